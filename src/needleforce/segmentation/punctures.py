# SPDX-License-Identifier: Apache-2.0
"""Punctures: falls of the force during inward travel that neither the noise nor the stroke's own fluctuation explains.

Two adjacent windows of the force, of several lengths, with or without a gap between them, are compared at every place
of the stroke. Their difference, less that just before and after it if the force declines there too, is divided by its
standard deviation; the threshold follows from the number of places and ``FALSE_ALARMS``.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri, stdtrit

from .comparisons import WINDOWS, Comparison, ForceNoise, comparisons, deviations, is_rough, quarter_sd, robust_sd
from .strokes import Blocks

FALSE_ALARMS = 1e-3  # punctures found in a recording that has only normal noise
MIN_LINE_WINDOW = 8  # [blocks] a line through fewer is less certain than their mean
CHECK_SIGMA = 4.0  # [sd] of the step by which a fall is located
SHORT_SIGMA = 5.0  # [sd] of the fall between short windows where a line judges it, which ends above a sharp bend
SHORT_SHARE = 0.4  # of a window: the short one of that check
TEXTURE_FREEDOM = 4.0  # degrees of freedom of Student's t for the texture of a rough stroke
LINE_BEFORE = 0.25 + 0.2 * 4.0 * np.array([-1.5, -0.5, 0.5, 1.5])  # a line through four blocks at 4 past their centre
PLACES_SKIPPED = 2  # the block before a steep fall, and that after it
END_WINDOWS = (12, 5)  # [blocks] before a fall near the end, the first that there is place for
MIN_PLACES = 10.0  # of a stroke of few blocks


@dataclass(frozen=True, kw_only=True)
class Fall:
    """A significant fall between blocks ``first`` and ``last``: its ``statistic`` [sd] above a ``threshold``, the
    standard ``deviation`` [N] of the means that show it, and whether it may be texture of a ``rough`` stroke, one that
    fluctuates more than the sensor."""

    first: int
    last: int
    statistic: float
    threshold: float
    deviation: float
    rough: bool


def falls(
    stroke: Blocks, *, free: int, noise: ForceNoise, rupture: int, max_gap: int, turns: bool = False
) -> list[Fall]:
    """The significant falls in ``stroke`` after its ``free`` first blocks, in order of depth. Where it ``turns`` into
    the withdrawal at once, a fall at its very end may be that of the withdrawal, which a lag can bring forward.

    The standard deviation of a comparison is the larger of the sensor's, from the free travel with its correlation, and
    that of the same comparison over the stroke, so that texture of the tissue is noise too. From the shortest windows
    to the longest, a place is left out that an earlier fall affects.

    Noise is normal; the texture of a tissue has heavier tails: in a rough stroke a fall that Student's t with four
    degrees of freedom would reach at the same false-alarm rate is marked as ``rough``.
    """
    found: list[Fall] = []
    short: dict[int, np.ndarray] = {}
    rare = FALSE_ALARMS / _places(len(stroke) - free, max_gap)
    threshold, texture = float(-ndtri(rare)), float(-stdtrit(TEXTURE_FREEDOM, rare))
    correlated, rough = 1.0, is_rough(stroke.force, free, noise, rupture)
    for each in comparisons(stroke.force, max_gap):
        sensor, own = deviations(each, free, noise)
        sd = max(sensor, own, 1e-300)
        if each.window <= WINDOWS[1] and not each.gap:
            correlated = max(correlated, sd / max(2**0.5 * noise.of_mean(each.window), 1e-300))
        if not each.gap:
            short[each.window] = each.excess / sd
        score = _scores(each, sd, short)
        score[: max(free - each.window, 0)] = 0.0
        for other in found:
            score[max(other.first - each.reach - each.window, 0) : max(other.last + each.reach, 0)] = 0.0
        for j in _peaks(score, threshold, each.reach):
            a, statistic = j + each.window - 1, float(score[j])
            unclear = rough and statistic < texture
            found.append(
                Fall(
                    first=a,
                    last=a + each.gap + 1,
                    statistic=statistic,
                    threshold=threshold,
                    deviation=sd / 2**0.5,
                    rough=unclear,
                )
            )
    found += _steep_falls(stroke.force, found, free=free, noise=noise, rough=texture if rough else 0.0, max_gap=max_gap)
    limits = (threshold * correlated, texture * correlated)
    if not turns:
        found += _last_falls(stroke, found, free=free, noise=noise, rough=rough, limits=limits)
    return sorted(found, key=lambda fall: fall.first)


def _places(count: int, max_gap: int) -> float:
    """The number of independent places in ``count`` blocks: about two a window, for each comparison."""
    places = sum(
        2.0 * count / w * (1 + (2 * w <= max_gap) + (w >= MIN_LINE_WINDOW)) for w in WINDOWS if 10 * w <= count
    )
    return max(places, MIN_PLACES)


def _scores(each: Comparison, sd: float, short: dict[int, np.ndarray]) -> np.ndarray:
    """The fall's (k,) standard deviations: by the means, or by the line if short windows show a fall too."""
    score = each.excess / sd
    if each.gap or each.window < MIN_LINE_WINDOW:
        return score
    w = max(w for w in short if w <= SHORT_SHARE * each.window)
    checked = short[w][each.window - w : each.window - w + len(score)] > SHORT_SIGMA
    return np.maximum(score, np.where(checked, each.line / (2.5**0.5 * sd), 0.0))


