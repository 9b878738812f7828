# SPDX-License-Identifier: Apache-2.0
"""Recordings whose loading curve is that of another condition."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from .anomaly import Oddity, shown

CLEAR = 2.5  # its own condition is so many times farther than the other, and than its own repeats are apart
LIKE = 2.0  # scatters of the other condition within which a curve belongs to it
LEAST = 0.1  # of the peak of its own condition's mean: conditions nearer to each other are not told apart
OVERLAP = 0.8  # of the longer of two curves that the shorter one must cover


def wrong_labels(
    curves: Mapping[str, Mapping[str, np.ndarray]], pooled: Mapping[str, Sequence[str]]
) -> Iterator[tuple[str, Oddity]]:
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
            if not away > max(CLEAR * others[1], LEAST * float(np.abs(others[0]).max())):
                continue
            best = _nearest(curve, {other: mean for other, mean in means.items() if other != name})
            if best is not None and best[0] < away / CLEAR:
                yield file, _oddity(best[1], away, best[0])


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


def _oddity(other: str, away: float, near: float) -> Oddity:
    said = f"Its label may be wrong: its force is {shown(away, 'N')} from the mean of its repeats, but only "
    said += f"{shown(near, 'N')} from that of the condition {other}. Check what it was recorded of."
    return Oddity("label", "peak_force", away, near, "N", said)
