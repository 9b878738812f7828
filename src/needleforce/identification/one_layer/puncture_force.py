# SPDX-License-Identifier: Apache-2.0
"""The measured force just before the puncture, independent of the stiffness law."""

import math

import numpy as np

from ...segmentation import Puncture
from ..estimates import Estimate
from ..statistics.noise import TWO_SIDED, Noise, noise_of
from ..statistics.regression import inverse, least_squares
from ..strokes import Strokes
from .cycle_estimates import CycleFit

WINDOW_M = 0.1e-3  # [m] of travel before the puncture
MIN_SAMPLES = 10  # in the window
MIN_FREE_SAMPLES = 50  # of free travel, for the noise
PEAK_DROP_SIGMA = 5.0  # [standard deviations of the noise] more than the largest of the samples near a peak
CONTACT_MARGIN = 0.1  # [of the indentation] the contact depth is not known better
MAX_STRAIGHT_WINDOW = 0.03  # [of the indentation] over a longer window the curvature of the loading curve matters


def measured_peak(strokes: Strokes, fit: CycleFit, puncture: Puncture, filter_length: int) -> Estimate | None:
    """``puncture_force`` [N]: a curve through the last 0.1 mm before the puncture, read at its depth.

    A line, or a parabola where the window is more than 3 % of the indentation; samples that a filter smears are left
    out. Tissue may rupture gradually: if the peak that segmentation finds is clearly above the curve, the force fell
    before the fitted puncture, and the curve ends at the peak instead. The noise is that of the free travel before the
    contact. None with too few samples of either.
    """
    noise = _free_noise(strokes, fit, filter_length)
    if noise is None:
        return None
    found = _peak_at(strokes, fit, fit.samples_before_puncture - fit.left_out, fit.values["puncture_depth"], noise)
    if found is not None and puncture.force - found.value > PEAK_DROP_SIGMA * math.sqrt(noise.variance):
        peak = _sample_of(puncture, strokes)
        return _peak_at(strokes, fit, peak + 1, float(strokes.depth_in[peak]), noise)
    return found


def _sample_of(puncture: Puncture, strokes: Strokes) -> int:
    """The sample of the peak. The depth of the event is that of the filtered force, which is delayed."""
    last = int(np.argmax(strokes.depth_in >= puncture.depth))
    return int(np.argmax(strokes.force_in[: last + 1]))


def _peak_at(strokes: Strokes, fit: CycleFit, end: int, at: float, noise: Noise) -> Estimate | None:
    """Value at the depth ``at`` [m] of the curve through the last samples before ``end``."""
    depth, force = strokes.depth_in, strokes.force_in
    first = min(int(np.searchsorted(depth[:end], depth[end - 1] - WINDOW_M)) if end > 0 else 0, end - MIN_SAMPLES)
    if first < 0 or not np.ptp(depth[first:end]) > 0.0:
        return None
    x, y = depth[first:end] - at, force[first:end]
    curved = np.ptp(x) > MAX_STRAIGHT_WINDOW * fit.values["puncture_indentation"]
    design = np.vander(x / np.ptp(x), 3 if curved else 2)
    values, _, _ = least_squares(design, y)
    # the puncture lies between samples: the growth of the force between them is not known
    between = abs(float(values[-2])) / np.ptp(x) * 0.5 * (fit.high["puncture_depth"] - fit.low["puncture_depth"])
    half = math.hypot(TWO_SIDED * math.sqrt(noise.long_run * float(inverse(design.T @ design)[-1, -1])), between)
    value = float(values[-1])
    source = "measured: curve through the last 0.1 mm before the puncture"
    return Estimate("puncture_force", value, "N", value - half, value + half, source=source)


def _free_noise(strokes: Strokes, fit: CycleFit, filter_length: int) -> Noise | None:
    """The noise of the force before the contact; None if the free travel is too short."""
    last = fit.values["contact_depth"] - CONTACT_MARGIN * fit.values["puncture_indentation"]
    free = strokes.force_in[: int(np.argmax(strokes.depth_in > last))]
    if len(free) < max(MIN_FREE_SAMPLES, 4 * filter_length):
        return None
    return noise_of(free - free.mean(), len(free), filter_length, 1.0)
