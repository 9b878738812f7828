# SPDX-License-Identifier: Apache-2.0
"""A recording cut into its events and phases."""

from ..recording.recording import Recording
from ..vocabulary import Status
from .contact import CROSSING
from .events import Events
from .insertion import insertion, limits
from .judging import check, judge, no_contact, unreadable
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
    Raises InputError for options out of range alone.
    """
    check(crossing, drop, within, cycle)
    time, depth, force = recording.time, recording.depth, recording.force
    wrong = unreadable(time, depth, force)
    if wrong:
        return Events(status=Status.unreadable, notes=(wrong,))
    strokes, length = cycles(time, depth), max(recording.card.filter_length, 1)
    found = [
        insertion(time, depth, force, each, limits(crossing, drop, within, recording.rate, each.speed, length))
        for each in strokes
    ]
    touching = [each for each in found if each.contact is not None]
    spans = phases(time, touching)
    if not touching:
        return Events(phases=spans, status=Status.no_contact, notes=(no_contact(time, force, bool(found)),))
    chosen = touching[min(cycle, len(touching) - 1)]
    status, notes = judge(chosen, len(touching), depth, force)
    return Events(chosen.contact, chosen.punctures, chosen.exit, spans, status, notes)
