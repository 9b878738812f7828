# SPDX-License-Identifier: Apache-2.0
"""The result of a campaign: recordings, conditions and the whole; as one tidy table, and as JSON."""

import dataclasses
import json
import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..files import atomic_write, json_safe
from ..identification.estimates import Estimate, Quality
from ..models.model import Model
from ..recording.parquet_table import pyarrow_for
from ..segmentation import Events
from ..vocabulary import Status
from .anomaly import Anomaly
from .labels import COLUMNS
from .summary import Trace


@dataclass(frozen=True, eq=False)
class RecordingResult:
    """What became of one recording. ``file`` is its name below the campaign's folder.

    ``pooled`` says whether the condition's parameters rest on it too; ``seen`` are motion, forces and events as seen,
    ``parameters`` its own fit; ``shown`` its curve to draw, ``curve`` its loading curve to compare, None or empty
    where it could not be read. ``notes`` are what segmentation and fit said, or why it could not be read; ``reading``
    is what reading said.
    """

    file: str
    fields: dict[str, str]
    status: Status
    notes: tuple[str, ...] = ()
    reading: tuple[str, ...] = ()
    anomalies: tuple[Anomaly, ...] = ()
    pooled: bool = False
    events: Events = field(default_factory=Events)
    seen: dict[str, Estimate] = field(default_factory=dict)
    parameters: dict[str, Estimate] = field(default_factory=dict)
    quality: Quality | None = None
    shown: Trace | None = None
    curve: np.ndarray = field(default_factory=lambda: np.empty(0))

    @property
    def answers(self) -> bool:
        """Whether it has parameters of its own."""
        return bool(self.parameters)

    @property
    def left_out(self) -> bool:
        """Whether the pooled fit does without it because of something odd."""
        return any(each.left_out for each in self.anomalies)

    @property
    def why(self) -> str:
        """What is odd in it, in sentences; where it gave no parameters, why."""
        said = [each.sentence for each in self.anomalies]
        explained = self.answers or any(each.kind == "no_puncture" for each in self.anomalies)
        return " ".join(said if explained else [*said, *self.notes])


@dataclass(frozen=True, eq=False)
class Condition:
    """Repeats of one condition: the ``fields`` they share, pooled ``parameters`` and the ``model`` they make.

    Where there is none, ``why`` says so. ``shown`` is the model along the motion of the repeat with the median
    residual.
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
        """The recordings that its parameters rest on."""
        return tuple(each for each in self.recordings if each.pooled)


@dataclass(frozen=True, eq=False)
class Campaign:
    """Every condition, the ``others`` (recordings that nothing assigns to a condition, each by itself), and notes."""

    conditions: tuple[Condition, ...]
    others: tuple[RecordingResult, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def recordings(self) -> tuple[RecordingResult, ...]:
        """Every recording, by condition."""
        return (*(each for condition in self.conditions for each in condition.recordings), *self.others)

    def table(self):
        """One tidy pandas table: a row for each recording and quantity, and for each condition and quantity."""

        return _tidy(self)

    def save_table(self, path) -> None:
        """Writes the table as CSV, or as Parquet where the file's name ends so (needs pyarrow)."""

        _save_table(self, path)

    def to_json(self) -> str:
        """The outcome as JSON text."""

        return _document(self)

    def report(self, path) -> None:
        """Writes one HTML file that opens offline."""
        from ..report import write_campaign_report

        write_campaign_report(self, path)


def _tidy(campaign: Campaign):
    """A pandas DataFrame in SI: the fields of the conditions, then ``COLUMNS``; pooled values have no ``file``.

    Each recording has a row ``anomalies`` with their number, which also says why it gave nothing; its own parameters
    are named as in ``Fit.parameters``; what was seen without a model are speed, travel, hold, forces, and events from
    ``event_contact_depth`` to ``event_exit_depth``.
    """
    import pandas

    fields = dict.fromkeys(name for one in campaign.recordings for name in one.fields)
    rows = [row for condition in campaign.conditions for row in _condition_rows(condition)]
    rows += [row for one in campaign.others for row in _recording_rows(one)]
    made = pandas.DataFrame([dict.fromkeys(fields, "") | row for row in rows], columns=[*fields, *COLUMNS])
    numbers = dict.fromkeys(("value", "low", "high"), "float64")
    return made.astype(numbers | dict.fromkeys(("pooled", "identifiable", "outlier"), "bool"))


