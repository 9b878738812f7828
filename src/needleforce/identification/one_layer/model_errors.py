# SPDX-License-Identifier: Apache-2.0
"""Errors of the model that noise does not show: intervals that hold every reading of a recording which it allows.

A lag between force and depth, or a filter that is not declared, is one more reading of the same recording: the fit with
it is another answer, and the reported interval holds both. So are the friction of the insertion and that of the
withdrawal by themselves, where they disagree: a surface that holds the shaft or rests on it, tissue that is dragged
along, and a contact depth that the law misses change the level of one stroke, hardly its slope.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..statistics.noise import TWO_SIDED, slow_noise
from ..statistics.regression import inverse
from ..strokes import Strokes
from .cycle_values import CycleFit
from .loading_curves import FITS

AFTER = ("friction_per_length", "cutting_force")
MIN_SAMPLES = 20  # of a stroke in the tissue, for a line of its own
DISAGREE = (
    "Insertion and withdrawal disagree on the friction per length: {own} by themselves, {together:.3g} N/m together. "
    "The surface may hold the shaft or rest on it, the tissue may be dragged along or differ over the depth: the "
    "intervals of friction and cutting force hold each of them."
)
ELSEWHERE = (
    "Insertion and withdrawal disagree on where the friction begins: it is {own} by themselves and {together:.3g} "
    "N/m from the contact depth on. The surface may hold the shaft or rest deeper, the tissue may be dragged "
    "along, depth and force may not be of the same instant, or the depth may be in coarse steps: the intervals of "
    "friction and cutting force hold each of them."
)
ALONE = (
    "Below the puncture the friction per length is {own} by the slope of the insertion, {together:.3g} N/m in the fit: "
    "the intervals of friction and cutting force hold both."
)


@dataclass(frozen=True, eq=False, kw_only=True)
class Stroke:
    """One stroke below the puncture: embedded length (n,) [m] and force (n,) [N] without the zero, positive against
    insertion; ``noise`` is its long-run variance [N²] and ``inwards`` the sign of its friction."""

    length: np.ndarray
    force: np.ndarray
    noise: float
    inwards: bool

    @property
    def design(self) -> np.ndarray:
        """Derivatives (n, 2) of the force by friction per length and cutting force."""
        sign = 1.0 if self.inwards else -1.0
        return np.column_stack([sign * self.length, np.full_like(self.length, float(self.inwards))])

    @property
    def line(self) -> np.ndarray:
        """The straight lines (n, 2) that a stroke by itself allows: friction, and any level."""
        return np.column_stack([self.design[:, 0], np.ones_like(self.length)])

    def own(self) -> tuple[np.ndarray, np.ndarray]:
        """Friction per length and level of this stroke alone, (2,), and the half widths of their intervals."""
        line = self.line
        bread = inverse(line.T @ line)
        return bread @ (line.T @ self.force), TWO_SIDED * np.sqrt(self.noise * bread.diagonal())


def strokes_below(fit: CycleFit, strokes: Strokes) -> list[Stroke]:
    """The strokes of a fit below its puncture, those with enough samples, with the noise of the fit."""
    contact, zero, w = fit.values["contact_depth"], fit.values["force_offset"], fit.puncture.left_out
    used = slice(fit.puncture.before + w, len(strokes.depth_in) - w)
    cut = strokes.depth_in[used] - contact, strokes.force_in[used] - zero
    back = strokes.depth_out[w:] - contact, strokes.force_out[w:] - zero
    inside = back[0] > 0.0
    parts = [(*cut, fit.residuals.noises[0], True), (back[0][inside], back[1][inside], fit.residuals.noises[1], False)]
    return [
        Stroke(length=length, force=force, noise=noise.long_run, inwards=inwards)
        for length, force, noise, inwards in parts
        if len(length) >= MIN_SAMPLES
    ]


def _with_own_noise(stroke: Stroke, friction: float) -> Stroke:
    """The stroke with its slow noise."""
    line = stroke.line
    residual = stroke.force - friction * line[:, 0]
    return replace(stroke, noise=slow_noise(residual - residual.mean(), line, stroke.noise))


def with_misfit_below(fit: CycleFit, strokes: Strokes) -> tuple[CycleFit, tuple[str, ...]]:
    """The fit with the misfit below the puncture in the intervals of friction and cutting force, and a sentence if its
    strokes disagree.

    The slow part of each stroke's residual adds to the covariance. Where a stroke by itself disagrees with the fit by
    more than both intervals, or the withdrawal does not end in zero force at the contact, the intervals hold the
    stroke's own friction too, with the cutting force that belongs to it. All of these tests are at the level of the
    intervals, so 5 % of the recordings that follow the model are widened for nothing.
    """
    parts = [_with_own_noise(each, fit.values["friction_per_length"]) for each in strokes_below(fit, strokes)]
    if not parts or not parts[0].inwards or FITS[fit.law].foundation != "linear":
        return fit, ()
    fit = _with_slow_noise(fit, parts)
    others = _disagreeing(fit, parts)
    if not others:
        return fit, ()
    return widen_to_cover(fit, others), (_sentence(parts, fit.values["friction_per_length"]),)


def _sentence(parts: list[Stroke], together: float) -> str:
    """What disagrees: the strokes with each other, or both with the fit."""
    own = [(float(values[0]), float(halves[0])) for values, halves in (part.own() for part in parts)]
    words = " and ".join(f"{value:.3g}" for value, _ in own) + " N/m"
    if len(own) < 2:
        return ALONE.format(own=words, together=together)
    (one, half), (other, width) = own
    agree = abs(one - other) <= math.hypot(half, width)
    return (ELSEWHERE if agree else DISAGREE).format(own=words, together=together)


def _with_slow_noise(fit: CycleFit, parts: list[Stroke]) -> CycleFit:
    """The fit with what the strokes' slow noise adds to the variance of friction and cutting force."""
    noises = dict(zip((True, False), fit.residuals.noises))
    more = [part.noise - noises[part.inwards].long_run for part in parts]
    if not any(each > 0.0 for each in more):
        return fit
    grams = [part.design.T @ part.design for part in parts]
    bread = inverse(sum(grams))
    added = bread @ sum(each * gram for each, gram in zip(more, grams)) @ bread
    low, high, covariance = dict(fit.low), dict(fit.high), fit.covariance.copy()
    rows = [fit.order.index(name) for name in AFTER]
    covariance[np.ix_(rows, rows)] += added
    for name, variance in zip(AFTER, added.diagonal()):
        value, half = fit.values[name], TWO_SIDED * math.sqrt(max(float(variance), 0.0))
        low[name] = min(value - math.hypot(value - low[name], half), low[name])
        high[name] = value + math.hypot(high[name] - value, half)
    return widened(fit, low, high, covariance)


