# SPDX-License-Identifier: Apache-2.0
"""``needleforce record``: from a sensor and an axis to a file, while it happens."""

import contextlib
import dataclasses
import math
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated

import typer

from ..acquisition.settings import Progress
from ..errors import InputError
from .output import JSON_HELP, check_outputs, say, write_json

NAME = "record"
SENSOR_HELP = "HOST or HOST:PORT of a Net F/T sensor (RDT over UDP)."
PAGE_HELP = "The sensor's configuration: a URL, or a saved netftapi2.xml; without it the page of the sensor's host."
SHARE = 0.8  # of the rating of a sensor: the force limit where none is given


LIMIT_HELP = f"Axial force without bias at which the axis is stopped; without it {SHARE:g} of the sensor's rating."
SAME_SITE_HELP = "Where no spare site is left, insert into the hole of a run that was broken off."


def run(
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="The MCAP file to write; must not exist.")
    ] = None,
    sensor: Annotated[str | None, typer.Option(help=SENSOR_HELP)] = None,
    sensor_page: Annotated[str, typer.Option(help=PAGE_HELP)] = "",
    axis: Annotated[str | None, typer.Option(help="HOST or HOST:PORT of a motion axis.")] = None,
    depth_mm: Annotated[float | None, typer.Option(help="Deepest point of the insertion.")] = None,
    speed_mm_s: Annotated[float | None, typer.Option(help="Speed of both strokes.")] = None,
    hold_s: Annotated[float, typer.Option(help="Rest at the deepest point.")] = 0.0,
    start_mm: Annotated[float, typer.Option(help="Where the tip starts and ends.")] = -5.0,
    duration_s: Annotated[float | None, typer.Option(help="How long, where no axis moves; else until Ctrl-C.")] = None,
    force_limit_n: Annotated[float | None, typer.Option("--force-limit-N", help=LIMIT_HELP)] = None,
    steady_n: Annotated[float, typer.Option("--steady-N", help="How far the force may wander during the bias.")] = 0.05,
    bias_s: Annotated[float, typer.Option(help="Time at rest for the bias; 0 for none.")] = 0.5,
    axial: Annotated[str, typer.Option(help="The sensor's axis along the needle: fz, -fz, fx, …")] = "fz",
    filter_length: Annotated[int, typer.Option(help="Samples in the sensor's average filter.")] = 1,
    source: Annotated[str | None, typer.Option("--from", help="- for lines on standard input.")] = None,
    calibration: Annotated[Path | None, typer.Option(help="Calibration of six gauge voltages.")] = None,
    protocol: Annotated[str | None, typer.Option(help="paper, or a protocol file.")] = None,
    folder: Annotated[Path | None, typer.Option(help="Folder for the recordings of a protocol.")] = None,
    same_site: Annotated[bool, typer.Option("--same-site", help=SAME_SITE_HELP)] = False,
    needle: Annotated[str, typer.Option(help="For the card of the recording.")] = "",
    tissue: Annotated[str, typer.Option(help="For the card of the recording.")] = "",
    plain: Annotated[bool, typer.Option("--plain", help="A line a second instead of a panel.")] = False,
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None,
) -> None:
    """Record force and depth, with bias, losses and clocks; a force limit stops the axis, Ctrl-C ends cleanly.

    Exit code 0: done, or ended by Ctrl-C; 1: ended by something else, with what there is kept; 2: could not begin.
    """

    from ..acquisition.motion_sequence import EndReason
    from ..acquisition.recorder import record_run
    from ..acquisition.settings import Settings
    from ..protocol import read_protocol

    check_outputs([output, json])
    _check_usage(output, sensor, source, axis, protocol, folder, depth_mm, speed_mm_s, duration_s, calibration)
    planned = read_protocol(protocol) if protocol else None  # before anything is asked of the network
    open_sources, rating = sources(sensor, sensor_page, axis, calibration, axial)
    settings = Settings(
        force_limit(force_limit_n, rating, axis if protocol is None else None),
        bias_s,
        duration_s,
        axial=axial,
        filter_length=filter_length,
        steady=steady_n,
    )
    with live_view(plain) as view:
        if protocol:
            _run_protocol(planned, folder, open_sources, settings, view, same_site, json)
            return
        moves = [] if depth_mm is None else _moves(start_mm, depth_mm, speed_mm_s, hold_s)
        card = {"needle": needle, "tissue": tissue, "rig": f"{sensor or 'standard input'}, {axis or 'no axis'}"}
        outcome = record_run(output, *open_sources(), moves, card, settings, view=view)
    _tell(outcome, json)
    if outcome.ended not in (EndReason.DONE, "interrupted", "source ended"):
        raise typer.Exit(1)


def _check_usage(output, sensor, source, axis, protocol, folder, depth_mm, speed_mm_s, duration_s, calibration) -> None:
    """Refuse options that do not go together."""
    wrong = [
        ((sensor is None) == (source is None), "--sensor and --from -", "one of the two is needed"),
        (source not in (None, "-"), "--from", "only - is known"),
        ((output is None) == (protocol is None), "--output and --protocol", "one of the two is needed"),
        ((protocol is None) != (folder is None), "--protocol", "it goes with --folder"),
        ((depth_mm is None) != (speed_mm_s is None), "--depth-mm", "it goes with --speed-mm-s"),
        (depth_mm is not None and axis is None, "--depth-mm", "it needs --axis"),
        (protocol is not None and axis is None, "--protocol", "it needs --axis"),
        (protocol is not None and depth_mm is not None, "--depth-mm", "the protocol has its own"),
        (duration_s is not None and (depth_mm, protocol) != (None, None), "--duration-s", "a motion has its own end"),
        (calibration is not None and source is None, "--calibration", "it goes with --from -"),
    ]
    for is_wrong, quantity, limit in wrong:
        if is_wrong:
            raise InputError(quantity, "", limit)


