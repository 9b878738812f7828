# SPDX-License-Identifier: Apache-2.0
"""Times of arrival by a kernel's stamps: on clocks that a test sets, and on a loopback."""

import itertools
import socket
import struct
import sys
import time

import pytest

from needleforce.acquisition.sources import arrival_time
from needleforce.acquisition.sources.arrival_time import StampedSocket

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="stamps of the kernel are read on Linux")
_MS = 1_000_000  # [ns]
_READING = 100  # [ns] that reading a clock takes here


class Kernel:
    """A socket whose packets, a millisecond apart, have waited for a second when the first of them is read."""

    def __init__(self, monkeypatch):
        self.now = time.clock_gettime_ns(time.CLOCK_BOOTTIME)
        self.set_by, self.interruptions = 0, itertools.repeat(0)
        monkeypatch.setattr(time, "clock_gettime_ns", lambda clock: self.read())
        monkeypatch.setattr(time, "time_ns", self.wall)
        self.sent = [arrival_time._EPOCH + self.now + k * _MS for k in range(30)]
        self.now += 1000 * _MS
        self.waiting = iter(self.sent)

    def read(self):
        self.now += _READING
        return self.now

    def wall(self):
        self.now += next(self.interruptions)
        stamp = arrival_time._EPOCH + self.read() + self.set_by
        self.now += next(self.interruptions)
        return stamp

    def setsockopt(self, *_):
        pass

    def recvmsg(self, *_):
        stamp = struct.pack("@ll", *divmod(next(self.waiting) + self.set_by, 10**9))
        return b"1", [(socket.SOL_SOCKET, arrival_time._STAMP, stamp)], 0, ("127.0.0.1", 1)


@pytest.fixture
def kernel(monkeypatch):
    return Kernel(monkeypatch)


@pytest.mark.parametrize("interrupted", [0, 1, 2])
def test_an_interruption_between_two_clocks_moves_no_time_stamp(kernel, interrupted):
    kernel.interruptions = (5 * _MS * (k % 3 == interrupted) for k in itertools.count())
    receiver = StampedSocket(kernel)
    arrivals = [receiver.receive(64).arrival for _ in kernel.sent]
    assert max(abs(a - b) for a, b in zip(arrivals, kernel.sent)) <= 2 * _READING


@pytest.mark.parametrize("by", [-3600.0, -0.01, 0.01, 30.0, 3600.0])
def test_a_clock_that_is_set_while_packets_wait_keeps_their_order(kernel, by):
    receiver = StampedSocket(kernel)
    received = [receiver.receive(64) for _ in range(3)]
    stamps = iter([stamp - round(1e9 * by) for stamp in kernel.sent[3:]])  # of the clock before it was set
    kernel.set_by, kernel.waiting = round(1e9 * by), stamps
    received += [receiver.receive(64) for _ in range(3)]
    arrivals = [each.arrival for each in received]
    assert arrivals == sorted(arrivals) and all(each.arrival <= each.read for each in received)
    assert max(abs(a - b) for a, b in zip(arrivals[:3], kernel.sent)) <= 2 * _READING


@pytest.fixture
def pair():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.setblocking(False)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.connect(receiver.getsockname())
            stamped = StampedSocket(receiver)
            for _ in range(500):  # on a busy computer Linux begins to stamp a little after it was asked to
                sender.send(b"0")
                time.sleep(0.005)
                first = stamped.receive(64)
                if first.arrival < first.read - 4 * _MS:
                    break
            yield sender, stamped


def test_a_packet_that_waits_keeps_the_time_at_which_it_came(pair):
    sender, receiver = pair
    for _ in range(3):
        sender.send(b"1")
    time.sleep(0.1)
    received = [receiver.receive(64) for _ in range(3)]
    assert all(each.read - each.arrival > 50 * _MS for each in received)


def test_an_empty_buffer_and_a_packet_that_is_cut_are_as_with_a_socket(pair):
    sender, receiver = pair
    with pytest.raises(BlockingIOError):
        receiver.receive(64)
    sender.send(b"0123456789")
    received = receiver.receive(4)
    assert received.data == b"0123" and received.sender == sender.getsockname() and received.dropped == 0


def test_without_stamps_of_the_kernel_a_packet_arrives_when_it_is_read(pair, monkeypatch):
    monkeypatch.setattr(arrival_time, "_LINUX", False)
    sender, receiver = pair[0], StampedSocket(pair[1]._socket)
    arrival_time.ask_for_drops(pair[1]._socket)
    for _ in range(2):
        sender.send(b"1")
    first, second = receiver.receive(64), receiver.receive(64)
    assert first.arrival == first.read <= second.arrival == second.read
    assert first.sender == sender.getsockname() and second.dropped == 0
    with pytest.raises(BlockingIOError):
        receiver.receive(64)
