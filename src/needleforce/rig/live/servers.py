# SPDX-License-Identifier: Apache-2.0
"""The rig on the network: the simulated rig in real time with its servers, axis over TCP, sensor over UDP, and its
configuration page over HTTP; no server waits."""

import errno
import os
import select
import socket
import struct
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import ExitStack, suppress

from ...checks import within
from ...errors import InputError
from ...models.model import Model
from ...wire.axis_lines import MAX_LINE_LENGTH, Answer, answer_line, state_line
from ...wire.net_ft import PAGE, Command, SensorConfiguration
from ..sensor import Sensor
from .simulated import LiveTruth, SimulatedRig

_MAX_UNREAD_BYTES = 1 << 16  # that a client may leave before it is disconnected
_ABORT = struct.pack("ii" if os.name == "posix" else "hh", 1, 0)
_MAX_REQUESTS = 64  # read in one call
_MAX_REQUEST_BYTES = 8192
_MAX_CLIENTS = 8  # with one more, the first is disconnected
_REQUEST_END = b"\r\n\r\n"
BUFFER_BYTES = 1 << 20  # large enough that nothing is lost when the rig wakes up late
# the sensor's period while it streams, otherwise often enough for the axis' states
_STREAMING_INTERVAL_S, _IDLE_INTERVAL_S = 1e-3, 8e-3


class AxisServer:
    """Server of the axis for one client; ``say`` is called with a line for each change."""

    def __init__(self, rig: SimulatedRig, listen: str, port: int, say: Callable[[str], None]):
        self._rig, self._say = rig, say
        self._listening = bound(socket.SOCK_STREAM, listen, port, "--axis-port")
        self._listening.listen(4)
        self.port = self._listening.getsockname()[1]
        self._client: socket.socket | None = None
        self._read, self._waiting = b"", b""

    @property
    def sockets(self) -> list[socket.socket]:
        """The sockets that may have data to read."""
        return [self._listening] + ([self._client] if self._client else [])

    def note_activity(self, ready: list, now: float) -> None:
        """Note that a client with data to read at ``now`` is not silent, even if the rig reads them later."""
        if self._client in ready and now < self._rig.faults["axis_silent_at_s"]:
            self._rig.axis.client_active(now)

    def serve(self, ready: list, now: float) -> None:
        """Read and answer commands, and send the states that are due."""
        if self._client is not None and self._client in ready:
            self._receive(now)
        if self._listening in ready:
            self._accept(now)
        states = self._rig.states()
        if self._client and states:
            self._send(now, *map(state_line, states))

    def close(self, abruptly: bool = False) -> None:
        """Close all sockets; ``abruptly`` as by a power cut."""
        for each in self.sockets:
            if abruptly:
                each.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _ABORT)
            each.close()
        self._client = None

    def _accept(self, now: float) -> None:
        try:
            client, address = self._listening.accept()
        except OSError:
            return  # already disconnected
        client.setblocking(False)
        if self._client:
            self._say(f"axis: {address[0]}:{address[1]} refused, another client has it")
            with suppress(OSError):
                client.send(f"{answer_line(Answer('connection', False, 'another client has the axis'))}\n".encode())
            client.close()
            return
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._client, self._read, self._waiting = client, b"", b""
        self._say(f"axis: {address[0]}:{address[1]} connected")
        self._rig.axis.client_active(now)
        self._send(now, self._rig.greeting)

    def _receive(self, now: float) -> None:
        try:
            data = self._client.recv(1 << 14)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            self._disconnect(now)
            return
        *lines, self._read = (self._read + data).split(b"\n")
        for line in lines:
            if self._client:
                self._execute(now, line)
        if self._client and len(self._read) > MAX_LINE_LENGTH:
            self._send(now, answer_line(Answer("line", False, "too long")))
            self._disconnect(now)

    def _execute(self, now: float, line: bytes) -> None:
        text = line.rstrip(b"\r").decode("ascii", "replace")[:MAX_LINE_LENGTH]
        answer = self._rig.command(now, text)
        if answer is None:
            return
        if text != "alive" and not answer.startswith("refused line"):
            self._say(f"axis: {text}: {answer}")
        self._send(now, answer)

    def _send(self, now: float, *lines: str) -> None:
        if now >= self._rig.faults["axis_silent_at_s"]:
            return
        self._waiting += "".join(f"{line}\n" for line in lines).encode()
        try:
            self._waiting = self._waiting[self._client.send(self._waiting) :]
        except BlockingIOError:
            pass
        except OSError:
            self._disconnect(now)
        if self._client and len(self._waiting) > _MAX_UNREAD_BYTES:
            self._disconnect(now)

    def _disconnect(self, now: float) -> None:
        self._client.close()
        self._client = None
        self._rig.axis.client_lost(now)
        self._say("axis: client disconnected, stopping")


