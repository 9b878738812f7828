# SPDX-License-Identifier: Apache-2.0
"""The result of a campaign: recordings and conditions, as objects, as one tidy table, and as JSON."""

import dataclasses
import os
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..display.axes import FORCE, INDENTATION
from ..display.quantities import counted, percent
from ..display.result import Result
from ..errors import InputError
from ..files import atomic_write, csv_text, open_regular
from ..identification.estimates import Estimate, Quality
from ..identification.export import preset_document
from ..models.model import Model
from ..recording.formats.parquet import pyarrow_for
from .labels import COLUMNS
from .recording_result import RecordingResult, Trace

CONDITIONS_HEAD = ("condition", "recordings used", "model", "residual / peak", "R²", "why there is no model")
MAX_NAMED = 4  # conditions in one note
_SEARCHED_BYTES = 1 << 16  # at either end of a file
_JSON = b'{\n  "conditions": ['
_PAGE = re.compile(rb'<p class="kicker">needleforce \S+ \xc2\xb7 campaign</p>')

if TYPE_CHECKING:
    import pandas

    from ..display.page import Page


@dataclass(frozen=True, eq=False, kw_only=True)
class Condition:
    """The repeats of one condition and their pooled fit.

    Parameters
    ----------
    fields : dict
        The fields that the repeats share.
    recordings : tuple of RecordingResult
        All repeats.
    parameters : dict
        Pooled parameters.
    model : Model or None
        The identified model; None if there is none, then ``why`` gives the reason.
    quality : Quality or None
        Quality of the pooled fit.
    why : str
        Why there is no model, otherwise empty.
    warnings : tuple of str
        Warnings of the fit.
    shown : Trace or None
        The model along the motion of the repeat with the median residual.
    """

    fields: dict[str, str]
    recordings: tuple[RecordingResult, ...]
    parameters: dict[str, Estimate] = field(default_factory=dict)
    model: Model | None = None
    quality: Quality | None = None
    why: str = ""
    warnings: tuple[str, ...] = ()
    shown: Trace | None = None

    @property
    def name(self) -> str:
        """The values of its fields."""
        return " · ".join(self.fields.values()) or "all recordings"

    @property
    def pooled(self) -> tuple[RecordingResult, ...]:
        """The recordings used for the pooled parameters."""
        return tuple(each for each in self.recordings if each.pooled)


