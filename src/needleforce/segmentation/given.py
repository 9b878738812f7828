# SPDX-License-Identifier: Apache-2.0
"""Events that were given by their times, in the place of those found in one insertion."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..recording.recording import GivenEvents
from .cycle_events import MAX_GRADUAL_TRAVEL_M, CycleEvents
from .events import Event, Puncture
from .strokes import white_noise

MIN_FREE = 5  # samples before a given contact, of which the median is the zero of the force
GIVEN = "Given, not found: {}."


def with_given(
    found: Sequence[CycleEvents], given: GivenEvents, time: np.ndarray, depth: np.ndarray, force: np.ndarray
) -> tuple[int, CycleEvents, str]:
    """The number of the insertion that the given events are of, this insertion with them, and a sentence on them.

    A given time at which the same event was found changes nothing of it. Of another one the force is that of its
    sample, and of a puncture the fall that to the lowest force within 1 mm, before the next event and the hold.
    Times outside the strokes of the insertion are those of its first or last sample.
    """
    times = [each for each in (*(given.punctures or ()), given.contact, given.exit) if each is not None]
    if times:
        number = min(range(len(found)), key=lambda k: _distance(found[k], _sample(time, times[0])))
    else:
        number = max(range(len(found)), key=lambda k: (bool(found[k].punctures), found[k].contact is not None, -k))
    one = _with_contact(found[number], given, time, depth, force)
    if given.punctures is not None and one.contact is not None:
        one = _with_punctures(one, given.punctures, time, depth, force)
    if given.exit is not None and one.cycle.withdrawn and (one.exit is None or one.exit.time != given.exit):
        k = min(max(_sample(time, given.exit), one.cycle.withdrawal_start), one.cycle.end - 1)
        one = replace(one, exit=_event(k, time, depth, force))
    what = {"contact": given.contact, "punctures": given.punctures, "exit": given.exit}
    return number, one, GIVEN.format(", ".join(name for name, each in what.items() if each is not None))


def _sample(time: np.ndarray, at: float) -> int:
    """The number of the sample nearest to a time."""
    k = int(np.searchsorted(time, at))
    return min(k, len(time) - 1) if k == 0 or (k < len(time) and time[k] - at <= at - time[k - 1]) else k - 1


def _distance(one: CycleEvents, sample: int) -> int:
    """Samples from an insertion to a sample, 0 within it."""
    return max(one.cycle.start - sample, sample - one.cycle.end + 1, 0)


def _event(k: int, time: np.ndarray, depth: np.ndarray, force: np.ndarray) -> Event:
    return Event(float(time[k]), float(depth[k]), float(force[k]), max(k - 1, 0), k)


def _with_contact(
    one: CycleEvents, given: GivenEvents, time: np.ndarray, depth: np.ndarray, force: np.ndarray
) -> CycleEvents:
    if given.contact is None or (one.contact is not None and one.contact.time == given.contact):
        return one
    start, stop = one.cycle.start, one.cycle.stop
    k = min(max(_sample(time, given.contact), start), stop - 1)
    free = k - start >= MIN_FREE
    contact = _event(k, time, depth, force)
    return replace(
        one,
        contact=contact,
        punctures=tuple(replace(each, indentation=each.depth - contact.depth) for each in one.punctures),
        free=free,
        in_contact=k == start,
        baseline=float(np.median(force[start:k])) if free else None,
        noise=one.noise or white_noise(force[start:stop]),
    )


def _with_punctures(
    one: CycleEvents, times: Sequence[float], time: np.ndarray, depth: np.ndarray, force: np.ndarray
) -> CycleEvents:
    known = {each.time: each for each in (*one.punctures, *one.minor)}
    first, stop = one.cycle.start, one.cycle.stop
    samples = [min(max(_sample(time, each), first), stop - 1) for each in times]
    ends = [*samples[1:], stop]
    made = [
        known.get(float(time[k])) or _puncture(range(k, end), one.contact, time, depth, force)
        for k, end in zip(samples, ends)
    ]
    minor = tuple(each for each in (*one.punctures, *one.minor) if each not in made)
    return replace(one, punctures=tuple(made), minor=tuple(sorted(minor, key=lambda each: each.time)))


def _puncture(span: range, contact: Event, time: np.ndarray, depth: np.ndarray, force: np.ndarray) -> Puncture:
    """The puncture whose peak is the first sample of a span, with its fall within the span."""
    k, end = span.start, span.stop
    far = np.flatnonzero(depth[k:end] > depth[k] + MAX_GRADUAL_TRAVEL_M)
    reach = k + int(far[0]) if len(far) else end
    lowest = k + int(np.argmin(force[k : max(reach, k + 1)]))
    return Puncture(
        time=float(time[k]),
        depth=float(depth[k]),
        force=float(force[k]),
        low=max(k - 1, 0),
        high=min(k + 1, len(time) - 1),
        drop=float(force[k] - force[lowest]),
        indentation=float(depth[k] - contact.depth),
        end=lowest,
        end_depth=float(depth[lowest]),
    )
