# SPDX-License-Identifier: Apache-2.0
"""The location of a significant fall in the raw force: its peak, its end, its size with an interval."""

from dataclasses import dataclass

import numpy as np

from ..vocabulary import SMALLEST
from .punctures import CHECK_SIGMA, DropCandidate, ForceNoise
from .strokes import Blocks, Cut

MIN_CONTINUED_SLOPE = 0.5  # of the mean slope of a fall: while it continues like this it has not ended
STEADY_SPEED_RATIO = 0.7  # speed after over before a fall: below it the fall may be that of the speed
SPEED_SAMPLES = 4  # samples over which a speed is measured, or a block,
SPEED_NOISES = 8.0  # or what takes so many times the noise of the depth
MIN_LOAD_SHARE = 1.0 / 3.0  # of a gradual fall: the rise before it
LONGER_LENGTHS = 8  # over which a gradual fall is compared with texture
PEAK_SIGMA = 3.0  # [sd] height of a peak over the force before the steepest descent
MAX_EXTENSIONS = 8  # windows by which peak or end of a gradual fall is moved
NORMAL_95 = 1.96


@dataclass(frozen=True, kw_only=True)
class LocatedDrop:
    """A ``candidate`` located in the raw force: samples ``peak``, ``low`` (before), ``high`` (certainly after) and
    ``end``, the ``force`` at the peak, the ``drop`` from it with its 95 % interval [N], and whether it is ``gradual``.
    """

    candidate: DropCandidate
    peak: int
    low: int
    high: int
    end: int
    force: float
    drop: float
    drop_low: float
    drop_high: float
    gradual: bool


def locate(
    force: np.ndarray, candidate: DropCandidate, stroke: Blocks, *, size: int, window: int, noise: ForceNoise
) -> LocatedDrop:
    """Peak and end of a ``candidate`` in the raw (n,) ``force``.

    ``size`` samples are averaged before and after the fall, never across it, and more where it is not significant with
    so few; the peak is searched up to ``window`` samples before the steepest descent, and further while the force falls
    as steeply as on average.
    """
    first, last = stroke.sample(candidate.first), stroke.sample(candidate.last + 1)
    sample_sd = noise.white * stroke.size**0.5
    while True:
        begin, end = max(first - window, 0), min(last + window, len(force))
        means = _trailing(force, begin, end, size)
        step = means[:-size] - means[size:] if len(means) > size else means[:1]
        edge = int(np.argmax(step[: max(last - begin + 1, 1)]))
        rounding = noise.quantum / 12**0.5 if sample_sd < 0.5 * noise.quantum else 0.0
        sd = max(sample_sd / size**0.5, rounding, candidate.deviation)
        if step[edge] > CHECK_SIGMA * 2**0.5 * sd or 2 * size > max(window, 2):
            break
        size *= 2
    return _extent(force, candidate, begin + edge, size=size, window=window, sd=sd)


