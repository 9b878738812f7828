# SPDX-License-Identifier: Apache-2.0
"""``campaign``: identify every condition in a folder of recordings, with a result for every recording: repeats
identified, their anomalies, the pooled fit of the valid ones, and the curves that are kept."""

import os
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..core import Needle
from ..errors import InputError
from ..identification import Estimate, Fit, RecordingFit, identify
from ..recording import Recording
from ..recording.mappings import IN_FOLDER
from ..recording.options import FileOptions, ReadOptions, keywords_of
from ..recording.reader import RecordingFile, open_file
from ..segmentation.strokes import cycles
from ..vocabulary import Status
from .checks import check_repeats, moving_repeats, outliers, wrong_labels
from .folder_files import File, find_files, other_files
from .labels import REPEATS, Label, grouped, inferred, label_files
from .recording_result import INVALIDATING, Anomaly, RecordingResult, RecordingSummary, Trace, event_quantities, trace
from .repeat_checks import copy_anomalies
from .result import Campaign, Condition

Progress = Callable[[Any, str], Any]
ALL_LEFT_OUT = "No recording is left to pool: {}"
TOO_WIDE = "the interval is wider than the value"
_ARBITRARY_ZERO = ("contact_depth", "puncture_depth")
NO_PARAMETERS = "No recording gives parameters: {}"


@dataclass(frozen=True, kw_only=True)
class CampaignOptions(FileOptions):
    """The options of ``campaign``: those of its files, and these.

    Parameters
    ----------
    instrument : str or os.PathLike, optional
        Options kept in a file, the ``mapping`` of ``read``.
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
    repeats : collection of str
        Fields in which repeats of one condition differ. Files with equal other fields are repeats of one condition; a
        file without fields is identified by itself.
    progress : callable, optional
        ``progress(iterable, text)`` wraps the work over files, for a progress bar.
    """

    instrument: str | os.PathLike | None = None
    pattern: str | None = None
    mapping: str | os.PathLike | None = None
    model: str | None = None
    needle: Needle | None = None
    repeats: Collection[str] = REPEATS
    progress: Progress | None = None


@dataclass(frozen=True, eq=False)
class LoadedFile:
    """A file with its recording, or with None and the error message if it cannot be read."""

    label: Label
    recording: Recording | None
    problem: str = ""

    @property
    def name(self) -> str:
        """The file's path relative to the campaign's folder."""
        return self.label.file.name

    def without_folder(self, sentence: str) -> str:
        """A sentence without the path of the campaign's folder, so that the result does not depend on it."""
        return sentence.replace(str(self.label.file.path), self.name)


@keywords_of(CampaignOptions)
def campaign(source: str | os.PathLike | Iterable[str | os.PathLike], options: CampaignOptions) -> Campaign:
    """Identify every condition of a campaign.

    The result does not depend on the order of the files. Only the arrays of one condition are in memory at a time. A
    file that cannot be read or identified is part of the result, with its status, and a file of the folder that is not
    a recording is listed with the reason. Every recording of a file with several is used, or those of ``part``, as for
    ``read_all``: ``"cycle *"`` takes every cycle of a recording that repeats, which by default is used as a whole. They
    are repeats of one condition.

    Parameters
    ----------
    source : str, os.PathLike or iterable of them
        A folder, a glob, or a list of files, folders and globs.
    options : CampaignOptions
        The keywords.

    Returns
    -------
    Campaign
        The conditions and the recordings without condition.

    Raises
    ------
    InputError
        A source without files, a pattern that matches none of them, a mapping that cannot be read, or an unknown model.
    """
    pattern, mapping, repeats = options.pattern, options.mapping, options.repeats
    reading = ReadOptions(**options.of_every_file(), mapping=options.instrument)
    files, not_recordings = _sorted_out(source, mapping, replace(reading, part=None))
    files = [each for file in files for each in file.parts(reading)]
    recordings = _Recordings(reading)
    labels, notes = label_files(files, pattern, mapping)
    if pattern is None and mapping is None:
        labels, more = inferred(labels, lambda file: _speed(file, recordings))
        notes += more
    found = list(_conditions(grouped(labels, repeats), options, recordings))
    conditions = _with_wrong_labels([each for each in found if each.recordings[0].fields])
    others = [each.recordings[0] for each in found if not each.recordings[0].fields]
    reasons = {label.file.name: label.why for label in labels}
    without = tuple(_without_condition(each, reasons[each.file]) for each in others)
    return Campaign(tuple(conditions), without, tuple(notes), tuple(not_recordings))


