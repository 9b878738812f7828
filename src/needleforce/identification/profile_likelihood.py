# SPDX-License-Identifier: Apache-2.0
"""Profile likelihood of contact depth and saturation depth: how much worse the best fit with each value is."""

from typing import NamedTuple

import numpy as np

from ..errors import InputError
from .result import Fit
from .statistics.posterior import can_be_exact, posterior_of

NAMES = ("contact_depth", "saturation_depth")
SHOWN = 201
FARTHEST = 25.0  # of the difference, which is 3.84 at the ends of a 95 % interval


class Profile(NamedTuple):
    """``values`` (m,) [m] of one depth in rising order, and ``difference`` (m,), the sum of squares over the variance
    of the noise above the least, all else at its best for that value. 95 % lie below 3.84 (chi-square, Wilks 1938)."""

    values: np.ndarray
    difference: np.ndarray


def profile(fit: Fit, name: str, recording: int = 0) -> Profile:
    """The profile likelihood of ``contact_depth`` or ``saturation_depth`` in one recording of a fit, by its place.

    Punctures and the other depth are minimised over the posterior's grid, the coefficients in closed form. Raises
    InputError for another name, for a saturation that was given or is none, and where the posterior is not exact.
    """
    each = fit.recordings[recording]
    if name not in NAMES:
        raise InputError("name", name, f"profiles are of {' and '.join(NAMES)}")
    if each.cycle is None or not can_be_exact(each.cycle):
        raise InputError("profile", name, "needs a complete fit with noise", each.file, "Draws and intervals remain.")
    if name == "saturation_depth" and not each.cycle.saturation_sought:
        raise InputError("profile", name, "was not sought", each.file, "Take model cone_cylinder without a needle.")
    posterior = posterior_of(each.cycle, each.strokes)
    misfit, unit = posterior.linear.misfit.min(axis=0), posterior.depth_unit
    if name == "saturation_depth":
        values, least = unit * posterior.saturations, misfit.min(axis=1)
    else:
        values = np.linspace(posterior.contacts.min(), posterior.contacts.max(), SHOWN)
        rows = [np.interp(values, z, row, np.inf, np.inf) for z, row in zip(posterior.contacts, misfit)]
        values, least = posterior.origin + unit * values, np.min(rows, axis=0)
    difference = least - least.min()
    near = difference <= FARTHEST
    return Profile(values[near], difference[near])
