# SPDX-License-Identifier: Apache-2.0
"""``needleforce steer``: simulate, identify and plan insertions of a needle that bends and is steered."""

import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import msgspec
import typer

from ..errors import InputError
from ..units import number_in
from .files import NEEDLE_HELP, PRESET_HELP
from .flags import takes_flags
from .output import JSON_HELP, ReportFlags, anonymous, check_outputs, say, show, table, write_file, write_json

if TYPE_CHECKING:
    from ..steering import Plan
    from ..steering.base_motion import BaseMotion
    from ..steering.obstacles import Obstacle

app = typer.Typer(help="Needles that bend and are steered: simulate, identify, plan.", no_args_is_help=True)
MODEL_HELP = "An identified needle: a file that steer identify --save wrote."
AXIAL_HELP = f"Laws of the axial force. {PRESET_HELP}"


class SteerSimulateFlags(msgspec.Struct, frozen=True, kw_only=True):
    """The flags of ``steer simulate``."""

    output: Annotated[Path, typer.Option("--output", "-o", help="Table to write (CSV), a row a step.")]
    model: Annotated[Path | None, typer.Option(help=f"{MODEL_HELP} Default: the steering rig.")] = None
    motion: Annotated[
        Path | None, typer.Option(help="Motion of the base: a table that steer plan wrote. Default: straight in.")
    ] = None
    depth_mm: Annotated[float, typer.Option(help="Depth of an insertion without --motion.")] = 100.0
    step_mm: Annotated[float, typer.Option(help="Travel between two motions of the base.")] = 5.0
    roll_deg: Annotated[float, typer.Option(help="Rotation of the needle without --motion.")] = 0.0
    insertions: Annotated[
        int, typer.Option(help="Of the rig: number of insertions, half of them steered at random.")
    ] = 6
    seed: Annotated[int, typer.Option(help="Of the rig: the same seed gives the same phantom and noise.")] = 1
    axial: Annotated[str | None, typer.Option(help=AXIAL_HELP)] = None
    page: ReportFlags


@app.command()
@takes_flags()
def simulate(given: SteerSimulateFlags) -> None:
    """Simulate insertions: of an identified needle, or tracked tips of the steering rig, to be identified."""
    import needleforce as nf

    check_outputs([given.output, given.page.check()], [given.model, given.motion])
    laws = nf.preset(given.axial) if given.axial else None
    if given.model is None:
        if given.page.report:
            step = "Identify the rig's table first."
            raise InputError("--report", str(given.page.report), "needs --model", next_step=step)
        _simulate_rig(
            given.output,
            given.motion,
            insertions=given.insertions,
            seed=given.seed,
            depths=_depths(given.depth_mm, given.step_mm),
            axial=laws,
        )
        return
    moves = _motion(given.motion, _depths(given.depth_mm, given.step_mm), given.roll_deg)
    run = nf.steering.simulate(nf.steering.load(given.model), moves, axial=laws)
    write_file("steps", given.output, run.write)
    given.page.write(run.report)
    if run.lost.any():
        say("warning: the needle buckles, or a step is impossible; see the column status")
    x, y, z = 1e3 * run.tip[-1]
    force = f", axial force {run.force[-1]:.3f} N" * bool(run.force.any())  # without laws of it, none is known
    show(f"{len(moves)} steps, tip at ({x:.2f}, {y:.2f}, {z:.2f}) mm{force}")


class SteerIdentifyFlags(msgspec.Struct, frozen=True, kw_only=True):
    """The flags of ``steer identify``."""

    needle: Annotated[str, typer.Option(help=NEEDLE_HELP)]
    only: Annotated[
        list[str],
        typer.Option("--only", help="Insertions of one tissue: whose name begins with this. Default: all."),
    ] = []
    model: Annotated[str | None, typer.Option(help="linear, or yielding (the default for tip paths).")] = None
    held: Annotated[str, typer.Option(help="guide at a fixed distance from the surface, or hub.")] = "guide"
    prior: Annotated[
        list[Path], typer.Option("--prior", help="Needle identified in another tissue, as --save wrote it.")
    ] = []
    length_unit: Annotated[str | None, typer.Option(help="Of all lengths, where the table states none.")] = None
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None
    page: ReportFlags
    save: Annotated[Path | None, typer.Option(help="Write the identified needle, for steer plan.")] = None


