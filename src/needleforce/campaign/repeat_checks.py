# SPDX-License-Identifier: Apache-2.0
"""Anomalies of a recording compared with its repeats.

Left out of the pooled fit are a copy of another recording (it would narrow the intervals), a recording in other units,
and one with another motion; if the motions form groups of equal size, none is known to be correct and all are left out.
Reported but kept are a recording without a sharp puncture where most others have one (it has no parameters to pool),
and a force drop that may contain two punctures closer than the filter.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..recording import Recording
from ..recording.copies import copies
from ..segmentation import Events
from .recording_result import Anomaly, RecordingSummary, formatted, nearest

FORCE_FACTORS = {1000.0: "mN and N", 4.4482: "lbf and N", 9.80665: "kgf and N"}
DEPTH_FACTORS = {1000.0: "mm and m", 25.4: "mm and in", 10.0: "mm and cm"}
OWN_FIELD = "Distinguish the two motions by a field, or record again."
MAX_FORCE_DIFFERENCE = 0.2  # largest relative difference of the force between repeats in tissue
MIN_CORRELATION = 0.9  # smallest correlation of two loading curves of the same shape
MAX_SPEED_DIFFERENCE = 0.05  # [share] between repeats of one motion
MAX_TRAVEL_DIFFERENCE_M = 0.5e-3  # between repeats of one motion
MAX_HOLD_DIFFERENCE = 0.2  # [share] between repeats of one motion
MIN_HOLD_S = 0.2  # [s] a shorter stop is part of the reversal
_STROKE_ENDS = ("beyond_contact", "end_depth", "travel")  # quantities of a summary
DROPPED_FORCE_SHARE = 0.8  # of its peak: a force that ends its stroke below has dropped, if not sharply
SLOW_DROP_RATIO = 1.2  # of a drop's duration to that of a filtered sudden drop and to that of its repeats


@dataclass(frozen=True, eq=False)
class Repeat:
    """One repeat of a condition; ``name`` is the name of its file."""

    name: str
    recording: Recording
    events: Events
    summary: RecordingSummary


def copy_anomalies(named: Sequence[tuple[str, Recording]]) -> dict[str, Anomaly]:
    """File -> anomaly for each file with the readings of a previous one."""
    found = {}
    for k, first in copies([recording for _, recording in named]).items():
        (name, one), (earlier, other) = named[k], named[first]
        what = "bytes" if one.card.sha256 == other.card.sha256 else "readings, saved in another way,"
        sentence = f"It has the same {what} as {earlier}: a copy is not a repeat. Remove one of the two."
        found[name] = Anomaly(kind="copy", sentence=sentence, left_out=True)
    return found


def repeat_anomalies(repeats: Sequence[Repeat]) -> dict[str, list[Anomaly]]:
    """File -> its anomalies compared with the other repeats, in the order of the checks."""
    found: dict[str, list[Anomaly]] = {each.name: [] for each in repeats}
    if len(repeats) < 2:
        return found
    for check in (_depth_units, _force_units, _motion, _punctures, _close_punctures):
        for name, anomaly in check(repeats):
            if not (check is _motion and any(each.kind == "depth_unit" for each in found[name])):
                found[name].append(anomaly)
    return found


def _depth_units(repeats: Sequence[Repeat]) -> Iterator[tuple[str, Anomaly]]:
    usual = float(np.median([each.summary.travel for each in repeats]))
    for each in repeats if len(repeats) > 2 and usual > 0.0 and not _of_one_file(repeats) else ():
        factor = nearest(each.summary.travel / usual, tuple(DEPTH_FACTORS), 0.05)
        if factor is not None:
            travel, pair = each.summary.travel, _units_of(factor, DEPTH_FACTORS)
            yield each.name, _other_unit("depth", "travel", "travel", "m", value=travel, usual=usual, units=pair)


def _force_units(repeats: Sequence[Repeat]) -> Iterator[tuple[str, Anomaly]]:
    """A force curve of the same shape that is larger or smaller by the factor between two units that are confused."""
    if len(repeats) < 3 or _of_one_file(repeats):
        return
    peaks = np.array([each.summary.peak for each in repeats])
    usual = float(np.median(peaks))
    reference = repeats[int(np.abs(peaks - usual).argmin())].summary.from_contact
    for each in repeats if usual > 0.0 else ():
        factor = nearest(each.summary.peak / usual, tuple(FORCE_FACTORS), MAX_FORCE_DIFFERENCE)
        if factor is not None and _same_shape(each.summary.from_contact, reference):
            peak, pair = each.summary.peak, _units_of(factor, FORCE_FACTORS)
            words = "maximum force"
            yield each.name, _other_unit("force", "peak_force", words, "N", value=peak, usual=usual, units=pair)


def _of_one_file(repeats: Sequence[Repeat]) -> bool:
    """Whether all repeats are recordings of one file, which has one unit for all of them."""
    return len({each.recording.card.sha256 or each.name for each in repeats}) == 1


def _units_of(factor: float, known: dict[float, str]) -> tuple[float, str]:
    """The factor with the pair of units that it converts."""
    return factor, known[factor] if factor in known else known[1.0 / factor]


def _other_unit(
    column: str, quantity: str, words: str, unit: str, *, value: float, usual: float, units: tuple[float, str]
) -> Anomaly:
    """The anomaly of a recording in another unit than its repeats."""
    factor, pair = units
    times = f"{max(factor, 1.0 / factor):.4g} times {'larger' if factor > 1.0 else 'smaller'}"
    sentence = f"The {column} is in another unit: its {words} of {formatted(value, unit)} is {times} than the "
    sentence += f"{formatted(usual, unit)} of its repeats, as if {pair} were confused. Correct the file, or read it "
    sentence += f"separately with --unit {column}=UNIT."
    return Anomaly(
        kind=f"{column}_unit", quantity=quantity, value=value, usual=usual, unit=unit, sentence=sentence, left_out=True
    )


def _same_shape(curve: np.ndarray, other: np.ndarray) -> bool:
    """Whether two loading curves have the same shape; True if they are too short to decide."""
    n = min(len(curve), len(other))
    if n < 20 or not (curve[:n].std() > 0.0 and other[:n].std() > 0.0):
        return True
    return float(abs(np.corrcoef(curve[:n], other[:n])[0, 1])) > MIN_CORRELATION


def _motion(repeats: Sequence[Repeat]) -> Iterator[tuple[str, Anomaly]]:
    speeds = [each.summary.speed for each in repeats]
    holds = [each.summary.hold for each in repeats]
    limits = {"speed": MAX_SPEED_DIFFERENCE * float(np.median(speeds))}
    limits["hold"] = max(MAX_HOLD_DIFFERENCE * float(np.median(holds)), MIN_HOLD_S)
    yield from _stroke_lengths(repeats)
    for quantity, unit in (("speed", "m/s"), ("hold", "s")):
        values = np.array([getattr(each.summary, quantity) for each in repeats])
        usual, unique = _usual(values, limits[quantity])
        for each, value in zip(repeats, values):
            if not unique or abs(value - usual) > limits[quantity]:
                sentence = _motion_sentence(quantity, float(value), usual, unit, unique)
                anomaly = Anomaly(
                    kind="motion",
                    quantity=quantity,
                    value=float(value),
                    usual=usual,
                    unit=unit,
                    sentence=sentence,
                    left_out=True,
                )
                yield each.name, anomaly


def _stroke_lengths(repeats: Sequence[Repeat]) -> Iterator[tuple[str, Anomaly]]:
    """Strokes that end at another depth: from the contact, in the recordings' zero and from the start of the stroke.

    A stroke that agrees in one of the three is the motion of the others, from another height or on a specimen of
    another height. If no depth is the most frequent, the recordings are kept: their parameters do not depend on it.
    """
    readings = [np.array([getattr(each.summary, name) for each in repeats]) for name in _STROKE_ENDS]
    usual = [_usual(values, MAX_TRAVEL_DIFFERENCE_M) for values in readings]
    same = [
        unique & (np.abs(values - middle) <= MAX_TRAVEL_DIFFERENCE_M)
        for values, (middle, unique) in zip(readings, usual)
    ]
    known = any(unique for _, unique in usual)
    for each, agrees in zip(repeats, np.any(same, axis=0)):
        if not agrees:
            own = each.summary
            sentence = _stroke_sentence(own, usual[-1][0], usual[0][0], known)
            anomaly = Anomaly(
                kind="motion",
                quantity="travel",
                value=own.travel,
                usual=usual[-1][0],
                unit="m",
                sentence=sentence,
                left_out=known,
            )
            yield each.name, anomaly


def _stroke_sentence(own: RecordingSummary, travel: float, beyond: float, known: bool) -> str:
    if not known:
        end = _stroke(own.travel, own.beyond_contact)
        return f"The strokes of its repeats end at different depths, and none is the most frequent: here {end}."
    sentence = f"It has another motion: its travel is {_stroke(own.travel, own.beyond_contact)}, that of its repeats "
    return f"{sentence}{_stroke(travel, beyond)}. " + OWN_FIELD


def _stroke(travel: float, beyond: float) -> str:
    """A stroke in words, with the part beyond the contact if that is known."""
    return formatted(travel, "m") + (f", {formatted(beyond, 'm')} beyond the contact" if np.isfinite(beyond) else "")


def _usual(values: np.ndarray, limit: float) -> tuple[float, bool]:
    """The value of the largest group of similar values (NaN if none is known), and whether no other is as large."""
    if not np.isfinite(values).any():
        return np.nan, False
    near = np.abs(values[:, None] - values[None, :]) <= limit
    count = near.sum(axis=1)
    group = near[int(count.argmax())]
    rival = count[~group].max(initial=0)
    return float(np.median(values[group])), bool(group.all() or rival < count.max())


def _motion_sentence(quantity: str, value: float, usual: float, unit: str, unique: bool) -> str:
    if not unique:
        return (
            f"The repeats have different motions, and none of them is the most frequent: here the {quantity} is "
            f"{formatted(value, unit)}. Distinguish the motions by a field."
        )
    sentence = f"It has another motion: its {quantity} is {formatted(value, unit)}, that of its repeats "
    return f"{sentence}{formatted(usual, unit)}. " + OWN_FIELD


def _punctures(repeats: Sequence[Repeat]) -> Iterator[tuple[str, Anomaly]]:
    counts = [len(each.events.punctures) for each in repeats]
    with_one = sum(count > 0 for count in counts)
    for each, count in zip(repeats, counts):
        if count == 0 and 2 * with_one > len(repeats):
            sentence = _no_puncture_sentence(each.summary, f"{with_one} of its {len(repeats) - 1} repeats")
            anomaly = Anomaly(
                kind="no_puncture",
                quantity="event_punctures",
                value=0.0,
                usual=float(np.median(counts)),
                unit="1",
                sentence=sentence,
            )
            yield each.name, anomaly


def _no_puncture_sentence(summary: RecordingSummary, others: str) -> str:
    if summary.end < DROPPED_FORCE_SHARE * summary.peak:
        return (
            f"Its force decreases without the sharp drop of a puncture, which {others} show: the puncture cannot be "
            "located, and the recording gives no parameters."
        )
    advice = "Check whether the needle entered an existing hole or missed the tissue."
    return f"It has no puncture, but {others} have one. {advice}"


def _close_punctures(repeats: Sequence[Repeat]) -> Iterator[tuple[str, Anomaly]]:
    """A first puncture that may be two: an average of N samples spreads a sudden drop over N samples, 0.8 N from 10 %
    to 90 % of it."""
    drops = [each.summary.drop_samples for each in repeats if np.isfinite(each.summary.drop_samples)]
    for each in repeats if len(drops) > 2 else ():
        length, drop, usual = each.recording.card.filter_length, each.summary.drop_samples, float(np.median(drops))
        if length > 1 and drop > SLOW_DROP_RATIO * max(0.8 * length, usual) and drop < 2.0 * length:
            sentence = "Its first puncture may be two that are closer than the filter: the drop takes "
            sentence += f"{drop:.0f} samples, that of its repeats {usual:.0f}, with an average of {length} samples. "
            sentence += "Its puncture depth is uncertain."
            anomaly = Anomaly(
                kind="close_punctures", quantity="puncture_depth", value=drop, usual=usual, unit="1", sentence=sentence
            )
            yield each.name, anomaly
