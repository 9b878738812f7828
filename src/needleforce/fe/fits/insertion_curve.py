# SPDX-License-Identifier: Apache-2.0
"""A recorded insertion as means over short travels, with its reversals and what of it a fit of the solid uses."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ... import core
from ...errors import InputError
from ...recording import Recording
from ...segmentation.segment import segment

BIN_SHARE = 0.05  # of the path's spacing, over which samples are averaged far from a reversal
GROWTH, FINEST = 0.05, 0.0025  # of the distance from a reversal, of the spacing: travel where the shaft sticks
NOISE_TRAVELS = 6.0  # [sd of the depth] shortest travel of a mean: less is motion that noise makes
MAX_BINS = 5000
MIN_REVERSAL = 4  # [bins] travel of a reversal that counts
_AFTER_PUNCTURE, _AFTER_SHARE = 0.3e-3, 0.25  # [m], [of the indentation] travel until the shaft slides everywhere
_WITHOUT_PUNCTURE = 0.25  # [of the deepest indentation] the same, where no breakthrough is found
MIN_ADVANCES = 10  # means over which the needle cuts
MIN_SPACINGS = 3.0  # of the path, of travel
_RESTS, _GROWTH = 4.0, 1.3  # [of the median time of a mean] longer ones are rests: several means, each that much longer


@dataclass(frozen=True, eq=False)
class InsertionCurve:
    """Means (m,) over short travels, and the turning points between them.

    Weights are of a residual, by how many samples a mean has; 0 where the needle turns, and in the deformation before
    the breakthrough, whose contact law is not that of the solid. The resolution of the depth is the travel of a sample,
    or of the finest mean where noise makes it longer.
    """

    time: np.ndarray  # [s]
    depth: np.ndarray  # [m] through which the needle goes, in the zero of the recording
    force: np.ndarray  # [N] NaN where the needle turns
    weight: np.ndarray  # [1]
    rests: np.ndarray  # True while the needle rests
    contact_depth: float  # [m]
    puncture_depth: float  # [m] where the needle breaks through
    resolution: float  # [m]
    reversal: float  # [m] longest travel after a reversal in the tissue

    @property
    def used(self) -> np.ndarray:
        """True (m,) for means with a weight."""
        return self.weight > 0.0

    @property
    def cuts(self) -> np.ndarray:
        """True (m,) for those of them that go deeper than any before, in the tissue."""
        deepest = np.maximum.accumulate(self.depth)
        return self.used & ~self.rests & (self.depth >= deepest) & (deepest > self.contact_depth)


def insertion_curve(
    recording: Recording, spacing: float, contact_depth: float | None, puncture_depth: float | None
) -> InsertionCurve:
    """The curve of a recording for a path with a spacing [m]; depths of events that are None are searched. Raises
    InputError if values are not finite, or the needle does not move, touch or turn."""
    _check_readable(recording, spacing)
    contact, puncture = _events(recording, contact_depth, puncture_depth)
    time, depth, force, count, rests = _averaged(recording, spacing)
    if puncture > contact:
        slides = puncture + max(_AFTER_PUNCTURE, _AFTER_SHARE * (puncture - contact))
    else:
        slides = contact + _WITHOUT_PUNCTURE * (float(depth.max()) - contact)
    above = depth < contact - BIN_SHARE * spacing
    used = np.logical_and.accumulate(above) | (np.maximum.accumulate(depth) > slides)
    weight = np.where(used, np.sqrt(np.minimum(count / np.median(count[count > 0]), 1.0)), 0.0)
    moves = np.abs(np.diff(recording.depth))
    resolution = max(_finest(recording.depth, spacing), float(np.median(moves[moves > 0.0])))
    reversal = _reversal(depth, np.isnan(force), contact, puncture)
    curve = InsertionCurve(
        time=time, depth=depth, force=force, weight=weight, rests=rests, contact_depth=contact,
        puncture_depth=puncture, resolution=resolution, reversal=reversal,
    )  # fmt: skip
    _check_advance(curve)
    return curve


def _check_readable(recording: Recording, spacing: float) -> None:
    for name in ("time", "depth", "force"):
        values = getattr(recording, name)
        if not np.all(np.isfinite(values)):
            where = int(np.flatnonzero(~np.isfinite(values))[0])
            raise InputError(name, f"{values[where]} at sample {where}", "must be finite", next_step="Leave it out.")
    span = float(np.ptp(recording.depth)) if len(recording.depth) else 0.0
    if not span > MIN_SPACINGS * spacing:
        limit = f"must be more than {1e3 * MIN_SPACINGS * spacing:.3g} mm, {MIN_SPACINGS:g} spacings of the path"
        raise InputError("travel of the needle", f"{1e3 * span:.3g} mm", limit, next_step="Give the depth in m.")


def _events(recording: Recording, contact: float | None, puncture: float | None) -> tuple[float, float]:
    """Depths of contact and breakthrough [m]; without a puncture the tip cuts from the contact on."""
    for name, value in (("contact_depth", contact), ("puncture_depth", puncture)):
        if value is not None and not recording.depth.min() <= value <= recording.depth.max():
            limit = "is outside the recorded depths"
            raise InputError(name, f"{1e3 * value:g} mm", limit, next_step="Give it in m, in the zero of the depth.")
    if contact is not None and puncture is not None:
        return contact, puncture
    events = segment(recording)
    if contact is None and events.contact is None:
        reason = events.notes[-1] if events.notes else "the force shows none"
        step = "Give contact_depth, or a recording from free travel on."
        raise InputError("contact", "not found", reason.rstrip("."), next_step=step)
    contact = events.contact.depth if contact is None else contact
    if puncture is None:
        deeper = [each for each in events.punctures if each.depth > contact]
        puncture = deeper[0].depth if deeper else contact
    return contact, puncture


def _averaged(recording: Recording, spacing: float) -> tuple[np.ndarray, ...]:
    """Time [s], depth [m] and force [N] of means and turning points, how many samples each has, and whether the needle
    rests; no force, none of these."""
    noise, finest = _noise(recording.depth), _finest(recording.depth, spacing)
    travel = float(np.abs(np.diff(recording.depth)).sum())
    width = max(BIN_SHARE * spacing, noise, travel / MAX_BINS)
    turns = core.reversals(recording.depth, MIN_REVERSAL * width)
    ends = [float(np.mean(recording.depth[_around(recording.depth, turn, noise)])) for turn in turns]
    parts = []
    for (first, last), (start, end) in zip(pairwise(turns), pairwise(ends)):
        here, way = slice(first, last + 1), np.sign(end - start)
        travels, time = way * (recording.depth[here] - start), recording.time[here]
        number = _numbers(np.clip(travels, 0.0, way * (end - start)), finest, width)
        number, rests = _divided(np.maximum.accumulate(number), time)
        at, times, force, count = _means(number, travels, time, recording.force[here])
        at = start + way * np.clip(np.maximum.accumulate(at), 0.0, way * (end - start))
        rows = (times, time[-1]), (at, end), (force, np.nan), (count, 0), (rests, False)
        parts.append([np.append(*row) for row in rows])
    return tuple(np.concatenate(each) for each in zip(*parts))


def _divided(number: np.ndarray, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The numbers (n,) of samples, which increase, so that a mean over a rest becomes several; and which means are
    such."""
    first = np.flatnonzero(np.diff(number, prepend=-1))
    counts = np.diff(first, append=len(number))
    elapsed = (time - np.repeat(time[first], counts)) / max(
        _RESTS * np.median(np.diff(time[first], append=time[-1])), 1e-9
    )
    within = np.where(elapsed < 1.0, 0.0, 1.0 + np.log(np.maximum(elapsed, 1.0)) / np.log(_GROWTH)).astype(int)
    begins = (np.diff(number, prepend=-1) > 0) | (np.diff(within, prepend=0) != 0)
    rests = np.repeat(np.maximum.reduceat(within, first) > 0, counts)
    return np.cumsum(begins) - 1, rests[begins]


