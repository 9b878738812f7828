# SPDX-License-Identifier: Apache-2.0
"""When the kernel had a packet, where it says so; else when the program had it."""

import socket
import struct
import sys
import time

_LINUX = sys.platform == "linux"
_STAMP = getattr(socket, "SO_TIMESTAMPNS", 35)  # the number of most Linux architectures
_TIMESPEC = struct.Struct("@ll")
_ANCILLARY = socket.CMSG_SPACE(_TIMESPEC.size) if _LINUX else 0


def ask_for_stamps(receiver: socket.socket) -> bool:
    """Ask the kernel to stamp what ``receiver`` gets; False where it does not know how."""
    try:
        receiver.setsockopt(socket.SOL_SOCKET, _STAMP if _LINUX else -1, 1)
    except OSError:
        return False
    return True


def receive_stamped(receiver: socket.socket, size: int) -> tuple[bytes, int, int, tuple]:
    """Data, arrival and reading [ns since 1970], sender. Raises BlockingIOError where nothing waits."""
    if not _LINUX:
        data, sender = receiver.recvfrom(size)
        now = time.time_ns()
        return data, now, now, sender
    data, ancillary, _, sender = receiver.recvmsg(size, _ANCILLARY)
    now = time.time_ns()
    for level, kind, stamp in ancillary:
        if level == socket.SOL_SOCKET and kind == _STAMP and len(stamp) == _TIMESPEC.size:
            seconds, nanoseconds = _TIMESPEC.unpack(stamp)
            return data, seconds * 1_000_000_000 + nanoseconds, now, sender
    return data, now, now, sender
