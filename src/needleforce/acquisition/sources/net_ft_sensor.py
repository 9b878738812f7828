# SPDX-License-Identifier: Apache-2.0
"""A Net F/T sensor on the network as a force source, and its configuration from its web server or from a file."""

import contextlib
import select
import socket
import threading
from collections.abc import Iterator
from http.client import HTTPConnection, HTTPException, HTTPSConnection
from urllib.parse import urlsplit

from ...errors import InputError
from ...files import read_bytes
from ...wire.net_ft import (
    MAX_PAGE_BYTES,
    PAGE,
    PORT,
    RECORD_SIZE,
    Command,
    Packet,
    SensorConfiguration,
    pack_request,
    parse_configuration,
    unpack_records,
)
from .arrival_time import Received, StampedSocket, ask_for_drops
from .reading_checks import Unwrapped
from .source import ForceSample

_MAX_DATAGRAM_BYTES = 40 * RECORD_SIZE  # buffered streaming sends 40 records; a longer one counts as of a wrong size
_MAX_DATAGRAMS = 64  # read in one call, so that the force limit is checked in between
_KERNEL_BYTES_PER_PACKET = 2304  # of the receive buffer, for a small packet on a network card
_MIN_STALE_RECORDS = 10  # consecutive records with the same reading of the sensor, from which they count as stale
_SECOND = 1_000_000_000  # [ns]
_PAGE_TIMEOUT_S = 3.0
_PAGE_INTERVAL_S = 1.0  # between two looks at the page during a run
_ADVICE = "Give its address or a saved copy with --sensor-page."


class SensorClient:
    """Readings of one sensor over UDP.

    Parameters
    ----------
    host : str
        Name or address of the sensor.
    port : int
        UDP port.
    configuration : SensorConfiguration
        Counts per newton, rate and ratings of the sensor; see ``read_configuration``.
    page : str
        URL or file of the configuration page, to be read every second while readings arrive; default: it is not read.

    Attributes
    ----------
    clock_rate : float
        Configured rate [Hz]; the device's time is the unwrapped counter over this rate.
    foreign, wrong_size, stale, dropped : int
        Counts of packets from other addresses, packets of a wrong size, records that repeat a reading, and packets that
        the kernel dropped because its buffer was full.
    buffer : float
        Time for which the kernel's buffer holds unread readings [s]; known once started.
    changed : str
        In words, that the page has another configuration now; empty otherwise. A page that does not answer is none.

    Raises
    ------
    InputError
        If the configuration is missing, or the host is unknown or not reachable.
    """

    def __init__(self, host: str, port: int = PORT, configuration: SensorConfiguration | None = None, page: str = ""):
        if configuration is None:
            limit, advice = "it is needed to convert counts to newtons", "Give read_configuration(host)."
            raise InputError("configuration of the sensor", "none", limit, next_step=advice)
        self.configuration, self.clock_rate = configuration, configuration.rate
        self.foreign = self.wrong_size = self.stale = self.dropped = 0
        self._numbers = Unwrapped(configuration.rate)
        self._sample, self._repeats = None, 0
        self._address, self._own_address = _route_to(host, port)
        self._socket: socket.socket | None = None
        self._stamped: StampedSocket | None = None
        self.buffer, self.changed = 0.0, ""
        self._page, self._stopped = page, threading.Event()

    @property
    def restart(self) -> int:
        """How often the sensor's counter restarted."""
        return self._numbers.restart

    def start(self) -> None:
        """Open a socket and request records without end."""
        self.stop()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind((self._own_address, 0))
        self._socket.setblocking(False)
        self._stamped = StampedSocket(self._socket)
        ask_for_drops(self._socket)
        self.buffer = _enlarged_buffer(self._socket) / _KERNEL_BYTES_PER_PACKET / self.clock_rate
        self._send(Command.START)
        if self._page:
            self._stopped = threading.Event()
            threading.Thread(target=self._watch_page, args=(self._stopped,), daemon=True).start()

    def receive(self, timeout: float) -> list[ForceSample]:
        """The samples received; waits at most ``timeout`` [s] for the first one."""
        if not select.select([self._socket], [], [], timeout)[0]:
            return []
        samples: list[ForceSample] = []
        with contextlib.suppress(BlockingIOError):
            for _ in range(_MAX_DATAGRAMS):
                try:
                    received = self._stamped.receive(_MAX_DATAGRAM_BYTES + 1)
                except ConnectionError:  # the network reports a closed port; the recorder detects the silence
                    continue
                self.dropped = max(self.dropped, received.dropped)
                samples += self._samples(received)
        return samples

    def stop(self) -> None:
        """End the stream and close the socket."""
        self._stopped.set()
        if self._socket:
            with contextlib.suppress(InputError):
                self._send(Command.STOP)
            self._socket.close()
            self._socket = None

    def _watch_page(self, stopped: threading.Event) -> None:
        """Compare the page with the configuration until the stream is stopped."""
        while not (stopped.wait(_PAGE_INTERVAL_S) or self.changed):
            with contextlib.suppress(InputError):
                if (now := read_configuration("", self._page)) != self.configuration:
                    both = ((name, vars(self.configuration)[name], new) for name, new in vars(now).items())
                    values = ", ".join(f"{name} {old} is now {new}" for name, old, new in both if old != new)
                    self.changed = f"its page changed: {values}"

    def _send(self, command: Command) -> None:
        try:
            self._socket.sendto(pack_request(command), self._address)
        except OSError as error:
            raise _unreachable(self._address, error) from None

    def _samples(self, received: Received) -> list[ForceSample]:
        if received.sender[:2] != self._address[:2]:
            self.foreign += 1
            return []
        if not received.data or len(received.data) % RECORD_SIZE:
            self.wrong_size += 1
            return []
        return [self._sample_of(packet, received.arrival, received.read) for packet in unpack_records(received.data)]

    def _sample_of(self, packet: Packet, arrival: int, read: int) -> ForceSample:
        self._repeats = self._repeats + 1 if packet.sample == self._sample else 0
        self._sample = packet.sample
        self.stale += self._repeats >= _MIN_STALE_RECORDS
        number, is_next = self._numbers.next(packet.sequence, arrival)
        device = max(0, round(number * _SECOND / self.clock_rate))
        return ForceSample(
            sequence=number,
            device=device,
            arrival=arrival,
            read=read,
            wrench=self.configuration.wrench(packet.counts),
            status=packet.status,
            fresh=is_next and self._repeats < _MIN_STALE_RECORDS,
        )


