# SPDX-License-Identifier: Apache-2.0
"""The cycles of a cyclic test in one continuous recording: seen in the motion, or counted by a column of the file."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from itertools import pairwise

import numpy as np

from .. import core
from ..errors import InputError
from .joining import RETURNED
from .parts import listed
from .recording import COLUMNS, Note, Recording

MIN_CYCLES = 3  # two strokes are a test with a second pass, which is one recording
_LARGE = 0.5  # of the largest stroke, of the travel and of the range of force: nearer to all of it than to nothing
_NEXT_SMALLER = 1.0 / 3.0  # of the smallest cycle: what is smaller is a disturbance; amplitudes double at most
_FALSE_ALARM = 1e-3  # probability that noise alone turns the depth anywhere in a recording
_N_BLOCKS, _BLOCK = 16, 500  # of samples, from which the noise is taken
_FOURTH_DIFFERENCE = 70**0.5  # sd of a fourth difference of values with sd 1
_DRIVEN = 2.0 / 3.0  # of the travel: what else moves the depth, travels at most half as far as the strokes
_MIN_SAMPLES = 12  # of a recording with cycles: two for each of six strokes
_MIN_SHARE = 1e-6  # of the travel: smaller motions are not searched

Turns = tuple[int, int, int]
"""Numbers of the samples at the low, the high and the next low of a cycle."""


@dataclass(frozen=True)
class CycleSpan:
    """One cycle: its name, its first sample, and the one after its last."""

    name: str
    first: int
    stop: int


def cycle_spans(recording: Recording) -> tuple[CycleSpan, ...]:
    """The complete cycles in the motion of a recording.

    Parameters
    ----------
    recording : Recording
        One recording.

    Returns
    -------
    tuple of CycleSpan
        In the order of time; empty if the motion is no repetition.

    Notes
    -----
    A cycle goes in from a low, the outermost depth, and returns to within a fifth of its stroke. The motion repeats if
    at least three cycles have half the stroke of the largest, which is at least half of all travel; two are enough if
    each is. Where the needle first advances to the tissue and cycles there, the cycles begin where it passes the depth
    to which it returns, and what replaces the travel is the force: at least half of its range, in the median of all
    cycles, lies between their lows and their highs. A pull-back is therefore part of its insertion, and vibration in a
    hold is none, as it moves little and changes the force little.

    Turning points are farther apart than white noise of the depth takes it anywhere in the recording, but in one of a
    thousand recordings; its standard deviation is that of fourth differences. A cut is in the middle of the rest at a
    low, to within this noise. Where the depth wanders, as of a drift at rest, over a third of the travel is not that of
    strokes, and nothing repeats.
    """
    bounds = _bounds(np.ascontiguousarray(recording.depth, float), recording.force)
    return tuple(CycleSpan(f"cycle {k}", a, b) for k, (a, b) in enumerate(bounds, 1))


def _bounds(depth: np.ndarray, force: np.ndarray) -> list[tuple[int, int]]:
    """First sample and the one after the last of each cycle; searched among the turning points beyond the noise."""
    if len(depth) < _MIN_SAMPLES:
        return []
    span, force_span, noise = float(np.ptp(depth)), float(np.ptp(force)), noise_travel(depth)
    points = np.array(core.reversals(depth, max(noise, _MIN_SHARE * span)))
    outer, force, travel = depth[points], force[points], _LARGE * span
    while travel > max(2.0 * noise, _MIN_SHARE * span):
        turns = core.reversals(outer, travel)
        motions = [outer] if len(turns) < 2 * MIN_CYCLES else [outer, _clipped(outer, turns)]
        for k, each in enumerate(motions):
            found = _closed(each, core.reversals(each, travel) if k else turns)
            if _repeats(each, force, found, span, force_span, two=not k) and _is_driven(each, found):
                found = _with_smaller(each, found, noise)
                at = [tuple(points[list(cycle)].tolist()) for cycle in found]
                return _cuts(np.maximum(depth, each.min()) if k else depth, at, noise, clipped=k > 0)
        travel *= _NEXT_SMALLER
    return []


def noise_travel(depth: np.ndarray) -> float:
    """The travel between two samples of a depth at rest that its noise does not reach [as the depth].

    For white noise with standard deviation s, ``2 s sqrt(2 ln(n / p))``, with a probability p of one in a thousand for
    all n samples together; two steps of a depth that stands still at most of its samples.
    """
    blocks = _N_BLOCKS if len(depth) > _N_BLOCKS * _BLOCK else 1
    length = _BLOCK if blocks > 1 else len(depth)
    starts = np.linspace(0, len(depth) - length, blocks).astype(int)
    parts = [depth[k : k + length] for k in starts]
    steps = np.abs(np.concatenate([np.diff(part) for part in parts]))
    moved = steps[steps > 0.0]
    quantum = float(moved.min()) if len(moved) < 0.5 * len(steps) and len(moved) else 0.0
    fourth = np.abs(np.concatenate([np.diff(part, 4) for part in parts]))
    deviation = float(np.median(fourth)) / 0.6745 / _FOURTH_DIFFERENCE if len(fourth) else 0.0
    return max(2.0 * deviation * np.sqrt(2.0 * np.log(len(depth) / _FALSE_ALARM)), 2.0 * quantum)


def _closed(depth: np.ndarray, turns: Sequence[int]) -> list[Turns]:
    """Low, high and next low of every cycle: from a low to the next one that is as far out, but for a fifth."""
    first = 0 if len(turns) > 1 and depth[turns[0]] < depth[turns[1]] else 1
    found, low, high = [], None, None
    for k in range(first, len(turns) - 1, 2):
        here, top = turns[k], turns[k + 1]
        low = here if low is None else low
        high = top if high is None or depth[top] > depth[high] else high
        if k + 2 < len(turns):
            after = turns[k + 2]
            if depth[high] - depth[after] >= (1.0 - RETURNED) * (depth[high] - depth[low]):
                found.append((low, high, after))
                low = high = None
    return found


def _clipped(depth: np.ndarray, turns: Sequence[int]) -> np.ndarray:
    """The depth, at least that of the outermost low between the first and the last turning point."""
    return np.maximum(depth, depth[turns[1:-1]].min())


def _strokes(depth: np.ndarray, found: Sequence[Turns]) -> np.ndarray:
    return np.array([depth[high] - depth[low] for low, high, _ in found])


def _repeats(
    depth: np.ndarray, force: np.ndarray, found: Sequence[Turns], span: float, force_span: float, *, two: bool
) -> bool:
    """Whether the cycles are large, alike and enough; ``two`` may be, if each is large."""
    strokes = _strokes(depth, found)
    if two and len(found) == 2 and strokes.min() >= _LARGE * span:
        return True
    if len(found) < MIN_CYCLES or np.count_nonzero(strokes >= _LARGE * strokes.max()) < MIN_CYCLES:
        return False
    if strokes.max() >= _LARGE * span:
        return True
    changes = [force[high] - 0.5 * (force[low] + force[after]) for low, high, after in found]
    return bool(abs(np.median(changes)) >= _LARGE * force_span)


def _is_driven(depth: np.ndarray, found: Sequence[Turns]) -> bool:
    """Whether most of the travel between the turning points (n,) is that of the strokes."""
    travel = np.abs(np.diff(depth[found[0][0] : found[-1][2] + 1])).sum()
    strokes = sum(2.0 * depth[high] - depth[low] - depth[after] for low, high, after in found)
    return bool(_DRIVEN * travel <= strokes)


def _with_smaller(depth: np.ndarray, found: list[Turns], noise: float) -> list[Turns]:
    """The cycles with smaller ones, as of a growing amplitude, down to those of a third of the next larger one."""
    while (smaller := _NEXT_SMALLER * float(_strokes(depth, found).min())) > noise:
        again = _closed(depth, core.reversals(depth, smaller))
        if len(again) <= len(found):
            break
        found = again
    return found


def _cuts(depth: np.ndarray, found: Sequence[Turns], noise: float, *, clipped: bool) -> list[tuple[int, int]]:
    """First sample and the one after the last of each cycle: cut in the middle of the rest at each low.

    A rest with which the recording begins or ends belongs to that cycle; of a ``clipped`` depth it is the advance to
    the tissue and the final withdrawal, which do not.
    """
    highs = [0, *(high for _, high, _ in found), len(depth)]
    lows = [*(low for low, _, _ in found), found[-1][2]]
    rests = [_rest(depth, low, a, b, noise) for low, (a, b) in zip(lows, pairwise(highs), strict=True)]
    cuts = [(a + b + 1) // 2 for a, b in rests]
    if rests[0][0] == 0:
        cuts[0] = rests[0][1] if clipped else 0
    if rests[-1][1] == len(depth) - 1:
        cuts[-1] = rests[-1][0] + 1 if clipped else len(depth)
    return list(pairwise(cuts))


def _rest(depth: np.ndarray, low: int, start: int, stop: int, noise: float) -> tuple[int, int]:
    """First and last sample of the rest at ``low``, between samples ``start`` and ``stop``."""
    before = np.flatnonzero(depth[start:low] > depth[low] + noise)
    after = np.flatnonzero(depth[low:stop] > depth[low] + noise)
    return start + int(before[-1]) + 1 if len(before) else start, low + int(after[0]) - 1 if len(after) else stop - 1


def part_of(recording: Recording, span: CycleSpan) -> Recording:
    """The samples of a cycle of a recording under its name; the clock is kept."""
    keep = slice(span.first, span.stop)
    columns = {each: getattr(recording, each)[keep].copy() for each in COLUMNS}
    axes = {each: values[keep].copy() for each, values in recording.axes.items()}
    part = f"{recording.card.part}: {span.name}" if recording.card.part else span.name
    return Recording(**columns, axes=axes, card=replace(recording.card, part=part), notes=_other_notes(recording))


def with_note(recording: Recording, spans: Sequence[CycleSpan]) -> Recording:
    """The recording with a note on its cycles, if they are more than those of a test with a second pass."""
    if len(spans) < MIN_CYCLES:
        return recording
    whole = f"{recording.card.part}: " if recording.card.part else ""
    one, every = f"{whole}{spans[-1].name}", f"{whole}cycle *"
    text = f"this recording has {len(spans)} cycles: --part '{one}' or part='{one}' reads one alone, "
    text += f"--part '{every}' or nf.read_all(path, part='{every}') each of them"
    return replace(recording, notes=(*_other_notes(recording), Note("cycles", text, len(spans))))


def _other_notes(recording: Recording) -> tuple[Note, ...]:
    """The notes without that on cycles, which a file of this package may hold already."""
    return tuple(note for note in recording.notes if note.kind != "cycles")


def spans_of_rows(counted: Sequence[tuple[str, int, int]], rows: np.ndarray) -> tuple[CycleSpan, ...]:
    """The cycles that a column counts, with name, first row, and the one after the last, as samples that were read from
    ``rows`` (n,) of the table; those of which fewer than two samples are left are left out."""
    found = [CycleSpan(name, *np.searchsorted(rows, (first, stop)).tolist()) for name, first, stop in counted]
    return tuple(each for each in found if each.stop - each.first > 1)


def chosen_cycle(recording: Recording, spans: Sequence[CycleSpan], wanted: str, place: str) -> Recording:
    """The cycle with this name, or number from 1. Raises InputError if there is none, or several fit."""
    if wanted.isdecimal() and 1 <= int(wanted) <= len(spans):
        return part_of(recording, spans[int(wanted) - 1])
    found = fitting(spans, wanted, place)
    if len(found) > 1:
        step = "Give one of their names; nf.read_all and campaign take each."
        raise InputError("number of cycles", len(found), f"one is read alone, and {wanted!r} fits several", place, step)
    return part_of(recording, found[0])


def fitting(spans: Sequence[CycleSpan], pattern: str, place: str) -> list[CycleSpan]:
    """The cycles whose names fit a name or a pattern with ``*``. Raises InputError if none does."""
    found = [each for each in spans if fnmatchcase(each.name.casefold(), " ".join(pattern.casefold().split()))]
    if found:
        return found
    limit = f"the recording has {listed(spans)}" if spans else "no cycles are found in the motion or in a column"
    step = "Give one of these names." if spans else "Leave it out to read the whole recording."
    raise InputError("part", repr(pattern[:60]), limit, place, step)
