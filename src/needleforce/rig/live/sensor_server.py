# SPDX-License-Identifier: Apache-2.0
"""The sensor over UDP, to the last who asked, and its configuration page over HTTP."""

import socket
import threading
from http.server import BaseHTTPRequestHandler, HTTPServer

from ...wire.rdt import Command
from ...wire.sensor_configuration import PAGE, SensorConfiguration
from .simulated import SimulatedRig
from .sockets import bound, check_port, refused

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


class PageServer:
    """The page ``netftapi2.xml`` and nothing else, in a thread of its own that ``close`` ends."""

    def __init__(self, configuration: SensorConfiguration, listen: str, port: int):
        check_port(port, "--page-port")
        page = configuration.xml()

        class Handler(BaseHTTPRequestHandler):
            timeout = 2.0  # [s] for a client that says nothing

            def do_GET(self):
                self.send_response(200 if self.path == f"/{PAGE}" else 404)
                body = page if self.path == f"/{PAGE}" else b""
                self.send_header("Content-Type", "text/xml")
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body)

            def log_message(self, *_):
                pass

        try:
            self._server = _Quiet((listen, port), Handler)
        except OSError as error:
            raise refused(error, listen, port, "--page-port") from None
        self.port = self._server.server_address[1]
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.1,), daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread and let go of the socket."""
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()


class _Quiet(HTTPServer):
    def server_bind(self):
        """As it is, without asking a name server who this computer is."""
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.socket.bind(self.server_address)
        self.server_address = self.socket.getsockname()
        self.server_name, self.server_port = self.server_address

    def handle_error(self, *_):
        """A client that goes away in the middle is no news."""
