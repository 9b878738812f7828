# SPDX-License-Identifier: Apache-2.0
"""``needleforce record``: record a sensor and an axis to a file during the run."""

import contextlib
import dataclasses
import math
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..acquisition.settings import Progress
from ..errors import InputError
from .output import JSON_HELP, check_outputs, say, write_json

if TYPE_CHECKING:
    from ..acquisition.settings import RunResult, Settings
    from ..acquisition.sources.standard_input import StandardInput
    from ..protocol.protocol import Protocol
    from ..protocol.session import CampaignOutcome

NAME = "record"
SENSOR_HELP = "HOST or HOST:PORT of a Net F/T sensor (RDT over UDP)."
PAGE_HELP = "Configuration of the sensor: a URL or a saved netftapi2.xml; default: the page of the sensor's host."
DEFAULT_LIMIT_SHARE = 0.8  # of the sensor's rated range: the default force limit


DEFAULT_LIMIT = f"{100 * DEFAULT_LIMIT_SHARE:g} % of the sensor's rated range"
LIMIT_HELP = f"Axial force minus bias at which the axis stops; default: {DEFAULT_LIMIT}."
SAME_SITE_HELP = "If no spare site is left, insert into the hole of an aborted run."


def run(
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="MCAP file to write; it must not exist.")
    ] = None,
    sensor: Annotated[str | None, typer.Option(help=SENSOR_HELP)] = None,
    sensor_page: Annotated[str, typer.Option(help=PAGE_HELP)] = "",
    axis: Annotated[str | None, typer.Option(help="HOST or HOST:PORT of a motion axis.")] = None,
    depth_mm: Annotated[float | None, typer.Option(help="Maximum depth of the insertion.")] = None,
    speed_mm_s: Annotated[float | None, typer.Option(help="Speed of insertion and withdrawal.")] = None,
    hold_s: Annotated[float, typer.Option(help="Hold at the maximum depth.")] = 0.0,
    start_mm: Annotated[float, typer.Option(help="Depth of the tip at the start and at the end.")] = -5.0,
    duration_s: Annotated[float | None, typer.Option(help="Duration without motion; default: until Ctrl-C.")] = None,
    force_limit_n: Annotated[float | None, typer.Option("--force-limit-N", help=LIMIT_HELP)] = None,
    steady_n: Annotated[float, typer.Option("--steady-N", help="Largest change of the force during the bias.")] = 0.05,
    bias_s: Annotated[float, typer.Option(help="Time at rest to measure the bias; 0 for none.")] = 0.5,
    axial: Annotated[str, typer.Option(help="Axis of the sensor along the needle: fz, -fz, fx, …")] = "fz",
    filter_length: Annotated[int, typer.Option(help="Samples in the sensor's average filter.")] = 1,
    source: Annotated[
        str | None, typer.Option("--from", help="Source other than a sensor: - for standard input.")
    ] = None,
    calibration: Annotated[Path | None, typer.Option(help="Calibration file of six gauge voltages.")] = None,
    protocol: Annotated[str | None, typer.Option(help="Protocol of several runs: paper, or a file.")] = None,
    folder: Annotated[Path | None, typer.Option(help="Folder for the recordings of a protocol.")] = None,
    same_site: Annotated[bool, typer.Option("--same-site", help=SAME_SITE_HELP)] = False,
    needle: Annotated[str, typer.Option(help="Description of the needle, for the card.")] = "",
    tissue: Annotated[str, typer.Option(help="Description of the tissue, for the card.")] = "",
    plain: Annotated[bool, typer.Option("--plain", help="Print one line per second instead of a panel.")] = False,
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None,
) -> None:
    """Record force and depth during a run, with bias, lost packets and clocks.

    A force limit stops the axis; Ctrl-C ends the recording and closes the file. Exit code 0: completed, or ended by
    Ctrl-C; 1: ended early for another reason, which is printed, and the data are kept; 2: could not start.
    """
    from ..acquisition.motion_sequence import EndReason
    from ..acquisition.recorder import record_run
    from ..acquisition.settings import Settings
    from ..protocol import read_protocol

    check_outputs([output, json])
    _check_usage(
        output=output,
        sensor=sensor,
        source=source,
        axis=axis,
        protocol=protocol,
        folder=folder,
        depth_mm=depth_mm,
        speed_mm_s=speed_mm_s,
        duration_s=duration_s,
        calibration=calibration,
    )
    planned = read_protocol(protocol) if protocol else None  # before the network is used
    open_sources, rating = sources(sensor, sensor_page, axis, calibration, axial)
    settings = Settings(
        force_limit=force_limit(force_limit_n, rating, axis if protocol is None else None),
        bias_time=bias_s,
        duration=duration_s,
        axial=axial,
        filter_length=filter_length,
        steady=steady_n,
    )
    with live_view(plain) as view:
        if protocol:
            done = _run_protocol(planned, folder, open_sources, settings, view=view, same_site=same_site)
            write_json(done.to_json(), json)
            if not done.complete:
                raise typer.Exit(1)
            return
        moves = [] if depth_mm is None else _moves(start_mm, depth_mm, speed_mm_s, hold_s)
        card = {"needle": needle, "tissue": tissue, "rig": f"{sensor or 'standard input'}, {axis or 'no axis'}"}
        force, motion = open_sources()
        outcome = record_run(output, force, motion, moves=moves, card=card, settings=settings, view=view)
    _print_outcome(outcome, json)
    if outcome.ended not in (EndReason.DONE, "interrupted", "source ended"):
        raise typer.Exit(1)