@app.command()
@takes_flags()
def identify(
    file: Annotated[Path, typer.Argument(help="Tip paths or shapes, a row a step or a point.", show_default=False)],
    given: SteerIdentifyFlags,
) -> None:
    """Identify tissue, tip force and guide of a steered needle from tracked tips or from shapes."""
    import needleforce as nf

    from ..preset_files.presets import needle_of

    check_outputs([given.json, given.page.check(), given.save], [file])
    measured = _named(_measured(file, given.length_unit), given.only)
    options: dict[str, Any] = {"model": given.model} if given.model else {}
    if isinstance(measured[0], nf.steering.TipPath):
        options["held"] = given.held
        if given.prior:
            options["prior"] = nf.steering.prior([nf.steering.load(file) for file in given.prior])
    elif given.prior:
        step = "Leave --prior out: shapes have none."
        raise InputError("--prior", str(given.prior[0]), "not for a table of shapes", next_step=step)
    elif given.held != "guide":
        step = "Leave --held out: the shapes begin where the needle is held."
        raise InputError("--held", given.held, "not for a table of shapes", next_step=step)
    with _progress_line("identifying") as progress:
        fit = nf.steering.identify(measured, needle_of(given.needle), progress=progress, **options)
    write_json(fit.to_json(), given.json)
    given.page.write(fit.report)
    write_file("model", given.save, fit.save)
    if given.json != "-":
        table(fit.heading(), *fit.cells())
        table("residual of each insertion", *fit.insertion_table())
    for remark in fit.remarks():
        say(remark)


class SteerPlanFlags(msgspec.Struct, frozen=True, kw_only=True):
    """The flags of ``steer plan``."""

    target_mm: Annotated[str, typer.Option(help="x,y,z of the target from the point of entry, such as 2,-1,80.")]
    sphere_mm: Annotated[list[str], typer.Option(help="Obstacle: x,y,z,radius. Repeat it for more.")] = []
    box_mm: Annotated[list[str], typer.Option(help="Obstacle: x,y,z of two opposite corners.")] = []
    clearance_mm: Annotated[float, typer.Option(help="Distance to keep from obstacles.")] = 0.0
    max_lateral_mm: Annotated[float, typer.Option(help="Motion of the base across, along x and along y.")] = 6.0
    max_lateral_step_mm: Annotated[float, typer.Option(help="The same in one step.")] = 6.0
    rolls: Annotated[bool, typer.Option("--rolls", help="The needle may be turned between the steps.")] = False
    max_force_n: Annotated[float, typer.Option(help="Axial force; needs --axial.")] = math.inf
    max_lateral_force_n: Annotated[float, typer.Option(help="Lateral force at the base.")] = math.inf
    max_moment_nmm: Annotated[float, typer.Option(help="Bending moment at the base.")] = math.inf
    step_mm: Annotated[float, typer.Option(help="Travel between two motions of the base.")] = 5.0
    axial: Annotated[str | None, typer.Option(help=AXIAL_HELP)] = None
    measured: Annotated[
        Path | None, typer.Option(help="Tips of the steps that were executed; the rest is planned anew.")
    ] = None
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Table of base motions to write (CSV).")] = None
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None
    page: ReportFlags


@app.command()
@takes_flags()
def plan(model: Annotated[Path, typer.Argument(help=MODEL_HELP, show_default=False)], given: SteerPlanFlags) -> None:
    """Plan the motion of the base that brings the tip to a target. Exit code 1: it is missed, or a limit exceeded."""
    import needleforce as nf

    from ..steering import SteeringLimits

    check_outputs([given.output, given.json, given.page.check()], [model, given.measured])
    readings = None if given.measured is None else nf.steering.read(given.measured)[-1]
    for doubt in readings.doubts if readings else ():
        say(f"{'the insertion' if anonymous.wanted else readings.name}: {doubt}")
    limits = SteeringLimits(
        max_lateral=1e-3 * given.max_lateral_mm,
        max_lateral_step=1e-3 * given.max_lateral_step_mm,
        rolls=given.rolls,
        max_force=given.max_force_n,
        max_lateral_force=given.max_lateral_force_n,
        max_moment=1e-3 * given.max_moment_nmm,
    )
    with _progress_line("planning") as progress:
        found = nf.steering.plan(
            nf.steering.load(model),
            _numbers(given.target_mm, 3, "--target-mm"),
            obstacles=_obstacles(given.sphere_mm, given.box_mm),
            clearance=1e-3 * given.clearance_mm,
            limits=limits,
            step=1e-3 * given.step_mm,
            readings=readings,
            axial=nf.preset(given.axial) if given.axial else None,
            progress=progress,
        )
    write_json(found.to_json(), given.json)
    write_file("motion", given.output, found.motion.write)
    given.page.write(found.report)
    _show_plan(found, quiet=given.json == "-")
    if found.faults:
        raise typer.Exit(1)


