# SPDX-License-Identifier: Apache-2.0
"""Reports of a steered needle: of its identification, of a plan, and of a simulated insertion."""

from functools import partial
from typing import Any

import numpy as np

from ..display.markup import Markup, element, join, listing, section, table
from ..steering import Plan, SteeredRun, SteeringFit
from ..steering.base_motion import COLUMNS
from ..steering.result import HEAD, SteeringResult
from ..vocabulary import __version__
from .canvas import drawing
from .frame import framed
from .steering_figures import loads_figure, motion_figure, path_figure, tips_figure

TIPS = (
    "Circles: measured tips. Lines: predicted from the motion of the base and the rows before it moves; orange of "
    "steered insertions, grey of unsteered ones. Below: measured less predicted."
)
PLAN_PATH = (
    "The path of the tip in three projections. Cross: target. Shade: 95 % region of the tip. Red: obstacles. The "
    "scales of the axes differ."
)
RUN_PATH = (
    "The path of the tip in three projections. Thin lines: the needle at some steps. Dashed: layer boundaries. The "
    "scales of the axes differ."
)
MOTION = "In each step the base first moves across and the needle rolls at rest, then it is pushed in."
LOADS = (
    "Axial force, + opposes insertion; it is 0 without a model of it. Lateral force and moment are those of the tissue "
    "on the needle at its base."
)


def steering_page(result: SteeringResult) -> str:
    """The report of an identification as HTML text."""
    sections = [
        section("Tips", _figure("tips", partial(tips_figure, fit=result), (430.0, 620.0), TIPS), name="tips")
        if isinstance(result, SteeringFit)
        else None,
        section(
            "Parameters",
            table(HEAD, result.rows(), class_="cards numbers dense"),
            listing(["Intervals assume that the model is right.", *result.remarks()], class_="note"),
            name="parameters",
        ),
        section("Insertions", *_insertions(result), name="insertions"),
        section("Needle", _needle(result.model.needle), name="needle"),
    ]
    return framed("An identified steered needle", _kicker("steering"), join([result.heading(), "."]), sections)


def plan_page(plan: Plan) -> str:
    """The report of a plan as HTML text."""
    depth, motion = plan.motion.depth, plan.motion
    rows = [
        (*(f"{value:.3f}" for value in row.values()), f"{1e3 * radius:.2f}", f"{force:.3f}")
        for row, radius, force in zip(motion.rows(), plan.tube(), plan.force)
    ]
    loads = partial(loads_figure, depth=depth, force=plan.force, wrench=plan.wrench)
    moved = partial(motion_figure, depth=depth, lateral=motion.lateral, roll=motion.roll)
    path = partial(path_figure, path=plan.path, plan=plan)
    sections = [
        section("Faults", listing(plan.faults), name="faults") if plan.faults else None,
        section("Path", _figure("path", path, (230.0, 620.0), PLAN_PATH), name="path"),
        section("Motion of the base", _figure("motion", moved, (230.0, 260.0), MOTION), name="motion"),
        section("Force and wrench", _figure("loads", loads, (220.0, 600.0), LOADS), name="loads"),
        section(
            "Table", table((*COLUMNS, "radius_95_mm", "axial_force_N"), rows, class_="numbers dense"), name="table"
        ),
    ]
    return framed("A planned insertion", _kicker("steering plan"), join([outcome(plan)]), sections)


def outcome(plan: Plan) -> str:
    """The plan in a sentence."""
    target = ", ".join(f"{1e3 * value:.2f}" for value in plan.target)
    within = f"within {1e3 * plan.tube()[-1]:.2f} mm with 95 %"
    end = f"The tip ends {1e3 * plan.miss:.2f} mm from the target at ({target}) mm, {within}"
    clear = ""
    if np.isfinite(plan.clearance):
        touched = ", which it may touch within its uncertainty" * (plan.uncertain_clearance < 0.0)
        clear = f", and stays {1e3 * plan.clearance:.2f} mm away from obstacles{touched}"
    return f"{end}{clear}." + " The plan has faults, listed below." * bool(plan.faults)


def run_page(run: SteeredRun) -> str:
    """The report of a simulated insertion as HTML text."""
    motion = run.motion
    drawn = partial(path_figure, path=run.tip, shapes=run.shapes, layers=run.layers)
    loads = partial(loads_figure, depth=motion.depth, force=run.force, wrench=run.wrench)
    moved = partial(motion_figure, depth=motion.depth, lateral=motion.lateral, roll=motion.roll)
    sections = [
        section("Path", _figure("path", drawn, (230.0, 620.0), RUN_PATH), name="path"),
        section("Force and wrench", _figure("loads", loads, (220.0, 600.0), LOADS), name="loads"),
        section("Motion of the base", _figure("motion", moved, (230.0, 260.0), MOTION), name="motion"),
    ]
    end = ", ".join(f"{1e3 * value:.2f}" for value in run.tip[-1])
    lost = " Some steps are invalid: the needle buckles, or a step is impossible." * bool(run.lost.any())
    summary = f"The tip ends at ({end}) mm, with an axial force of {run.force[-1]:.3f} N.{lost}"
    return framed("A simulated insertion", _kicker("steering"), join([summary]), sections)


def _kicker(what: str) -> str:
    return f"needleforce {__version__} · {what}"


def _figure(name: str, draw: Any, heights: tuple[float, float], caption: str) -> Markup:
    image = drawing(name, draw, heights, caption)
    return element("figure", element("div", image, class_="drawing"), element("figcaption", caption))


def _insertions(result: SteeringResult) -> list[Markup]:
    """What the fit leaves of each insertion, and what it would leave if it were left out."""
    heads, rows = insertion_table(result)
    notes: dict[str, list[str]] = {}
    for path in result.model.predictor.insertions:
        if path.note:
            notes.setdefault(path.note, []).append(path.name)
    remarks = [f"{note} ({', '.join(names)})" if len(notes) > 1 else note for note, names in notes.items()]
    return [table(tuple(heads), rows, class_="numbers dense"), *([listing(remarks, class_="note")] if remarks else [])]


def insertion_table(result: SteeringResult) -> tuple[list[str], list[list[str]]]:
    """Heads and cells of what the fit leaves of each insertion."""
    found = result.by_insertion()
    keys = list(dict.fromkeys(key for fields in found.values() for key in fields))
    rows = [[name, *(_cell(key, fields[key]) for key in keys)] for name, fields in found.items()]
    return ["insertion", *(_HEADS.get(key, key) for key in keys)], rows


_HEADS = {
    "rms_m": "error in the fit [mm]",
    "left_out_rms_m": "error when left out [mm]",
    "rms": "residual of fx, fy [N], tx, ty [N m]",
}


def _cell(key: str, value: Any) -> str:
    factor = 1e3 if key.endswith("_m") else 1.0
    return ", ".join(f"{factor * each:.3g}" for each in np.atleast_1d(np.asarray(value, dtype=float)))


def _needle(needle: Any) -> Markup:
    from ..display.tables import parameters_html

    return parameters_html(needle)
