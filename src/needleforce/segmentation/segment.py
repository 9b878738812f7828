# SPDX-License-Identifier: Apache-2.0
"""Segmentation of a recording into events and phases: contact and punctures of the insertion stroke, exit of the
withdrawal stroke, and whether the recording is complete."""

import math
from numbers import Integral

import numpy as np

from .. import core
from ..errors import InputError
from ..recording.force_signal import outliers, quantum_of, without_outliers
from ..recording.recording import Recording
from ..recording.source import RecordingSource, recording_of
from ..vocabulary import Phase, Status
from .contact import CROSSING_SIGMA, MAX_BASELINE_CHANGE
from .cycle_events import CycleEvents, cycle_events, limits
from .doubtful import baseline_step, doubtful, no_contact, unreadable
from .events import Events, Span
from .strokes import cycles, insertions, stands, updated_depth

RUPTURE_TRAVEL_M = 0.3e-3  # [m] travel during a rupture
DROP_OF_PEAK = 0.1  # of the force at the peak, in a stroke that is rough
NO_PUNCTURE = "There is no puncture."
NO_EXIT_TENSION = "The needle is back at the contact depth, but no tension during withdrawal shows the exit."
NOT_AT_BASELINE = "The needle is back at the contact depth, but the force is not at its baseline: no exit is found."
WITHDRAWAL_INCOMPLETE = "The withdrawal ends below the contact depth: the recording is incomplete."
LITTLE_FREE_TRAVEL = "There is too little free travel before the contact: its depth is uncertain."
IN_CONTACT = (
    "The recording begins in contact, or just before it: the contact is not later than given, and the zero of the "
    "force is not shown."
)
MAX_RUPTURE_TRAVEL_M = 1.0  # [m] largest travel of a rupture that may be given


def segment(
    recording: RecordingSource,
    *,
    crossing: float = CROSSING_SIGMA,
    drop: float = DROP_OF_PEAK,
    within: float = RUPTURE_TRAVEL_M,
    cycle: int = 0,
) -> Events:
    """Find contact, punctures, exit and phases of a recording.

    Parameters
    ----------
    recording : Recording, path, DataFrame, mapping of columns, or arrays (time, depth, force)
        The recording; a file is read as by ``nf.read``.
    crossing : float
        Height of a contact above the baseline, in standard deviations of the free travel's noise, >= 0.
    drop : float
        Smallest drop at a puncture in a stroke that is rougher than the noise, as a share of the force, 0 to 1.
    within : float
        Travel [m] of a sudden rupture, 0 to 1.
    cycle : int
        The insertion whose events are returned: 0 is the first with a puncture, or with contact if none has one, and
        larger numbers than the last one mean the last. The phases are those of all insertions.

    Returns
    -------
    Events
        Missing events are None; ``status`` and ``notes`` give the reason. Forces include the bias of the recording.

    Raises
    ------
    InputError
        An option is out of range, or a file cannot be read. No content of a recording raises an error.

    Notes
    -----
    Contact: the force exceeds the mean of the free travel by ``crossing`` standard deviations for 10 samples; the rise
    is traced back to its origin by a fit. Without free travel the contact is not later than given.

    Puncture: a fall of the force at the cut, where the needle is deeper than ever before, that noise explains at most
    once in 1000 recordings (0 of 2000 measured). Windows of several lengths before and after every place are compared,
    also with a gap for gradual ruptures of up to 1 mm. The noise is that of the free travel with its correlation, or of
    the differences of the stroke without it, at least that of the sensor's quantum; where the stroke itself fluctuates
    more, its fluctuation counts. A steady decline, a regular oscillation, a fall in proportion to the speed, what a
    rest relaxes, and what comes back after a pull-back are no punctures. In a stroke that is rougher than the noise, a
    tissue with texture, a puncture also falls by ``drop`` times the force within a third of ``within``, or over more at
    the end of a rise by that times the root of the longer distance, or by what noise with the tails of Student's t (4
    degrees of freedom) does not explain either. Other falls are in ``minor``: 0 for ``drop`` counts them all.

    Exit: during withdrawal the force returns to its baseline and remains there. ``low`` and ``high`` of an event are
    samples that bound it. Pull-backs and pauses are part of one insertion as long as the needle stays in the tissue.
    Outliers, one in 1000 recordings by chance, are replaced by their neighbours. Events given by
    ``Recording.with_events`` take the place of those found in their insertion. The page on events has figures.
    """
    check(crossing, drop, within, cycle)
    recording = recording_of(recording)
    time, depth, force = recording.time, recording.depth, recording.force
    fault = unreadable(time, depth, force)
    if fault:
        return Events(status=Status.unreadable, notes=(fault,))
    depth, quantum = updated_depth(depth), quantum_of(force)
    spikes_at = outliers(force, quantum)
    clean = without_outliers(force, spikes_at)
    options = {"crossing": crossing, "drop": drop, "within": within, "rate": recording.rate if len(time) > 1 else 1.0}
    options |= {"filter_length": max(recording.card.filter_length, 1), "quantum": quantum}
    found = _insertions(time, depth, clean, options)
    remarks = (*_stand_notes(recording), *_outlier_note(spikes_at))
    chosen, sentences = _put_given(found, recording, clean)
    remarks = (*sentences, *remarks)
    touching = [each for each in found if each.contact is not None]
    spans = phases(time, touching)
    if not touching:
        notes = (no_contact(time, depth, force, quantum, moved=bool(found)), *remarks)
        return Events(phases=spans, status=Status.no_contact, notes=notes, outliers=spikes_at)
    first = next((number for number, each in enumerate(touching) if each.punctures), 0)
    if chosen not in touching:
        chosen = touching[min(first + cycle, len(touching) - 1)]
    status, notes = status_of(chosen, len(touching), depth, clean)
    if step := baseline_step(time, clean, quantum, stop=int(np.searchsorted(time, chosen.contact.time))):
        remarks += (step,)
    reason = () if chosen.punctures else (NO_PUNCTURE,)
    return Events(
        contact=chosen.contact,
        punctures=chosen.punctures,
        exit=chosen.exit,
        phases=spans,
        status=status,
        notes=(*reason, *doubtful(time, depth, clean, chosen, quantum), *notes, *remarks),
        minor=chosen.minor,
        outliers=spikes_at,
        baseline=chosen.baseline,
        noise=chosen.noise,
    )


