# SPDX-License-Identifier: Apache-2.0
"""Whether a second pass is friction only, and to which depth its friction grows in proportion."""

import numpy as np

from ...models.validity import FRICTION_LIMIT
from ..statistics.regression import least_squares, line
from .result import Site

DEFORMS = 0.2  # of the first pass's loading curve: a dimple or the tip opening the hole bends the force by a tenth
FALL = 0.05  # of the greatest force so far
SURE = 6.0  # standard deviations of the noise
UNEVEN = 0.25  # of the mean difference, as of a swing: less is passes that differ in friction here and there
ABOVE_NOISE = 2.0  # times its change from one stretch to the next: a swing of the cutting force stays below, too
LASTS = 0.4  # of a drop: the means around it also hold what rises before and after
ASIDE = 0.3e-3  # [m] over which a rupture is over, as in segmentation
BIN = 0.25e-3  # [m]; wider than any filter's memory, so that the bins' residuals are independent
LEAST_BINS = 12
CRITICAL = 1.36  # Ploberger & Kraemer 1992: 5 % bound of the largest OLS-CUSUM
PRACTICAL = 0.01  # of the force: what bends less is a line for friction's purpose, however sure the bend is


def stiffness_share(first: tuple, second: tuple, puncture: float) -> tuple[float, float]:
    """The share of the first pass's loading curve that the second shows, and its 95 % half width; NaN if untold.

    ``first`` and ``second`` are indentation (n,) [m] and force (n,) [N]. Over the depths up to the ``puncture`` [m], or
    to where the second pass first falls, its force is a line, friction, plus that share of the first's.
    """
    end = _first_fall(*second, puncture)
    width = end / (2 * LEAST_BINS)
    (depth, loading), (at, force) = (bin_means(*each, 0.0, end, width) for each in (first, second))
    if len(at) < LEAST_BINS or len(depth) < LEAST_BINS:
        return np.nan, np.nan
    design = np.column_stack([np.interp(at, depth, loading), at, np.ones_like(at)])
    values, covariance, t = least_squares(design, force)
    return float(values[0]), t * float(np.sqrt(covariance[0, 0]))


def lasting_drops(depth: np.ndarray, force: np.ndarray, drops: list[tuple[float, float]]) -> int:
    """How many ``drops``, each a depth [m] and a size [N], leave the force (n,) lower; a spike of noise does not."""
    lasting = 0
    for place, size in drops:
        before = force[(depth > place - ASIDE) & (depth <= place)]
        after = force[(depth > place + ASIDE) & (depth <= place + 2 * ASIDE)]
        lasting += bool(len(before) and len(after) and before.mean() - after.mean() > LASTS * size)
    return lasting


def _first_fall(depth: np.ndarray, force: np.ndarray, puncture: float) -> float:
    """Where the force stops to rise before it first falls by a twentieth of its greatest; the puncture if it does
    not."""
    at, means = bin_means(depth, force, 0.0, puncture, puncture / (4 * LEAST_BINS))
    if len(at) < LEAST_BINS:
        return puncture
    # of second differences: a steady rise is no noise
    noise = float(np.median(np.abs(np.diff(means, 2)))) / 0.6745 / np.sqrt(6.0)
    fallen = np.flatnonzero(np.maximum.accumulate(means) - means > max(FALL * means.max(), SURE * noise))
    return float(at[np.argmax(means[: fallen[0]])]) if len(fallen) else puncture


def unevenness(depth: np.ndarray, difference: np.ndarray) -> float:
    """How far the difference (n,) [N] of both passes departs from a line in depth (n,) [m], over its mean; 0 within the
    noise."""
    slope, intercept, _, _ = line(depth, difference)
    residual = difference - slope * depth - intercept
    apart, alike = float(np.std(residual)), float(np.std(np.diff(residual))) / np.sqrt(2.0)
    return apart / abs(float(difference.mean())) if apart > ABOVE_NOISE * alike else 0.0


def not_friction_only(site: Site) -> tuple[str, ...]:
    """What shows that the second pass is more than friction, each as the end of a sentence; empty if nothing does."""
    said = []
    if site.stiffness_share - site.stiffness_share_half > DEFORMS:
        said.append(f"still deform, with {site.stiffness_share:.2f} of the first pass's loading curve")
    if site.drops:
        said.append("drop as at a puncture")
    if site.unevenness > UNEVEN:
        said.append("leave a difference that neither a constant nor a line in depth describes")
    return tuple(said)


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
