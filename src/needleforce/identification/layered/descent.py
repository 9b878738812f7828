# SPDX-License-Identifier: Apache-2.0
"""Levenberg-Marquardt within bounds, on normal equations: a few tens of unknowns beside thousands of residuals."""

from collections.abc import Callable

import numpy as np

SHRINK, GROW = 0.2, 4.0
FIRST, LEAST, MOST = 1e-3, 1e-12, 1e8
SETTLED = 1e-5  # relative gain of a step below which …
PATIENCE = 3  # … so many steps in a row end the descent

Equations = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


def descend(
    x: np.ndarray,
    cost: Callable[[np.ndarray], float],
    equations: Equations,
    bounds: tuple[np.ndarray, np.ndarray],
    most: int,
) -> tuple[np.ndarray, float]:
    """The least ``cost`` (half a sum of squares) from x (p,) in at most ``most`` steps, and where it lies.

    ``equations(x)`` gives J'J (p, p) and J'r (p,). Damping is Marquardt's (1963), scaled by the diagonal; a step that
    leaves the bounds is cut to them, and what lies at a bound and is pushed outwards is held there.
    """
    low, high = bounds
    x = np.clip(x, low, high)
    now, damping, idle = cost(x), FIRST, 0
    gram, slope = equations(x)
    for _ in range(most):
        tried = np.clip(x - _step(gram, slope, damping, x, bounds), low, high)
        then = cost(tried)
        if not then < now:
            damping *= GROW
            if damping > MOST:
                break
            continue
        idle = idle + 1 if now - then < SETTLED * now else 0
        x, now, damping = tried, then, max(SHRINK * damping, LEAST)
        if idle == PATIENCE:
            break
        gram, slope = equations(x)
    return x, now


def _step(gram: np.ndarray, slope: np.ndarray, damping: float, x: np.ndarray, bounds) -> np.ndarray:
    low, high = bounds
    pushed = ((x <= low) & (slope > 0.0)) | ((x >= high) & (slope < 0.0))
    free = np.flatnonzero(~pushed & (gram.diagonal() > 0.0))
    part = gram[np.ix_(free, free)]
    scale = np.sqrt(part.diagonal())
    scaled = part / np.outer(scale, scale) + damping * np.eye(len(free))
    step = np.zeros_like(x)
    step[free] = np.linalg.solve(scaled, slope[free] / scale) / scale
    return step
