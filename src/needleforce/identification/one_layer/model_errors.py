# SPDX-License-Identifier: Apache-2.0
"""Errors of the model that noise does not show: intervals that hold every reading of a recording which it allows.

A lag between force and depth, or a filter that is not declared, is one more reading of the same recording: the fit with
it is another answer, and the reported interval holds both. So are the friction of the insertion and that of the
withdrawal by themselves, where they disagree: a surface that holds the shaft or rests on it, tissue that is dragged
along, and a contact depth that the law misses change the level of one stroke, hardly its slope.

Such an error is common to the repeats of a condition, and their mean has all of it. So what it adds to an interval is
kept apart from what noise gives, in ``systematic``, and how it moves the values together in ``causes``.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ... import core
from ...vocabulary import SMALLEST
from ..estimates import Estimate
from ..statistics.noise import ONE_IN_40, SIGNIFICANT, TWO_SIDED, noise_of, slow_noise, student_quantile
from ..statistics.regression import inverse
from ..timing import MAX_LAG_S
from .cycle_values import CycleFit
from .loading_curves import CURVES, FITS
from .segmented_recording import SegmentedRecording

AFTER = ("friction_per_length", "cutting_force")
BENDS = {"time": ONE_IN_40, "bend": SIGNIFICANT}
"""[standard errors] of the growth of friction that noise does not explain, by the bend that shows it. The friction at
the contact by the insertion alone is an extrapolation: its interval would be wide for nothing more often."""
INTACT = 1e-4  # of the contact that a gradual rupture leaves, so that none of it is in the friction behind
SURE = SIGNIFICANT / TWO_SIDED  # [half widths] from which on a difference between strokes is named
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
CHANGES = (
    "Insertion and withdrawal are bent as by friction per length that changes with time, from {:.3g} N/m at the start "
    "of the recording to {:.3g} N/m at the exit: friction may age, or the gain of the sensor drift. The intervals hold "
    "what that gives at the start."
)
BENT = (
    "The insertion below the puncture is bent, as by friction per length that begins with {:.3g} N/m and changes with "
    "time or depth: the intervals of friction and cutting force hold that too."
)

LATE = (
    "The withdrawal by itself does not end at the contact, as behind a lag between force and depth, which the start of "
    "the withdrawal allows: the intervals of the depths hold that too."
)


@dataclass(frozen=True, eq=False, kw_only=True)
class Stroke:
    """One stroke below the puncture: embedded length (n,) [m] and force (n,) [N] without the zero, positive against
    insertion, and time (n,) since the recording's start over that up to the exit, which is ``touched`` at the contact;
    ``inwards`` is the sign of its friction. Sums over its samples are computed once."""

    length: np.ndarray
    force: np.ndarray
    time: np.ndarray
    touched: float
    inwards: bool
    filter_length: int

    @cached_property
    def line(self) -> np.ndarray:
        """The straight lines (2, n) that a stroke by itself allows: friction, and any level."""
        return np.array([self.length if self.inwards else -self.length, np.ones_like(self.length)])

    @cached_property
    def shown(self) -> np.ndarray:
        """1 (2,) for friction per length and, in the insertion, for the cutting force: the lines that strokes share."""
        return np.array([1.0, float(self.inwards)])

    @cached_property
    def products(self) -> np.ndarray:
        """Sums of products (3, 3) of the lines and the force."""
        return core.gram(np.vstack([self.line, self.force]))

    @cached_property
    def gram(self) -> np.ndarray:
        """Those (2, 2) of the derivatives by friction per length and cutting force."""
        return self.products[:2, :2] * np.outer(self.shown, self.shown)

    @cached_property
    def bread(self) -> np.ndarray:
        """Inverse (2, 2) of the products of the lines."""
        return inverse(self.products[:2, :2])

    @cached_property
    def bent(self) -> np.ndarray:
        """What its own line leaves (n,) [N]; a line that both strokes share leaves misfit in it."""
        return self.force - self.own @ self.line

    @cached_property
    def noise(self) -> float:
        """Long-run variance [N²] of what its own parabola leaves: a bend is no noise, which would hide it."""
        curve = self.length**2
        curve = curve - self.bread @ (self.line @ curve) @ self.line
        left = self.bent - curve * float(curve @ self.bent) / max(float(curve @ curve), SMALLEST)
        return noise_of(left, len(left), self.filter_length, 3.0).long_run

    @cached_property
    def slow(self) -> float:
        """The same with its slow misfit."""
        return slow_noise(self.bent, self.line.T, self.noise)

    @cached_property
    def own(self) -> np.ndarray:
        """Friction per length and level of this stroke alone, (2,)."""
        return self.bread @ self.products[:2, 2]

    @cached_property
    def halves(self) -> np.ndarray:
        """The half widths (2,) of their intervals."""
        return TWO_SIDED * np.sqrt(self.slow * self.bread.diagonal())


def strokes_below(fit: CycleFit, single: SegmentedRecording) -> list[Stroke]:
    """The strokes of a fit below its puncture, those with enough samples."""
    strokes, time = single.strokes, single.recording.time
    contact, zero, w = fit.values["contact_depth"], fit.values["force_offset"], fit.puncture.left_out
    used = slice(max(fit.puncture.before, _fallen(fit, strokes.depth_in)) + w, len(strokes.depth_in) - w)
    cut = strokes.depth_in[used] - contact, strokes.force_in[used] - zero, time[strokes.index_in[used]]
    back = strokes.depth_out[w:] - contact, strokes.force_out[w:] - zero, time[strokes.index_out[w:]]
    inside = back[0] > 0.0
    parts = [(*cut, True), (*(each[inside] for each in back), False)]
    parts = [part for part in parts if len(part[0]) >= MIN_SAMPLES]
    if not parts:
        return []
    lasts = float(parts[-1][2][-1] - time[0])
    touched = time[strokes.index_in[min(int(np.searchsorted(strokes.depth_in, contact)), used.start)]]
    shared = {"touched": float(touched - time[0]) / lasts, "filter_length": single.recording.card.filter_length}
    return [
        Stroke(length=length, force=force, time=(times - time[0]) / lasts, inwards=inwards, **shared)
        for length, force, times, inwards in parts
    ]


def _fallen(fit: CycleFit, depth: np.ndarray) -> int:
    """The first sample of the insertion at a ``depth`` (n,) [m] behind a gradual rupture; 0 for a sharp one."""
    values = fit.values
    if "rupture_length" not in values:
        return 0
    length = values["rupture_length"] * math.log(1.0 / INTACT) ** (1.0 / values["rupture_exponent"])
    return int(np.searchsorted(depth, values["contact_depth"] + values["rupture_onset"] + length))


def with_misfit_below(single: SegmentedRecording, law: str) -> SegmentedRecording:
    """The recording with the misfit below the puncture in the intervals of friction and cutting force of one law's fit,
    and a note if its strokes disagree.

    The slow part of each stroke's residual adds to the covariance. Where a stroke by itself disagrees with the fit by
    more than both intervals, or the withdrawal does not end in zero force at the contact, the intervals hold the
    stroke's own friction too, with the cutting force that belongs to it. What the contact depth may be is in the fit's
    intervals before, so that a contact which the loading law misses is no such disagreement. All of these tests are at
    the level of the intervals, so 5 % of the recordings that follow the model are widened for nothing. Where strokes
    disagree, what their common line leaves is no noise: the random part is then that of the noise about the strokes'
    own lines. Strokes that are bent hold what a force that changes with time leaves at the contact. The load of a
    second layer, which a note names, is no such misfit.
    """
    fit = single.fits.get(law)
    if fit is None or FITS[law].foundation != "linear" or len(single.events.punctures) > 1:
        return single
    parts = strokes_below(fit, single)
    if not parts or not parts[0].inwards:
        return single
    random = _random_shares(fit, parts)
    others, bends = _disagreeing(fit, parts, random["friction_per_length"]), _bends(fit, parts)
    moved = {cause: bend.moved(fit) for cause, bend in bends.items()}
    sizes = {cause: bend.significance for cause, bend in bends.items()}
    fit = replace(fit, strokes_alone=_strokes_alone(fit, parts) | moved, bends=sizes)
    shown = {cause: bend for cause, bend in bends.items() if abs(sizes[cause]) > BENDS[cause]}
    late = _other_instants(fit, parts, single)
    changed = {cause: bend.applied(fit) for cause, bend in shown.items()} | late
    sentences = [bend.sentence for bend in shown.values() if abs(bend.significance) > SIGNIFICANT] + [LATE] * len(late)
    fit = _with_rounded_zero(_with_slow_noise(fit, parts), parts, single.force_step)
    if others:
        sentences = [each for each in (_sentence(fit, parts), *sentences) if each]
        fit = _with_random(fit, random)
    notes = tuple(dict.fromkeys((*single.law_notes.get(law, ()), *sentences)))
    fits = single.fits | {law: widen_to_cover(fit, others | changed)}
    return replace(single, fits=fits, law_notes=single.law_notes | {law: notes})


def _sentence(fit: CycleFit, parts: list[Stroke]) -> str:
    """What disagrees, beyond noise in all but one of a thousand recordings: the strokes with each other, or both with
    the fit; empty where only a contact depth within its interval is another one."""
    own = [(float(part.own[0]), float(part.halves[0])) for part in parts]
    words = " and ".join(f"{value:.3g}" for value, _ in own) + " N/m"
    if len(own) < 2:
        found = ALONE
    elif abs(own[0][0] - own[1][0]) > SURE * math.hypot(own[0][1], own[1][1]):
        found = DISAGREE
    else:
        found = ELSEWHERE if _level(fit, parts, SURE) else ""
    return found.format(own=words, together=fit.values["friction_per_length"])


def _random_shares(fit: CycleFit, parts: list[Stroke]) -> dict[str, float]:
    """Share of the standard errors of friction and cutting force that the noise about the strokes' own lines gives."""
    common = np.array([fit.values[name] for name in AFTER])
    left = [part.force - (part.shown * common) @ part.line for part in parts]
    noises = [noise_of(each, len(each), part.filter_length, 1.0).long_run for each, part in zip(left, parts)]
    bread = inverse(sum(part.gram for part in parts))
    own, together = (
        (bread @ sum(noise * part.gram for noise, part in zip(each, parts)) @ bread).diagonal()
        for each in ([part.noise for part in parts], noises)
    )
    return {name: math.sqrt(min(a / b, 1.0)) if b > 0.0 else 1.0 for name, a, b in zip(AFTER, own, together)}