def _sorted_out(
    source: Any, mapping: str | os.PathLike | None, options: ReadOptions
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


def _unreadable(file: File, options: ReadOptions) -> str:
    try:
        opened = open_file(file.path, options)
        opened.read(opened.chosen()[0][0])
    except (InputError, OSError) as error:
        return str(error).replace(f"{file.path}: ", "").replace(f"{file.path}, ", "")
    return ""


class _Recordings:
    """The recordings of files; a file with several is open until a recording of another one is read."""

    def __init__(self, options: ReadOptions):
        self._options = options
        self._opened: RecordingFile | None = None

    def read(self, file: File) -> Recording:
        """The recording of a file. Raises InputError as ``nf.read``."""
        opened, self._opened = self._opened, None
        if opened is None or opened.path != file.path:
            opened = open_file(file.path, self._options)
        recording = opened.read(file.part)[0]
        self._opened = opened if len(opened.parts) > 1 else None
        return recording


def _speed(file: File, recordings: _Recordings) -> float:
    """The median speed [m/s] of the first insertion; NaN without one."""
    try:
        recording = recordings.read(file)
    except (InputError, OSError):
        return float("nan")
    strokes = cycles(recording.time, recording.depth)
    return float(np.median(recording.velocity[strokes[0].start : strokes[0].stop])) if strokes else float("nan")


def _conditions(groups: list[list[Label]], options: CampaignOptions, recordings: _Recordings) -> Iterator[Condition]:
    """One condition after the other; the recordings of each are released before the next is read."""
    files = [(label, label is group[-1]) for group in groups for label in group]
    loaded: list[LoadedFile] = []
    for label, last in options.progress(files, "identifying") if options.progress else files:
        loaded.append(_load(label, recordings))
        if last:
            yield condition(loaded, label.condition(options.repeats), options.model, options.needle)
            loaded = []


def _load(label: Label, recordings: _Recordings) -> LoadedFile:
    try:
        return LoadedFile(label, recordings.read(label.file))
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
        replace(each, recordings=tuple(_with(one, mislabelled.get(one.file)) for one in each.recordings))
        for each in conditions
    ]


def _comparable(one: RecordingResult) -> bool:
    """Whether the loading curve can be compared: it exists, and its sign, unit and range are valid."""
    return len(one.curve) > 0 and not any(each.kind in INVALIDATING for each in one.anomalies)


def _without_condition(one: RecordingResult, reason: str) -> RecordingResult:
    return replace(_with(one, Anomaly(kind="no_condition", sentence=reason)), pooled=False)


def _with(one: RecordingResult, anomaly: Anomaly | None) -> RecordingResult:
    return one if anomaly is None else replace(one, anomalies=(*one.anomalies, anomaly))


