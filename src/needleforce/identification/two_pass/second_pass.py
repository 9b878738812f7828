# SPDX-License-Identifier: Apache-2.0
"""Tests whether a second pass contains only friction, and the depth to which its friction is linear in depth."""

import numpy as np

from ...models.validity import FRICTION_LIMIT
from ..statistics.regression import least_squares, line
from .result import Site

MAX_STIFFNESS_SHARE = 0.2  # [of the first loading curve] a dimple or the tip opening the hole gives about 0.1
MIN_FALL = 0.05  # [of the largest force so far]
MIN_FALL_SIGMA = 6.0  # [standard deviations of the noise]
MAX_UNEVENNESS = 0.25  # [of the mean difference] less is local variation of friction; also used for an oscillation
MIN_UNEVENNESS_RATIO = 2.0  # over the change between neighbouring parts; an oscillation of the cutting force is below
MIN_LASTING_SHARE = 0.4  # [of a drop] the means around a drop include the rise before and after it
RUPTURE_MARGIN_M = 0.3e-3  # [m] after which a rupture has ended, as in segmentation
BIN_M = 0.25e-3  # [m] wider than any filter, so that the bins' residuals are independent
MIN_BINS = 12
CUSUM_BOUND = 1.36  # Ploberger & Kraemer 1992: 5 % bound of the largest OLS-CUSUM
MIN_NONLINEARITY = 0.01  # [of the force] a smaller departure from a line is not relevant, even if significant


def stiffness_share(
    first: tuple[np.ndarray, np.ndarray], second: tuple[np.ndarray, np.ndarray], puncture: float
) -> tuple[float, float]:
    """The share of the first pass's loading curve in the second pass, and its interval's half width; NaN if unknown.

    ``first`` and ``second`` are indentation (n,) [m] and force (n,) [N]. Over the depths up to the ``puncture`` [m], or
    to where the second pass first falls, its force is a line, friction, plus that share of the first's.
    """
    end = _first_fall(*second, puncture)
    width = end / (2 * MIN_BINS)
    (depth, loading), (at, force) = (bin_means(*each, 0.0, end, width) for each in (first, second))
    if len(at) < MIN_BINS or len(depth) < MIN_BINS:
        return np.nan, np.nan
    design = np.column_stack([np.interp(at, depth, loading), at, np.ones_like(at)])
    values, covariance, t = least_squares(design, force)
    return float(values[0]), t * float(np.sqrt(covariance[0, 0]))


def lasting_drops(depth: np.ndarray, force: np.ndarray, drops: list[tuple[float, float]]) -> int:
    """Number of ``drops``, each a depth [m] and a size [N], after which the force (n,) stays lower, unlike a spike."""
    lasting = 0
    for place, size in drops:
        before = force[(depth > place - RUPTURE_MARGIN_M) & (depth <= place)]
        after = force[(depth > place + RUPTURE_MARGIN_M) & (depth <= place + 2 * RUPTURE_MARGIN_M)]
        lasting += bool(len(before) and len(after) and before.mean() - after.mean() > MIN_LASTING_SHARE * size)
    return lasting


def _first_fall(depth: np.ndarray, force: np.ndarray, puncture: float) -> float:
    """Indentation [m] of the peak before the first fall by 5 % of the largest force; the puncture without a fall."""
    at, means = bin_means(depth, force, 0.0, puncture, puncture / (4 * MIN_BINS))
    if len(at) < MIN_BINS:
        return puncture
    # from second differences: a steady rise is not noise
    noise = float(np.median(np.abs(np.diff(means, 2)))) / 0.6745 / np.sqrt(6.0)
    fallen = np.flatnonzero(np.maximum.accumulate(means) - means > max(MIN_FALL * means.max(), MIN_FALL_SIGMA * noise))
    return float(at[np.argmax(means[: fallen[0]])]) if len(fallen) else puncture


