# SPDX-License-Identifier: Apache-2.0
"""Intervals of a least-squares fit whose residuals may be correlated, as behind an average filter."""

import math
from typing import NamedTuple

import numpy as np

from ... import core

Z_90, Z_95 = 1.6448536269514722, 1.959963984540054
"""Half widths of 90 % and 95 % intervals in standard errors; the first bounds one side at 95 %."""

MARGIN = 40.0
"""Punctures whose sum of squares is this many variances above the least weigh nothing: exp(-20)."""

RUN = 5
"""As many insignificant autocorrelations in a row end the search for more."""


class Noise(NamedTuple):
    """Noise of one stroke: sum of squares [N²] over the samples used, their number, their variance [N²].

    ``long_run`` is the sum of the autocovariances over all lags [N²]: what the mean of many samples feels. ``reach`` is
    the last correlated lag found, ``fades`` the factor from one lag to the next where correlation fades evenly, else 0.
    """

    sse: float = 0.0
    count: int = 0
    variance: float = 0.0
    long_run: float = 0.0
    reach: int = 0
    fades: float = 0.0


def noise_of(residual: np.ndarray, count: int, filter_length: int = 1, lost: float = 0.0) -> Noise:
    """Estimate the noise of one stroke from its residual, (n,) [N] in the order of time, zero where left out.

    ``count`` samples were used; ``lost`` is the number of parameters this stroke paid for: smooth parameters take
    their share from low frequencies only, that is from the long-run variance, as many times as lags are summed.

    The window is flat (weight 1) up to the filter length, or up to the lag where the autocorrelation is lost in its own
    noise, and falls to 0 at twice that lag: Politis & Romano (1995), lag chosen as in Politis (2003). A triangular
    window (Newey & West 1987) weighs the lags within the filter down and so understates the noise, as blocks do. A
    correlation that fades evenly, as of drift, has no last lag: its tail is summed (Andrews & Monahan 1992).
    """
    if count < 2:
        return Noise(count=count)
    covariance, found = _autocovariance(residual, count, filter_length)
    plain = float(covariance[0])
    variance = plain / max(1.0 - lost / count, 0.5)
    reach = min(max(found, filter_length if filter_length > 1 else 0), (len(covariance) - 1) // 2)
    fades, long_run = _fading(residual, covariance, found, lost / count) if filter_length == 1 else (0.0, 0.0)
    if not fades:
        long_run, lags = _flat_top(covariance, reach)
        long_run /= max(1.0 - lost * lags / count, 0.5)
    return Noise(plain * count, count, variance, max(long_run, variance), found, fades)


def _flat_top(covariance: np.ndarray, reach: int) -> tuple[float, float]:
    """The sum of autocovariances within the window, and the sum of its weights."""
    weight = np.clip(2.0 - np.arange(1, 2 * reach) / max(reach, 1), 0.0, 1.0)
    return float(covariance[0] + 2.0 * (weight @ covariance[1 : len(weight) + 1])), 1.0 + 2.0 * float(weight.sum())


def _fading(residual: np.ndarray, covariance: np.ndarray, found: int, lost: float) -> tuple[float, float]:
    """Factor by which the correlation fades from lag to lag, and the long-run variance [N²] that it gives; (0, 0) where
    it does not fade evenly. ``lost`` is the share of the samples that was paid for parameters.

    The factor a is that from the first lag on: noise of the sensor adds to lag 0 alone. It comes out too small by
    2 a / count + (1 + a) lost (Marriott & Pope 1954), which the long-run variance, with 1 / (1 - a), would feel.
    """
    count, lags = len(residual), covariance[1 : max(found // 2, 1) + 2]
    if not found:
        return 0.0, 0.0
    fades = float(lags[1:] @ lags[:-1] / (lags[:-1] @ lags[:-1]))
    fades = min(fades + 2.0 * fades / count + (1.0 + fades) * lost, 1.0 - 1.0 / count)
    if not fades > 0.0 or not _white_without(residual, fades, 2 * found):
        return 0.0, 0.0
    start = float(lags.sum()) * (1.0 - fades) / (1.0 - fades ** len(lags))
    return fades, float(covariance[0]) + 2.0 * start / (1.0 - fades)


def _white_without(residual: np.ndarray, fades: float, lags: int) -> bool:
    """True if what is new in each sample is correlated with no other but the next."""
    new = residual[1:] - fades * residual[:-1]
    covariance = core.lagged_products(new, lags)
    white = 2.0 * math.sqrt(math.log10(len(new)) / len(new) * (1.0 + 2.0 * (covariance[1] / covariance[0]) ** 2))
    return bool(np.abs(covariance[2:]).max() < white * covariance[0])


def _autocovariance(residual: np.ndarray, count: int, filter_length: int) -> tuple[np.ndarray, int]:
    """Autocovariances as far as needed, and the last lag before a run of insignificant ones."""
    lags, longest = RUN if filter_length == 1 else 3 * filter_length, max(len(residual) // 4, RUN)
    while True:
        lags = min(lags, longest)
        covariance = core.lagged_products(residual, lags) / count
        found = _correlation_reach(covariance, count)
        if 2 * found <= lags or lags == longest:
            return covariance, min(found, lags // 2)
        lags *= 2


def _correlation_reach(covariance: np.ndarray, count: int) -> int:
    """Smallest lag after which a run of autocorrelations is within its noise (whose spread is Bartlett's, 1946)."""
    white = 2.0 * math.sqrt(math.log10(count) / count)
    if max(map(abs, covariance[1 : RUN + 1].tolist())) <= white * covariance[0]:
        return 0
    correlation = covariance[1:] / covariance[0]
    small = np.abs(correlation) < white * np.sqrt(1.0 + 2.0 * (np.cumsum(correlation**2) - correlation**2))
    for lag in range(len(small) - RUN + 1):
        if small[lag : lag + RUN].all():
            return lag
    return len(small)


def sandwich(bread: np.ndarray, grams: np.ndarray, noises: list[Noise]) -> np.ndarray:
    """Covariance of the parameters, (p, p): B (Σ J'ΩJ) B over the strokes, whose noises are independent; B = (ΣJ'J)⁻¹.

    ``grams`` (2, p, p) are J'J of either stroke. J is smooth on the scale of the filter, so that J'ΩJ is the long-run
    variance times J'J, but for the jumps at the segments' ends: a share of some filter length over segment length (1 %
    of the standard errors at 50 samples in 2400), neglected on the wide side.
    """
    return bread @ (noises[0].long_run * grams[0] + noises[1].long_run * grams[1]) @ bread


def likely_punctures(gain: np.ndarray, variance: float) -> tuple[np.ndarray, np.ndarray]:
    """Positions in ``gain`` the puncture may have and their posterior weights, (k,) each, heaviest first, in all 95 %.

    ``gain[i]``: the part of the sum of squares that is explained with the puncture there [N²]. With a flat prior its
    weight is exp(gain / 2 variance); the smallest set with 95 % of the weight is the exact answer for a change point,
    which has no standard error: it lies between two samples.
    """
    best = int(gain.argmax())
    near = (gain > gain[best] - MARGIN * variance).nonzero()[0]
    if len(near) < 2:
        return np.array([best]), np.ones(1)
    weight = np.exp((gain[near] - gain[best]) / (2.0 * variance))
    order = (-weight).argsort()
    weight = weight[order] / weight.sum()
    kept = int(weight.cumsum().searchsorted(0.95)) + 1
    return near[order[:kept]], weight[:kept] / weight[:kept].sum()
