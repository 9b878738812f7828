# SPDX-License-Identifier: Apache-2.0
"""The signs of depth and force, recognised where the data show them: a needle goes in before it comes out, and what it
does to the tissue costs work."""

from dataclasses import dataclass

import numpy as np

from .. import core

RETURNED = 0.2  # of the travel: a recording that ends so near to its start is of a complete cycle
_ENDS = 0.1  # of the travel at either end of a single stroke, whose forces are compared
_RATIO = 3.0  # of the forces at both ends, and of work done and given back, beyond which a sign is sure
_FREE = 0.02  # of the travel: its forces are the value at the start
_MIN_SAMPLES, _NOISE = 20, 10.0  # samples of a stroke, and noise of the force, below which it shows no sign

DEPTH_REVERSED = "depth decreases while the needle goes in: its sign is reversed (--depth-inwards increasing keeps it)"
FORCE_REVERSED = "the force falls while the needle goes in: its sign is reversed (--unit force=+N keeps it)"
WITHDRAWAL = (
    "depth decreases, and the force does not show an insertion: it is taken for a withdrawal "
    "(--depth-inwards decreasing makes it an insertion)"
)


@dataclass(frozen=True)
class Signs:
    """Factors of +1 or -1 for depth and force, with a sentence for each that is assumed."""

    depth: float = 1.0
    force: float = 1.0
    sentences: tuple[str, ...] = ()


def signs_of(depth: np.ndarray, force: np.ndarray, *, depth_known: bool = False, force_known: bool = False) -> Signs:
    """Recognise reversed signs.

    Parameters
    ----------
    depth, force : (n,) array
        As in the file, in SI.
    depth_known, force_known : bool
        The sign was given and is not changed.

    Returns
    -------
    Signs
        Factors, and what was assumed.

    Notes
    -----
    The stroke is the motion from the first sample to the farthest one. It is an insertion if the recording returns to
    where it began, as a needle cannot be drawn out before it was inserted, or if it begins with free travel: the force
    changes within the first tenth of the travel by less than a third of its change within the last tenth; a withdrawal
    ends so. Where neither holds, the force at the end must be three times that at the start. Any other stroke is left
    as it is, and a sentence states so if its depth decreases. Along an insertion the force does
    work against the motion: the force is reversed if this work is negative and three times the work with the other
    sign. A constant bias does not matter, because the force counts from its value at the start; a force that changes by
    less than ten times its noise, of which white noise is capable in none of 1e12 recordings, shows no sign.
    """
    if len(depth) < 2 or np.ptp(depth) == 0.0:
        return Signs()
    far = int(np.argmax(np.abs(depth - depth[0])))
    outwards = bool(depth[far] < depth[0])
    stroke, travel = force[: far + 1], np.abs(depth[: far + 1] - depth[0])
    inserted = _is_insertion(depth, travel, stroke)
    if outwards and not depth_known and not inserted:
        return Signs(sentences=(WITHDRAWAL,))
    turned = outwards and not depth_known
    reverse = (inserted and (turned or not outwards)) and not force_known and _is_against(travel, stroke)
    sentences = (DEPTH_REVERSED,) * turned + (FORCE_REVERSED,) * reverse
    return Signs(-1.0 if turned else 1.0, -1.0 if reverse else 1.0, sentences)


def _is_insertion(depth: np.ndarray, travel: np.ndarray, force: np.ndarray) -> bool:
    """Whether the first stroke goes in."""
    full = float(travel[-1])
    if abs(depth[-1] - depth[0]) <= RETURNED * full:
        return True
    start, end = force[travel <= _ENDS * full], force[travel >= (1.0 - _ENDS) * full]
    noise = core.second_difference_noise(np.ascontiguousarray(force, float))
    if len(force) < _MIN_SAMPLES or np.abs(np.median(end) - np.median(start)) <= _NOISE * noise:
        return False
    changes = _change_within(start), _change_within(end)
    if max(changes) > _RATIO * min(changes):
        return changes[1] > changes[0]
    return bool(np.abs(np.median(end)) > _RATIO * np.abs(np.median(start)))


def _change_within(force: np.ndarray) -> float:
    """By how much a force changes from the first to the second half of its samples."""
    half = max(1, len(force) // 2)
    return float(np.abs(np.median(force[half:]) - np.median(force[:half]))) if len(force) > 1 else 0.0


def _is_against(travel: np.ndarray, force: np.ndarray) -> bool:
    """Whether the force helps the motion along the first stroke, counted from its value at the start."""
    change = force - np.median(force[travel <= _FREE * travel[-1]])
    shown = float(np.abs(change).max()) / _NOISE
    if len(force) < _MIN_SAMPLES or core.noise_exceeds(np.ascontiguousarray(force, float), shown):
        return False
    work = 0.5 * (change[1:] + change[:-1]) * np.diff(travel)
    return bool(-work[work < 0.0].sum() > _RATIO * work[work > 0.0].sum())
