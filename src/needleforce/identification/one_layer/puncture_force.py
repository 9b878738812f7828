# SPDX-License-Identifier: Apache-2.0
"""The force just before the puncture, as measured: no law of stiffness enters it."""

import math

import numpy as np

from ...segmentation import Puncture
from ..estimates import Estimate
from ..statistics.noise import Z_95, Noise, noise_of
from ..statistics.regression import inverse, least_squares
from ..strokes import Strokes
from .cycle_estimates import CycleFit

REACH = 0.1e-3  # [m] of travel before the puncture
LEAST_SAMPLES = 10
LEAST_FREE = 50
FELL = 5.0  # standard deviations of the noise: more than the largest of the samples near a peak
CLEAR = 0.1  # of the indentation: the contact is not known better
STRAIGHT = 0.03  # of the indentation: over a longer reach the loading curve bends


def measured_peak(strokes: Strokes, fit: CycleFit, puncture: Puncture, filter_length: int) -> Estimate | None:
    """``puncture_force`` [N]: a curve through the last 0.1 mm before the puncture, read at its depth.

    A line, or a parabola where the reach is more than a small share of the indentation; samples that a filter smears
    are left out. Tissue may give way gradually: where the peak that segmentation sees stands clear above what the curve
    gives, the force fell before the fit's puncture, and the curve ends at the peak. The noise is that of the free
    travel before the contact; None with too few samples of either.
    """
    noise = _free_noise(strokes, fit, filter_length)
    if noise is None:
        return None
    found = _read(strokes, fit, fit.samples_before_puncture - fit.left_out, fit.values["puncture_depth"], noise)
    if found is not None and puncture.force - found.value > FELL * math.sqrt(noise.variance):
        peak = _sample_of(puncture, strokes)
        return _read(strokes, fit, peak + 1, float(strokes.depth_in[peak]), noise)
    return found


def _sample_of(puncture: Puncture, strokes: Strokes) -> int:
    """The sample of the peak. The event's depth is that of the force as filtered, late against the strokes' own."""
    beyond = int(np.argmax(strokes.depth_in >= puncture.depth))
    return int(np.argmax(strokes.force_in[: beyond + 1]))


def _read(strokes: Strokes, fit: CycleFit, end: int, at: float, noise: Noise) -> Estimate | None:
    """The curve through the last samples before ``end``, at the depth ``at`` [m]."""
    depth, force = strokes.depth_in, strokes.force_in
    first = min(int(np.searchsorted(depth[:end], depth[end - 1] - REACH)) if end > 0 else 0, end - LEAST_SAMPLES)
    if first < 0 or not np.ptp(depth[first:end]) > 0.0:
        return None
    x, y = depth[first:end] - at, force[first:end]
    bent = np.ptp(x) > STRAIGHT * fit.values["puncture_indentation"]
    design = np.vander(x / np.ptp(x), 3 if bent else 2)
    values, _, _ = least_squares(design, y)
    # the puncture lies between samples: what the force grows by meanwhile is not known
    between = abs(float(values[-2])) / np.ptp(x) * 0.5 * (fit.high["puncture_depth"] - fit.low["puncture_depth"])
    half = math.hypot(Z_95 * math.sqrt(noise.long_run * float(inverse(design.T @ design)[-1, -1])), between)
    value = float(values[-1])
    source = "measured, a curve through the last 0.1 mm before the puncture"
    return Estimate("puncture_force", value, "N", value - half, value + half, source=source)


def _free_noise(strokes: Strokes, fit: CycleFit, filter_length: int) -> Noise | None:
    """The noise of the force before the contact; None with too short a free travel."""
    clear = fit.values["contact_depth"] - CLEAR * fit.values["puncture_indentation"]
    free = strokes.force_in[: int(np.argmax(strokes.depth_in > clear))]
    if len(free) < max(LEAST_FREE, 4 * filter_length):
        return None
    return noise_of(free - free.mean(), len(free), filter_length, 1.0)
