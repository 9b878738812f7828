# SPDX-License-Identifier: Apache-2.0
"""Own estimates of repeats become pooled ones: the mean, with the scatter between repeats."""

from dataclasses import replace

import numpy as np

from .estimates import Estimate
from .statistics.noise import Z_95

MEAN = "mean of {n} repeats"


def pool(own: list[dict[str, Estimate]]) -> dict[str, Estimate]:
    """The pooled estimate of every quantity that any repeat has; with one repeat its own.

    Between-repeat scatter dominates on tissue, and the within-run error is part of it: the interval is Student's t on
    the scatter, never below the mean within-run error.
    """
    names = list(dict.fromkeys(name for estimates in own for name in estimates))
    return {name: _pooled([estimates[name] for estimates in own if name in estimates]) for name in names}


def mean_estimate(name: str, values, unit: str, source: str, half: float = np.nan) -> Estimate:
    """Mean of independent values (n,) with Student's 95 % interval and their sd; a single one has its own half
    width."""
    values = np.asarray(values, float)
    mean, n = float(values.mean()), len(values)
    if n < 2:
        return Estimate(name, mean, unit, mean - half, mean + half, None, True, source)
    sd = float(values.std(ddof=1))
    half = student(n) * sd / np.sqrt(n)
    return Estimate(name, mean, unit, mean - half, mean + half, sd, True, source)


def student(n: int) -> float:
    """Student's t for 95 % and n values."""
    from scipy.stats import t

    return float(t.ppf(0.975, n - 1))


def _pooled(repeats: list[Estimate]) -> Estimate:
    if len(repeats) == 1:
        return repeats[0]
    first, n = repeats[0], len(repeats)
    source = f"{first.source}; {MEAN.format(n=n)}"
    values = np.array([estimate.value for estimate in repeats])
    if not np.isfinite(values).all():
        return Estimate(first.name, float(values.mean()), first.unit, np.nan, np.nan, None, first.identifiable, source)
    halves = np.array([0.5 * (estimate.high - estimate.low) for estimate in repeats])
    pooled = replace(mean_estimate(first.name, values, first.unit, source), within_run_sd=_root_mean_square(halves))
    if not all(estimate.identifiable for estimate in repeats):
        # a bound that all repeats share does not scatter: the mean is no better known than each
        low, high = min(estimate.low for estimate in repeats), max(estimate.high for estimate in repeats)
        return replace(pooled, low=low, high=high, identifiable=False)
    within = np.nanmean(halves) / np.sqrt(n)
    half = max(pooled.high - pooled.value, within if np.isfinite(within) else 0.0)
    return replace(pooled, low=pooled.value - half, high=pooled.value + half)


def _root_mean_square(halves: np.ndarray) -> float | None:
    """Of the standard errors whose 95 % half widths (n,) are finite; None where none is."""
    known = halves[np.isfinite(halves)] / Z_95
    return float(np.sqrt(np.mean(known**2))) if len(known) else None
