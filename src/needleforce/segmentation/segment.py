# SPDX-License-Identifier: Apache-2.0
"""A recording cut into its events and phases."""

import numpy as np

from ..recording.recording import Recording
from ..vocabulary import Status
from .contact import CROSSING
from .events import Events
from .insertion import Insertion, insertion, limits
from .phases import phases
from .punctures import FALL_PEAK
from .strokes import cycles

FALL_DEPTH = 0.3e-3  # [m]


def segment(
    recording: Recording,
    *,
    crossing: float = CROSSING,
    drop: float = FALL_PEAK,
    within: float = FALL_DEPTH,
    cycle: int = 0,
) -> Events:
    """Contact, punctures, exit and phases of a recording.

    Contact: the force is ``crossing`` standard deviations of the free travel's noise above its mean for 10 samples,
    traced back to where it began to rise. Puncture: a rupture is over within the travel ``within`` [m], and in a third
    of it the force falls by ``drop`` of its peak, by 3 % of the stroke's greatest force, and by more than the free
    travel's ripples. Exit: on withdrawal the force is back at its baseline for good. Forces are those of the
    recording, its bias included; ``low`` and ``high`` are the samples between which an event surely lies.

    ``cycle`` says which insertion the events are of, 0 for the first that touches; the phases are those of all.
    Nothing a recording may hold raises an error: what is missing is ``None``, told in ``status`` and ``notes``.
    """
    time, depth, force = recording.time, recording.depth, recording.force
    if not all(np.isfinite(values).all() for values in (time, depth, force)):
        return Events(status=Status.unreadable, notes=("The recording holds values that are not finite.",))
    strokes, length = cycles(time, depth), max(recording.card.filter_length, 1)
    found = [
        insertion(time, depth, force, each, limits(crossing, drop, within, recording.rate, each.speed, length))
        for each in strokes
    ]
    touching = [each for each in found if each.contact is not None]
    spans = phases(time, touching)
    if not touching:
        why = "The force never leaves its baseline." if found else "The depth never moves inwards."
        return Events(phases=spans, status=Status.no_contact, notes=(why,))
    chosen = touching[min(cycle, len(touching) - 1)]
    status, notes = _judge(chosen, len(touching))
    return Events(chosen.contact, chosen.punctures, chosen.exit, spans, status, notes)


def _judge(chosen: Insertion, count: int) -> tuple[Status, tuple[str, ...]]:
    """The status of one insertion, and what its reader should know."""
    notes = [] if chosen.free else ["There is hardly any free travel before the contact: its depth is doubtful."]
    if count > 1:
        notes.append(f"There are {count} insertions; the events are those of one of them.")
    if not chosen.punctures:
        notes.append("There is no puncture.")
    if chosen.exit is None:
        kept = "The force does not come back to its baseline" if chosen.cycle.withdrawn else "There is no withdrawal"
        return Status.incomplete, (*notes, f"{kept}: the recording is cut off.")
    return (Status.ok if chosen.punctures else Status.no_puncture), tuple(notes)
