# SPDX-License-Identifier: Apache-2.0
"""What segmentation finds: events with the samples between which they lie, and phases as spans."""

from dataclasses import dataclass, field

from ..vocabulary import Phase, Status


@dataclass(frozen=True)
class Event:
    """Something that happened between sample ``low`` and sample ``high``: time [s], depth [m], force [N]."""

    time: float
    depth: float
    force: float
    low: int
    high: int


@dataclass(frozen=True)
class Puncture(Event):
    """The force peak before its drop [N], and its indentation [m]: its depth minus the contact depth."""

    drop: float
    indentation: float


@dataclass(frozen=True)
class Span:
    """One phase: from ``start`` to ``end`` [s], samples ``first`` up to but not including ``last``."""

    phase: Phase
    start: float
    end: float
    first: int
    last: int


@dataclass(frozen=True)
class Events:
    """Events and phases of one recording; ``notes`` say in plain words what was doubtful."""

    contact: Event | None = None
    punctures: tuple[Puncture, ...] = ()
    exit: Event | None = None
    phases: tuple[Span, ...] = ()
    status: Status = Status.ok
    notes: tuple[str, ...] = field(default=())

    def spans(self, phase: str) -> tuple[Span, ...]:
        """The spans of one phase, in order of time."""
        return tuple(span for span in self.phases if span.phase == phase)
