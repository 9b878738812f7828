# SPDX-License-Identifier: Apache-2.0
"""The paper's own procedure: friction from a second insertion into the same hole, cutting by subtraction."""

from dataclasses import dataclass
from math import nan

import numpy as np


@dataclass(frozen=True, eq=False)
class Site:
    """One site, both passes on one grid of indentation (m,) [m]: forces [N] and their difference.

    ``oscillating`` (s,) [N] is the difference in steps too fine for an oscillation of the cutting force to be
    averaged away, and ``noise`` [N] the standard deviation of a pass that does not cut, in such steps.
    ``friction_depth`` (k,) [m] and ``friction_force`` (k,) [N] are the second pass; ``friction_slope`` [N/m] and
    ``friction_intercept`` [N] the line through it within the friction window, which ends at ``friction_end`` [m] for
    ``friction_end_reason``. ``cutting`` [N] is the mean difference. The ``_half`` are half widths of 95 % intervals
    within the site, from means over stretches of travel longer than the filter's memory.

    What the biases rest on: ``puncture`` [m] of the first pass and the indentation at which that pass left the tissue,
    ``exit`` [m]; ``first_slope`` [N/m] after the puncture, and ``slope_difference`` [N/m], first minus second, over the
    same depths, whose mean is ``mean_depth`` [m]. ``stiffness_share`` is how much of the first pass's loading curve the
    second still shows, ``drops`` how often it falls as at a puncture, ``unevenness`` the difference's departure from a
    line over its mean, above the noise. ``doubts`` are about this pair alone.
    """

    grid: np.ndarray
    first: np.ndarray
    second: np.ndarray
    difference: np.ndarray
    oscillating: np.ndarray
    noise: float
    friction_depth: np.ndarray
    friction_force: np.ndarray
    friction_slope: float
    friction_slope_half: float
    friction_intercept: float
    friction_end: float
    friction_end_reason: str
    cutting: float
    cutting_half: float
    friction_intercept_half: float = nan
    puncture: float = nan
    exit: float = nan
    first_slope: float = nan
    slope_difference: float = nan
    slope_difference_half: float = nan
    mean_depth: float = nan
    stiffness_share: float = nan
    stiffness_share_half: float = nan
    drops: int = 0
    unevenness: float = 0.0
    doubts: tuple[str, ...] = ()


@dataclass(frozen=True)
class BiasTerm:
    """One thing that the subtraction cannot separate: its size [``unit``], and what it adds to the cutting force [N].

    ``low`` to ``high`` is the 95 % interval of ``value`` where it was measured, else its bounds, and ``value`` is NaN
    where there are only bounds. The identified cutting force is the true one plus ``adds_low`` to ``adds_high``.
    """

    name: str
    value: float
    low: float
    high: float
    unit: str
    adds_low: float
    adds_high: float
    sentence: str


@dataclass(frozen=True, eq=False)
class TwoPass:
    """Every site, and what the procedure cannot separate: ``terms``, with their sizes, and ``biases``, all of it in
    plain words.

    ``upper_bound`` is True where a second pass still deforms or drops, so that the difference is an upper bound of the
    cutting force. ``cutting_range`` [N] is where the cutting force may lie with the terms; it is no interval of chance
    and knows nothing of noise and scatter. No corrected value is made of it.
    """

    sites: tuple[Site, ...]
    upper_bound: bool = False
    biases: tuple[str, ...] = ()
    terms: tuple[BiasTerm, ...] = ()
    cutting_range: tuple[float, float] = (nan, nan)
