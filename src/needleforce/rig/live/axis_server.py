# SPDX-License-Identifier: Apache-2.0
"""The axis over TCP: one client, lines in, answers and states out; nothing here waits."""

import socket
import struct

from ...wire.axis_lines import LONGEST, Answer, answer_line, state_line
from .simulated import SimulatedRig
from .sockets import bound

_MOST_WAITING = 1 << 16  # bytes a client may leave unread before it is let go
_ABORT = struct.pack("ii", 1, 0)


class AxisServer:
    """``sockets`` are those to be watched; ``say`` takes a line for each change."""

    def __init__(self, rig: SimulatedRig, listen: str, port: int, say):
        self._rig, self._say = rig, say
        self._listening = bound(socket.SOCK_STREAM, listen, port, "--axis-port")
        self._listening.listen(4)
        self.port = self._listening.getsockname()[1]
        self._client: socket.socket | None = None
        self._read, self._waiting = b"", b""

    @property
    def sockets(self) -> list[socket.socket]:
        """What may have something to read."""
        return [self._listening] + ([self._client] if self._client else [])

    def heard(self, ready: list, now: float) -> None:
        """A client that has said something by ``now`` is not silent, however late the rig comes to read it."""
        if self._client in ready and now < self._rig.faults["axis_silent_at_s"]:
            self._rig.axis.heard(now)

    def serve(self, ready: list, now: float) -> None:
        """Read what has come, answer it, and send the states that are due."""
        if self._client is not None and self._client in ready:
            self._receive(now)
        if self._listening in ready:
            self._accept(now)
        states = self._rig.states()
        if self._client and states:
            self._tell(now, *map(state_line, states))

    def close(self, abruptly: bool = False) -> None:
        """Let go of all sockets; ``abruptly`` as by a power cut."""
        for each in self.sockets:
            if abruptly:
                each.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _ABORT)
            each.close()
        self._client = None

    def _accept(self, now: float) -> None:
        try:
            client, address = self._listening.accept()
        except OSError:
            return  # gone again
        client.setblocking(False)
        if self._client:
            self._say(f"axis: {address[0]}:{address[1]} refused, another client has it")
            _last_word(client, answer_line(Answer("connection", False, "another client has the axis")))
            return
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._client, self._read, self._waiting = client, b"", b""
        self._say(f"axis: {address[0]}:{address[1]} connected")
        self._rig.axis.heard(now)
        self._tell(now, self._rig.greeting)

    def _receive(self, now: float) -> None:
        try:
            data = self._client.recv(1 << 14)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self._gone(now)
            return
        *lines, self._read = (self._read + data).split(b"\n")
        for line in lines:
            if self._client:
                self._do(now, line)
        if self._client and len(self._read) > LONGEST:
            self._tell(now, answer_line(Answer("line", False, "too long")))
            self._gone(now)

    def _do(self, now: float, line: bytes) -> None:
        text = line.rstrip(b"\r").decode("ascii", "replace")[:LONGEST]
        answer = self._rig.command(now, text)
        if answer is None:
            return
        if text != "alive" and not answer.startswith("refused line"):
            self._say(f"axis: {text}: {answer}")
        self._tell(now, answer)

    def _tell(self, now: float, *lines: str) -> None:
        if now >= self._rig.faults["axis_silent_at_s"]:
            return
        self._waiting += "".join(f"{line}\n" for line in lines).encode()
        try:
            self._waiting = self._waiting[self._client.send(self._waiting) :]
        except BlockingIOError:
            pass
        except OSError:
            self._gone(now)
        if self._client and len(self._waiting) > _MOST_WAITING:
            self._gone(now)

    def _gone(self, now: float) -> None:
        self._client.close()
        self._client = None
        self._rig.axis.gone(now)
        self._say("axis: client gone, stopping")


def _last_word(client: socket.socket, line: str) -> None:
    try:
        client.send(f"{line}\n".encode())
    except OSError:
        pass
    client.close()
