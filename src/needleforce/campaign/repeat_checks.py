# SPDX-License-Identifier: Apache-2.0
"""What is odd in a recording next to its repeats.

Left out of the pooled fit: the copy of another recording (it would narrow the intervals), one in other units, one with
another motion; where the motions fall into groups of equal size nobody can say which is the right one, and all are left
out. Told, and kept: no sharp puncture where most others have one (it has no parameters to pool anyway), and a drop that
may hold two punctures closer than the filter.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..recording import Recording
from ..segmentation import Events
from .anomaly import Anomaly, nearest, shown
from .summary import RecordingSummary

FORCE_FACTORS = {1000.0: "mN and N", 4.4482: "lbf and N", 9.80665: "kgf and N"}
DEPTH_FACTORS = {1000.0: "mm and m", 25.4: "mm and in", 10.0: "mm and cm"}
OWN_FIELD = "Give the two motions a field of their own, or record again."
WITHIN = 0.2  # repeats of tissue differ by so much in force
ALIKE = 0.9  # correlation of two loading curves of one shape
SPEED, TRAVEL, HOLD = 0.05, 0.5e-3, 0.2  # [share], [m], [share] by which repeats of one motion differ at most
SHORTEST_HOLD = 0.2  # [s] below, a stop is the turn itself
SOFT = 0.8  # of its peak: a force that ends its stroke below has fallen, if not sharply
SLOW_FALL = 1.2  # a drop that takes so many times what a filter makes of a sudden one, and what the others take


@dataclass(frozen=True, eq=False)
class Repeat:
    """One recording of a condition, read; ``name`` is its file's."""

    name: str
    recording: Recording
    events: Events
    seen: RecordingSummary


def copies(named: Sequence[tuple[str, Recording]]) -> dict[str, Anomaly]:
    """File -> that it has the same bytes as one before it."""
    first: dict[str, str] = {}
    found = {}
    for name, recording in named:
        sha256 = recording.card.sha256
        if sha256 and sha256 in first:
            said = f"It has the same bytes as {first[sha256]}: a copy is no repeat. Remove one of the two."
            found[name] = Anomaly("copy", "", float("nan"), float("nan"), "", said, left_out=True)
        first.setdefault(sha256, name)
    return found


def repeat_anomalies(repeats: Sequence[Repeat]) -> dict[str, list[Anomaly]]:
    """File -> what is odd in it next to the others, in the order of the checks."""
    found: dict[str, list[Anomaly]] = {each.name: [] for each in repeats}
    if len(repeats) < 2:
        return found
    for check in (_depth_units, _force_units, _motion, _punctures, _close_punctures):
        for name, oddity in check(repeats):
            if not (check is _motion and any(each.kind == "depth_unit" for each in found[name])):
                found[name].append(oddity)
    return found


def _depth_units(repeats: Sequence[Repeat]) -> Iterator[tuple[str, Anomaly]]:
    usual = float(np.median([each.seen.travel for each in repeats]))
    for each in repeats if len(repeats) > 2 and usual > 0.0 else ():
        factor = nearest(each.seen.travel / usual, tuple(DEPTH_FACTORS), 0.05)
        if factor is not None:
            said = _units("depth", "travel", each.seen.travel, usual, "m", factor, DEPTH_FACTORS)
            yield each.name, Anomaly("depth_unit", "travel", each.seen.travel, usual, "m", said, left_out=True)


def _force_units(repeats: Sequence[Repeat]) -> Iterator[tuple[str, Anomaly]]:
    """Of the same shape, and greater or smaller by the factor between two units that are mixed up."""
    if len(repeats) < 3:
        return
    peaks = np.array([each.seen.peak for each in repeats])
    usual = float(np.median(peaks))
    like = repeats[int(np.abs(peaks - usual).argmin())].seen.curve
    for each in repeats if usual > 0.0 else ():
        factor = nearest(each.seen.peak / usual, tuple(FORCE_FACTORS), WITHIN)
        if factor is not None and _alike(each.seen.curve, like):
            said = _units("force", "greatest force", each.seen.peak, usual, "N", factor, FORCE_FACTORS)
            yield each.name, Anomaly("force_unit", "peak_force", each.seen.peak, usual, "N", said, left_out=True)


