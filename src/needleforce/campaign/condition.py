# SPDX-License-Identifier: Apache-2.0
"""One condition: its repeats identified, their anomalies, the pooled fit of the valid ones, and the curves that are
kept."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..core import Needle
from ..errors import InputError
from ..files import digest
from ..identification import Estimate, Fit, RecordingFit, identify
from ..recording import Recording
from ..recording.options import ReadOptions
from ..recording.reader import RecordingFile, open_file
from ..vocabulary import Status
from .checks import check_repeats, moving_repeats, outliers
from .folder_files import File
from .kept_results import encoded_condition
from .labels import Label
from .recording_result import Anomaly, RecordingResult, RecordingSummary, Trace, event_quantities, trace
from .repeat_checks import copy_anomalies
from .result import Condition

ALL_LEFT_OUT = "No recording is left to pool: {}"
TOO_WIDE = "the interval is wider than the value"
_ARBITRARY_ZERO = ("contact_depth", "puncture_depth")
NO_PARAMETERS = "No recording gives parameters: {}"


@dataclass(frozen=True, eq=False)
class LoadedFile:
    """A file with its recording, or with None and the error message if it cannot be read."""

    label: Label
    recording: Recording | None
    problem: str = ""
    is_out_of_memory: bool = False

    @property
    def name(self) -> str:
        """The file's path relative to the campaign's folder."""
        return self.label.file.name

    def without_folder(self, sentence: str) -> str:
        """A sentence without the path of the campaign's folder, so that the result does not depend on it."""
        return sentence.replace(str(self.label.file.path), self.name)


@dataclass(frozen=True, kw_only=True)
class ConditionTask:
    """What a worker needs to identify a condition: where its files are, and the options.

    ``unreadable`` are files that are not to be read, with the reason; ``contents`` the digests that the files are to
    have, empty if the result is not kept.
    """

    labels: tuple[Label, ...]
    fields: dict[str, str]
    reading: ReadOptions
    model: str | None
    needle: Needle | None
    unreadable: dict[str, str]
    contents: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Identified:
    """A condition as bytes, whether it follows from the contents its files are to have, and the time it took [s]."""

    content: bytes
    follows: bool
    seconds: float


def identified(task: ConditionTask) -> Identified:
    """Read the files of a condition and identify it."""
    began, recordings = time.perf_counter(), Recordings(task.reading)
    loaded = [
        LoadedFile(label, None, task.unreadable[label.file.name])
        if label.file.name in task.unreadable
        else _load(label, recordings)
        for label in task.labels
    ]
    found = encoded_condition(condition(loaded, task.fields, task.model, task.needle))
    follows = bool(task.contents) and not task.unreadable and _is_of(loaded, task.contents)
    return Identified(content=found, follows=follows, seconds=time.perf_counter() - began)


def failed(task: ConditionTask, reason: str) -> Condition:
    """The condition if it could not be identified at all."""
    results = tuple(
        RecordingResult(file=each.file.name, fields=each.fields, status=Status.unreadable, notes=(reason,))
        for each in task.labels
    )
    return Condition(fields=task.fields, recordings=results, why=reason)


def _is_of(loaded: Sequence[LoadedFile], contents: tuple[str, ...]) -> bool:
    """Whether the files have these contents, and none was left out because this computer lacks memory."""
    if any(each.problem and each.is_out_of_memory for each in loaded):
        return False
    try:
        return all(digest(each.label.file.path) == content for each, content in zip(loaded, contents))
    except (InputError, OSError):
        return False


class Recordings:
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


def _load(label: Label, recordings: Recordings) -> LoadedFile:
    try:
        return LoadedFile(label, recordings.read(label.file))
    except (InputError, OSError) as error:
        is_out_of_memory = isinstance(error, InputError) and error.quantity == "memory"
        return LoadedFile(label, None, str(error), is_out_of_memory)


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
        model=pooled.identified_model,
        quality=pooled.quality,
        why="" if pooled.identified_model is not None else _why(results, pooled),
        warnings=pooled.warnings,
        shown=None if pooled.identified_model is None else _model_trace(pooled),
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
