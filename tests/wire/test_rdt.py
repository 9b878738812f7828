"""Packets of the sensor against bytes written by hand from the published layout."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from needleforce import InputError
from needleforce.wire.net_ft import (
    Command,
    Packet,
    is_fault,
    pack_record,
    pack_request,
    status_words,
    unpack_records,
    unpack_request,
)

RECORD = bytes.fromhex(
    "00000007 00000031 00000000 00000001 ffffffff 000f4240 00000000 80000000 7fffffff".replace(" ", "")
)
PACKET = Packet(7, 49, 0, (1, -1, 1_000_000, 0, -(2**31), 2**31 - 1))


def test_a_request_has_the_published_bytes():
    assert pack_request(Command.START) == bytes.fromhex("1234000200000000")
    assert pack_request(Command.STOP) == bytes.fromhex("1234000000000000")
    assert unpack_request(bytes.fromhex("1234000300000005")) == (Command.START_BUFFERED, 5)


def test_a_record_has_the_published_bytes():
    assert pack_record(PACKET) == RECORD
    assert unpack_records(RECORD) == [PACKET]
    assert unpack_records(3 * RECORD) == 3 * [PACKET]


def test_counters_wrap_at_32_bits():
    assert unpack_records(pack_record(PACKET._replace(sequence=2**32 + 5)))[0].sequence == 5


@pytest.mark.parametrize("size", [0, 1, 35, 37, 71, 1500])
def test_a_datagram_of_the_wrong_size_is_refused(size):
    with pytest.raises(InputError, match=f"{size} bytes, a multiple of 36"):
        unpack_records(bytes(size))


@pytest.mark.parametrize("data", ["1234000200", "4321000200000000", "1234007700000000"])
def test_invalid_requests_are_refused(data):
    with pytest.raises(InputError, match="request"):
        unpack_request(bytes.fromhex(data))


@given(st.binary(max_size=200))
def test_any_bytes_are_read_or_refused(data):
    try:
        packets = unpack_records(data)
    except InputError:
        assert not data or len(data) % 36
    else:
        assert b"".join(map(pack_record, packets)) == data


def test_a_status_is_described_and_classified():
    assert status_words(0) == "healthy"
    assert "saturated" in status_words(0x80020000)
    assert status_words(0x00000001) == "bits 0x00000001"
    assert is_fault(0x80020000)
    assert not is_fault(0)
    assert not is_fault(0x80010000)  # a threshold set by the user, not a fault of the sensor