def _moves(start_mm: float, depth_mm: float, speed_mm_s: float, hold_s: float) -> list[tuple[float, float]]:
    """To the start, in, a rest, and out again."""
    start, depth, speed = 1e-3 * start_mm, 1e-3 * depth_mm, 1e-3 * speed_mm_s
    if not depth > start:
        raise InputError("--depth-mm", depth_mm, f"must be beyond --start-mm, {start_mm:g}")
    return [(start, speed), (depth, speed), (depth, hold_s), (start, speed)]


def _run_protocol(planned, folder: Path, open_sources, settings, view, same_site: bool, json: str | None) -> None:
    from ..protocol import run_protocol

    ask = typer.confirm if sys.stdin and sys.stdin.isatty() else None
    told = {"view": view, "ask": ask, "say": say, "same_site": same_site}
    done = run_protocol(planned, folder, open_sources, settings, **told)
    write_json(done.to_json(), json)
    if not done.complete:
        raise typer.Exit(1)


def _tell(outcome, json: str | None) -> None:
    """The run in a few lines."""
    write_json(dataclasses.asdict(outcome) | {"path": str(outcome.path)}, json)
    known = outcome.alignment_uncertainty
    clock = "unknown" if known is None else f"{1e3 * known:.3f} ms"
    say(f"{outcome.path}: {outcome.ended}" + (f": {outcome.detail}" if outcome.detail else ""))
    say(f"{outcome.seconds:.1f} s, {outcome.received} readings, largest force {outcome.peak_force:.3f} N")
    say(f"lost {outcome.lost}, doubled {outcome.doubled}, late {outcome.late}; clock of the sensor known to {clock}")
    if outcome.dropped:
        say(f"warning: of the lost, {outcome.dropped} packets found this computer's buffer full")
    if outcome.buffer < 1.0:
        say(f"warning: the buffer holds {outcome.buffer:.2f} s; more with: sysctl -w net.core.rmem_max=4194304")
    say(f"longest own gap {1e3 * outcome.longest_own_gap:.1f} ms, {100 * outcome.cpu_share:.0f} % of a processor")


def sources(sensor: str | None, page: str, axis: str | None, calibration: Path | None, axial: str):
    """A function that opens force source and axis for a run, and the rating [N] of the axial force, 0 where unknown.

    ``sensor`` None is standard input. Raises InputError for an address that is none, and for a page without counts.
    """
    from ..acquisition.sources.axis import AxisClient
    from ..acquisition.sources.net_ft_sensor import SensorClient, read_configuration
    from ..wire import axis_lines, rdt

    there = address(axis, axis_lines.PORT) if axis else None
    if sensor is None:
        lines = _standard_input(calibration)  # one for all runs: its header comes once
        return lambda: (lines, AxisClient(*there) if there else None), 0.0
    host, port = address(sensor, rdt.PORT)
    configuration = read_configuration(host, page)
    column = rdt.AXES.index(axial.removeprefix("-")) if axial.removeprefix("-") in rdt.AXES else 0
    ways = host, port, configuration
    return lambda: (SensorClient(*ways), AxisClient(*there) if there else None), configuration.ratings[column]


def _standard_input(calibration: Path | None):
    from ..acquisition.sources.gauge_calibration import read_calibration
    from ..acquisition.sources.standard_input import StandardInput

    if sys.stdin is None:
        raise InputError("standard input", "closed", "", "", "Pipe a program into it.")
    return StandardInput(sys.stdin.buffer, read_calibration(calibration) if calibration else None)


def address(text: str, port: int) -> tuple[str, int]:
    """HOST and PORT of HOST[:PORT]. Raises InputError for a port that is none."""
    host, colon, number = text.rpartition(":")
    if not colon:
        return text, port
    if not number.isdecimal() or not 0 < int(number) < 65536 or not host:
        raise InputError("address", repr(text), "HOST or HOST:PORT is needed, the port from 1 to 65535")
    return host, int(number)


def force_limit(given: float | None, rating: float, axis: str | None) -> float:
    """The force limit [N]: ``given``, or a share of the sensor's rating. InputError where an axis would have none."""
    if given is not None:
        return given
    if rating:
        return SHARE * rating
    if axis:
        raise InputError("--force-limit-N", "not given", "an axis needs one, and the sensor's page has no rating")
    return math.inf


class Rates:
    """Readings a second [Hz] and losses over the last second, from totals."""

    def __init__(self):
        self._before: list[Progress] = []

    def over_last_second(self, now: Progress) -> tuple[float | None, int]:
        """Rate and losses up to ``now``; no rate from a first look."""
        self._before.append(now)
        while len(self._before) > 2 and now.seconds - self._before[1].seconds >= 1.0:
            self._before.pop(0)
        then = self._before[0]
        span = now.seconds - then.seconds
        return (now.received - then.received) / span if span > 0.0 else None, now.lost - then.lost


def facts(now: Progress, rate: float | None, lost: int) -> list[tuple[str, str]]:
    """What is shown, as names and texts."""
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
    """A view for ``record_run``: a panel in a terminal, a line a second where ``plain``, else none."""
    if plain:
        yield _lines()
    elif not sys.stderr.isatty():
        yield None
    else:
        with _panel() as view:
            yield view


def _lines() -> Callable[[Progress], None]:
    rates, told = Rates(), [-1]

    def view(now: Progress) -> None:
        rate, lost = rates.over_last_second(now)
        if int(now.seconds) > told[0]:
            told[0] = int(now.seconds)
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
