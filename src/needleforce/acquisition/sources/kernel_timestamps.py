# SPDX-License-Identifier: Apache-2.0
"""When the kernel had a packet, and how many it had to drop, where it says so; else when the program had it."""

import contextlib
import socket
import struct
import sys
import time
from typing import NamedTuple

_LINUX = sys.platform == "linux"
_STAMP = getattr(socket, "SO_TIMESTAMPNS", 35)  # the number of most Linux architectures
_OVERFLOW = getattr(socket, "SO_RXQ_OVFL", 40)
_TIMESPEC, _COUNT = struct.Struct("@ll"), struct.Struct("@I")
_ANCILLARY = socket.CMSG_SPACE(_TIMESPEC.size) + socket.CMSG_SPACE(_COUNT.size) if _LINUX else 0


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
