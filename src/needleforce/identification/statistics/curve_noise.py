# SPDX-License-Identifier: Apache-2.0
"""The noise of the readings of one curve at every length, found without a model of the curve."""

from dataclasses import dataclass

import numpy as np

from ...segmentation.punctures import quarter_sd, robust_sd
from ...segmentation.strokes import FOURTH_DIFFERENCE, white_noise

MIN_NOISE_SHARE = 1e-6  # of the range of the force: a simulated curve may have no noise
MIN_NOISE_PLACES = 20  # fourth differences of means that show the noise over their length
MIN_NOISE_LENGTHS = 45  # distances in the curve, between means whose differences show correlated noise


@dataclass(frozen=True, kw_only=True)
class CurveNoise:
    """Standard ``deviations`` [N] of means over ``lengths`` [samples], the ``quantum`` of the force [N], and the
    ``count`` of samples that show them."""

    lengths: np.ndarray
    deviations: np.ndarray
    quantum: float
    count: int

    def of_mean(self, count: int) -> float:
        """Standard deviation [N] of the mean of ``count`` samples; a quantum above the noise is not averaged."""
        known = int(np.searchsorted(self.lengths, count, side="right")) - 1
        sd = float(self.deviations[known]) * (float(self.lengths[known]) / count) ** 0.5
        return max(sd, self.quantum / 12**0.5) if self.coarse else sd

    def of_blocks(self, size: int) -> "CurveNoise":
        """The noise of means over ``size`` samples."""
        deviations = np.array([self.of_mean(size * int(w)) for w in self.lengths])
        return CurveNoise(lengths=self.lengths, deviations=deviations, quantum=self.quantum if self.coarse else 0.0,
                          count=self.count // size)  # fmt: skip

    @property
    def coarse(self) -> bool:
        """Whether the rounding of the force hides its noise."""
        return bool(self.deviations[0] <= 0.5 * self.quantum)


def curve_noise(force: np.ndarray, quantum: float) -> CurveNoise:
    """The noise of the (n,) force [N] over 1, 2, 4 … samples, from fourth differences of means over that length.

    A smooth curve contributes next to nothing to them, and the smallest quarter of their magnitudes leaves out peaks
    and falls; hum, filtered noise and texture are in them. Neighbouring means of correlated noise differ less than
    distant ones: the distance with the largest differences counts, up to a thirtieth of the curve. The mean over twice
    a length varies no more than that over the length, and no less than over the root of two.
    """
    # readings that alternate between two steps have a deviation of half a step, which robust estimates miss
    floor = max(MIN_NOISE_SHARE * float(np.ptp(force)), 0.5 * quantum, 1e-150)
    sums = np.concatenate(([0.0], np.cumsum(force - force[0])))
    lengths, found = [1], [max(white_noise(force), floor)]
    while len(force) - 10 * lengths[-1] >= MIN_NOISE_PLACES:
        w = lengths[-1]
        distances = [w * 2**k for k in range(16) if not k or w * 2**k * MIN_NOISE_LENGTHS <= len(force)]
        mean = (sums[w:] - sums[:-w]) / w
        own = max(_fourth_difference(mean, distance) for distance in distances)
        found[-1] = max(found[-1], own) if w == 1 else min(max(own, found[-2] / 2**0.5), found[-2])
        lengths.append(2 * w)
        found.append(found[-1] / 2**0.5)
    return CurveNoise(lengths=np.array(lengths), deviations=np.array(found), quantum=quantum, count=len(force))


def _fourth_difference(values: np.ndarray, d: int) -> float:
    """The standard deviation of (n,) values from fourth differences over a distance ``d``."""
    fourth = values[4 * d :] - 4 * values[3 * d : -d] + 6 * values[2 * d : -2 * d] - 4 * values[d : -3 * d]
    fourth = np.ascontiguousarray(fourth + values[: -4 * d])
    # those of an oscillation are not normal: most are far from zero, and few of them show no small part
    return min(quarter_sd(fourth), robust_sd(fourth), float(fourth.std())) / FOURTH_DIFFERENCE
