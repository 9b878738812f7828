# SPDX-License-Identifier: Apache-2.0
"""Raw data transfer (RDT) of an ATI Net F/T sensor: requests of 8 bytes, records of 36, big-endian, over UDP.

A datagram holds one record, or several in buffered streaming. ``sequence`` counts the records sent and ``sample`` the
sensor's own readings (``ft_sequence``), which are faster; both wrap at 2^32.
"""

import struct
from enum import IntEnum
from typing import NamedTuple

from ..errors import InputError

PORT = 49152
AXES = ("fx", "fy", "fz", "tx", "ty", "tz")
_HEADER = 0x1234
_REQUEST = struct.Struct(">HHI")
_RECORD = struct.Struct(">3I6i")
RECORD_SIZE = _RECORD.size
_SATURATED_BIT, _SERIAL_LINK_BIT = 17, 27
SUMMARY = 1 << 31  # set together with any other bit
SATURATED = 1 << _SATURATED_BIT  # a gauge is at the end of its range
LINK_FAILED = 1 << _SERIAL_LINK_BIT
# meaning of the status bits of this sensor family
_STATUS = {
    30: "processor or memory error",
    29: "digital board error",
    28: "analog board error",
    _SERIAL_LINK_BIT: "serial link error",
    26: "program memory error",
    25: "halted by its configuration",
    24: "settings not valid",
    23: "configuration does not fit the calibration",
    22: "network failure",
    21: "CAN failure",
    20: "RDT failure",
    _SATURATED_BIT: "saturated, or a fault of the converter",
    16: "a monitored condition was met",
    2: "temperature out of range",
}
_NO_FAULT = 1 << 16 | SUMMARY  # a monitored condition


class Command(IntEnum):
    """Command of a request."""

    STOP = 0
    START = 2
    START_BUFFERED = 3
    BIAS = 0x42


class Packet(NamedTuple):
    """One record: two counters, a status of 32 bits, and six counts in the order of ``AXES``."""

    sequence: int
    sample: int
    status: int
    counts: tuple[int, ...]


def pack_request(command: Command, count: int = 0) -> bytes:
    """The 8 bytes of a request for ``count`` records, 0 for no end."""
    return _REQUEST.pack(_HEADER, command, count)


def unpack_request(data: bytes) -> tuple[Command, int]:
    """Command and count of a request. Raises InputError for an invalid request."""
    if len(data) != _REQUEST.size:
        raise InputError("request", f"{len(data)} bytes", f"{_REQUEST.size} are needed")
    header, command, count = _REQUEST.unpack(data)
    if header != _HEADER or command not in list(Command):
        raise InputError("request", data.hex(), f"not {_HEADER:#06x} followed by a known command")
    return Command(command), count


def pack_record(packet: Packet) -> bytes:
    """The 36 bytes of a record; counters are taken modulo 2^32."""
    return _RECORD.pack(packet.sequence & 0xFFFFFFFF, packet.sample & 0xFFFFFFFF, packet.status, *packet.counts)


def unpack_records(data: bytes) -> list[Packet]:
    """The records of one datagram. Raises InputError for a size of zero or that is not a multiple of 36."""
    if not data or len(data) % RECORD_SIZE:
        raise InputError("datagram", f"{len(data)} bytes", f"a multiple of {RECORD_SIZE} is needed")
    return [Packet(a, b, c, tuple(counts)) for a, b, c, *counts in _RECORD.iter_unpack(data)]


def is_fault(status: int) -> bool:
    """Whether a status means that the counts of its record are invalid."""
    return status & ~_NO_FAULT != 0


def status_words(status: int) -> str:
    """A status in words; unknown bits are given as a number."""
    words = [word for bit, word in _STATUS.items() if status >> bit & 1]
    rest = status & ~SUMMARY & ~sum(1 << bit for bit in _STATUS)
    if rest or (status and not words):
        words.append(f"bits {rest or status:#010x}")
    return ", ".join(words) or "healthy"
