# SPDX-License-Identifier: Apache-2.0
"""The force at the puncture: measured, modelled, and whether the law meets the measured one."""

import math
from dataclasses import dataclass, replace

import numpy as np

from ...models.parameter_units import UNITS
from ...segmentation import Puncture
from ...segmentation.strokes import white_noise
from ..estimates import Estimate
from ..statistics.noise import SIGNIFICANT, TWO_SIDED, Noise
from ..statistics.regression import coefficients, inverse
from ..strokes import Strokes
from .cycle_values import CycleFit

WINDOW_M = 0.1e-3  # [m] of travel before the puncture
MIN_SAMPLES = 10  # in the window
MAX_MISMATCH = 0.05  # [of the measured force] more than the noise allows, and more than this, is not met
PEAK_DROP_SIGMA = 5.0  # [standard deviations of the noise] more than the largest of the samples near a peak
SOURCE = "measured: curve through the last 0.1 mm before the puncture"
OF_THE_SENSOR = {"time", "filter"}  # errors of the model that change the measured peak
MAX_STRAIGHT_WINDOW = 0.03  # [of the indentation] over a longer window the curvature of the loading curve matters


@dataclass(frozen=True, kw_only=True)
class MeasuredPeak:
    """The measured force [N] at the puncture, and the half widths [N] of its 95 % interval from the ``noise``, from the
    ``place`` of the puncture between samples, from the sensor's ``zero``, and from the ``rounding`` of the force."""

    force: float
    noise: float
    place: float
    zero: float
    rounding: float = 0.0

    def rounded(self, step: float) -> "MeasuredPeak":
        """The peak of a force that is given in steps [N]: it may be anywhere within one, and so may the zero."""
        return replace(self, rounding=math.sqrt(0.5) * step)

    def estimate(self, fit: CycleFit) -> Estimate:
        """``puncture_force`` with its interval, which reaches as far as that of the ``fit`` where an error of the model
        changes what the sensor shows: behind a filter the measured peak is lower than that of the law, however little
        the law's own moves. Repeats at one speed have their samples at the same places."""
        half, name = math.hypot(self.noise, self.place, self.zero, self.rounding), "puncture_force"
        limits = near = self.force - half, self.force + half
        if fit.causes.keys() & OF_THE_SENSOR:
            limits = min(near[0], fit.low[name]), max(near[1], fit.high[name])
        shared = math.hypot(self.place, self.rounding)
        return Estimate(
            name,
            self.force,
            UNITS[name],
            *limits,
            systematic=(shared + near[0] - limits[0], shared + limits[1] - near[1]),
            source=SOURCE,
        )


def measured_peak(
    strokes: Strokes, fit: CycleFit, puncture: Puncture, filter_length: int, free: Noise | None
) -> MeasuredPeak | None:
    """The measured force at the puncture: a curve through the last 0.1 mm before the puncture, read at its depth.

    A line, or a parabola where the window is more than 3 % of the indentation; samples that a filter smears are left
    out. Where tissue ruptures gradually, or the peak that segmentation finds is clearly above the curve, so that the
    force fell before the fitted puncture, the curve ends at the peak instead. The noise is that of the ``free`` travel
    before the contact, or of the differences of neighbouring samples where that is too short. None with too few samples
    before the puncture.
    """
    noise = free if free is not None and free.count >= 4 * filter_length else _neighbours_noise(strokes, filter_length)
    found = _peak_at(strokes, fit, fit.puncture.before - fit.puncture.left_out, fit.values["puncture_depth"], noise)
    above = 0.0 if found is None else puncture.force - fit.values["force_offset"] - found.force
    if puncture.gradual or above > PEAK_DROP_SIGMA * math.sqrt(noise.variance):
        peak = _sample_of(puncture, strokes)
        return _peak_at(strokes, fit, peak + 1, float(strokes.depth_in[peak]), noise)
    return found


def _sample_of(puncture: Puncture, strokes: Strokes) -> int:
    """The sample of the peak. The depth of the event is that of the filtered force, which is delayed."""
    last = int(np.argmax(strokes.depth_in >= puncture.depth))
    return int(np.argmax(strokes.force_in[: last + 1]))