def condition(
    files: Sequence[LoadedFile], fields: dict[str, str], model: str | None, needle: Needle | None
) -> Condition:
    """Identify the condition of these repeats. No content of a recording raises an error; faults are in the result."""
    readable = [each for each in files if each.recording is not None]
    duplicates = copy_anomalies([(each.name, each.recording) for each in readable])
    first = _identified([each.recording for each in readable if each.name not in duplicates], model, needle)
    fits = iter(first.recordings)
    fitted = {each.name: next(fits) for each in readable if each.name not in duplicates}
    moving = moving_repeats(
        [(each.name, each.recording, fitted[each.name].events) for each in readable if each.name in fitted]
    )
    summaries, anomalies = {each.name: each.summary for each in moving}, {each.name: [] for each in readable}
    anomalies |= check_repeats(moving, {each.name: each.label.fields for each in readable})
    anomalies |= {name: [anomaly] for name, anomaly in duplicates.items()}
    kept = [each for each in readable if not any(one.left_out for one in anomalies[each.name])]
    pooled = first if len(kept) == len(fitted) else _identified([each.recording for each in kept], model, needle)
    for file, anomaly in outliers({each.name: fitted[each.name].parameters for each in kept}):
        anomalies[file].append(anomaly)
    names = {each.name for each in kept if fitted[each.name].parameters}
    results = tuple(
        _result(each, fitted.get(each.name), summaries.get(each.name), anomalies.get(each.name, []), names)
        for each in files
    )
    return Condition(
        fields=fields,
        recordings=results,
        parameters={name: _checked(each) for name, each in pooled.parameters.items()},
        model=pooled.model,
        quality=pooled.quality,
        why="" if pooled.model is not None else _why(results, pooled),
        warnings=pooled.warnings,
        shown=None if pooled.model is None else _model_trace(pooled),
    )


def _checked(estimate: Estimate) -> Estimate:
    """The estimate, not identifiable if the ± of its interval exceeds the value: not even the sign is known then.

    The zero of a contact or puncture depth is arbitrary, so that its size means nothing.
    """
    half = 0.5 * (estimate.high - estimate.low)
    if estimate.name in _ARBITRARY_ZERO or half <= abs(estimate.value):
        return estimate
    source = f"{estimate.source}; {TOO_WIDE}" if estimate.source else TOO_WIDE
    return replace(estimate, identifiable=False, source=source)


def _identified(recordings: list[Recording], model: str | None, needle: Needle | None) -> Fit:
    return identify(recordings, model=model, needle=needle) if recordings else Fit()


def _result(
    file: LoadedFile,
    fit: RecordingFit | None,
    summary: RecordingSummary | None,
    anomalies: list[Anomaly],
    pooled: set[str],
) -> RecordingResult:
    known = {"file": file.name, "fields": file.label.fields, "anomalies": tuple(anomalies)}
    if fit is None:
        status = Status.unreadable if file.recording is None else Status.ok
        notes = (file.without_folder(file.problem),) if file.problem else ()
        return RecordingResult(**known, status=status, notes=notes)
    quantities = event_quantities(file.recording, fit.events) | ({} if summary is None else summary.quantities())
    reading = [note.message for note in file.recording.notes]
    notes = dict.fromkeys(note for note in fit.notes if note not in reading)
    result = RecordingResult(
        **known,
        status=fit.status,
        notes=tuple(map(file.without_folder, notes)),
        reading=tuple(map(file.without_folder, reading)),
        pooled=file.name in pooled,
        events=fit.events,
        measured=quantities,
        parameters=fit.parameters,
        quality=fit.quality,
    )
    return result if summary is None else replace(result, shown=summary.shown, curve=summary.curve)


def _why(results: tuple[RecordingResult, ...], pooled: Fit) -> str:
    """Why a condition has no model."""
    if pooled.parameters:
        return " ".join(pooled.warnings)
    reasons = dict.fromkeys(each.anomalies[0].sentence if each.left_out else each.why for each in results)
    first, more = list(reasons)[:3], len(reasons) - 3
    text = ALL_LEFT_OUT if any(each.left_out for each in results) else NO_PARAMETERS
    return text.format(" ".join(first) + (f" And {more} more reasons." if more > 0 else ""))


def _model_trace(fit: Fit) -> Trace:
    """The pooled model along the motion of the repeat with the median residual."""
    ranked = sorted((each for each in fit.recordings if each.quality), key=lambda each: each.quality.rmse_N)
    chosen = (ranked or [each for each in fit.recordings if each.parameters])[(len(ranked) - 1) // 2 if ranked else 0]
    surface = fit.parameters["contact_depth"].value
    return trace(chosen.recording.depth, np.asarray(fit.predict(chosen.recording)), surface)