@dataclass(frozen=True, eq=False, repr=False)
class Campaign(Result):
    """The result of a campaign.

    Parameters
    ----------
    conditions : tuple of Condition
        All conditions.
    others : tuple of RecordingResult
        Recordings that belong to no condition, each identified by itself.
    notes : tuple of str
        Notes on the campaign, such as rows of the mapping without a file.
    not_recordings : tuple of (str, str)
        Files of the folder that are no recordings, each with the reason.
    """

    conditions: tuple[Condition, ...]
    others: tuple[RecordingResult, ...] = ()
    notes: tuple[str, ...] = ()
    not_recordings: tuple[tuple[str, str], ...] = ()

    @property
    def recordings(self) -> tuple[RecordingResult, ...]:
        """Every recording, by condition."""
        return (*(each for condition in self.conditions for each in condition.recordings), *self.others)

    @property
    def all_notes(self) -> tuple[str, ...]:
        """The notes, the warnings of the conditions, and the files that are not recordings."""
        warned: dict[str, list[str]] = {}
        for condition in self.conditions:
            for text in condition.warnings:
                warned.setdefault(text, []).append(condition.name)
        warnings = (f"{_named(names)}: {text}" for text, names in warned.items())
        return (*self.notes, *warnings, *(f"{file} is not a recording: {why}" for file, why in self.not_recordings))

    def save_table(self, path: str | os.PathLike) -> None:
        """Write the table as Parquet (``.parquet``, needs pyarrow) or otherwise as CSV.

        Parameters
        ----------
        path : str or os.PathLike
            The file.

        Raises
        ------
        InputError
            The file cannot be written, or pyarrow is missing.
        """
        target, made = Path(path), self.to_dataframe()
        if target.suffix.lower() == ".parquet":
            _save_parquet(made, target)
            return
        texts = made.select_dtypes(exclude=["number", "bool"]).columns
        made[texts] = made[texts].map(csv_text)
        with atomic_write(target) as file:
            made.to_csv(file, index=False, lineterminator="\n")

    def to_dataframe(self) -> "pandas.DataFrame":
        """One tidy table: a row for each recording and quantity, and for each condition and quantity, in SI.

        The fields of the conditions stand first, then ``COLUMNS``; pooled values have no ``file``. Each recording has a
        row ``anomalies`` with their number and the reason if it has no parameters. Its own parameters are named as in
        ``Fit.parameters``; residual over peak and R² are those of its fit, or of the pooled one. Quantities measured
        without a model are speed, travel, hold, forces, and events from ``event_contact_depth`` to
        ``event_exit_depth``.
        """
        import pandas

        fields = dict.fromkeys(name for one in self.recordings for name in one.fields)
        rows = [row for condition in self.conditions for row in _condition_rows(condition)]
        rows += [row for one in self.others for row in _recording_rows(one)]
        made = pandas.DataFrame([dict.fromkeys(fields, "") | row for row in rows], columns=[*fields, *COLUMNS])
        numbers = dict.fromkeys(("value", "low", "high", "residual_over_peak", "r2"), "float64")
        return made.astype(numbers | dict.fromkeys(("pooled", "identifiable", "outlier"), "bool"))

    table = to_dataframe

    def _heading(self) -> str:
        identified = sum(each.model is not None for each in self.conditions)
        conditions, recordings = counted(len(self.conditions), "condition"), counted(len(self.recordings), "recording")
        return f"Campaign of {recordings}: {identified} of {conditions} identified"

    def _cells(self) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
        rows = [
            (
                each.name,
                f"{len(each.pooled)} of {len(each.recordings)}",
                "none" if each.model is None else each.model.name,
                *quality_cells(each.quality),
                each.why,
            )
            for each in self.conditions
        ]
        return CONDITIONS_HEAD, rows

    def _remarks(self) -> Iterable[tuple[str, Iterable[str]]]:
        yield "Notes", self.all_notes

    def _draw(self, axes: Any) -> tuple[str, ...]:
        """The model of each condition along the motion of one of its repeats."""
        for each in self.conditions:
            if each.shown is not None:
                axes.plot(1e3 * each.shown.indentation, each.shown.force, lw=1.2, label=each.name)
        return INDENTATION, FORCE, "Models of the conditions"

    def document(self) -> dict:
        """The complete result as dicts and lists, as ``to_json`` writes it."""
        return {
            "conditions": [_condition_document(each) for each in self.conditions],
            "others": [_recording_document(each) for each in self.others],
            "notes": list(self.notes),
            "not_recordings": [{"file": file, "why": why} for file, why in self.not_recordings],
        }

    def _page(self) -> "Page":
        from .page import campaign_page

        return campaign_page(self)


def _named(names: list[str]) -> str:
    """The names of conditions in a note, the first few of many."""
    more = len(names) - MAX_NAMED
    return ", ".join(names[:MAX_NAMED]) + (f" and {counted(more, 'more condition')}" if more > 0 else "")


def quality_cells(quality: Quality | None) -> tuple[str, str]:
    """Residual over peak and R² as text; empty without a model."""
    return ("", "") if quality is None else (percent(quality.nrmse), f"{quality.r2:.3f}")


def is_result(path: Path) -> bool:
    """Whether a file is a table, a report or the JSON of a campaign."""
    try:
        with open_regular(path) as file:
            start = file.read(_SEARCHED_BYTES)
            file.seek(max(os.fstat(file.fileno()).st_size - _SEARCHED_BYTES, 0))
            end = file.read(_SEARCHED_BYTES)
    except (InputError, OSError):
        return False
    if start.startswith(b"PAR1"):  # the names of the columns are at the end
        return all(name.encode() in end for name in COLUMNS)
    head = start.partition(b"\n")[0].rstrip(b"\r")
    return head.endswith(",".join(COLUMNS).encode()) or start.startswith(_JSON) or _PAGE.search(start) is not None


