# SPDX-License-Identifier: Apache-2.0
"""Peaks and steps of a penetration curve, force over travel, judged against its noise; what is set is the rate of false
alarms."""

import itertools
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import maximum_filter1d
from scipy.special import ndtri, stdtrit

from .. import core
from ..identification.statistics.evidence import CurveNoise
from .penetration_curve import NORMAL_95
from .penetration_tops import Feature, moving_mean, top_of

FALSE_ALARMS = 1e-3  # peaks, and steps, found in a curve that only rises, with normal noise
FREEDOM_PER_SAMPLE = 0.5  # degrees of freedom of a robust estimate of the noise
MIN_BLOCKS = 8  # means over a length in which peaks are searched
STEP_WINDOWS = (8, 12, 20, 32, 50, 80, 128)  # [samples or blocks] before and after a step
STEP_ORDER = 5  # degree of the polynomial that a step differs from: a smooth bend is none
MIN_SLOPE_LOSS = 0.5  # of the slope before a step, at the step
MAX_BLOCKS = 2000  # blocks of a long curve in which steps are searched


@dataclass(frozen=True, kw_only=True)
class Turn:
    """A turning point of the curve: sample ``index``, ``level`` [N] of the mean that shows it, whether it is a maximum,
    and the ``width`` [samples] of that mean."""

    index: int
    level: float
    maximum: bool
    width: int


