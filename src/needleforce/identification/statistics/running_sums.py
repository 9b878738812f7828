# SPDX-License-Identifier: Apache-2.0
"""The linear coefficients of one cycle, given its contact, saturation and puncture: a Gaussian in O(1).

Given these three the one-layer model is linear in c, f' and f_c; c stands in the loading curve alone, f' and f_c in the
samples after it. With flat priors each group is Gaussian, and what is left of the sum of squares tells how likely the
three are. Everything is a combination of running sums (variable projection, Golub & Pereyra 1973).
"""

from typing import NamedTuple

import numpy as np

LEAST = 8  # samples of a loading curve


class RunningSums:
    """Sums over any run of samples of a stroke: their number, h to h^4, and F, F h, F h^2, F^2.

    ``h`` (n,) is depth from near the contact in units near the indentation, ``force`` (n,); ``direction`` is +1 for an
    insertion, -1 for a withdrawal.
    """

    def __init__(self, h: np.ndarray, force: np.ndarray, direction: float):
        self.size, self.direction = len(h), direction
        self.reach = np.maximum.accumulate(direction * h) if len(h) else h
        squared = h * h
        columns = (np.ones_like(h), h, squared, squared * h, squared * squared)
        columns += (force, force * h, force * squared, force * force)
        self.rows = np.zeros((9, len(h) + 1))
        np.cumsum(columns, axis=1, out=self.rows[:, 1:])

    def passing(self, h) -> np.ndarray:
        """Number of samples before the stroke first passes h."""
        return np.searchsorted(self.reach, self.direction * h, side="right")

    def between(self, first, last) -> np.ndarray:
        """The sums (9, ...) over samples first to last - 1."""
        first, last = np.broadcast_arrays(first, last)
        return self.rows[:, last] - self.rows[:, first]


class Linear(NamedTuple):
    """For each contact, saturation and puncture: ``misfit``, the sum of squares that is left over the variance,
    ``volume``, the logarithm of the Gaussian's width, the means of c, f' and f_c, and their deviations' triangle."""

    misfit: np.ndarray
    volume: np.ndarray
    stiffness: np.ndarray
    friction: np.ndarray
    cutting: np.ndarray
    stiffness_sd: np.ndarray
    friction_sd: np.ndarray
    cutting_by_friction: np.ndarray
    cutting_sd: np.ndarray

    @property
    def log_density(self) -> np.ndarray:
        """Logarithm of the posterior density of contact, saturation and puncture, but for a constant."""
        return self.volume - 0.5 * self.misfit


class Cycle(NamedTuple):
    """Both strokes, the variance [N^2] that divides their squares, and the samples left out on each side of a step."""

    insertion: RunningSums
    withdrawal: RunningSums
    variance: float
    left_out: int

    def linear(self, contact, saturation, puncture) -> Linear:
        """The coefficients for contacts, saturation depths and punctures, counted in samples before, of any shape."""
        z, saturation, puncture = np.broadcast_arrays(contact, saturation, puncture)
        gg, fg = self._loading(z, saturation, puncture - self.left_out)
        room = gg > 0.0
        gg = np.where(room, gg, 1.0)
        n, h, hh, f, fh = self._line(z, puncture + self.left_out)
        det = hh * n - h * h
        friction, cutting = (n * fh - h * f) / det, (hh * f - h * fh) / det
        misfit = (self._squares(puncture) - fg * fg / gg - friction * fh - cutting * f) / self.variance
        sd, friction_sd = np.sqrt(self.variance), np.sqrt(self.variance * n / det)
        sds = sd / np.sqrt(gg), friction_sd, -self.variance * h / det / friction_sd, sd / np.sqrt(n)
        volume = np.where(room, -0.5 * np.log(gg * det), -np.inf)
        return Linear(misfit, volume, fg / gg, friction, cutting, *sds)

    def _line(self, z, first) -> tuple[np.ndarray, ...]:
        """Sums of 1, h, h^2, F and F h over the insertion's samples from ``first`` on, and of h^2 and -F h over the
        withdrawal's below the contact: what one slope and the insertion's offset need."""
        line = self.insertion.between(first, self.insertion.size - self.left_out)
        skipped = min(self.left_out, self.withdrawal.size)
        out = self.withdrawal.between(skipped, np.maximum(self.withdrawal.passing(z), skipped))
        n, h, f = line[0], line[1] - z * line[0], line[5]
        hh = line[2] - z * (2.0 * line[1] - z * line[0]) + out[2] - z * (2.0 * out[1] - z * out[0])
        return n, h, hh, f, line[6] - z * f - (out[6] - z * out[5])

    def _loading(self, contact, saturation, end) -> tuple[np.ndarray, np.ndarray]:
        """Sums of g^2 and F g between contact and puncture: g = h^2, then 2 s h - s^2. Not above 0 where there is no
        room: fewer than a fiftieth of the samples, as in the fit."""
        start = np.minimum(self.insertion.passing(contact), end)
        turn = np.clip(self.insertion.passing(contact + saturation), start, end)
        m, s = self.insertion.between(start, turn), self.insertion.between(turn, end)
        z = contact
        gg = m[4] - z * (4.0 * m[3] - z * (6.0 * m[2] - z * (4.0 * m[1] - z * m[0])))
        fg = m[7] - z * (2.0 * m[6] - z * m[5])
        slope = np.where(np.isfinite(saturation), 2.0 * saturation, 0.0)
        offset = -slope * (z + 0.25 * slope)
        gg = gg + slope * (slope * s[2] + 2.0 * offset * s[1]) + offset * offset * s[0]
        room = end - start >= max(self.insertion.size // 50, LEAST)
        return np.where(room, gg, 0.0), fg + slope * s[6] + offset * s[5]

    def _squares(self, puncture) -> np.ndarray:
        """Sum of F^2 over every sample that counts."""
        w, inside, outside = self.left_out, self.insertion.rows[8], self.withdrawal.rows[8]
        used = inside[puncture - w] + inside[self.insertion.size - w] - inside[puncture + w]
        return used + outside[-1] - outside[min(w, self.withdrawal.size)]
