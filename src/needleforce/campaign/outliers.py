# SPDX-License-Identifier: Apache-2.0
"""Outliers: parameters of one repeat far from those of the others, and recordings that look like another condition."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ..identification.estimates import Estimate
from .anomaly import Anomaly, shown

FEWEST = 4  # repeats
LOOKED_AT = (
    "puncture_force", "puncture_indentation", "stiffness_coefficient", "reference_force", "friction_per_length",
    "cutting_force",
)  # fmt: skip
LEAST_OFF = 0.1  # of the median: less is no matter, however well the others agree

# repeats -> how many scaled MADs the farthest of them is from the median, at most, in 99 % of normal samples
# (200 000 samples each): for few repeats the MAD itself is a poor guess of the scatter
_EVEN = ((4, 15.8), (6, 10.0), (8, 8.0), (10, 6.9), (12, 6.3), (14, 5.9), (20, 5.3), (30, 4.8), (50, 4.5), (100, 4.3))
_ODD = ((5, 18.7), (7, 10.7), (9, 8.3), (11, 7.0), (13, 6.4), (15, 5.9), (21, 5.3), (31, 4.8), (51, 4.5), (101, 4.3))
CLEAR = 2.5  # its own condition is so many times farther than the other, and than its own repeats are apart
LIKE = 2.0  # scatters of the other condition within which a curve belongs to it
LEAST_APART = 0.1  # of the peak of its own condition's mean: conditions nearer to each other are not told apart
OVERLAP = 0.8  # of the longer of two curves that the shorter one must cover


def limit(count: int) -> float:
    """Scaled MADs beyond which one of ``count`` values is an outlier: 1 in 100 normal samples holds one."""
    counts, limits = zip(*(_ODD if count % 2 else _EVEN))
    return float(np.interp(count, counts, limits))


def outliers(repeats: Mapping[str, Mapping[str, Estimate]]) -> Iterator[tuple[str, Anomaly]]:
    """File and oddity for each parameter of ``repeats`` (file -> its own estimates) that is far off.

    At least four repeats must have the parameter. An outlier is beyond ``limit`` scaled MADs, a tenth of the median
    and its own interval. It stays in the pooled fit: without a cause, leaving it out would choose the result.
    """
    for name in LOOKED_AT:
        known = {file: each[name] for file, each in repeats.items() if name in each and each[name].identifiable}
        if len(known) < FEWEST:
            continue
        values = np.array([each.value for each in known.values()])
        middle = float(np.median(values))
        scale = 1.4826 * float(np.median(np.abs(values - middle)))
        least = max(limit(len(values)) * scale, LEAST_OFF * abs(middle))
        if least == 0.0:  # most stand at the bound of the fit, which is no scatter
            continue
        for file, each in known.items():
            off, half = abs(each.value - middle), 0.5 * (each.high - each.low)
            if off > least and not off <= half:
                yield file, _outlier(each, middle, scale)


def _outlier(each: Estimate, middle: float, scale: float) -> Anomaly:
    words = each.name.replace("_", " ")
    said = f"Its {words} is {shown(each.value, each.unit)}, far from that of its repeats, {shown(middle, each.unit)} "
    said += f"with a scatter of {shown(scale, each.unit)}."
    return Anomaly("outlier", each.name, each.value, middle, each.unit, said)


def wrong_labels(
    curves: Mapping[str, Mapping[str, np.ndarray]], pooled: Mapping[str, Sequence[str]]
) -> Iterator[tuple[str, Anomaly]]:
    """File and oddity for each that is likely of another condition; it stays where it is, and is told.

    ``curves`` maps a condition's name to its files' loading curves [N]; ``pooled`` to the files that its mean is taken
    of. Its own condition needs two others that agree, the other condition two.
    """
    means = {name: _mean([curves[name][file] for file in files]) for name, files in pooled.items()}
    for name, own in curves.items():
        for file, curve in own.items():
            others = _mean([own[each] for each in pooled[name] if each != file])
            if others is None:
                continue
            away = _distance(curve, others[0])
            if not away > max(CLEAR * others[1], LEAST_APART * float(np.abs(others[0]).max())):
                continue
            best = _nearest(curve, {other: mean for other, mean in means.items() if other != name})
            if best is not None and best[0] < away / CLEAR:
                yield file, _wrong_label(best[1], away, best[0])


def _mean(curves: list[np.ndarray]) -> tuple[np.ndarray, float] | None:
    """The mean curve over their common length and the scatter about it [N]; None of fewer than two."""
    curves = [each for each in curves if len(each)]
    if len(curves) < 2:
        return None
    length = min(map(len, curves))
    rows = np.array([each[:length] for each in curves])
    return rows.mean(axis=0), float(np.sqrt(rows.var(axis=0, ddof=1).mean()))


def _distance(curve: np.ndarray, mean: np.ndarray) -> float:
    """Root mean square [N] over what both cover; NaN where that is too little."""
    length = min(len(curve), len(mean))
    if length < OVERLAP * max(len(curve), len(mean)):
        return np.nan
    return float(np.sqrt(np.mean((curve[:length] - mean[:length]) ** 2)))


def _nearest(curve: np.ndarray, means: dict) -> tuple[float, str] | None:
    found = ((_distance(curve, mean[0]), name, mean[1]) for name, mean in means.items() if mean is not None)
    near = [(away, name) for away, name, scatter in found if away < LIKE * scatter]
    return min(near) if near else None


def _wrong_label(other: str, away: float, near: float) -> Anomaly:
    said = f"Its label may be wrong: its force is {shown(away, 'N')} from the mean of its repeats, but only "
    said += f"{shown(near, 'N')} from that of the condition {other}. Check what it was recorded of."
    return Anomaly("label", "peak_force", away, near, "N", said)