def _with_random(fit: CycleFit, shares: Mapping[str, float]) -> CycleFit:
    """The fit with no more than these ``shares`` of the intervals that noise gave as their random part."""
    systematic = dict(fit.systematic)
    for name, share in shares.items():
        below, above = fit.systematic_part(name)
        value = fit.values[name]
        less = (1.0 - share) * (value - fit.low[name] - below), (1.0 - share) * (fit.high[name] - value - above)
        systematic[name] = below + max(less[0], 0.0), above + max(less[1], 0.0)
    return replace(fit, systematic=systematic)


def _with_slow_noise(fit: CycleFit, parts: list[Stroke]) -> CycleFit:
    """The fit with what the strokes' slow noise adds to the variance of friction and cutting force."""
    noises = dict(zip((True, False), fit.residuals.noises))
    more = [max(part.slow - max(part.noise, noises[part.inwards].long_run), 0.0) for part in parts]
    if not any(each > 0.0 for each in more):
        return fit
    bread = inverse(sum(part.gram for part in parts))
    added = bread @ sum(each * part.gram for each, part in zip(more, parts)) @ bread
    low, high = dict(fit.low), dict(fit.high)
    for name, variance in zip(AFTER, added.diagonal()):
        value, half = fit.values[name], TWO_SIDED * math.sqrt(max(float(variance), 0.0))
        low[name] = min(value - math.hypot(value - low[name], half), low[name])
        high[name] = value + math.hypot(high[name] - value, half)
    sizes, axes = np.linalg.eigh(added)
    moved = TWO_SIDED * np.sqrt(np.maximum(sizes, 0.0)) * axes * np.where(axes[0] < 0.0, -1.0, 1.0)
    names = ("slower misfit", "slow misfit")
    return widened(fit, low, high, {name: dict(zip(AFTER, axis)) for name, axis in zip(names, moved.T.tolist())})


