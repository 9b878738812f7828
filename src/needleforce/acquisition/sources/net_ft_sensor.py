# SPDX-License-Identifier: Apache-2.0
"""A Net F/T sensor on the network as a force source, and its configuration from its own web server or from a file."""

import contextlib
import select
import socket
import threading
from collections.abc import Iterator
from http.client import HTTPConnection, HTTPException, HTTPSConnection
from pathlib import Path
from urllib.parse import urlsplit

from ...errors import InputError
from ...wire.rdt import PORT, RECORD_SIZE, Command, Packet, pack_request, unpack_records
from ...wire.sensor_configuration import LONGEST, PAGE, SensorConfiguration, parse_configuration
from .sequence import Unwrapped
from .source import ForceSample, ask_for_drops, ask_for_stamps, receive_stamped

_DATAGRAM = 65536  # bytes
_AT_ONCE = 1024  # datagrams read before what they say is looked at
_HELD = 2304  # bytes of the kernel's memory for a small packet on a network card
_STANDS = 10  # records in which the sensor's own counter stands before it is told
_SECOND = 1_000_000_000  # [ns]
_PATIENCE = 3.0  # [s]
_ADVICE = "Name its address or a saved copy with --sensor-page."


class SensorClient:
    """Records of one sensor. What comes from another address, has a wrong size, or repeats a reading is counted.

    ``clock_rate`` [Hz] is the configured one, and the device's clock the unwrapped counter over it. ``buffer`` [s] is,
    once started, how long the kernel keeps what is not read; ``dropped`` are packets that found it full. Raises
    InputError for a host that is not known or has no way to it.
    """

    def __init__(self, host: str, port: int = PORT, configuration: SensorConfiguration | None = None):
        if configuration is None:
            raise InputError("configuration of the sensor", "none", "counts are no newtons without it")
        self.configuration, self.clock_rate = configuration, configuration.rate
        self.foreign = self.wrong_size = self.stale = self.dropped = 0
        self._numbers = Unwrapped(configuration.rate)
        self._sample, self._standing = None, 0
        self._address, self._own = _way_to(host, port)
        self._socket: socket.socket | None = None
        self.buffer = 0.0

    @property
    def restart(self) -> int:
        """How often the sensor's counter began anew."""
        return self._numbers.restart

    def start(self) -> None:
        """Open a socket and ask for records without end."""
        self.stop()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind((self._own, 0))
        self._socket.setblocking(False)
        ask_for_stamps(self._socket)
        ask_for_drops(self._socket)
        self.buffer = _widened(self._socket) / _HELD / self.clock_rate
        self._send(Command.START)

    def receive(self, timeout: float) -> list[ForceSample]:
        """The samples that came, the first awaited for at most ``timeout`` [s]."""
        if not select.select([self._socket], [], [], timeout)[0]:
            return []
        samples: list[ForceSample] = []
        with contextlib.suppress(BlockingIOError):
            for _ in range(_AT_ONCE):
                try:
                    received = receive_stamped(self._socket, _DATAGRAM)
                except ConnectionError:  # nobody listens there, says the network; silence tells the same
                    continue
                self.dropped = max(self.dropped, received.dropped)
                samples += self._samples(*received[:4])
        return samples

    def stop(self) -> None:
        """End the stream and close the socket."""
        if self._socket:
            with contextlib.suppress(InputError):
                self._send(Command.STOP)
            self._socket.close()
            self._socket = None

    def _send(self, command: Command) -> None:
        try:
            self._socket.sendto(pack_request(command), self._address)
        except OSError as error:
            raise _unreachable(self._address, error) from None

    def _samples(self, data: bytes, arrival: int, read: int, sender: tuple) -> list[ForceSample]:
        if sender[:2] != self._address[:2]:
            self.foreign += 1
            return []
        if not data or len(data) % RECORD_SIZE:
            self.wrong_size += 1
            return []
        return [self._sample_of(packet, arrival, read) for packet in unpack_records(data)]

    def _sample_of(self, packet: Packet, arrival: int, read: int) -> ForceSample:
        self._standing = self._standing + 1 if packet.sample == self._sample else 0
        self._sample = packet.sample
        self.stale += self._standing >= _STANDS
        number = self._numbers.number(packet.sequence, arrival)
        device = max(0, round(number * _SECOND / self.clock_rate))
        return ForceSample(number, device, arrival, read, self.configuration.wrench(packet.counts), packet.status)


