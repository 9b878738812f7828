# SPDX-License-Identifier: Apache-2.0
"""The outcome of a campaign: recordings, conditions, and the whole."""

from dataclasses import dataclass, field

import numpy as np

from ..identification.estimates import Estimate, Quality
from ..models.model import Model
from ..segmentation import Events
from ..vocabulary import Status
from .anomaly import Oddity
from .trace import Trace


@dataclass(frozen=True, eq=False)
class Outcome:
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
    oddities: tuple[Oddity, ...] = ()
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
        return any(each.left_out for each in self.oddities)

    @property
    def why(self) -> str:
        """What is odd in it, in sentences; where it gave no parameters, why."""
        said = [each.sentence for each in self.oddities]
        explained = self.answers or any(each.kind == "no_puncture" for each in self.oddities)
        return " ".join(said if explained else [*said, *self.notes])


@dataclass(frozen=True, eq=False)
class Condition:
    """Repeats of one condition: the ``fields`` they share, pooled ``parameters`` and the ``model`` they make.

    Where there is none, ``why`` says so. ``shown`` is the model along the motion of the repeat with the median
    residual.
    """

    fields: dict[str, str]
    recordings: tuple[Outcome, ...]
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
    def pooled(self) -> tuple[Outcome, ...]:
        """The recordings that its parameters rest on."""
        return tuple(each for each in self.recordings if each.pooled)


@dataclass(frozen=True, eq=False)
class Campaign:
    """Every condition, the ``others`` (recordings that nothing assigns to a condition, each by itself), and notes."""

    conditions: tuple[Condition, ...]
    others: tuple[Outcome, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def recordings(self) -> tuple[Outcome, ...]:
        """Every recording, by condition."""
        return (*(each for condition in self.conditions for each in condition.recordings), *self.others)

    def table(self):
        """One tidy pandas table: a row for each recording and quantity, and for each condition and quantity."""
        from .table import tidy

        return tidy(self)

    def save_table(self, path) -> None:
        """Writes the table as CSV, or as Parquet where the file's name ends so (needs pyarrow)."""
        from .table import save

        save(self, path)

    def to_json(self) -> str:
        """The outcome as JSON text."""
        from .as_json import as_json

        return as_json(self)

    def report(self, path) -> None:
        """Writes one HTML file that opens offline."""
        from ..report import write_campaign_report

        write_campaign_report(self, path)
