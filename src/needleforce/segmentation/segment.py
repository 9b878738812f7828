# SPDX-License-Identifier: Apache-2.0
"""A recording cut into its events and phases: contact and punctures of the insertion stroke, exit of the withdrawal
stroke, and whether the recording is whole."""

import math
from dataclasses import dataclass, replace
from numbers import Integral

import numpy as np

from ..errors import InputError
from ..recording.force_signal import glitches, spikes
from ..recording.recording import Recording
from ..vocabulary import Phase, Status
from .contact import CROSSING, SAME_BASELINE, Onset, exit_depth, only_drift, onset, returned
from .events import Event, Events, Puncture, Span
from .punctures import FALL_PEAK, falls, locate
from .strokes import Cycle, blocks, cycles

FALL_DEPTH = 0.3e-3  # [m]
FALL_TIME = 0.03  # [s] a fall may last so long however fast the stroke: needle and sensor swing
FALL_SAMPLES = 5  # or so many samples
BLOCKS_PER_FALL = 10
SMALL_DRIFT = 1e-3  # of the greatest force: less is left alone
NO_PULL = "The needle is out, but no pull on the way shows where it left the tissue: there is no exit."
STUCK = "The needle is back at the contact depth, but the force is not at its baseline: no exit is found."
CUT_OFF = "The withdrawal ends below the contact depth: the recording is cut off."
FURTHEST = 1.0  # [m] no rupture takes longer


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
        cycle_events(time, depth, force, each, limits(crossing, drop, within, recording.rate, each.speed, length))
        for each in strokes
    ]
    touching = [each for each in found if each.contact is not None]
    spans = phases(time, touching)
    if not touching:
        return Events(phases=spans, status=Status.no_contact, notes=(no_contact(time, force, bool(found)),))
    chosen = touching[min(cycle, len(touching) - 1)]
    status, notes = status_of(chosen, len(touching), depth, force)
    return Events(chosen.contact, chosen.punctures, chosen.exit, spans, status, notes)


@dataclass(frozen=True)
class CycleEvents:
    """What one cycle holds above ``baseline`` and ``noise`` [N]; ``exit`` is ``None`` where the force shows none."""

    cycle: Cycle
    contact: Event | None = None
    punctures: tuple[Puncture, ...] = ()
    exit: Event | None = None
    free: bool = True
    baseline: float = 0.0
    noise: float = 0.0