def _way_to(host: str, port: int) -> tuple[tuple, str]:
    """The sensor's address, and that of the one interface that leads to it."""
    try:
        if not 0 < port < 65536:
            raise OverflowError("no such port")
        address = socket.getaddrinfo(host, port, socket.AF_INET, socket.SOCK_DGRAM)[0][4]
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.connect(address)  # sends nothing
            return address, probe.getsockname()[0]
    except (OSError, OverflowError, UnicodeError) as error:
        raise _unreachable((host, port), error) from None


def _widened(receiver: socket.socket) -> int:
    """The bytes got of the largest buffer that the system gives."""
    for size in (1 << 25, 1 << 24, 1 << 23, 1 << 22):
        with contextlib.suppress(OSError):
            receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, size)
            break
    return receiver.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)


def _unreachable(address: tuple, error: Exception) -> InputError:
    reason = getattr(error, "strerror", None) or str(error)
    return InputError("sensor", "not reached", reason, f"{address[0]}:{address[1]}", "Check the address and the cable.")


def read_configuration(host: str, page: str = "") -> SensorConfiguration:
    """What ``page`` says, a URL or a file; without one, the page of ``host`` on port 80. Raises InputError."""
    place = page or f"http://{host}/{PAGE}"
    read = _fetched if place.startswith(("http://", "https://")) else _from_file
    return parse_configuration(read(place), place)


def _fetched(url: str) -> bytes:
    try:
        with contextlib.closing(_connection(url)) as connection, _cut_after(_PATIENCE, connection) as cut:
            path = urlsplit(url)
            connection.request("GET", (path.path or "/") + (f"?{path.query}" if path.query else ""))
            answer = connection.getresponse()
            page = answer.read(LONGEST + 1)
    except (OSError, ValueError, HTTPException) as error:
        raise _not_read(getattr(error, "strerror", None) or str(error), url) from None
    if cut.is_set():
        raise _not_read(f"not there after {_PATIENCE:g} s", url)
    if answer.status != 200:
        raise _not_read(f"the server says {answer.status} {answer.reason}", url)
    return page


def _connection(url: str) -> HTTPConnection:
    """A connection to the server itself, by no proxy: a sensor is on the lab's own network."""
    parts = urlsplit(url)
    kind = HTTPSConnection if parts.scheme == "https" else HTTPConnection
    if not parts.hostname:
        raise ValueError("no host given")
    connection = kind(parts.hostname, parts.port, timeout=_PATIENCE)
    connection.connect()
    return connection


@contextlib.contextmanager
def _cut_after(seconds: float, connection: HTTPConnection) -> Iterator[threading.Event]:
    """Shut the connection down after so many ``seconds``, however slowly something still comes; an event says so."""
    cut, held = threading.Event(), connection.sock

    def shut() -> None:
        cut.set()
        with contextlib.suppress(OSError):
            held.shutdown(socket.SHUT_RDWR)

    timer = threading.Timer(seconds, shut)
    timer.start()
    try:
        yield cut
    finally:
        timer.cancel()
        timer.join()


def _not_read(reason: str, url: str) -> InputError:
    told = "".join(filter(str.isprintable, reason)).strip()[:120]
    return InputError("sensor's configuration", "not read", told or "no answer that is known", url, _ADVICE)


def _from_file(path: str) -> bytes:
    try:
        with Path(path).open("rb") as file:
            return file.read(LONGEST + 1)
    except OSError as error:
        raise InputError("sensor's configuration", "not read", error.strerror or "", path, _ADVICE) from None