def unevenness(depth: np.ndarray, difference: np.ndarray) -> float:
    """Departure of the difference (n,) [N] of both passes from a line in depth (n,) [m], over its mean; 0 within the
    noise."""
    slope, intercept, _, _ = line(depth, difference)
    residual = difference - slope * depth - intercept
    departure, noise = float(np.std(residual)), float(np.std(np.diff(residual))) / np.sqrt(2.0)
    return departure / abs(float(difference.mean())) if departure > MIN_UNEVENNESS_RATIO * noise else 0.0


def not_friction_only(site: Site) -> tuple[str, ...]:
    """Reasons why the second pass contains more than friction, each as the end of a sentence."""
    reasons = []
    if site.stiffness_share - site.stiffness_share_half > MAX_STIFFNESS_SHARE:
        reasons.append(f"still deform the tissue, with {site.stiffness_share:.2f} of the first pass's loading curve")
    if site.drops:
        reasons.append("drop as at a puncture")
    if site.unevenness > MAX_UNEVENNESS:
        reasons.append("give a difference that neither a constant nor a line in depth describes")
    return tuple(reasons)


def friction_window(depth: np.ndarray, force: np.ndarray, puncture: float) -> tuple[float, float, str]:
    """Start and end [m] of the window in which the force is linear in depth, and the reason for its end.

    It starts at the ``puncture`` [m] of the first pass, but not deeper than 30 % of the window, as tissue may puncture
    beyond the window. It ends at 12 mm, beyond which the needle bends in the paper, at a break in the CUSUM of the
    line's residuals, or at the end of the data, whichever comes first.
    """
    limit = min(FRICTION_LIMIT, float(depth.max()))
    reason = "the paper's 12 mm" if limit == FRICTION_LIMIT else "the end of the insertion"
    start, end = min(puncture, 0.3 * limit), limit
    while (found := _break(*bin_means(depth, force, start, end))) is not None:
        end, reason = found, "a break in the CUSUM of the residuals"
    return start, end, reason


def bin_means(
    depth: np.ndarray, force: np.ndarray, start: float, end: float, width: float = BIN_M
) -> tuple[np.ndarray, np.ndarray]:
    """Mean depth and force of the complete bins of ``width`` [m] between start and end."""
    count = max(int(round((end - start) / width, 6)), 0)
    index = np.floor((depth - start) / width).astype(int)
    inside = (index >= 0) & (index < count)
    number = np.bincount(index[inside], minlength=count)
    filled = number > 0
    mean = [np.bincount(index[inside], x[inside], minlength=count)[filled] / number[filled] for x in (depth, force)]
    return mean[0], mean[1]


def _break(depth: np.ndarray, force: np.ndarray) -> float | None:
    """The depth of a kink, if the OLS-CUSUM of the straight line exceeds its bound and the kink is relevant."""
    if len(depth) < MIN_BINS:
        return None
    residual = force - np.polyval(np.polyfit(depth, force, 1), depth)
    # from differences: curvature of the complete curve would otherwise count as noise
    sd = float(np.std(np.diff(residual))) / np.sqrt(2.0)
    cusum = float(np.abs(np.cumsum(residual)).max())
    small = np.abs(residual).max() <= MIN_NONLINEARITY * np.abs(force).max()
    if cusum <= CUSUM_BOUND * sd * np.sqrt(len(residual)) or small:
        return None
    return _kink(depth, force)


def _kink(depth: np.ndarray, force: np.ndarray) -> float:
    """The depth at which two lines meet, by least squares."""
    places = depth[MIN_BINS // 3 : -MIN_BINS // 3]

    def misfit(place: float) -> float:
        design = np.column_stack([np.ones_like(depth), depth, np.maximum(depth - place, 0.0)])
        return float(np.sum((force - design @ np.linalg.lstsq(design, force, rcond=None)[0]) ** 2))

    return float(min(places, key=misfit))