def _simulate_rig(output: Path, motion: Path | None, *, insertions: int, seed: int, depths: Any, axial: Any) -> None:
    """Tracked tips of insertions of the steering rig: along a motion, or half of them steered at random."""
    import numpy as np

    from ..checks import random_seed
    from ..rig import SteeringPhantom, steering_insertion, write_steering

    if not 1 <= insertions <= 1000:
        raise InputError("--insertions", insertions, "must be 1 to 1000", next_step="Give 6.")
    rng, made = np.random.default_rng(random_seed(seed, "--seed")), []
    for number in range(insertions):
        moves = _motion(motion, depths, 0.0)
        insertion, base = steering_insertion(seed, number, SteeringPhantom(), axial=axial), np.zeros(2)
        for row, (depth, lateral, roll) in enumerate(zip(moves.depth, moves.lateral, moves.roll)):
            if motion is None and number >= insertions // 2 and row >= 2:
                base = np.clip(base + rng.normal(0.0, 1.2e-3, 2), -6e-3, 6e-3)
            insertion.advance(float(depth), lateral + base, float(roll))
        made.append(insertion)
    write_steering(made, output)
    show(f"{output}: {insertions} insertions of the steering rig, seed {seed}")


def _depths(depth_mm: float, step_mm: float) -> Any:
    import numpy as np

    if not (step_mm > 0.0 and 0.0 < depth_mm / step_mm <= 1000.0):
        raise InputError("--step-mm", f"{step_mm:g}", "must be above 0, at most 1000 steps", next_step="Give 5.")
    return 1e-3 * step_mm * np.arange(math.floor(depth_mm / step_mm + 1e-9) + 1)


def _motion(file: Path | None, depths: Any, roll_deg: float) -> "BaseMotion":
    import numpy as np

    from ..steering.base_motion import BaseMotion

    if file is not None:
        return BaseMotion.read(file)
    return BaseMotion(depths, np.zeros((len(depths), 2)), np.full(len(depths), math.radians(roll_deg)))


def _measured(file: Path, unit: str | None) -> list:
    """Tip paths or shapes of a file, by its columns."""
    from ..steering import read, read_shapes

    try:
        return read(file, unit=unit)
    except InputError as paths:
        try:
            return read_shapes(file, unit=unit)
        except InputError:
            raise paths from None


def _named(measured: list, names: list[str]) -> list:
    chosen = [each for each in measured if not names or any(each.name.startswith(name) for name in names)]
    if anonymous.wanted and chosen:
        return [replace(each, name=f"insertion {number}") for number, each in enumerate(chosen, 1)]
    if not chosen:
        given = ", ".join(each.name for each in measured[:8]) + ", …" * (len(measured) > 8)
        raise InputError(
            "--only", ", ".join(names), "no insertion has a name that begins with it", next_step=f"There are {given}."
        )
    return chosen


def _numbers(text: str, count: int, option: str) -> tuple[float, ...]:
    """Lengths in mm as m."""
    try:
        values = tuple(1e-3 * number_in(part) for part in text.split(","))
    except ValueError:
        values = ()
    if len(values) != count:
        limit = f"must be {count} numbers with commas"
        raise InputError(
            option, repr(text), limit, next_step=f"Write for example {option} {','.join('123456'[:count])}."
        )
    return values


def _obstacles(spheres: list[str], boxes: list[str]) -> "list[Obstacle]":
    from ..steering import Box, Sphere

    found: list[Obstacle] = []
    for text in spheres:
        x, y, z, radius = _numbers(text, 4, "--sphere-mm")
        found.append(Sphere((x, y, z), radius))
    for text in boxes:
        corners = _numbers(text, 6, "--box-mm")
        low, high = (tuple(f(pair) for pair in zip(corners[:3], corners[3:])) for f in (min, max))
        found.append(Box(low, high))  # type: ignore[arg-type]
    return found


def _show_plan(found: "Plan", quiet: bool) -> None:
    if not quiet:
        table("motion of the base", *found.cells())
    say(found.heading())
    for fault in found.faults:
        say(f"fault: {fault}")


@contextmanager
def _progress_line(what: str) -> "Iterator[Callable[[int, float], None] | None]":
    """Progress on standard error while something is sought: a line in a terminal, nothing otherwise."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console

    with Console(stderr=True).status(what) as status:
        yield lambda calls, cost: status.update(f"{what}: {calls} simulations, cost {cost:.4g}")