def _peaks(score: np.ndarray, threshold: float, reach: int) -> list[int]:
    """The largest score of every group above ``threshold``; groups are more than ``reach`` blocks apart."""
    above = np.flatnonzero(score > threshold)
    if not len(above):
        return []
    groups = np.split(above, np.flatnonzero(np.diff(above) > reach) + 1)
    return [int(group[np.argmax(score[group])]) for group in groups]


def _steep_falls(
    force: np.ndarray, found: list[Fall], *, free: int, noise: ForceNoise, rough: float, max_gap: int
) -> list[Fall]:
    """Falls from one block to the next in a rise so steep that the mean before it is below that after it.

    The fall is significant by itself, and so is that below the line through the four blocks before the last one, which
    a single outlier does not bend. ``rough`` is the threshold for the texture of a rough stroke, or 0.
    """
    count = len(LINE_BEFORE)
    if len(force) - free < 3 * count:
        return []
    line = np.convolve(force, LINE_BEFORE[::-1], "valid")[: -PLACES_SKIPPED - 1]
    fall, below = -np.diff(force)[count:][: len(line)], line - 0.5 * (force[count + 1 : -1] + force[count + 2 :])
    white, inside = noise.of_mean(1), max(free - count - 2, 0)
    sds = (2.0**0.5 * white, (float(LINE_BEFORE @ LINE_BEFORE) + 0.5) ** 0.5 * white)
    sds = [
        max(sd, robust_sd(each[:inside]), quarter_sd(each[inside:]))
        for sd, each in zip(sds, (fall, below), strict=True)
    ]
    score = np.minimum(fall / max(sds[0], 1e-300), below / max(sds[1], 1e-300))
    score[:inside] = 0.0
    threshold = float(-ndtri(FALSE_ALARMS / (_places(len(force) - free, max_gap) + len(score))))
    for other in found:
        score[max(other.first - 2 * count, 0) : max(other.last + count, 0)] = 0.0
    return [
        Fall(
            first=j + count,
            last=j + count + 1,
            statistic=float(score[j]),
            threshold=threshold,
            deviation=sds[0] / 2**0.5,
            rough=bool(score[j] < rough),
        )
        for j in _peaks(score, threshold, count)
    ]


def _last_falls(
    stroke: Blocks, found: list[Fall], *, free: int, noise: ForceNoise, rough: bool, limits: tuple[float, float]
) -> list[Fall]:
    """Falls just before the end, with fewer blocks after than before them: below the line through these, where it
    declines, and below their mean."""
    extra, force, end = [], stroke.force, len(stroke)
    for after in range(1, WINDOWS[1]):
        k = end - after
        count = next((w for w in END_WINDOWS if k - w >= free), 0)
        if not count:
            continue
        before, place = force[k - count : k], np.arange(count) - (count - 1) / 2
        decline, apart = max(-float(place @ before) / float(place @ place), 0.0), 0.5 * (count + after)
        fall = float(before.mean() - force[k:end].mean()) - decline * apart
        line = noise.of_mean(1) ** 2 * apart**2 / float(place @ place)
        score = fall / max(noise.of_mean(count) ** 2 + line + noise.of_mean(after) ** 2, 1e-300) ** 0.5
        near = any(other.first - count <= k <= other.last + count for other in [*found, *extra])
        if score > limits[0] and not near:
            extra.append(
                Fall(
                    first=k - 1,
                    last=end - 1,
                    statistic=score,
                    threshold=limits[0],
                    deviation=noise.of_mean(count),
                    rough=rough and score < limits[1],
                )
            )
    return extra