def _disagreeing(fit: CycleFit, parts: list[Stroke]) -> list[CycleFit]:
    """The fit with the friction of a stroke by itself, for each stroke that disagrees with it."""
    name = "friction_per_length"
    value, half = fit.values[name], 0.5 * (fit.high[name] - fit.low[name])
    own = [part.own() for part in parts]
    level = own[1][0][1] if len(parts) > 1 and abs(own[1][0][1]) > own[1][1][1] else 0.0
    best = min(own, key=lambda each: each[1][0])
    found = []
    for each in own:
        away = abs(float(each[0][0]) - value) > math.hypot(half, each[1][0])
        if away or (level and each is best):
            found.append(_with_friction(fit, parts[0], float(each[0][0]), float(each[1][0]), float(level)))
    return found


def _with_friction(fit: CycleFit, insertion: Stroke, friction: float, half: float, level: float) -> CycleFit:
    """The fit with another ``friction`` [N/m], its ``half`` width, and the cutting force that follows from the
    insertion's mean; embedding that begins elsewhere changes it by the withdrawal's ``level`` [N] at the contact."""
    friction, mean = max(friction, 0.0), float(insertion.length.mean())
    cutting, width = float(insertion.force.mean()) - friction * mean, half * mean
    ends = cutting + min(level, 0.0) - width, cutting + max(level, 0.0) + width
    low = fit.low | dict(zip(AFTER, (friction - half, ends[0])))
    high = fit.high | dict(zip(AFTER, (friction + half, ends[1])))
    other = widened(fit, low, high, fit.covariance)
    return replace(other, values=fit.values | dict(zip(AFTER, (friction, cutting))))


def widened(fit: CycleFit, low: Mapping[str, float], high: Mapping[str, float], covariance: np.ndarray) -> CycleFit:
    """The fit with wider intervals, not below 0 where they were not: there is no negative friction or cutting."""
    ends = {**low, **{name: max(low[name], min(fit.low[name], 0.0)) for name in AFTER}}
    return replace(fit, low=ends, high=dict(high), covariance=covariance, widened=True)


def widen_to_cover(fit: CycleFit, others: Iterable[CycleFit]) -> CycleFit:
    """The fit with intervals that cover those of the ``others`` too; its covariance has their differences."""
    low, high, covariance = dict(fit.low), dict(fit.high), fit.covariance
    others = tuple(others)
    for other in others:
        for name in fit.values.keys() & other.values.keys():
            low[name] = _farther(min, low[name], other.low[name])
            high[name] = _farther(max, high[name], other.high[name])
        shift = [other.values.get(name, fit.values[name]) - fit.values[name] for name in fit.order]
        covariance = covariance + _spread(np.array(shift))
    return replace(fit, low=low, high=high, covariance=covariance, widened=True) if others else fit


def _farther(end: Callable, one: float, other: float) -> float:
    """The farther of two limits; a limit that is not known does not count."""
    return one if math.isnan(other) else end(one, other)


def _spread(shift: np.ndarray) -> np.ndarray:
    """Covariance (p, p) of values that differ by up to ``shift`` (p,), at the level of the intervals."""
    known = np.where(np.isfinite(shift), shift, 0.0) / TWO_SIDED
    return np.outer(known, known)
