# SPDX-License-Identifier: Apache-2.0
"""Punctures: falls of the force during inward travel that neither the noise nor the stroke's own fluctuation explains.

Two adjacent windows of the force, of several lengths, with or without a gap between them, are compared at every place
of the stroke. Their difference, less that just before and after it if the force declines there too, is divided by its
standard deviation; the threshold follows from the number of places and ``FALSE_ALARMS``.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri, stdtrit

from .. import core
from .strokes import Blocks, white_noise

FALSE_ALARMS = 1e-3  # punctures found in a recording that has only normal noise
WINDOWS = (3, 5, 8, 12, 20, 32, 50, 80)  # [blocks] lengths of the compared windows
MAX_END_WINDOW = 5  # [blocks] of a comparison near the end of a stroke, where the force after it is not known
MIN_LINE_WINDOW = 8  # [blocks] a line through fewer is less certain than their mean
CHECK_SIGMA = 4.0  # [sd] of the fall between short windows, where the larger one is judged by its line
SHORT_SHARE = 0.4  # of a window: the short one of that check
MIN_STROKE_WINDOWS = 5  # pairs of windows in a stroke, whose fluctuation is to be known
MIN_FREE_WINDOWS = 6  # windows of free travel that show the correlation of the noise
TEXTURE_FREEDOM = 4.0  # degrees of freedom of Student's t for the texture of a rough stroke
MIN_PLACES = 10.0  # of a stroke of few blocks
ROUGH_PARTS = (4, 2, 1)  # of a rupture: lengths over which the fluctuation of a stroke is judged
ROUGH_SIGMA = 2.0  # standard errors (2 % by chance) by which it exceeds the noise: more is texture of the tissue
MIN_ROUGH_WINDOWS = 20  # such lengths of free travel that show the correlation of the noise over them
ROBUST_SD_ERROR = 0.83  # standard error of a robust standard deviation, times the root of the number of values
FOURTH_DIFFERENCE = 70**0.5  # sd of a fourth difference of values with sd 1
MIN_NOISE_SHARE = 1e-4  # of the range of the force: simulated recordings may have no noise
STEADY_SPEED_RATIO = 0.7  # speed after over before a fall: below it the fall may be that of the speed
SPEED_BLOCKS = 8  # blocks over which a speed is measured
MIN_CONTINUED_SLOPE = 0.5  # of the mean slope of a fall: while it continues like this it has not ended
MAX_EXTENSIONS = 8  # windows by which peak or end of a gradual fall is moved
NORMAL_95 = 1.96


@dataclass(frozen=True, kw_only=True)
class ForceNoise:
    """The noise of a block of the force: standard deviation of its ``white`` part, and the sensor's ``quantum`` [N]."""

    white: float
    quantum: float

    def of_mean(self, count: int) -> float:
        """Standard deviation [N] of the mean of ``count`` blocks; a quantum above the noise is not averaged."""
        rounding = self.quantum / 12**0.5
        return max(self.white / count**0.5, rounding if self.white < 0.5 * self.quantum else 0.0)


@dataclass(frozen=True, kw_only=True)
class Fall:
    """A significant fall between blocks ``first`` and ``last``: its ``statistic`` [sd], and whether it may be texture
    of a ``rough`` stroke, one that fluctuates more than the sensor."""

    first: int
    last: int
    statistic: float
    rough: bool


@dataclass(frozen=True, kw_only=True)
class ForceDrop:
    """A located fall: samples ``peak``, ``low`` (before), ``high`` (certainly after) and ``end``, the ``force`` at the
    peak, the ``drop`` from it with its 95 % interval [N], and whether it is ``gradual``."""

    peak: int
    low: int
    high: int
    end: int
    force: float
    drop: float
    drop_low: float
    drop_high: float
    gradual: bool


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