def _save_table(campaign: Campaign, path: str | os.PathLike) -> None:
    """Writes the table whole: Parquet for a name that ends so, else CSV.

    Raises InputError where it cannot be written, and for Parquet without pyarrow.
    """
    target, made = Path(path), _tidy(campaign)
    if target.suffix.lower() == ".parquet":
        _save_parquet(made, target)
        return
    with atomic_write(target) as file:
        made.to_csv(file, index=False, lineterminator="\n")


def check_table(path: str | os.PathLike) -> None:
    """Raises InputError, before any work, for a Parquet file without pyarrow."""
    if Path(path).suffix.lower() == ".parquet":
        pyarrow_for(path)


def _save_parquet(made, target: Path) -> None:
    pyarrow = pyarrow_for(target)
    buffer = pyarrow.BufferOutputStream()
    pyarrow.parquet.write_table(pyarrow.Table.from_pandas(made, preserve_index=False), buffer)
    with atomic_write(target) as file:
        file.buffer.write(buffer.getvalue())


def _condition_rows(condition: Condition) -> Iterator[dict]:
    shared = condition.fields | {"file": "", "pooled": True, "status": "ok" if condition.model else "no_model"}
    for one in condition.recordings:
        yield from _recording_rows(one)
    count = Estimate("recordings", float(len(condition.pooled)), "1", float("nan"), float("nan"))
    yield shared | _row(count, {"recordings": condition.why} if condition.why else {}, flagged=False)
    for estimate in condition.parameters.values():
        yield shared | _row(estimate, {}, flagged=False)


def _recording_rows(one: RecordingResult) -> Iterator[dict]:
    shared = one.fields | {"file": one.file, "pooled": one.pooled, "status": str(one.status)}
    said: dict[str, str] = {}
    for odd in one.anomalies:
        said[odd.quantity] = f"{said.get(odd.quantity, '')} {odd.sentence}".strip()
    count = Estimate("anomalies", float(len(one.anomalies)), "1", float("nan"), float("nan"))
    yield shared | _row(count, {"anomalies": one.why}, flagged=bool(one.anomalies))
    for estimate in (*one.seen.values(), *one.parameters.values()):
        yield shared | _row(estimate, said, flagged=estimate.name in said)


def _row(estimate: Estimate, said: dict[str, str], flagged: bool) -> dict:
    return {
        "quantity": estimate.name, "value": estimate.value, "low": estimate.low, "high": estimate.high,
        "unit": estimate.unit, "identifiable": estimate.identifiable, "outlier": flagged,
        "why": said.get(estimate.name, ""),
    }  # fmt: skip


def _document(campaign: Campaign) -> str:
    """The whole outcome; numbers that are not finite become null."""
    document = {
        "conditions": [_condition_document(each) for each in campaign.conditions],
        "others": [_recording_document(each) for each in campaign.others],
        "notes": list(campaign.notes),
    }
    return json.dumps(json_safe(document), indent=2, allow_nan=False)


def _condition_document(condition: Condition) -> dict:
    return {
        "name": condition.name,
        "fields": condition.fields,
        "model": None if condition.model is None else condition.model.name,
        "why": condition.why,
        "parameters": _estimates(condition.parameters),
        "quality": _plain(condition.quality),
        "warnings": list(condition.warnings),
        "recordings": [_recording_document(each) for each in condition.recordings],
    }


def _recording_document(one: RecordingResult) -> dict:
    return {
        "file": one.file,
        "fields": one.fields,
        "status": str(one.status),
        "pooled": one.pooled,
        "anomalies": [dataclasses.asdict(odd) for odd in one.anomalies],
        "seen": _estimates(one.seen),
        "parameters": _estimates(one.parameters),
        "quality": _plain(one.quality),
        "notes": list(one.notes),
        "reading": list(one.reading),
    }


def _estimates(estimates: dict[str, Estimate]) -> list[dict]:
    return [dataclasses.asdict(each) for each in estimates.values()]


def _plain(value) -> dict | None:
    return None if value is None else dataclasses.asdict(value)
