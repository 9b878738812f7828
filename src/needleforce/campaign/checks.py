# SPDX-License-Identifier: Apache-2.0
"""Anomalies of a single recording, and the checks of several recordings together."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ..display.quantities import percent
from ..recording import Recording
from ..segmentation import Events, segment
from ..segmentation.segment import RUPTURE_TRAVEL_M
from .recording_result import INVALIDATING, Anomaly, formatted
from .repeat_checks import Repeat, repeat_anomalies
from .summary import RecordingSummary, summarise

SIGN_SIGMA = 5.0  # [sd of the noise] a smaller mean force has no sign
GAP_STEPS = 10.0  # median steps: the usual stalls of an insertion robot are shorter
MAX_LOST_SHARE = 0.05  # largest share of samples lost in gaps
DRIFT_SIGMA, DRIFT_PEAK_SHARE = 5.0, 0.05  # [sd of the noise], [share of the peak]: a drift exceeds both
MAX_SPEED_DEVIATION = 0.1  # largest relative deviation from the labelled speed
SPEED_FIELD = "speed_mm_s"
NO_FIELDS: Mapping[str, str] = {}


def recording_anomalies(
    recording: Recording, events: Events, summary: RecordingSummary, fields: Mapping[str, str]
) -> Iterator[Anomaly]:
    """The anomalies of one recording; none for a valid recording."""
    yield from _sign(recording, summary)
    yield from _saturated(events, summary)
    yield from _dropped(summary)
    yield from _drift(summary)
    yield from _speed_label(summary, fields)


def _sign(recording: Recording, summary: RecordingSummary) -> Iterator[Anomaly]:
    """A force that is negative during insertion and positive during withdrawal; without a withdrawal, the note made
    while reading is used."""
    threshold = SIGN_SIGMA * summary.noise if summary.noise > 0.0 else 0.0
    noted = np.isnan(summary.pull) and any(note.kind == "sign" for note in recording.notes)
    if summary.push < -threshold and (summary.pull > threshold or noted):
        sentence = f"The force has the wrong sign: its mean is {formatted(summary.push, 'N')} during insertion"
        sentence += "" if noted else f" and {formatted(summary.pull, 'N')} during withdrawal"
        sentence += ", but a positive force opposes insertion. Give --unit force=-N."
        yield Anomaly(
            kind="sign",
            quantity="peak_force",
            value=summary.push,
            usual=float("nan"),
            unit="N",
            sentence=sentence,
            left_out=True,
        )


def _saturated(events: Events, summary: RecordingSummary) -> Iterator[Anomaly]:
    if not summary.flat:
        return
    deformation = next(iter(events.spans("deformation")), None)
    before = deformation is None or not events.punctures or summary.flat_ends - summary.flat <= deformation.last
    # the longest part at the extreme may lie deeper than a peak that is cut off at the same force
    before = before or abs(events.punctures[0].force) >= abs(summary.peak)
    sentence = f"The force is saturated: {summary.flat} consecutive samples are at its extreme of "
    sentence += f"{formatted(summary.peak, 'N')} while the needle moves"
    sentence += ", up to the puncture" if before else ", beyond the puncture"
    sentence += ". Record again with a larger range of the sensor."
    yield Anomaly(
        kind="saturated",
        quantity="peak_force",
        value=summary.peak,
        usual=float("nan"),
        unit="N",
        sentence=sentence,
        left_out=before,
    )


def _dropped(summary: RecordingSummary) -> Iterator[Anomaly]:
    travel = summary.gap * summary.speed
    hidden = travel > RUPTURE_TRAVEL_M
    if (
        summary.gap > GAP_STEPS * summary.step
        or (summary.gap > 3.0 * summary.step and hidden)
        or summary.lost > MAX_LOST_SHARE
    ):
        sentence = f"Samples were dropped: the longest gap is {formatted(summary.gap, 's')}, the median step "
        sentence += f"{summary.step:.3g} s, and {percent(summary.lost)} of the samples are missing"
        sentence += f"; a puncture within the {formatted(travel, 'm')} of such a gap is not detected" if hidden else ""
        yield Anomaly(
            kind="dropped",
            quantity="longest_gap",
            value=summary.gap,
            usual=summary.step,
            unit="s",
            sentence=sentence + ".",
        )


def _drift(summary: RecordingSummary) -> Iterator[Anomaly]:
    if abs(summary.drift) > max(DRIFT_SIGMA * summary.noise, DRIFT_PEAK_SHARE * summary.peak):
        sentence = f"The baseline drifts: it is {formatted(summary.before, 'N')} before the contact and "
        sentence += f"{formatted(summary.after, 'N')} after the exit, with a maximum force of "
        sentence += f"{formatted(summary.peak, 'N')}. Let the sensor warm up, or zero it before each run."
        yield Anomaly(kind="drift", quantity="drift", value=summary.drift, usual=0.0, unit="N", sentence=sentence)


def _speed_label(summary: RecordingSummary, fields: Mapping[str, str]) -> Iterator[Anomaly]:
    """A speed that differs from the label; only a field in mm/s can be compared."""
    try:
        labelled = 1e-3 * float(fields.get(SPEED_FIELD, "nan"))
    except ValueError:
        return
    if labelled > 0.0 and abs(summary.speed / labelled - 1.0) > MAX_SPEED_DEVIATION:
        sentence = f"Label and motion differ: {SPEED_FIELD} is {formatted(labelled, 'm/s')}, but the needle is "
        sentence += f"inserted at {formatted(summary.speed, 'm/s')}. Check the label and the motion."
        yield Anomaly(
            kind="label", quantity="speed", value=summary.speed, usual=labelled, unit="m/s", sentence=sentence
        )


def check_recordings(named: Sequence[tuple[str, Recording]]) -> dict[str, list[Anomaly]]:
    """The anomalies of repeats by name; a recording without motion has none."""
    return check_repeats(moving_repeats([(name, recording, segment(recording)) for name, recording in named]))


def moving_repeats(segmented: Sequence[tuple[str, Recording, Events]]) -> list[Repeat]:
    """The repeats in which the needle moves, with their summaries."""
    contacts = [events.contact.depth for _, _, events in segmented if events.contact is not None]
    usual = float(np.median(contacts)) if contacts else None
    with np.errstate(all="ignore"):  # values too large for a force are reported by the status
        summaries = [summarise(recording, events, usual) for _, recording, events in segmented]
    return [Repeat(*each, summary) for each, summary in zip(segmented, summaries) if summary is not None]


def check_repeats(repeats: Sequence[Repeat], fields: Mapping[str, Mapping[str, str]] = {}) -> dict[str, list[Anomaly]]:
    """The anomalies by name; ``fields`` are the label of each repeat."""
    with np.errstate(all="ignore"):
        compared = repeat_anomalies(repeats)
        return {
            each.name: _first_causes(
                [
                    *recording_anomalies(each.recording, each.events, each.summary, fields.get(each.name, NO_FIELDS)),
                    *compared[each.name],
                ]
            )
            for each in repeats
        }


def _first_causes(anomalies: list[Anomaly]) -> list[Anomaly]:
    """The anomalies without a missing puncture if the values are invalid, because that explains it."""
    invalid = any(each.kind in INVALIDATING for each in anomalies)
    return [each for each in anomalies if not (invalid and each.kind == "no_puncture")]
