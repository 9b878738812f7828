# SPDX-License-Identifier: Apache-2.0
"""The sensor over UDP, to the last who asked for records."""

import socket

from ...wire.rdt import Command
from .simulated import SimulatedRig
from .sockets import bound

_AT_ONCE = 64  # requests read before anything else is done


class SensorServer:
    """``not_sent`` counts datagrams that this computer refused to send."""

    def __init__(self, rig: SimulatedRig, listen: str, port: int, say):
        self._rig, self._say = rig, say
        self.socket = bound(socket.SOCK_DGRAM, listen, port, "--sensor-port")
        self._other = bound(socket.SOCK_DGRAM, listen, 0, "--listen")
        self.port = self.socket.getsockname()[1]
        self._client, self.not_sent = None, 0

    def serve(self, ready: list, now: float) -> None:
        """Answer the requests that have come, and send the records that are due."""
        if self.socket in ready:
            self._receive(now)
        for datagram in self._rig.datagrams(now):
            try:
                (self._other if datagram.foreign else self.socket).sendto(datagram.data, self._client)
            except OSError:
                self.not_sent += 1

    def close(self) -> None:
        """Let go of both sockets."""
        self.socket.close()
        self._other.close()

    def _receive(self, now: float) -> None:
        for _ in range(_AT_ONCE):
            try:
                data, address = self.socket.recvfrom(64)
            except OSError:
                return
            self._do(now, data, address)

    def _do(self, now: float, data: bytes, address) -> None:
        command = self._rig.request(now, data, stops=address == self._client)
        if command in (Command.START, Command.START_BUFFERED):
            self._client = address
        if command is not None:
            self._say(f"sensor: {address[0]}:{address[1]} {command.name.lower().replace('_', ' ')}")
