# SPDX-License-Identifier: Apache-2.0
"""Results of the paper's two-pass procedure: friction from a second insertion, cutting force by subtraction."""

from dataclasses import dataclass
from math import nan

import numpy as np


@dataclass(frozen=True, eq=False, kw_only=True)
class Site:
    """One site: both passes on one grid of indentation, and the quantities of the subtraction.

    Names in ``_half`` are half widths of intervals within the site, from means over parts of the travel longer than the
    filter.

    Attributes
    ----------
    grid : numpy.ndarray
        Indentation (m,) [m].
    first, second, difference : numpy.ndarray
        Force (m,) [N] of either pass, and first minus second.
    oscillating : numpy.ndarray
        The difference (s,) [N] in steps fine enough not to average an oscillation of the cutting force.
    noise : float
        Standard deviation [N], in such steps, of a pass that does not cut.
    friction_depth, friction_force : numpy.ndarray
        Indentation (k,) [m] and force (k,) [N] of the second pass.
    friction_slope, friction_intercept : float
        Slope [N/m] and intercept [N] of the line through the second pass within the friction window.
    friction_end, friction_end_reason : float, str
        End of that window [m], and its reason.
    cutting : float
        Mean difference [N].
    puncture, exit : float
        Indentation [m] of the first pass at its puncture and at its exit from the tissue.
    first_slope, slope_difference : float
        Slope [N/m] of the first pass after the puncture, and first minus second slope over the same depths.
    mean_depth : float
        Mean of these depths [m].
    stiffness_share : float
        Share [1] of the first pass's loading curve that the second pass still has.
    drops : int
        Number of lasting force drops in the second pass.
    unevenness : float
        Departure of the difference from a line, over its mean [1], where it is above the noise.
    doubts : tuple of str
        Sentences on this pair only.
    forms : tuple of FrictionForm
        The second pass, with intercept and from the puncture to its deepest point, under each form of the foundation;
        the lowest BIC first. Empty with too few bins.
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
    forms: tuple["FrictionForm", ...] = ()


@dataclass(frozen=True, kw_only=True)
class FrictionForm:
    """Friction against the embedded length under one form of the foundation.

    Attributes
    ----------
    form : str
        ``linear``, or a nonlinear form in ``mechanics.foundation.FORMS``.
    values, low, high : dict of str to float
        ``friction_per_length`` [N/m] of a straight shaft, and of a nonlinear form ``settlement_ratio`` [1],
        ``deflection_length`` [m] and ``friction_bend`` [1], the departure of the force from the line of the straight
        shaft at the largest embedded length. ``low`` and ``high`` are the limits of the joint 95 % region of
        settlement ratio and deflection length, all other parameters at their best: 95 % or more for each.
    identifiable : tuple of str
        The names with an interval that ends inside the range that was searched.
    bic : float
        Schwarz's criterion, bins of 0.25 mm counted as independent.
    """

    form: str
    values: dict[str, float]
    low: dict[str, float]
    high: dict[str, float]
    identifiable: tuple[str, ...]
    bic: float


@dataclass(frozen=True, kw_only=True)
class BiasTerm:
    """One bias that the subtraction cannot separate: its size, and its effect on the cutting force.

    Attributes
    ----------
    name : str
        ``dimple``, ``intercept``, ``unequal_friction`` or ``spreading_force``.
    value : float
        Its size [``unit``]; NaN where only limits are known.
    low, high : float
        Interval of ``value`` where it was measured, otherwise its limits [``unit``].
    unit : str
        SI unit.
    adds_low, adds_high : float
        The identified cutting force is the true one plus ``adds_low`` to ``adds_high`` [N].
    sentence : str
        The same in words.
    """

    name: str
    value: float
    low: float
    high: float
    unit: str
    adds_low: float
    adds_high: float
    sentence: str


@dataclass(frozen=True, eq=False, kw_only=True)
class TwoPass:
    """Result of the two-pass procedure over all sites, with its biases.

    Attributes
    ----------
    sites : tuple of Site
        The result at each site.
    upper_bound : bool
        True where a second pass still deforms or drops, so that the difference is an upper bound of the cutting force.
    biases : tuple of str
        All sentences on the biases.
    terms : tuple of BiasTerm
        The bias terms with their sizes.
    cutting_range : tuple of float
        Lower and upper limit [N] of the cutting force with the bias terms. It is not a confidence interval: noise and
        scatter are not included, and the cutting force is not corrected with it.
    """

    sites: tuple[Site, ...]
    upper_bound: bool = False
    biases: tuple[str, ...] = ()
    terms: tuple[BiasTerm, ...] = ()
    cutting_range: tuple[float, float] = (nan, nan)

    @property
    def bic(self) -> dict[str, float]:
        """Form of the foundation -> BIC of the second passes over all sites, the lowest first; empty where a site has
        too few bins."""
        named = [{each.form: each.bic for each in site.forms} for site in self.sites]
        if not all(named):
            return {}
        sums = {form: sum(each[form] for each in named) for form in named[0]}
        return dict(sorted(sums.items(), key=lambda item: item[1]))

    def forms(self, form: str) -> tuple[FrictionForm, ...]:
        """The fits of one form of the foundation, one for each site that has it."""
        return tuple(each for site in self.sites for each in site.forms if each.form == form)
