# SPDX-License-Identifier: Apache-2.0
"""``needleforce record``: record a sensor and an axis to a file during the run."""

import contextlib
import dataclasses
import math
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import msgspec
import typer

from ..acquisition.sources.opening import DEFAULT_LIMIT_SHARE, force_limit, open_sources
from ..errors import InputError
from ..files import MAX_PART_SAMPLES
from .flags import takes_flags
from .output import JSON_HELP, check_outputs, say, write_json

if TYPE_CHECKING:
    from ..acquisition.settings import Progress, RunResult, Settings
    from ..acquisition.sources.source import MotionAxis
    from ..core import EventSettings
    from ..protocol.protocol import Protocol
    from ..protocol.session import CampaignOutcome

SENSOR_HELP = "HOST or HOST:PORT of a Net F/T sensor (RDT over UDP)."
PAGE_HELP = "Configuration of the sensor: a URL or a saved netftapi2.xml; default: the page of the sensor's host."

DEFAULT_LIMIT = f"{100 * DEFAULT_LIMIT_SHARE:g} % of the sensor's rated range"
LIMIT_HELP = f"Axial force minus bias at which the axis stops; default: {DEFAULT_LIMIT}."
FROZEN_HELP = "Whether readings that repeat more often than noise explains stop the axis."
GAP_HELP = "Time without a usable reading after which a moving axis is stopped."
STOP_AT_HELP = "Event at which the axis stops: puncture, layer=2 for the second, or force-rate=20 for a fall of 20 N/s."
FALL_HELP = "The smallest fall of the force that counts as a puncture; default: 0.15 N."
SAME_SITE_HELP = "If no spare site is left, insert into the hole of an aborted run."


class SourceFlags(msgspec.Struct, frozen=True, kw_only=True):
    """The flags that name a sensor and an axis, and what stops the axis."""

    sensor: Annotated[str | None, typer.Option(help=SENSOR_HELP)] = None
    sensor_page: Annotated[str, typer.Option(help=PAGE_HELP)] = ""
    axis: Annotated[str | None, typer.Option(help="HOST or HOST:PORT of a motion axis.")] = None
    force_limit_n: Annotated[float | None, typer.Option("--force-limit-N", help=LIMIT_HELP)] = None
    steady_n: Annotated[float, typer.Option("--steady-N", help="Largest change of the force during the bias.")] = 0.05
    max_force_gap_s: Annotated[float, typer.Option(help=GAP_HELP)] = 0.25
    frozen_check: Annotated[bool, typer.Option("--frozen-check/--no-frozen-check", help=FROZEN_HELP)] = True
    bias_s: Annotated[float, typer.Option(help="Time at rest to measure the bias; 0 for none.")] = 0.5
    axial: Annotated[str, typer.Option(help="Axis of the sensor along the needle: fz, -fz, fx, …")] = "fz"
    filter_length: Annotated[int, typer.Option(help="Samples in the sensor's average filter.")] = 1
    needle: Annotated[str, typer.Option(help="Description of the needle, for the card.")] = ""
    tissue: Annotated[str, typer.Option(help="Description of the tissue, for the card.")] = ""


class EventFlags(msgspec.Struct, frozen=True, kw_only=True):
    """The flags of what counts as a puncture while the needle moves."""

    fall_n: Annotated[float | None, typer.Option("--fall-N", help=FALL_HELP)] = None
    fall_share: Annotated[float | None, typer.Option(help="The same as a share of the largest force so far.")] = None
    false_alarms: Annotated[float | None, typer.Option(help="False alarms a second by noise alone, at most.")] = None

    def settings(self) -> "EventSettings":
        """The settings of the detector."""
        from ..core import EventSettings

        given = {"fall": self.fall_n, "share": self.fall_share, "false_alarms": self.false_alarms}
        return EventSettings(**{name: value for name, value in given.items() if value is not None})


