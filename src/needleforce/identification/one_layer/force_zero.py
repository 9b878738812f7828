# SPDX-License-Identifier: Apache-2.0
"""The sensor's zero as the free travel shows it: which samples are free, and whether the zero drifts over time.

The zero itself is a parameter of each fit, with these samples as data. A drift is one too where the free travel shows
it: a slope over time that its noise explains once in a thousand recordings.
"""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ... import core
from ...recording import Recording
from ...segmentation import Events
from ..statistics.noise import noise_of
from ..statistics.regression import inverse
from ..strokes import Strokes

SIGNIFICANT = 3.29  # [standard errors] noise exceeds it once in a thousand recordings
MIN_FREE_SAMPLES = 10  # of a part of the free travel
STEP = (
    "The force without contact is {before:.3g} N before the insertion and {after:.3g} N after it, and this is not a "
    "steady drift: the sensor's zero is uncertain by as much."
)
DRIFT = "The sensor's zero drifts by {:.3g} N/s, as the free travel shows; the drift is part of the fit."


@dataclass(frozen=True, kw_only=True)
class Drift:
    """``slope`` [N/s] of the sensor's zero with its standard error, about the time ``origin`` [s] where the zero is
    best known; 0 where the free travel shows none. ``uncertain_by`` [N] is a change that is no steady drift."""

    slope: float = 0.0
    error: float = 0.0
    origin: float = 0.0
    uncertain_by: float = 0.0
    note: str = ""

    def at(self, time: np.ndarray) -> np.ndarray:
        """Change of the zero (n,) [N] at times (n,) [s]."""
        return self.slope * (time - self.origin)


def free_samples(strokes: Strokes, events: Events, usable: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sample numbers of the free travel before the contact and after the exit."""
    before = after = np.empty(0, int)
    if events.contact is not None:
        before = np.arange(strokes.inwards.start, max(events.contact.low, strokes.inwards.start))
    if events.exit is not None:
        after = np.arange(events.exit.high + 1, max(strokes.outwards.stop, events.exit.high + 1))
    return before[usable[before]], after[usable[after]]


def drift_of(recording: Recording, before: np.ndarray, after: np.ndarray) -> Drift:
    """The drift of the zero from the free samples before contact and after exit.

    A line over time through both parts with its long-run noise. Where a step between the parts explains them better
    than the line, it is no drift.
    """
    parts = [part for part in (before, after) if len(part) >= MIN_FREE_SAMPLES]
    if not parts:
        return Drift()
    samples = np.concatenate(parts)
    time, force = recording.time[samples], recording.force[samples]
    origin = float(time.mean())
    line = [np.ones_like(time), time - origin]
    slope, error = _coefficient(np.array(line), force, parts, 1)
    if len(parts) == 2:
        step, step_error = _coefficient(np.array([*line, samples >= after[0]]), force, parts, 2)
        if abs(step) > SIGNIFICANT * step_error:
            levels = (float(recording.force[part].mean()) for part in parts)
            first, last = levels
            note = STEP.format(before=first, after=last)
            return Drift(uncertain_by=abs(last - first) / math.sqrt(12.0), note=note)
    if not abs(slope) > SIGNIFICANT * error:
        return Drift()
    return Drift(slope=slope, error=error, origin=origin, note=DRIFT.format(slope))


def _coefficient(design: np.ndarray, force: np.ndarray, parts: list[np.ndarray], at: int) -> tuple[float, float]:
    """Least-squares coefficient ``at`` of force (n,) on design (p, n), and its standard error from correlated noise; an
    infinite error where the samples do not determine it."""
    products = core.gram(np.vstack([design, force]))
    bread = inverse(products[:-1, :-1])
    if not np.isfinite(bread).all():
        return 0.0, math.inf
    values = bread @ products[:-1, -1]
    residual = force - sum(value * row for value, row in zip(values.tolist(), design))
    ends = np.cumsum([0, *map(len, parts)])
    meat = np.zeros_like(bread)
    for first, last in pairwise(ends):
        part = np.ascontiguousarray(design[:, first:last])
        lost = min(float(len(design)), 0.25 * (last - first))
        meat += noise_of(residual[first:last], last - first, 1, lost).long_run * core.gram(part)
    return float(values[at]), math.sqrt(max(float((bread @ meat @ bread)[at, at]), 0.0))
