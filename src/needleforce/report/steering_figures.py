# SPDX-License-Identifier: Apache-2.0
"""Figures of a steered needle: its path in three projections, loads over depth, measured and predicted tips."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

from ..steering import Box, Plan, Sphere, SteeringFit, TipPath
from .canvas import INK, MEASURED, MODEL, QUIET, SECOND, SLATE, THICK, THIN, Labels, Sheet, axis_names, panels

DEPTH = "depth [mm]"
BLOCKED = "#b23b3b"
_VIEWS = ((2, 0), (2, 1), (0, 1))  # horizontal and vertical axis of each projection
_NAMES = ("x", "y", "z")


def path_figure(
    figure: Figure,
    sheet: Sheet,
    *,
    path: np.ndarray,
    shapes: Sequence[np.ndarray] = (),
    layers: Sequence[float] = (),
    plan: Plan | None = None,
) -> None:
    """The path of the tip in three projections, with the needle at some steps and what a plan knows."""
    rows, columns = (3, 1) if sheet.narrow else (1, 3)
    margins = {"left": 46.0, "across": 46.0, "down": 50.0}
    for axes, (over, up) in zip(panels(figure, sheet, rows, columns, margins).ravel(), _VIEWS):
        for shape in shapes:
            axes.plot(1e3 * shape[:, over], 1e3 * shape[:, up], color=QUIET, lw=THIN)
        axes.plot(1e3 * path[:, over], 1e3 * path[:, up], color=MODEL, lw=THICK, zorder=4)
        if plan is not None:
            _draw_plan(axes, plan, over, up)
        for top in layers if over == 2 else ():
            axes.axvline(1e3 * top, color=QUIET, lw=0.6, ls=(0, (4, 2)))
        axis_names(axes, f"{_NAMES[over]} [mm]", f"{_NAMES[up]} [mm]")
        axes.margins(0.08, 0.25)


def _draw_plan(axes: Axes, plan: Plan, over: int, up: int) -> None:
    """Target, uncertainty and obstacles of a plan in one projection."""
    tube = 1e3 * plan.tube()
    path = 1e3 * plan.path
    if over == 2:
        axes.fill_between(path[:, 2], path[:, up] - tube, path[:, up] + tube, color=MODEL, alpha=0.13, lw=0.0)
    else:
        axes.add_patch(Circle((path[-1, over], path[-1, up]), tube[-1], color=MODEL, alpha=0.13, lw=0.0))
    for obstacle in plan.problem.obstacles:
        _draw_obstacle(axes, obstacle, over, up)
    target = 1e3 * plan.target
    axes.plot(target[over], target[up], marker="x", ms=7, mew=1.6, color=INK, zorder=5)


def _draw_obstacle(axes: Axes, obstacle: object, over: int, up: int) -> None:
    style = {"color": BLOCKED, "alpha": 0.25, "lw": 0.0}
    if isinstance(obstacle, Sphere):
        center = 1e3 * np.asarray(obstacle.center)
        axes.add_patch(Circle((center[over], center[up]), 1e3 * obstacle.radius, **style))
    elif isinstance(obstacle, Box):
        low, high = 1e3 * np.asarray(obstacle.low), 1e3 * np.asarray(obstacle.high)
        axes.add_patch(Rectangle((low[over], low[up]), high[over] - low[over], high[up] - low[up], **style))


def loads_figure(figure: Figure, sheet: Sheet, *, depth: np.ndarray, force: np.ndarray, wrench: np.ndarray) -> None:
    """Axial force, lateral force and bending moment at the base over depth."""
    curves = [
        ("axial force [N]", [("", force)]),
        ("lateral force at the base [N]", [("x", wrench[:, 0]), ("y", wrench[:, 1])]),
        ("moment at the base [N mm]", [("about x", 1e3 * wrench[:, 3]), ("about y", 1e3 * wrench[:, 4])]),
    ]
    rows, columns = (3, 1) if sheet.narrow else (1, 3)
    margins = {"left": 46.0, "across": 46.0, "down": 50.0}
    for axes, (name, lines) in zip(panels(figure, sheet, rows, columns, margins).ravel(), curves):
        drawn = []
        for (label, values), colour in zip(lines, (MODEL, SECOND)):
            axes.plot(1e3 * depth, values, color=colour, lw=THICK)
            drawn.append((label, (1e3 * depth, values), colour))
        axis_names(axes, DEPTH, name)
        labels = Labels(axes, [line for _, line, _ in drawn])
        for label, line, colour in drawn:
            if label:
                labels.on(label, *line, colour)


def motion_figure(figure: Figure, sheet: Sheet, *, depth: np.ndarray, lateral: np.ndarray, roll: np.ndarray) -> None:
    """What the base does over depth: motion across, and roll if it rolls."""
    rolls = bool(np.ptp(roll) > 1e-9)
    made = panels(figure, sheet, 1 + rolls, 1, {"left": 46.0, "down": 44.0}, sharex=True).ravel()
    lines = []
    for column, name, colour in zip(1e3 * lateral.T, _NAMES, (MODEL, SECOND)):
        made[0].step(1e3 * depth, column, where="pre", color=colour, lw=THICK)
        lines.append((name, (1e3 * depth, column), colour))
    axis_names(made[0], "" if rolls else DEPTH, "base across [mm]")
    labels = Labels(made[0], [line for _, line, _ in lines])
    for name, line, colour in lines:
        labels.on(name, *line, colour)
    if rolls:
        made[1].step(1e3 * depth, np.degrees(roll), where="pre", color=SLATE, lw=THICK)
        axis_names(made[1], DEPTH, "roll [°]")


def tips_figure(figure: Figure, sheet: Sheet, *, fit: SteeringFit) -> None:
    """Measured and predicted tips of each insertion over depth, and what is left of both."""
    made = panels(figure, sheet, 2, 2, {"left": 46.0, "across": 46.0, "down": 50.0}, sharex="col")
    for path in fit.model.predictor.insertions:
        predicted, depth = fit.predict(path), 1e3 * path.depth
        for plane in (0, 1):
            start = path.tip[0, plane]
            measured, expected = (1e3 * (tip[:, plane] - start) for tip in (path.tip, predicted))
            _draw_tip(made[0, plane], path, depth, measured, expected)
            left = 1e3 * (path.tip[:, plane] - predicted[:, plane])
            made[1, plane].plot(depth, left, color=MODEL if path.steered else MEASURED, lw=THIN)
    for plane, name in enumerate("xy"):
        axis_names(made[0, plane], "", f"tip, {name} [mm]")
        axis_names(made[1, plane], DEPTH, f"measured - predicted, {name} [mm]")


def _draw_tip(axes: Axes, path: TipPath, depth: np.ndarray, measured: np.ndarray, predicted: np.ndarray) -> None:
    axes.plot(depth, measured, ls="", marker="o", ms=2.2, mfc="white", mec=SLATE, mew=0.7)
    axes.plot(depth, predicted, color=MODEL if path.steered else MEASURED, lw=1.1)
