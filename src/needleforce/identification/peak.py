# SPDX-License-Identifier: Apache-2.0
"""The force just before the puncture, as measured: no law of stiffness enters it."""

import math

import numpy as np

from .estimates import Estimate
from .regression import line

REACH = 0.1e-3  # [m] of travel before the puncture, short enough for a straight line
LEAST_SAMPLES = 10


def measured_peak(depth: np.ndarray, force: np.ndarray, before: int, left_out: int, puncture: float) -> Estimate | None:
    """``puncture_force`` [N]: a line through the last 0.1 mm before the puncture, read at its depth [m].

    ``depth`` and ``force`` (n,) are the insertion in the order of time, ``before`` the samples before the puncture, of
    which the last ``left_out`` are smeared by a filter. None with fewer than ten samples.
    """
    end = before - left_out
    first = min(int(np.searchsorted(depth[:end], depth[end - 1] - REACH)) if end > 0 else 0, end - LEAST_SAMPLES)
    if first < 0:
        return None
    x, y = depth[first:end] - puncture, force[first:end]
    if not np.ptp(x) > 0.0:
        return None
    slope, at_puncture, _, t = line(x, y)
    residual = y - at_puncture - slope * x
    # behind an average filter of n samples, n of them count as one
    spread = float(residual @ residual) / (len(x) - 2) * max(left_out, 1)
    leverage = 1.0 / len(x) + float(x.mean()) ** 2 / float(np.sum((x - x.mean()) ** 2))
    half = t * math.sqrt(spread * leverage)
    source = "measured, a line through the last 0.1 mm before the puncture"
    return Estimate("puncture_force", at_puncture, "N", at_puncture - half, at_puncture + half, source=source)