def _with_rounded_zero(fit: CycleFit, parts: list[Stroke], step: float) -> CycleFit:
    """The fit with what half a ``step`` [N] of the force, by which rounding may move the zero, does to its strokes."""
    if step <= 0.0:
        return fit
    sums = sum(part.shown * part.line.sum(axis=1) for part in parts)
    moved = dict(zip(AFTER, (0.5 * step * (inverse(sum(part.gram for part in parts)) @ sums)).tolist()))
    low = {name: fit.values[name] - math.hypot(fit.values[name] - fit.low[name], moved[name]) for name in AFTER}
    high = {name: fit.values[name] + math.hypot(fit.high[name] - fit.values[name], moved[name]) for name in AFTER}
    return widened(fit, fit.low | low, fit.high | high, {"rounding": moved})


@dataclass(frozen=True, eq=False, kw_only=True)
class Bend:
    """``growth`` of the friction per length [N/m] over the time by the bend of strokes, with its standard ``error``;
    friction per length before it and cutting force then, ``after`` (2,), and their half widths; and the share of the
    time up to the puncture, None where the gain of the sensor may not have changed so."""

    growth: float
    error: float
    after: np.ndarray
    halves: np.ndarray
    puncture: float | None

    @property
    def significance(self) -> float:
        """The growth in standard errors."""
        return self.growth / self.error

    @property
    def sentence(self) -> str:
        """What it may be, for a note."""
        return (BENT if self.puncture is None else CHANGES).format(*self.after[:1], self.after[0] + self.growth)

    def moved(self, fit: CycleFit) -> dict[str, float]:
        """How far friction and cutting force move with it."""
        return {name: float(value) - fit.values[name] for name, value in zip(AFTER, self.after)}

    def applied(self, fit: CycleFit) -> CycleFit:
        """The fit with it, and with the gain that the sensor then has at the puncture."""
        low, high, values = dict(fit.low), dict(fit.high), dict(fit.values)
        for name, value, half in zip(AFTER, self.after.tolist(), self.halves.tolist()):
            values[name], low[name], high[name] = value, value - half, value + half
        if self.puncture is not None and self.after[0] > 0.0:
            gain = max(1.0 + self.puncture * self.growth / float(self.after[0]), 0.5)
            for name in ("puncture_force", *CURVES[FITS[fit.law].law.name].amplitudes):
                values[name], low[name], high[name] = (each[name] / gain for each in (values, low, high))
        return replace(fit, values=values, low=low, high=high)


