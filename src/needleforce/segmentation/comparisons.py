# SPDX-License-Identifier: Apache-2.0
"""Comparisons of adjacent windows of the force at every place of a stroke, and the standard deviations of these: that
of the sensor, from the free travel, and that of the stroke's own fluctuation."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .. import core
from .strokes import white_noise

WINDOWS = (3, 5, 8, 12, 20, 32, 50, 80)  # [blocks] lengths of the compared windows
MAX_END_WINDOW = 5  # [blocks] of a comparison near the end of a stroke, where the force after it is not known
MIN_STROKE_WINDOWS = 5  # pairs of windows in a stroke, whose fluctuation is to be known
MIN_FREE_WINDOWS = 6  # windows of free travel that show the correlation of the noise
ROUGH_PARTS = (4, 2, 1)  # of a rupture: lengths over which the fluctuation of a stroke is judged
ROUGH_SIGMA = 2.0  # standard errors (2 % by chance) by which it exceeds the noise: more is texture of the tissue
MIN_ROUGH_WINDOWS = 20  # such lengths of free travel that show the correlation of the noise over them
ROBUST_SD_ERROR = 0.83  # standard error of a robust standard deviation, times the root of the number of values
FOURTH_DIFFERENCE = 70**0.5  # sd of a fourth difference of values with sd 1
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


def is_rough(force: np.ndarray, free: int, noise: ForceNoise, rupture: int) -> bool:
    """Whether the (m,) force of a stroke fluctuates significantly more than the noise after its ``free`` first blocks.

    Fourth differences of means over parts of a ``rupture`` [blocks] are compared: a smooth loading curve contributes
    nothing to them.
    """
    sums = np.concatenate(([0.0], np.cumsum(force - force[0])))
    inside, correlated = len(force) - free, 1.0
    for w in sorted({max(3, rupture // part) for part in ROUGH_PARTS}):
        if inside < 8 * w:
            break
        mean = (sums[w:] - sums[:-w]) / w
        second = mean[: -2 * w] - 2.0 * mean[w:-w] + mean[2 * w :]
        fourth = second[: -2 * w] - 2.0 * second[w:-w] + second[2 * w :]
        sensor = FOURTH_DIFFERENCE * noise.of_mean(w)
        if free >= MIN_ROUGH_WINDOWS * w:
            correlated = max(correlated, robust_sd(fourth[: free - 5 * w + 1]) / max(sensor, 1e-300))
        error = (w / inside + w / max(free, MIN_ROUGH_WINDOWS * w)) ** 0.5
        if robust_sd(fourth[free:]) > (1.0 + ROUGH_SIGMA * ROBUST_SD_ERROR * error) * correlated * sensor:
            return True
    return False


def block_noise(force: np.ndarray, free: int, quantum: float, size: int) -> ForceNoise:
    """The noise of (m,) blocks of ``size`` samples whose ``free`` first ones are free travel.

    White noise is that of the free travel's second differences, or without free travel that of the whole stroke; it is
    at least the rounding to ``quantum`` [N], which varies within a block if the noise is larger.
    """
    white = white_noise(force[:free] if free >= WINDOWS[1] else force)
    floor = MIN_NOISE_SHARE * float(np.ptp(force))
    rounding = quantum / (12 * size) ** 0.5
    return ForceNoise(white=max(white, rounding, floor), quantum=quantum)
