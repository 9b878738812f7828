# SPDX-License-Identifier: Apache-2.0
"""Straight lines and linear least squares, and Schwarz's information criterion (BIC, 1978)."""

import math

import numpy as np

from ...errors import InputError
from ...vocabulary import SMALLEST
from .noise import Noise, student_quantile

MAX_CONDITION = 1e14  # of the correlation of the parameters: beyond, the samples do not determine all of them
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
    values = coefficients(design, y)
    variance = float(np.sum((y - design @ values) ** 2)) / (n - p)
    return values, variance * inverse(design.T @ design), student_quantile(n - p)


def coefficients(design: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Least-squares coefficients (p,) of y (n,) on design (n, p).

    Raises InputError where the readings do not determine them.
    """
    n, p = design.shape
    scale = np.linalg.norm(design, axis=0)
    if (scale > 0.0).all():
        values, _, _, singular = np.linalg.lstsq(design / scale, y, rcond=None)
        rounding = max(n, p) * np.finfo(float).eps
        if n >= p and singular[-1] * scale.min() > singular[0] * scale.max() * rounding:
            return values / scale  # a bound on the rank of the design itself
    if np.linalg.matrix_rank(design) < p:
        step = "Give readings at more places or loads that differ."
        raise InputError("number of readings", n, f"they do not determine {p} coefficients", next_step=step)
    return np.linalg.lstsq(design / scale, y, rcond=None)[0] / scale


def inverse(gram: np.ndarray) -> np.ndarray:
    """Inverse of J'J (p, p), scaled first as its columns have different units; NaN where it does not determine all p
    parameters."""
    scale = np.sqrt(np.diagonal(gram))
    if not (scale > 0.0).all():
        return np.full_like(gram, np.nan)
    units = np.outer(scale, scale)
    correlation = gram / units
    try:
        found = np.linalg.inv(correlation)
    except np.linalg.LinAlgError:
        return np.full_like(gram, np.nan)
    # the product of the Frobenius norms bounds the condition number
    bound = math.sqrt(np.vdot(correlation, correlation) * np.vdot(found, found))
    if not bound < 0.1 * MAX_CONDITION and np.linalg.cond(correlation) > MAX_CONDITION:
        return np.full_like(gram, np.nan)
    return found / units


def criterion(mean_square: float, parameters: int, samples: float) -> float:
    """BIC: n log(``mean_square``) + parameters log(n), n being ``samples``; the noise's own is not counted."""
    return samples * math.log(max(mean_square, SMALLEST)) + parameters * math.log(samples)


def bic_gain(squares: float, other: float, more: float, samples: float) -> float:
    """By how much the BIC of a fit with the sum of ``squares`` is lower than that of an ``other`` one to the same
    ``samples``, than which it has so many ``more`` parameters."""
    return samples * math.log(max(other, SMALLEST) / max(squares, SMALLEST)) - more * math.log(samples)


def misfit_gain(noise: Noise, other: Noise) -> float:
    """Minus twice the logarithm of the ratio of the likelihoods of two fits to the same samples, the one that leaves
    ``noise`` over the ``other``: the difference of their squares over the long-run variance of the smaller residual.

    A further parameter that describes nothing gains one on average, however the noise is correlated. With the variance
    of each fit's own residual instead, a misfit that correlates all samples would hide even a large difference.
    """
    best = min(noise, other, key=lambda each: each.sse)
    return (other.sse - noise.sse) / max(best.long_run, best.variance, SMALLEST)


def independent_samples(noises: list[Noise]) -> float:
    """Effective number of independent samples: count times plain over long-run variance, of the least residual.

    Misfit correlates neighbouring samples too, so the residual of the best curve is nearest to the noise. At least 2.
    """
    best = min(noises, key=lambda noise: noise.sse)
    return max(best.count * best.variance / best.long_run, 2.0) if best.long_run > 0.0 else float(best.count)