def _bends(fit: CycleFit, parts: list[Stroke]) -> dict[str, Bend]:
    """The bend that both strokes share, by a force that grows with the time since the recording's start, and that of
    the insertion alone, by friction that grows with the logarithm of the time since the contact, as contacts age, or
    with depth. Any line of each stroke is left out of the bend, so that strokes that disagree are not bent."""
    touched = parts[0].touched
    scale = max(float(parts[0].time[0]) - touched, SMALLEST)
    found = {"bend": _bend(fit, parts[:1], lambda time: np.log1p(np.maximum(time - touched, 0.0) / scale))}
    return found | {"time": _bend(fit, parts, lambda time: time)} if len(parts) > 1 else found


def _bend(fit: CycleFit, parts: list[Stroke], growing: Callable) -> Bend:
    """The bend of strokes by friction that grows as ``growing`` of the time."""
    along, across, force, lever = 0.0, 0.0, np.zeros(2), np.zeros(2)
    for part in parts:
        column, noise = part.line[0] * growing(part.time), max(part.noise, SMALLEST)
        common = part.line @ column
        along += float(column @ part.bent) / noise
        across += float(column @ column - common @ part.bread @ common) / noise
        force, lever = force + part.shown * part.products[:2, 2], lever + part.shown * common
    growth, error = along / max(across, SMALLEST), 1.0 / math.sqrt(max(across, SMALLEST))
    bread = inverse(sum(part.gram for part in parts))
    force, lever = bread @ force, bread @ lever
    noise = np.array([0.5 * (fit.high[name] - fit.low[name]) for name in AFTER])
    halves = np.hypot(noise, TWO_SIDED * np.sqrt(parts[0].noise * bread.diagonal() + (error * lever) ** 2))
    puncture = float(parts[0].time[0]) if len(parts) > 1 else None
    return Bend(growth=growth, error=error, after=force - growth * lever, halves=halves, puncture=puncture)


