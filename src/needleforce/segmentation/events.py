# SPDX-License-Identifier: Apache-2.0
"""The result of segmentation: events with the samples that bound them, and phases as spans."""

from dataclasses import dataclass, field

from ..vocabulary import Phase, Status


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
    """

    drop: float
    indentation: float


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


@dataclass(frozen=True)
class Events:
    """The events and phases of one recording.

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
    """

    contact: Event | None = None
    punctures: tuple[Puncture, ...] = ()
    exit: Event | None = None
    phases: tuple[Span, ...] = ()
    status: Status = Status.ok
    notes: tuple[str, ...] = field(default=())

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
