# SPDX-License-Identifier: Apache-2.0
"""The paper's own procedure: friction from a second insertion into the same hole, cutting by subtraction."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Site:
    """One site, both passes on one grid of indentation (m,) [m]: forces [N] and their difference.

    ``swinging`` (s,) [N] is the difference in steps too fine for a swing of the cutting force to be averaged away, and
    ``noise`` [N] the standard deviation of a pass that does not cut, in such steps.
    ``friction_depth`` (k,) [m] and ``friction_force`` (k,) [N] are the second pass; ``friction_slope`` [N/m] and
    ``friction_intercept`` [N] the line through it within the friction window, which ends at ``friction_end`` [m] for
    ``friction_end_reason``. ``cutting`` [N] is the mean difference. The ``_half`` are half widths of 95 % intervals
    within the site, from means over stretches of travel longer than the filter's memory.
    """

    grid: np.ndarray
    first: np.ndarray
    second: np.ndarray
    difference: np.ndarray
    swinging: np.ndarray
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


@dataclass(frozen=True, eq=False)
class TwoPass:
    """Every site, and what the procedure cannot separate, in plain words. ``upper_bound`` is True where the second
    pass still deforms or drops, so that the difference only bounds the cutting force from above."""

    sites: tuple[Site, ...]
    upper_bound: bool = False
    biases: tuple[str, ...] = ()
