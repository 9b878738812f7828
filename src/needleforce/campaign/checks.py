# SPDX-License-Identifier: Apache-2.0
"""What is anomalous in a recording by itself, and the checks of several together."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ..recording import Recording
from ..segmentation import Events, segment
from ..segmentation.segment import FALL_DEPTH
from .anomaly import INVALIDATING, Anomaly, shown
from .repeat_checks import Repeat, repeat_anomalies
from .summary import RecordingSummary, summarise

SIGN_NOISE = 5.0  # by so many noises a mean force counts as a push or a pull
GAP = 10.0  # median steps: an insertion robot's usual stalls are shorter
LOST = 0.05  # share of all samples that gaps may swallow
DRIFT_NOISE, DRIFT_PEAK = 5.0, 0.05  # a baseline drifts by more than both, of its noise and of the peak
SPEED_LABEL = 0.1  # a stage keeps its nominal speed better than that
SPEED_FIELD = "speed_mm_s"
NO_FIELDS: Mapping[str, str] = {}


def recording_anomalies(
    recording: Recording, events: Events, seen: RecordingSummary, fields: Mapping[str, str]
) -> Iterator[Anomaly]:
    """Each with its sentence; nothing for a sound recording."""
    yield from _sign(recording, seen)
    yield from _saturated(events, seen)
    yield from _dropped(seen)
    yield from _drift(seen)
    yield from _speed_label(seen, fields)


def _sign(recording: Recording, seen: RecordingSummary) -> Iterator[Anomaly]:
    """Negative on the way in and positive on the way out; without a way out, what reading saw."""
    least = SIGN_NOISE * seen.noise if seen.noise > 0.0 else 0.0
    unseen = np.isnan(seen.pull) and any(note.kind == "sign" for note in recording.notes)
    if seen.push < -least and (seen.pull > least or unseen):
        said = f"The force has the wrong sign: on average {shown(seen.push, 'N')} on the way in"
        said += "" if unseen else f" and {shown(seen.pull, 'N')} on the way out"
        said += ", but + opposes insertion. Give --unit force=-N."
        yield Anomaly("sign", "peak_force", seen.push, float("nan"), "N", said, left_out=True)


def _saturated(events: Events, seen: RecordingSummary) -> Iterator[Anomaly]:
    if not seen.flat:
        return
    deformation = next(iter(events.spans("deformation")), None)
    before = deformation is None or not events.punctures or seen.flat_ends - seen.flat <= deformation.last
    said = f"The force is saturated: {seen.flat} samples in a row stand at its extreme of {shown(seen.peak, 'N')} "
    said += "while the needle moves" + (", up to the puncture" if before else ", beyond the puncture")
    said += ". Record again with a greater range of the sensor."
    yield Anomaly("saturated", "peak_force", seen.peak, float("nan"), "N", said, left_out=before)


def _dropped(seen: RecordingSummary) -> Iterator[Anomaly]:
    blind = seen.gap * seen.speed
    if seen.gap > GAP * seen.step or (seen.gap > 3.0 * seen.step and blind > FALL_DEPTH) or seen.lost > LOST:
        said = f"Samples were dropped: the longest gap is {shown(seen.gap, 's')}, the median step {seen.step:.3g} s, "
        said += f"and {100 * seen.lost:.2g} % of the samples are missing"
        said += f"; a puncture within the {shown(blind, 'm')} of such a gap is not seen." if blind > FALL_DEPTH else "."
        yield Anomaly("dropped", "longest_gap", seen.gap, seen.step, "s", said)


def _drift(seen: RecordingSummary) -> Iterator[Anomaly]:
    if abs(seen.drift) > max(DRIFT_NOISE * seen.noise, DRIFT_PEAK * seen.peak):
        said = f"The baseline drifts: {shown(seen.before, 'N')} before the contact, {shown(seen.after, 'N')} after "
        said += f"the exit, of a greatest force of {shown(seen.peak, 'N')}. Let the sensor warm up, or zero it."
        yield Anomaly("drift", "drift", seen.drift, 0.0, "N", said)


def _speed_label(seen: RecordingSummary, fields: Mapping[str, str]) -> Iterator[Anomaly]:
    """Only a field in mm/s can be held against the motion."""
    try:
        labelled = 1e-3 * float(fields.get(SPEED_FIELD, "nan"))
    except ValueError:
        return
    if labelled > 0.0 and abs(seen.speed / labelled - 1.0) > SPEED_LABEL:
        said = f"The label is wrong or the motion is: {SPEED_FIELD} says {shown(labelled, 'm/s')}, but the needle "
        said += f"goes in at {shown(seen.speed, 'm/s')}."
        yield Anomaly("label", "speed", seen.speed, labelled, "m/s", said)


def check_recordings(named: Sequence[tuple[str, Recording]]) -> dict[str, list[Anomaly]]:
    """The anomalies of recordings that are repeats of one another, by name; none for one in which nothing moves."""
    return check_repeats(moving_repeats([(name, recording, segment(recording)) for name, recording in named]))


def moving_repeats(seen: Sequence[tuple[str, Recording, Events]]) -> list[Repeat]:
    """Those in which the needle moves, with what is seen of them."""
    contacts = [events.contact.depth for _, _, events in seen if events.contact is not None]
    usual = float(np.median(contacts)) if contacts else None
    with np.errstate(all="ignore"):  # numbers too large for a force are told by their status
        observed = [summarise(recording, events, usual) for _, recording, events in seen]
    return [Repeat(*each, what) for each, what in zip(seen, observed) if what is not None]


def check_repeats(repeats: Sequence[Repeat], fields: Mapping[str, Mapping[str, str]] = {}) -> dict[str, list[Anomaly]]:
    """The anomalies by name; ``fields`` are what the label of each says of it."""
    with np.errstate(all="ignore"):
        beside = repeat_anomalies(repeats)
        return {
            each.name: _first_causes(
                [
                    *recording_anomalies(each.recording, each.events, each.seen, fields.get(each.name, NO_FIELDS)),
                    *beside[each.name],
                ]
            )
            for each in repeats
        }


def _first_causes(odd: list[Anomaly]) -> list[Anomaly]:
    """Without the missing puncture where the numbers themselves are wrong: that is why none is seen."""
    spoiled = any(each.kind in INVALIDATING for each in odd)
    return [each for each in odd if not (spoiled and each.kind == "no_puncture")]
