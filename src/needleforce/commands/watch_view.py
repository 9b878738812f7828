# SPDX-License-Identifier: Apache-2.0
"""What ``needleforce watch`` shows: a panel in a terminal, lines elsewhere; and the lines for other programs."""

import contextlib
import json
import sys
import time
from collections.abc import Iterator
from typing import IO, TYPE_CHECKING, Any

from ..display.quantities import percent, quantity
from ..errors import printable
from ..files import json_safe
from .output import anonymous, say

if TYPE_CHECKING:
    from ..core import Detection
    from ..events.rows import Row
    from ..events.watch import Watch

_REFRESH_S = 0.1  # between two looks of the panel
_MAX_POINTS = 3000  # of the curve in the panel
_SHOWN_EVENTS = 6  # the newest ones
_BAR = 40  # characters
_LETTERS = {"contact": "C", "puncture": "P", "exit": "E"}  # in the curve


class View:
    """Lines on standard error: one an event, one a second, and where a stream stalls."""

    def begin(self, name: str, watch: "Watch") -> None:
        """A stream begins."""
        self.name, self.watch = name, watch
        say(f"watching {name}")

    def row(self, row: "Row") -> None:
        """A row has come."""

    def second(self, now: dict[str, Any]) -> None:
        """A second of the stream is over."""
        say(", ".join(f"{name} {text}" for name, text in facts(now)))

    def event(self, event: "Detection") -> None:
        """An event was found."""
        say(f"  {event.kind}: " + ", ".join(event_cells(event)[1:]))

    def stalled(self, seconds: float) -> None:
        """No row has come for a while."""
        say(f"stalled: no row for {seconds:.0f} s")

    def lost(self, sentences: list[str]) -> None:
        """Something of the stream could not be used."""
        for sentence in sentences:
            say(f"lost: {sentence}")

    def refresh(self) -> None:
        """Show what is new, as often as it can be seen."""


class _Panel(View):
    """The curve, the state of the moment and the newest events, in place."""

    def __init__(self, live: Any):
        self._live, self._shown, self._waiting = live, 0.0, 0.0

    def begin(self, name: str, watch: "Watch") -> None:
        self.name, self.watch = name, watch
        self._points, self._events, self._every, self._count = [], [], 1, 0
        self._shown, self._losses = 0.0, []

    def row(self, row: "Row") -> None:
        self._waiting = 0.0
        self._count += 1
        if self._count % self._every:
            return
        self._points.append((row.depth, row.force))
        if len(self._points) > _MAX_POINTS:
            self._points, self._every = self._points[::2], 2 * self._every

    def second(self, now: dict[str, Any]) -> None:
        pass

    def event(self, event: "Detection") -> None:
        self._events.append(event)

    def stalled(self, seconds: float) -> None:
        self._waiting = seconds

    def lost(self, sentences: list[str]) -> None:
        self._losses = sentences

    def refresh(self) -> None:
        if time.monotonic() - self._shown < _REFRESH_S or not self._points:
            return
        self._shown = time.monotonic()
        self._live.update(self._drawn(), refresh=True)

    def _drawn(self) -> Any:
        """The panel as text with styles."""
        import numpy as np
        from rich.text import Text

        from .inspect import terminal_plot

        depth, force = np.array(self._points).T
        now, text = self.watch.now(), Text()
        text.append(f"{printable(anonymous.text(self.name))}\n", style="bold")
        if self._waiting:
            text.append(f"stalled: no row for {self._waiting:.0f} s\n", style="bold red")
        for sentence in self._losses:
            text.append(f"lost: {sentence}\n", style="red")
        marks = [(1e3 * e.depth, _force_at(depth, force, e.depth), _LETTERS[e.kind])
                 for e in self._events if e.kind in _LETTERS]  # fmt: skip
        text.append(terminal_plot(1e3 * depth, force, "depth [mm]", "force [N]", marks, height=8) + "\n\n")
        for name, value in facts(now):
            text.append(f"{name:>8}  ").append(value, style="bold")
            text.append(f"  {_bar(now['force_N'], force)}\n" if name == "force" else "\n")
        text.append("\n")
        for event in self._events[-_SHOWN_EVENTS:]:
            style = "bold red" if event.kind == "puncture" and event.probability > 0.5 else ""
            cells = "  ".join(f"{each:>10}" for each in event_cells(event)[1:])
            text.append(f"{event.kind:>8}  {cells}\n", style)
        text.append("\n")
        for name, value in learnt(now):
            text.append(f"{name:>30}  ").append(f"{value}\n", style="bold")
        return text


