# SPDX-License-Identifier: Apache-2.0
"""Intervals of a least-squares fit whose residuals may be correlated, as behind an average filter."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ... import core

LEVEL = 0.95
"""Confidence level of every interval of an estimate. Also the level at which a test of a fit decides: whether repeats
agree, layers are needed, a limit is reached. To change it, change the quantiles below too."""

INTERVAL = f"{100 * LEVEL:g} % interval"
"""How tables, captions and reports name it."""

TWO_SIDED, ONE_SIDED = 1.959963984540054, 1.6448536269514722
"""Standard normal quantiles at (1 + LEVEL) / 2 and at LEVEL: the half width of an interval, and the distance of a
one-sided limit, in standard errors. Written out so that SciPy is not loaded; a test compares them with ``LEVEL``."""

SIGNIFICANT = 3.29
"""[standard errors] Noise exceeds it once in a thousand recordings."""

ONE_IN_40 = 2.241402727604947
"""[standard errors] Noise exceeds it in one of 40 recordings."""

MAX_GAIN_GAP = 40.0
"""[variances] A puncture whose sum of squares exceeds the least by more has no weight: exp(-20)."""

SLOW_WAVES, MAX_BLOCKS = 8, 64
"""Cosines whose projections give the slow part of a misfit, and the blocks of samples on which they are evaluated."""

MIN_WAVE = 1e-3
"""[of the largest] Below, a cosine is absorbed by the parameters."""

WHITE = "white"
AUTOREGRESSIVE = "autocorrelated (AR(1)) over {}: long-run variance of a first-order autoregression"
CORRELATED = "correlated over {}: flat-top long-run variance"
LONG_CORRELATED = (
    "correlated over {}, an eighth of the stroke or more: too few independent parts, intervals may be too narrow"
)
MIN_FREE_SAMPLES = 100  # of the free travel, for the correlation of the noise
FEW_LAGS = 100  # up to which direct sums are faster than a spectrum
MIN_QUIET_LAGS = 5
"""So many insignificant autocorrelations in a row end the search for further ones."""


class Noise(NamedTuple):
    """Noise of one stroke: sum of squares [N²] over the samples used, their number, their variance [N²].

    ``long_run`` is the sum of the autocovariances over all lags [N²], which sets the error of a mean of many samples.
    ``last_lag`` is the last correlated lag found [samples]; ``ar1_factor`` is the ratio of successive autocovariances
    of autocorrelated (AR(1)) noise, 0 for any other noise.
    """

    sse: float = 0.0
    count: int = 0
    variance: float = 0.0
    long_run: float = 0.0
    last_lag: int = 0
    ar1_factor: float = 0.0

    @property
    def mean_square(self) -> float:
        """Of the samples used [N²]."""
        return self.sse / self.count


@dataclass(frozen=True, eq=False, kw_only=True)
class DriftEffect:
    """``lever`` (n,) [s], the time of each sample of a fit from the drift's origin, and the drift's standard ``error``
    [N/s]."""

    lever: np.ndarray
    error: float

    def change(self, bread: np.ndarray, jacobian: np.ndarray) -> np.ndarray:
        """Change of the parameters (p,) by one standard error of the drift; ``bread`` is the inverse of J J' (p, p) of
        the jacobian J (p, n)."""
        return -bread @ (jacobian @ (self.error * self.lever))


def noise_of(residual: np.ndarray, count: int, filter_length: int = 1, lost: float = 0.0) -> Noise:
    """Estimate the noise of one stroke from its residual, (n,) [N] in the order of time, zero where left out.

    ``count`` samples were used; ``lost`` is the number of parameters that were estimated from this stroke. Smooth
    parameters reduce the residual at low frequencies only, that is the long-run variance, once for each lag summed.

    The window is flat (weight 1) up to the filter length, or up to the lag where the autocorrelation is below its own
    noise, and falls to 0 at twice that lag: Politis & Romano (1995), lag chosen as in Politis (2003). A triangular
    window (Newey & West 1987) gives the lags within the filter too little weight and so underestimates the noise, as
    blocks do. AR(1) noise, such as drift, has no last lag: its tail is summed (Andrews & Monahan 1992).
    """
    if count < 2:
        return Noise(count=count)
    covariance, found = _autocovariance(residual, count, filter_length)
    plain = float(covariance[0])
    variance = plain / max(1.0 - lost / count, 0.5)
    flat_lags = min(max(found, filter_length if filter_length > 1 else 0), (len(covariance) - 1) // 2)
    ar1_factor, long_run = _ar1(residual, covariance, found, lost / count) if filter_length == 1 else (0.0, 0.0)
    if not ar1_factor:
        long_run, lags = _flat_top(covariance, flat_lags)
        long_run /= max(1.0 - lost * lags / count, 0.5)
    return Noise(
        sse=plain * count,
        count=count,
        variance=variance,
        long_run=max(long_run, variance),
        last_lag=found,
        ar1_factor=ar1_factor,
    )


def _flat_top(covariance: np.ndarray, flat_lags: int) -> tuple[float, float]:
    """The sum of autocovariances within the window, and the sum of its weights."""
    if not flat_lags:
        return float(covariance[0]), 1.0
    weight = np.clip(2.0 - np.arange(1, 2 * flat_lags) / max(flat_lags, 1), 0.0, 1.0)
    return float(covariance[0] + 2.0 * (weight @ covariance[1 : len(weight) + 1])), 1.0 + 2.0 * float(weight.sum())


def _ar1(residual: np.ndarray, covariance: np.ndarray, found: int, lost: float) -> tuple[float, float]:
    """The AR(1) factor and the long-run variance [N²] that it gives; (0, 0) where the noise is not AR(1).

    ``lost`` is the number of estimated parameters over that of the samples. The factor a is fitted from the first lag
    on, because sensor noise adds to lag 0 only. It is too small by 2 a / count + (1 + a) lost (Marriott & Pope 1954);
    this is corrected, as the long-run variance depends on 1 / (1 - a).
    """
    count, lags = len(residual), covariance[1 : max(found // 2, 1) + 2]
    if not found:
        return 0.0, 0.0
    factor = float(lags[1:] @ lags[:-1] / (lags[:-1] @ lags[:-1]))
    factor = min(factor + 2.0 * factor / count + (1.0 + factor) * lost, 1.0 - 1.0 / count)
    if not factor > 0.0 or not _has_white_innovations(residual, factor, 2 * found):
        return 0.0, 0.0
    start = float(lags.sum()) * (1.0 - factor) / (1.0 - factor ** len(lags))
    return factor, float(covariance[0]) + 2.0 * start / (1.0 - factor)


def _has_white_innovations(residual: np.ndarray, factor: float, lags: int) -> bool:
    """True if the innovation of each sample is correlated with no other than the next."""
    innovation = residual[1:] - factor * residual[:-1]
    covariance, n = _lagged_products(innovation, lags), len(innovation)
    white = 2.0 * math.sqrt(math.log10(n) / n * (1.0 + 2.0 * (covariance[1] / covariance[0]) ** 2))
    return bool(np.abs(covariance[2:]).max() < white * covariance[0])


def _autocovariance(residual: np.ndarray, count: int, filter_length: int) -> tuple[np.ndarray, int]:
    """Autocovariances as far as needed, and the last lag before a run of insignificant ones."""
    lags = MIN_QUIET_LAGS if filter_length == 1 else 3 * filter_length
    max_lags = max(len(residual) // 4, MIN_QUIET_LAGS)
    while True:
        lags = min(lags, max_lags)
        covariance = _lagged_products(residual, lags) / count
        found = _last_correlated_lag(covariance, count)
        if 2 * found <= lags or lags == max_lags:
            return covariance, min(found, lags // 2)
        lags *= 8  # a spectrum has many more lags at once


def _lagged_products(residual: np.ndarray, lags: int) -> np.ndarray:
    """Sums of the products of (n,) residuals ``lags`` and fewer samples apart, (lags + 1,); of many lags by their
    spectrum."""
    if lags <= FEW_LAGS:
        return core.lagged_products(residual, lags)
    from scipy.fft import irfft, next_fast_len, rfft

    length = next_fast_len(len(residual) + lags, real=True)
    return irfft(np.abs(rfft(residual, length)) ** 2, length)[: lags + 1]


def _last_correlated_lag(covariance: np.ndarray, count: int) -> int:
    """Smallest lag after which a run of autocorrelations is within its noise, by the variance of Bartlett (1946)."""
    white = 2.0 * math.sqrt(math.log10(count) / count)
    if max(map(abs, covariance[1 : MIN_QUIET_LAGS + 1].tolist())) <= white * covariance[0]:
        return 0
    correlation = covariance[1:] / covariance[0]
    small = np.abs(correlation) < white * np.sqrt(1.0 + 2.0 * (np.cumsum(correlation**2) - correlation**2))
    total = np.concatenate(([0], np.cumsum(small)))
    quiet = total[MIN_QUIET_LAGS:] - total[:-MIN_QUIET_LAGS] == MIN_QUIET_LAGS
    return int(quiet.argmax()) if quiet.any() else len(small)


def slow_noise(residual: np.ndarray, design: np.ndarray, long_run: float) -> float:
    """Long-run variance [N²] of a part of a stroke from its slowest waves, at least ``long_run``.

    Misfit that is small next to the noise of a sample but extends over millimetres correlates no two samples
    significantly, and still shifts what is averaged over all of them. The projections of the residual (n,) on the
    slowest cosines, without what the ``design`` (n, p) absorbs, have the long-run variance each (equal-weighted
    cosines: Lazarus, Lewis, Stock & Watson 2018). Their mean counts where it exceeds ``long_run`` by more than noise
    does in one of 20 recordings.
    """
    blocks = min(len(residual) // 2, MAX_BLOCKS)
    if blocks < 4 * SLOW_WAVES:
        return long_run
    edges = np.linspace(0, len(residual), blocks + 1).astype(int)
    sizes = np.sqrt(np.diff(edges))
    r, *columns = (np.add.reduceat(column, edges[:-1]) / sizes for column in (residual, *design.T))
    q, _ = np.linalg.qr(np.column_stack(columns))
    waves = np.cos(np.pi * np.outer((edges[:-1] + edges[1:]) / (2.0 * edges[-1]), np.arange(1, SLOW_WAVES + 1)))
    waves, size, _ = np.linalg.svd(waves - q @ (q.T @ waves), full_matrices=False)
    waves = waves[:, size > MIN_WAVE * size[0]]
    found, k = float(np.mean((waves.T @ (r - q @ (q.T @ r))) ** 2)), waves.shape[1]
    limit = (1.0 - 2.0 / (9.0 * k) + ONE_SIDED * math.sqrt(2.0 / (9.0 * k))) ** 3  # chi-square / k: Wilson & Hilferty
    return found if found > limit * long_run else long_run


def student_quantile(freedom: int, level: float = LEVEL) -> float:
    """Half width of an interval in standard errors that were estimated with ``freedom`` degrees of freedom."""
    from scipy.special import stdtrit  # scipy.stats takes seconds to load

    return float(stdtrit(freedom, 0.5 * (1.0 + level)))


def sandwich(bread: np.ndarray, grams: np.ndarray, noises: list[Noise]) -> np.ndarray:
    """Covariance of the parameters, (p, p): B (Σ J'ΩJ) B over the strokes, whose noises are independent; B = (ΣJ'J)⁻¹.

    ``grams`` (2, p, p) are J'J of each stroke. J is smooth on the scale of the filter, so that J'ΩJ is the long-run
    variance times J'J, except for the jumps at the segments' ends. These are neglected: they make the standard errors
    too wide by a share of about filter length over segment length (1 % at 50 samples in 2400).
    """
    return bread @ (noises[0].long_run * grams[0] + noises[1].long_run * grams[1]) @ bread


def likely_punctures(gain: np.ndarray, variance: float) -> tuple[np.ndarray, np.ndarray]:
    """Positions in ``gain`` where the puncture may be and their posterior weights, (k,) each, largest weight first.

    Together they have the weight ``LEVEL``. ``gain[i]`` is the part of the sum of squares that is explained with the
    puncture at i [N²]. With a flat prior its weight is exp(gain / 2 variance). A change point lies between two samples
    and has no standard error: the smallest set with this weight is its exact interval.
    """
    best = int(gain.argmax())
    near = (gain > gain[best] - MAX_GAIN_GAP * variance).nonzero()[0]
    if len(near) < 2:
        return np.array([best]), np.ones(1)
    weight = np.exp((gain[near] - gain[best]) / (2.0 * variance))
    order = (-weight).argsort()
    weight = weight[order] / weight.sum()
    kept = int(weight.cumsum().searchsorted(LEVEL)) + 1
    return near[order[:kept]], weight[:kept] / weight[:kept].sum()


def undeclared_filter(free: np.ndarray, declared: int) -> int:
    """Length [samples] of an average filter that the (n,) free force shows and the recording does not declare; 0 for
    none.

    Behind an average of n samples the autocorrelation falls on a straight line to 0 at lag n. The length is that of the
    line through the correlated lags; it is reported where it is at least 2 and not the declared one.
    """
    if len(free) < MIN_FREE_SAMPLES:
        return 0
    place = np.arange(len(free)) - 0.5 * (len(free) - 1)
    residual = free - free.mean()
    residual -= place * (core.product(place, residual) / core.product(place, place))
    noise = noise_of(residual, len(residual), 1, 2.0)
    if noise.last_lag < 1 or noise.ar1_factor:
        return 0
    lags = np.arange(noise.last_lag + 1)
    correlation = core.lagged_products(residual, noise.last_lag)
    correlation /= correlation[0]
    slope = float((1.0 - correlation) @ lags / (lags @ lags))
    misfit = float(np.max(np.abs(correlation - (1.0 - slope * lags))))
    length = round(1.0 / slope) if slope > 0.0 else 0
    straight = misfit < SIGNIFICANT * math.sqrt(max(noise.last_lag, 1) / len(residual))
    return length if straight and length >= 2 and abs(length - declared) > 0.25 * declared else 0


def noise_words(noises: Iterable[Noise]) -> str:
    """One phrase for each kind of noise among the strokes, with the length of its correlation in samples."""
    lags: dict[str, list[int]] = {}
    for noise in noises:
        if noise.count:
            lags.setdefault(_kind(noise), []).append(noise.last_lag)
    return "; ".join(kind.format(_samples(last)) for kind, last in lags.items())


def _kind(noise: Noise) -> str:
    if not noise.last_lag:
        return WHITE
    if noise.ar1_factor:
        return AUTOREGRESSIVE
    return LONG_CORRELATED if 8 * noise.last_lag >= noise.count - 8 else CORRELATED


def _samples(lags: list[int]) -> str:
    low, high = min(lags), max(lags)
    return f"{low} samples" if low == high else f"{low} to {high} samples"
