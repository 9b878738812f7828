# SPDX-License-Identifier: Apache-2.0
"""``needleforce watch``: events while they happen, from a recording that is replayed, a rig, or lines of a program."""

import math
import tempfile
import time
from collections.abc import Iterable
from contextlib import ExitStack, suppress
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec
import typer

from ..errors import InputError
from ..recording.options import ReadOptions
from .files import PRESET_HELP, read_all, readable
from .flags import takes_flags
from .output import ReportFlags, check_outputs, progress, say, show, table, write_json
from .record import STOP_AT_HELP, EventFlags, SourceFlags, moves_of, opened_rig, say_limits
from .watch_view import EVENT_COLUMNS, JsonLines, View, event_cells, json_lines, learnt, view_of

if TYPE_CHECKING:
    from ..acquisition.settings import Written
    from ..core import EventSettings
    from ..events.rows import Losses, Row

LINES, RIG = "-", "rig"
STALLED_S = 1.0  # without a row, after which a stream counts as stalled
SOURCE_HELP = "Recordings; or rig, with --sensor and --axis; or - for lines of time, force and depth, CSV or JSON."
SPEED_HELP = "Seconds of a recording in one second, or max."
DEPTH_HELP = "Of a rig: move the axis to this depth, at --speed-mm-s; without, whoever moves the needle is watched."
OUTPUT_HELP = "Of a rig: MCAP file to record to; without, nothing is kept."
CHOOSE_HELP = "Instead of a replay: the settings that fit the recordings, with misses, false alarms and delays."
PRIOR_HELP = "What is expected of the tissue; default: nothing."
JSON_HELP = "Write a JSON line an event and one a second to this file; - for standard output."


class WatchFlags(msgspec.Struct, frozen=True, kw_only=True):
    """The flags of ``watch``."""

    pace: Annotated[str, typer.Option("--speed", help=SPEED_HELP)] = "1"
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None
    prior: Annotated[str | None, typer.Option(help=f"{PRESET_HELP} {PRIOR_HELP}")] = None
    plain: Annotated[bool, typer.Option("--plain", help="Print one line per second instead of a panel.")] = False
    events: EventFlags
    rig: SourceFlags
    depth_mm: Annotated[float | None, typer.Option(help=DEPTH_HELP)] = None
    start_mm: Annotated[float, typer.Option(help="Of a rig: depth of the tip at the start and at the end.")] = -5.0
    stop_at: Annotated[str | None, typer.Option(help=STOP_AT_HELP)] = None
    output: Annotated[Path | None, typer.Option("--output", "-o", help=OUTPUT_HELP)] = None
    allowed: Annotated[float, typer.Option(help="With --choose: false alarms an insertion, at most.")] = 0.02
    choose: Annotated[bool, typer.Option("--choose", help=CHOOSE_HELP)] = False
    page: ReportFlags


@takes_flags("motion", "start_depth")
def run(
    sources: Annotated[list[str], typer.Argument(help=SOURCE_HELP, metavar="FILE...|rig|-", show_default=False)],
    given: WatchFlags,
    *,
    reading: ReadOptions,
) -> None:
    """Watch an insertion: contact, punctures, stop, reversal and exit as they happen, live in the terminal.

    Ctrl-C ends it. Exit code 0: something was watched; 1: there was nothing to watch, with the reason for each source;
    2: wrong usage; of a rig as of ``record``.
    """
    files = [] if sources in ([LINES], [RIG]) else [Path(each) for each in sources]
    check_outputs([given.json, given.output, given.page.check()], files)
    if given.choose:
        _choose(files, given, reading)
        return
    speed, settings, done, code = _speed(given.pace), given.events.settings(), [], 0
    _check_rig(sources == [RIG], given, reading)
    with ExitStack() as opened:
        shown = opened.enter_context(view_of(given.plain)), opened.enter_context(json_lines(given.json))
        if sources == [RIG]:
            done.append(Watched(RIG, settings, given.prior, *shown))
            code = _watch_rig(given, reading, done[-1])
        with suppress(KeyboardInterrupt):
            for name, rows, losses in () if sources == [RIG] else _streams(files, reading, speed):
                done.append(Watched(name, settings, given.prior, *shown, losses))
                done[-1].follow(rows)
    for each in done:
        each.show_events(quiet=given.json == "-")
    if code or not any(each.watch.rows for each in done):
        raise typer.Exit(code or 1)


def _choose(files: list[Path], given: WatchFlags, reading: ReadOptions) -> None:
    """Choose the settings on recordings."""
    from ..events.choice import choose

    if not files:
        raise InputError("--choose", "given", "it needs recordings", next_step="Name files.")
    done = read_all(files, reading)
    for _, each in done:
        if isinstance(each, InputError):
            say(str(each))
    if not (found := readable(done)):
        raise typer.Exit(1)
    chosen = choose(found, allowed=given.allowed, progress=progress)
    write_json(chosen.to_json(), given.json)
    given.page.write(chosen.report)
    if given.json != "-":
        show(str(chosen))


def _check_rig(wanted: bool, given: WatchFlags, reading: ReadOptions) -> None:
    """Raise InputError for flags of a rig without one, or a rig without them."""
    flags = [("--sensor", given.rig.sensor), ("--axis", given.rig.axis), ("--depth-mm", given.depth_mm)]
    flags += [("--stop-at", given.stop_at), ("--output", given.output)]
    name = next((word for word, value in flags if value is not None), None)
    if not wanted and name:
        raise InputError(name, "given", "it is of a rig", next_step="Write: needleforce watch rig")
    if wanted and not (given.rig.sensor and given.rig.axis):
        raise InputError("--sensor and --axis", "not given", "both are needed", next_step="Give HOST of each.")
    if wanted and (given.depth_mm is None) != (reading.speed is None):
        raise InputError("--depth-mm and --speed-mm-s", "one", "both are needed", next_step="Give both, or neither.")
    if given.stop_at and given.depth_mm is None:
        raise InputError("--stop-at", given.stop_at, "it needs --depth-mm", next_step="Give the farthest depth.")


