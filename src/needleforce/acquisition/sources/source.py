# SPDX-License-Identifier: Apache-2.0
"""Interfaces of force sources and motion axes, and packets with the kernel's time of arrival."""

import contextlib
import socket
import struct
import sys
import time
from typing import NamedTuple, Protocol

from ...wire.axis_lines import Answer, AxisRange, AxisState

_LINUX = sys.platform == "linux"
_MAX_AGE = 60_000_000_000  # [ns] of a packet that was waiting; an older one is of a clock that was set
_STAMP = getattr(socket, "SO_TIMESTAMPNS", 35)  # its number on most Linux architectures
_OVERFLOW = getattr(socket, "SO_RXQ_OVFL", 40)
_TIMESPEC, _COUNT = struct.Struct("@ll"), struct.Struct("@I")
_ANCILLARY = socket.CMSG_SPACE(_TIMESPEC.size) + socket.CMSG_SPACE(_COUNT.size) if _LINUX else 0


class ForceSample(NamedTuple):
    """One reading of a force sensor.

    ``sequence`` is its unwrapped number. Times [ns]: ``device`` on the source's clock, ``arrival`` by the kernel's time
    stamp if there is one, ``read`` when the program read it; the last two are on the same clock. ``wrench`` [N, N m] is
    in the order of ``wire.rdt.AXES``. ``status`` is as in ``wire.rdt``, 0 for healthy. ``fresh`` is whether it is a new
    measurement by its counters: not repeated, not overtaken, and without a jump that no loss explains.
    """

    sequence: int
    device: int
    arrival: int
    read: int
    wrench: tuple[float, ...]
    status: int
    fresh: bool = True


class ForceSource(Protocol):
    """A source of force readings with the nominal rate ``clock_rate`` [Hz].

    Optional attributes: the counts ``foreign``, ``wrong_size``, ``stale``, ``restart`` and ``dropped``, which never
    decrease, and ``buffer`` [s], the time for which this computer holds unread readings.
    """

    clock_rate: float

    def start(self) -> None:
        """Start the stream. Raises InputError if the source cannot be reached."""

    def receive(self, timeout: float) -> list[ForceSample]:
        """The new readings after at most ``timeout`` [s], perhaps none; EOFError at the end of the source."""

    def stop(self) -> None:
        """End the stream and release its resources; never raises, may be called twice."""


class MotionAxis(Protocol):
    """A motion axis with its ``limits``, None for one that takes no commands. Depth is + inwards."""

    limits: AxisRange | None

    def receive(self) -> list[tuple[AxisState, int]]:
        """The states since the last call, each with its arrival by ``host_time_ns``; returns at once.

        Raises InputError if the axis is lost.
        """

    def move(self, depth: float, speed: float) -> None:
        """Send the tip to ``depth`` [m] at ``speed`` [m/s]; return when it is accepted. Raises InputError if not."""

    def send_move(self, depth: float, speed: float) -> None:
        """As ``move``, but return at once: a stop waits for it; ``answer`` has the result."""

    def answer(self, command: str) -> Answer | None:
        """The answer to the last command of this name, None until it arrives."""

    def site(self, number: int) -> None:
        """Go to the site ``number`` of the specimen, from 1. Raises InputError if the axis cannot."""

    def check_move(self, depth: float, speed: float) -> None:
        """Raise InputError for a move outside the limits."""

    def alive(self) -> None:
        """Let the axis continue."""

    def send_stop(self) -> None:
        """Send a stop and return at once."""

    def stop(self) -> bool:
        """Stop; whether the axis answered."""

    def close(self) -> None:
        """Close the connection."""


def _steady_ns() -> int:
    """A clock [ns] that nobody sets; on Linux it also counts the time in which the computer is suspended."""
    return time.clock_gettime_ns(time.CLOCK_BOOTTIME) if _LINUX else time.monotonic_ns()


_EPOCH = time.time_ns() - _steady_ns()


def host_time_ns() -> int:
    """Time [ns since 1970], read once when the program starts and continued by a clock that nobody sets."""
    return _EPOCH + _steady_ns()


def ask_for_stamps(receiver: socket.socket) -> bool:
    """Ask the kernel for time stamps of what ``receiver`` receives; False if it has none."""
    try:
        receiver.setsockopt(socket.SOL_SOCKET, _STAMP if _LINUX else -1, 1)
    except OSError:
        return False
    return True


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


def receive_stamped(receiver: socket.socket, size: int) -> Received:
    """The first packet in the buffer. Raises BlockingIOError if there is none."""
    if not _LINUX:
        data, sender = receiver.recvfrom(size)
        now = host_time_ns()
        return Received(data, now, now, sender)
    data, ancillary, _, sender = receiver.recvmsg(size, _ANCILLARY)
    now, age, dropped = host_time_ns(), 0, 0
    for level, kind, content in ancillary:
        if (level, kind, len(content)) == (socket.SOL_SOCKET, _STAMP, _TIMESPEC.size):
            seconds, nanoseconds = _TIMESPEC.unpack(content)
            age = time.time_ns() - (seconds * 1_000_000_000 + nanoseconds)
        elif (level, kind, len(content)) == (socket.SOL_SOCKET, _OVERFLOW, _COUNT.size):
            (dropped,) = _COUNT.unpack(content)
    return Received(data, now - age if 0 <= age <= _MAX_AGE else now, now, sender, dropped)