def falls(stroke: Blocks, *, free: int, noise: ForceNoise, level: np.ndarray, rupture: int, max_gap: int) -> list[Fall]:
    """The significant falls in ``stroke`` after its ``free`` first blocks, in order of depth.

    The standard deviation of a comparison is the larger of the sensor's, from the free travel with its correlation, and
    that of the same comparison over the stroke, so that texture of the tissue is noise too. From the shortest windows
    to the longest, a place is left out that an earlier fall affects, and so is a fall that the speed explains:
    ``level`` [N] is the (m,) force above the baseline, of which a decrease of the speed takes its own share at most.

    Noise is normal; the texture of a tissue has heavier tails: in a rough stroke a fall that Student's t with four
    degrees of freedom would reach at the same false-alarm rate is marked as ``rough``.
    """
    found: list[Fall] = []
    short: dict[int, np.ndarray] = {}
    rare = FALSE_ALARMS / _places(len(stroke) - free, max_gap)
    threshold, texture = float(-ndtri(rare)), float(-stdtrit(TEXTURE_FREEDOM, rare))
    broken, correlated, rough = _breaks(stroke), 1.0, is_rough(stroke.force, free, noise, rupture)
    for each in comparisons(stroke.force, max_gap):
        sensor, own = _deviations(each, free, noise)
        sd = max(sensor, own, 1e-300)
        if each.window <= WINDOWS[1] and not each.gap:
            correlated = max(correlated, sd / max(2**0.5 * noise.of_mean(each.window), 1e-300))
        if not each.gap:
            short[each.window] = each.excess / sd
        score = _scores(each, sd, short)
        score[: max(free - each.window, 0)] = 0.0
        for block in broken:
            score[max(block - each.reach - each.window + 1, 0) : max(block, 0)] = 0.0
        for other in found:
            score[max(other.first - each.reach - each.window, 0) : max(other.last + each.reach, 0)] = 0.0
        for j in _peaks(score, threshold, each.reach):
            a = j + each.window - 1
            statistic = float(score[j]) * (1.0 - _slowed_share(stroke.depth, level, _parts(each, j), each.fall[j]))
            if statistic > threshold:
                unclear = rough and statistic < texture
                found.append(Fall(first=a, last=a + each.gap + 1, statistic=statistic, rough=unclear))
    found += _last_falls(
        stroke,
        found,
        free=free,
        level=level,
        noise=noise,
        rough=rough,
        limits=(threshold * correlated, texture * correlated),
    )
    return sorted(found, key=lambda fall: fall.first)


def _places(count: int, max_gap: int) -> float:
    """The number of independent places in ``count`` blocks: about two a window, for each comparison."""
    places = sum(
        2.0 * count / w * (1 + (2 * w <= max_gap) + (w >= MIN_LINE_WINDOW)) for w in WINDOWS if 10 * w <= count
    )
    return max(places, MIN_PLACES)


def _deviations(each: Comparison, free: int, noise: ForceNoise) -> tuple[float, float]:
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
        return _quarter_sd(left) / 1.5**0.5
    lever = 1.0 + 3.0 * (each.reach / each.window) ** 2  # variance of a bent fall over that of a fall, white noise
    return _quarter_sd(each.bent[min(free, len(each.bent)) :]) / lever**0.5


def _quarter_sd(values: np.ndarray) -> float:
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


def _scores(each: Comparison, sd: float, short: dict[int, np.ndarray]) -> np.ndarray:
    """The fall's (k,) standard deviations: by the means, or by the line if short windows show a fall too."""
    score = each.excess / sd
    if each.gap or each.window < MIN_LINE_WINDOW:
        return score
    w = max(w for w in short if w <= SHORT_SHARE * each.window)
    checked = short[w][each.window - w : each.window - w + len(score)] > CHECK_SIGMA
    return np.maximum(score, np.where(checked, each.line / (2.5**0.5 * sd), 0.0))


def _peaks(score: np.ndarray, threshold: float, reach: int) -> list[int]:
    """The largest score of every group above ``threshold``; groups are more than ``reach`` blocks apart."""
    above = np.flatnonzero(score > threshold)
    if not len(above):
        return []
    groups = np.split(above, np.flatnonzero(np.diff(above) > reach) + 1)
    return [int(group[np.argmax(score[group])]) for group in groups]


def _breaks(stroke: Blocks) -> list[int]:
    """The blocks after a stop or pull-back: a fall across it is none of inward travel."""
    return [int(block) + 1 for block in np.flatnonzero(np.diff(stroke.starts[:-1]) > stroke.size)]