def _disagreeing(fit: CycleFit, parts: list[Stroke], share: float) -> dict[str, CycleFit]:
    """The fit with the friction of a stroke by itself, for each stroke that disagrees with it; ``share`` of the
    interval of the fit is random."""
    name = "friction_per_length"
    value, (below, above) = fit.values[name], fit.systematic_part(name)
    half = share * 0.5 * (fit.high[name] - fit.low[name] - below - above)
    level = _level(fit, parts)
    best = min(parts, key=lambda part: part.halves[0])
    found = {}
    for part in parts:
        change, error = float(part.own[0]) - value, math.hypot(half, part.halves[0])
        away = not -below - error <= change <= above + error
        if away or (level and part is best):
            other = _with_friction(fit, parts[0], float(part.own[0]), float(part.halves[0]), float(level))
            found["insertion" if part.inwards else "withdrawal"] = other
    return found


def _level(fit: CycleFit, parts: list[Stroke], sure: float = 1.0) -> float:
    """The force [N] at which the withdrawal by itself ends at the contact, 0 where its error, so many times, that of
    the zero and what the contact depth may be explain it."""
    if len(parts) < 2:
        return 0.0
    (friction, level), half = parts[1].own, parts[1].halves[1]
    name = "contact_depth"
    away = fit.high[name] - fit.values[name] if level > 0.0 else fit.values[name] - fit.low[name]
    zero = 0.5 * (fit.high["force_offset"] - fit.low["force_offset"])
    explained = math.hypot(sure * half, *np.nan_to_num([friction * away, sure * zero]))
    return float(level) if abs(level) > explained else 0.0


def _other_instants(fit: CycleFit, parts: list[Stroke], single: SegmentedRecording) -> dict[str, CycleFit]:
    """The fit with the depths at the instants of the force, if a lag parts the contact from where the withdrawal by
    itself ends: by twice what it shifts the depths. None where the reversal excludes such a lag, and where what the
    contact depth may be explains the travel too, unless the reversal shows a lag, or a tip that unloads at once."""
    if single.timing.lag is not None or len(parts) < 2:
        return {}
    part, strokes, inside = parts[1], single.strokes, slice(fit.puncture.before, None)
    friction, level = part.own.tolist()
    if not np.all(np.abs(part.own) > SURE * part.halves) or friction < 0.0:
        return {}
    travel, slopes = 0.5 * level / friction, 0.5 * np.array([-level / friction, 1.0]) / friction
    speed = float(np.ptp(strokes.depth_in[inside]) / np.ptp(single.recording.time[strokes.index_in[inside]]))
    reversal = None if single.timing.search is None else single.timing.search.possible
    shown = _level(fit, parts, SURE) or (reversal is not None and reversal.significant)
    allowed = abs(travel) <= MAX_LAG_S * speed and (reversal is None or reversal.allows(-travel / speed))
    if not (shown and allowed):
        return {}
    error = TWO_SIDED * math.sqrt(part.slow * float(slopes @ part.bread @ slopes))
    names, ends = ("contact_depth", "puncture_depth"), (travel, travel - error, travel + error)
    moved = [
        each | {name: each[name] + end for name in names} for each, end in zip((fit.values, fit.low, fit.high), ends)
    ]
    return {"lag": replace(fit, **dict(zip(("values", "low", "high"), moved)))}


def _strokes_alone(fit: CycleFit, parts: list[Stroke]) -> dict[str, dict[str, float]]:
    """How far friction and cutting force move if one stroke alone decides on friction, and if the level at which the
    withdrawal ends is one of the insertion too."""
    found = {}
    for part in parts:
        friction, level = part.own
        moved = _with_friction(fit, parts[0], float(friction), 0.0, 0.0).values
        found["insertion" if part.inwards else "withdrawal"] = {name: moved[name] - fit.values[name] for name in AFTER}
        if not part.inwards:
            found["level"] = dict(zip(AFTER, (0.0, float(level))))
    return found


def with_shared_readings(pooled: dict[str, Estimate], cycles: Sequence[CycleFit]) -> dict[str, Estimate]:
    """Pooled estimates whose intervals hold what a stroke alone gives where repeats show together, by Student's t at
    the level of the intervals, that it differs: a difference within the noise of each may be none of their mean. Of
    bends the noise is known. One in eight conditions that follow the model is widened for nothing."""
    n = len(cycles)
    shared = set.intersection(*(set(each.strokes_alone) for each in cycles)) if n > 1 else set()
    for cause in sorted(shared):
        moved = np.array([[each.strokes_alone[cause][name] for name in AFTER] for each in cycles])
        mean, error = moved.mean(axis=0), student_quantile(n - 1) * moved.std(axis=0, ddof=1) / math.sqrt(n)
        known = abs(sum(each.bends[cause] for each in cycles)) / math.sqrt(n) if cause in BENDS else None
        if (np.abs(mean) > error).any() if known is None else known > BENDS[cause]:
            pooled |= {
                name: _holding(pooled[name], float(change)) for name, change in zip(AFTER, mean) if name in pooled
            }
    return pooled


