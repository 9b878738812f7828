# SPDX-License-Identifier: Apache-2.0
"""Time of arrival of what a socket receives, on a clock that nobody sets."""

import contextlib
import socket
import struct
import sys
import time
from typing import NamedTuple

_LINUX = sys.platform == "linux"
_MAX_AGE = 60_000_000_000  # [ns] of a packet that was waiting; an older one is of a clock that was set
_STAMP = getattr(socket, "SO_TIMESTAMPNS", 35)  # its number on most Linux architectures
_OVERFLOW = getattr(socket, "SO_RXQ_OVFL", 40)
_TIMESPEC, _COUNT = struct.Struct("@ll"), struct.Struct("@I")
_ANCILLARY = socket.CMSG_SPACE(_TIMESPEC.size) + socket.CMSG_SPACE(_COUNT.size) if _LINUX else 0


def _steady_ns() -> int:
    """A clock [ns] that nobody sets; on Linux it also counts the time in which the computer is suspended, on Windows it
    is the only one with steps below 16 ms."""
    return time.clock_gettime_ns(time.CLOCK_BOOTTIME) if _LINUX else time.perf_counter_ns()


_EPOCH = time.time_ns() - _steady_ns()


def host_time_ns() -> int:
    """Time [ns since 1970], read once when the program starts and continued by a clock that nobody sets."""
    return _EPOCH + _steady_ns()


def ask_for_drops(receiver: socket.socket) -> None:
    """Ask the kernel to count the packets that it drops because its buffer is full."""
    with contextlib.suppress(OSError):
        receiver.setsockopt(socket.SOL_SOCKET, _OVERFLOW if _LINUX else -1, 1)


class Received(NamedTuple):
    """Data, arrival and reading by ``host_time_ns`` [ns], the sender, and the packets dropped on this socket so far."""

    data: bytes
    arrival: int
    read: int
    sender: tuple
    dropped: int = 0


class _WallClock:
    """What the wall clock, by which the kernel stamps packets, is ahead of ``host_time_ns``.

    It changes only when somebody sets the clock. Two clocks are never read at once, so that each reading gives a range:
    the difference stays what it was as long as it is inside. A program that is interrupted between the readings gets a
    wide range, not another difference.
    """

    def __init__(self) -> None:
        self._ahead = 0  # host_time_ns is the wall clock until somebody sets it

    def ahead(self) -> int:
        """The difference now [ns]."""
        before, wall, after = host_time_ns(), time.time_ns(), host_time_ns()
        low, high = wall - after, wall - before
        self._ahead = min(max(self._ahead, low), high)
        return self._ahead


class StampedSocket:
    """What a socket receives, with its times; on Linux by the kernel's stamps.

    ``arrival`` never decreases: the kernel hands packets out in the order in which they came.
    """

    def __init__(self, receiver: socket.socket) -> None:
        self._socket, self._clock, self._latest = receiver, _WallClock(), 0
        with contextlib.suppress(OSError):  # a kernel without stamps
            receiver.setsockopt(socket.SOL_SOCKET, _STAMP if _LINUX else -1, 1)

    def receive(self, size: int) -> Received:
        """The first packet, or the next bytes. Raises BlockingIOError if the socket does not wait and has none."""
        if not _LINUX:
            data, sender = self._socket.recvfrom(size)
            now = host_time_ns()
            return Received(data, now, now, sender)
        data, ancillary, _, sender = self._socket.recvmsg(size, _ANCILLARY)
        now, stamp, dropped = host_time_ns(), None, 0
        for level, kind, content in ancillary:
            if (level, kind, len(content)) == (socket.SOL_SOCKET, _STAMP, _TIMESPEC.size):
                seconds, nanoseconds = _TIMESPEC.unpack(content)
                stamp = seconds * 1_000_000_000 + nanoseconds
            elif (level, kind, len(content)) == (socket.SOL_SOCKET, _OVERFLOW, _COUNT.size):
                (dropped,) = _COUNT.unpack(content)
        return Received(data, self._arrival(stamp, now), now, sender, dropped)

    def _arrival(self, stamp: int | None, now: int) -> int:
        arrival = now if stamp is None else stamp - self._clock.ahead()
        if not now - _MAX_AGE <= arrival <= now:  # the clock was set while the packet waited
            arrival = now
        self._latest = max(self._latest, arrival)
        return self._latest
