# SPDX-License-Identifier: Apache-2.0
"""Single samples far beyond both neighbours: no needle does that, a sensor or a cable does."""

import numpy as np

from .recording import Note

_FEWEST = 20  # samples
_NOISE = 20.0  # median second differences
_RANGE = 0.5  # of the range of all other samples …
_END_RANGE = 10.0  # … or so many at either end of a noisy force: there a step looks like a spike
_ALIKE = 0.2  # of its height: by so much the neighbours of a spike may differ
_AT_MOST = 0.01  # of all samples: more are no glitches


def glitches(force: np.ndarray) -> np.ndarray:
    """Sample numbers of the isolated spikes, one sample wide, in (n,) ``force``; a peak before a fall is none.

    Each differs from the mean of its two neighbours, which agree, by more than 20 median second differences and by
    more than half of the range of all other samples.
    """
    if len(force) < _FEWEST:
        return np.empty(0, int)
    second = np.abs(np.diff(force, 2))
    ends = abs(force[1] - force[0]), abs(force[-1] - force[-2])
    if max(0.5 * float(second.max()), *ends) <= _RANGE * _least_range(force):
        return np.empty(0, int)
    height, noise = np.concatenate((ends[:1], 0.5 * second, ends[1:])), float(np.median(second))
    before, after = np.append(force[2], force[:-1]), np.append(force[1:], force[-3])
    alone = (height > _NOISE * noise) & (np.abs(after - before) < _ALIKE * height)
    rest = force[~alone]
    if not alone.any() or not len(rest):
        return np.empty(0, int)
    size = float(np.ptp(rest))
    least = np.full(len(force), max(_RANGE * size, _NOISE * _quantum(rest)))
    least[[0, -1]] = _END_RANGE * size if noise > 0.0 else np.inf
    found = np.flatnonzero(alone & (height > least))
    return found if len(found) <= _AT_MOST * len(force) else np.empty(0, int)


def glitch_notes(time: np.ndarray, force: np.ndarray) -> list[Note]:
    """A note on the spikes in (n,) ``force`` [N] over ``time`` [s], if there are any."""
    found = glitches(force)
    return [Note("glitch", f"{spikes(time, force, found)}: told, not removed", len(found))] if len(found) else []


def spikes(time: np.ndarray, force: np.ndarray, found: np.ndarray) -> str:
    """In words, how many glitches were ``found``, and the largest of them."""
    worst = int(found[np.argmax(np.abs(force[found]))])
    what = f"of {force[worst]:.4g} N at {time[worst]:.6g} s, far beyond its neighbours"
    if len(found) == 1:
        return f"the force has a spike, one sample wide, {what}"
    return f"the force has {len(found)} spikes, one sample wide, the largest {what}"


def _least_range(force: np.ndarray) -> float:
    """What the range of all other samples exceeds, without knowing the spikes: of two neighbours one is none."""
    lower, upper = np.minimum(force[1:], force[:-1]), np.maximum(force[1:], force[:-1])
    return float(lower.max() - upper.min())


def _quantum(values: np.ndarray) -> float:
    """The smallest step of (n,) values, 0 if they are constant: a coarse sensor's last digit is no spike."""
    steps = np.abs(np.diff(values))
    steps = steps[steps > 0.0]
    return float(steps.min()) if len(steps) else 0.0
