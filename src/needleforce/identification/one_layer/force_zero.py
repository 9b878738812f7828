# SPDX-License-Identifier: Apache-2.0
"""The sensor's zero as the free travel shows it: which samples are free, and whether the zero drifts over time or
changes over the travel, as by a cable that is pulled along.

The zero itself is a parameter of each fit, with these samples as data. A slope is one too where the free travel shows
it: a slope over time or over depth that its noise explains once in a thousand recordings each. Free travel before the
insertion alone, at one speed, does not distinguish the two: then it is called a drift over time.
"""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ... import core
from ...recording import Recording
from ...segmentation import Events
from ..statistics.noise import DriftEffect, noise_of
from ..statistics.regression import inverse
from ..strokes import Strokes

FALSE_ALARMS = 1e-3  # drifts, and steps, that are found in a recording whose free travel has only noise
ALL = slice(None)
MIN_FREE_SAMPLES = 10  # of a part of the free travel
STEP = (
    "The force without contact is {before:.3g} N before the insertion and {after:.3g} N after it, and this is not a "
    "steady drift: the sensor's zero is uncertain by as much."
)
DRIFT = {
    "time": "The sensor's zero drifts by {:.3g} N/s, as the free travel shows; the drift is part of the fit.",
    "depth": (
        "The force without contact changes by {:.3g} N/m of travel, as the free travel before and after shows: does a "
        "cable pull or a guide rub? The slope is part of the fit."
    ),
}


@dataclass(frozen=True, kw_only=True)
class Drift:
    """``slope`` of the sensor's zero with its standard error, ``over`` the time [N/s] or the depth [N/m], about the
    ``origin`` [s or m] where the zero is best known; 0 where the free travel shows none. ``uncertain_by`` [N] is a
    change that is no steady drift."""

    slope: float = 0.0
    error: float = 0.0
    origin: float = 0.0
    over: str = "time"
    uncertain_by: float = 0.0
    note: str = ""

    def at(self, recording: Recording, samples: np.ndarray | slice = ALL) -> np.ndarray:
        """Change of the zero (n,) [N] at samples of the recording."""
        return self.slope * self._lever(recording, samples)

    def effect(self, recording: Recording, samples: np.ndarray) -> DriftEffect | None:
        """The slope as an error of the fit at samples of the recording; None without one."""
        return DriftEffect(lever=self._lever(recording, samples), error=self.error) if self.error > 0.0 else None

    def _lever(self, recording: Recording, samples: np.ndarray | slice) -> np.ndarray:
        return getattr(recording, self.over)[samples] - self.origin


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

    A line over time, or over depth if that leaves less, through both parts with its long-run noise. Where a step
    between the parts explains them better than the line, it is no drift.
    """
    parts = [part for part in (before, after) if len(part) >= MIN_FREE_SAMPLES]
    if not parts:
        return Drift()
    lines = [_line(recording, parts, over) for over in (("time", "depth") if len(parts) == 2 else ("time",))]
    over, origin, fit = min(lines, key=lambda line: line[2].squares([0, 1]))
    slope = fit.coefficient([0, 1])
    if len(parts) == 2 and fit.coefficient([0, 1, 2]).is_significant:
        first, last = (float(recording.force[part].mean()) for part in parts)
        return Drift(uncertain_by=abs(last - first) / math.sqrt(12.0), note=STEP.format(before=first, after=last))
    if not slope.is_significant:
        return Drift()
    note = DRIFT[over].format(slope.value)
    return Drift(slope=slope.value, error=slope.error, origin=origin, over=over, note=note)


def _line(recording: Recording, parts: list[np.ndarray], over: str) -> tuple[str, float, "LineFit"]:
    """The line over time or depth through the free samples: over which, from where, and its sums of products."""
    samples = np.concatenate(parts)
    x, force = getattr(recording, over)[samples], recording.force[samples]
    origin = float(x.mean())
    later = samples >= parts[-1][0] if len(parts) == 2 else np.zeros(len(samples))
    return over, origin, LineFit.of(np.array([np.ones_like(x), x - origin, later, force]), parts)


def slope_without_contact(place: np.ndarray, force: np.ndarray) -> "Coefficient":
    """The slope of the (n,) force of free travel over its place."""
    rows = np.array([np.ones_like(place), place - place.mean(), force])
    return LineFit.of(rows, [np.arange(len(place))]).coefficient([0, 1])


@dataclass(frozen=True, kw_only=True)
class Coefficient:
    """A coefficient with its standard error from correlated noise, and the size that noise ``explains``; infinite where
    the samples do not determine it."""

    value: float
    error: float
    explains: float

    @property
    def is_significant(self) -> bool:
        """Whether noise does not explain it."""
        return abs(self.value) > self.explains


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

    def coefficient(self, used: list[int]) -> Coefficient:
        """The coefficient of the last of the rows that are ``used``.

        The noise is known from few independent samples where it is correlated: the size that it explains follows
        Student's distribution with their number, less that of the coefficients. There are no more of them than the
        residual has runs of one sign, so that a transient of the amplifier, which is no line, is no drift.
        """
        from scipy.special import stdtrit

        bread, values, residual = self._solved(used)
        if not np.isfinite(bread).all():
            return Coefficient(value=0.0, error=math.inf, explains=math.inf)
        meat, independent = self._meat(residual, used)
        error = math.sqrt(max(float((bread @ meat @ bread)[-1, -1]), 0.0))
        student = float(stdtrit(max(independent, 1.0), 1.0 - 0.5 * FALSE_ALARMS))
        return Coefficient(value=float(values[-1]), error=error, explains=error * student)

    def squares(self, used: list[int]) -> float:
        """The sum of squares [N²] that the ``used`` rows leave."""
        residual = self._solved(used)[2]
        return float(residual @ residual)

    def _solved(self, used: list[int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The inverse of the products, the coefficients and the residual (n,); all of it is left where the samples do
        not determine them."""
        products = sum(self.grams)
        bread = inverse(products[np.ix_(used, used)])
        values = bread @ products[used, -1] if np.isfinite(bread).all() else np.zeros(len(used))
        residual = self.rows[-1] - sum(value * self.rows[row] for value, row in zip(values.tolist(), used))
        return bread, values, residual

    def _meat(self, residual: np.ndarray, used: list[int]) -> tuple[np.ndarray, float]:
        """The middle of the sandwich (p, p) from the long-run noise of each part; number of independent samples."""
        meat, independent = np.zeros((len(used), len(used))), -float(len(used))
        for (first, last), gram in zip(pairwise(self.ends), self.grams):
            part = residual[first:last]
            noise = noise_of(part, last - first, 1, min(float(len(used)), 0.25 * (last - first)))
            runs = 1 + int(np.count_nonzero(np.diff(part > 0.0)))
            known = (last - first) * noise.variance / noise.long_run if noise.long_run > 0.0 else 0.0
            independent += min(known, runs)
            meat += noise.long_run * gram[np.ix_(used, used)]
        return meat, independent