def peaks(travel: np.ndarray, force: np.ndarray, noise: CurveNoise) -> list[Feature]:
    """The maxima of (n,) force [N] over travel [m] after which it falls by more than the noise explains.

    Means over 1, 2, 4 … samples are searched for a maximum and a later minimum that differ by more than normal noise
    does in any pair of them, once in 1000 curves that only rise. What long means show is added where short ones rise
    or fall throughout.
    """
    turns: list[Turn] = []
    scales = [w for w in noise.lengths.tolist() if len(force) // w >= MIN_BLOCKS]
    for w in scales:
        count = len(force) // w
        rare = 2.0 * FALSE_ALARMS / (count**2 * len(scales))
        threshold = 2**0.5 * noise.of_mean(w) * float(-stdtrit(FREEDOM_PER_SAMPLE * len(force), rare))
        turns = _merged(turns, _turns(force, w, threshold))
    return [
        _peak(travel, force, noise, before=before.index, top=top, after=after.index)
        for before, top, after in zip(turns, turns[1:], turns[2:])
        if top.maximum
    ]


def _turns(force: np.ndarray, width: int, threshold: float) -> list[Turn]:
    """Alternating extremes of means over ``width`` samples of (n,) force that differ by ``threshold`` [N] and more."""
    means = core.block_means(np.ascontiguousarray(force), width)
    at = core.reversals(means, threshold)
    if len(at) < 2 or abs(means[at[0]] - means[at[1]]) < threshold:
        return []
    if len(at) > 2 and abs(means[at[-1]] - means[at[-2]]) < threshold:
        at = at[:-1]
    found, maximum = [], bool(means[at[0]] > means[at[1]])
    for k in at:
        part = force[k * width : (k + 1) * width]
        sample = k * width + int(part.argmax() if maximum else part.argmin())
        found.append(Turn(index=sample, level=float(means[k]), maximum=maximum, width=width))
        maximum = not maximum
    return found


def _merged(turns: list[Turn], found: list[Turn]) -> list[Turn]:
    """The turning points with those ``found`` in longer means where the curve had none: before the first, after the
    last, or inside a stretch of the opposite direction."""
    added = list(turns)
    for a, b in itertools.pairwise(found):
        inside = [p for p, q in itertools.pairwise(turns) if p.index < a.index and b.index < q.index]
        outside = not turns or b.index <= turns[0].index or a.index >= turns[-1].index
        if outside or (inside and inside[0].maximum != a.maximum):
            added += [a, b]
    kept: list[Turn] = []
    for each in sorted(added, key=lambda turn: turn.index):
        if not kept or each.maximum != kept[-1].maximum:
            kept.append(each)
        elif (each.level > kept[-1].level) == each.maximum and each.width <= kept[-1].width:
            kept[-1] = each
    return kept


def _peak(travel: np.ndarray, force: np.ndarray, noise: CurveNoise, *, before: int, top: Turn, after: int) -> Feature:
    """The peak at the turning point ``top``, between the minima ``before`` and ``after``."""
    index, width = top.index, top.width
    found = top_of(travel, force, noise, index=index, width=width, first=before, last=after)
    bottom_width = max(1, min(width, (after - index) // 2))
    low, high = max(after - bottom_width + 1, 0), min(after + bottom_width, len(force))
    error = noise.of_mean(high - low)
    bottom = float(force[low:high].mean())
    bottom, spread = (bottom, NORMAL_95 * error) if width > 1 else (float(force[after]), 2 * NORMAL_95 * error)
    fall = found.force - bottom
    statistic = fall / (2**0.5 * noise.of_mean(width))
    return replace(
        found,
        end=after,
        fall=fall,
        fall_low=found.low - bottom - spread,
        fall_high=found.high - bottom + spread,
        statistic=statistic,
    )


def steps(travel: np.ndarray, force: np.ndarray, noise: CurveNoise, found: list[Feature]) -> list[Feature]:
    """Places in the rises between the peaks ``found`` at which the slope falls at once by half or more.

    A bend at one place is compared with a polynomial of fifth degree over equal stretches before and after it: the
    part of the bend that such a polynomial does not follow is beyond the noise in one of 1000 curves without one.
    """
    rises = [(0, found[0].index if found else len(force) - 1)]
    rises += [(a.end, b.index) for a, b in itertools.pairwise(found)]
    rises += [(found[-1].end, len(force) - 1)] if found else []
    rare = FALSE_ALARMS / len(rises)
    result = [
        _step(travel, force, noise, ends=(first, last), rare=rare)
        for first, last in rises
        if last - first > 2 * STEP_WINDOWS[0]
    ]
    return [each for each in result if each is not None]


def _step(
    travel: np.ndarray, force: np.ndarray, noise: CurveNoise, *, ends: tuple[int, int], rare: float
) -> Feature | None:
    """The most significant step between the samples ``ends``, on a grid of equal travel, or None."""
    first, last = ends
    z, f = travel[first : last + 1], force[first : last + 1]
    if not z[-1] > z[0] or not np.all(np.diff(z) >= 0.0):
        return None
    count = min(len(z), MAX_BLOCKS)
    grid = np.linspace(z[0], z[-1], count)
    per = len(z) / count
    even = np.interp(grid, z, moving_mean(f, max(int(per), 1)))
    sd = noise.of_mean(max(int(per), 1))
    best: tuple[float, int, int] | None = None
    windows = [w for w in STEP_WINDOWS if 2 * w <= count]
    places = sum(4.0 * count / w for w in windows)
    for w in windows:
        score = _bend_scores(even, w, max(noise.of_mean(max(int(w * per / 3), 1)) * max(w / 3, 1.0) ** 0.5, sd))
        k = int(score.argmax())
        if score[k] > -ndtri(rare / places) and (best is None or score[k] > best[0]):
            best = (float(score[k]), k + w, w)
    if best is None:
        return None
    statistic, k, w = best
    before, after = (np.polyfit(grid[part], even[part], 1)[0] for part in (slice(k - w, k), slice(k, k + w)))
    if before <= 0.0 or after > (1.0 - MIN_SLOPE_LOSS) * before:
        return None
    line = np.polyfit(grid[k - w : k], even[k - w : k], 1)
    value, error, reach = float(np.polyval(line, grid[k])), 2.0 * noise.of_mean(max(int(w * per), 1)), grid[1] - grid[0]
    around = max(2.0, w / max(statistic, 1.0)) * float(reach)
    index = first + int(np.searchsorted(z, grid[k]))
    error += abs(float(before)) * around / NORMAL_95
    return Feature(
        kind="step",
        index=index,
        end=index,
        travel=float(grid[k]),
        travel_low=float(grid[k]) - around,
        travel_high=float(grid[k]) + around,
        force=value,
        low=value - NORMAL_95 * error,
        high=value + NORMAL_95 * error,
        reading=float(force[index]),
        statistic=statistic,
    )


def _bend_scores(values: np.ndarray, w: int, sd: float) -> np.ndarray:
    """By how many standard deviations a slope that falls at one place describes (n,) values better than a polynomial
    of fifth degree over ``w`` places before and after it; both with a cubic. 0 where it does not, (n - 2 w + 1,)."""
    x = (np.arange(2 * w) - w + 0.5) / w
    basis, _ = np.linalg.qr(np.vander(x, STEP_ORDER + 1, increasing=True))
    cubic = basis[:, :4]
    bend = -np.maximum(x, 0.0)
    bend -= cubic @ (cubic.T @ bend)
    centred = values - values.mean()
    own, *smooth = (
        np.convolve(centred, each[::-1], "valid") for each in (bend / np.linalg.norm(bend), *basis[:, 4:].T)
    )
    better = (own**2 - sum(each**2 for each in smooth)) / sd**2
    # where the slope rises abruptly, it seems to fall on either side, less clearly
    clear = np.abs(own) >= maximum_filter1d(np.abs(own), 2 * w + 1)
    return np.where(clear & (own > 0.0), np.maximum(better, 0.0), 0.0) ** 0.5
