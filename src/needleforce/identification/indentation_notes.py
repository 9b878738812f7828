# SPDX-License-Identifier: Apache-2.0
"""What an indentation fit refuses to answer, and what it says beside its numbers."""

import math

import numpy as np

from ..errors import InputError
from ..mechanics.contact import contact
from ..mechanics.validity import SMALL_SLOPE_ANGLE
from .contact_search import LEAST_IN_CONTACT, ContactSearch
from .one_layer.deformation_fit import LEAST_SAMPLES, SIGN
from .statistics.noise import Noise

LEAST_FREE = 5  # samples before contact
SURE = 5.0  # standard errors; in noise alone a search over all contact depths finds 3
ROUNDING = 1e-10  # of the force: a rise below this is none
WIDE = 0.1  # of the indentation
MISFIT = 2.0  # residual in contact over that of the free travel


def refuse_no_contact(search: ContactSearch, place: float, noise: Noise) -> None:
    """InputError where the force does not rise, or contact is at an end of the curve."""
    gain = search.gain(place)
    if not gain > max(SURE**2 * noise.long_run, ROUNDING**2 * float(search.force_given @ search.force_given)):
        raise InputError("force", "not rising with depth", "no contact is found on the curve", next_step=SIGN)
    free = int((search.depth <= place).sum())
    if free < LEAST_FREE:
        raise InputError(
            "contact depth",
            f"at the start of the curve ({free} samples before it)",
            f"at least {LEAST_FREE} of free travel are needed",
            next_step="Give a curve that begins clear of the surface, or another tip or baseline.",
        )
    if (search.depth > place).sum() <= LEAST_IN_CONTACT:
        raise InputError("contact depth", "at the end of the curve", next_step="Give a curve that goes deeper.")


def notes_on(search: ContactSearch, place: float, modulus: float, half: np.ndarray, residual: np.ndarray):
    """Sentences on a fit with contact at ``place``; ``half`` are the half intervals of modulus and contact."""
    said = [_contact(search, place, half[1]), _slope(search, place), _misfit(search, place, residual)]
    if not half[0] < modulus:
        said.append("The interval of the reduced modulus holds 0: this curve does not tell a stiffness.")
    return tuple(sentence for sentence in said if sentence)


def _contact(search: ContactSearch, place: float, half: float) -> str:
    if not half < place:
        return "The interval of the contact depth reaches the start of the curve: there is too little free travel."
    share = half / (search.span - place)
    if share <= WIDE:
        return ""
    return (
        f"The contact depth is known to {100 * share:.2g} % of the indentation only, and the modulus goes with it; its "
        "interval is that of small errors."
    )


def _slope(search: ContactSearch, place: float) -> str:
    """The limit of small slopes, at the edge of the deepest contact, where a tip is steepest."""
    deepest = contact(search.tip, depth=search.span - place, reduced_modulus=1.0, shank_radius=search.shank_radius)
    radius = min(deepest.contact_radius, deepest.tip.end * (1.0 - 1e-9))
    slope = float(deepest.tip.slope(radius))
    if slope <= (1.0 + 1e-9) / math.tan(SMALL_SLOPE_ANGLE):
        return ""
    return (
        f"At the deepest sample the tip's slope at the edge of the contact is {slope:.3g}, that of a half angle of "
        f"{math.degrees(math.atan2(1.0, slope)):.3g} degrees and below 60: representative strain {0.2 * slope:.2f}, so "
        "the modulus is that of a scaling law, not of the tissue at small strain."
    )


def _misfit(search: ContactSearch, place: float, residual: np.ndarray) -> str:
    inside = search.depth > place
    if (~inside).sum() < LEAST_SAMPLES:
        return ""
    free, within = (float(np.sqrt(np.mean(residual[part] ** 2))) for part in (~inside, inside))
    ratio = within / max(free, ROUNDING * float(np.abs(search.force_given).max()))
    if ratio <= MISFIT:
        return ""
    return (
        f"In contact the residual is {ratio:.2g} times that of the free travel: tip or half-space do not describe this "
        "curve, and the intervals take that for noise."
    )
