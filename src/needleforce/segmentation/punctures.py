# SPDX-License-Identifier: Apache-2.0
"""Punctures: falls of the force during inward travel that neither the noise nor the stroke's own fluctuation explains.

Two adjacent windows of the force, of several lengths, with or without a gap between them, are compared at every place
of the stroke. Their difference, less that just before and after it if the force declines there too, is divided by its
standard deviation; the threshold follows from the number of places and ``FALSE_ALARMS``.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtri, stdtrit

from .. import core
from ..vocabulary import SMALLEST
from .strokes import FOURTH_DIFFERENCE, Blocks, white_noise

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
WINDOWS = (3, 5, 8, 12, 20, 32, 50, 80)  # [blocks] lengths of the compared windows
MAX_END_WINDOW = 5  # [blocks] of a comparison near the end of a stroke, where the force after it is not known
MIN_STROKE_WINDOWS = 5  # pairs of windows in a stroke, whose fluctuation is to be known
MIN_FREE_WINDOWS = 6  # windows of free travel that show the correlation of the noise
ROUGH_PARTS = (4, 2, 1)  # of a rupture: lengths over which the fluctuation of a stroke is judged
ROUGH_SIGMA = 2.5  # standard errors by which it exceeds the noise (5 % of smooth strokes, measured): more is texture
MIN_ROUGH_WINDOWS = 20  # such lengths of free travel that show the correlation of the noise over them
ROBUST_SD_ERROR = 0.83  # standard error of a robust standard deviation, times the root of the number of values
MIN_NOISE_SHARE = 1e-4  # of the range of the force: simulated recordings may have no noise


@dataclass(frozen=True, kw_only=True)
class ForceNoise:
    """The noise of a block of the force: standard deviation of its ``white`` part, and the sensor's ``quantum`` [N]."""

    white: float
    quantum: float

    def of_mean(self, count: int) -> float:
        """Standard deviation [N] of the mean of ``count`` blocks; a quantum above the noise is not averaged."""
        rounding = self.quantum / 12**0.5
        return max(self.white / count**0.5, rounding if self.white < 0.5 * self.quantum else 0.0)


@dataclass(frozen=True)
class Comparison:
    """Two windows of ``window`` blocks, ``gap`` blocks apart, at every place: the ``fall`` between their means, its
    ``excess`` over that just before and after, the ``bent`` fall about the windows' slopes, and ``line``, the excess
    with the value at the end of a line for the first mean, (k,) each. The fall at j begins after block j + window - 1.
    The decline before and after it is the larger of the falls a comparison's length away; after the last one it is that
    of the second window's slope in short windows, and otherwise not known, so that there is no excess.
    """

    window: int
    gap: int
    fall: np.ndarray
    excess: np.ndarray
    bent: np.ndarray
    line: np.ndarray

    @property
    def reach(self) -> int:
        """Blocks before and after a fall that it affects."""
        return self.window + self.gap


def robust_sd(values: np.ndarray) -> float:
    """Standard deviation of (n,) values about their median, from the median of their magnitudes."""
    return core.spread_of_part(values, 2) / 0.6745


def comparisons(force: np.ndarray, max_gap: int) -> Iterator[Comparison]:
    """All comparisons of windows in the (n,) block ``force``, shortest windows first, by running sums."""
    count, centred = len(force), force - force.mean()
    for w in WINDOWS:
        if 2 * w > count:
            return
        for gap in (0, 2 * w):
            apart = w + gap
            if gap > max_gap or ((w > WINDOWS[0] or gap) and count < MIN_STROKE_WINDOWS * (apart + w)):
                continue
            fall, excess, bent, line = core.compare_windows(
                centred, window=w, gap=gap, near_end=not gap and w <= MAX_END_WINDOW
            )
            yield Comparison(window=w, gap=gap, fall=fall, excess=excess, bent=bent, line=line)


def deviations(each: Comparison, free: int, noise: ForceNoise) -> tuple[float, float]:
    """Standard deviations [N] of a comparison's fall: the sensor's, and the stroke's own after ``free`` blocks."""
    sensor = 2**0.5 * noise.of_mean(each.window)
    inside = each.fall[: max(free - each.window - each.reach + 1, 0)]
    if free >= MIN_FREE_WINDOWS * (each.window + each.reach) // 2 and len(inside) > 3:
        sensor = max(sensor, robust_sd(inside))
    return sensor, _own_deviation(each, free)