class RecordFlags(SourceFlags, frozen=True, kw_only=True):
    """The flags of ``record``."""

    output: Annotated[Path | None, typer.Option("--output", "-o", help="MCAP file to write; it must not exist.")] = None
    depth_mm: Annotated[float | None, typer.Option(help="Maximum depth of the insertion.")] = None
    speed_mm_s: Annotated[float | None, typer.Option(help="Speed of insertion and withdrawal.")] = None
    hold_s: Annotated[float, typer.Option(help="Hold at the maximum depth.")] = 0.0
    start_mm: Annotated[float, typer.Option(help="Depth of the tip at the start and at the end.")] = -5.0
    duration_s: Annotated[float | None, typer.Option(help="Duration without motion; default: until Ctrl-C.")] = None
    source: Annotated[str | None, typer.Option("--from", help="Source other than a sensor: - for standard input.")] = (
        None
    )
    calibration: Annotated[Path | None, typer.Option(help="Calibration file of six gauge voltages.")] = None
    protocol: Annotated[str | None, typer.Option(help="Protocol of several runs: paper, or a file.")] = None
    folder: Annotated[Path | None, typer.Option(help="Folder for the recordings of a protocol.")] = None
    same_site: Annotated[bool, typer.Option("--same-site", help=SAME_SITE_HELP)] = False
    stop_at: Annotated[str | None, typer.Option(help=STOP_AT_HELP)] = None
    events: EventFlags
    part_s: Annotated[float, typer.Option(help="Time after which the recording continues in the next file.")] = math.inf
    part_readings: Annotated[int, typer.Option(help="Readings after which it does.")] = MAX_PART_SAMPLES
    plain: Annotated[bool, typer.Option("--plain", help="Print one line per second instead of a panel.")] = False
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None


@takes_flags()
def run(given: RecordFlags) -> None:
    """Record force and depth during a run, with bias, lost packets and clocks.

    A force limit stops the axis; Ctrl-C ends the recording and closes the file. Exit code 0: completed, stopped at the
    event of --stop-at, or ended by Ctrl-C; 1: without that event, or ended early for another reason, which is printed,
    and the data are kept; 2: could not start; 3: the axis was not seen to stop.
    """
    from ..acquisition.motion_sequence import EndReason
    from ..acquisition.recorder import record_run
    from ..acquisition.stop_at import parse_stop
    from ..protocol import read_protocol

    check_outputs([given.output, given.json])
    _check_usage(given)
    planned = read_protocol(given.protocol) if given.protocol else None  # before the network is used
    opened, settings = opened_rig(
        given,
        planned,
        given.calibration,
        duration=given.duration_s,
        part_samples=given.part_readings,
        part_time=given.part_s,
        stop_at=parse_stop(given.stop_at, given.events.settings()) if given.stop_at else None,
    )
    with live_view(given.plain) as view:
        if given.protocol:
            done = _run_protocol(planned, given.folder, opened, settings, view=view, same_site=given.same_site)
            write_json(done.to_json(), given.json)
            _exit(done.complete, done.rest_confirmed)
            return
        motion_flags = given.start_mm, given.depth_mm, given.speed_mm_s, given.hold_s
        moves = [] if given.depth_mm is None else moves_of(*motion_flags)
        card = {
            "needle": given.needle,
            "tissue": given.tissue,
            "rig": f"{given.sensor or 'standard input'}, {given.axis or 'no axis'}",
        }
        force, motion = opened()
        say_limits(motion, moves, settings)
        outcome = record_run(given.output, force, motion, moves=moves, card=card, settings=settings, view=view)
    completed = [EndReason.DONE, EndReason.INTERRUPTED, EndReason.EVENT] + ([] if moves else [EndReason.SOURCE_ENDED])
    document = dataclasses.asdict(outcome) | {
        "path": str(outcome.path),
        "stop": outcome.stop and outcome.stop._asdict(),
    }
    try:
        write_json(document, given.json)
        _print_outcome(outcome)
    except BaseException:  # a closed terminal, a missing folder, Ctrl-C: the axis comes first
        _exit(True, outcome.rest_confirmed)
        raise
    missed = settings.stop_at is not None and outcome.ended == EndReason.DONE
    _exit(outcome.ended in completed and not missed, outcome.rest_confirmed)


def opened_rig(
    given: SourceFlags, planned: "Protocol | None" = None, calibration: Path | None = None, **chosen: Any
) -> tuple[Callable[[], tuple], "Settings"]:
    """What opens force source and axis for a run, and the settings of the run."""
    from ..acquisition.settings import Settings

    opened, configuration = open_sources(given.sensor, given.sensor_page, given.axis, calibration)
    wanted = given.force_limit_n if given.force_limit_n is not None or planned is None else planned.force_limit
    limit, source = force_limit(wanted, configuration, planned.axial if planned else given.axial, given.axis)
    return opened, Settings(
        force_limit=limit,
        limit_source=source,
        max_force_gap=given.max_force_gap_s,
        bias_time=given.bias_s,
        axial=given.axial,
        filter_length=given.filter_length,
        steady=given.steady_n,
        frozen_check=given.frozen_check,
        **chosen,
    )


