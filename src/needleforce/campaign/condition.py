# SPDX-License-Identifier: Apache-2.0
"""One condition: its repeats identified, what is anomalous in each, the fit of the rest, and the curves that are
kept."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..identification import Fit, RecordingFit, identify
from ..recording import Recording
from ..vocabulary import Status
from .checks import check_repeats, moving_repeats
from .conditions import Label
from .outliers import outliers
from .repeat_checks import copies
from .result import Condition, RecordingResult
from .summary import RecordingSummary, Trace, event_quantities, trace

ALL_LEFT_OUT = "No recording is left to pool: {}"
NONE_ANSWERS = "No recording can answer: {}"


@dataclass(frozen=True, eq=False)
class Read:
    """A file that was read: the recording, or None and the sentence that says why there is none."""

    label: Label
    recording: Recording | None
    problem: str = ""

    @property
    def name(self) -> str:
        """The file's name below the campaign's folder."""
        return self.label.file.name

    def told(self, sentence: str) -> str:
        """A sentence without the place of the campaign's folder, which is no result."""
        return sentence.replace(str(self.label.file.path), self.name)


def condition(read: Sequence[Read], fields: dict[str, str], model: str | None, needle) -> Condition:
    """The condition of these repeats. Nothing that a recording holds stops it: what went wrong is told."""
    good = [each for each in read if each.recording is not None]
    twice = copies([(each.name, each.recording) for each in good])
    first = _identified([each.recording for each in good if each.name not in twice], model, needle)
    fits = iter(first.recordings)
    fitted = {each.name: next(fits) for each in good if each.name not in twice}
    moving = moving_repeats(
        [(each.name, each.recording, fitted[each.name].events) for each in good if each.name in fitted]
    )
    seen, odd = {each.name: each.seen for each in moving}, {each.name: [] for each in good}
    odd |= check_repeats(moving, {each.name: each.label.fields for each in good})
    odd |= {name: [oddity] for name, oddity in twice.items()}
    kept = [each for each in good if not any(one.left_out for one in odd[each.name])]
    pooled = first if len(kept) == len(fitted) else _identified([each.recording for each in kept], model, needle)
    for file, oddity in outliers({each.name: fitted[each.name].parameters for each in kept}):
        odd[file].append(oddity)
    names = {each.name for each in kept if fitted[each.name].parameters}
    told = tuple(_outcome(each, fitted.get(each.name), seen.get(each.name), odd, names) for each in read)
    why = "" if pooled.model is not None else _why(told, pooled)
    along = None if pooled.model is None else _along(pooled)
    return Condition(fields, told, pooled.parameters, pooled.model, pooled.quality, why, pooled.warnings, along)


def _identified(recordings: list[Recording], model: str | None, needle) -> Fit:
    return identify(recordings, model=model, needle=needle) if recordings else Fit()


def _outcome(
    read: Read, fit: RecordingFit | None, seen: RecordingSummary | None, odd: dict, pooled: set[str]
) -> RecordingResult:
    said = tuple(odd.get(read.name, ()))
    if fit is None:
        status = Status.unreadable if read.recording is None else Status.ok
        notes = (read.told(read.problem),) if read.problem else ()
        return RecordingResult(read.name, read.label.fields, status, notes, anomalies=said)
    quantities = event_quantities(read.recording, fit.events) | ({} if seen is None else seen.quantities())
    reading = [note.message for note in read.recording.notes]
    notes = dict.fromkeys(note for note in fit.notes if note not in reading)
    base = RecordingResult(
        read.name, read.label.fields, fit.status, tuple(map(read.told, notes)), tuple(map(read.told, reading)), said,
        read.name in pooled, fit.events, quantities, fit.parameters, fit.quality,
    )  # fmt: skip
    return base if seen is None else dataclasses.replace(base, shown=seen.shown, curve=seen.curve)


def _why(told: tuple[RecordingResult, ...], pooled: Fit) -> str:
    """Why a condition has no model."""
    if pooled.parameters:
        return " ".join(pooled.warnings)
    reasons = dict.fromkeys(each.anomalies[0].sentence if each.left_out else each.why for each in told)
    few, more = list(reasons)[:3], len(reasons) - 3
    said = ALL_LEFT_OUT if any(each.left_out for each in told) else NONE_ANSWERS
    return said.format(" ".join(few) + (f" And {more} more reasons." if more > 0 else ""))


def _along(fit: Fit) -> Trace:
    """The pooled model along the motion of the repeat with the median residual."""
    ranked = sorted((each for each in fit.recordings if each.quality), key=lambda each: each.quality.rmse_N)
    chosen = (ranked or [each for each in fit.recordings if each.parameters])[(len(ranked) - 1) // 2 if ranked else 0]
    surface = fit.parameters["contact_depth"].value
    return trace(chosen.recording.depth, np.asarray(fit.predict(chosen.recording)), surface)
