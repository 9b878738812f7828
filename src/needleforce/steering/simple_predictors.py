# SPDX-License-Identifier: Apache-2.0
"""Predictors without mechanics: curvature, and a regression on the motion of the base."""

from collections.abc import Sequence

import numpy as np

from .tip_paths import TipPath
from .tissue_prior import RESPONSES, Spread

SIMPLE = ("unicycle", "bicycle", "regression")
"""Predictors without mechanics, of one, two and four coefficients a direction, the last ones common to both."""
_UNIT = 0.1  # [m] of depth, so that coefficients are about 1
_VARIANCE = 1e-5  # [m^2] of each row, as ten rows share an error of 1 mm: coefficients from 0.3 on are hardly shrunk
_REGRESSION = 1.4e-3  # [m] lateral, of a regression with many insertions: medians of 0.8, 2.0 and 1.4 mm in three gels


def both(values: np.ndarray) -> np.ndarray:
    """(..., m, 2) as (..., 2 m): x, then y, whose parameters are the same."""
    return np.concatenate([values[..., 0], values[..., 1]], axis=-1)


def _entry_line(path: TipPath) -> np.ndarray:
    """The straight path from the entry, (n, 2) [m]: mean place and slope of at most two rows before the base moves."""
    rows = path.entry[:2]
    slope = np.zeros(2) if path.slope is None else path.slope[rows].mean(axis=0)
    return path.tip[rows, :2].mean(axis=0) + np.outer(path.depth - path.depth[rows].mean(), slope)


def _columns(by: str, path: TipPath) -> np.ndarray:
    """What each coefficient adds to the straight path, x and then y (2 n, c): entry angle, curvature, and the response
    to the base, at once and to where it was on the way, by powers of the depth."""
    depth = np.maximum(path.depth, 0.0)[:, None] / _UNIT
    columns = np.kron(np.eye(2), depth**2 if by == "unicycle" else np.hstack([depth, depth**2]))
    if by != "regression":
        return columns
    moved = path.base - path.base[0]
    parts = [moved]
    for power in range(3):
        slope = depth**power * moved
        steps = 0.5 * np.diff(depth, axis=0) * (slope[1:] + slope[:-1])
        parts.append(np.vstack([np.zeros(2), np.cumsum(steps, axis=0)]))
    return np.column_stack([columns, *(both(part) for part in parts)])


def _coefficients(by: str, training: Sequence[TipPath], response: Spread | None) -> tuple[np.ndarray, np.ndarray]:
    """Those that fit the training insertions (c,), and the covariance of their errors (c, c)."""
    columns = [_columns(by, each).reshape(2, len(each), -1)[:, each.compared] for each in training]
    sides = [both((each.tip[:, :2] - _entry_line(each))[each.compared]) for each in training]
    rows = np.vstack([each.reshape(-1, each.shape[-1]) for each in columns])
    precision, side = np.eye(rows.shape[1]), rows.T @ np.concatenate(sides) / _VARIANCE
    if by == "regression" and response is not None:
        known = precision[-RESPONSES:, -RESPONSES:] = np.linalg.inv(response.covariance)
        side[-RESPONSES:] += known @ response.mean
    errors = np.linalg.inv(rows.T @ rows / _VARIANCE + precision)
    return errors @ side, errors


def regression_error(training: Sequence[TipPath], path: TipPath, response: Spread | None) -> np.ndarray:
    """Standard deviation of a regression in each lateral direction, (n,) [m]: of coefficients and of the form."""
    columns, (_, errors) = _columns("regression", path), _coefficients("regression", training, response)
    variance = np.einsum("ij,jk,ik->i", columns, errors, columns).reshape(2, -1).mean(axis=0)
    return np.sqrt(variance + 0.5 * _REGRESSION**2)


def predicted_simply(by: str, training: Sequence[TipPath], path: TipPath, response: Spread | None = None) -> np.ndarray:
    """Tip across (n, 2) [m] by one of ``SIMPLE``, whose coefficients fit the training insertions; ``response`` is what
    other tissues show of that of a regression to the base."""
    found, _ = _coefficients(by, training, response)
    return _entry_line(path) + (_columns(by, path) @ found).reshape(2, -1).T


def response_shown(training: Sequence[TipPath], response: Spread | None) -> Spread:
    """What insertions show of the response of a regression to the base, whatever entry angle and curvature are."""
    found, errors = _coefficients("regression", training, response)
    return Spread(found[-RESPONSES:], errors[-RESPONSES:, -RESPONSES:])
