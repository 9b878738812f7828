# SPDX-License-Identifier: Apache-2.0
"""Outliers: parameters of one repeat far from those of the others, recordings that resemble another condition, and
repeats that form two groups."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ..identification.estimates import Estimate
from .recording_result import Anomaly, formatted
from .repeat_checks import Repeat
from .summary import CURVE_STEP_M

MIN_REPEATS = 4  # repeats
CHECKED_PARAMETERS = (
    "puncture_force", "puncture_indentation", "stiffness_coefficient", "reference_force", "friction_per_length",
    "cutting_force",
)  # fmt: skip
MIN_DEVIATION_SHARE = 0.1  # of the median: a smaller deviation is not an outlier, however well the others agree

# repeats -> 99 % quantile of the largest deviation from the median in scaled MADs, for normal samples (200 000 each):
# for few repeats the MAD is a poor estimate of the scatter
_EVEN_QUANTILES = (
    (4, 15.8), (6, 10.0), (8, 8.0), (10, 6.9), (12, 6.3), (14, 5.9), (20, 5.3), (30, 4.8), (50, 4.5), (100, 4.3),
)  # fmt: skip
_ODD_QUANTILES = (
    (5, 18.7), (7, 10.7), (9, 8.3), (11, 7.0), (13, 6.4), (15, 5.9), (21, 5.3), (31, 4.8), (51, 4.5), (101, 4.3),
)  # fmt: skip
# repeats -> 99.5 % quantile of the largest distance between the means of two groups in scatters within them, over all
# cuts of the sorted values into groups of two or more, for normal samples (400 000 each)
_GROUP_QUANTILES = (
    (4, 24.96), (5, 14.97), (6, 11.03), (7, 9.07), (8, 7.91), (9, 7.17), (10, 6.60), (12, 5.94), (15, 5.30),
    (20, 4.75), (30, 4.23), (50, 3.85), (100, 3.73),
)  # fmt: skip
MIN_GROUP_NOISES = 5.0  # standard errors of a repeat's force level, from the noise within the recordings
MIN_POINTS = 10  # of the loading curves in which repeats are compared
MIN_DISTANCE_RATIO = 2.5  # of the distance to its own condition to that of the other and to the scatter of its repeats
MAX_DISTANCE_SCATTERS = 2.0  # scatters of the other condition within which a curve belongs to it
MIN_DISTANCE_SHARE = 0.1  # of the peak of its own condition's mean: closer conditions cannot be distinguished
MIN_OVERLAP_SHARE = 0.8  # of the longer of two curves, which the shorter one must cover


def limit(count: int) -> float:
    """Scaled MADs beyond which one of ``count`` values is an outlier: 1 in 100 normal samples contains one."""
    counts, limits = zip(*(_ODD_QUANTILES if count % 2 else _EVEN_QUANTILES))
    return float(np.interp(count, counts, limits))


def outliers(repeats: Mapping[str, Mapping[str, Estimate]]) -> Iterator[tuple[str, Anomaly]]:
    """File and anomaly for each parameter of ``repeats`` (file -> its own estimates) that is an outlier.

    At least four repeats must have the parameter. An outlier deviates from the median by more than ``limit`` scaled
    MADs, a tenth of the median and the half width of its own interval. It remains in the pooled fit: leaving it out
    without a known cause would bias the result.
    """
    for name in CHECKED_PARAMETERS:
        known = {file: each[name] for file, each in repeats.items() if name in each and each[name].identifiable}
        if len(known) < MIN_REPEATS:
            continue
        values = np.array([each.value for each in known.values()])
        middle = float(np.median(values))
        scale = 1.4826 * float(np.median(np.abs(values - middle)))
        threshold = max(limit(len(values)) * scale, MIN_DEVIATION_SHARE * abs(middle))
        if threshold == 0.0:  # most values are at the bound of the fit, which is not scatter
            continue
        for file, each in known.items():
            deviation, half = abs(each.value - middle), 0.5 * (each.high - each.low)
            if deviation > threshold and not deviation <= half:
                yield file, _outlier(each, middle, scale)


def _outlier(each: Estimate, middle: float, scale: float) -> Anomaly:
    words = each.name.replace("_", " ")
    sentence = f"Its {words} is {formatted(each.value, each.unit)}, far from that of its repeats, "
    sentence += f"{formatted(middle, each.unit)} with a scatter of {formatted(scale, each.unit)}."
    return Anomaly(
        kind="outlier", quantity=each.name, value=each.value, usual=middle, unit=each.unit, sentence=sentence
    )


def wrong_labels(
    curves: Mapping[str, Mapping[str, np.ndarray]], pooled: Mapping[str, Sequence[str]]
) -> Iterator[tuple[str, Anomaly]]:
    """File and anomaly for each recording that probably belongs to another condition; its label is not changed.

    ``curves`` maps a condition's name to its files' loading curves [N]; ``pooled`` maps it to the files of its mean.
    The recording's own condition needs two other files that agree, the other condition two files.
    """
    means = {name: _mean([curves[name][file] for file in files]) for name, files in pooled.items()}
    for name, own in curves.items():
        for file, curve in own.items():
            others = _mean([own[each] for each in pooled[name] if each != file])
            if others is None:
                continue
            distance = _distance(curve, others[0])
            if not distance > max(MIN_DISTANCE_RATIO * others[1], MIN_DISTANCE_SHARE * float(np.abs(others[0]).max())):
                continue
            best = _nearest(curve, {other: mean for other, mean in means.items() if other != name})
            if best is not None and best[0] < distance / MIN_DISTANCE_RATIO:
                yield file, _wrong_label(best[1], distance, best[0])


def _mean(curves: list[np.ndarray]) -> tuple[np.ndarray, float] | None:
    """The mean curve over the common length and the scatter about it [N]; None for fewer than two curves."""
    curves = [each for each in curves if len(each)]
    if len(curves) < 2:
        return None
    length = min(map(len, curves))
    rows = np.array([each[:length] for each in curves])
    return rows.mean(axis=0), float(np.sqrt(rows.var(axis=0, ddof=1).mean()))


def _distance(curve: np.ndarray, mean: np.ndarray) -> float:
    """The root-mean-square difference [N] over the common length; NaN if that is too short."""
    length = min(len(curve), len(mean))
    if length < MIN_OVERLAP_SHARE * max(len(curve), len(mean)):
        return np.nan
    return float(np.sqrt(np.mean((curve[:length] - mean[:length]) ** 2)))


def _nearest(curve: np.ndarray, means: dict) -> tuple[float, str] | None:
    found = ((_distance(curve, mean[0]), name, mean[1]) for name, mean in means.items() if mean is not None)
    near = [(distance, name) for distance, name, scatter in found if distance < MAX_DISTANCE_SCATTERS * scatter]
    return min(near) if near else None


def _wrong_label(other: str, distance: float, nearest: float) -> Anomaly:
    sentence = f"Its label may be wrong: its force differs by {formatted(distance, 'N')} from the mean of its repeats, "
    sentence += f"but only by {formatted(nearest, 'N')} from that of the condition {other}. Check which condition was "
    sentence += "recorded."
    return Anomaly(kind="label", quantity="peak_force", value=distance, usual=nearest, unit="N", sentence=sentence)


def group_limit(count: int) -> float:
    """Distance of two groups of ``count`` values in scatters within them, exceeded by 0.5 % of normal samples."""
    counts, limits = zip(*_GROUP_QUANTILES)
    return float(np.interp(count, counts, limits))


def two_groups(repeats: Sequence[Repeat]) -> Iterator[str]:
    """A warning for repeats whose forces form two groups, as of two needles or specimens under one name.

    The loading curves from the contact are compared up to the first puncture and beyond it: the logarithm of the ratio
    of each to their mean. The groups have two or more repeats each; their means must differ by a tenth, by five
    standard errors of the noise within the recordings, and by more than normal scatter between the repeats gives in
    0.5 % of conditions. A condition whose repeats scatter normally is thus warned of in at most 1 %. Four repeats show
    only groups that are 25 scatters apart, six 11, ten 7.
    """
    for words, first, last in _parts(repeats):
        rows = np.array([each.summary.from_contact[first:last] for each in repeats])
        mean = rows.mean(axis=0)
        levels = rows @ mean / (mean @ mean)
        if not (levels > 0.0).all():
            continue
        noise = max(each.summary.noise for each in repeats) / np.sqrt(mean @ mean)
        found = _groups(np.log(levels), noise)
        if found is not None:
            yield _groups_sentence(words, [each.name for each in repeats], np.log(levels), found)
            return


def _parts(repeats: Sequence[Repeat]) -> list[tuple[str, int, int]]:
    """The grid points of the loading curves up to the earliest first puncture and beyond the latest one, as far as all
    repeats have them."""
    if len(repeats) < MIN_REPEATS:
        return []
    end = min(len(each.summary.from_contact) for each in repeats)
    depths = [each.events.punctures[0].indentation for each in repeats if each.events.punctures]
    earliest, latest = (int(depth / CURVE_STEP_M) for depth in (min(depths), max(depths))) if depths else (end, end)
    parts = [("up to the first puncture", 0, min(earliest, end)), ("beyond the first puncture", latest + 1, end)]
    return [part for part in parts if part[2] - part[1] >= MIN_POINTS]


def _groups(values: np.ndarray, noise: float) -> np.ndarray | None:
    """Which values are in the upper of two groups; None if they form none."""
    order = np.argsort(values)
    best, cut, gap = 0.0, 0, 0.0
    for k in range(2, len(values) - 1):
        low, high = values[order[:k]], values[order[k:]]
        within = np.sqrt((low.var() * len(low) + high.var() * len(high)) / (len(values) - 2))
        distance = high.mean() - low.mean()
        if distance > best * within:
            best, cut, gap = distance / max(within, 1e-300), k, distance
    large = gap > np.log1p(MIN_DEVIATION_SHARE) and not gap <= MIN_GROUP_NOISES * noise
    return np.isin(np.arange(len(values)), order[cut:]) if large and best > group_limit(len(values)) else None


def _groups_sentence(words: str, names: list[str], levels: np.ndarray, upper: np.ndarray) -> str:
    ratio = np.exp(levels[upper].mean() - levels[~upper].mean()) - 1.0
    low, high = (", ".join(name for name, is_in in zip(names, group) if is_in) for group in (~upper, upper))
    return (
        f"The repeats form two groups: {words}, the force of {high} is {100.0 * ratio:.0f} % larger than that of {low}"
        ", far beyond the scatter within each. Check whether two needles or specimens have the same name."
    )
