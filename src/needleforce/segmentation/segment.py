# SPDX-License-Identifier: Apache-2.0
"""Segmentation of a recording into events and phases: contact and punctures of the insertion stroke, exit of the
withdrawal stroke, and whether the recording is complete."""

import math
from dataclasses import dataclass, replace
from numbers import Integral

import numpy as np

from ..errors import InputError
from ..recording.force_signal import glitches, spikes
from ..recording.source import RecordingSource, recording_of
from ..vocabulary import Phase, Status
from .contact import CROSSING_SIGMA, MAX_BASELINE_CHANGE, Onset, exit_depth, only_drift, onset, returned
from .events import Event, Events, Puncture, Span
from .punctures import DROP_OF_PEAK, force_drops, locate
from .strokes import Cycle, blocks, cycles

RUPTURE_TRAVEL_M = 0.3e-3  # [m] travel during a rupture
MIN_RUPTURE_TIME_S = 0.03  # [s] minimum duration of a rupture at any speed: needle and sensor oscillate
MIN_RUPTURE_SAMPLES = 5  # minimum number of samples of a rupture
BLOCKS_PER_RUPTURE = 10
NEGLIGIBLE_DRIFT_SHARE = 1e-3  # of the maximum force: a smaller drift is not corrected
NO_EXIT_TENSION = "The needle is back at the contact depth, but no tension during withdrawal shows the exit."
NOT_AT_BASELINE = "The needle is back at the contact depth, but the force is not at its baseline: no exit is found."
WITHDRAWAL_INCOMPLETE = "The withdrawal ends below the contact depth: the recording is incomplete."
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
        Smallest drop of the force at a puncture, as a share of its peak, 0 to 1.
    within : float
        Travel [m] within which a rupture is complete, 0 to 1.
    cycle : int
        The insertion whose events are returned: 0 is the first with contact, and larger numbers than the last one mean
        the last. The phases are those of all insertions.

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
    is traced back to its origin by a fit. Puncture: within a third of ``within`` the force drops by more than ``drop``
    times its peak, 3 % of the maximum force of the stroke, and the ripple of the free travel. Exit: during withdrawal
    the force returns to its baseline and remains there. ``low`` and ``high`` of an event are samples that bound it.
    """
    check(crossing, drop, within, cycle)
    recording = recording_of(recording)
    time, depth, force = recording.time, recording.depth, recording.force
    fault = unreadable(time, depth, force)
    if fault:
        return Events(status=Status.unreadable, notes=(fault,))
    options = {"crossing": crossing, "drop": drop, "within": within}
    options["filter_length"] = max(recording.card.filter_length, 1)
    found = [
        cycle_events(time, depth, force, each, limits(**options, rate=recording.rate, speed=each.speed))
        for each in cycles(time, depth)
    ]
    touching = [each for each in found if each.contact is not None]
    spans = phases(time, touching)
    if not touching:
        return Events(phases=spans, status=Status.no_contact, notes=(no_contact(time, force, bool(found)),))
    chosen = touching[min(cycle, len(touching) - 1)]
    status, notes = status_of(chosen, len(touching), depth, force)
    return Events(
        contact=chosen.contact,
        punctures=chosen.punctures,
        exit=chosen.exit,
        phases=spans,
        status=status,
        notes=notes,
    )


@dataclass(frozen=True, kw_only=True)
class CycleEvents:
    """The events of one cycle, with ``baseline`` and ``noise`` [N]; ``exit`` is None if the force does not show it."""

    cycle: Cycle
    contact: Event | None = None
    punctures: tuple[Puncture, ...] = ()
    exit: Event | None = None
    free: bool = True
    baseline: float = 0.0
    noise: float = 0.0


@dataclass(frozen=True)
class DetectionLimits:
    """``crossing`` [sd] of a contact, ``drop`` (share of the peak) and ``window`` [samples] of a puncture, and the
    filter's ``lag`` [samples]."""

    crossing: float
    drop: float
    window: int
    lag: int

    @property
    def size(self) -> int:
        """Samples per block."""
        return max(1, self.window // BLOCKS_PER_RUPTURE)


def limits(
    *, crossing: float, drop: float, within: float, rate: float, speed: float, filter_length: int
) -> DetectionLimits:
    """Limits for a rupture over ``within`` [m] at ``speed`` [m/s], at least as long as sensor, filter and ``rate`` [Hz]
    require."""
    window = int(max(within / speed * rate, MIN_RUPTURE_TIME_S * rate, MIN_RUPTURE_SAMPLES)) + filter_length - 1
    return DetectionLimits(crossing, drop, window, filter_length - 1)


def cycle_events(
    time: np.ndarray, depth: np.ndarray, force: np.ndarray, cycle: Cycle, allowed: DetectionLimits
) -> CycleEvents:
    """The events of ``cycle`` in (n,) arrays of time [s], depth [m] and force [N]."""
    begin, last = _ends(time, depth, force, cycle, allowed)
    if begin is None:
        return CycleEvents(cycle=cycle)
    window, size = allowed.window, allowed.size
    contact = _event(time, depth, force, begin, allowed.lag)
    stroke = blocks(depth, force, cycle.start, cycle.stop, size)
    free = (begin.low - stroke.first) // size
    found = force_drops(
        stroke,
        window=-(-window // size),
        free=free,
        baseline=begin.baseline,
        noise=begin.noise,
        fraction=allowed.drop,
    )
    punctures = []
    for a, b in found:
        drop = locate(force, stroke.sample(a), stroke.sample(b + 1), size=size, window=window, noise=begin.noise)
        peak_depth = float(depth[drop.peak])
        punctures.append(
            Puncture(
                time=float(time[drop.peak]),
                depth=peak_depth,
                force=drop.force,
                low=max(drop.low - allowed.lag, 0),
                high=drop.high,
                drop=drop.drop,
                indentation=peak_depth - contact.depth,
            )
        )
    return CycleEvents(
        cycle=cycle,
        contact=contact,
        punctures=tuple(punctures),
        exit=None if last is None else _event(time, depth, force, last, allowed.lag),
        free=begin.free,
        baseline=begin.baseline,
        noise=begin.noise,
    )


def _event(time: np.ndarray, depth: np.ndarray, force: np.ndarray, where: Onset, lag: int) -> Event:
    """``where`` as an event at the first sample past its depth; a filter may delay it by ``lag`` samples."""
    low, high = max(where.low - lag, 0), min(where.high, len(depth) - 1)
    between = depth[low : high + 1]
    passed = np.flatnonzero(between >= where.depth if depth[high] >= depth[low] else between <= where.depth)
    at = low + int(passed[0]) if len(passed) else high
    return Event(float(time[at]), float(where.depth), float(force[at]), low, high)


def _ends(
    time: np.ndarray, depth: np.ndarray, force: np.ndarray, cycle: Cycle, allowed: DetectionLimits
) -> tuple[Onset | None, Onset | None]:
    """Contact and exit with ``low`` and ``high`` as samples; both are determined again after the drift between them is
    subtracted."""
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
    if abs(drift) <= max(begin.noise, NEGLIGIBLE_DRIFT_SHARE * peak):
        return begin, last
    before, after = time[(cycle.start + begin.low) // 2], time[(last.high + cycle.end - 1) // 2]
    level = force - drift * (time - before) / (after - before)
    again = _contact(depth, level, cycle, allowed), exit_depth(depth, level, cycle, allowed.size, allowed.crossing)
    return again if None not in again else (begin, last)


def _contact(depth: np.ndarray, force: np.ndarray, cycle: Cycle, allowed: DetectionLimits) -> Onset | None:
    """The contact of the insertion stroke, with blocks converted to samples."""
    stroke = blocks(depth, force, cycle.start, cycle.stop, allowed.size)
    found = onset(stroke, allowed.crossing)
    return None if found is None else replace(found, low=stroke.sample(found.low), high=stroke.sample(found.high + 1))


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
    pierced = contact if later else cycle.stop
    if each.punctures:
        pierced = int(np.searchsorted(time, each.punctures[0].time))
    out = len(time) if not cycle.withdrawn else cycle.end
    left = out if each.exit is None else int(np.searchsorted(time, each.exit.time))
    return [
        (contact, Phase.deformation),
        (pierced, Phase.insertion),
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


def unreadable(time: np.ndarray, depth: np.ndarray, force: np.ndarray) -> str:
    """Why (n,) time, depth and force cannot be segmented; empty if they can."""
    if not all(np.isfinite(values).all() for values in (time, depth, force)):
        return "The recording contains values that are not finite."
    return "" if (np.diff(time) > 0.0).all() else "The time does not increase from sample to sample."


def no_contact(time: np.ndarray, force: np.ndarray, moved: bool) -> str:
    """Why there is no contact: the needle did not move, or the force does not show it."""
    if not moved:
        return "The depth never increases: the needle does not move inwards."
    found = glitches(force)
    if not len(found):
        return "The force never exceeds the noise of its baseline: there is no contact."
    return f"No contact is detected because of a glitch: {spikes(time, force, found)}. Remove such samples."


def status_of(chosen: CycleEvents, count: int, depth: np.ndarray, force: np.ndarray) -> tuple[Status, tuple[str, ...]]:
    """The status of one of ``count`` insertions in (n,) depth and force, and notes for the user."""
    notes = [] if chosen.free else ["There is too little free travel before the contact: its depth is uncertain."]
    if count > 1:
        notes.append(f"There are {count} insertions; the events are those of one of them.")
    if not chosen.punctures:
        notes.append("There is no puncture.")
    complete = Status.ok if chosen.punctures else Status.no_puncture
    if chosen.exit is not None:
        return complete, tuple(notes)
    missing = _no_exit(chosen, depth, force)
    return (complete if missing == NO_EXIT_TENSION else Status.incomplete), (*notes, missing)


def _no_exit(chosen: CycleEvents, depth: np.ndarray, force: np.ndarray) -> str:
    """Why there is no exit: no withdrawal, an incomplete one, or an exit that the force does not show."""
    cycle, contact = chosen.cycle, chosen.contact
    if not cycle.withdrawn:
        return "There is no withdrawal: the recording is incomplete."
    back = np.flatnonzero(depth[cycle.withdrawal_start : cycle.end] <= contact.depth)
    if not len(back):
        return WITHDRAWAL_INCOMPLETE
    change = abs(float(np.median(force[cycle.withdrawal_start + back])) - chosen.baseline)
    peak = float(np.max(np.abs(force[cycle.start : cycle.stop] - chosen.baseline)))
    return NO_EXIT_TENSION if change <= max(5.0 * chosen.noise, MAX_BASELINE_CHANGE * peak) else NOT_AT_BASELINE
