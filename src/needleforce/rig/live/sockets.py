# SPDX-License-Identifier: Apache-2.0
"""Sockets of the rig, bound or refused in words."""

import errno
import socket

from ...errors import InputError

LARGE = 1 << 20  # bytes of a buffer: a rig that wakes up late loses nothing


def bound(kind: socket.SocketKind, listen: str, port: int, option: str) -> socket.socket:
    """A socket that does not block, bound to ``port`` of ``listen``, 0 for any free one. Raises InputError."""
    check_port(port, option)
    made = socket.socket(socket.AF_INET, kind)
    try:
        if kind == socket.SOCK_STREAM:
            made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # a port of a rig that has just ended
        made.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, LARGE)
        made.bind((listen, port))
        made.setblocking(False)
    except OSError as error:
        made.close()
        raise refused(error, listen, port, option) from None
    return made


def check_port(port: int, option: str) -> None:
    """Raises InputError, naming the option, for what is no port."""
    if not 0 <= port <= 65_535:
        raise InputError(option, port, "outside 0 to 65535")


def refused(error: OSError, listen: str, port: int, option: str) -> InputError:
    """Why there is no socket at that address, and which option gives another."""
    if error.errno == errno.EADDRINUSE:
        return InputError(option, port, "in use", listen, "Give another port, or 0 for any free one.")
    return InputError(option, port, error.strerror or str(error), listen, "Check the address to listen at.")
