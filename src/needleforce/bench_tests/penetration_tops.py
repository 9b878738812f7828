# SPDX-License-Identifier: Apache-2.0
"""The top of a peak in a penetration curve: force and travel of a maximum with their intervals, sudden or rounded."""

import math
from dataclasses import dataclass, replace

import numpy as np

from .. import core
from ..identification.statistics.evidence import CurveNoise
from ..vocabulary import SMALLEST
from .penetration_curve import NORMAL_95

FIT_LENGTHS = (4, 6, 9, 13, 19, 28, 41, 60, 88, 129, 189, 277, 406, 595)  # [samples] of the fit at a peak
MAX_SHIFT_SIGMA = 1.5  # [standard errors] by which a longer fit may move the peak
MAX_PLACES = 40  # places at which the fits before and after a peak may meet
MAX_FIT_EXCESS = 2.0  # [standard errors] of the residual's variance over the noise, beyond which a fit is too long


@dataclass(frozen=True, kw_only=True)
class Feature:
    """A peak or a step of the curve, ``kind`` ``"peak"`` or ``"step"``.

    ``force`` [N] at ``travel`` [m], each with the ends of its 95 % interval; ``reading`` [N] is the highest sample;
    ``fall`` [N] to the next minimum, with its interval, 0 at a step; ``index`` and ``end`` are the samples of the
    peak and of that minimum; ``statistic`` is the fall, or the bend, in standard deviations.
    """

    kind: str
    index: int
    end: int
    travel: float
    travel_low: float
    travel_high: float
    force: float
    low: float
    high: float
    reading: float
    statistic: float
    fall: float = 0.0
    fall_low: float = 0.0
    fall_high: float = 0.0


def top_of(
    travel: np.ndarray, force: np.ndarray, noise: CurveNoise, *, index: int, width: int, first: int, last: int
) -> Feature:
    """Force and travel of the maximum near sample ``index`` between samples ``first`` and ``last``.

    A parabola is fitted to the samples before the peak and another to those after it, joined where they describe the
    samples best, over the longest stretch that they describe within the noise. At a sudden fall the end of the first is
    the peak, and the true one lies up to a sample later; at a rounded one it is a vertex. The highest reading alone
    would be above the peak by the noise.
    """
    level = moving_mean(force, width)
    # the highest of many readings and the lowest near it are this far apart by chance
    apart = 2.0 * (2.0 * math.log(last - first + 2)) ** 0.5 * noise.of_mean(width)
    lower = level < level[index] - apart
    gone = np.flatnonzero(lower[index : last + 1])
    end = min(index + (int(gone[0]) - 1 if len(gone) else last - index), last)
    near = np.flatnonzero(lower[first : index + 1])
    start = first + int(near[-1]) + 1 if len(near) else first
    if end - start > 2 * MAX_PLACES:
        blocks = max(end - start, 1) // MAX_PLACES
        return _top_of_blocks(travel, force, noise, size=blocks, ends=(start, end), limits=(first, last))
    best = Top(value=float(force[index]), error=noise.of_mean(1), at=index, low=index, high=end, slope=0.0)
    known: list[Top] = []
    for m in FIT_LENGTHS:
        part = range(max(index - m, first), min(end + m, last) + 1)
        if part.start == first and part.stop == last + 1 and known:
            break
        found = _joined(travel, force, noise, part=part, places=(max(start, index - m), end))
        if found is None:
            break
        if any(_has_moved(found, other, end - start + 1) for other in known):
            break
        shift = max((abs(found.value - each.value) for each in known), default=0.0)
        known.append(found)
        best = replace(found, error=float(np.hypot(found.error, shift)))  # the length was chosen: a kink is rounded
    after = min(best.at + 1, len(travel) - 1)
    growth = max(best.slope, 0.0) * max(float(travel[after] - travel[best.at]), 0.0)
    return Feature(
        kind="peak",
        index=best.at,
        end=end,
        travel=float(travel[best.at]),
        travel_low=float(travel[max(best.low - 1, 0)]),
        travel_high=float(travel[min(best.high + 1, len(travel) - 1)]),
        force=best.value,
        low=best.value - NORMAL_95 * best.error,
        high=best.value + NORMAL_95 * best.error + growth,
        reading=float(force[max(min(index, best.low) - width, first) : end + 1].max()),
        statistic=np.nan,
    )


def _has_moved(longer: "Top", shorter: "Top", near: int) -> bool:
    """Whether a longer fit moves the top. A shorter one is at the highest of several places among the ``near`` samples
    and is above them by chance, so that the longer one may be lower by half of that: a kink is lowered as well."""
    places = max(near / max(shorter.high - shorter.low + 1, 1), 1.0)
    chance = 0.5 * (2.0 * math.log(places)) ** 0.5 if longer.value < shorter.value else 0.0
    return abs(longer.value - shorter.value) > (MAX_SHIFT_SIGMA + chance) * shorter.error


def _top_of_blocks(
    travel: np.ndarray,
    force: np.ndarray,
    noise: CurveNoise,
    *,
    size: int,
    ends: tuple[int, int],
    limits: tuple[int, int],
) -> Feature:
    """``top_of`` for means over ``size`` samples, where many samples between the ``ends`` are near the top: the highest
    of many is so by chance."""
    first, last = limits
    z, f = (core.block_means(np.ascontiguousarray(values[first : last + 1]), size) for values in (travel, force))
    a, b = (ends[0] - first) // size, max((ends[1] - first) // size, 1)
    top = a + int(f[a:b].argmax())
    found = top_of(z, f, noise.of_blocks(size), index=top, width=1, first=0, last=len(f) - 1)
    reading = float(force[ends[0] : ends[1] + 1].max())
    return replace(found, index=first + found.index * size, end=first + found.end * size, reading=reading)


