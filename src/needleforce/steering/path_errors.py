# SPDX-License-Identifier: Apache-2.0
"""What the mechanics leave unexplained along a tip path: pose, uneven tissue, an error common to all, noise."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

POSITION_NOISE = 0.2e-3  # [m] of an electromagnetic sensor in a needle
SLOPE_NOISE = 4e-3
OFFSET_SPREAD = 1e-3  # [m] of the entry against the base, between insertions
TILT_SPREAD = 0.015  # [rad]
# uneven tissue: a white noise of curvature, which in 100 mm turns the tip by 3 mrad [1/m]
UNEVENNESS = 1e-4
# error of the law that is the same in each insertion of a tissue: a slope that varies slowly along the path
COMMON_SLOPE = 5e-3
COMMON_LENGTH = 0.03  # [m]
_GRID = 101  # depths at which the expected error, a smooth function, is computed
_SHORTEST = 1e-3  # [m]


@dataclass(frozen=True)
class PathReadings:
    """What was read of one insertion: where, and whether slopes were read, too."""

    depth: np.ndarray  # [m] travel of the tip in tissue
    sloped: bool

    def __len__(self) -> int:
        return len(self.depth) * (2 if self.sloped else 1)


class PathErrors:
    """Lateral errors of one law on several insertions, those with which it was identified, as normal processes along
    the path; x and y are independent.

    Error of position: offset + tilt s + own(s) + common(s) + noise. The own error has a curvature of white noise, so
    that cov(own(s), own(t)) = q m^2 (3 M - m) / 6 with the smaller m and larger M of s and t (an integrated Wiener
    process). The slope of the common error has the covariance sd^2 exp(-(s - t)^2 / 2 l^2). Errors of slope are the
    derivatives.
    """

    def __init__(self, readings: Sequence[PathReadings]):
        self._readings = list(readings)
        blocks = [[between(a, b, a is b, noise=a is b) for b in self._readings] for a in self._readings]
        self._factor = np.linalg.cholesky(np.block(blocks)) if blocks else np.zeros((0, 0))

    def whitened(self, residuals: Sequence[np.ndarray]) -> np.ndarray:
        """Residuals of all insertions, (n, 2) or (2 n, 2) with the slopes below, as independent ones of spread 1."""
        return self._solved(np.vstack([np.zeros((0, 2)), *residuals]))

    def _solved(self, columns: np.ndarray) -> np.ndarray:
        from scipy.linalg import solve_triangular

        return solve_triangular(self._factor, columns, lower=True, check_finite=False) if columns.size else columns

    def _with(self, other: PathReadings) -> np.ndarray:
        """Covariance of what was read with another insertion."""
        blocks = [between(each, other, False) for each in self._readings]
        return np.vstack([np.zeros((0, len(other))), *blocks])

    def expected(
        self, residuals: Sequence[np.ndarray], entry: PathReadings, seen: np.ndarray, depth: np.ndarray
    ) -> np.ndarray:
        """Error of position that is expected at depths (n,) [m] along another insertion, (n, 2) [m]: from the residuals
        of the insertions with which the law was identified, and those ``seen`` in the rows of this one that were read.
        """
        grid = np.linspace(0.0, max(depth.max(), _SHORTEST), _GRID)
        there = PathReadings(grid, sloped=False)
        common = self._solved(self._with(there))
        known = self._solved(self._with(entry))
        white = self.whitened(residuals)
        gram = between(entry, entry, True, noise=True) - known.T @ known
        cross = between(entry, there, True) - known.T @ common
        mean = common.T @ white + cross.T @ np.linalg.solve(gram, seen - known.T @ white)
        return np.column_stack([np.interp(depth, grid, column) for column in mean.T])


def between(a: PathReadings, b: PathReadings, same: bool, *, noise: bool = False) -> np.ndarray:
    """Covariance of the errors of two insertions, or of one with itself: positions first, then slopes."""
    s, t = np.meshgrid(a.depth, b.depth, indexing="ij")
    blocks = _common(s, t)
    if same:
        blocks = [[x + y + z for x, y, z in zip(*rows)] for rows in zip(blocks, _uneven(s, t), _pose(s, t))]
    blocks = [row[: 1 + b.sloped] for row in blocks[: 1 + a.sloped]]
    covariance = np.block(blocks)
    if noise:
        n = len(a.depth)
        covariance[np.diag_indices(len(a))] += np.repeat([POSITION_NOISE**2, SLOPE_NOISE**2], n)[: len(a)]
    return covariance


def _pose(s: np.ndarray, t: np.ndarray) -> list[list[np.ndarray]]:
    one = np.full_like(s, TILT_SPREAD**2)
    return [[OFFSET_SPREAD**2 + one * s * t, one * s], [one * t, one]]


def _uneven(s: np.ndarray, t: np.ndarray) -> list[list[np.ndarray]]:
    less = np.minimum(s, t)
    parts = [[integrated_wiener(s, t), s * less - 0.5 * less**2], [t * less - 0.5 * less**2, less]]
    return [[UNEVENNESS * part for part in row] for row in parts]


def integrated_wiener(s: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Covariance of positions whose curvature is a white noise of spectral density 1."""
    less, more = np.minimum(s, t), np.maximum(s, t)
    return less**2 * (3.0 * more - less) / 6.0


def _common(s: np.ndarray, t: np.ndarray) -> list[list[np.ndarray]]:
    once, twice = _integral, _second_integral
    position = twice(s) + twice(t) - twice(s - t)
    slope = np.exp(-0.5 * ((s - t) / COMMON_LENGTH) ** 2)
    parts = [[position, once(t) + once(s - t)], [once(s) + once(t - s), slope]]
    return [[COMMON_SLOPE**2 * part for part in row] for row in parts]


def _integral(d: np.ndarray) -> np.ndarray:
    """Of exp(-t^2 / 2 l^2) from 0 to d."""
    from scipy.special import erf

    return COMMON_LENGTH * np.sqrt(0.5 * np.pi) * erf(d / (COMMON_LENGTH * np.sqrt(2.0)))


def _second_integral(d: np.ndarray) -> np.ndarray:
    return d * _integral(d) + COMMON_LENGTH**2 * (np.exp(-0.5 * (d / COMMON_LENGTH) ** 2) - 1.0)
