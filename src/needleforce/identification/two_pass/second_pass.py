# SPDX-License-Identifier: Apache-2.0
"""Tests whether a second pass contains only friction, the depth to which its friction is linear in depth, and the
friction of a bent shaft on a nonlinear foundation beyond."""

import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from ... import core
from ...mechanics.foundation import FORMS, LAWS
from ...models.laws import law_called
from ...models.model import Model
from ...models.validity import FRICTION_LIMIT
from ...vocabulary import SMALLEST
from ..statistics.noise import LEVEL, student_quantile
from ..statistics.regression import criterion, least_squares, line
from .result import FrictionForm, Site

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


RATIOS = (0.0, *np.geomspace(0.05, 10.0, 22))  # settlement_ratio; 0 is linear, and bends where one side loses contact
N_LENGTHS = 61  # values of deflection_length in one search
N_FINE = 10  # settlement ratios between two of the search before
LENGTH_RANGE = (0.05, 50.0)  # [of the largest embedded length] of deflection_length
UNIT_LENGTH = 1e-3  # [m] the smallest deflection_length of the laws


class Fits(NamedTuple):
    """Least-squares fits, (k,) each: settlement ratio, deflection length [m], friction per length [N/m], its standard
    error for a noise of 1 N, sum of squares [N^2], and bend at the largest embedded length."""

    ratio: np.ndarray
    length: np.ndarray
    friction: np.ndarray
    error: np.ndarray
    sse: np.ndarray
    bend: np.ndarray


class Bins:
    """Forces (n,) [N] of long sliding at embedded lengths (n,) [m], ``direction`` (n,) 1 inwards and -1 outwards; the
    columns of ``others`` (n, k) are fitted too."""

    def __init__(self, embedded: np.ndarray, force: np.ndarray, others: np.ndarray, direction: np.ndarray):
        self.embedded, self.direction, self.largest = embedded, direction, float(embedded.max())
        self.span = np.linalg.qr(others)[0]
        self.force, self.count, self.others = self.apart(force), len(force), others.shape[1]

    def apart(self, rows: np.ndarray) -> np.ndarray:
        """Rows (..., n) without what the other columns describe."""
        return rows - (rows @ self.span) @ self.span.T

    def free(self, form: str) -> int:
        """Degrees of freedom under a form."""
        return self.count - self.others - (1 if form == "linear" else 3)

    def line(self) -> Fits:
        """The fit of the line, of a straight shaft."""
        return self._fits(self.embedded[None], np.zeros(1), 0.0, np.full(1, math.inf))

    def nonlinear(self, form: str, ratio: float, lengths: np.ndarray) -> Fits:
        """The fits of one form and ratio for deflection lengths (k,) [m]."""
        places = np.append(self.embedded, self.largest)
        shapes = shape(form, ratio, places, lengths)
        return self._fits(shapes[:, :-1], shapes[:, -1] / self.largest - 1.0, ratio, lengths)

    def _fits(self, shapes: np.ndarray, bend: np.ndarray, ratio: float, lengths: np.ndarray) -> Fits:
        rows = self.apart(shapes * self.direction)
        norm = np.maximum(np.einsum("kn,kn->k", rows, rows), SMALLEST)
        friction = np.maximum(rows @ self.force / norm, 0.0)
        sse = np.maximum(np.sum((self.force - friction[:, None] * rows) ** 2, axis=1), SMALLEST)
        ratios, error = np.full(len(lengths), ratio), 1.0 / np.sqrt(norm)
        return Fits(ratio=ratios, length=lengths, friction=friction, error=error, sse=sse, bend=bend)


