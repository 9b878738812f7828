# SPDX-License-Identifier: Apache-2.0
"""Errors of the model that noise does not show: intervals that hold every reading of a recording which it allows.

A lag between force and depth, or a filter that is not declared, is one more reading of the same recording: the fit with
it is another answer, and the reported interval holds both.
"""

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from ..statistics.noise import TWO_SIDED
from .cycle_estimates import CycleFit


def holding(fit: CycleFit, others: Iterable[CycleFit]) -> CycleFit:
    """The fit with intervals that hold those of the ``others`` too; its covariance has their differences."""
    low, high, covariance = dict(fit.low), dict(fit.high), fit.covariance
    others = tuple(others)
    for other in others:
        for name in fit.values.keys() & other.values.keys():
            low[name] = _farther(min, low[name], other.low[name])
            high[name] = _farther(max, high[name], other.high[name])
        shift = [other.values.get(name, fit.values[name]) - fit.values[name] for name in fit.covariance_order]
        covariance = covariance + _spread(np.array(shift))
    return replace(fit, low=low, high=high, covariance=covariance, widened=True) if others else fit


def _farther(end, one: float, other: float) -> float:
    """The farther of two limits; a limit that is not known does not count."""
    return one if math.isnan(other) else end(one, other)


def _spread(shift: np.ndarray) -> np.ndarray:
    """Covariance (p, p) of values that differ by up to ``shift`` (p,), at the level of the intervals."""
    known = np.where(np.isfinite(shift), shift, 0.0) / TWO_SIDED
    return np.outer(known, known)
