# SPDX-License-Identifier: Apache-2.0
"""Six gauge voltages of a force/torque sensor behind a data acquisition card, as a wrench."""

from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ...wire.rdt import SATURATED

GAUGES = 6
FULL_SCALE = 10.0  # [V] on either side, what converters for these sensors span
_WORST_CONDITION = 1e8  # of the matrix, its rows to scale; the sensors' own are below 100


@dataclass(frozen=True, eq=False)
class Calibration:
    """``matrix`` (6, 6) [N/V, N m/V] from gauges to fx fy fz tx ty tz, ``bias`` (6,) [V] of the unloaded sensor,
    ``full_scale`` [V] of the converter, serial number, ``ratings``: the ends of the six ranges [N, N m], 0 where
    unknown, and ``said``, what had to be assumed of the file.

    Raises InputError for a matrix that is singular, not finite or of another shape.
    """

    matrix: np.ndarray
    bias: np.ndarray
    full_scale: float = FULL_SCALE
    serial: str = ""
    ratings: tuple[float, ...] = (0.0,) * GAUGES
    said: tuple[str, ...] = ()

    def __post_init__(self):
        _check(self.matrix, (GAUGES, GAUGES), "calibration matrix")
        _check(self.bias, (GAUGES,), "bias voltages")
        _check(np.asarray(self.ratings), (GAUGES,), "ratings")
        if not 0.0 < self.full_scale <= 1e3:
            raise InputError("full scale of the converter", self.full_scale, "outside 0 to 1000 V")
        rows = np.abs(self.matrix).max(axis=1, keepdims=True)
        if not rows.all() or not np.linalg.cond(self.matrix / rows) < _WORST_CONDITION:
            advice = "Compare it with the sensor's own sheet: two rows or columns may be the same."
            raise InputError("calibration matrix", "singular", "six axes need six gauges", next_step=advice)

    def wrench(self, volts) -> np.ndarray:
        """Forces and torques (n, 6) [N, N m] of voltages (n, 6) [V]."""
        return (np.asarray(volts, dtype=float) - self.bias) @ self.matrix.T

    def status(self, volts) -> np.ndarray:
        """(n,) status words of voltages (n, 6) [V]: saturated where a gauge is at the end of the converter's range."""
        return np.where(np.abs(volts).max(axis=1) >= self.full_scale, SATURATED, 0)


def _check(values: np.ndarray, shape: tuple[int, ...], quantity: str) -> None:
    if values.shape != shape:
        raise InputError(quantity, f"of shape {values.shape}", f"{shape} is needed")
    if not np.isfinite(values).all():
        raise InputError(quantity, "not finite", "numbers are needed")