def _slowed_share(depth: np.ndarray, level: np.ndarray, parts: tuple[slice, slice], fall: float) -> float:
    """The share of a ``fall`` [N] from the first of two ``parts`` to the second that the speed explains, as that of a
    force in proportion to it at most."""
    before, after = (depth[part] for part in parts)
    if min(len(before), len(after)) < 2:
        return 0.0
    speeds = [float(np.ptp(each)) / (len(each) - 1) for each in (before, after)]
    ratio = speeds[1] / max(speeds[0], 1e-300)
    explained = (1.0 - ratio) * max(float(level[parts[0]].max()), 0.0)
    return min(explained / max(fall, 1e-300), 1.0) if ratio < STEADY_SPEED_RATIO else 0.0


def _parts(each: Comparison, j: int) -> tuple[slice, slice]:
    """The blocks before and after the fall at index j over which its speeds are measured."""
    length = max(each.window, SPEED_BLOCKS)
    return slice(max(j + each.window - length, 0), j + each.window), slice(j + each.reach, j + each.reach + length)


def _last_falls(
    stroke: Blocks,
    found: list[Fall],
    *,
    free: int,
    level: np.ndarray,
    noise: ForceNoise,
    rough: bool,
    limits: tuple[float, float],
) -> list[Fall]:
    """Falls just before a stop, a pull-back or the end, with fewer blocks after than before them."""
    extra, force, count = [], stroke.force, WINDOWS[1]
    for end in [*_breaks(stroke), len(stroke)]:
        for after in range(1, count):
            k = end - after
            if k - count < free:
                continue
            before = force[k - count : k]
            place = np.arange(count) - (count - 1) / 2
            decline = max(-float(place @ before) / float(place @ place), 0.0)
            fall = float(before.mean() - force[k:end].mean()) - decline * 0.5 * (count + after)
            score = fall / max(noise.of_mean(count) ** 2 + noise.of_mean(after) ** 2, 1e-300) ** 0.5
            score *= 1.0 - _slowed_share(stroke.depth, level, (slice(k - count, k), slice(k - 1, end)), fall)
            near = any(other.first - count <= k <= other.last + count for other in [*found, *extra])
            if score > limits[0] and not near:
                extra.append(Fall(first=k - 1, last=end - 1, statistic=score, rough=rough and score < limits[1]))
    return extra


def locate(force: np.ndarray, fall: Fall, stroke: Blocks, *, size: int, window: int, noise: ForceNoise) -> ForceDrop:
    """Peak and end of a ``fall`` in the raw (n,) ``force``.

    ``size`` samples are averaged before and after the fall, never across it, and more where it is not significant with
    so few; the peak is searched up to ``window`` samples before the steepest descent, and further while the force falls
    as steeply as on average.
    """
    first, last = stroke.sample(fall.first), stroke.sample(fall.last + 1)
    sample_sd = noise.white * stroke.size**0.5
    while True:
        begin, end = max(first - window, 0), min(last + window, len(force))
        means = _trailing(force, begin, end, size)
        step = means[:-size] - means[size:] if len(means) > size else means[:1]
        edge = int(np.argmax(step[: max(last - begin + 1, 1)]))
        sd = max(sample_sd / size**0.5, noise.quantum / 12**0.5 if sample_sd < 0.5 * noise.quantum else 0.0)
        if step[edge] > CHECK_SIGMA * 2**0.5 * sd or 2 * size > max(window, 2):
            break
        size *= 2
    return _extent(force, begin + edge, size=size, window=window, sd=sd)


