# SPDX-License-Identifier: Apache-2.0
"""The force just before the puncture, as measured: no law of stiffness enters it."""

import math

import numpy as np

from .covariance import Z_95, noise_of
from .cycle_fit import CycleFit
from .estimates import Estimate
from .regression import inverse, least_squares
from .strokes import Strokes

REACH = 0.1e-3  # [m] of travel before the puncture
LEAST_SAMPLES = 10
LEAST_FREE = 50
CLEAR = 0.1  # of the indentation: the contact is not known better
STRAIGHT = 0.03  # of the indentation: over a longer reach the loading curve bends


def measured_peak(strokes: Strokes, fit: CycleFit, filter_length: int) -> Estimate | None:
    """``puncture_force`` [N]: a curve through the last 0.1 mm before the puncture, read at its depth.

    A line, or a parabola where the reach is more than a small share of the indentation; samples that a filter smears
    are left out. The noise is that of the free travel before the contact: too few samples remain here to tell it, and
    the residual of a law would be no noise. None with too few samples of either.
    """
    depth, force = strokes.depth_in, strokes.force_in
    end = fit.samples_before_puncture - fit.left_out
    first = min(int(np.searchsorted(depth[:end], depth[end - 1] - REACH)) if end > 0 else 0, end - LEAST_SAMPLES)
    if first < 0 or not np.ptp(depth[first:end]) > 0.0:
        return None
    x, y = depth[first:end] - fit.values["puncture_depth"], force[first:end]
    bent = -x[0] > STRAIGHT * fit.values["puncture_indentation"]
    design = np.vander(x / -x[0], 3 if bent else 2)
    spread = _free_noise(depth, force, fit, filter_length)
    if spread is None:
        return None
    values, _, _ = least_squares(design, y)
    half = Z_95 * math.sqrt(spread * float(inverse(design.T @ design)[-1, -1]))
    source = "measured, a curve through the last 0.1 mm before the puncture"
    return Estimate(
        "puncture_force", float(values[-1]), "N", float(values[-1]) - half, float(values[-1]) + half, source=source
    )


def _free_noise(depth: np.ndarray, force: np.ndarray, fit: CycleFit, filter_length: int) -> float | None:
    """Long-run variance [N^2] of the force before the contact; None with too short a free travel."""
    clear = fit.values["contact_depth"] - CLEAR * fit.values["puncture_indentation"]
    free = force[: int(np.argmax(depth > clear))]
    if len(free) < max(LEAST_FREE, 4 * filter_length):
        return None
    return noise_of(free - free.mean(), len(free), filter_length, 1.0).long_run