def _means(number: np.ndarray, *values: np.ndarray) -> list[np.ndarray]:
    """Of values by the number of each sample, and last the counts of samples."""
    count = np.bincount(number)
    return [*(np.bincount(number, each) / count for each in values), count]


def _noise(depth: np.ndarray) -> float:
    """Travel that noise of the depth makes [m]."""
    return NOISE_TRAVELS * core.second_difference_noise(depth)


def _finest(depth: np.ndarray, spacing: float) -> float:
    """Travel of a mean just after a reversal [m]."""
    return max(FINEST * spacing, _noise(depth))


def _numbers(travel: np.ndarray, finest: float, width: float) -> np.ndarray:
    """Number of the mean for a travel from a reversal [m]: they grow from ``finest`` to ``width``."""
    turn, wide = (width - finest) / GROWTH, np.log(width / finest) / GROWTH
    graded = np.log1p(GROWTH * travel / finest) / GROWTH
    return np.where(travel < turn, graded, wide + (travel - turn) / width).astype(int)


def _around(depth: np.ndarray, turn: int, noise: float) -> slice:
    """Samples around a turning point that noise or rest keeps near it: their mean is where the needle turns."""
    near = np.abs(depth - depth[turn]) <= noise
    before, after = np.flatnonzero(~near[:turn]), np.flatnonzero(~near[turn:])
    return slice(int(before[-1]) + 1 if len(before) else 0, turn + int(after[0]) if len(after) else len(depth))


def _check_advance(curve: InsertionCurve) -> None:
    """Raise InputError if the needle does not cut on after the breakthrough."""
    advances = int(curve.cuts.sum())
    if advances < MIN_ADVANCES:
        limit = f"at least {MIN_ADVANCES} means deeper than {1e3 * curve.puncture_depth:.4g} mm are needed"
        step = "Insert deeper, or give puncture_depth."
        raise InputError("travel after the breakthrough", f"{advances} means", limit, next_step=step)


def _reversal(depth: np.ndarray, turns: np.ndarray, contact: float, puncture: float) -> float:
    """Longest travel after a reversal in the tissue [m]. Raises InputError if there is none: then the shaft never
    sticks, and the force shows no modulus."""
    deepest, points = np.maximum.accumulate(depth)[turns], depth[turns]
    within = (deepest > puncture) & (points > contact)
    travels = np.abs(np.diff(points))[within[:-1]]
    if not len(travels):
        step = "Record the withdrawal too, or pull back by a few millimetres on the way."
        limit = "without one the shaft always slides, and the force shows no modulus"
        raise InputError("number of reversals in the tissue", 0, limit, next_step=step)
    return float(travels.max())
