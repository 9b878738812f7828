# SPDX-License-Identifier: Apache-2.0
"""``needleforce watch``: events while they happen, from a recording that is replayed, a rig, or lines of a program."""

import math
import time
from collections.abc import Iterable
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec
import typer

from ..errors import InputError
from ..events.rows import Row, replayed, rows_of_lines
from ..events.watch import Watch, event_document
from ..recording.options import ReadOptions
from .files import read_all
from .flags import takes_flags
from .output import check_outputs, say, table
from .watch_view import EVENT_COLUMNS, JsonLines, View, event_cells, json_lines, view_of

if TYPE_CHECKING:
    pass

LINES = "-"
STALLED_S = 1.0  # without a row, after which a stream counts as stalled
SOURCE_HELP = "Recordings; or - for lines of time, force and depth on standard input, CSV or JSON."
SPEED_HELP = "Seconds of a recording in one second, or max."
JSON_HELP = "Write a JSON line an event and one a second to this file; - for standard output."


class WatchFlags(msgspec.Struct, frozen=True, kw_only=True):
    """The flags of ``watch``."""

    pace: Annotated[str, typer.Option("--speed", help=SPEED_HELP)] = "1"
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None
    plain: Annotated[bool, typer.Option("--plain", help="Print one line per second instead of a panel.")] = False


@takes_flags("motion", "start_depth")
def run(
    sources: Annotated[list[str], typer.Argument(help=SOURCE_HELP, metavar="FILE...|-", show_default=False)],
    given: WatchFlags,
    *,
    reading: ReadOptions,
) -> None:
    """Watch an insertion: contact, punctures, stop, reversal and exit as they happen, live in the terminal.

    Ctrl-C ends it. Exit code 0: something was watched; 1: there was nothing to watch, with the reason for each source;
    2: wrong usage.
    """
    files = [] if sources == [LINES] else [Path(each) for each in sources]
    check_outputs([given.json], files)
    speed, done = _speed(given.pace), []
    with ExitStack() as opened:
        shown = opened.enter_context(view_of(given.plain)), opened.enter_context(json_lines(given.json))
        with suppress(KeyboardInterrupt):
            for name, rows in _streams(files, reading, speed):
                done.append(Watched(name, *shown))
                done[-1].follow(rows)
    for each in done:
        each.show_events(quiet=given.json == "-")
    if not any(each.watch.rows for each in done):
        raise typer.Exit(1)


def _streams(files: list[Path], reading: ReadOptions, speed: float) -> Iterable[tuple[str, Iterable[list[Row]]]]:
    """The name and the rows of each source; a file that cannot be read is reported."""
    if not files:
        from ..acquisition.sources.opening import standard_input

        lines = standard_input(None, given=reading.columns, units=reading.units)
        yield "standard input", rows_of_lines(lines, reading.rate)
    for file, recording in read_all(files, reading):
        if isinstance(recording, InputError):
            say(str(recording))
        else:
            yield str(file), replayed(recording, speed)


def _speed(text: str) -> float:
    if text == "max":
        return math.inf
    with suppress(ValueError):
        if 0.0 < (speed := float(text)) < math.inf:
            return speed
    raise InputError("--speed", repr(text), "above 0, or max, is needed", next_step="Give --speed 1 or --speed max.")


class Watched:
    """One stream, shown while it comes."""

    def __init__(self, name: str, view: View, out: JsonLines):
        self.name, self.watch = name, Watch()
        self._view, self._out = view, out
        self._second, self._came, self._stalled = 0, time.monotonic(), 0
        view.begin(Path(name).name, self.watch)
        out.write("begin", source=name)

    def follow(self, batches: Iterable[list[Row]]) -> None:
        """Take all batches as they come."""
        for rows in batches:
            self.take(rows)
        self._out.write("end", source=self.name, events=len(self.watch.events), rows=self.watch.rows)

    def take(self, rows: list[Row]) -> None:
        """Take the rows that have come, perhaps none."""
        for row in rows:
            event = self.watch.add(row)
            self._view.row(row)
            if event is not None:
                self._view.event(event)
                self._out.write("event", **event_document(event))
            if row.time >= self._second + 1:
                self._second = int(row.time)
                self._view.second(self.watch.now())
                self._out.write("second", **self.watch.now())
        self._note_stall(bool(rows))
        self._view.refresh()

    def _note_stall(self, came: bool) -> None:
        """A stream without rows is shown as such, once a second."""
        now = time.monotonic()
        self._came = now if came else self._came
        waited = 0 if came else int((now - self._came) / STALLED_S)
        if waited > self._stalled:
            self._view.stalled(now - self._came)
            self._out.write("stalled", seconds=now - self._came)
        self._stalled = waited

    def show_events(self, quiet: bool) -> None:
        """The events in a table."""
        if not quiet:
            table(f"events of {Path(self.name).name}", EVENT_COLUMNS, [event_cells(each) for each in self.watch.events])
