# SPDX-License-Identifier: Apache-2.0
"""Figures of a steered needle: its path in three projections, loads over depth, measured and predicted tips."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ..display.axes import DEPTH
from ..display.canvas import INK, MEASURED, MODEL, QUIET, SECOND, SLATE, THICK, THIN, Labels, Sheet, axis_names, panels
from ..display.page import Figure
from .base_motion import BaseMotion
from .obstacles import Box, Obstacle, Sphere
from .tip_paths import TipPath

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Drawing

BLOCKED = "#b23b3b"
TIPS = (
    "Circles: measured tips. Lines: predicted from the motion of the base and the rows before it moves; orange of "
    "steered insertions, grey of unsteered ones. Below: measured less predicted."
)
PATH = (
    "The path of the tip in three projections. Thin lines: the needle at some steps. Both directions across have one "
    "scale, the depth has its own."
)
IN_SPACE = (
    "The needle in space at some steps, with one scale: x upwards, y obliquely and shortened by half, z to the right. "
    "Orange: the path of the tip. Grey: the surface."
)
MOTION = "In each step the base first moves across and the needle rolls at rest, then it is pushed in."
AXIAL = "Axial force, + opposes insertion. "
LOADS = "Lateral force and moment are those of the tissue on the needle at its base."
_VIEWS = ((2, 0), (2, 1), (0, 1))  # horizontal and vertical axis of each projection
_NAMES = ("x", "y", "z")
_MARGINS = {"left": 46.0, "across": 46.0, "down": 50.0}


@dataclass(frozen=True, eq=False, kw_only=True)
class Scene:
    """What surrounds the path (n, 3) of a tip: the needle at some steps, depths of layers, the radius (n,) in which the
    tip is, obstacles, and a target (3,) [m]."""

    path: np.ndarray
    shapes: Sequence[np.ndarray]
    layers: Sequence[float] = ()
    tube: np.ndarray | None = None
    obstacles: Sequence[Obstacle] = ()
    target: np.ndarray | None = None

    def figures(self) -> tuple[Figure, Figure]:
        """Three projections, and the needle in space."""
        marks = " Red: obstacles." * bool(self.obstacles) + " Cross: target." * (self.target is not None)
        shade = " Shade: 95 % region of the tip." if self.tube is not None else ""
        words = PATH + " Dashed: layer boundaries." * bool(self.layers) + shade + marks
        sides = Figure(
            name="path", draw=partial(draw_sides, scene=self), heights=(230.0, 620.0), caption=words, alt=words
        )
        words = IN_SPACE + marks
        return sides, Figure(
            name="space", draw=partial(draw_space, scene=self), heights=(160.0, 120.0), caption=words, alt=words
        )


def base_motion(motion: BaseMotion) -> Figure:
    """What the base does over depth."""
    draw = partial(motion_figure, motion=motion)
    return Figure(name="motion", draw=draw, heights=(230.0, 260.0), caption=MOTION, alt=MOTION)


def loads(depth: np.ndarray, force: np.ndarray, wrench: np.ndarray) -> Figure:
    """Force (n,) [N] and wrench (n, 6) [N], [N m] over depth [m]; a force of 0 at all depths has no model."""
    draw = partial(loads_figure, depth=depth, force=force, wrench=wrench)
    axial = bool(np.any(force))
    caption = AXIAL * axial + LOADS
    return Figure(name="loads", draw=draw, heights=(220.0, 600.0 if axial else 410.0), caption=caption, alt=caption)


def tips(insertions: Sequence[tuple[TipPath, np.ndarray]]) -> Figure:
    """Measured tips of each insertion with the predicted ones (n, 3) [m]."""
    draw = partial(tips_figure, insertions=insertions)
    return Figure(name="tips", draw=draw, heights=(430.0, 760.0), caption=TIPS, alt=TIPS)


def draw_path(axes: "Axes", path: np.ndarray) -> tuple[str, str]:
    """Both directions across over the depth of a path (n, 3) [m]; returns the axis labels."""
    for column, name, colour in zip(path.T, _NAMES[:2], (MODEL, SECOND)):
        axes.plot(1e3 * path[:, 2], 1e3 * column, color=colour, lw=THICK, label=name)
    return DEPTH, "tip across [mm]"


def draw_sides(figure: "Drawing", sheet: Sheet, scene: Scene) -> None:
    """The scene in three projections; a millimetre across is as long in each."""
    rows, columns = (3, 1) if sheet.narrow else (1, 3)
    every = panels(figure, sheet, rows, columns, _MARGINS).ravel()
    for axes, (over, up) in zip(every, _VIEWS):
        _draw_side(axes, scene, over, up)
        axis_names(axes, f"{_NAMES[over]} [mm]", f"{_NAMES[up]} [mm]")
        axes.margins(0.08, 0.25)
    last = every[-1]
    half = 0.5 * max(high - low for low, high in [last.get_xlim(), *(axes.get_ylim() for axes in every)])
    for axes in every:
        axes.set_ylim(*(np.mean(axes.get_ylim()) + np.array([-half, half])))
    wide = half * last.bbox.width / last.bbox.height
    last.set_xlim(*(np.mean(last.get_xlim()) + np.array([-wide, wide])))


def _draw_side(axes: "Axes", scene: Scene, over: int, up: int) -> None:
    """The scene over one direction and up another."""
    from matplotlib.patches import Circle

    path, shade = 1e3 * scene.path, {"color": MODEL, "alpha": 0.13, "lw": 0.0}
    for shape in scene.shapes:
        axes.plot(1e3 * shape[:, over], 1e3 * shape[:, up], color=QUIET, lw=THIN, label="needle")
    axes.plot(path[:, over], path[:, up], color=MODEL, lw=THICK, zorder=4, label="tip")
    for top in scene.layers if over == 2 else ():
        axes.axvline(1e3 * top, color=QUIET, lw=0.6, ls=(0, (4, 2)))
    if scene.tube is not None and over == 2:
        radius = 1e3 * scene.tube
        axes.fill_between(path[:, 2], path[:, up] - radius, path[:, up] + radius, **shade)
    elif scene.tube is not None:
        axes.add_patch(Circle((path[-1, over], path[-1, up]), 1e3 * scene.tube[-1], **shade))
    _draw_marks(axes, scene, lambda points: 1e3 * points[:, [over, up]])


def draw_space(figure: "Drawing", sheet: Sheet, scene: Scene) -> None:
    """The scene in oblique projection with equal scales."""
    from matplotlib.patches import Polygon

    def seen(points: np.ndarray) -> np.ndarray:
        """Points (n, 3) [m] in the plane of the drawing, (n, 2) [mm]."""
        x, y, z = 1e3 * points.T
        return np.column_stack([z - 0.35 * y, x + 0.35 * y])

    axes = panels(figure, sheet)[0, 0]
    reach = 1.2 * max(float(np.abs(scene.path[:, :2]).max()), 0.06 * float(np.ptp(scene.path[:, 2])))
    corners = reach * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    axes.add_patch(Polygon(seen(corners), closed=True, color=QUIET, alpha=0.18, lw=0))
    for shape in scene.shapes:
        axes.plot(*seen(shape).T, color=QUIET, lw=THIN)
    axes.plot(*seen(scene.path).T, color=MODEL, lw=THICK)
    _draw_marks(axes, scene, seen)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_yticks([])
    axes.grid(False)
    axes.spines["left"].set_visible(False)
    axes.set_xlabel("z [mm]", loc="right")


def _draw_marks(axes: "Axes", scene: Scene, seen: Callable[[np.ndarray], np.ndarray]) -> None:
    """Obstacles and target; ``seen`` gives the place (n, 2) of points (n, 3) in the drawing."""
    from matplotlib.patches import Polygon
    from scipy.spatial import ConvexHull

    for surface in filter(len, map(_surface, scene.obstacles)):
        outline = seen(surface)
        axes.add_patch(Polygon(outline[ConvexHull(outline).vertices], color=BLOCKED, alpha=0.25, lw=0.0))
    if scene.target is not None:
        axes.plot(*seen(scene.target[None]).T, marker="x", ms=7, mew=1.6, color=INK, zorder=5)


def _surface(obstacle: Obstacle) -> np.ndarray:
    """Points (n, 3) [m] on the surface of a sphere or a box; none of a function."""
    if isinstance(obstacle, Box):
        return np.array([np.where(corner, obstacle.high, obstacle.low) for corner in np.ndindex(2, 2, 2)])
    if not isinstance(obstacle, Sphere):
        return np.empty((0, 3))
    up, around = np.meshgrid(np.linspace(-1.0, 1.0, 33), np.linspace(0.0, 2.0 * np.pi, 33))
    flat = np.sqrt(1.0 - up**2)
    ball = np.stack([flat * np.cos(around), flat * np.sin(around), up], axis=-1).reshape(-1, 3)
    return np.asarray(obstacle.center) + obstacle.radius * ball


def loads_figure(figure: "Drawing", sheet: Sheet, depth: np.ndarray, force: np.ndarray, wrench: np.ndarray) -> None:
    """Axial force, lateral force and bending moment at the base over depth."""
    curves = [("axial force [N]", [("", force)])] if np.any(force) else []
    curves += [
        ("lateral force at the base [N]", [("x", wrench[:, 0]), ("y", wrench[:, 1])]),
        ("moment at the base [N mm]", [("about x", 1e3 * wrench[:, 3]), ("about y", 1e3 * wrench[:, 4])]),
    ]
    rows, columns = (len(curves), 1) if sheet.narrow else (1, len(curves))
    for axes, (name, lines) in zip(panels(figure, sheet, rows, columns, _MARGINS).ravel(), curves):
        drawn = []
        for (label, values), colour in zip(lines, (MODEL, SECOND)):
            axes.plot(1e3 * depth, values, color=colour, lw=THICK)
            drawn.append((label, (1e3 * depth, values), colour))
        axis_names(axes, DEPTH, name)
        labels = Labels(axes, [line for _, line, _ in drawn])
        for label, line, colour in drawn:
            if label:
                labels.on(label, *line, colour)


def motion_figure(figure: "Drawing", sheet: Sheet, motion: BaseMotion) -> None:
    """What the base does over depth: motion across, and roll if it rolls."""
    depth, lateral, roll = motion.depth, motion.lateral, motion.roll
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


def tips_figure(figure: "Drawing", sheet: Sheet, insertions: Sequence[tuple[TipPath, np.ndarray]]) -> None:
    """Measured and predicted tips of each insertion over depth, and what is left of both."""
    made = panels(figure, sheet, *((4, 1) if sheet.narrow else (2, 2)), _MARGINS, sharex="col").reshape(2, 2)
    for path, predicted in insertions:
        depth = 1e3 * path.depth
        for plane in (0, 1):
            start = path.tip[0, plane]
            measured, expected = (1e3 * (tip[:, plane] - start) for tip in (path.tip, predicted))
            _draw_tip(made[0, plane], path, depth, measured, expected)
            left = 1e3 * (path.tip[:, plane] - predicted[:, plane])
            made[1, plane].plot(depth, left, color=MODEL if path.steered else MEASURED, lw=THIN)
    for plane, name in enumerate("xy"):
        axis_names(made[0, plane], "", f"tip, {name} [mm]")
        axis_names(made[1, plane], DEPTH, f"measured - predicted, {name} [mm]")


def _draw_tip(axes: "Axes", path: TipPath, depth: np.ndarray, measured: np.ndarray, predicted: np.ndarray) -> None:
    axes.plot(depth, measured, ls="", marker="o", ms=2.2, mfc="white", mec=SLATE, mew=0.7)
    axes.plot(depth, predicted, color=MODEL if path.steered else MEASURED, lw=1.1)
