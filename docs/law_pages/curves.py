# SPDX-License-Identifier: Apache-2.0
"""One drawing for each family of laws, with the curve that characterises a law of that family."""

import numpy as np

from .figure import DEPTH, FIRST, FORCE, OTHER, SPEED, TIME, axis_names, curve, headroom, key, row
from .runs import SLOW, back_and_forth, by_velocity, cycle, run
from .runs import SPEED as FAST
from .typical import around

CAPTIONS = {
    "stiffness": "Force and slope over depth, up to the puncture depth of the source paper's needle.",
    "puncture": "An insertion with the source paper's other laws; the dot marks the puncture.",
    "friction": "Friction only, at 3 mm/s: in, half-way back, in again, a hold of 3 s, out.",
    "cutting": "Cutting force only, at two speeds: over depth in, a hold of 2 s, out; over time from the puncture.",
    "relaxation": "Force in a hold of 10 s: contact at 3 mm, and needle in the tissue at 10 mm.",
}


def stiffness(figure, sheet, law) -> None:
    """Force and slope over depth."""
    depth = np.linspace(1e-9, around(law).puncture_depth, 300)
    left, right = row(figure, sheet, 2)
    curve(left, 1e3 * depth, [law.force(h) for h in depth])
    curve(right, 1e3 * depth, [1e-3 * law.slope(h) for h in depth])
    for axes, y in ((left, FORCE), (right, "slope [N/mm]")):
        axes.set_xlim(0.0)
        axes.set_ylim(0.0)
        axis_names(axes, DEPTH, y)


def puncture(figure, sheet, law) -> None:
    """The loading curve with the puncture marked."""
    done = run(around(law), (6e-3, FAST))
    (axes,) = row(figure, sheet, 1)
    curve(axes, done.depth, done.force)
    headroom(axes)
    axis_names(axes, DEPTH, FORCE)
    last = int(np.flatnonzero(done.parts["stiffness"] > 0.0)[-1])
    axes.plot(done.depth[last], done.force[last], "o", color=OTHER, ms=6)
    label = f"puncture at {done.depth[last]:.2f} mm, {done.force[last]:.3f} N"
    at = done.depth[last], done.force[last]
    axes.annotate(label, at, (-8, 4), textcoords="offset points", color=OTHER, ha="right")  # the right is narrow


def friction(figure, sheet, law) -> None:
    """The loop over depth, and the force over velocity or, for a law independent of velocity, over time."""
    done, rate = back_and_forth(law), by_velocity(law)
    left, right = row(figure, sheet, 2)
    curve(left, done.depth, done.parts["friction"])
    axis_names(left, DEPTH, FORCE)
    curve(right, *(rate or (done.time, done.parts["friction"])))
    axis_names(right, f"{SPEED}, sliding at 10 mm" if rate else TIME, FORCE)
    _zero(left, right)


def cutting(figure, sheet, law) -> None:
    """Force over depth and over time at two speeds, the slow one drawn wider because they may coincide."""
    left, right = row(figure, sheet, 2)
    entry = 1e3 * around(law).puncture_depth
    for speed, colour, width in ((SLOW, OTHER, 3.0), (FAST, FIRST, 1.3)):
        done = cycle(around(law), speed, 6e-3)
        near = done.depth > entry - 0.8
        since = done.time - done.time[done.depth > entry][0]
        part = (since > -0.2) & (since < 2.0)
        curve(left, done.depth[near], done.parts["cutting"][near], colour, width)
        curve(right, since[part], done.parts["cutting"][part], colour, width)
    for axes, x in ((left, DEPTH), (right, "time since the puncture [s]")):
        axis_names(axes, x, FORCE)
        key(axes, {f"{1e3 * SLOW:g} mm/s": OTHER, f"{1e3 * FAST:g} mm/s": FIRST})


def relaxation(figure, sheet, law) -> None:
    """Force over time in a hold, before and after the puncture."""
    for axes, depth in zip(row(figure, sheet, 2), (3e-3, 10e-3)):
        done = run(around(law), (depth, FAST), (depth, 10.0))
        curve(axes, done.time, done.force)
        axes.set_ylim(0.0, 1.05 * done.force.max())
        axis_names(axes, TIME, f"{FORCE}, hold at {1e3 * depth:g} mm")


def _zero(*several) -> None:
    for axes in several:
        axes.axhline(0.0, color="#9a9a9a", lw=0.7)


DRAWN = {draw.__name__: draw for draw in (stiffness, puncture, friction, cutting, relaxation)}