def shape(form: str, ratio: float, embedded: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Friction over friction per length (k, n) [m] at embedded lengths (n,) [m] for deflection lengths (k,) [m]; the
    shaft bends over its whole embedded length."""
    law = law_called("friction", LAWS[form])(
        per_length=1.0, settlement_ratio=ratio, deflection_length=UNIT_LENGTH, bending_length=1.0
    )
    sliding = Model(core.laws.Cone(1e5, 1.0), core.laws.PunctureDepth(0.0), law, core.laws.NoCutting())
    scaled = embedded * (UNIT_LENGTH / lengths)[:, None]
    return sliding.force(scaled.ravel()).reshape(scaled.shape) * (lengths / UNIT_LENGTH)[:, None]


def friction_forms(
    embedded: np.ndarray,
    force: np.ndarray,
    others: np.ndarray,
    direction: np.ndarray | None = None,
    forms: Iterable[str] = FORMS,
) -> tuple[FrictionForm, ...]:
    """Friction under each form of the foundation, least squares, the lowest BIC first.

    Parameters
    ----------
    embedded, force : numpy.ndarray
        Bin means (n,) of the embedded length [m] and of the force [N] of long sliding, with independent errors.
    others : numpy.ndarray
        Columns (n, k) of what else is fitted: an intercept, the cutting force of the insertion.
    direction : numpy.ndarray, optional
        1 inwards, -1 outwards (n,). Default: 1.
    forms : iterable of str
        The forms to fit. Default: all.

    Returns
    -------
    tuple of FrictionForm
        Empty with fewer than ``MIN_BINS`` bins.

    Notes
    -----
    Settlement ratio and deflection length are searched on a grid, the rest is solved (Golub & Pereyra 1973). With a
    linear foundation as the truth, n bins and two parameters more, a form has the lower BIC by chance where twice the
    gain in log-likelihood exceeds 2 ln n: in about one of n recordings (chi-square of two degrees of freedom), one of
    the three forms in about three.
    """
    if len(embedded) < MIN_BINS:
        return ()
    bins = Bins(embedded, force, others, np.ones(len(force)) if direction is None else direction)
    found = [_summary(bins, form, list(_searched(bins, form) if form in LAWS else [bins.line()])) for form in forms]
    return tuple(sorted(found, key=lambda each: each.bic))


def _searched(bins: Bins, form: str) -> Iterator[Fits]:
    """The best lengths for each ratio, then for finer ratios around the best, then over all that are possible."""
    ratios, sums = np.array(RATIOS), {}
    for found in (_near_best, _near_best, _near_best, _possible, _possible):
        for ratio in ratios:
            rounds = list(_over_lengths(bins, form, float(ratio)))
            sums[float(ratio)] = min(float(fits.sse.min()) for fits in rounds)
            yield from rounds
        known = np.array(sorted(sums))
        first, last = found(np.array([sums[ratio] for ratio in known]), bins.free(form))
        ratios = np.linspace(known[max(first - 1, 0)], known[min(last + 1, len(known) - 1)], N_FINE)[1:-1]


def _near_best(sse: np.ndarray, free: int) -> tuple[int, int]:
    """Index of the smallest sum of squares, twice."""
    return (best := int(np.argmin(sse))), best


def _possible(sse: np.ndarray, free: int) -> tuple[int, int]:
    """First and last index of the sums of squares (n,) inside the interval."""
    inside = np.flatnonzero(sse <= sse.min() * (1.0 + _joint_quantile(free) / free))
    return int(inside[0]), int(inside[-1])


def _over_lengths(bins: Bins, form: str, ratio: float) -> Iterator[Fits]:
    """A grid of lengths, and a finer one around its least sum of squares, twice."""
    grid = _coarse_lengths(bins.largest)
    for _ in range(3):
        fits = bins.nonlinear(form, ratio, grid)
        yield fits
        best = int(np.argmin(fits.sse))
        grid = np.geomspace(grid[max(best - 2, 0)], grid[min(best + 2, len(grid) - 1)], N_LENGTHS)


def _summary(bins: Bins, form: str, rounds: list[Fits]) -> FrictionForm:
    fits = Fits(*(np.concatenate(column) for column in zip(*rounds)))
    best, free = int(np.argmin(fits.sse)), bins.free(form)
    quantile = student_quantile(free) ** 2 if form == "linear" else _joint_quantile(free)
    variance = fits.sse[best] / free
    distance = (fits.sse - fits.sse[best]) / variance
    inside = distance <= quantile
    half = fits.error * np.sqrt(variance * np.maximum(quantile - distance, 0.0))
    columns = {"friction_per_length": (fits.friction, half)}
    if form != "linear":
        none = np.zeros_like(half)
        columns |= {
            "settlement_ratio": (fits.ratio, none), "deflection_length": (fits.length, none),
            "friction_bend": (fits.bend, none),
        }  # fmt: skip
    values = {name: float(column[best]) for name, (column, _) in columns.items()}
    low = {name: float((column - width)[inside].min()) for name, (column, width) in columns.items()}
    high = {name: float((column + width)[inside].max()) for name, (column, width) in columns.items()}
    low, high = _outwards(low, high, bins.largest)
    low["friction_per_length"] = max(low["friction_per_length"], 0.0)
    return FrictionForm(
        form=form, values=values, low=low, high=high, identifiable=tuple(_inside(low, high)),
        bic=criterion(fits.sse[best] / bins.count, bins.count - free, bins.count),
    )  # fmt: skip


def _joint_quantile(free: int) -> float:
    """Twice the quantile of F(2, ``free``) at ``LEVEL``: of the joint region of two parameters.

    The likelihood may have several maxima, a softer bend of both sides and a contact that is lost earlier, which one
    degree of freedom does not cover; the limits of each parameter are those of the joint region.
    """
    return free * ((1.0 - LEVEL) ** (-2.0 / free) - 1.0)


def _outwards(low: dict, high: dict, largest: float) -> tuple[dict, dict]:
    """Limits of the two searched parameters moved out to the next values of the coarse grid; the ends of the search
    become those of what is possible."""
    if "settlement_ratio" not in low:
        return low, high
    for name, grid in (("settlement_ratio", np.array(RATIOS)), ("deflection_length", _coarse_lengths(largest))):
        below, above = grid[grid < low[name] * (1 - 1e-9)], grid[grid > high[name] * (1 + 1e-9)]
        low[name] = float(below[-1]) if len(below) else 0.0
        high[name] = float(above[0]) if len(above) else math.inf
    return low, high


def _coarse_lengths(largest: float) -> np.ndarray:
    """The deflection lengths [m] of the first search."""
    first, last = (share * largest for share in LENGTH_RANGE)
    return np.geomspace(max(first, UNIT_LENGTH), last, N_LENGTHS)


def _inside(low: dict, high: dict) -> Iterator[str]:
    """The names of the parameters whose intervals are bounded and do not include that they have no effect."""
    for name in low:
        bounded = math.isfinite(low[name]) and math.isfinite(high[name])
        effective = low[name] > 0.0 or (name == "friction_bend" and high[name] < 0.0)
        if bounded and effective:
            yield name