def _route_to(host: str, port: int) -> tuple[tuple, str]:
    """The sensor's address, and that of the interface that leads to it."""
    try:
        if not 0 < port < 65536:
            raise OverflowError(f"port {port} is outside 1 to 65535")
        address = socket.getaddrinfo(host, port, socket.AF_INET, socket.SOCK_DGRAM)[0][4]
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.connect(address)  # sends nothing
            return address, probe.getsockname()[0]
    except (OSError, OverflowError, UnicodeError) as error:
        raise _unreachable((host, port), error) from None


def _enlarged_buffer(receiver: socket.socket) -> int:
    """The size [bytes] of the receive buffer, made as large as the system allows."""
    for size in (1 << 25, 1 << 24, 1 << 23, 1 << 22):
        with contextlib.suppress(OSError):
            receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, size)
            break
    return receiver.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)


def _unreachable(address: tuple, error: Exception) -> InputError:
    reason = getattr(error, "strerror", None) or str(error)
    return InputError("sensor", "not reached", reason, f"{address[0]}:{address[1]}", "Check the address and the cable.")


def read_configuration(host: str, page: str = "") -> SensorConfiguration:
    """Read the configuration of a sensor.

    Parameters
    ----------
    host : str
        Name or address of the sensor, whose web server on port 80 is asked if no page is given.
    page : str
        URL or file of the configuration page.

    Returns
    -------
    SensorConfiguration

    Raises
    ------
    InputError
        If the page cannot be read or does not contain counts, units and a rate.
    """
    place = page or f"http://{host}/{PAGE}"
    read = _fetched if place.startswith(("http://", "https://")) else _from_file
    return parse_configuration(read(place), place)


def _fetched(url: str) -> bytes:
    timed_out = threading.Event()
    try:
        with contextlib.closing(_connection(url)) as connection, _limited_to(_PAGE_TIMEOUT_S, connection, timed_out):
            path = urlsplit(url)
            connection.request("GET", (path.path or "/") + (f"?{path.query}" if path.query else ""))
            answer = connection.getresponse()
            page = answer.read(MAX_PAGE_BYTES + 1)
    except (OSError, ValueError, HTTPException) as error:
        if not timed_out.is_set():  # data that arrive after the shutdown reset the connection
            raise _not_read(getattr(error, "strerror", None) or str(error), url) from None
    if timed_out.is_set():
        raise _not_read(f"not complete after {_PAGE_TIMEOUT_S:g} s", url)
    if answer.status != 200:
        raise _not_read(f"the server answers {answer.status} {answer.reason}", url)
    return page


def _connection(url: str) -> HTTPConnection:
    """A direct connection to the server without a proxy, as a sensor is on the lab's own network."""
    parts = urlsplit(url)
    kind = HTTPSConnection if parts.scheme == "https" else HTTPConnection
    if not parts.hostname:
        raise ValueError("the URL has no host")
    connection = kind(parts.hostname, parts.port, timeout=_PAGE_TIMEOUT_S)
    connection.connect()
    return connection


@contextlib.contextmanager
def _limited_to(seconds: float, connection: HTTPConnection, timed_out: threading.Event) -> Iterator[None]:
    """Shut the connection down after ``seconds``, even while data arrive slowly; the event is then set."""
    open_socket = connection.sock

    def shut() -> None:
        timed_out.set()
        with contextlib.suppress(OSError):
            open_socket.shutdown(socket.SHUT_RDWR)

    timer = threading.Timer(seconds, shut)
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
        timer.join()


def _not_read(reason: str, url: str) -> InputError:
    printable = "".join(filter(str.isprintable, reason)).strip()[:120]
    return InputError("sensor's configuration", "not read", printable or "unknown answer", url, _ADVICE)


def _from_file(path: str) -> bytes:
    try:
        return read_bytes(path, "sensor's configuration", MAX_PAGE_BYTES)
    except InputError as error:
        raise InputError(error.quantity, error.value, error.limit, error.place, _ADVICE) from None
