# SPDX-License-Identifier: Apache-2.0
"""From a folder of recordings to a campaign: every condition identified, every recording accounted for."""

import dataclasses
import os
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from ..errors import InputError
from ..recording import read
from .anomaly import INVALIDATING, Anomaly
from .condition import Read, condition
from .conditions import Label, grouped, label_files
from .labels import REPEATS, find_files
from .outliers import wrong_labels
from .result import Campaign, Condition, RecordingResult

Progress = Callable[[Any, str], Any]


def campaign(
    source: str | os.PathLike | Iterable[str | os.PathLike],
    *,
    pattern: str | None = None,
    mapping: str | os.PathLike | None = None,
    model: str | None = None,
    needle=None,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    inwards: str = "increasing",
    filter_length: int | None = None,
    repeats: Collection[str] = REPEATS,
    progress: Progress | None = None,
) -> Campaign:
    """Identifies every condition of a campaign. The same files give the same result, in whatever order they come.

    ``source`` is a folder, a glob, or a list of files, folders and globs. What a file is of comes from its name by
    ``pattern``, such as ``"{specimen}_{speed_mm_s}_{repeat}"``, else from ``mapping``, a CSV table with a column
    ``file`` and any others, else from the card in the file. Files with equal fields, but for those in ``repeats``, are
    repeats of one condition; a file that nothing assigns to one is identified by itself.

    ``model`` and ``needle`` go to ``identify``, ``columns``, ``units``, ``inwards`` and ``filter_length`` to ``read``;
    ``progress(iterable, text)`` wraps the work over files. Each file is read once, and only the arrays of one condition
    are held at a time. A file that cannot be read, or cannot answer, is kept with its status and stops nothing.

    Raises InputError for a source without files, a pattern that fits none of them, a mapping that cannot be read and an
    unknown model.
    """
    labels, notes = label_files(find_files(source), pattern, mapping)
    options = {"columns": columns, "units": units, "inwards": inwards, "filter_length": filter_length}
    found = list(_conditions(grouped(labels, repeats), repeats, options, model, needle, progress))
    conditions = _with_wrong_labels([each for each in found if each.recordings[0].fields])
    others = [each.recordings[0] for each in found if not each.recordings[0].fields]
    whys = {label.file.name: label.why for label in labels}
    return Campaign(tuple(conditions), tuple(_of_none(each, whys[each.file]) for each in others), tuple(notes))


def _conditions(
    groups: list[list[Label]], repeats: Collection[str], options: dict, model, needle, progress: Progress | None
) -> Iterator[Condition]:
    """One condition after the other; the files of each are dropped before the next is read."""
    files = [(label, label is group[-1]) for group in groups for label in group]
    held: list[Read] = []
    for label, last in progress(files, "identifying") if progress else files:
        held.append(_read(label, options))
        if last:
            yield condition(held, label.condition(repeats), model, needle)
            held = []


def _read(label: Label, options: dict) -> Read:
    try:
        return Read(label, read(label.file.path, **options))
    except (InputError, OSError) as error:
        return Read(label, None, str(error))


def _with_wrong_labels(conditions: list[Condition]) -> list[Condition]:
    """The conditions with what only a look at all of them shows."""
    curves = {each.name: {one.file: one.curve for one in each.recordings if _comparable(one)} for each in conditions}
    pooled = {
        each.name: [one.file for one in each.recordings if one.pooled and _comparable(one)] for each in conditions
    }
    with np.errstate(all="ignore"):  # a distance to numbers too large for a force is no distance
        odd = dict(wrong_labels(curves, pooled))
    return [
        dataclasses.replace(each, recordings=tuple(_with(one, odd.get(one.file)) for one in each.recordings))
        for each in conditions
    ]


def _comparable(one: RecordingResult) -> bool:
    """A force of another sign, unit or range is no one's curve."""
    return len(one.curve) > 0 and not any(each.kind in INVALIDATING for each in one.anomalies)


def _of_none(one: RecordingResult, why: str) -> RecordingResult:
    oddity = Anomaly("no_condition", "", float("nan"), float("nan"), "", why)
    return dataclasses.replace(one, anomalies=(*one.anomalies, oddity), pooled=False)


def _with(one: RecordingResult, oddity: Anomaly | None) -> RecordingResult:
    return one if oddity is None else dataclasses.replace(one, anomalies=(*one.anomalies, oddity))
