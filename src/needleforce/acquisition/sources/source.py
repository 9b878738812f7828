# SPDX-License-Identifier: Apache-2.0
"""What a force source gives the recorder, whatever it is, and when each packet arrived by the kernel's clock."""

import contextlib
import socket
import struct
import sys
import time
from typing import NamedTuple, Protocol

_LINUX = sys.platform == "linux"
_STAMP = getattr(socket, "SO_TIMESTAMPNS", 35)  # the number of most Linux architectures
_OVERFLOW = getattr(socket, "SO_RXQ_OVFL", 40)
_TIMESPEC, _COUNT = struct.Struct("@ll"), struct.Struct("@I")
_ANCILLARY = socket.CMSG_SPACE(_TIMESPEC.size) + socket.CMSG_SPACE(_COUNT.size) if _LINUX else 0


class ForceSample(NamedTuple):
    """One reading: its number, unwrapped; the source's own clock, arrival and when the program had it [ns]; six of
    N and N m in the order of ``wire.rdt.AXES``; a status as in ``wire.rdt``, 0 for healthy.

    ``arrival`` is by the kernel's stamp where there is one, of the same clock as ``read``.
    """

    sequence: int
    device: int
    arrival: int
    read: int
    wrench: tuple[float, ...]
    status: int


class ForceSource(Protocol):
    """``clock_rate`` is readings a second [Hz], nominal.

    A source that can tell has also the counts ``foreign``, ``wrong_size``, ``stale``, ``restart`` and ``dropped``,
    which only grow, and ``buffer`` [s], how long this computer keeps what waits.
    """

    clock_rate: float

    def start(self) -> None:
        """Begin to send. Raises InputError for what cannot be reached."""

    def receive(self, timeout: float) -> list[ForceSample]:
        """What came, after at most ``timeout`` [s]; empty if nothing did. EOFError if nothing more can come."""

    def stop(self) -> None:
        """End the stream and give back what it holds; never raises, may be called twice."""


def ask_for_stamps(receiver: socket.socket) -> bool:
    """Ask the kernel to stamp what ``receiver`` gets; False where it does not know how."""
    try:
        receiver.setsockopt(socket.SOL_SOCKET, _STAMP if _LINUX else -1, 1)
    except OSError:
        return False
    return True


def ask_for_drops(receiver: socket.socket) -> None:
    """Ask the kernel to tell how many packets found its buffer full."""
    with contextlib.suppress(OSError):
        receiver.setsockopt(socket.SOL_SOCKET, _OVERFLOW if _LINUX else -1, 1)


class Received(NamedTuple):
    """Data, arrival and reading [ns since 1970], the sender, and what the kernel dropped of this socket so far."""

    data: bytes
    arrival: int
    read: int
    sender: tuple
    dropped: int = 0


def receive_stamped(receiver: socket.socket, size: int) -> Received:
    """What came first. Raises BlockingIOError where nothing waits."""
    if not _LINUX:
        data, sender = receiver.recvfrom(size)
        now = time.time_ns()
        return Received(data, now, now, sender)
    data, ancillary, _, sender = receiver.recvmsg(size, _ANCILLARY)
    now = arrival = time.time_ns()
    dropped = 0
    for level, kind, content in ancillary:
        if (level, kind, len(content)) == (socket.SOL_SOCKET, _STAMP, _TIMESPEC.size):
            seconds, nanoseconds = _TIMESPEC.unpack(content)
            arrival = seconds * 1_000_000_000 + nanoseconds
        elif (level, kind, len(content)) == (socket.SOL_SOCKET, _OVERFLOW, _COUNT.size):
            (dropped,) = _COUNT.unpack(content)
    return Received(data, arrival, now, sender, dropped)
