# SPDX-License-Identifier: Apache-2.0
"""Straight lines and linear least squares, variable projection (Golub & Pereyra 1973), and Schwarz's information
criterion (BIC, 1978)."""

import math
from itertools import product
from typing import Any

import numpy as np

from ...errors import InputError
from ..one_layer.loading_curves import LoadingCurve
from .noise import Noise, student_quantile

CONTACT_STARTS = (-0.8, -0.5, -0.3, -0.1, 0.0, 0.1, 0.3, 0.5, 0.7)  # [indentations] from the contact given
CONTACT_RANGE = (-1.0, 0.9)  # [indentations] from the contact given
SCREENING_SAMPLES = 500  # every start is tried on about so many: more would cost time and change no ranking
N_FINALISTS = 3  # best starts that are fitted to all samples
EDGE_SHARE = 1e-3  # [of the range of a parameter] nearer to its limit, a parameter is held there
VERY_STRONG_BIC = 10.0  # difference of two BIC values that is "very strong" evidence: Kass & Raftery 1995


def line(x: np.ndarray, y: np.ndarray) -> tuple[float, float, float, float]:
    """Slope, intercept, standard error of the slope, and Student's quantile; at least three points."""
    if len(x) < 3:
        raise InputError("number of points on a line", len(x), "at least 3 are needed", next_step="Give more readings.")
    values, covariance, t = least_squares(np.column_stack([x, np.ones_like(x)]), y)
    return float(values[0]), float(values[1]), float(np.sqrt(covariance[0, 0])), t


def least_squares(design: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Coefficients (p,), their covariance (p, p) and Student's quantile, of y (n,) on design (n, p), n > p.

    Raises InputError where the readings do not determine the coefficients.
    """
    n, p = design.shape
    if np.linalg.matrix_rank(design) < p:
        step = "Give readings at more places or loads that differ."
        raise InputError("number of readings", n, f"they do not determine {p} coefficients", next_step=step)
    scale = np.linalg.norm(design, axis=0)
    values = np.linalg.lstsq(design / scale, y, rcond=None)[0] / scale
    variance = float(np.sum((y - design @ values) ** 2)) / (n - p)
    return values, variance * inverse(design.T @ design), student_quantile(n - p)


def inverse(gram: np.ndarray) -> np.ndarray:
    """Inverse of J'J (p, p), scaled first as its columns have different units; NaN where it does not determine all p
    parameters."""
    scale = np.sqrt(np.diagonal(gram))
    unit = np.outer(scale, scale)
    if not (scale > 0.0).all() or np.linalg.cond(gram / unit) > 1e14:
        return np.full_like(gram, np.nan)
    return np.linalg.inv(gram / unit) / unit


def amplitudes_of(basis: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Least-squares amplitudes (k,) of force (n,) on the rows of basis (k, n), none below 0 (Lawson & Hanson 1974)."""
    from scipy.optimize import nnls

    size = np.sqrt(np.einsum("kn,kn->k", basis, basis))
    size[~(size > 0.0)] = np.inf
    if len(basis) == 1:
        return np.maximum(basis @ force / size**2, 0.0)
    return nnls((basis / size[:, None]).T, force)[0] / size


class Search:
    """Search for the contact depth and shape parameters x, in units of the indentation, of one curve on samples (n,).

    The amplitudes and the sensor's zero, a constant of either sign, are projected out: the curve and the force are
    taken from their means. ``contact`` [m] is where to start; ``given`` are the shape parameters where they are not
    fitted.
    """

    def __init__(
        self,
        curve: LoadingCurve,
        depth: np.ndarray,
        force: np.ndarray,
        contact: float,
        given: tuple[float, ...] | None,
    ):
        self.curve, self.depth, self.contact, self.given = curve, depth, contact, given
        self.mean = float(force.mean())
        self.force = force - self.mean
        self.fitted = {} if given is not None else curve.shape
        span, parameters = float(depth.max() - contact), self.fitted.values()
        self.scale = np.array([span, *(span**each.power for each in parameters)])
        self.low, self.high = np.array([CONTACT_RANGE, *((each.low, each.high) for each in parameters)]).T
        self.starts = list(product(CONTACT_STARTS, *(each.starts for each in parameters)))

    def best(self) -> np.ndarray:
        """x of least squares: every start is tried on part of the samples, the best few are fitted to all of them."""
        every = max(len(self.depth) // SCREENING_SAMPLES, 1)
        force = self.force[::every]
        starts = sorted(self.starts, key=lambda start: float(np.sum(self._residual(start, force, every) ** 2)))
        return min((self._minimised(start) for start in starts[:N_FINALISTS]), key=lambda found: found.cost).x

    def values(self, x: np.ndarray) -> dict[str, float]:
        """The curve's parameters and ``contact_depth`` at x, SI."""
        contact, shape = self._parameters(x)
        basis = self._basis(x, 1)
        means = basis.mean(axis=1)
        amplitudes = amplitudes_of(basis - means[:, None], self.force)
        return dict(zip((*self.curve.amplitudes, *self.curve.shape), (*map(float, amplitudes), *shape))) | {
            "contact_depth": contact,
            "force_offset": self.mean - float(amplitudes @ means),
        }

    def held(self, x: np.ndarray) -> list[str]:
        """Names of the parameters that are at a limit of their range."""
        edge = np.minimum(x - self.low, self.high - x) <= EDGE_SHARE * (self.high - self.low)
        names = [name for name, at_edge in zip(("contact_depth", *self.fitted), edge) if at_edge]
        values = self.values(x)
        return [name for name in self.curve.amplitudes if values[name] == 0.0] + names

    def _parameters(self, x: np.ndarray) -> tuple[float, tuple[float, ...]]:
        place, *shape = map(float, np.asarray(x) * self.scale)
        return self.contact + place, tuple(shape) if self.given is None else self.given

    def _basis(self, x: np.ndarray, every: int) -> np.ndarray:
        contact, shape = self._parameters(x)
        return np.stack(self.curve.basis(np.maximum(self.depth[::every] - contact, 0.0), *shape))

    def _residual(self, x: np.ndarray, force: np.ndarray, every: int) -> np.ndarray:
        basis = self._basis(x, every)
        basis -= basis.mean(axis=1)[:, None]
        force = force - force.mean()
        return force - amplitudes_of(basis, force) @ basis

    def _minimised(self, start: tuple[float, ...]) -> Any:
        from scipy.optimize import least_squares

        force = self.force / (float(np.abs(self.force).max()) or 1.0)
        bounds = self.low, self.high
        return least_squares(self._residual, start, bounds=bounds, x_scale=0.1, args=(force, 1))


def criterion(noise: Noise, parameters: int, samples: float) -> float:
    """BIC: n log(sum of squares / count) + parameters log(n), n being ``samples``; the noise's own is not counted."""
    variance = max(noise.sse / noise.count, 1e-300)
    return samples * math.log(variance) + parameters * math.log(samples)


def independent_samples(noises: list[Noise]) -> float:
    """Effective number of independent samples: count times plain over long-run variance, of the least residual.

    Misfit correlates neighbouring samples too, so the residual of the best curve is nearest to the noise. At least 2.
    """
    best = min(noises, key=lambda noise: noise.sse)
    return max(best.count * best.variance / best.long_run, 2.0) if best.long_run > 0.0 else float(best.count)