@dataclass(frozen=True)
class DetectionLimits:
    """``crossing`` [sd] of a contact, ``drop`` (of its peak) and ``window`` of a fall, filter ``lag`` [samples]."""

    crossing: float
    drop: float
    window: int
    lag: int

    @property
    def size(self) -> int:
        """How many samples make a block."""
        return max(1, self.window // BLOCKS_PER_FALL)


def limits(
    crossing: float, drop: float, within: float, rate: float, speed: float, filter_length: int
) -> DetectionLimits:
    """For a fall over ``within`` [m] at ``speed`` [m/s], or for as long as sensor, filter and ``rate`` [Hz] take."""
    window = int(max(within / speed * rate, FALL_TIME * rate, FALL_SAMPLES)) + filter_length - 1
    return DetectionLimits(crossing, drop, window, filter_length - 1)


def cycle_events(
    time: np.ndarray, depth: np.ndarray, force: np.ndarray, cycle: Cycle, allowed: DetectionLimits
) -> CycleEvents:
    """The events of ``cycle`` in (n,) arrays of time [s], depth [m] and force [N]."""
    begin, last = _ends(time, depth, force, cycle, allowed)
    if begin is None:
        return CycleEvents(cycle)
    window, size = allowed.window, allowed.size
    contact = _event(time, depth, force, begin, allowed.lag)
    stroke = blocks(depth, force, cycle.start, cycle.stop, size)
    free = (begin.low - stroke.first) // size
    found = falls(stroke, -(-window // size), free, begin.baseline, begin.noise, allowed.drop)
    punctures = []
    for a, b in found:
        fall = locate(force, stroke.sample(a), stroke.sample(b + 1), size, window, begin.noise)
        low, place = max(fall.low - allowed.lag, 0), float(depth[fall.peak])
        punctures.append(
            Puncture(float(time[fall.peak]), place, fall.force, low, fall.high, fall.drop, place - contact.depth)
        )
    leaving = None if last is None else _event(time, depth, force, last, allowed.lag)
    return CycleEvents(cycle, contact, tuple(punctures), leaving, begin.free, begin.baseline, begin.noise)


def _event(time: np.ndarray, depth: np.ndarray, force: np.ndarray, where: Onset, lag: int) -> Event:
    """``where`` as an event, at the first sample past its depth; a filter may have shown it ``lag`` samples late."""
    low, high = max(where.low - lag, 0), min(where.high, len(depth) - 1)
    between = depth[low : high + 1]
    passed = np.flatnonzero(between >= where.depth if depth[high] >= depth[low] else between <= where.depth)
    at = low + int(passed[0]) if len(passed) else high
    return Event(float(time[at]), float(where.depth), float(force[at]), low, high)


def _ends(
    time: np.ndarray, depth: np.ndarray, force: np.ndarray, cycle: Cycle, allowed: DetectionLimits
) -> tuple[Onset | None, Onset | None]:
    """Contact and exit, ``low`` and ``high`` as samples; both are sought again without the drift between them."""
    span = slice(cycle.start, cycle.end)
    if cycle.withdrawn and only_drift(time[span], force[span], allowed.size):
        return None, None
    begin, last = _contact(depth, force, cycle, allowed), None
    if begin is None or not cycle.withdrawn:
        return begin, None
    last = exit_depth(depth, force, cycle, allowed.size, allowed.crossing)
    peak = float(np.max(np.abs(force[span] - begin.baseline)))
    if last is None or not returned(begin, last, float(depth[cycle.stop - 1]), peak):
        return begin, None
    drift = last.baseline - begin.baseline
    if abs(drift) <= max(begin.noise, SMALL_DRIFT * peak):
        return begin, last
    before, after = time[(cycle.start + begin.low) // 2], time[(last.high + cycle.end - 1) // 2]
    level = force - drift * (time - before) / (after - before)
    again = _contact(depth, level, cycle, allowed), exit_depth(depth, level, cycle, allowed.size, allowed.crossing)
    return again if None not in again else (begin, last)


def _contact(depth: np.ndarray, force: np.ndarray, cycle: Cycle, allowed: DetectionLimits) -> Onset | None:
    """The contact of the inward stroke, its blocks turned into samples."""
    stroke = blocks(depth, force, cycle.start, cycle.stop, allowed.size)
    found = onset(stroke, allowed.crossing)
    return None if found is None else replace(found, low=stroke.sample(found.low), high=stroke.sample(found.high + 1))


def phases(time: np.ndarray, insertions: list[CycleEvents]) -> tuple[Span, ...]:
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


def _marks(time: np.ndarray, each: CycleEvents, later: bool) -> list[tuple[int, Phase]]:
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


def check(crossing: float, drop: float, within: float, cycle: int) -> None:
    """Raise InputError for options of ``segment`` that are out of range."""
    for name, value, low, high in (
        ("crossing", crossing, 0.0, math.inf), ("drop", drop, 0.0, 1.0), ("within", within, 0.0, FURTHEST)
    ):  # fmt: skip
        if not (isinstance(value, (int, float, np.number)) and low <= value <= high):
            raise InputError(name, repr(value), f"a number from {low:g} to {high:g} is needed", "segment")
    if not isinstance(cycle, Integral) or cycle < 0:
        raise InputError(
            "cycle", repr(cycle), "a whole number from 0 is needed", "segment", "0 is the first insertion."
        )


def unreadable(time: np.ndarray, depth: np.ndarray, force: np.ndarray) -> str:
    """Why (n,) time, depth and force make no recording; empty if they do."""
    if not all(np.isfinite(values).all() for values in (time, depth, force)):
        return "The recording holds values that are not finite."
    return "" if (np.diff(time) > 0.0).all() else "The time does not increase from sample to sample."


def no_contact(time: np.ndarray, force: np.ndarray, moved: bool) -> str:
    """Why there is no contact: the needle did not move, or the force tells none."""
    if not moved:
        return "The depth never moves inwards."
    found = glitches(force)
    if not len(found):
        return "The force never leaves its baseline."
    return f"No contact is seen beside a glitch: {spikes(time, force, found)}. Remove such samples and try again."


def status_of(chosen: CycleEvents, count: int, depth: np.ndarray, force: np.ndarray) -> tuple[Status, tuple[str, ...]]:
    """The status of one of ``count`` insertions in (n,) depth and force, and what its reader should know."""
    notes = [] if chosen.free else ["There is hardly any free travel before the contact: its depth is doubtful."]
    if count > 1:
        notes.append(f"There are {count} insertions; the events are those of one of them.")
    if not chosen.punctures:
        notes.append("There is no puncture.")
    complete = Status.ok if chosen.punctures else Status.no_puncture
    if chosen.exit is not None:
        return complete, tuple(notes)
    missing = _no_exit(chosen, depth, force)
    return (complete if missing == NO_PULL else Status.incomplete), (*notes, missing)


def _no_exit(chosen: CycleEvents, depth: np.ndarray, force: np.ndarray) -> str:
    """Why there is no exit: no withdrawal, or one cut off, or none that shows in the force."""
    cycle, contact = chosen.cycle, chosen.contact
    if not cycle.withdrawn:
        return "There is no withdrawal: the recording is cut off."
    back = np.flatnonzero(depth[cycle.leave : cycle.end] <= contact.depth)
    if not len(back):
        return CUT_OFF
    change = abs(float(np.median(force[cycle.leave + back])) - chosen.baseline)
    peak = float(np.max(np.abs(force[cycle.start : cycle.stop] - chosen.baseline)))
    return NO_PULL if change <= max(5.0 * chosen.noise, SAME_BASELINE * peak) else STUCK
