# SPDX-License-Identifier: Apache-2.0
"""The result of segmentation: events with the samples that bound them, and phases as spans."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..display.quantities import counted, fixed, with_unit
from ..display.result import Printed
from ..vocabulary import Phase, Status

EVENT_HEAD = ("event", "time", "depth", "indentation", "force", "drop", "between samples")


@dataclass(frozen=True)
class Event:
    """An event of a recording.

    Parameters
    ----------
    time : float
        Time [s].
    depth : float
        Depth [m] in the recording's own zero.
    force : float
        Force of the recording [N], including its bias.
    low, high : int
        Numbers of the samples between which the event occurred.
    """

    time: float
    depth: float
    force: float
    low: int
    high: int


@dataclass(frozen=True)
class Puncture(Event):
    """A puncture: the force peak before its drop.

    Parameters
    ----------
    time, depth, force, low, high
        As for ``Event``, at the force peak.
    drop : float
        Drop of the force after the peak [N].
    indentation : float
        Depth minus contact depth [m].
    statistic : float
        Size of the fall in standard deviations of noise and fluctuation of the stroke, over the best windows.
    drop_low, drop_high : float
        95 % interval of ``drop`` [N].
    end : int
        Number of the sample at which the fall ends, -1 if not known.
    end_depth : float
        Depth at that sample [m].
    gradual : bool
        True if the fall takes longer than needle and sensor take to follow a sudden one.
    """

    drop: float
    indentation: float
    statistic: float = field(default=math.nan, kw_only=True)
    drop_low: float = field(default=math.nan, kw_only=True)
    drop_high: float = field(default=math.nan, kw_only=True)
    end: int = field(default=-1, kw_only=True)
    end_depth: float = field(default=math.nan, kw_only=True)
    gradual: bool = field(default=False, kw_only=True)


@dataclass(frozen=True)
class Span:
    """One phase of a recording.

    Parameters
    ----------
    phase : Phase
        ``free``, ``deformation``, ``insertion``, ``hold`` or ``extraction``.
    start, end : float
        Times of its first and last sample [s].
    first, last : int
        Its samples: ``first`` up to but not including ``last``.
    """

    phase: Phase
    start: float
    end: float
    first: int
    last: int


@dataclass(frozen=True, repr=False)
class Events(Printed):
    """The events and phases of one recording. It prints as a table of events and the times of the phases.

    Parameters
    ----------
    contact : Event or None
        First contact of the insertion stroke.
    punctures : tuple of Puncture
        In order of time.
    exit : Event or None
        Exit of the needle during withdrawal.
    phases : tuple of Span
        All phases, in order of time.
    status : Status
        ``ok``, ``no_contact``, ``no_puncture``, ``incomplete`` or ``unreadable``.
    notes : tuple of str
        Sentences on what is missing or doubtful.
    minor : tuple of Puncture
        Falls of the force that are significant but no punctures: smaller ones within the texture of a rough tissue, and
        the regular oscillation of a cutting force.
    outliers : (k,) array of int
        Numbers of the samples of the force that lie far from both neighbours.
    baseline : float or None
        Force of the free travel before the contact [N]; None if the recording begins in contact or has none.
    noise : float
        Standard deviation of a sample of the force [N], without its correlation.
    """

    contact: Event | None = None
    punctures: tuple[Puncture, ...] = ()
    exit: Event | None = None
    phases: tuple[Span, ...] = ()
    status: Status = Status.ok
    notes: tuple[str, ...] = field(default=())
    minor: tuple[Puncture, ...] = field(default=(), kw_only=True)
    outliers: np.ndarray = field(default_factory=lambda: np.empty(0, int), kw_only=True, compare=False)
    baseline: float | None = field(default=None, kw_only=True)
    noise: float = field(default=0.0, kw_only=True)

    def spans(self, phase: str) -> tuple[Span, ...]:
        """Select the spans of one phase.

        Parameters
        ----------
        phase : str
            Name of the phase.

        Returns
        -------
        tuple of Span
            In order of time.
        """
        return tuple(span for span in self.phases if span.phase == phase)

    @property
    def named(self) -> list[tuple[str, Event]]:
        """The events that were found, with their names: contact, punctures, exit."""
        every = (("contact", self.contact), *(("puncture", each) for each in self.punctures), ("exit", self.exit))
        return [(name, event) for name, event in every if event is not None]

    __repr__ = Printed.__str__

    def _heading(self) -> str:
        return f"Events: {self.status}, {counted(len(self.punctures), 'puncture')}"

    def _cells(self) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
        rows = []
        for name, event in self.named:
            indentation = "" if self.contact is None else _milli(1e3 * (event.depth - self.contact.depth), "mm")
            place = _milli(event.time, "s"), _milli(1e3 * event.depth, "mm"), indentation, _milli(event.force, "N")
            drop = _milli(event.drop, "N") if isinstance(event, Puncture) else ""
            rows.append((name, *place, drop, f"{event.low}–{event.high}"))
        return EVENT_HEAD, rows

    def _remarks(self) -> Iterable[tuple[str, Iterable[str]]]:
        yield "Phases", [f"{span.phase}: {span.start:.2f} to {span.end:.2f} s" for span in self.phases]
        yield "Notes", self.notes


def _milli(value: float, unit: str) -> str:
    """A value with three decimals: milliseconds, micrometres and millinewtons, finer than the sensors resolve."""
    return with_unit(fixed(value, 3), unit)