def _exit(completed: bool, rest_confirmed: bool) -> None:
    """The exit code: an axis that was not seen to stop comes before all else."""
    if not rest_confirmed:
        raise typer.Exit(3)
    if not completed:
        raise typer.Exit(1)


def say_limits(axis: "MotionAxis", moves: list[tuple[float, float]], settings: "Settings") -> None:
    """Print the force limit, and the distances within which the axis must stop, for the fastest of the moves."""
    from ..acquisition.axis_check import stop_distance

    text = f"force limit {settings.force_limit:.4g} N ({settings.limit_source})"
    # a move to where the one before ends is a hold, and its second number a time
    speeds = [move[1] for before, move in zip([None, *moves], moves) if before is None or move[0] != before[0]]
    if speeds:
        speed = min(axis.limits.max_speed, max(speeds))
        text += f"; a stop from {1e3 * speed:g} mm/s takes at most {1e3 * stop_distance(axis.limits, speed):.2f} mm"
        if settings.stop_at:
            text += f", {1e3 * settings.stop_at.farthest(axis.limits, speed):.2f} mm past the peak of a puncture"
    say(text)


def _check_usage(given: RecordFlags) -> None:
    """Raise InputError for options that cannot be combined."""
    one, both, to_axis = "exactly one of the two is needed", "both are needed", "Give --axis HOST:PORT."
    protocol, moves, no_axis = given.protocol is not None, given.depth_mm is not None, given.axis is None
    gauges = given.calibration is not None
    faults = [
        ((given.sensor is None) == (given.source is None), "--sensor and --from -", one, "Give one of them."),
        (given.source not in (None, "-"), f"--from is {given.source!r}", "only - is known", "Give --from -."),
        ((given.output is not None) == protocol, "--output and --protocol", one, "Give one of them."),
        (protocol != (given.folder is not None), "--protocol and --folder", both, "Give both or neither."),
        (moves != (given.speed_mm_s is not None), "--depth-mm and --speed-mm-s", both, "Give both."),
        (moves and no_axis, "--depth-mm", "it needs --axis", to_axis),
        (protocol and no_axis, "--protocol", "it needs --axis", to_axis),
        (protocol and moves, "--depth-mm", "the protocol has its own", "Leave it out."),
        (given.duration_s is not None and (moves or protocol), "--duration-s", "a motion has its own end",
         "Leave it out."),
        (given.stop_at is not None and not moves, "--stop-at", "it needs --depth-mm, the farthest the needle may go",
         "Give --depth-mm and --speed-mm-s."),
        (gauges and given.source is None, "--calibration", "it needs --from -", "Give --from -."),
    ]  # fmt: skip
    for is_wrong, quantity, limit, advice in faults:
        if is_wrong:
            raise InputError(quantity, "", limit, next_step=advice)


def moves_of(start_mm: float, depth_mm: float, speed_mm_s: float, hold_s: float) -> list[tuple[float, float]]:
    """The motion: to the start, insertion, hold, withdrawal."""
    start, depth, speed = 1e-3 * start_mm, 1e-3 * depth_mm, 1e-3 * speed_mm_s
    if not depth > start:
        limit = f"must be greater than --start-mm, which is {start_mm:g}"
        raise InputError("--depth-mm", depth_mm, limit, next_step="Give a greater depth, or another start.")
    return [(start, speed), (depth, speed), (depth, hold_s), (start, speed)]


def _run_protocol(
    planned: "Protocol",
    folder: Path,
    opened: Callable[[], tuple],
    settings: "Settings",
    *,
    view: "Callable[[Progress], None] | None",
    same_site: bool,
) -> "CampaignOutcome":
    from ..protocol import run_protocol

    def confirm(question: str) -> bool:
        try:
            return typer.confirm(question)
        except typer.Abort:
            raise KeyboardInterrupt from None

    ask = confirm if sys.stdin and sys.stdin.isatty() else None
    return run_protocol(planned, folder, opened, settings, view=view, ask=ask, say=say, same_site=same_site)


