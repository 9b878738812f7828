# SPDX-License-Identifier: Apache-2.0
"""Straight lines and linear least squares, variable projection (Golub & Pereyra 1973), and Schwarz's information
criterion (BIC, 1978)."""

import math
from itertools import product

import numpy as np

from ...errors import InputError
from ..one_layer.loading_curves import LoadingCurve
from .noise import Noise

CONTACTS = (-0.8, -0.5, -0.3, -0.1, 0.0, 0.1, 0.3, 0.5, 0.7)  # starts, from the contact given, in indentations
CONTACT_RANGE = (-1.0, 0.9)
FEW = 500  # samples on which the starts are weighed
FOLLOWED = 3  # starts, the best, that go on with all samples
AT_EDGE = 1e-3  # of the range of a number that is sought
VERY_STRONG = 10.0  # difference of two criteria, in the words of Kass & Raftery 1995


def line(x: np.ndarray, y: np.ndarray) -> tuple[float, float, float, float]:
    """Slope, intercept, standard error of the slope, and Student's t for 95 %; at least three points."""
    if len(x) < 3:
        raise InputError("points on a line", len(x), "fewer than 3", next_step="Give more readings.")
    values, covariance, t = least_squares(np.column_stack([x, np.ones_like(x)]), y)
    return float(values[0]), float(values[1]), float(np.sqrt(covariance[0, 0])), t


def least_squares(design: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Coefficients (p,), their covariance (p, p) and Student's t for 95 %, of y (n,) on design (n, p), n > p.

    Raises InputError where the readings do not tell the coefficients apart.
    """
    from scipy.stats import t as student

    n, p = design.shape
    if np.linalg.matrix_rank(design) < p:
        raise InputError("readings", n, f"do not tell {p} unknowns apart", next_step="Give readings that differ.")
    scale = np.linalg.norm(design, axis=0)
    values = np.linalg.lstsq(design / scale, y, rcond=None)[0] / scale
    variance = float(np.sum((y - design @ values) ** 2)) / (n - p)
    return values, variance * inverse(design.T @ design), float(student.ppf(0.975, n - p))


def inverse(gram: np.ndarray) -> np.ndarray:
    """Inverse of J'J (p, p), scaled first as its columns have different units; NaN where they do not tell all p
    apart."""
    scale = np.sqrt(np.diagonal(gram))
    unit = np.outer(scale, scale)
    if not (scale > 0.0).all() or np.linalg.cond(gram / unit) > 1e14:
        return np.full_like(gram, np.nan)
    return np.linalg.inv(gram / unit) / unit


def amplitudes_of(basis: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Least squares of force (n,) on the rows of basis (k, n), none below 0 (Lawson & Hanson 1974)."""
    from scipy.optimize import nnls

    size = np.sqrt(np.einsum("kn,kn->k", basis, basis))
    size[~(size > 0.0)] = np.inf
    if len(basis) == 1:
        return np.maximum(basis @ force / size**2, 0.0)
    return nnls((basis / size[:, None]).T, force)[0] / size


class Search:
    """The contact depth and shape numbers x, in units of the indentation, of one curve on samples (n,).

    ``contact`` [m] is where to start; ``given`` are the shape numbers where they are not sought.
    """

    def __init__(self, curve: LoadingCurve, depth, force, contact: float, given: tuple[float, ...] | None):
        self.curve, self.depth, self.force, self.contact, self.given = curve, depth, force, contact, given
        self.sought = {} if given is not None else curve.shape
        span, numbers = float(depth.max() - contact), self.sought.values()
        self.scale = np.array([span, *(span**number.power for number in numbers)])
        self.low, self.high = np.array([CONTACT_RANGE, *((number.low, number.high) for number in numbers)]).T
        self.starts = list(product(CONTACTS, *(number.starts for number in numbers)))

    def best(self) -> np.ndarray:
        """x of least squares: every start is weighed on a share of the samples, the best few are followed on all."""
        every = max(len(self.depth) // FEW, 1)
        force = self.force[::every]
        starts = sorted(self.starts, key=lambda start: float(np.sum(self._residual(start, force, every) ** 2)))
        return min((self._follow(start) for start in starts[:FOLLOWED]), key=lambda found: found.cost).x

    def values(self, x: np.ndarray) -> dict[str, float]:
        """The curve's numbers and ``contact_depth`` at x, SI."""
        contact, shape = self._told(x)
        amplitudes = amplitudes_of(self._basis(x, 1), self.force)
        return dict(zip((*self.curve.amplitudes, *self.curve.shape), (*map(float, amplitudes), *shape))) | {
            "contact_depth": contact
        }

    def held(self, x: np.ndarray) -> list[str]:
        """Names of those at the edge of what is allowed."""
        edge = np.minimum(x - self.low, self.high - x) <= AT_EDGE * (self.high - self.low)
        names = [name for name, at_edge in zip(("contact_depth", *self.sought), edge) if at_edge]
        values = self.values(x)
        return [name for name in self.curve.amplitudes if values[name] == 0.0] + names

    def _told(self, x) -> tuple[float, tuple[float, ...]]:
        place, *shape = map(float, np.asarray(x) * self.scale)
        return self.contact + place, tuple(shape) if self.given is None else self.given

    def _basis(self, x, every: int) -> np.ndarray:
        contact, shape = self._told(x)
        return np.stack(self.curve.basis(np.maximum(self.depth[::every] - contact, 0.0), *shape))

    def _residual(self, x, force: np.ndarray, every: int) -> np.ndarray:
        basis = self._basis(x, every)
        return force - amplitudes_of(basis, force) @ basis

    def _follow(self, start):
        from scipy.optimize import least_squares

        force = self.force / (float(np.abs(self.force).max()) or 1.0)
        bounds = self.low, self.high
        return least_squares(self._residual, start, bounds=bounds, x_scale=0.1, args=(force, 1))


def criterion(noise: Noise, numbers: int, samples: float) -> float:
    """n log(sum of squares / count) + numbers log(n), n being ``samples``; numbers do not count the noise's own."""
    variance = max(noise.sse / noise.count, 1e-300)
    return samples * math.log(variance) + numbers * math.log(samples)


def independent_samples(noises: list[Noise]) -> float:
    """Samples that count where neighbours are alike: count times plain over long-run variance, of the least residual.

    Misfit makes neighbours alike too, so that the best of the curves says most about the noise; never fewer than two.
    """
    least = min(noises, key=lambda noise: noise.sse)
    return max(least.count * least.variance / least.long_run, 2.0) if least.long_run > 0.0 else float(least.count)
