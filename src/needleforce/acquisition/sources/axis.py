# SPDX-License-Identifier: Apache-2.0
"""A motion axis on the network: states from it, and commands with answers."""

import contextlib
import select
import socket
import threading
import time
from collections import deque
from collections.abc import Callable

from ...errors import InputError
from ...wire.axis_lines import MAX_LINE_LENGTH, PORT, Answer, AxisRange, AxisState, move_line, parse_answer
from .arrival_time import StampedSocket

ANSWER_TIMEOUT_S = 1.0
_POLL_S = 0.05
_MAX_LINES_PER_S, _MAX_LINE_BURST = 3000, 1000  # from an axis; more are a flood
_FLOOD_PAUSE_S = 0.005  # between two reads of a flood, so that the force has the processor
_SEND_TIMEOUT_S = 0.2
_ALIVE_INTERVAL_S = 0.1  # an axis stops after half a second of silence


class AxisClient:
    """A connection to one axis.

    A thread reads its lines; ``close`` joins it. An axis stops by itself half a second after the last line from its
    client: while it moves, call ``alive`` often. All methods except ``receive`` may be called from any thread. All
    except ``send_stop``, ``alive`` and ``close`` raise InputError if the connection is lost or the axis sends
    an invalid line. Of an axis that sends more than 3000 lines a second only the newest state is read.

    Parameters
    ----------
    host : str
        Name or address of the axis.
    port : int
        TCP port.
    timeout : float
        Longest wait for a connection or an answer [s].

    Attributes
    ----------
    limits : AxisRange
        Lowest and highest depth, largest speed and acceleration.
    flood : bool
        Whether the axis sent more lines than it may.

    Raises
    ------
    InputError
        If the axis is not reached or does not send its range.
    """

    def __init__(self, host: str, port: int = PORT, timeout: float = ANSWER_TIMEOUT_S):
        self.place = f"axis at {host}:{port}"
        self._timeout = timeout
        self._socket = _connected(host, port, timeout, self.place)
        self._arrived: deque[tuple[AxisState, int]] = deque()
        self._answers: dict[str, Answer] = {}
        self._changed = threading.Condition()
        self._sending = threading.Lock()
        self._fault: InputError | None = None
        self.flood = self._closing = False
        self._allowed_lines, self._counted = float(_MAX_LINE_BURST), time.monotonic()
        self._stamped = StampedSocket(self._socket)
        self._incomplete, self._last_sent = b"", 0.0
        self.limits: AxisRange | None = None
        self._thread = threading.Thread(target=self._read, name="axis", daemon=True)
        self._thread.start()
        self._await(lambda: self.limits is not None, "greeting")

    def receive(self) -> list[tuple[AxisState, int]]:
        """The states since the last call, each with its arrival [ns]."""
        states = []
        while self._arrived:
            states.append(self._arrived.popleft())
        if not states and self._fault:
            raise self._fault
        return states

    def send_move(self, depth: float, speed: float) -> None:
        """Send the tip to ``depth`` [m] at ``speed`` [m/s]; ``answer`` has the result. Limits as in ``check_move``."""
        self.check_move(depth, speed)
        self._answers.pop("move", None)
        self._send(move_line(depth, speed))

    def answer(self, command: str) -> Answer | None:
        """The answer to the last command of this name, None until it arrives."""
        return self._answers.get(command)

    def site(self, number: int) -> None:
        """Go to the site ``number`` of the specimen, from 1."""
        self._answers.pop("site", None)
        self._send(f"site {number}")
        self._await(lambda: "site" in self._answers, "answer to site")
        if not (answer := self._answers["site"]).accepted:
            raise InputError("site", "refused", answer.reason, self.place)

    def check_move(self, depth: float, speed: float) -> None:
        """Raise InputError for a move outside the limits of the axis."""
        low, high, max_speed = self.limits[:3]
        if not low <= depth <= high:
            raise InputError("depth", f"{depth:g} m", f"the axis moves from {low:g} to {high:g} m", self.place)
        if not 0.0 < speed <= max_speed:
            raise InputError("speed", f"{speed:g} m/s", f"the axis moves at up to {max_speed:g} m/s", self.place)

    def alive(self) -> None:
        """Let the axis continue; sends at most ten lines a second."""
        if time.monotonic() - self._last_sent > _ALIVE_INTERVAL_S:
            self._send("alive")

    def send_stop(self) -> None:
        """Send a stop and return at once."""
        self._answers.pop("stop", None)
        self._send("stop")

    def close(self) -> None:
        """Close the connection; the axis then stops by itself."""
        self._closing = True
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        self._thread.join(5.0)
        self._socket.close()

    def _await(self, arrived: Callable[[], bool], what: str) -> None:
        with self._changed:
            self._changed.wait_for(lambda: arrived() or self._fault, self._timeout)
        if arrived():
            return
        advice = "Check that the axis is on and speaks the protocol in docs/reference/rig.md."
        fault = self._fault or InputError(what, "missing", f"none within {self._timeout:g} s", self.place, advice)
        if self.limits is None:
            self.close()
        raise fault

    def _send(self, line: str) -> None:
        self._last_sent = time.monotonic()
        with contextlib.suppress(OSError), self._sending:  # the reading thread reports a lost connection
            self._socket.sendall(line.encode() + b"\n")

    def _read(self) -> None:
        try:
            while not self._closing:
                if select.select([self._socket], [], [], _POLL_S)[0]:
                    received = self._stamped.receive(65536)
                    self._split(received.data, received.arrival)
                if self.flood:
                    time.sleep(_FLOOD_PAUSE_S)
        except (OSError, InputError) as error:
            known = isinstance(error, InputError)
            self._fault = error.at(self.place) if known else _connection_lost(self.place)
        with self._changed:
            self._changed.notify_all()

    def _split(self, data: bytes, arrival: int) -> None:
        *lines, self._incomplete = (self._incomplete + data).split(b"\n")
        states = []
        try:
            for line in self._limited(lines):
                states += self._interpret(line.rstrip(b"\r").decode("ascii", "replace"))
        finally:  # all at once, so that whoever takes them has the newest one
            self._arrived.extend([(state, arrival) for state in states])
        if not data:
            raise ConnectionError
        if len(self._incomplete) > MAX_LINE_LENGTH:
            self._interpret(self._incomplete.decode("ascii", "replace"))

    def _limited(self, lines: list[bytes]) -> list[bytes]:
        """The lines, as many as an axis may send; of a flood the last one, so that its state is the newest."""
        now = time.monotonic()
        self._allowed_lines = min(_MAX_LINE_BURST, self._allowed_lines + _MAX_LINES_PER_S * (now - self._counted))
        self._counted = now
        if not self.flood and len(lines) <= self._allowed_lines:
            self._allowed_lines -= len(lines)
            return lines
        self.flood = True
        if len(self._arrived) > _MAX_LINE_BURST:
            self._arrived.popleft()
        return lines[-1:]

    def _interpret(self, line: str) -> list[AxisState]:
        """The state in a line, if it is one; limits and answers are kept."""
        message = parse_answer(line)
        if isinstance(message, AxisState):
            return [message]
        if isinstance(message, Answer) and message.command == "connection":
            advice = "The axis has one client at a time: end the other one."
            raise InputError("connection", "refused", message.reason, next_step=advice)
        with self._changed:
            if isinstance(message, AxisRange):
                self.limits = message
            else:
                self._answers[message.command] = message
            self._changed.notify_all()
        return []


def _connection_lost(place: str) -> InputError:
    return InputError("connection", "lost", place=place, next_step="Check the cable and the axis, then start again.")


def _connected(host: str, port: int, timeout: float, place: str) -> socket.socket:
    try:
        connection = socket.create_connection((host, port), timeout=timeout)
    except (OSError, OverflowError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError("axis", "not reached", reason, place, "Check its address, and that it is on.") from None
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.settimeout(_SEND_TIMEOUT_S)
    return connection