def _own_deviation(each: Comparison, free: int) -> float:
    """Standard deviation [N] of a comparison's fall over the stroke after ``free`` blocks, about its local trend: the
    mean of the same comparison before and after it. A short stroke has only the slope of the windows for a trend.

    Punctures may affect more than half of a stroke; therefore the smallest quarter of the magnitudes is used.
    """
    fall, apart = each.fall[min(free, len(each.fall)) :], each.window + each.reach
    if len(fall) > 4 * apart:
        left = fall[apart:-apart] - 0.5 * (fall[: -2 * apart] + fall[2 * apart :])
        return quarter_sd(left) / 1.5**0.5
    lever = 1.0 + 3.0 * (each.reach / each.window) ** 2  # variance of a bent fall over that of a fall, white noise
    return quarter_sd(each.bent[min(free, len(each.bent)) :]) / lever**0.5


def quarter_sd(values: np.ndarray) -> float:
    """Standard deviation of (n,) normal values about their median of which up to three quarters may be disturbed."""
    return core.spread_of_part(values, 4) / 0.3186


def block_noise(force: np.ndarray, free: int, quantum: float, size: int) -> ForceNoise:
    """The noise of (m,) blocks of ``size`` samples whose ``free`` first ones are free travel.

    White noise is that of the free travel's second differences, or without free travel that of the whole stroke; it is
    at least the rounding to ``quantum`` [N], which varies within a block if the noise is larger.
    """
    white = white_noise(force[:free] if free >= WINDOWS[1] else force[force < force.max()])  # a cut-off force has none
    floor = MIN_NOISE_SHARE * float(np.ptp(force))
    rounding = quantum / (12 * size) ** 0.5
    return ForceNoise(white=max(white, rounding, floor), quantum=quantum)


@dataclass(frozen=True, kw_only=True)
class DropCandidate:
    """A significant fall of the force between blocks ``first`` and ``last``: its ``statistic`` [sd] above a
    ``threshold``, the standard ``deviation`` [N] of the means that show it, and whether it may be texture of a
    ``rough`` stroke, one that fluctuates more than the sensor."""

    first: int
    last: int
    statistic: float
    threshold: float
    deviation: float
    rough: bool = False


def drop_candidates(
    stroke: Blocks, *, free: int, noise: ForceNoise, rupture: int, max_gap: int, turns: bool = False
) -> list[DropCandidate]:
    """The significant falls in ``stroke`` after its ``free`` first blocks, in order of depth. Where it ``turns`` into
    the withdrawal at once, a fall at its very end may be that of the withdrawal, which a lag can bring forward.

    The standard deviation of a comparison is the larger of the sensor's, from the free travel with its correlation, and
    that of the same comparison over the stroke, so that texture of the tissue is noise too. From the shortest windows
    to the longest, a place is left out that an earlier fall affects.

    Noise is normal; the texture of a tissue has heavier tails: in a rough stroke a fall that Student's t with four
    degrees of freedom would reach at the same false-alarm rate is marked as ``rough``.
    """
    found: list[DropCandidate] = []
    short: dict[int, np.ndarray] = {}
    rare = FALSE_ALARMS / _places(len(stroke) - free, max_gap)
    threshold, texture = float(-ndtri(rare)), float(-stdtrit(TEXTURE_FREEDOM, rare))
    correlated = 1.0
    for each in comparisons(stroke.force, max_gap):
        sensor, own = deviations(each, free, noise)
        sd = max(sensor, own, SMALLEST)
        if each.window <= WINDOWS[1] and not each.gap:
            correlated = max(correlated, sd / max(2**0.5 * noise.of_mean(each.window), SMALLEST))
        if not each.gap:
            short[each.window] = each.excess / sd
        score = _scores(each, sd, short)
        score[: max(free - each.window, 0)] = 0.0
        for other in found:
            score[max(other.first - each.reach - each.window, 0) : max(other.last + each.reach, 0)] = 0.0
        for j in _peaks(score, threshold, each.reach):
            a = j + each.window - 1
            found.append(
                DropCandidate(
                    first=a,
                    last=a + each.gap + 1,
                    statistic=float(score[j]),
                    threshold=threshold,
                    deviation=sd / 2**0.5,
                )
            )
    found += _steep_candidates(stroke.force, found, free=free, noise=noise, max_gap=max_gap)
    if not turns:
        found += _last_candidates(stroke, found, free=free, noise=noise, threshold=threshold * correlated)
    rough = _texture_around(stroke.force, free, noise, rupture, found)
    unclear = (each.statistic < texture / threshold * each.threshold for each in found)
    judged = [replace(each, rough=a and b) for each, a, b in zip(found, rough, unclear, strict=True)]
    return sorted(judged, key=lambda each: each.first)