def _extent(force: np.ndarray, edge: int, *, size: int, window: int, sd: float) -> ForceDrop:
    """Peak, end and size of the fall whose steepest descent follows sample ``edge``."""
    begin = max(edge - (MAX_EXTENSIONS + 1) * window, 0)
    stop = min(edge + size + (MAX_EXTENSIONS + 1) * window, len(force))
    means, at = _trailing(force, begin, stop, size), edge - begin
    after = min(at + size, len(means) - 1)
    bottom = after + _downhill(means[after:], window, 0.0)
    slope = (float(means[at]) - float(means[bottom])) / max(bottom - at, 1)
    top = at - _downhill(-means[: at + 1][::-1], window, MIN_CONTINUED_SLOPE * slope)
    peak, earlier = (_line_end(force[max(begin + k - size + 1, 0) : begin + k + 1]) for k in (top, top - size // 2))
    if earlier > peak + sd and top > size // 2:  # a mean over the last samples has its maximum after a rounded peak
        top, peak = top - size // 2, earlier
    drop = peak - float(means[bottom])
    low = max(top - window, 0)
    growth = max(float(means[top] - means[low]) / max(top - low, 1), 0.0)  # the true peak lies between two samples
    plateau = np.flatnonzero(means[low : top + 1] < means[top] - 3.0 * sd)
    past = np.flatnonzero(force[edge + 1 : stop] < peak - 0.5 * drop)
    course = means[top : bottom + 1]
    early, late = (np.flatnonzero(course < peak - share * drop) for share in (0.1, 0.9))
    rise = int(late[0] - early[0]) - size if len(early) and len(late) else 0
    spread = NORMAL_95 * 5**0.5 * sd  # the end of a line has twice the deviation of the mean
    return ForceDrop(
        peak=begin + top,
        low=max(begin + (low + int(plateau[-1]) if len(plateau) else low) - size, 0),
        high=min(edge + 1 + (int(past[0]) if len(past) else 0), len(force) - 1),
        end=begin + (top + int(late[0]) if len(late) else bottom),
        force=peak,
        drop=drop,
        drop_low=drop - spread - 2.0 * sd,  # the lowest of several means is below their mean by about 2 sd
        drop_high=drop + spread + 2.0 * growth,
        gradual=rise > max(window // 2, 3),
    )


def sudden_share(force: np.ndarray, drop: ForceDrop, baseline: float, window: int) -> float:
    """The largest share of the force above ``baseline`` [N] by which a located fall takes the raw (n,) ``force`` down
    within a third of the ``window`` [samples] of a rupture; over all of it slow declines would pass."""
    level = middle_of_three(force[max(drop.peak - 1, 0) : drop.end + window]) - baseline
    travel = range(1, min(-(-window // 3) + 1, len(level)))
    return max((float(np.max(1.0 - level[k:] / np.maximum(level[:-k], 1e-12))) for k in travel), default=0.0)


def middle_of_three(values: np.ndarray) -> np.ndarray:
    """The median of each value and its two neighbours, (n,): removes single spikes and keeps steps."""
    if len(values) < 3:
        return values
    a, b, c = values[:-2], values[1:-1], values[2:]
    middle = np.maximum(np.minimum(a, b), np.minimum(np.maximum(a, b), c))
    return np.concatenate((values[:1], middle, values[-1:]))


def _downhill(values: np.ndarray, window: int, min_slope: float) -> int:
    """The index of the lowest of the first ``window`` (n,) ``values``, or of the end of a descent that continues at
    ``min_slope``, and at half of its own slope so far."""
    lowest = int(np.argmin(values[: window + 1]))
    for _ in range(MAX_EXTENSIONS):
        further = int(np.argmin(values[: lowest + window + 1]))
        slope = MIN_CONTINUED_SLOPE * (values[0] - values[lowest]) / max(lowest, 1)
        continued = (values[lowest] - values[further]) / max(further - lowest, 1)
        if further == lowest or not lowest or lowest % window or continued < max(slope, min_slope):
            break
        lowest = further
    return lowest


def _trailing(force: np.ndarray, begin: int, end: int, size: int) -> np.ndarray:
    """Means of the ``size`` samples that end at each sample from ``begin`` up to ``end`` (fewer at the start)."""
    start = max(begin - size + 1, 0)
    sums = np.concatenate(([0.0], np.cumsum(force[start:end] - force[begin])))
    stop = np.arange(begin, end) - start + 1
    reach = np.minimum(stop, size)
    return (sums[stop] - sums[stop - reach]) / reach + force[begin]


def _line_end(values: np.ndarray) -> float:
    """The end value of a line fitted to the (n,) values, to reduce noise; the last value itself if n < 4."""
    if len(values) < 4:
        return float(values[-1])
    place = np.arange(len(values)) - (len(values) - 1) / 2
    return float(values.mean() + place[-1] * (place @ values) / (place @ place))


def block_noise(force: np.ndarray, free: int, quantum: float, size: int) -> ForceNoise:
    """The noise of (m,) blocks of ``size`` samples whose ``free`` first ones are free travel.

    White noise is that of the free travel's second differences, or without free travel that of the whole stroke; it is
    at least the rounding to ``quantum`` [N], which varies within a block if the noise is larger.
    """
    white = white_noise(force[:free] if free >= WINDOWS[1] else force)
    floor = MIN_NOISE_SHARE * float(np.ptp(force))
    rounding = quantum / (12 * size) ** 0.5
    return ForceNoise(white=max(white, rounding, floor), quantum=quantum)
