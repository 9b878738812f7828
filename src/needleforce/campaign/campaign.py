# SPDX-License-Identifier: Apache-2.0
"""``campaign``: identify every condition in a folder of recordings, with a result for every recording."""

import dataclasses
import os
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..core import Needle
from ..errors import InputError
from ..recording import read
from ..recording.mappings import IN_FOLDER
from ..segmentation.strokes import cycles
from .condition import LoadedFile, condition
from .folder_files import File, find_files, other_files
from .labels import REPEATS, Label, grouped, inferred, label_files
from .outliers import wrong_labels
from .recording_result import INVALIDATING, Anomaly, RecordingResult
from .result import Campaign, Condition

Progress = Callable[[Any, str], Any]


def campaign(
    source: str | os.PathLike | Iterable[str | os.PathLike],
    *,
    pattern: str | None = None,
    mapping: str | os.PathLike | None = None,
    model: str | None = None,
    needle: Needle | None = None,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    inwards: str | None = None,
    filter_length: int | None = None,
    motion_part: str | int | None = None,
    motion_shift: float | None = None,
    rate: float | None = None,
    speed: float | None = None,
    step: float | None = None,
    stroke: float | None = None,
    hold: float | None = None,
    first_row: int | None = None,
    instrument: str | os.PathLike | None = None,
    part: str | None = None,
    repeats: Collection[str] = REPEATS,
    progress: Progress | None = None,
) -> Campaign:
    """Identify every condition of a campaign.

    The result does not depend on the order of the files. Only the arrays of one condition are in memory at a time. A
    file that cannot be read or identified is part of the result, with its status, and a file of the folder that is not
    a recording is listed with the reason.

    Parameters
    ----------
    source : str, os.PathLike or iterable of them
        A folder, a glob, or a list of files, folders and globs.
    pattern : str, optional
        Pattern of the file names, such as ``"{specimen}_{speed_mm_s}_{repeat}"``, from which the fields of a file are
        read.
    mapping : str or os.PathLike, optional
        CSV table with a column ``file`` and one column for each field, for files that do not match the pattern. Without
        either, the fields are read from the card in the file, otherwise from the names by evidence: a note states what
        the values decide (date, speed, repeat) and what they do not.
    model : str, optional
        Name of the model, as for ``identify``.
    needle : Needle, optional
        The needle, as for ``identify``.
    columns, units, inwards, filter_length, motion_part, motion_shift, rate, speed, step, stroke, hold, first_row
        As for ``read``. Every recording of a file with several is used; they are repeats of one condition.
    instrument : str or os.PathLike, optional
        Options kept in a file, the ``mapping`` of ``read``.
    part : str, optional
        Which recordings of each file, as for ``read_all``: ``"cycle *"`` takes every cycle of a recording that repeats.
        Cycles are repeats of one condition, too. By default a recording with cycles is used as a whole.
    repeats : collection of str
        Fields in which repeats of one condition differ. Files with equal other fields are repeats of one condition; a
        file without fields is identified by itself.
    progress : callable, optional
        ``progress(iterable, text)`` wraps the work over files, for a progress bar.

    Returns
    -------
    Campaign
        The conditions and the recordings without condition.

    Raises
    ------
    InputError
        A source without files, a pattern that matches none of them, a mapping that cannot be read, or an unknown model.
    """
    options = {"columns": columns, "units": units, "inwards": inwards, "filter_length": filter_length}
    options |= {
        "motion_part": motion_part,
        "motion_shift": motion_shift,
        "rate": rate,
        "speed": speed,
        "step": step,
        "stroke": stroke,
        "hold": hold,
        "first_row": first_row,
        "mapping": instrument,
    }
    files, not_recordings = _sorted_out(source, mapping, options)
    files = [each for file in files for each in file.parts(part, options)]
    labels, notes = label_files(files, pattern, mapping)
    if pattern is None and mapping is None:
        labels, more = inferred(labels, lambda file: _speed(file, options))
        notes += more
    groups = grouped(labels, repeats)
    found = list(_conditions(groups, repeats, options, model=model, needle=needle, progress=progress))
    conditions = _with_wrong_labels([each for each in found if each.recordings[0].fields])
    others = [each.recordings[0] for each in found if not each.recordings[0].fields]
    reasons = {label.file.name: label.why for label in labels}
    without = tuple(_without_condition(each, reasons[each.file]) for each in others)
    return Campaign(tuple(conditions), without, tuple(notes), tuple(not_recordings))