@dataclass(frozen=True, kw_only=True)
class Top:
    """The largest ``value`` [N] of two fitted parabolas, its standard ``error``, its sample ``at``, the samples between
    which they do not differ from it, and the ``slope`` [N/m] if the force still rises there."""

    value: float
    error: float
    at: int
    low: int
    high: int
    slope: float


def _joined(
    travel: np.ndarray, force: np.ndarray, noise: CurveNoise, *, part: range, places: tuple[int, int]
) -> Top | None:
    """The top of two parabolas that meet after the best of the ``places``, None if they miss the samples."""
    candidates = np.unique(np.linspace(places[0], max(places), MAX_PLACES).astype(int))
    candidates = candidates[(candidates >= part.start + 2) & (candidates < part.stop)]
    if part.stop == len(force) and int(force[part.start :].argmax()) == len(part) - 1:
        # it still rises at the end, where a parabola through the last few would leave them out of the top
        after = part.stop - 1 - candidates
        candidates = candidates[(after == 0) | (after > 3)]
    sd = noise.of_mean(1)
    best: tuple[float, int, tuple, tuple | None] | None = None
    for k in candidates.tolist():
        left = _parabola(travel, force, part.start, k + 1)
        right = _parabola(travel, force, k + 1, part.stop) if k + 1 < part.stop else None
        # a few samples after the place fit exactly: their terms count (Akaike)
        cost = left[0] + (right[0] + 2.0 * sd * sd * min(3, part.stop - k - 1) if right else 0.0)
        if best is None or cost < best[0]:
            best = (cost, k, left, right)
    if best is None:
        return None
    _, k, left, right = best
    squares, free = left[0] + (right[0] if right else 0.0), max(len(part) - 6 - 1, 1)
    if squares > sd * sd * (free + MAX_FIT_EXCESS * (2.0 * free) ** 0.5) and len(part) > 2 * FIT_LENGTHS[0] + 1:
        return None
    _, fit, variance, slope = left
    start, rises = part.start, int(fit.argmax()) >= len(fit) - 2
    slope = max(slope, _mean_slope(travel[start : k + 1], fit))
    if rises and right is not None and len(right[1]) > 3 and 0 < int(right[1].argmax()) and right[1].max() > fit[-1]:
        (_, fit, variance, slope), start, rises = right, k + 1, False
    top = int(fit.argmax())
    correlated = max(noise.of_mean(len(fit)) * len(fit) ** 0.5 / sd, 1.0)
    error = max(sd * correlated * float(variance[top]) ** 0.5, noise.quantum / 12**0.5 if noise.coarse else 0.0)
    near = np.flatnonzero(fit >= fit[top] - 2.0 * NORMAL_95 * error)
    high = start + int(near[-1])
    if right is not None and high == k:  # it may lie after the place at which the parabolas meet
        high += int(np.flatnonzero(np.append(right[1], -np.inf) < fit[top] - 2.0 * NORMAL_95 * error)[0])
    return Top(
        value=float(fit[top]),
        error=error,
        at=start + top,
        low=start + int(near[0]),
        high=high,
        slope=slope if rises and k + 1 < part.stop else 0.0,
    )


def _mean_slope(travel: np.ndarray, fit: np.ndarray) -> float:
    """The mean slope [N/m] of the second half of a fit over (n,) travel."""
    half = len(fit) // 2
    return (
        float(fit.max() - fit[half]) / max(float(travel[-1] - travel[half]), SMALLEST) if half < len(fit) - 1 else 0.0
    )


def _parabola(
    travel: np.ndarray, force: np.ndarray, first: int, stop: int
) -> tuple[float, np.ndarray, np.ndarray, float]:
    """Sum of squares, fit and its variances in those of a sample of a parabola through samples ``first`` up to
    ``stop`` (fewer terms for few samples), and its slope [N/m] at the end."""
    length = float(travel[stop - 1] - travel[first])
    if not length > 0.0:
        part = force[first:stop]
        fit = np.full(len(part), part.mean())
        return float(((part - fit) ** 2).sum()), fit, np.full(len(part), 1.0 / len(part)), 0.0
    x = (travel[first:stop] - travel[stop - 1]) / length
    basis, triangle = np.linalg.qr(np.vander(x, min(3, max(stop - first - 1, 1)), increasing=True))
    parts = basis.T @ force[first:stop]
    fit = basis @ parts
    coefficients = np.linalg.lstsq(triangle, parts, rcond=None)[0]
    slope = float(coefficients[1]) / length if len(coefficients) > 1 else 0.0
    return float(((force[first:stop] - fit) ** 2).sum()), fit, (basis**2).sum(axis=1), slope


def moving_mean(values: np.ndarray, width: int) -> np.ndarray:
    """Centred means over ``width`` samples, fewer at the ends, (n,)."""
    if width < 2:
        return values
    sums = np.concatenate(([0.0], np.cumsum(values)))
    at = np.arange(len(values))
    low, high = np.maximum(at - width // 2, 0), np.minimum(at + width // 2 + 1, len(values))
    return (sums[high] - sums[low]) / (high - low)
