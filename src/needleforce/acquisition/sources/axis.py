# SPDX-License-Identifier: Apache-2.0
"""A motion axis on the network: its states, and commands that are answered."""

import contextlib
import select
import socket
import threading
import time
from collections import deque

from ...errors import InputError
from ...wire.axis_lines import LONGEST, PORT, Answer, AxisRange, AxisState, move_line, parse_answer
from .source import ask_for_stamps, receive_stamped

PATIENCE = 1.0  # [s] for an answer
_AGAIN = 0.05  # [s] after which an unanswered stop is sent again
_STUCK = 0.2  # [s] for sending a line
_ALIVE_EVERY = 0.1  # [s]; an axis waits for half a second


class AxisClient:
    """One axis. A thread reads what it says and sends ``stop`` again until it is answered; ``close`` joins it.

    ``limits`` is what the axis can do. An axis stops by itself half a second after the last word: while it moves, call
    ``alive`` often. Raises InputError for an axis that is not there, or says what an axis does not say, from any method
    but ``send_stop``, ``stop``, ``alive`` and ``close``. All but ``receive`` may be called from any thread.
    """

    def __init__(self, host: str, port: int = PORT, patience: float = PATIENCE):
        self.place = f"axis at {host}:{port}"
        self._patience = patience
        self._socket = _connected(host, port, patience, self.place)
        self._arrived: deque[tuple[AxisState, int]] = deque()
        self._answers: dict[str, Answer] = {}
        self._changed = threading.Condition()
        self._sending = threading.Lock()
        self._fault: InputError | None = None
        self._stopping = self._closing = False
        self._rest, self._last_word = b"", 0.0
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

    def move(self, depth: float, speed: float) -> None:
        """Send the tip to ``depth`` [m] at ``speed`` [m/s]; returns when it is accepted. InputError if not."""
        self.send_move(depth, speed)
        self._accepted("move")

    def send_move(self, depth: float, speed: float) -> None:
        """As ``move``, but returns at once; ``answer`` tells."""
        self.check_move(depth, speed)
        self._answers.pop("move", None)
        self._send(move_line(depth, speed))

    def answer(self, command: str) -> Answer | None:
        """The answer to the last command of this name, None as long as there is none."""
        return self._answers.get(command)

    def site(self, number: int) -> None:
        """Go to the site ``number`` of the specimen, from 1."""
        self._answers.pop("site", None)
        self._send(f"site {number}")
        self._accepted("site")

    def check_move(self, depth: float, speed: float) -> None:
        """Raise InputError for what is beyond the axis."""
        low, high, fastest, _ = self.limits
        if not low <= depth <= high:
            raise InputError("depth", depth, f"the axis goes from {low:g} to {high:g} m", self.place)
        if not 0.0 < speed <= fastest:
            raise InputError("speed", speed, f"the axis goes at up to {fastest:g} m/s", self.place)

    def alive(self) -> None:
        """Say that the axis may go on, at most ten times a second."""
        if time.monotonic() - self._last_word > _ALIVE_EVERY:
            self._send("alive")

    def send_stop(self) -> None:
        """Send the stop and return at once; it is sent again until it is answered."""
        self._answers.pop("stop", None)
        self._stopping = True
        self._send("stop")

    def stop(self) -> bool:
        """Send the stop, and whether it was answered in time."""
        self.send_stop()
        with self._changed:
            return self._changed.wait_for(lambda: "stop" in self._answers or self._fault, self._patience) is True

    def close(self) -> None:
        """Close the connection, upon which an axis stops by itself."""
        self._closing = True
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        self._thread.join(5.0)
        self._socket.close()

    def _accepted(self, command: str) -> None:
        self._await(lambda: command in self._answers, f"answer to {command}")
        answer = self._answers[command]
        if not answer.accepted:
            raise InputError(command, "refused", answer.reason, self.place)

    def _await(self, there, what: str) -> None:
        with self._changed:
            self._changed.wait_for(lambda: there() or self._fault, self._patience)
        if there():
            return
        fault = self._fault or InputError(what, "none", f"awaited for {self._patience:g} s", self.place)
        if self.limits is None:
            self.close()
        raise fault

    def _send(self, line: str) -> None:
        self._last_word = time.monotonic()
        with contextlib.suppress(OSError), self._sending:  # a connection that is gone is told by who reads
            self._socket.sendall(line.encode() + b"\n")

    def _read(self) -> None:
        try:
            while not self._closing:
                if select.select([self._socket], [], [], _AGAIN)[0]:
                    received = receive_stamped(self._socket, 65536)
                    self._take(received.data, received.arrival)
                if self._stopping and time.monotonic() - self._last_word > _AGAIN:
                    self._send("stop")
        except (OSError, InputError) as error:
            known = isinstance(error, InputError)
            self._fault = error.at(self.place) if known else InputError("connection", "lost", "", self.place)
        with self._changed:
            self._changed.notify_all()

    def _take(self, data: bytes, arrival: int) -> None:
        *lines, self._rest = (self._rest + data).split(b"\n")
        for line in lines:
            self._hear(line.rstrip(b"\r").decode("ascii", "replace"), arrival)
        if not data:
            raise ConnectionError
        if len(self._rest) > LONGEST:
            self._hear(self._rest.decode("ascii", "replace"), arrival)

    def _hear(self, line: str, arrival: int) -> None:
        said = parse_answer(line)
        if isinstance(said, AxisState):
            self._arrived.append((said, arrival))
            return
        if isinstance(said, Answer) and said.command == "connection":
            raise InputError("connection", "refused", said.reason, "", "One client at a time: end the other one.")
        with self._changed:
            if isinstance(said, AxisRange):
                self.limits = said
            else:
                self._answers[said.command] = said
                self._stopping = self._stopping and said.command != "stop"
            self._changed.notify_all()


def _connected(host: str, port: int, patience: float, place: str) -> socket.socket:
    try:
        made = socket.create_connection((host, port), timeout=patience)
    except (OSError, OverflowError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError("axis", "not reached", reason, place, "Check its address, and that it is on.") from None
    made.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    made.settimeout(_STUCK)
    ask_for_stamps(made)
    return made