class SensorServer:
    """Server of the sensor; ``not_sent`` counts datagrams that this computer refused to send."""

    def __init__(self, rig: SimulatedRig, listen: str, port: int, say: Callable[[str], None]):
        self._rig, self._say = rig, say
        self.socket = bound(socket.SOCK_DGRAM, listen, port, "--sensor-port")
        self._foreign_socket = bound(socket.SOCK_DGRAM, listen, 0, "--listen")
        self.port = self.socket.getsockname()[1]
        self._client, self.not_sent = None, 0

    def serve(self, ready: list, now: float) -> None:
        """Execute requests, and send the records that are due."""
        if self.socket in ready:
            self._receive(now)
        for datagram in self._rig.datagrams(now):
            try:
                (self._foreign_socket if datagram.foreign else self.socket).sendto(datagram.data, self._client)
            except OSError:
                self.not_sent += 1

    def close(self) -> None:
        """Close both sockets."""
        self.socket.close()
        self._foreign_socket.close()

    def _receive(self, now: float) -> None:
        for _ in range(_MAX_REQUESTS):
            try:
                data, address = self.socket.recvfrom(64)
            except OSError:
                return
            command = self._rig.request(now, data, stops=address == self._client)
            if command in (Command.START, Command.START_BUFFERED):
                self._client = address
            if command is not None:
                self._say(f"sensor: {address[0]}:{address[1]} {command.name.lower().replace('_', ' ')}")


class PageServer:
    """Server of the configuration page."""

    def __init__(self, configuration: SensorConfiguration, listen: str, port: int):
        self._page = configuration.xml()
        self._listening = bound(socket.SOCK_STREAM, listen, port, "--page-port")
        self._listening.listen(64)
        self.port = self._listening.getsockname()[1]
        self._clients: dict[socket.socket, bytes] = {}

    @property
    def sockets(self) -> list[socket.socket]:
        """The sockets that may have data to read."""
        return [self._listening, *self._clients]

    def serve(self, ready: list) -> None:
        """Read requests, and answer those that are complete."""
        for client in [each for each in self._clients if each in ready]:
            self._receive(client)
        if self._listening in ready:
            with suppress(OSError):  # already disconnected
                client, _ = self._listening.accept()
                client.setblocking(False)
                self._clients[client] = b""
        if len(self._clients) > _MAX_CLIENTS:
            self._disconnect(next(iter(self._clients)))

    def close(self) -> None:
        """Close all sockets."""
        for each in self.sockets:
            each.close()
        self._clients = {}

    def _receive(self, client: socket.socket) -> None:
        with suppress(OSError):
            data = client.recv(_MAX_REQUEST_BYTES)
            self._clients[client] += data
            request = self._clients[client]
            if data and _REQUEST_END not in request and len(request) <= _MAX_REQUEST_BYTES:
                return
            if _REQUEST_END in request:
                client.send(self._answer(request))
        self._disconnect(client)

    def _answer(self, request: bytes) -> bytes:
        method, _, rest = request.partition(b" ")
        found = method == b"GET" and rest.partition(b" ")[0] == f"/{PAGE}".encode()
        status, page = ("200 OK", self._page) if found else ("404 Not Found", b"")
        head = (f"HTTP/1.1 {status}", "Content-Type: text/xml", f"Content-Length: {len(page)}", "Connection: close")
        return "\r\n".join([*head, "", ""]).encode() + page

    def _disconnect(self, client: socket.socket) -> None:
        del self._clients[client]
        client.close()