def _units(what: str, words: str, value: float, usual: float, unit: str, factor: float, known: dict) -> str:
    pair = known[factor] if factor in known else known[1.0 / factor]
    times = f"{max(factor, 1.0 / factor):.4g} times {'greater' if factor > 1.0 else 'smaller'}"
    said = (
        f"The {what} is in another unit: its {words} of {shown(value, unit)} is {times} than the {shown(usual, unit)} "
    )
    return (
        said + f"of its repeats, as if {pair} were mixed. Mend the file, or read it by itself with --unit {what}=NAME."
    )


def _alike(curve: np.ndarray, other: np.ndarray) -> bool:
    """Whether two loading curves have one shape; True where they are too short to say."""
    n = min(len(curve), len(other))
    if n < 20 or not (curve[:n].std() > 0.0 and other[:n].std() > 0.0):
        return True
    return float(abs(np.corrcoef(curve[:n], other[:n])[0, 1])) > ALIKE


def _motion(repeats: Sequence[Repeat]) -> Iterator[tuple[str, Anomaly]]:
    speeds = [each.seen.speed for each in repeats]
    holds = [each.seen.hold for each in repeats]
    limits = {"speed": SPEED * float(np.median(speeds)), "travel": TRAVEL}
    limits["hold"] = max(HOLD * float(np.median(holds)), SHORTEST_HOLD)
    for quantity, unit in (("speed", "m/s"), ("travel", "m"), ("hold", "s")):
        values = np.array([getattr(each.seen, quantity) for each in repeats])
        usual, sure = _usual(values, limits[quantity])
        for each, value in zip(repeats, values):
            if not sure or abs(value - usual) > limits[quantity]:
                said = _moves(quantity, float(value), usual, unit, sure)
                yield each.name, Anomaly("motion", quantity, float(value), usual, unit, said, left_out=True)


def _usual(values: np.ndarray, limit: float) -> tuple[float, bool]:
    """The value that most others are near to, and whether it has no rival with as many."""
    near = np.abs(values[:, None] - values[None, :]) <= limit
    count = near.sum(axis=1)
    group = near[int(count.argmax())]
    rival = count[~group].max(initial=0)
    return float(np.median(values[group])), bool(group.all() or rival < count.max())


def _moves(quantity: str, value: float, usual: float, unit: str, sure: bool) -> str:
    if not sure:
        return (
            f"The repeats move differently, and none of their motions is the usual one: here the {quantity} is "
            f"{shown(value, unit)}. Give each motion a field of its own."
        )
    said = f"It moves differently: its {quantity} is {shown(value, unit)}, that of its repeats {shown(usual, unit)}. "
    return said + OWN_FIELD


def _punctures(repeats: Sequence[Repeat]) -> Iterator[tuple[str, Anomaly]]:
    counts = [len(each.events.punctures) for each in repeats]
    with_one = sum(count > 0 for count in counts)
    for each, count in zip(repeats, counts):
        if count == 0 and 2 * with_one > len(repeats):
            said = _unpierced(each.seen, f"{with_one} of its {len(repeats) - 1} repeats")
            yield each.name, Anomaly("no_puncture", "event_punctures", 0.0, float(np.median(counts)), "1", said)


def _unpierced(seen: RecordingSummary, others: str) -> str:
    if seen.end < SOFT * seen.peak:
        return (
            f"Its force falls without the sharp drop of a puncture, which {others} show: where it punctures cannot be "
            "told, and it gives no parameters."
        )
    return f"It never punctures, but {others} do. Was the needle in an old hole, or beside the tissue?"


def _close_punctures(repeats: Sequence[Repeat]) -> Iterator[tuple[str, Anomaly]]:
    """An average of N samples stretches a sudden drop over N, so over 0.8 N from a tenth to nine tenths of it."""
    falls = [each.seen.fall for each in repeats if np.isfinite(each.seen.fall)]
    for each in repeats if len(falls) > 2 else ():
        length, fall, usual = each.recording.card.filter_length, each.seen.fall, float(np.median(falls))
        if length > 1 and fall > SLOW_FALL * max(0.8 * length, usual) and fall < 2.0 * length:
            said = f"Its first puncture may be two that are closer than the filter: the drop takes {fall:.0f} samples, "
            said += f"that of its repeats {usual:.0f}, under an average of {length}. Its puncture depth is doubtful."
            yield each.name, Anomaly("close_punctures", "puncture_depth", each.seen.fall, usual, "1", said)
