# SPDX-License-Identifier: Apache-2.0
"""Anomalies of a single recording, and the checks of several recordings together: repeats that differ, parameters far
from those of the other repeats, and recordings that resemble another condition."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ..display.quantities import percent
from ..identification.estimates import Estimate
from ..recording import Recording
from ..segmentation import Events, segment
from ..segmentation.doubtful import dead, dies
from ..segmentation.segment import RUPTURE_TRAVEL_M
from .recording_result import INVALIDATING, Anomaly, RecordingSummary, formatted, summarise
from .repeat_checks import OWN_FIELD, Repeat, repeat_anomalies

SIGN_SIGMA = 5.0  # [sd of the noise] a smaller mean force has no sign
GAP_STEPS = 10.0  # median steps: the usual stalls of an insertion robot are shorter
MAX_LOST_SHARE = 0.05  # largest share of samples lost in gaps
DRIFT_SIGMA, DRIFT_PEAK_SHARE = 5.0, 0.05  # [sd of the noise], [share of the peak]: a drift exceeds both
MAX_SPEED_DEVIATION = 0.1  # largest relative deviation from the labelled speed
SPEED_FIELD = "speed_mm_s"
NO_FIELDS: Mapping[str, str] = {}
MIN_REPEATS = 4  # repeats
CHECKED_PARAMETERS = (
    "puncture_force", "puncture_indentation", "stiffness_coefficient", "reference_force", "friction_per_length",
    "cutting_force",
)  # fmt: skip
MIN_DEVIATION_SHARE = 0.1  # of the median: a smaller deviation is not an outlier, however well the others agree

# repeats -> 99 % quantile of the largest deviation from the median in scaled MADs, for normal samples (200 000 each):
# for few repeats the MAD is a poor estimate of the scatter
_EVEN_QUANTILES = (
    (4, 15.8), (6, 10.0), (8, 8.0), (10, 6.9), (12, 6.3), (14, 5.9), (20, 5.3), (30, 4.8), (50, 4.5), (100, 4.3),
)  # fmt: skip
_ODD_QUANTILES = (
    (5, 18.7), (7, 10.7), (9, 8.3), (11, 7.0), (13, 6.4), (15, 5.9), (21, 5.3), (31, 4.8), (51, 4.5), (101, 4.3),
)  # fmt: skip
MIN_DISTANCE_RATIO = 2.5  # of the distance to its own condition to that of the other and to the scatter of its repeats
MAX_DISTANCE_SCATTERS = 2.0  # scatters of the other condition within which a curve belongs to it
MIN_DISTANCE_SHARE = 0.1  # of the peak of its own condition's mean: closer conditions cannot be distinguished
MIN_OVERLAP_SHARE = 0.8  # of the longer of two curves, which the shorter one must cover


def recording_anomalies(
    recording: Recording, events: Events, summary: RecordingSummary, fields: Mapping[str, str]
) -> Iterator[Anomaly]:
    """The anomalies of one recording; none for a valid recording. One whose channel is dead shows nothing else."""
    if sentence := _dead(recording, summary):
        yield Anomaly(
            kind="dead", quantity="peak_force", value=summary.peak, unit="N", sentence=sentence, left_out=True
        )
        return
    yield from _sign(recording, summary)
    yield from _saturated(events, summary)
    yield from _dropped(summary)
    yield from _drift(summary)
    yield from _speed_label(summary, fields)


def _dead(recording: Recording, summary: RecordingSummary) -> str:
    """A sentence if the force is constant, or so from a sample on that is no return to the baseline: without noise, a
    force is constant after the exit."""
    held = float(np.ptp(recording.force[int(np.argmax(recording.depth)) :])) == 0.0 or _drifts(summary)
    stuck = dies(recording.time, recording.depth, recording.force) if held else ""
    return dead(recording.force) or (f"T{stuck[1:]} Check the sensor and its cable." if stuck else "")


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
            kind="sign", quantity="peak_force", value=summary.push, unit="N", sentence=sentence, left_out=True
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
        kind="saturated", quantity="peak_force", value=summary.peak, unit="N", sentence=sentence, left_out=before
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
        known = {"value": summary.gap, "usual": summary.step, "unit": "s"}
        yield Anomaly(kind="dropped", quantity="longest_gap", sentence=f"{sentence}.", **known)


def _drifts(summary: RecordingSummary) -> bool:
    return abs(summary.drift) > max(DRIFT_SIGMA * summary.noise, DRIFT_PEAK_SHARE * summary.peak)


def _drift(summary: RecordingSummary) -> Iterator[Anomaly]:
    if _drifts(summary):
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


def invalid_recordings(named: Sequence[tuple[str, Recording]]) -> tuple[dict[str, Anomaly], list[str]]:
    """By name why a recording has invalid values, and sentences on the other anomalies of repeats."""
    invalid: dict[str, Anomaly] = {}
    remarks = []
    for name, found in check_recordings(named).items():
        for anomaly in found:
            if anomaly.left_out and anomaly.kind in INVALIDATING:
                invalid.setdefault(name, anomaly)
            elif anomaly.kind != "no_puncture":  # reported by the status
                remarks.append(f"{name}: {anomaly.sentence.removesuffix(OWN_FIELD).rstrip()}")
    return invalid, remarks


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


def limit(count: int) -> float:
    """Scaled MADs beyond which one of ``count`` values is an outlier: 1 in 100 normal samples contains one."""
    counts, limits = zip(*(_ODD_QUANTILES if count % 2 else _EVEN_QUANTILES))
    return float(np.interp(count, counts, limits))


def outliers(repeats: Mapping[str, Mapping[str, Estimate]]) -> Iterator[tuple[str, Anomaly]]:
    """File and anomaly for each parameter of ``repeats`` (file -> its own estimates) that is an outlier.

    At least four repeats must have the parameter. An outlier deviates from the median by more than ``limit`` scaled
    MADs, a tenth of the median and the half width of its own interval. It remains in the pooled fit: leaving it out
    without a known cause would bias the result.
    """
    for name in CHECKED_PARAMETERS:
        known = {file: each[name] for file, each in repeats.items() if name in each and each[name].identifiable}
        if len(known) < MIN_REPEATS:
            continue
        values = np.array([each.value for each in known.values()])
        middle = float(np.median(values))
        scale = 1.4826 * float(np.median(np.abs(values - middle)))
        threshold = max(limit(len(values)) * scale, MIN_DEVIATION_SHARE * abs(middle))
        if threshold == 0.0:  # most values are at the bound of the fit, which is not scatter
            continue
        for file, each in known.items():
            deviation, half = abs(each.value - middle), 0.5 * (each.high - each.low)
            if deviation > threshold and not deviation <= half:
                yield file, _outlier(each, middle, scale)


def _outlier(each: Estimate, middle: float, scale: float) -> Anomaly:
    words = each.name.replace("_", " ")
    sentence = f"Its {words} is {formatted(each.value, each.unit)}, far from that of its repeats, "
    sentence += f"{formatted(middle, each.unit)} with a scatter of {formatted(scale, each.unit)}."
    return Anomaly(
        kind="outlier", quantity=each.name, value=each.value, usual=middle, unit=each.unit, sentence=sentence
    )


def wrong_labels(
    curves: Mapping[str, Mapping[str, np.ndarray]], pooled: Mapping[str, Sequence[str]]
) -> Iterator[tuple[str, Anomaly]]:
    """File and anomaly for each recording that probably belongs to another condition; its label is not changed.

    ``curves`` maps a condition's name to its files' loading curves [N]; ``pooled`` maps it to the files of its mean.
    The recording's own condition needs two other files that agree, the other condition two files.
    """
    means = {name: _mean([curves[name][file] for file in files]) for name, files in pooled.items()}
    for name, own in curves.items():
        for file, curve in own.items():
            others = _mean([own[each] for each in pooled[name] if each != file])
            if others is None:
                continue
            distance = _distance(curve, others[0])
            if not distance > max(MIN_DISTANCE_RATIO * others[1], MIN_DISTANCE_SHARE * float(np.abs(others[0]).max())):
                continue
            best = _nearest(curve, {other: mean for other, mean in means.items() if other != name})
            if best is not None and best[0] < distance / MIN_DISTANCE_RATIO:
                yield file, _wrong_label(best[1], distance, best[0])


def _mean(curves: list[np.ndarray]) -> tuple[np.ndarray, float] | None:
    """The mean curve over the common length and the scatter about it [N]; None for fewer than two curves."""
    curves = [each for each in curves if len(each)]
    if len(curves) < 2:
        return None
    length = min(map(len, curves))
    rows = np.array([each[:length] for each in curves])
    return rows.mean(axis=0), float(np.sqrt(rows.var(axis=0, ddof=1).mean()))


def _distance(curve: np.ndarray, mean: np.ndarray) -> float:
    """The root-mean-square difference [N] over the common length; NaN if that is too short."""
    length = min(len(curve), len(mean))
    if length < MIN_OVERLAP_SHARE * max(len(curve), len(mean)):
        return np.nan
    return float(np.sqrt(np.mean((curve[:length] - mean[:length]) ** 2)))


def _nearest(curve: np.ndarray, means: dict) -> tuple[float, str] | None:
    found = ((_distance(curve, mean[0]), name, mean[1]) for name, mean in means.items() if mean is not None)
    near = [(distance, name) for distance, name, scatter in found if distance < MAX_DISTANCE_SCATTERS * scatter]
    return min(near) if near else None


def _wrong_label(other: str, distance: float, nearest: float) -> Anomaly:
    sentence = f"Its label may be wrong: its force differs by {formatted(distance, 'N')} from the mean of its repeats, "
    sentence += f"but only by {formatted(nearest, 'N')} from that of the condition {other}. Check which condition was "
    sentence += "recorded."
    return Anomaly(kind="label", quantity="peak_force", value=distance, usual=nearest, unit="N", sentence=sentence)
