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
from dataclasses import replace

import numpy as np

from ..estimates import Estimate
from ..statistics.noise import ONE_IN_40, SIGNIFICANT, TWO_SIDED, noise_of, student_quantile
from ..statistics.regression import inverse
from ..timing import MAX_LAG_S
from .cycle_values import CycleFit
from .loading_curves import FITS
from .segmented_recording import SegmentedRecording
from .strokes_below import AFTER, Stroke, bends_of, strokes_below

BENDS = {"time": ONE_IN_40, "bend": SIGNIFICANT}
"""[standard errors] of the growth of friction that noise does not explain, by the bend that shows it. The friction at
the contact by the insertion alone is an extrapolation: its interval would be wide for nothing more often."""
SURE = SIGNIFICANT / TWO_SIDED  # [half widths] from which on a difference between strokes is named
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
LATE = (
    "The withdrawal by itself does not end at the contact, as behind a lag between force and depth, which the start of "
    "the withdrawal allows: the intervals of the depths hold that too."
)


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
    random, bends = _random_shares(fit, parts), bends_of(fit, parts)
    alone = {part.name: _with_friction(fit, parts[0], part, _level(fit, parts)) for part in parts}
    others = {name: alone[name] for name in _disagreeing(fit, parts, random["friction_per_length"])}
    bent = {cause: bend.applied(fit) for cause, bend in bends.items()}
    late = _other_instants(fit, parts, single)
    shown = {cause: bent[cause] for cause, bend in bends.items() if abs(bend.significance) > BENDS[cause]}
    sentences = [bend.sentence for bend in bends.values() if abs(bend.significance) > SIGNIFICANT] + [LATE] * len(late)
    moved = {
        cause: {name: each.values[name] - fit.values[name] for name in AFTER} for cause, each in (alone | bent).items()
    }
    if len(parts) > 1:
        moved["level"] = dict(zip(AFTER, (0.0, float(parts[1].own[1]))))
    fit = replace(fit, strokes_alone=moved, bends={cause: bend.significance for cause, bend in bends.items()})
    fit = _with_errors(fit, _slow_misfit(fit, parts) | _rounded_zero(parts, single.force_step))
    if others:
        sentences = [each for each in (_sentence(fit, parts), *sentences) if each]
        fit = _with_random(fit, random)
    notes = tuple(dict.fromkeys((*single.law_notes.get(law, ()), *sentences)))
    fits = single.fits | {law: widen_to_cover(fit, others | shown | late)}
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


def _slow_misfit(fit: CycleFit, parts: list[Stroke]) -> dict[str, dict[str, float]]:
    """How far friction and cutting force move together by what the strokes' slow noise adds to their variance."""
    noises = dict(zip((True, False), fit.residuals.noises))
    more = [max(part.slow - max(part.noise, noises[part.inwards].long_run), 0.0) for part in parts]
    if not any(each > 0.0 for each in more):
        return {}
    bread = inverse(sum(part.gram for part in parts))
    sizes, axes = np.linalg.eigh(bread @ sum(each * part.gram for each, part in zip(more, parts)) @ bread)
    moved = TWO_SIDED * np.sqrt(np.maximum(sizes, 0.0)) * axes * np.where(axes[0] < 0.0, -1.0, 1.0)
    return {name: dict(zip(AFTER, axis)) for name, axis in zip(("slower misfit", "slow misfit"), moved.T.tolist())}


def _rounded_zero(parts: list[Stroke], step: float) -> dict[str, dict[str, float]]:
    """How far they move by half a ``step`` [N] of the force, by which rounding may move the zero."""
    if step <= 0.0:
        return {}
    sums = sum(part.shown * part.line.sum(axis=1) for part in parts)
    moved = 0.5 * step * (inverse(sum(part.gram for part in parts)) @ sums)
    return {"rounding": dict(zip(AFTER, moved.tolist()))}


def _with_errors(fit: CycleFit, causes: Mapping[str, Mapping[str, float]]) -> CycleFit:
    """The fit with independent errors of friction and cutting force by these ``causes``."""
    if not causes:
        return fit
    low, high = dict(fit.low), dict(fit.high)
    for name in AFTER:
        value, halves = fit.values[name], [moved[name] for moved in causes.values()]
        low[name] = value - math.hypot(value - low[name], *halves)
        high[name] = value + math.hypot(high[name] - value, *halves)
    return widened(fit, low, high, causes)


def _disagreeing(fit: CycleFit, parts: list[Stroke], share: float) -> list[str]:
    """The strokes that disagree with the friction of the fit, of whose interval a ``share`` is random."""
    name, level = "friction_per_length", _level(fit, parts)
    value, (below, above) = fit.values[name], fit.systematic_part(name)
    half = share * 0.5 * (fit.high[name] - fit.low[name] - below - above)
    best = min(parts, key=lambda part: part.halves[0])
    found = []
    for part in parts:
        change, error = float(part.own[0]) - value, math.hypot(half, part.halves[0])
        if not -below - error <= change <= above + error or (level and part is best):
            found.append(part.name)
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


def _with_friction(fit: CycleFit, insertion: Stroke, part: Stroke, level: float) -> CycleFit:
    """The fit with the friction of a stroke by itself, and the cutting force that follows from the insertion's mean,
    with the errors of contact depth and zero; embedding that begins elsewhere changes it by the withdrawal's ``level``
    [N] at the contact."""
    friction, half = max(float(part.own[0]), 0.0), float(part.halves[0])
    mean, force = (insertion.products[1, ::2] / len(insertion.force)).tolist()
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
