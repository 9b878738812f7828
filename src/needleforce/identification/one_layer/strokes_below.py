# SPDX-License-Identifier: Apache-2.0
"""The strokes of a fit below its puncture, each with the line that it allows by itself, and their bends: by friction
that changes with time or depth, or a gain of the sensor that drifts."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ... import core
from ...vocabulary import SMALLEST
from ..statistics.noise import TWO_SIDED, noise_of, slow_noise
from ..statistics.regression import inverse
from .cycle_values import CycleFit
from .loading_curves import CURVES, FITS
from .segmented_recording import SegmentedRecording

AFTER = ("friction_per_length", "cutting_force")
INTACT = 1e-4  # of the contact that a gradual rupture leaves, so that none of it is in the friction behind
MIN_SAMPLES = 20  # of a stroke in the tissue, for a line of its own
CHANGES = (
    "Insertion and withdrawal are bent as by friction per length that changes with time, from {:.3g} N/m at the start "
    "of the recording to {:.3g} N/m at the exit: friction may age, or the gain of the sensor drift. The intervals hold "
    "what that gives at the start."
)
BENT = (
    "The insertion below the puncture is bent, as by friction per length that begins with {:.3g} N/m and changes with "
    "time or depth: the intervals of friction and cutting force hold that too."
)


@dataclass(frozen=True, eq=False, kw_only=True)
class Stroke:
    """One stroke below the puncture: embedded length (n,) [m] and force (n,) [N] without the zero, positive against
    insertion, and time (n,) since the recording's start over that up to the exit, which is ``touched`` at the contact;
    ``inwards`` is the sign of its friction. Sums over its samples are computed once."""

    length: np.ndarray
    force: np.ndarray
    time: np.ndarray
    touched: float
    inwards: bool
    filter_length: int

    @property
    def name(self) -> str:
        """Of the reading in which this stroke alone decides on friction."""
        return "insertion" if self.inwards else "withdrawal"

    @cached_property
    def line(self) -> np.ndarray:
        """The straight lines (2, n) that a stroke by itself allows: friction, and any level."""
        return np.array([self.length if self.inwards else -self.length, np.ones_like(self.length)])

    @cached_property
    def shown(self) -> np.ndarray:
        """1 (2,) for friction per length and, in the insertion, for the cutting force: the lines that strokes share."""
        return np.array([1.0, float(self.inwards)])

    @cached_property
    def products(self) -> np.ndarray:
        """Sums of products (3, 3) of the lines and the force."""
        return core.gram(np.vstack([self.line, self.force]))

    @cached_property
    def gram(self) -> np.ndarray:
        """Those (2, 2) of the derivatives by friction per length and cutting force."""
        return self.products[:2, :2] * np.outer(self.shown, self.shown)

    @cached_property
    def bread(self) -> np.ndarray:
        """Inverse (2, 2) of the products of the lines."""
        return inverse(self.products[:2, :2])

    @cached_property
    def bent(self) -> np.ndarray:
        """What its own line leaves (n,) [N]; a line that both strokes share leaves misfit in it."""
        return self.force - self.own @ self.line

    @cached_property
    def noise(self) -> float:
        """Long-run variance [N²] of what its own parabola leaves: a bend is no noise, which would hide it."""
        curve = self.length**2
        curve = curve - self.bread @ (self.line @ curve) @ self.line
        left = self.bent - curve * float(curve @ self.bent) / max(float(curve @ curve), SMALLEST)
        return noise_of(left, len(left), self.filter_length, 3.0).long_run

    @cached_property
    def slow(self) -> float:
        """The same with its slow misfit."""
        return slow_noise(self.bent, self.line.T, self.noise)

    @cached_property
    def own(self) -> np.ndarray:
        """Friction per length and level of this stroke alone, (2,)."""
        return self.bread @ self.products[:2, 2]

    @cached_property
    def halves(self) -> np.ndarray:
        """The half widths (2,) of their intervals."""
        return TWO_SIDED * np.sqrt(self.slow * self.bread.diagonal())


def strokes_below(fit: CycleFit, single: SegmentedRecording) -> list[Stroke]:
    """The strokes of a fit below its puncture, those with enough samples."""
    strokes, time = single.strokes, single.recording.time
    contact, zero, w = fit.values["contact_depth"], fit.values["force_offset"], fit.puncture.left_out
    used = slice(max(fit.puncture.before, _fallen(fit, strokes.depth_in)) + w, len(strokes.depth_in) - w)
    cut = strokes.depth_in[used] - contact, strokes.force_in[used] - zero, time[strokes.index_in[used]]
    back = strokes.depth_out[w:] - contact, strokes.force_out[w:] - zero, time[strokes.index_out[w:]]
    inside = back[0] > 0.0
    parts = [(*cut, True), (*(each[inside] for each in back), False)]
    parts = [part for part in parts if len(part[0]) >= MIN_SAMPLES]
    if not parts:
        return []
    lasts = float(parts[-1][2][-1] - time[0])
    touched = time[strokes.index_in[min(int(np.searchsorted(strokes.depth_in, contact)), used.start)]]
    shared = {"touched": float(touched - time[0]) / lasts, "filter_length": single.recording.card.filter_length}
    return [
        Stroke(length=length, force=force, time=(times - time[0]) / lasts, inwards=inwards, **shared)
        for length, force, times, inwards in parts
    ]


def _fallen(fit: CycleFit, depth: np.ndarray) -> int:
    """The first sample of the insertion at a ``depth`` (n,) [m] behind a gradual rupture; 0 for a sharp one."""
    values = fit.values
    if "rupture_length" not in values:
        return 0
    length = values["rupture_length"] * math.log(1.0 / INTACT) ** (1.0 / values["rupture_exponent"])
    return int(np.searchsorted(depth, values["contact_depth"] + values["rupture_onset"] + length))


@dataclass(frozen=True, eq=False, kw_only=True)
class Bend:
    """``growth`` of the friction per length [N/m] over the time by the bend of strokes, with its standard ``error``;
    friction per length before it and cutting force then, ``after`` (2,), and their half widths; and the share of the
    time up to the puncture, None where the gain of the sensor may not have changed so."""

    growth: float
    error: float
    after: np.ndarray
    halves: np.ndarray
    puncture: float | None

    @property
    def significance(self) -> float:
        """The growth in standard errors."""
        return self.growth / self.error

    @property
    def sentence(self) -> str:
        """What it may be, for a note."""
        return (BENT if self.puncture is None else CHANGES).format(*self.after[:1], self.after[0] + self.growth)

    def applied(self, fit: CycleFit) -> CycleFit:
        """The fit with it, and with the gain that the sensor then has at the puncture."""
        low, high, values = dict(fit.low), dict(fit.high), dict(fit.values)
        for name, value, half in zip(AFTER, self.after.tolist(), self.halves.tolist()):
            values[name], low[name], high[name] = value, value - half, value + half
        if self.puncture is not None and self.after[0] > 0.0:
            gain = max(1.0 + self.puncture * self.growth / float(self.after[0]), 0.5)
            for name in ("puncture_force", *CURVES[FITS[fit.law].law.name].amplitudes):
                values[name], low[name], high[name] = (each[name] / gain for each in (values, low, high))
        return replace(fit, values=values, low=low, high=high)


def bends_of(fit: CycleFit, parts: list[Stroke]) -> dict[str, Bend]:
    """The bend that both strokes share, by a force that grows with the time since the recording's start, and that of
    the insertion alone, by friction that grows with the logarithm of the time since the contact, as contacts age, or
    with depth. Any line of each stroke is left out of the bend, so that strokes that disagree are not bent."""
    touched = parts[0].touched
    scale = max(float(parts[0].time[0]) - touched, SMALLEST)
    found = {"bend": _bend(fit, parts[:1], lambda time: np.log1p(np.maximum(time - touched, 0.0) / scale))}
    return found | {"time": _bend(fit, parts, lambda time: time)} if len(parts) > 1 else found


def _bend(fit: CycleFit, parts: list[Stroke], growing: Callable) -> Bend:
    """The bend of strokes by friction that grows as ``growing`` of the time."""
    along, across, force, lever = 0.0, 0.0, np.zeros(2), np.zeros(2)
    for part in parts:
        column, noise = part.line[0] * growing(part.time), max(part.noise, SMALLEST)
        common = part.line @ column
        along += float(column @ part.bent) / noise
        across += float(column @ column - common @ part.bread @ common) / noise
        force, lever = force + part.shown * part.products[:2, 2], lever + part.shown * common
    growth, error = along / max(across, SMALLEST), 1.0 / math.sqrt(max(across, SMALLEST))
    bread = inverse(sum(part.gram for part in parts))
    force, lever = bread @ force, bread @ lever
    noise = np.array([0.5 * (fit.high[name] - fit.low[name]) for name in AFTER])
    halves = np.hypot(noise, TWO_SIDED * np.sqrt(parts[0].noise * bread.diagonal() + (error * lever) ** 2))
    puncture = float(parts[0].time[0]) if len(parts) > 1 else None
    return Bend(growth=growth, error=error, after=force - growth * lever, halves=halves, puncture=puncture)
