# SPDX-License-Identifier: Apache-2.0
"""The sensor's configuration page over HTTP: that page and nothing else; nothing here waits, or grows."""

import socket
from contextlib import suppress

from ...wire.sensor_configuration import PAGE, SensorConfiguration
from .sockets import bound

_LONGEST = 8192  # bytes of a request
_MOST = 8  # clients at a time; one more, and the first is let go
_END = b"\r\n\r\n"


class PageServer:
    """``sockets`` are those to be watched."""

    def __init__(self, configuration: SensorConfiguration, listen: str, port: int):
        self._page = configuration.xml()
        self._listening = bound(socket.SOCK_STREAM, listen, port, "--page-port")
        self._listening.listen(64)
        self.port = self._listening.getsockname()[1]
        self._clients: dict[socket.socket, bytes] = {}

    @property
    def sockets(self) -> list[socket.socket]:
        """What may have something to read."""
        return [self._listening, *self._clients]

    def serve(self, ready: list) -> None:
        """Read what has come, and answer what is complete."""
        for client in [each for each in self._clients if each in ready]:
            self._receive(client)
        if self._listening in ready:
            with suppress(OSError):  # gone again
                client, _ = self._listening.accept()
                client.setblocking(False)
                self._clients[client] = b""
        if len(self._clients) > _MOST:
            self._let_go(next(iter(self._clients)))

    def close(self) -> None:
        """Let go of all sockets."""
        for each in self.sockets:
            each.close()
        self._clients = {}

    def _receive(self, client: socket.socket) -> None:
        with suppress(OSError):
            data = client.recv(_LONGEST)
            self._clients[client] += data
            request = self._clients[client]
            if data and _END not in request and len(request) <= _LONGEST:
                return
            if _END in request:
                client.send(self._answer(request))
        self._let_go(client)

    def _answer(self, request: bytes) -> bytes:
        method, _, rest = request.partition(b" ")
        found = method == b"GET" and rest.partition(b" ")[0] == f"/{PAGE}".encode()
        status, page = ("200 OK", self._page) if found else ("404 Not Found", b"")
        head = (
            f"HTTP/1.1 {status}\r\nContent-Type: text/xml\r\nContent-Length: {len(page)}\r\nConnection: close\r\n\r\n"
        )
        return head.encode() + page

    def _let_go(self, client: socket.socket) -> None:
        del self._clients[client]
        client.close()