def _insertions(time: np.ndarray, depth: np.ndarray, force: np.ndarray, options: dict) -> list[CycleEvents]:
    """The events of every insertion: the strokes by the depth, joined where the needle did not come out between."""
    events_of = lambda each: cycle_events(time, depth, force, each, limits(**options, speed=each.speed))  # noqa: E731
    found = [events_of(each) for each in cycles(time, depth)]
    surfaces = [float(depth[each.contact.high]) for each in found if each.contact is not None and not each.in_contact]
    if not surfaces:
        return found
    known = {(each.cycle.start, each.cycle.stop, each.cycle.end): each for each in found}
    again = insertions(time, depth, surfaces[0])
    return [known.get((each.start, each.stop, each.end)) or events_of(each) for each in again] or found


def _put_given(
    found: list[CycleEvents], recording: Recording, force: np.ndarray
) -> tuple[CycleEvents | None, tuple[str, ...]]:
    """Put the events that the recording was given into their insertion; this one, and a sentence, if there are any."""
    given = recording.card.given_events
    if given is None or not found:
        return None, ()
    from .given import with_given

    number, chosen, sentence = with_given(found, given, recording.time, updated_depth(recording.depth), force)
    found[number] = chosen
    return chosen, (sentence,)


def _stand_notes(recording: Recording) -> list[str]:
    """Sentences on the stretches in which the depth is not updated."""
    found, depth = [], recording.depth
    for first, last in stands(depth):
        change, duration = (float(values[last] - values[first]) for values in (recording.force, recording.time))
        found.append(
            f"The force {'rises' if change > 0.0 else 'falls'} by {abs(change):.3g} N while the depth stands at "
            f"{1e3 * depth[first]:.4g} mm for {duration:.2g} s and then jumps to {1e3 * depth[last]:.4g} mm, where the "
            "motion leads: it was not updated, and is taken for a straight line between."
        )
    return found


def _outlier_note(found: np.ndarray) -> tuple[str, ...]:
    """A sentence on the outliers, if there are any."""
    if not len(found):
        return ()
    what = (
        "1 sample of the force is an outlier" if len(found) == 1 else f"{len(found)} samples of the force are outliers"
    )
    return (f"{what}, far from the neighbours on both sides, and left out of the segmentation.",)


