# SPDX-License-Identifier: Apache-2.0
"""Outliers: parameters of one repeat far from those of the others, and recordings that resemble another condition."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ..identification.estimates import Estimate
from .recording_result import Anomaly, formatted

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
