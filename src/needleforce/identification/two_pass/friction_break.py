# SPDX-License-Identifier: Apache-2.0
"""Where the friction of the second pass stops to grow in proportion to depth."""

import numpy as np

from ...mechanics.validity import FRICTION_LIMIT

BIN = 0.25e-3  # [m]; wider than any filter's memory, so that the bins' residuals are independent
LEAST_BINS = 12
CRITICAL = 1.36  # Ploberger & Kraemer 1992: 5 % bound of the largest OLS-CUSUM
PRACTICAL = 0.01  # of the force: what bends less is a line for friction's purpose, however sure the bend is


def friction_window(depth: np.ndarray, force: np.ndarray, puncture: float) -> tuple[float, float, str]:
    """Start and end [m] of the window in which force is a line in depth, and why it ends there.

    It starts at the ``puncture`` [m] of the first pass, or at three tenths of the window where that lies deeper, as
    tissue may puncture beyond the window. It ends at 12 mm, beyond which the paper sees the needle bend, at the break
    that a CUSUM of the line's residuals shows, or where the data do, whichever comes first.
    """
    limit = min(FRICTION_LIMIT, float(depth.max()))
    reason = "the paper's 12 mm" if limit == FRICTION_LIMIT else "the end of the insertion"
    start, end = min(puncture, 0.3 * limit), limit
    while (found := _break(*bin_means(depth, force, start, end))) is not None:
        end, reason = found, "a break that the CUSUM of the residuals shows"
    return start, end, reason


def bin_means(
    depth: np.ndarray, force: np.ndarray, start: float, end: float, width: float = BIN
) -> tuple[np.ndarray, np.ndarray]:
    """Mean depth and force of the whole bins of ``width`` [m] between start and end."""
    count = max(int(round((end - start) / width, 6)), 0)
    index = np.floor((depth - start) / width).astype(int)
    inside = (index >= 0) & (index < count)
    number = np.bincount(index[inside], minlength=count)
    filled = number > 0
    mean = [np.bincount(index[inside], x[inside], minlength=count)[filled] / number[filled] for x in (depth, force)]
    return mean[0], mean[1]


def _break(depth: np.ndarray, force: np.ndarray) -> float | None:
    """The depth of a kink, if the OLS-CUSUM of the straight line passes its bound and the kink matters."""
    if len(depth) < LEAST_BINS:
        return None
    residual = force - np.polyval(np.polyfit(depth, force, 1), depth)
    # from differences: a bend of the whole would otherwise pass for noise
    sd = float(np.std(np.diff(residual))) / np.sqrt(2.0)
    cusum = float(np.abs(np.cumsum(residual)).max())
    if cusum <= CRITICAL * sd * np.sqrt(len(residual)) or np.abs(residual).max() <= PRACTICAL * np.abs(force).max():
        return None
    return _kink(depth, force)


def _kink(depth: np.ndarray, force: np.ndarray) -> float:
    """Least squares of two lines that meet: where they do."""
    places = depth[LEAST_BINS // 3 : -LEAST_BINS // 3]

    def misfit(place: float) -> float:
        design = np.column_stack([np.ones_like(depth), depth, np.maximum(depth - place, 0.0)])
        return float(np.sum((force - design @ np.linalg.lstsq(design, force, rcond=None)[0]) ** 2))

    return float(min(places, key=misfit))