def phases(time: np.ndarray, insertions: list[CycleEvents]) -> tuple[Span, ...]:
    """Spans over the (n,) times from the first to the last sample; empty ones are left out.

    Deformation ends at the first puncture, or without one at the end of the stroke. A later stroke of the same
    recording without puncture is insertion throughout, because the needle may follow an existing hole.
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


def _marks(time: np.ndarray, each: CycleEvents, later: bool) -> list[tuple[int, Phase]]:
    """The first sample of each phase of one insertion."""
    cycle = each.cycle
    contact = min(int(np.searchsorted(time, each.contact.time)), cycle.stop)
    puncture = contact if later else cycle.stop
    if each.punctures:
        puncture = int(np.searchsorted(time, each.punctures[0].time))
    out = len(time) if not cycle.withdrawn else cycle.end
    left = out if each.exit is None else int(np.searchsorted(time, each.exit.time))
    return [
        (contact, Phase.deformation),
        (puncture, Phase.insertion),
        (cycle.stop, Phase.hold),
        (cycle.withdrawal_start, Phase.extraction),
        (left, Phase.free),
    ]


def check(crossing: float, drop: float, within: float, cycle: int) -> None:
    """Raise InputError for options of ``segment`` that are out of range."""
    for name, value, low, high in (
        ("crossing", crossing, 0.0, math.inf), ("drop", drop, 0.0, 1.0), ("within", within, 0.0, MAX_RUPTURE_TRAVEL_M)
    ):  # fmt: skip
        if not (isinstance(value, (int, float, np.number)) and low <= value <= high):
            raise InputError(name, repr(value), f"a number from {low:g} to {high:g} is needed", "segment")
    if not isinstance(cycle, Integral) or cycle < 0:
        limit = "an integer of at least 0 is needed"
        raise InputError("cycle", repr(cycle), limit, "segment", "Give 0 for the first insertion.")


def status_of(chosen: CycleEvents, count: int, depth: np.ndarray, force: np.ndarray) -> tuple[Status, tuple[str, ...]]:
    """The status of one of ``count`` insertions in (n,) depth and force, and notes for the user."""
    notes = [] if chosen.free else [IN_CONTACT if chosen.in_contact else LITTLE_FREE_TRAVEL]
    if count > 1:
        notes.append(f"There are {count} insertions; the events are those of one of them.")
    if len(chosen.minor) > chosen.oscillations:
        notes.append(_minor_note(len(chosen.minor) - chosen.oscillations))
    if chosen.oscillations:
        notes.append(
            f"The force oscillates regularly: {chosen.oscillations} falls of similar size and spacing are no punctures."
        )
    complete = Status.ok if chosen.punctures else Status.no_puncture
    if chosen.exit is not None:
        return complete, tuple(notes)
    missing = _no_exit(chosen, depth, force)
    return (complete if missing == NO_EXIT_TENSION else Status.incomplete), (*notes, missing)


def _minor_note(count: int) -> str:
    """A sentence on falls of the force that are no punctures."""
    what = "smaller fall of the force is" if count == 1 else "smaller falls of the force are"
    return f"{count} {what} significant, but within the texture of the tissue, and not counted as punctures (minor)."


def _no_exit(chosen: CycleEvents, depth: np.ndarray, force: np.ndarray) -> str:
    """Why there is no exit: no withdrawal, an incomplete one, or an exit that the force does not show."""
    cycle, contact = chosen.cycle, chosen.contact
    if not cycle.withdrawn:
        return "There is no withdrawal: the recording is incomplete."
    back = np.flatnonzero(depth[cycle.withdrawal_start : cycle.end] <= contact.depth)
    if not len(back):
        return WITHDRAWAL_INCOMPLETE
    level = force[chosen.contact.low] if chosen.baseline is None else chosen.baseline
    change = abs(core.median(force[cycle.withdrawal_start + back]) - level)
    peak = float(np.max(np.abs(force[cycle.start : cycle.stop] - level)))
    return NO_EXIT_TENSION if change <= max(5.0 * chosen.noise, MAX_BASELINE_CHANGE * peak) else NOT_AT_BASELINE