def _check_usage(
    *,
    output: Path | None,
    sensor: str | None,
    source: str | None,
    axis: str | None,
    protocol: str | None,
    folder: Path | None,
    depth_mm: float | None,
    speed_mm_s: float | None,
    duration_s: float | None,
    calibration: Path | None,
) -> None:
    """Raise InputError for options that cannot be combined."""
    one, moves = "exactly one of the two is needed", (depth_mm, protocol) != (None, None)
    faults = [
        ((sensor is None) == (source is None), "--sensor and --from -", one, "Give one of them."),
        (source not in (None, "-"), f"--from is {source!r}", "only - is known", "Give --from -."),
        ((output is None) == (protocol is None), "--output and --protocol", one, "Give one of them."),
        ((protocol is None) != (folder is None), "--protocol and --folder", "both are needed", "Give both or neither."),
        ((depth_mm is None) != (speed_mm_s is None), "--depth-mm and --speed-mm-s", "both are needed", "Give both."),
        (depth_mm is not None and axis is None, "--depth-mm", "it needs --axis", "Give --axis HOST:PORT."),
        (protocol is not None and axis is None, "--protocol", "it needs --axis", "Give --axis HOST:PORT."),
        (protocol is not None and depth_mm is not None, "--depth-mm", "the protocol has its own", "Leave it out."),
        (duration_s is not None and moves, "--duration-s", "a motion has its own end", "Leave it out."),
        (calibration is not None and source is None, "--calibration", "it needs --from -", "Give --from -."),
    ]
    for is_wrong, quantity, limit, advice in faults:
        if is_wrong:
            raise InputError(quantity, "", limit, next_step=advice)


def _moves(start_mm: float, depth_mm: float, speed_mm_s: float, hold_s: float) -> list[tuple[float, float]]:
    """The motion: to the start, insertion, hold, withdrawal."""
    start, depth, speed = 1e-3 * start_mm, 1e-3 * depth_mm, 1e-3 * speed_mm_s
    if not depth > start:
        limit = f"must be greater than --start-mm, which is {start_mm:g}"
        raise InputError("--depth-mm", depth_mm, limit, next_step="Give a greater depth, or another start.")
    return [(start, speed), (depth, speed), (depth, hold_s), (start, speed)]


def _run_protocol(
    planned: "Protocol",
    folder: Path,
    open_sources: Callable[[], tuple],
    settings: "Settings",
    *,
    view: Callable[[Progress], None] | None,
    same_site: bool,
) -> "CampaignOutcome":
    from ..protocol import run_protocol

    ask = typer.confirm if sys.stdin and sys.stdin.isatty() else None
    return run_protocol(planned, folder, open_sources, settings, view=view, ask=ask, say=say, same_site=same_site)


def _print_outcome(outcome: "RunResult", json: str | None) -> None:
    """Print the result of a run in a few lines."""
    write_json(dataclasses.asdict(outcome) | {"path": str(outcome.path)}, json)
    uncertainty = outcome.alignment_uncertainty
    clock = "unknown" if uncertainty is None else f"{1e3 * uncertainty:.3f} ms"
    say(f"{outcome.path}: {outcome.ended}" + (f": {outcome.detail}" if outcome.detail else ""))
    say(f"{outcome.seconds:.1f} s, {outcome.received} readings, largest force {outcome.peak_force:.3f} N")
    counts = f"lost {outcome.lost}, duplicated {outcome.duplicated}, late {outcome.late}"
    say(f"packets: {counts}; uncertainty of the sensor's clock: {clock}")
    if outcome.dropped:
        say(f"warning: {outcome.dropped} of the lost packets were dropped because this computer's buffer was full")
    if outcome.buffer < 1.0:
        advice = "enlarge it with: sysctl -w net.core.rmem_max=4194304"
        say(f"warning: the receive buffer holds only {outcome.buffer:.2f} s of packets; {advice}")
    gap = f"{1e3 * outcome.longest_own_gap:.1f} ms"
    say(f"longest delay in this program: {gap}; processor load: {100 * outcome.cpu_share:.0f} %")


