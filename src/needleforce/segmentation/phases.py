# SPDX-License-Identifier: Apache-2.0
"""The phases of a recording as spans that follow each other without gap."""

import numpy as np

from ..vocabulary import Phase
from .events import Span
from .insertion import Insertion


def phases(time: np.ndarray, insertions: list[Insertion]) -> tuple[Span, ...]:
    """Spans over the (n,) times from the first to the last sample; empty ones are left out.

    Deformation ends at the first puncture. Without one it lasts as long as the stroke, but in a later insertion of the
    same recording: the needle may follow a hole, so that stroke is insertion throughout.
    """
    marks: list[tuple[int, Phase]] = [(0, Phase.free)]
    for number, each in enumerate(insertions):
        if each.contact is not None:
            marks += _marks(time, each, later=number > 0)
    ends = [first for first, _ in marks[1:]] + [len(time)]
    return tuple(
        Span(phase, float(time[first]), float(time[last - 1]), first, last)
        for (first, phase), last in zip(marks, ends, strict=True)
        if last > first
    )


def _marks(time: np.ndarray, each: Insertion, later: bool) -> list[tuple[int, Phase]]:
    """Where each phase of one insertion begins, in samples."""
    cycle = each.cycle
    contact = min(int(np.searchsorted(time, each.contact.time)), cycle.stop)
    pierced = contact if later else cycle.stop
    if each.punctures:
        pierced = int(np.searchsorted(time, each.punctures[0].time))
    out = len(time) if not cycle.withdrawn else cycle.end
    left = out if each.exit is None else int(np.searchsorted(time, each.exit.time))
    return [
        (contact, Phase.deformation),
        (pierced, Phase.insertion),
        (cycle.stop, Phase.hold),
        (cycle.leave, Phase.extraction),
        (left, Phase.free),
    ]