def check_table(path: str | os.PathLike) -> None:
    """Raise InputError for a Parquet file if pyarrow is missing; called before any work."""
    if Path(path).suffix.lower() == ".parquet":
        pyarrow_for(path)


def _save_parquet(made: "pandas.DataFrame", target: Path) -> None:
    pyarrow = pyarrow_for(target)
    buffer = pyarrow.BufferOutputStream()
    pyarrow.parquet.write_table(pyarrow.Table.from_pandas(made, preserve_index=False), buffer)
    with atomic_write(target) as file:
        file.buffer.write(buffer.getvalue())


def _condition_rows(condition: Condition) -> Iterator[dict]:
    shared = condition.fields | {"file": "", "pooled": True, "status": "ok" if condition.model else "no_model"}
    shared |= _quality(condition.quality)
    for one in condition.recordings:
        yield from _recording_rows(one)
    count = Estimate("recordings", float(len(condition.pooled)), "1", float("nan"), float("nan"))
    yield shared | _row(count, {"recordings": condition.why} if condition.why else {}, flagged=False)
    for estimate in condition.parameters.values():
        reason = {} if estimate.identifiable else {estimate.name: estimate.source}
        yield shared | _row(estimate, reason, flagged=False)


def _recording_rows(one: RecordingResult) -> Iterator[dict]:
    shared = one.fields | {"file": one.file, "pooled": one.pooled, "status": str(one.status)} | _quality(one.quality)
    sentences: dict[str, str] = {}
    for anomaly in one.anomalies:
        sentences[anomaly.quantity] = f"{sentences.get(anomaly.quantity, '')} {anomaly.sentence}".strip()
    count = Estimate("anomalies", float(len(one.anomalies)), "1", float("nan"), float("nan"))
    yield shared | _row(count, {"anomalies": one.why}, flagged=bool(one.anomalies))
    for estimate in (*one.measured.values(), *one.parameters.values()):
        yield shared | _row(estimate, sentences, flagged=estimate.name in sentences)


def _quality(quality: Quality | None) -> dict[str, float]:
    found = (float("nan"), float("nan")) if quality is None else (quality.nrmse, quality.r2)
    return dict(zip(("residual_over_peak", "r2"), found))


def _row(estimate: Estimate, sentences: dict[str, str], flagged: bool) -> dict:
    return {
        "quantity": estimate.name, "value": estimate.value, "low": estimate.low, "high": estimate.high,
        "unit": estimate.unit, "identifiable": estimate.identifiable, "outlier": flagged,
        "why": sentences.get(estimate.name, ""),
    }  # fmt: skip


def _condition_document(condition: Condition) -> dict:
    return {
        "name": condition.name,
        "fields": condition.fields,
        "model": None if condition.model is None else condition.model.name,
        "why": condition.why,
        "parameters": _estimates(condition.parameters),
        "quality": None if condition.quality is None else dataclasses.asdict(condition.quality),
        "warnings": list(condition.warnings),
        "recordings": [_recording_document(each) for each in condition.recordings],
        "preset": preset_document(condition.model),
    }


def _recording_document(one: RecordingResult) -> dict:
    return {
        "file": one.file,
        "fields": one.fields,
        "status": str(one.status),
        "pooled": one.pooled,
        "anomalies": [dataclasses.asdict(anomaly) for anomaly in one.anomalies],
        "measured": _estimates(one.measured),
        "parameters": _estimates(one.parameters),
        "quality": None if one.quality is None else dataclasses.asdict(one.quality),
        "notes": list(one.notes),
        "reading": list(one.reading),
    }


def _estimates(estimates: dict[str, Estimate]) -> list[dict]:
    return [each.document() for each in estimates.values()]