def _holding(estimate: Estimate, change: float) -> Estimate:
    """The estimate with an interval that holds its value after a ``change``, with its random error."""
    value, (below, above) = estimate.value, estimate.systematic
    below, above = max(below, -change), max(above, change)
    low, high = min(estimate.low, value - below - estimate.random), max(estimate.high, value + above + estimate.random)
    return replace(estimate, low=max(low, min(estimate.low, 0.0)), high=high, systematic=(below, above))


def _with_friction(fit: CycleFit, insertion: Stroke, friction: float, half: float, level: float) -> CycleFit:
    """The fit with another ``friction`` [N/m], its ``half`` width, and the cutting force that follows from the
    insertion's mean, with the errors of contact depth and zero; embedding that begins elsewhere changes it by the
    withdrawal's ``level`` [N] at the contact."""
    friction, (mean, force) = max(friction, 0.0), (insertion.products[1, ::2] / len(insertion.force)).tolist()
    cutting = force - friction * mean
    contact, zero = (0.5 * (fit.high[name] - fit.low[name]) for name in ("contact_depth", "force_offset"))
    width = math.hypot(half * mean, *np.nan_to_num([friction * contact, zero]))
    ends = cutting + min(level, 0.0) - width, cutting + max(level, 0.0) + width
    low = fit.low | dict(zip(AFTER, (friction - half, ends[0])))
    high = fit.high | dict(zip(AFTER, (friction + half, ends[1])))
    return replace(fit, low=low, high=high, values=fit.values | dict(zip(AFTER, (friction, cutting))))


def widened(
    fit: CycleFit, low: Mapping[str, float], high: Mapping[str, float], causes: Mapping[str, Mapping[str, float]]
) -> CycleFit:
    """The fit with wider intervals because of ``causes``, which move the values; not below 0 where they were not: there
    is no negative friction or cutting."""
    low = {**low, **{name: max(low[name], min(fit.low[name], 0.0)) for name in AFTER}}
    systematic, covariance = dict(fit.systematic), fit.covariance
    for name in fit.values:
        below, above = systematic.get(name, (0.0, 0.0))
        systematic[name] = below + _more(fit.low[name], low[name]), above + _more(high[name], fit.high[name])
    for moved in causes.values():
        covariance = covariance + _spread(np.array([moved.get(name, 0.0) for name in fit.order]))
    return replace(
        fit,
        low=low,
        high=dict(high),
        covariance=covariance,
        systematic=systematic,
        causes={**fit.causes, **causes},
    )


def _more(farther: float, limit: float) -> float:
    """By how much a limit moved; a limit that was not known did not."""
    return farther - limit if farther > limit else 0.0


def widen_to_cover(fit: CycleFit, others: Mapping[str, CycleFit]) -> CycleFit:
    """The fit with intervals that cover those of the ``others`` too, each with its cause; its covariance has their
    differences."""
    low, high, causes = dict(fit.low), dict(fit.high), {}
    for cause, other in others.items():
        known = fit.values.keys() & other.values.keys()
        for name in known:
            low[name] = _farther(min, low[name], other.low[name])
            high[name] = _farther(max, high[name], other.high[name])
        causes[cause] = {name: other.values[name] - fit.values[name] for name in known}
    return widened(fit, low, high, causes) if causes else fit


def _farther(end: Callable, one: float, other: float) -> float:
    """The farther of two limits; a limit that is not known does not count."""
    return one if math.isnan(other) else end(one, other)


def _spread(shift: np.ndarray) -> np.ndarray:
    """Covariance (p, p) of values that differ by up to ``shift`` (p,), at the level of the intervals."""
    known = np.where(np.isfinite(shift), shift, 0.0) / TWO_SIDED
    return np.outer(known, known)