def _print_outcome(outcome: "RunResult") -> None:
    """Print the result of a run in a few lines."""
    uncertainty = outcome.alignment_uncertainty
    if outcome.restarts:
        say(f"warning: the sensor's counter restarted {outcome.restarts} times: it was switched off or exchanged")
    clock = "unknown" if uncertainty is None else f"{1e3 * uncertainty:.3f} ms"
    say(f"{outcome.path}: {outcome.ended}" + (f": {outcome.detail}" if outcome.detail else ""))
    if outcome.past_event is not None:
        say(f"{1e3 * outcome.past_event:.3f} mm past it")
    say(f"{outcome.seconds:.1f} s, {outcome.received} readings, largest force {outcome.peak_force:.3f} N")
    counts = f"lost {outcome.lost}, duplicated {outcome.duplicated}, late {outcome.late}"
    say(f"packets: {counts}; uncertainty of the sensor's clock: {clock}")
    if outcome.unwritten:
        say(f"warning: {outcome.unwritten} readings arrived and are not in the file, which could not be written")
    if outcome.dropped:
        say(f"warning: {outcome.dropped} of the lost packets were dropped because this computer's buffer was full")
    for name in outcome.frozen_axes:
        say(f"warning: {name} froze: its values repeat more often than its noise at rest explains; check its cable")
    if outcome.buffer < 1.0:
        advice = "enlarge it with: sysctl -w net.core.rmem_max=4194304"
        say(f"warning: the receive buffer holds only {outcome.buffer:.2f} s of packets; {advice}")
    gap = f"{1e3 * outcome.longest_own_gap:.1f} ms"
    say(f"longest delay in this program: {gap}; processor load: {100 * outcome.cpu_share:.0f} %")


class Rates:
    """Sampling rate [Hz] and lost packets of the last second, computed from totals."""

    def __init__(self):
        self._before: list[Progress] = []

    def over_last_second(self, now: "Progress") -> tuple[float | None, int]:
        """Rate and losses up to ``now``; the rate is None in the first call."""
        self._before.append(now)
        while len(self._before) > 2 and now.seconds - self._before[1].seconds >= 1.0:
            self._before.pop(0)
        then = self._before[0]
        span = now.seconds - then.seconds
        return (now.received - then.received) / span if span > 0.0 else None, now.lost - then.lost


def facts(now: "Progress", rate: float | None, lost: int) -> list[tuple[str, str]]:
    """The displayed values as names and texts."""
    depth = "-" if now.depth is None else f"{1e3 * now.depth:8.2f} mm"
    return [
        ("time", f"{now.seconds:8.1f} s"),
        ("phase", now.phase or "-"),
        ("force", f"{now.force:8.3f} N"),
        ("depth", depth),
        ("rate", "-" if rate is None else f"{rate:8.0f} Hz"),
        ("lost", f"{now.lost} ({lost} in the last second)"),
        ("bias", f"{now.bias:8.3f} N"),
    ]


@contextlib.contextmanager
def live_view(plain: bool = False) -> Iterator[Callable[["Progress"], None] | None]:
    """A view for ``record_run``: one line per second if ``plain``, a panel in a terminal, otherwise None."""
    if plain:
        yield _lines()
    elif not sys.stderr.isatty():
        yield None
    else:
        with _panel() as view:
            yield view


def _lines() -> Callable[["Progress"], None]:
    rates, printed = Rates(), [-1]

    def view(now: "Progress") -> None:
        rate, lost = rates.over_last_second(now)
        if int(now.seconds) > printed[0]:
            printed[0] = int(now.seconds)
            print(", ".join(f"{name} {text.strip()}" for name, text in facts(now, rate, lost)), file=sys.stderr)

    return view


@contextlib.contextmanager
def _panel() -> Iterator[Callable[["Progress"], None]]:
    from rich.console import Console
    from rich.live import Live
    from rich.text import Text

    rates = Rates()
    with Live(console=Console(stderr=True), auto_refresh=False, transient=True) as live:

        def view(now: "Progress") -> None:
            rate, lost = rates.over_last_second(now)
            text = Text()
            for name, value in facts(now, rate, lost):
                style = "bold red" if name == "lost" and now.lost else "bold"
                text.append(f"{name:>6}  ").append(f"{value}\n", style=style)
            live.update(text, refresh=True)

        yield view