def _peak_at(strokes: Strokes, fit: CycleFit, end: int, at: float, noise: Noise) -> MeasuredPeak | None:
    """Value at the depth ``at`` [m] of the curve through the last samples before ``end``."""
    depth, force = strokes.depth_in, strokes.force_in
    first = min(int(np.searchsorted(depth[:end], depth[end - 1] - WINDOW_M)) if end > 0 else 0, end - MIN_SAMPLES)
    if first < 0 or not np.ptp(depth[first:end]) > 0.0:
        return None
    x, y = depth[first:end] - at, force[first:end]
    places = len(np.unique(x))  # a depth in coarse steps has few
    curved = places > 3 and np.ptp(x) > MAX_STRAIGHT_WINDOW * fit.values["puncture_indentation"]
    design = np.vander(x / np.ptp(x), 3 if curved else 2)
    values = coefficients(design, y)
    # the puncture lies between samples: the growth of the force between them is not known
    between = abs(float(values[-2])) / np.ptp(x) * 0.5 * (fit.high["puncture_depth"] - fit.low["puncture_depth"])
    return MeasuredPeak(
        force=float(values[-1]) - fit.values["force_offset"],
        noise=TWO_SIDED * math.sqrt(noise.long_run * float(inverse(design.T @ design)[-1, -1])),
        place=between,
        zero=0.5 * (fit.high["force_offset"] - fit.low["force_offset"]),
    )


def _neighbours_noise(strokes: Strokes, filter_length: int) -> Noise:
    variance = white_noise(strokes.force_in) ** 2
    return Noise(variance=variance, long_run=variance * filter_length)


@dataclass(frozen=True, kw_only=True)
class PunctureMatch:
    """Force [N] of the law and of the friction and cutting after it at the puncture, with the measured force before it
    and the ``error`` [N] that noise explains."""

    modelled: float
    after: float
    measured: float
    error: float

    @property
    def ratio(self) -> float:
        """Modelled over measured force."""
        return self.modelled / self.measured

    @property
    def allowed(self) -> float:
        """Difference [N] from the measured force that is met."""
        return max(self.error, MAX_MISMATCH * abs(self.measured))

    @property
    def met(self) -> bool:
        """Whether the law meets the measured force."""
        return abs(self.modelled - self.measured) <= self.allowed

    @property
    def rises(self) -> bool:
        """Whether the model's force rises at the puncture, where the measured one falls."""
        return self.after - min(self.modelled, self.measured) > self.allowed

    def sentence(self, law: str) -> str:
        """What is wrong; empty where the law meets the puncture and the force does not rise there."""
        if not self.met:
            side = "above" if self.modelled > self.measured else "below"
            return (
                f"The law {law} is {abs(self.ratio - 1.0):.0%} {side} the measured force at the puncture "
                f"({self.modelled:.3g} N for {self.measured:.3g} N): its parameters are not identified."
            )
        if self.rises:
            return (
                f"Friction and cutting force after the puncture are together {self.after:.3g} N there, more than the "
                f"{self.modelled:.3g} N before it: the force below the puncture is not that of one layer."
            )
        return ""


def puncture_match(fit: CycleFit, peak: MeasuredPeak | None) -> PunctureMatch | None:
    """The forces at the puncture of one fit and its measured force; None where that is not known.

    Place and zero are the same for both. The law's own interval is not counted: it grows with the misfit that is looked
    for, and the law, fitted to all of the loading curve, is known as well as the curve through its last part.
    """
    if peak is None or not peak.force > 0.0:
        return None
    values = fit.values
    after = values["friction_per_length"] * values["puncture_indentation"] + values["cutting_force"]
    error = SIGNIFICANT / TWO_SIDED * math.sqrt(2.0) * math.hypot(peak.noise, math.sqrt(0.5) * peak.rounding)
    return PunctureMatch(modelled=values["puncture_force"], after=after, measured=peak.force, error=error)