def _sorted_out(
    source: Any, mapping: str | os.PathLike | None, options: dict[str, Any]
) -> tuple[list[File], list[tuple[str, str]]]:
    """The recordings, and the other files of the folders with the reason why they are none.

    A file with another ending is a recording if it can be read as one. Raises InputError if none is.
    """
    files, rest = find_files(source), []
    table = None if mapping is None else Path(os.path.abspath(mapping))
    for file in other_files(source):
        why = "it is the mapping" if file.path == table else "it keeps options" if file.path.name == IN_FOLDER else ""
        why = why or _unreadable(file, options)
        if why:
            rest.append((file.name, why))
        else:
            files.append(file)
    if not files:
        reasons = "; ".join(f"{name}: {why}" for name, why in rest[:3])
        raise InputError("source", repr(str(source)), f"a folder without recordings ({reasons})")
    return sorted(files), rest


def _unreadable(file: File, options: dict[str, Any]) -> str:
    try:
        read(file.path, part=file.parts(None, options)[0].part, **options)
    except (InputError, OSError) as error:
        return str(error).replace(f"{file.path}: ", "").replace(f"{file.path}, ", "")
    return ""


def _speed(file: File, options: dict[str, Any]) -> float:
    """The median speed [m/s] of the first insertion; NaN without one."""
    try:
        recording = read(file.path, part=file.part, **options)
    except (InputError, OSError):
        return float("nan")
    strokes = cycles(recording.time, recording.depth)
    return float(np.median(recording.velocity[strokes[0].start : strokes[0].stop])) if strokes else float("nan")


def _conditions(
    groups: list[list[Label]],
    repeats: Collection[str],
    options: dict[str, Any],
    *,
    model: str | None,
    needle: Needle | None,
    progress: Progress | None,
) -> Iterator[Condition]:
    """One condition after the other; the recordings of each are released before the next is read."""
    files = [(label, label is group[-1]) for group in groups for label in group]
    loaded: list[LoadedFile] = []
    for label, last in progress(files, "identifying") if progress else files:
        loaded.append(_load(label, options))
        if last:
            yield condition(loaded, label.condition(repeats), model, needle)
            loaded = []


def _load(label: Label, options: dict[str, Any]) -> LoadedFile:
    try:
        return LoadedFile(label, read(label.file.path, part=label.file.part, **options))
    except (InputError, OSError) as error:
        return LoadedFile(label, None, str(error))


def _with_wrong_labels(conditions: list[Condition]) -> list[Condition]:
    """The conditions with anomalies of labels, which are found only by comparing all conditions."""
    curves = {each.name: {one.file: one.curve for one in each.recordings if _comparable(one)} for each in conditions}
    pooled = {
        each.name: [one.file for one in each.recordings if one.pooled and _comparable(one)] for each in conditions
    }
    with np.errstate(all="ignore"):  # values too large for a force give distances that are not finite
        mislabelled = dict(wrong_labels(curves, pooled))
    return [
        dataclasses.replace(each, recordings=tuple(_with(one, mislabelled.get(one.file)) for one in each.recordings))
        for each in conditions
    ]


def _comparable(one: RecordingResult) -> bool:
    """Whether the loading curve can be compared: it exists, and its sign, unit and range are valid."""
    return len(one.curve) > 0 and not any(each.kind in INVALIDATING for each in one.anomalies)


def _without_condition(one: RecordingResult, reason: str) -> RecordingResult:
    nan = float("nan")
    anomaly = Anomaly(kind="no_condition", quantity="", value=nan, usual=nan, unit="", sentence=reason)
    return dataclasses.replace(one, anomalies=(*one.anomalies, anomaly), pooled=False)


def _with(one: RecordingResult, anomaly: Anomaly | None) -> RecordingResult:
    return one if anomaly is None else dataclasses.replace(one, anomalies=(*one.anomalies, anomaly))
