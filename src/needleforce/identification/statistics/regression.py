# SPDX-License-Identifier: Apache-2.0
"""Straight lines and linear least squares with the errors of independent readings."""

import numpy as np

from ...errors import InputError


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