def _extent(
    force: np.ndarray, candidate: DropCandidate, edge: int, *, size: int, window: int, sd: float
) -> LocatedDrop:
    """Peak, end and size of the candidate whose steepest descent follows sample ``edge``."""
    begin = max(edge - (MAX_EXTENSIONS + 1) * window, 0)
    stop = min(edge + size + (MAX_EXTENSIONS + 1) * window, len(force))
    means, at = _trailing(force, begin, stop, size), edge - begin
    after = min(at + size, len(means) - 1)
    bottom = after + _downhill(means[after:], window, 0.0)
    slope = (float(means[at]) - float(means[bottom])) / max(bottom - at, 1)
    top = at - _downhill(-means[: at + 1][::-1], window, MIN_CONTINUED_SLOPE * slope)
    if means[top] - means[at] < PEAK_SIGMA * 2**0.5 * sd:  # the highest of a plateau before a sudden fall is noise
        top = at
    gradual = _steep_length(means[top : bottom + 1]) > size + max(window // 2, 3)
    if gradual:
        top = _rounded_top(means[: bottom + 1], top, PEAK_SIGMA * sd)
    peak, earlier = (
        _line_end(force[max(begin + k - size + 1, 0) : begin + k + 1]) for k in (top, max(top - size // 2, 0))
    )
    if earlier > peak + sd and top > size // 2:  # a mean over the last samples has its maximum after a rounded peak
        top, peak = top - size // 2, earlier
    drop = peak - float(means[bottom])
    low = max(top - window, 0)
    growth = max(float(means[top] - means[low]) / max(top - low, 1), 0.0)  # the true peak lies between two samples
    plateau = np.flatnonzero(means[low : top + 1] < means[top] - 3.0 * sd)
    past = np.flatnonzero(force[edge + 1 : stop] < peak - 0.5 * drop)
    late = np.flatnonzero(means[top : bottom + 1] < peak - 0.9 * drop)
    spread = NORMAL_95 * 5**0.5 * sd  # the end of a line has twice the deviation of the mean
    return LocatedDrop(
        candidate=candidate,
        peak=begin + top,
        low=max(begin + (low + int(plateau[-1]) if len(plateau) else low) - size, 0),
        high=min(edge + 1 + (int(past[0]) if len(past) else 0), len(force) - 1),
        end=begin + (top + int(late[0]) if len(late) else bottom),
        force=peak,
        drop=drop,
        drop_low=drop - spread - 2.0 * sd,  # the lowest of several means is below their mean by about 2 sd
        drop_high=drop + spread + 2.0 * growth,
        gradual=gradual,
    )


def _steep_length(course: np.ndarray) -> int:
    """Samples over which a falling (n,) course loses 10 to 90 % of its height."""
    early, late = (np.flatnonzero(course < course[0] - share * (course[0] - course[-1])) for share in (0.1, 0.9))
    return int(late[0] - early[0]) if len(early) and len(late) else 0


def _rounded_top(course: np.ndarray, top: int, noise: float) -> int:
    """The highest place of the (n,) course before its fall from ``top`` to the end, no farther from that than the fall
    is long, nor beyond a dip below the ``noise``."""
    before = max(2 * top - len(course) + 1, 0)
    dips = np.flatnonzero(course[before:top] < course[top] - noise)
    before += int(dips[-1]) + 1 if len(dips) else 0
    return before + int(np.argmax(course[before : top + 1]))


def lasting_share(drop: LocatedDrop, cut: Cut, depth: np.ndarray, window: int) -> float:
    """The share of a fall that outlasts the pull-backs and rests in it or within ``window`` samples after it.

    A pull-back after the fall leaves it as it is: the force has not come back when the needle is at the cut again. If
    the fall lies across it, the stretch that it took out of the shaft counts too: a pull-back by b takes it from the
    last b at most, which is stretched again within b of new travel, and the force is compared with that beyond. A rest
    lets the force relax: what it lost there is no fall.
    """
    share, rest = 1.0, 0.0
    for k in cut.gaps[(cut.gaps > drop.peak) & (cut.gaps <= drop.end + window)].tolist():
        first, last, reach = int(cut.samples[k - 1]), int(cut.samples[k]), window
        back = max(float(cut.depth[k - 1] - depth[first : last + 1].min()), 0.0)
        if drop.end < k:  # a smaller pull-back before, hidden in the noise of the depth, is stretched again beyond that
            place, reach = max(int(np.searchsorted(cut.depth, cut.depth[k - 1] + cut.noise)), k), cut.blocks.size
        elif back > cut.noise:
            place = int(np.searchsorted(cut.depth, cut.depth[k - 1] + back))
        else:
            place, rest = k, rest + max(float(cut.force[k - 1] - cut.force[k]), 0.0)
        after = cut.force[place : place + reach]
        left = drop.force - float(np.median(after)) - rest if len(after) else 0.0
        share = min(share, left / max(drop.drop, SMALLEST))
    return share


def unslowed_share(drop: LocatedDrop, cut: Cut, baseline: float, reach: int) -> float:
    """The share of a fall at the cut that the speed does not explain, as that of a force in proportion to it at most.

    Such a force would follow the speed: the fall counts up to what is missing within ``reach`` samples after it, where
    the speed may be back.
    """
    n = max(cut.blocks.size, SPEED_SAMPLES)
    n = max(n, int(SPEED_NOISES * cut.noise / max(float(np.ptp(cut.depth)) / len(cut.depth), SMALLEST)))
    after = drop.end + np.arange(0, max(reach, 1), max(cut.blocks.size, 1))
    after = after[after + n < len(cut.depth)]
    low = max(drop.peak - n, 0)
    if drop.peak - low < 2 or not len(after):
        return 1.0
    usual = float(cut.depth[drop.peak] - cut.depth[low]) / (drop.peak - low)
    ratio = (cut.depth[after + n] - cut.depth[after]) / n / max(usual, SMALLEST)
    if ratio[0] >= STEADY_SPEED_RATIO:
        return 1.0
    sums = np.concatenate(([0.0], np.cumsum(cut.force)))
    size = cut.blocks.size
    level = (sums[after + size] - sums[after]) / size - baseline
    missing = (drop.force - baseline) * np.where(ratio > STEADY_SPEED_RATIO, 1.0, ratio) - level
    return float(np.clip(missing.max() / max(drop.drop, SMALLEST), 0.0, 1.0))


def rupture_share(force: np.ndarray, drop: LocatedDrop, baseline: float, window: int, reach: int) -> float:
    """The largest share of the force above ``baseline`` [N] by which a located fall takes the raw (n,) ``force`` down.

    It counts over a third of the ``window`` [samples] of a sudden rupture as it is. Over longer distances up to the
    ``reach`` of a gradual one it is divided by the root of the distance over that third, as texture falls that is a
    random walk, and counts only if it ends a rise: a rupture needs a load that builds up, a decline does not.
    """
    sudden = -(-window // 3)
    if drop.force - float(force[max(drop.peak - reach, 0) : drop.peak + 1].min()) < MIN_LOAD_SHARE * drop.drop:
        reach = sudden
    level = middle_of_three(force[max(drop.peak - 1, 0) : min(drop.end, drop.peak + reach) + window]) - baseline
    longer = np.unique(np.geomspace(sudden, max(reach, sudden), LONGER_LENGTHS).astype(int)).tolist()
    found = 0.0
    for k in [*range(1, sudden), *longer]:
        if k < len(level):
            share = float(np.max(1.0 - level[k:] / np.maximum(level[:-k], 1e-12)))
            found = max(found, share / max(k / sudden, 1.0) ** 0.5)
    return found


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
        if further == lowest or not lowest or -lowest % window > window // 4 or continued < max(slope, min_slope):
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
