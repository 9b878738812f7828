# SPDX-License-Identifier: Apache-2.0
"""Small multiples of a campaign: force over indentation, one panel a condition, as plain SVG of few points."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from .markup import Markup, element, escape, join

WIDTH, HEIGHT = 300.0, 190.0
LEFT, RIGHT, TOP, BOTTOM = 30.0, 4.0, 16.0, 28.0
OFF_AXES = 5.0  # times the axis: a curve that reaches so far, as in another unit, is not drawn
OWN_SCALE = 8.0  # a panel whose forces are so many times smaller than the others' has a scale of its own
FREE = 3.0  # [mm] of free travel shown at most
ROOM = 0.04  # of the range above and below the curves


@dataclass(frozen=True)
class Scale:
    """What a panel shows: indentation from ``left`` to ``right`` [mm], force from ``low`` to ``high`` [N]."""

    left: float
    right: float
    low: float
    high: float

    def points(self, trace) -> str:
        """A curve as the points of a polyline, in tenths of a point."""
        x = (1e3 * trace.indentation - self.left) / (self.right - self.left) * (WIDTH - LEFT - RIGHT)
        y = (self.high - trace.force) / (self.high - self.low) * (HEIGHT - TOP - BOTTOM)
        return " ".join(f"{a:g},{b:g}" for a, b in np.round(np.column_stack((x, y)), 1).tolist())

    def holds(self, trace) -> bool:
        """Whether a curve can be drawn on these axes."""
        deep, size = 1e3 * np.abs(trace.indentation).max(), np.abs(trace.force).max()
        return bool(deep <= OFF_AXES * (self.right - self.left) and size <= OFF_AXES * (self.high - self.low))


def shared_scale(conditions) -> Scale:
    """One scale for all panels, from the recordings that the models rest on; without any, from all."""
    pooled = [one.shown for each in conditions for one in each.pooled if one.shown is not None]
    models = [each.shown for each in conditions if each.shown is not None]
    return _scale([*pooled, *models] or [trace for each in conditions for trace in usual_traces(each)])


def scale_of(condition, shared: Scale) -> Scale:
    """The shared scale; one of its own where the condition's forces would be flat on it, or would leave it."""
    traces = list(usual_traces(condition))
    own = _scale(traces)
    if traces and not any(map(shared.holds, traces)):
        return own
    if own.high - own.low > (shared.high - shared.low) / OWN_SCALE or not traces:
        return shared
    return Scale(shared.left, shared.right, own.low, own.high)


def usual_traces(condition) -> Iterator:
    """The curves that set the scale: the model, and the recordings that are not left out, else all."""
    drawn = [one for one in condition.recordings if one.shown is not None]
    yield from (one.shown for one in [one for one in drawn if not one.left_out] or drawn)
    yield from () if condition.shown is None else (condition.shown,)


def panel(condition, scale: Scale, colours: dict[str, int], alt: str) -> Markup:
    """Every repeat as a thin line, the model as a thick one; ``colours`` (file -> number) marks what is odd."""
    drawn = [one for one in condition.recordings if one.shown is not None and scale.holds(one.shown)]
    usual = [one for one in drawn if one.file not in colours]
    odd = [one for one in drawn if one.file in colours]
    lines = [_line(one.shown, scale, "one") for one in usual]
    lines += [_line(one.shown, scale, f"odd c{colours[one.file]}" + " out" * one.left_out) for one in odd]
    lines += [] if condition.shown is None else [_line(condition.shown, scale, "fit")]
    inner = Markup(
        f'<svg x="{LEFT:g}" y="{TOP:g}" width="{WIDTH - LEFT - RIGHT:g}" height="{HEIGHT - TOP - BOTTOM:g}">'
        f"{join(lines)}</svg>"
    )
    view = f'viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img" aria-label="{escape(alt)}"'
    return Markup(f'<svg class="panel" {view}>{join(_axes(scale))}{inner}</svg>')


def _line(trace, scale: Scale, kind: str) -> Markup:
    return element("polyline", class_=kind, points=scale.points(trace))


def _axes(scale: Scale) -> Iterator[Markup]:
    """Ticks with light lines across, the zero of the force stronger, and the axes' names."""
    right, floor = WIDTH - RIGHT, HEIGHT - BOTTOM
    for force in ticks(scale.low, scale.high, 6):
        y = TOP + (scale.high - force) / (scale.high - scale.low) * (floor - TOP)
        yield element("path", class_="zero" if force == 0.0 else "grid", d=f"M{LEFT:g} {y:.1f}H{right:g}")
        yield _text(LEFT - 4, y + 3.5, f"{force:g}".replace("-", "−"), "end")
    for depth in ticks(scale.left, scale.right, 5):
        x = LEFT + (depth - scale.left) / (scale.right - scale.left) * (right - LEFT)
        yield element("path", class_="tick", d=f"M{x:.1f} {floor:g}v3")
        yield _text(x, floor + 13, f"{depth:g}".replace("-", "−"), "middle")
    yield _text(0.0, 9.0, "force [N]", "start")
    yield _text(right, HEIGHT - 3, "indentation [mm]", "end")


def _text(x: float, y: float, text: str, anchor: str) -> Markup:
    return element("text", text, x=f"{x:.1f}", y=f"{y:.1f}", text_anchor=anchor)


def ticks(low: float, high: float, about: int) -> list[float]:
    """Round numbers within the range, 1, 2 or 5 times a power of ten apart."""
    rough = (high - low) / about
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(each * power for each in (1.0, 2.0, 5.0, 10.0) if each * power >= 0.999 * rough)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [round(k * step, 12) + 0.0 for k in range(first, last + 1)]


def _scale(traces: Iterable) -> Scale:
    """Around all curves; a scale of some size where there is nothing to draw."""
    traces = list(traces)
    if not traces:
        return Scale(-1.0, 10.0, -1.0, 1.0)
    left, right = (1e3 * pick(pick(each.indentation) for each in traces) for pick in (min, max))
    low, high = (float(pick(pick(each.force) for each in traces)) for pick in (min, max))
    room = ROOM * (high - low) or 1.0
    return Scale(max(float(left), -FREE), max(float(right), 1e-3), low - room, high + room)
