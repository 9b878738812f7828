# SPDX-License-Identifier: Apache-2.0
"""Profile likelihood of contact depth and saturation depth: the misfit of the best fit at each value."""

from typing import NamedTuple

import numpy as np

from ..errors import InputError
from .result import Fit
from .statistics.posterior import can_be_exact, posterior_of

NAMES = ("contact_depth", "saturation_depth")
N_VALUES = 201  # of a contact profile
MAX_DIFFERENCE = 25.0  # [variances] five standard errors; an interval ends at TWO_SIDED**2


class Profile(NamedTuple):
    """Profile likelihood of one depth.

    Attributes
    ----------
    values : numpy.ndarray
        Values (m,) [m] of the depth, rising.
    difference : numpy.ndarray
        Sum of squares over the noise variance (m,) [1] minus its minimum, all other parameters at their best for that
        value. The interval of the depth is where it is below ``TWO_SIDED**2`` of ``statistics.noise``, 3.84, the
        quantile of chi-square (Wilks 1938).
    """

    values: np.ndarray
    difference: np.ndarray


def profile(fit: Fit, name: str, recording: int = 0) -> Profile:
    """The profile likelihood of one depth in one recording of a fit.

    Punctures and the other depth are minimised over the posterior's grid, the coefficients in closed form.

    Parameters
    ----------
    fit : Fit
        A one-layer fit.
    name : str
        ``contact_depth`` or ``saturation_depth``.
    recording : int
        Index of the recording in ``fit.recordings``.

    Returns
    -------
    Profile

    Raises
    ------
    InputError
        For another name, for a saturation depth that was not fitted, and for a recording without an exact posterior.
    """
    each = fit.recordings[recording]
    if name not in NAMES:
        raise InputError("name of the profile", repr(name), "unknown", next_step=f"Give {' or '.join(NAMES)}.")
    if each.cycle is None or not can_be_exact(each.cycle):
        limit = "it needs a complete fit (not a staged one) with noise"
        raise InputError(f"profile of {name}", "not available", limit, each.file, "Use fit.draws() or the interval.")
    if name == "saturation_depth" and not each.cycle.saturation_sought:
        step = "Identify with model='cone_cylinder' and without a needle."
        raise InputError(f"profile of {name}", "not available", "it was not fitted", each.file, step)
    posterior = posterior_of(each.cycle, each.strokes)
    misfit, unit = posterior.linear.misfit.min(axis=0), posterior.depth_unit
    if name == "saturation_depth":
        values, smallest = unit * posterior.saturations, misfit.min(axis=1)
    else:
        values = np.linspace(posterior.contacts.min(), posterior.contacts.max(), N_VALUES)
        rows = [np.interp(values, z, row, np.inf, np.inf) for z, row in zip(posterior.contacts, misfit)]
        values, smallest = posterior.origin + unit * values, np.min(rows, axis=0)
    difference = smallest - smallest.min()
    near = difference <= MAX_DIFFERENCE
    return Profile(values[near], difference[near])
