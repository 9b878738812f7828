# SPDX-License-Identifier: Apache-2.0
"""Repeats as given, each once and with its second pass; and whether they are of one needle and one specimen: their
loading curves from the contact, compared in size."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ..errors import InputError
from ..recording import Recording
from ..recording.copies import copies
from ..recording.source import RecordingSource, is_arrays, recording_of, recordings_of
from ..segmentation.strokes import white_noise
from ..vocabulary import SMALLEST
from .one_layer.segmented_recording import SegmentedRecording

STEP_M = 0.1e-3  # [m] of the grid on which loading curves are compared
MIN_POINTS = 10  # of the loading curves in which repeats are compared
MIN_GROUP_REPEATS = 4
MIN_GROUP_RATIO = 0.1  # of the force: closer groups make no difference
MIN_GROUP_NOISES = 5.0  # standard errors of a repeat's force level, from the noise within the recordings
LARGE_RATIO = 1.5  # of the largest to the smallest force: a mean of such repeats describes none of them

# repeats -> 99.5 % quantile of the largest distance between the means of two groups in scatters within them, over all
# cuts of the sorted values into groups of two or more, for normal samples (400 000 each)
_GROUP_QUANTILES = (
    (4, 24.96), (5, 14.97), (6, 11.03), (7, 9.07), (8, 7.91), (9, 7.17), (10, 6.60), (12, 5.94), (15, 5.30),
    (20, 4.75), (30, 4.23), (50, 3.85), (100, 3.73),
)  # fmt: skip


def paired(recordings: RecordingSource, seconds: RecordingSource) -> tuple[list[Recording], list[Recording | None]]:
    """Both as lists; the second empty, or as long as the first.

    Raises InputError for an object that is not a recording, no recording, lists that do not pair, and a file given
    twice.
    """
    recordings = recordings_of(recordings)
    seconds = [None if each is None else recording_of(each) for each in _listed(seconds)]
    if not recordings:
        raise InputError("number of recordings", 0, "at least 1 is needed", next_step="Give nf.read(path).")
    if seconds and len(seconds) != len(recordings):
        raise InputError(
            "number of second passes",
            len(seconds),
            f"it must be that of the recordings, {len(recordings)}",
            next_step="Give one second pass for each recording, in the same order, None for a missing one.",
        )
    _different([*recordings, *(second for second in seconds if second is not None)])
    return recordings, seconds


def _listed(sources: Any) -> list:
    """One source or several as a list."""
    several = isinstance(sources, list | tuple) and not is_arrays(sources)
    return list(sources) if several else [sources]


def _different(recordings: list[Recording]) -> None:
    """Raises InputError for readings given twice, which would count as a repeat and make the intervals too narrow."""
    for k, first in copies(recordings).items() if len(recordings) > 1 else ():
        one, other = recordings[k].card, recordings[first].card
        what = (
            "the same bytes as"
            if one.sha256 == other.sha256
            else "the same readings, saved in another way, as those of"
        )
        same = f"{what} {other.source}"
        raise InputError("content of the file", same, "given twice", one.source, "Give each file once.")


def differing_repeats(singles: Sequence[SegmentedRecording]) -> Iterator[str]:
    """A sentence where the forces of repeats form two groups, or differ by more than a factor of 1.5.

    The loading curves from the contact are compared up to the first puncture and beyond it: the logarithm of the ratio
    of each to their mean. Groups have two or more repeats each; their means must differ by a tenth, by five standard
    errors of the noise within the recordings, and by more than normal scatter between repeats gives in 0.5 % of
    conditions, so that at most 1 % of those with normal scatter are called groups. Four repeats show only groups that
    are 25 scatters apart, six 11, ten 7: the factor, which two repeats show, is a measured figure and no test.
    """
    known = [each for each in singles if each.events.contact is not None]
    curves = [_curve(each) for each in known]
    for words, first, last in _parts(known, curves):
        rows = np.array([curve[first:last] for curve in curves])
        mean = rows.mean(axis=0)
        levels = rows @ mean / (mean @ mean)
        if not (levels > 0.0).all():
            continue
        noise = max(white_noise(each.strokes.force_in) for each in known) / np.sqrt(mean @ mean)
        names = [
            each.recording.name if each.recording.card.source else f"recording {k}" for k, each in enumerate(known, 1)
        ]
        sentence = _sentence(words, names, np.log(levels), noise)
        if sentence:
            yield sentence
            return


def _curve(single: SegmentedRecording) -> np.ndarray:
    """The force (m,) [N] of the insertion every 0.1 mm from the contact, without the force before it.

    The contact is that of the loading curve by itself if it has a fit. The complete cycle has another one, and whether
    the fit follows it may differ between repeats.
    """
    strokes, contact = single.strokes, single.events.contact
    free = strokes.force_in[: strokes.place_in(contact.low)]
    surface = next((fit.values["contact_depth"] for fit in single.loading.values()), contact.depth)
    travel = np.maximum.accumulate(strokes.depth_in) - surface
    grid = STEP_M * np.arange(max(int(travel[-1] / STEP_M) + 1, 0)) if len(travel) else np.empty(0)
    return np.interp(grid, travel, strokes.force_in) - (float(np.median(free)) if len(free) else 0.0)


def _parts(singles: Sequence[SegmentedRecording], curves: list[np.ndarray]) -> list[tuple[str, int, int]]:
    """The grid points of the loading curves up to the earliest first puncture and beyond the latest one, as far as all
    repeats have them."""
    if len(curves) < 2:
        return []
    end = min(map(len, curves))
    depths = [each.events.punctures[0].indentation for each in singles if each.events.punctures]
    earliest, latest = (int(depth / STEP_M) for depth in (min(depths), max(depths))) if depths else (end, end)
    parts = [("up to the first puncture", 0, min(earliest, end)), ("beyond the first puncture", latest + 1, end)]
    return [part for part in parts if part[2] - part[1] >= MIN_POINTS]


def _sentence(words: str, names: list[str], levels: np.ndarray, noise: float) -> str:
    """What the levels (n,), logarithms of the repeats' forces, show; empty if nothing."""
    upper = groups(levels, noise)
    if upper is not None:
        ratio = np.exp(levels[upper].mean() - levels[~upper].mean()) - 1.0
        low, high = (", ".join(name for name, is_in in zip(names, group) if is_in) for group in (~upper, upper))
        return (
            f"The repeats form two groups: {words}, the force of {high} is {100.0 * ratio:.0f} % larger than that of "
            f"{low}, far beyond the scatter within each. Check whether two needles or specimens have the same name."
        )
    factor = float(np.exp(levels.max() - levels.min()))
    if not factor > LARGE_RATIO:
        return ""
    return (
        f"The repeats differ: {words}, the force of {names[int(levels.argmax())]} is {factor:.2g} times that of "
        f"{names[int(levels.argmin())]}. Check whether they are of one needle and one specimen: the parameters of all "
        "together describe none of them."
    )


def group_limit(count: int) -> float:
    """Distance of two groups of ``count`` values in scatters within them, exceeded by 0.5 % of normal samples."""
    counts, limits = zip(*_GROUP_QUANTILES)
    return float(np.interp(count, counts, limits))


def groups(values: np.ndarray, noise: float) -> np.ndarray | None:
    """Which values (n,) are in the upper of two groups; None if they form none."""
    if len(values) < MIN_GROUP_REPEATS:
        return None
    order = np.argsort(values)
    best, cut, gap = 0.0, 0, 0.0
    for k in range(2, len(values) - 1):
        low, high = values[order[:k]], values[order[k:]]
        within = np.sqrt((low.var() * len(low) + high.var() * len(high)) / (len(values) - 2))
        distance = high.mean() - low.mean()
        if distance > best * within:
            best, cut, gap = distance / max(within, SMALLEST), k, distance
    large = gap > np.log1p(MIN_GROUP_RATIO) and not gap <= MIN_GROUP_NOISES * noise
    return np.isin(np.arange(len(values)), order[cut:]) if large and best > group_limit(len(values)) else None
