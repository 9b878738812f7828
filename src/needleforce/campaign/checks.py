# SPDX-License-Identifier: Apache-2.0
"""What is odd in a recording whatever its repeats are.

A force of the wrong sign, and one that is saturated up to the puncture, make the parameters meaningless: such a
recording is left out of the pooled fit. Saturation elsewhere, dropped samples, a drifting baseline and a speed that
its label contradicts are told, and it stays: the fit rests on what is sound in it.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from ..recording import Recording
from ..segmentation import Events
from ..segmentation.segment import FALL_DEPTH
from .anomaly import Oddity, shown
from .summary import Observed

SIGN_NOISE = 5.0  # by so many noises a mean force counts as a push or a pull
GAP = 10.0  # median steps: an insertion robot's usual stalls are shorter
LOST = 0.05  # share of all samples that gaps may swallow
DRIFT_NOISE, DRIFT_PEAK = 5.0, 0.05  # a baseline drifts by more than both, of its noise and of the peak
SPEED_LABEL = 0.1  # a stage keeps its nominal speed better than that
SPEED_FIELD = "speed_mm_s"


def oddities_alone(recording: Recording, events: Events, seen: Observed, fields: Mapping[str, str]) -> Iterator[Oddity]:
    """Each with its sentence; nothing for a sound recording."""
    yield from _sign(recording, seen)
    yield from _saturated(events, seen)
    yield from _dropped(seen)
    yield from _drift(seen)
    yield from _speed_label(seen, fields)


def _sign(recording: Recording, seen: Observed) -> Iterator[Oddity]:
    """Negative on the way in and positive on the way out; without a way out, what reading saw."""
    least = SIGN_NOISE * seen.noise if seen.noise > 0.0 else 0.0
    unseen = np.isnan(seen.pull) and any(note.kind == "sign" for note in recording.notes)
    if seen.push < -least and (seen.pull > least or unseen):
        said = f"The force has the wrong sign: on average {shown(seen.push, 'N')} on the way in"
        said += "" if unseen else f" and {shown(seen.pull, 'N')} on the way out"
        said += ", but + opposes insertion. Give --unit force=-N."
        yield Oddity("sign", "peak_force", seen.push, float("nan"), "N", said, left_out=True)


def _saturated(events: Events, seen: Observed) -> Iterator[Oddity]:
    if not seen.flat:
        return
    deformation = next(iter(events.spans("deformation")), None)
    before = deformation is None or not events.punctures or seen.flat_ends - seen.flat <= deformation.last
    said = f"The force is saturated: {seen.flat} samples in a row stand at its extreme of {shown(seen.peak, 'N')} "
    said += "while the needle moves" + (", up to the puncture" if before else ", beyond the puncture")
    said += ". Record again with a greater range of the sensor."
    yield Oddity("saturated", "peak_force", seen.peak, float("nan"), "N", said, left_out=before)


def _dropped(seen: Observed) -> Iterator[Oddity]:
    blind = seen.gap * seen.speed
    if seen.gap > GAP * seen.step or (seen.gap > 3.0 * seen.step and blind > FALL_DEPTH) or seen.lost > LOST:
        said = f"Samples were dropped: the longest gap is {shown(seen.gap, 's')}, the median step {seen.step:.3g} s, "
        said += f"and {100 * seen.lost:.2g} % of the samples are missing"
        said += f"; a puncture within the {shown(blind, 'm')} of such a gap is not seen." if blind > FALL_DEPTH else "."
        yield Oddity("dropped", "longest_gap", seen.gap, seen.step, "s", said)


def _drift(seen: Observed) -> Iterator[Oddity]:
    if abs(seen.drift) > max(DRIFT_NOISE * seen.noise, DRIFT_PEAK * seen.peak):
        said = f"The baseline drifts: {shown(seen.before, 'N')} before the contact, {shown(seen.after, 'N')} after "
        said += f"the exit, of a greatest force of {shown(seen.peak, 'N')}. Let the sensor warm up, or zero it."
        yield Oddity("drift", "drift", seen.drift, 0.0, "N", said)


def _speed_label(seen: Observed, fields: Mapping[str, str]) -> Iterator[Oddity]:
    """Only a field in mm/s can be held against the motion."""
    try:
        labelled = 1e-3 * float(fields.get(SPEED_FIELD, "nan"))
    except ValueError:
        return
    if labelled > 0.0 and abs(seen.speed / labelled - 1.0) > SPEED_LABEL:
        said = f"The label is wrong or the motion is: {SPEED_FIELD} says {shown(labelled, 'm/s')}, but the needle "
        said += f"goes in at {shown(seen.speed, 'm/s')}."
        yield Oddity("label", "speed", seen.speed, labelled, "m/s", said)
