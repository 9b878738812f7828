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
    later = samples >= after[0] if len(parts) == 2 else np.zeros(len(samples))
    fit = LineFit.of(np.array([np.ones_like(time), time - origin, later, force]), parts)
    slope, error = fit.coefficient([0, 1])
    if len(parts) == 2:
        step, step_error = fit.coefficient([0, 1, 2])
        if abs(step) > SIGNIFICANT * step_error:
            first, last = (float(recording.force[part].mean()) for part in parts)
            note = STEP.format(before=first, after=last)
            return Drift(uncertain_by=abs(last - first) / math.sqrt(12.0), note=note)
    if not abs(slope) > SIGNIFICANT * error:
        return Drift()
    return Drift(slope=slope, error=error, origin=origin, note=DRIFT.format(slope))


@dataclass(frozen=True, eq=False)
class LineFit:
    """Least squares of the last of the ``rows`` (p + 1, n) on some of the others, with the sums of products ``grams``
    (p + 1, p + 1) over each of the parts between ``ends``."""

    rows: np.ndarray
    ends: list[int]
    grams: list[np.ndarray]

    @classmethod
    def of(cls, rows: np.ndarray, parts: list[np.ndarray]) -> "LineFit":
        """The sums of products of the rows over each of the consecutive ``parts``."""
        ends = np.cumsum([0, *map(len, parts)]).tolist()
        grams = [core.gram(rows, first, last) for first, last in pairwise(ends)]
        return cls(rows, ends, grams)

    def coefficient(self, used: list[int]) -> tuple[float, float]:
        """The coefficient of the last of the rows that are ``used``, and its standard error from correlated noise; an
        infinite error where the samples do not determine it."""
        products = sum(self.grams)
        bread = inverse(products[np.ix_(used, used)])
        if not np.isfinite(bread).all():
            return 0.0, math.inf
        values = bread @ products[used, -1]
        residual = self.rows[-1] - sum(value * self.rows[row] for value, row in zip(values.tolist(), used))
        meat = np.zeros_like(bread)
        for (first, last), gram in zip(pairwise(self.ends), self.grams):
            lost = min(float(len(used)), 0.25 * (last - first))
            meat += noise_of(residual[first:last], last - first, 1, lost).long_run * gram[np.ix_(used, used)]
        return float(values[-1]), math.sqrt(max(float((bread @ meat @ bread)[-1, -1]), 0.0))