def bound(kind: socket.SocketKind, listen: str, port: int, option: str) -> socket.socket:
    """A non-blocking socket bound to ``port`` at ``listen``, 0 for any free one. Raises InputError."""
    within(option, port, 0, 65_535)
    made = socket.socket(socket.AF_INET, kind)
    try:
        if kind == socket.SOCK_STREAM and os.name == "posix":  # to reuse the port of a rig that has just ended;
            made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # elsewhere two programs could have the same
        made.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER_BYTES)
        made.bind((listen, port))
        made.setblocking(False)
    except OSError as error:
        made.close()
        reason, step = error.strerror or str(error), "Check the address to listen at."
        if error.errno == errno.EADDRINUSE:
            reason, step = "in use", "Give another port, or 0 for any free one."
        raise InputError(option, port, reason, listen, step) from None
    return made


class VirtualRig:
    """A virtual rig on the network, as a context manager: it runs while the context is open.

    Parameters
    ----------
    model : Model, optional
        The tissue; default: the source paper's phantom.
    seed : int
        Seed of all random numbers, at least 0.
    faults : mapping of str to float, optional
        Values of faults by name as in ``FAULTS``.
    sensor : Sensor, optional
        Filter and noise of the force sensor.
    sensor_port, axis_port, page_port : int
        Ports, 0 for any free one; inside the context the attributes of these names are the ports in use.
    listen : str
        Address to listen at.
    say : callable
        Called with a line for each event, in the rig's thread.

    Raises
    ------
    InputError
        If a value is invalid; on entering the context, if a port is in use.
    """

    def __init__(
        self,
        model: Model | None = None,
        seed: int = 1,
        faults: Mapping[str, float] | None = None,
        *,
        sensor: Sensor | None = None,
        sensor_port: int = 0,
        axis_port: int = 0,
        page_port: int = 0,
        listen: str = "127.0.0.1",
        say: Callable[[str], None] = lambda line: None,
    ):
        self.simulated = SimulatedRig(seed, model, faults, sensor)
        self._ports, self._listen, self._say = (sensor_port, axis_port, page_port), listen, say
        self._ending = threading.Event()
        self.ended = threading.Event()  # the power was cut, or the context has ended
        self._lock = threading.Lock()

    def __enter__(self) -> "VirtualRig":
        sensor, axis, page = self._ports
        with ExitStack() as opened:  # what is open is closed if the next port is in use
            self._sensor = SensorServer(self.simulated, self._listen, sensor, self._say)
            opened.callback(self._sensor.close)
            self._axis = AxisServer(self.simulated, self._listen, axis, self._say)
            opened.callback(self._axis.close)
            self._page = PageServer(self.simulated.sensor.configuration, self._listen, page)
            opened.pop_all()
        self.sensor_port, self.axis_port, self.page_port = self._sensor.port, self._axis.port, self._page.port
        if not self._listen.startswith("127."):
            self._say(f"warning: listening at {self._listen}; any computer that can connect can move the axis")
        self._start = time.monotonic()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_) -> None:
        self._ending.set()
        self._thread.join()

    @property
    def time(self) -> float:
        """Time since the context was entered [s]."""
        return time.monotonic() - self._start

    def truth(self) -> LiveTruth:
        """The ground truth so far."""
        with self._lock:
            return self.simulated.truth()

    def _run(self) -> None:
        cut = self.simulated.faults["power_cut_s"]
        try:
            while not self._ending.is_set() and self.time < cut:
                self._serve_once()
        finally:
            self._axis.close(abruptly=self.time >= cut)
            self._sensor.close()
            self._page.close()
            if self.time >= cut:
                self._say("rig: power cut")
            self.ended.set()

    def _serve_once(self) -> None:
        """Wait for input or for the next output, and advance the rig to the present time."""
        period = _STREAMING_INTERVAL_S if self.simulated.transfer.streaming else _IDLE_INTERVAL_S
        watched = [self._sensor.socket, *self._axis.sockets, *self._page.sockets]
        ready, _, _ = select.select(watched, [], [], period - self.time % period)
        with self._lock:
            now = self.time
            self._axis.note_activity(ready, now)
            self.simulated.advance(now)
            self._axis.serve(ready, now)
            self._sensor.serve(ready, now)
            self._page.serve(ready)