def _watch_rig(given: WatchFlags, reading: ReadOptions, watched: "Watched") -> int:
    """Watch a run, with a file of it where one is wanted; the exit code as of ``record``."""
    from ..acquisition.motion_sequence import EndReason
    from ..acquisition.recorder import record_run
    from ..acquisition.stop_at import parse_stop

    stop_at = parse_stop(given.stop_at, given.events.settings()) if given.stop_at else None
    opened, settings = opened_rig(given.rig, stop_at=stop_at)
    moves = []
    if given.depth_mm is not None:
        moves = moves_of(given.start_mm, given.depth_mm, 1e3 * reading.speed, reading.hold or 0.0)
    with tempfile.TemporaryDirectory() as folder:
        force, axis = opened()
        say_limits(axis, moves, settings)
        path = given.output or Path(folder, "run.mcap")
        end = record_run(path, force, axis, moves, card={}, settings=settings, feed=RunRows(watched).feed)
    say(f"{end.ended}" + (f": {end.detail}" if end.detail else ""))
    watched.end()
    fine = end.ended in (EndReason.DONE, EndReason.INTERRUPTED, EndReason.EVENT)
    return 0 if fine and end.rest_confirmed else 1 if end.rest_confirmed else 3


class RunRows:
    """The rows of a run as it is written."""

    def __init__(self, watched: "Watched"):
        from ..acquisition.stop_at import DepthNow

        self._watched, self._course, self._first = watched, DepthNow(), None

    def feed(self, written: "Written") -> None:
        """Take what was written; depth and force are on one clock."""
        for state, at in written.states:
            self._course.add(1e-9 * at, state)
        from ..events.rows import Row

        rows = []
        for (_, at), force in zip(written.samples, written.forces, strict=True):
            depth = self._course.at(1e-9 * at)
            if depth is not None:
                self._first = at if self._first is None else self._first
                rows.append(Row(1e-9 * (at - self._first), force, depth))
        self._watched.take(rows)


def _streams(
    files: list[Path], reading: ReadOptions, speed: float
) -> Iterable[tuple[str, Iterable[list["Row"]], "Losses"]]:
    """The name, the rows and the losses of each source; a file that cannot be read is reported."""
    from ..events.rows import Losses, replayed, rows_of_lines

    if not files:
        from ..acquisition.sources.opening import standard_input

        lines = standard_input(None, given=reading.columns, units=reading.units)
        losses = Losses()
        yield "standard input", rows_of_lines(lines, reading.rate, losses), losses
    for file, recording in read_all(files, reading):
        if isinstance(recording, InputError):
            say(str(recording))
        else:
            yield str(file), replayed(recording, speed), Losses()


def _speed(text: str) -> float:
    if text == "max":
        return math.inf
    with suppress(ValueError):
        if 0.0 < (speed := float(text)) < math.inf:
            return speed
    raise InputError("--speed", repr(text), "above 0, or max, is needed", next_step="Give --speed 1 or --speed max.")


class Watched:
    """One stream, shown while it comes."""

    def __init__(
        self,
        name: str,
        settings: "EventSettings",
        prior: str | None,
        view: View,
        out: JsonLines,
        losses: "Losses | None" = None,
    ):
        import needleforce as nf

        online = nf.OnlineIdentifier(prior=nf.preset(prior) if prior else None)
        self.name, self.watch = name, nf.events.Watch(settings, online)
        self._view, self._out = view, out
        self._second, self._came, self._stalled = 0, time.monotonic(), 0
        self._losses, self._lost = losses or nf.events.Losses(), {}
        view.begin(Path(name).name, self.watch)
        out.write("begin", source=name)

    def follow(self, batches: Iterable[list["Row"]]) -> None:
        """Take all batches as they come."""
        for rows in batches:
            self.take(rows)
        self.end()

    def end(self) -> None:
        """The stream is over."""
        self._note_losses()
        counts = asdict(self._losses)
        self._out.write("end", source=self.name, events=len(self.watch.events), rows=self.watch.rows, **counts)

    def take(self, rows: list["Row"]) -> None:
        """Take the rows that have come, perhaps none."""
        from ..events.watch import event_document

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
        self._note_losses()
        self._note_stall(bool(rows))
        self._view.refresh()

    def _note_losses(self) -> None:
        """What is lost of a stream is stated when it happens first, and whenever it has doubled."""
        counts = {name: getattr(self._losses, name) for name in ("unreadable", "late", "restarts")}
        if any(count >= max(1, 2 * self._lost.get(name, 0)) for name, count in counts.items()):
            self._lost = counts
            sentences = self._losses.sentences()
            self._view.lost(sentences)
            self._out.write("lost", **asdict(self._losses), text=sentences)

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
        """The events in a table, and what was learnt of the tissue."""
        if quiet:
            return
        for sentence in self._losses.sentences():
            say(sentence)
        name = Path(self.name).name
        table(f"events of {name}", EVENT_COLUMNS, [event_cells(each) for each in self.watch.events])
        if not self.watch.punctures():
            wanted = self.watch.detector.settings
            fall = f"{wanted.fall:g} N and {100 * wanted.share:g} % of the largest force"
            say(f"No fall of at least {fall}, which is a puncture. In soft tissue lower it: --fall-N 0.04")
        if found := learnt(self.watch.now()):
            table(f"tissue of {name}", ["parameter", "value, 95 % interval"], found)
