# SPDX-License-Identifier: Apache-2.0
"""The sensor's configuration, from its own web server or from a file."""

import contextlib
import socket
import threading
from collections.abc import Iterator
from http.client import HTTPConnection, HTTPException, HTTPSConnection
from pathlib import Path
from urllib.parse import urlsplit

from ...errors import InputError
from ...wire.sensor_configuration import LONGEST, PAGE, SensorConfiguration, parse_configuration

_PATIENCE = 3.0  # [s]
_ADVICE = "Name its address or a saved copy with --sensor-page."


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