def _force_at(depth: Any, force: Any, where: float) -> float:
    return float(force[abs(depth - where).argmin()])


def _bar(force: float, seen: Any) -> str:
    """The force as a share of the largest so far."""
    top = max(float(abs(seen).max()), 1e-9)
    return "#" * round(_BAR * min(abs(force) / top, 1.0))


def facts(now: dict[str, Any]) -> list[tuple[str, str]]:
    """What is known of this moment, as names and texts."""
    found = [
        ("time", f"{now['time_s']:.2f} s"),
        ("force", f"{now['force_N']:.3f} N"),
        ("depth", f"{1e3 * now['depth_m']:.2f} mm"),
        ("status", now["status"].replace("_", " ")),
        ("noise", f"{1e3 * now['noise_N']:.3g} mN"),
        ("puncture", f"a fall of {now['needed_fall_N']:.3g} N"),
    ]
    return found + ([] if (ahead := now.get("ahead")) is None else [("ahead", _expected(ahead))])


def _expected(ahead: dict[str, Any]) -> str:
    """The force over the next travel."""
    force = str(quantity(ahead["force_N"], ahead["low_N"], ahead["high_N"], "N"))
    chance = percent(ahead["puncture_probability"])
    return f"{force} after {1e3 * ahead['travel_m']:g} mm; a puncture before that: {chance}"


def learnt(now: dict[str, Any]) -> list[tuple[str, str]]:
    """The parameters so far, as names and texts; those that the motion has not determined are shown as such."""
    shown = []
    for each in now.get("parameters", ()):
        value = quantity(each["value"], each["low"], each["high"], each["unit"])
        doubt = "" if each["identifiable"] else ", not determined"
        shown.append((each["name"].replace("_", " "), f"{value}{doubt}"))
    return shown


def event_cells(event: "Detection") -> list[str]:
    """An event as cells of a table."""
    size = f"{1e3 * event.size:.3f} mm" if event.kind == "reversal" else f"{event.size:.3f} N" if event.size else "-"
    return [
        event.kind,
        f"{event.time:.3f} s",
        f"{1e3 * event.depth:.3f} mm",
        size,
        f"{event.probability:.3f}",
        f"{1e3 * event.delay:.1f} ms",
    ]


EVENT_COLUMNS = ["event", "time", "depth", "change", "probability", "found after"]


@contextlib.contextmanager
def view_of(plain: bool) -> Iterator[View]:
    """A panel in a terminal, lines elsewhere or where they are wanted."""
    if plain or not sys.stderr.isatty():
        yield View()
        return
    from rich.console import Console
    from rich.live import Live

    with Live(console=Console(stderr=True), auto_refresh=False, transient=True, vertical_overflow="crop") as live:
        yield _Panel(live)


class JsonLines:
    """Lines of JSON for other programs, each written at once; nowhere for None."""

    def __init__(self, target: IO[str] | None):
        self._target = target

    def write(self, kind: str, **facts: Any) -> None:
        """Write one line."""
        if self._target is not None:
            document = json.dumps(json_safe({"kind": kind} | facts), allow_nan=False)
            self._target.write(anonymous.text(document) + "\n")
            self._target.flush()


@contextlib.contextmanager
def json_lines(path: str | None) -> Iterator[JsonLines]:
    """Lines to a file, to standard output for ``-``, or nowhere."""
    if path is None or path == "-":
        yield JsonLines(None if path is None else sys.stdout)
        return
    with open(path, "w", encoding="utf-8") as file:
        yield JsonLines(file)
