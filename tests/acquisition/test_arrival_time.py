# SPDX-License-Identifier: Apache-2.0
"""Times of arrival against the times around sending: on a loopback a packet arrives before ``send`` returns."""

import itertools
import socket
import sys
import time

import pytest

from needleforce.acquisition.sources.arrival_time import StampedSocket, host_time_ns

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="stamps of the kernel are read on Linux")
_PAIRED = 100_000  # [ns] within which two clocks are read one after the other


@pytest.fixture
def pair():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.setblocking(False)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.connect(receiver.getsockname())
            yield sender, StampedSocket(receiver)


def sent(sender, number):
    before = host_time_ns()
    sender.send(b"%d" % number)
    return before, host_time_ns()


def test_an_interruption_between_two_clocks_moves_no_time_stamp(pair, monkeypatch):
    sender, receiver = pair
    wall, calls = time.time_ns, itertools.count()
    delay = lambda: time.sleep(5e-3 * (next(calls) % 3 == 1))  # noqa: E731
    monkeypatch.setattr(time, "time_ns", lambda: (delay(), wall(), delay())[1])
    times = [sent(sender, number) for number in range(30)]
    arrivals = [receiver.receive(64).arrival for _ in times]
    assert arrivals == sorted(arrivals)
    for (before, after), arrival in zip(times, arrivals):
        assert before - _PAIRED <= arrival <= after + _PAIRED


@pytest.mark.parametrize("by", [-3600.0, -0.01, 0.01, 30.0, 3600.0])
def test_a_clock_that_is_set_while_packets_wait_keeps_their_order(pair, monkeypatch, by):
    sender, receiver = pair
    times = [sent(sender, number) for number in range(6)]
    arrivals = [receiver.receive(64).arrival for _ in range(3)]
    wall = time.time_ns
    monkeypatch.setattr(time, "time_ns", lambda: wall() + round(1e9 * by))
    received = [receiver.receive(64) for _ in range(3)]
    arrivals += [each.arrival for each in received]
    assert arrivals == sorted(arrivals) and all(each.arrival <= each.read for each in received)
    assert arrivals[0] >= times[0][0] - _PAIRED


def test_an_empty_buffer_and_a_packet_that_is_cut_are_as_with_a_socket(pair):
    sender, receiver = pair
    with pytest.raises(BlockingIOError):
        receiver.receive(64)
    sender.send(b"0123456789")
    received = receiver.receive(4)
    assert received.data == b"0123" and received.sender == sender.getsockname() and received.dropped == 0
