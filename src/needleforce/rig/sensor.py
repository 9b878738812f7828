# SPDX-License-Identifier: Apache-2.0
"""A six-axis force sensor with a moving-average filter."""

from dataclasses import dataclass

import numpy as np

from ..checks import not_below_zero
from ..errors import InputError

# ATI Nano17, calibration SI-12-0.12: 12 N across, 17 N along the axis, 120 N mm; 1/320 N and 1/64 N mm. The paper names
# the sensor and not the calibration; this is the one with the finest resolution. The values are the maker's as quoted
# by several public projects, not read in the data sheet; a resolution is not an accuracy.
RANGE = {"fx": 12.0, "fy": 12.0, "force": 17.0, "tx": 0.12, "ty": 0.12, "tz": 0.12}  # N, N m
COUNTS = {"fx": 320, "fy": 320, "force": 320, "tx": 64_000, "ty": 64_000, "tz": 64_000}  # per N, per N m


@dataclass(frozen=True)
class Sensor:
    """Noise, quantisation and saturation, then a causal moving average at the recorded rate.

    The source paper records at 1 kHz "after being smoothed by an average filter" without its length. The filter delays
    by (filter_length - 1) / 2 samples and spreads a step over filter_length samples. Noise of one count and rounding of
    0.29 counts give 1.03 mN in the record for 10 samples, a third of a count.

    Parameters
    ----------
    filter_length : int
        Samples in the moving average, at least 1; the default is assumed.
    noise : float
        Standard deviation of the forces before the filter [N], at least 0; default: one count (assumed).
    torque_noise : float
        Standard deviation of the torques before the filter [N m], at least 0; default: one count (assumed).
    bias : float
        Standard deviation of the residual bias after zeroing [N], at least 0 (assumed): one constant for each run and
        axis; for torques with a lever of 1 mm.

    Raises
    ------
    InputError
        If a value is below its limit or not finite.
    """

    filter_length: int = 10
    noise: float = 1.0 / 320.0
    torque_noise: float = 1.0 / 64_000.0
    bias: float = 2e-3

    def __post_init__(self):
        if self.filter_length < 1 or int(self.filter_length) != self.filter_length:
            raise InputError(
                "sensor.filter_length", self.filter_length, "must be an integer number of samples, at least 1"
            )
        for quantity in ("noise", "torque_noise", "bias"):
            not_below_zero(f"sensor.{quantity}", getattr(self, quantity))

    def record(self, wrench: dict[str, np.ndarray], random: np.random.Generator) -> dict[str, np.ndarray]:
        """Record a true wrench.

        Parameters
        ----------
        wrench : dict of str to ndarray
            True values (n,) [N, N m] by axis as in ``RANGE``; an axis that is absent is 0.
        random : numpy.random.Generator
            Source of bias and noise.

        Returns
        -------
        dict of str to ndarray
            Recorded values (n,) [N, N m] by axis. Before the first sample the filter is filled with the first value.
        """
        count = len(next(iter(wrench.values())))
        still = np.zeros(count)
        return {axis: self._axis(axis, wrench.get(axis, still), random) for axis in RANGE}

    def _axis(self, axis: str, value: np.ndarray, random: np.random.Generator) -> np.ndarray:
        torque = axis.startswith("t")
        before = np.concatenate([np.full(self.filter_length - 1, value[0]), value])
        before = before + random.normal(0.0, self.bias * (1e-3 if torque else 1.0))
        before = before + random.normal(0.0, self.torque_noise if torque else self.noise, len(before))
        return average(counted(before, axis), self.filter_length) / (COUNTS[axis] * self.filter_length)


def counted(value: np.ndarray, axis: str) -> np.ndarray:
    """Integer counts of a value (n,) [N, N m], limited to the range of the axis."""
    end = RANGE[axis] * COUNTS[axis]
    return np.clip(np.rint(value * COUNTS[axis]), -end, end).astype(np.int64)


def average(counts: np.ndarray, length: int) -> np.ndarray:
    """Sums (n - length + 1,) over the last ``length`` counts; exact, as the counts are integers."""
    total = np.concatenate([[0], np.cumsum(counts)])
    return total[length:] - total[:-length]