def sources(
    sensor: str | None, page: str, axis: str | None, calibration: Path | None, axial: str
) -> tuple[Callable[[], tuple], float]:
    """A function that opens force source and axis for a run, and the rated range [N] of the axial force, 0 if unknown.

    ``sensor`` None means standard input. Raises InputError for an invalid address and for an incomplete configuration.
    """
    from ..acquisition.sources.axis import AxisClient
    from ..acquisition.sources.net_ft_sensor import SensorClient, read_configuration
    from ..wire import axis_lines, rdt

    axis_address = address(axis, axis_lines.PORT) if axis else None
    if sensor is None:
        lines = _standard_input(calibration)  # one for all runs, because the header arrives once
        return lambda: (lines, AxisClient(*axis_address) if axis_address else None), 0.0
    host, port = address(sensor, rdt.PORT)
    configuration = read_configuration(host, page)
    column = rdt.AXES.index(axial.removeprefix("-")) if axial.removeprefix("-") in rdt.AXES else 0
    rating = configuration.ratings[column]
    return lambda: (
        SensorClient(host, port, configuration),
        AxisClient(*axis_address) if axis_address else None,
    ), rating


def _standard_input(calibration: Path | None) -> "StandardInput":
    from ..acquisition.sources.gauge_calibration import read_calibration
    from ..acquisition.sources.standard_input import StandardInput

    if sys.stdin is None:
        raise InputError("standard input", "closed", next_step="Pipe the output of a program into this command.")
    return StandardInput(sys.stdin.buffer, read_calibration(calibration) if calibration else None)


def address(text: str, port: int) -> tuple[str, int]:
    """HOST and PORT of HOST[:PORT]. Raises InputError for an invalid port."""
    host, colon, number = text.rpartition(":")
    if not colon:
        return text, port
    if not number.isdecimal() or not 0 < int(number) < 65536 or not host:
        limit = "HOST or HOST:PORT is needed, with a port from 1 to 65535"
        raise InputError("address", repr(text), limit, next_step="Correct the address.")
    return host, int(number)


def force_limit(given: float | None, rating: float, axis: str | None) -> float:
    """The force limit [N]: ``given``, or a share of the rated range. Raises InputError for an axis without a limit."""
    if given is not None:
        return given
    if rating:
        return DEFAULT_LIMIT_SHARE * rating
    if axis:
        limit = "an axis needs a force limit, and the sensor's configuration has no rated range"
        raise InputError("--force-limit-N", "not given", limit, next_step="Give --force-limit-N.")
    return math.inf


class Rates:
    """Sampling rate [Hz] and lost packets of the last second, computed from totals."""

    def __init__(self):
        self._before: list[Progress] = []

    def over_last_second(self, now: Progress) -> tuple[float | None, int]:
        """Rate and losses up to ``now``; the rate is None in the first call."""
        self._before.append(now)
        while len(self._before) > 2 and now.seconds - self._before[1].seconds >= 1.0:
            self._before.pop(0)
        then = self._before[0]
        span = now.seconds - then.seconds
        return (now.received - then.received) / span if span > 0.0 else None, now.lost - then.lost


def facts(now: Progress, rate: float | None, lost: int) -> list[tuple[str, str]]:
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
def live_view(plain: bool = False) -> Iterator[Callable[[Progress], None] | None]:
    """A view for ``record_run``: one line per second if ``plain``, a panel in a terminal, otherwise None."""
    if plain:
        yield _lines()
    elif not sys.stderr.isatty():
        yield None
    else:
        with _panel() as view:
            yield view


def _lines() -> Callable[[Progress], None]:
    rates, printed = Rates(), [-1]

    def view(now: Progress) -> None:
        rate, lost = rates.over_last_second(now)
        if int(now.seconds) > printed[0]:
            printed[0] = int(now.seconds)
            print(", ".join(f"{name} {text.strip()}" for name, text in facts(now, rate, lost)), file=sys.stderr)

    return view


@contextlib.contextmanager
def _panel() -> Iterator[Callable[[Progress], None]]:
    from rich.console import Console
    from rich.live import Live
    from rich.text import Text

    rates = Rates()
    with Live(console=Console(stderr=True), auto_refresh=False, transient=True) as live:

        def view(now: Progress) -> None:
            rate, lost = rates.over_last_second(now)
            text = Text()
            for name, value in facts(now, rate, lost):
                style = "bold red" if name == "lost" and now.lost else "bold"
                text.append(f"{name:>6}  ").append(f"{value}\n", style=style)
            live.update(text, refresh=True)

        yield view
