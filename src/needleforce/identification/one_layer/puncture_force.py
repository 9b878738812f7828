# SPDX-License-Identifier: Apache-2.0
"""The force at the puncture: measured, modelled, whether the law meets the measured one, and whether it falls behind an
average filter that is not declared."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ...models.parameter_units import UNITS
from ...recording import Recording
from ...segmentation import Events, Puncture
from ...segmentation.strokes import white_noise
from ...vocabulary import Phase
from ..estimates import Estimate
from ..statistics.noise import SIGNIFICANT, TWO_SIDED, Noise
from ..statistics.regression import VERY_STRONG_BIC, coefficients, inverse
from ..strokes import Strokes, own_spans
from .cycle_values import CycleFit

WINDOW_M = 0.1e-3  # [m] of travel before the puncture
MIN_SAMPLES = 10  # in the window
MAX_MISMATCH = 0.05  # [of the measured force] more than the noise allows, and more than this, is not met
PEAK_DROP_SIGMA = 5.0  # [standard deviations of the noise] more than the largest of the samples near a peak
SOURCE = "measured: curve through the last 0.1 mm before the puncture"
OF_THE_SENSOR = {"time", "filter"}  # errors of the model that change the measured peak
BLOCKS = 12  # of samples around a fall at least, and over it at most
PARAMETERS = 5  # of a parabola before a fall and a line after it
LENGTHS, STARTS = np.geomspace(0.2, 1.6, 10), np.linspace(-0.6, 0.3, 10)  # [of the fall] of its course, from the peak
FINER = np.linspace(-0.5, 0.5, 5)  # [steps of the grid] around the best of it
RUPTURES = (None, 2.0, 1.5, 3.0, 1.0)  # powers of gradual ones that a filter is compared with; None is a smooth step
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


def filter_of_the_fall(recording: Recording, events: Events) -> int:
    """Length [samples] of an average filter that explains the fall at the first puncture better, by very strong
    evidence, than a sharp and than a gradual rupture; 0 if none.

    Before and after the fall the force is a parabola and a line. The filter averages a step between them; a gradual
    rupture goes over by exp(-(s / l)^m), as does any law of this package, or by a smooth step.
    """
    if recording.card.filter_length > 1 or not events.punctures:
        return 0
    place, force, samples, size = _fall(recording, events)
    if len(place) < BLOCKS or not place[0] < -0.5 < 0.5 < place[-1]:
        return 0
    enough = math.exp(VERY_STRONG_BIC / len(place))
    near = place[PARAMETERS:-PARAMETERS]
    sharp = _unexplained(force, _broken(place, None, near[np.abs(near) < 1.0]))[0]
    if sharp < enough * len(place) * white_noise(recording.force) ** 2 / size:
        return 0
    smeared, length = _closest(force, partial(_averaged, place))
    if not smeared * enough < sharp or any(
        _closest(force, partial(_broken, place, power=each))[0] <= smeared * enough for each in RUPTURES
    ):
        return 0
    return round(length * samples)


def _fall(recording: Recording, events: Events) -> tuple[np.ndarray, np.ndarray, int, int]:
    """The fall at the first puncture with twice its length on both sides: place (n,) from the peak, over the length of
    the fall, and force (n,) of blocks of samples; that length and the size of the blocks [samples]."""
    first = events.punctures[0]
    peak = int(np.searchsorted(recording.time, first.time))
    ends = [span.first for phase in (Phase.hold, Phase.extraction) for span in own_spans(events, phase)]
    ends += [len(recording), *(each.low for each in events.punctures[1:2])]
    length = max(first.end - peak, 1)
    size = max(length // BLOCKS, 1)
    before, after = min(2 * length, peak) // size, max(min(peak + 3 * length, *ends) - peak, 0) // size
    force = recording.force[peak - before * size : peak + after * size].reshape(-1, size).mean(axis=1)
    return (np.arange(len(force)) - before) * (size / length), force, length, size


def _closest(force: np.ndarray, columns: Callable) -> tuple[float, float]:
    """The least sum of squares [N²] that a course of the fall leaves of the force (n,), over its length and its start,
    and that length [of the fall]."""
    lengths, starts = LENGTHS, STARTS
    for _ in range(3):
        grid = [each.ravel() for each in np.meshgrid(lengths, starts)]
        squares, best = _unexplained(force, columns(*grid))
        length = float(grid[0][best])
        lengths, starts = length * (lengths[1] / lengths[0]) ** FINER, grid[1][best] + (starts[1] - starts[0]) * FINER
    return squares, length


def _averaged(place: np.ndarray, lengths: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """Columns (k, n, 5) of a parabola before and a line behind a step at each of ``starts`` (k,), averaged over the
    ``lengths`` (k,) up to each place (n,)."""
    end, length = place - starts[:, None], lengths[:, None]
    first = end - length
    before = [(np.minimum(end, 0.0) ** p - np.minimum(first, 0.0) ** p) / (p * length) for p in (1, 2, 3)]
    after = [(np.maximum(end, 0.0) ** p - np.maximum(first, 0.0) ** p) / (p * length) for p in (1, 2)]
    return np.stack([*before, *after], axis=2)


def _broken(
    place: np.ndarray, lengths: np.ndarray | None, starts: np.ndarray, power: float | None = None
) -> np.ndarray:
    """Columns (k, n, 5) of a parabola that goes over into a line by a rupture at each of ``starts`` (k,): over
    ``lengths`` (k,) with a ``power``, or by a smooth step; sharp without lengths."""
    away = place - starts[:, None]
    passed = np.maximum(away, 0.0) / lengths[:, None] if lengths is not None else (away > 0.0).astype(float)
    step = np.minimum(passed, 1.0)
    share = 1.0 - step**2 * (3.0 - 2.0 * step) if power is None else np.exp(-(passed**power))
    left = 1.0 - share
    return np.stack([share, share * away, share * away**2, left, left * away], axis=2)


def _unexplained(force: np.ndarray, design: np.ndarray) -> tuple[float, int]:
    """The least sum of squares [N²] that a design of (k, n, 5) leaves of the force (n,), and which of them."""
    across = np.swapaxes(design, 1, 2)
    values = np.linalg.solve(across @ design + 1e-9 * np.eye(design.shape[2]), (across @ force)[..., None])
    squares = np.sum((force - (design @ values)[..., 0]) ** 2, axis=1)
    return float(squares.min()), int(squares.argmin())