def _texture_around(
    force: np.ndarray, free: int, noise: ForceNoise, rupture: int, found: list[DropCandidate]
) -> list[bool]:
    """Whether the (m,) force of a stroke fluctuates significantly more than the noise after its ``free`` first blocks,
    elsewhere than at each of the falls ``found``, and as far from it as a rounded one is long.

    Fourth differences of means over parts of a ``rupture`` [blocks] are compared: a smooth loading curve contributes
    nothing to them, and what a rupture does to a curve is no texture.
    """
    sums = np.concatenate(([0.0], np.cumsum(force - force[0])))
    rough, lengths = [False] * len(found), sorted({max(3, rupture // part) for part in ROUGH_PARTS})
    known = free >= MIN_ROUGH_WINDOWS * lengths[0]  # the free travel may be quieter than white noise, or louder
    level = min(noise.quantum / 12**0.5 / max(noise.white, SMALLEST), 1.0) if known else 1.0
    for w in lengths:
        if len(force) - free < 8 * w:
            break
        mean = (sums[w:] - sums[:-w]) / w
        second = mean[: -2 * w] - 2.0 * mean[w:-w] + mean[2 * w :]
        fourth = second[: -2 * w] - 2.0 * second[w:-w] + second[2 * w :]
        sensor = FOURTH_DIFFERENCE * noise.of_mean(w)
        if free >= MIN_ROUGH_WINDOWS * w:
            level = max(level, robust_sd(fourth[: free - 5 * w + 1]) / max(sensor, SMALLEST))
        for number, each in enumerate(found):
            low, high = 2 * each.first - each.last - 5 * w - free, 2 * each.last - each.first - free
            apart = np.concatenate((fourth[free:][: max(low, 0)], fourth[free:][max(high, 0) :]))
            error = (w / max(len(apart), 1) + w / max(free, MIN_ROUGH_WINDOWS * w)) ** 0.5
            limit = (1.0 + ROUGH_SIGMA * ROBUST_SD_ERROR * error) * level * sensor
            rough[number] = rough[number] or (len(apart) > 3 * w and robust_sd(apart) > limit)
    return rough


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


def _steep_candidates(
    force: np.ndarray, found: list[DropCandidate], *, free: int, noise: ForceNoise, max_gap: int
) -> list[DropCandidate]:
    """Falls from one block to the next in a rise so steep that the mean before it is below that after it.

    The fall is significant by itself, and so is that below the line through the four blocks before the last one, which
    a single outlier does not bend.
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
    score = np.minimum(fall / max(sds[0], SMALLEST), below / max(sds[1], SMALLEST))
    score[:inside] = 0.0
    threshold = float(-ndtri(FALSE_ALARMS / (_places(len(force) - free, max_gap) + len(score))))
    for other in found:
        score[max(other.first - 2 * count, 0) : max(other.last + count, 0)] = 0.0
    return [
        DropCandidate(
            first=j + count,
            last=j + count + 1,
            statistic=float(score[j]),
            threshold=threshold,
            deviation=sds[0] / 2**0.5,
        )
        for j in _peaks(score, threshold, count)
    ]


def _last_candidates(
    stroke: Blocks, found: list[DropCandidate], *, free: int, noise: ForceNoise, threshold: float
) -> list[DropCandidate]:
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
        score = fall / max(noise.of_mean(count) ** 2 + line + noise.of_mean(after) ** 2, SMALLEST) ** 0.5
        near = any(other.first - count <= k <= other.last + count for other in [*found, *extra])
        if score > threshold and not near:
            extra.append(
                DropCandidate(
                    first=k - 1,
                    last=end - 1,
                    statistic=score,
                    threshold=threshold,
                    deviation=noise.of_mean(count),
                )
            )
    return extra
