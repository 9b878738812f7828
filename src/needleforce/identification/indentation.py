# SPDX-License-Identifier: Apache-2.0
"""Modulus of a half-space from an indentation curve, with contact depth and baseline as part of the model."""

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..core import Tissue
from ..display.quantities import percent
from ..display.tables import in_words
from ..errors import InputError
from ..mechanics.contact import contact
from ..models.parameter_units import UNITS
from ..models.validity import SMALL_SLOPE_ANGLE
from .contact_search import MIN_IN_CONTACT, ContactSearch
from .estimates import Estimate, EstimateResult
from .one_layer.deformation_fit import FLIP_SIGN, MIN_LOADING_SAMPLES
from .one_layer.force_zero import slope_without_contact
from .statistics.noise import TWO_SIDED, Noise, noise_of
from .statistics.regression import criterion, inverse

PARAMETERS = ("reduced_modulus", "contact_depth", "baseline", "baseline_slope")
BASELINES = {
    "none": lambda depth: np.empty((0, len(depth))),
    "constant": lambda depth: np.ones((1, len(depth))),
    "line": lambda depth: np.array([np.ones_like(depth), depth]),
}
BY_READINGS = "auto"  # a line where the readings before contact show a slope, otherwise a constant
CLEARLY_FREE = 0.8  # of the travel before contact: the readings that show the slope
MIN_FREE_SAMPLES = 5  # before contact
MIN_RISE_SIGMA = 5.0  # [standard errors] in noise only, a search over all contact depths finds a rise of 3
ROUNDING = 1e-10  # [of the force] a smaller rise is rounding
MAX_CONTACT_INTERVAL = 0.1  # [of the indentation] half width; beyond, linear error propagation is too narrow
MAX_RESIDUAL_RATIO = 2.0  # residual in contact over that of the free travel; beyond, the model does not fit


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class IndentationFit(EstimateResult):
    """Fit of F = baseline + baseline_slope (depth - contact_depth) + E_r F_1(depth - contact_depth).

    Attributes
    ----------
    tip : Tip
        The tip, one of ``nf.tips``.
    parameters : dict of str to Estimate
        Estimates with their intervals by name; each is also a property: ``reduced_modulus``, ``contact_depth``,
        ``young_modulus`` (None without a Poisson ratio), ``baseline`` and ``baseline_slope`` (None where they are not
        in the model).
    residual : numpy.ndarray
        Measured minus fitted force (n,) [N] in the order given.
    bic : float
        Schwarz's criterion, each sample counted as independent.
    notes : tuple of str
        Limits of the fit, in sentences.
    """

    tip: Any
    parameters: dict[str, Estimate]
    residual: np.ndarray = field(repr=False)
    bic: float
    notes: tuple[str, ...]

    @property
    def reduced_modulus(self) -> Estimate:
        """Reduced modulus E_r [Pa]."""
        return self.parameters["reduced_modulus"]

    @property
    def young_modulus(self) -> Estimate | None:
        """Young modulus E [Pa]."""
        return self.parameters.get("young_modulus")

    @property
    def contact_depth(self) -> Estimate:
        """Depth [m] where contact begins, in the zero of the given depths."""
        return self.parameters["contact_depth"]

    @property
    def baseline(self) -> Estimate | None:
        """Force without contact [N], at the contact depth."""
        return self.parameters.get("baseline")

    @property
    def baseline_slope(self) -> Estimate | None:
        """Change of the baseline with depth [N/m]."""
        return self.parameters.get("baseline_slope")

    @property
    def residual_rms(self) -> float:
        """Root mean square of the residual [N]."""
        return float(np.sqrt(np.mean(self.residual**2)))

    def _heading(self) -> str:
        return f"IndentationFit: {in_words(self.tip)}, residual {self.residual_rms:.3g} N"

    def document(self) -> dict:
        """The numbers for JSON."""
        fitted = {"residual_rms_N": self.residual_rms, "bic": self.bic, "notes": list(self.notes)}
        return {"tip": repr(self.tip), **super().document(), **fitted}


def fit_indentation(
    depth: ArrayLike,
    force: ArrayLike,
    tip: Any,
    *,
    poisson_ratio: float | None = None,
    baseline: str = BY_READINGS,
    shank_radius: float | None = None,
    contact_depth: float | None = None,
) -> IndentationFit:
    """Fit the contact of a rigid tip to one approach by least squares, without a starting value.

    Parameters
    ----------
    depth : array_like
        Depth (n,) [m], + inwards, in the order of time: the intervals use the autocorrelation of the residual.
    force : array_like
        Force (n,) [N], + against the indentation.
    tip : Tip
        One of ``nf.tips``.
    poisson_ratio : float, optional
        Poisson ratio of the sample [1], 0 to 0.5; with it ``young_modulus`` = E_r (1 - nu²) is given too.
    baseline : str
        Force without contact: "none" (0), "constant", "line" (linear in depth) or "auto": a line where the readings
        before contact have a slope that their noise explains once in 1000 curves, with a note, otherwise a constant.
    shank_radius : float, optional
        Radius of the shank [m], as in ``nf.contact``.
    contact_depth : float, optional
        Where contact begins [m], if it is known: of a curve whose first sample is in contact, as nanoindenters record.
        Without, it is part of the fit.

    Returns
    -------
    IndentationFit

    Raises
    ------
    InputError
        For arrays that are not a curve, a force that does not rise above its baseline by five standard errors, and a
        contact depth at an end of the curve.

    Notes
    -----
    The force of the contact is that of ``nf.contact`` (Sneddon 1965); all samples have the same weight.
    """
    tissue = checked_options(poisson_ratio, baseline)
    depth, force = checked_curve(depth, force)
    zero, known = float(depth.min()), contact_depth is not None

    def searched(baseline: str) -> tuple[np.ndarray, ContactSearch, float]:
        parts = BASELINES[baseline](depth - zero)
        search = ContactSearch(depth - zero, force, parts, tip, shank_radius)
        return parts, search, _given_place(contact_depth, zero, search) if known else search.best()

    slopes = ""
    parts, search, place = searched("constant" if baseline == BY_READINGS else baseline)
    if baseline == BY_READINGS:
        line = searched("line")
        slopes = _slope_before(line[1].depth, force, line[2])
        parts, search, place = line if slopes else (parts, search, place)
    values, jacobian = _solved(search, place, parts)
    residual = force - np.delete(values, 1) @ np.delete(jacobian, 1, axis=0)
    fitted = np.delete(np.arange(len(values)), 1) if known else np.arange(len(values))
    jacobian = jacobian[fitted]
    noise = noise_of(residual, len(residual), lost=len(jacobian))
    refuse_no_contact(search, place, noise, known=known)
    half = np.zeros(len(values))
    half[fitted] = TWO_SIDED * np.sqrt(noise.long_run * np.diagonal(inverse(jacobian @ jacobian.T)))
    notes = (*([slopes] if slopes else []), *notes_on(search, place, values[0], half, residual))
    values[1] += zero
    found = {name: _estimate(name, *each, tip) for name, *each in zip(PARAMETERS, values, half)}
    if known:
        nothing = {"low": math.nan, "high": math.nan, "identifiable": False}
        found["contact_depth"] = replace(found["contact_depth"], source="as given", **nothing)
    if tissue is not None:
        found["young_modulus"] = _young(found["reduced_modulus"], tissue)
    bic = criterion(noise.mean_square, len(values), noise.count)
    return IndentationFit(tip=tip, parameters=found, residual=residual, bic=bic, notes=notes)


def checked_options(poisson_ratio: float | None, baseline: str) -> Tissue | None:
    """A tissue of 1 Pa with the Poisson ratio; None without a ratio. Raises InputError for an unknown baseline or an
    impossible ratio."""
    known = (*BASELINES, BY_READINGS)
    if baseline not in known:
        raise InputError("baseline", repr(baseline), "unknown", next_step=f"Give one of {', '.join(known)}.")
    return None if poisson_ratio is None else Tissue(1.0, poisson_ratio)


def _slope_before(depth: np.ndarray, force: np.ndarray, place: float) -> str:
    """A sentence if the readings well before contact at ``place`` have a slope that their noise does not explain."""
    free = np.flatnonzero(depth < CLEARLY_FREE * place)
    if len(free) < MIN_LOADING_SAMPLES:
        return ""
    slope = slope_without_contact(depth[free], force[free])
    if not slope.is_significant:
        return ""
    return (
        f"The force changes by {slope.value:.3g} N/m before contact, as {len(free)} readings there show: this slope of "
        'the baseline is part of the fit (baseline="constant", --baseline constant, holds it at 0).'
    )


def _given_place(contact_depth: float, zero: float, search: ContactSearch) -> float:
    """The contact depth from the least depth. Raises InputError for one at which no sample is in contact."""
    place = contact_depth - zero
    if not (math.isfinite(place) and (search.depth > place).sum() > MIN_IN_CONTACT):
        limit = f"the depths are {zero:g} to {zero + search.span:g} m, and more than {MIN_IN_CONTACT} must be deeper"
        raise InputError("contact depth", contact_depth, limit, next_step="Give the depth of the surface.")
    return float(place)


def checked_curve(depth: ArrayLike, force: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Depth and force as arrays (n,). Raises InputError if they are no curve."""
    depth, force = np.asarray(depth, float), np.asarray(force, float)
    if depth.ndim != 1 or depth.shape != force.shape or len(depth) < MIN_LOADING_SAMPLES:
        limit = f"two columns of the same length, at least {MIN_LOADING_SAMPLES} samples, are needed"
        raise InputError("shapes of depth and force", f"{depth.shape} and {force.shape}", limit)
    for name, column in (("depth", depth), ("force", force)):
        if not np.isfinite(column).all():
            first = int(np.argmin(np.isfinite(column)))
            raise InputError(name, column[first], "it must be finite", f"sample {first}", "Remove such samples.")
        if not np.ptp(column) > 0.0:
            raise InputError(name, f"constant at {column[0]:g}", "it must vary", next_step="Check the columns.")
    return depth, force


def _solved(search: ContactSearch, place: float, parts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values (p,) of ``PARAMETERS`` with contact at ``place``, and the force's derivatives by them, (p, n)."""
    unit, slope = search.unit_force(place)
    modulus = search.modulus(place)
    line = np.array(parts)
    line[1:] -= place  # the baseline's constant is its force at contact
    size = np.linalg.norm(line, axis=1)
    baseline = np.linalg.lstsq((line / size[:, None]).T, search.force_given - modulus * unit, rcond=None)[0] / size
    by_contact = -modulus * slope - sum(baseline[1:])
    return np.array([modulus, place, *baseline]), np.array([unit, by_contact, *line])


def _estimate(name: str, value: float, half: float, tip: Any) -> Estimate:
    source = f"indentation curve, rigid tip {in_words(tip)}" if name == "reduced_modulus" else "indentation curve"
    half = half if np.isfinite(half) else np.inf
    low, high = float(value - half), float(value + half)
    identifiable = low > (0.0 if name == "reduced_modulus" else -np.inf)
    return Estimate(name, float(value), UNITS[name], low, high, identifiable=identifiable, source=source)


def _young(reduced: Estimate, tissue: Tissue) -> Estimate:
    """E = E_r (1 - nu^2); its Poisson ratio is given, as no curve identifies it."""
    factor, source = (
        1.0 / tissue.plane_strain_modulus,
        f"reduced modulus and a Poisson ratio of {tissue.poisson_ratio:g}",
    )
    value, low, high = (factor * each for each in (reduced.value, reduced.low, reduced.high))
    return Estimate("young_modulus", value, UNITS["young_modulus"], low, high, identifiable=False, source=source)


def refuse_no_contact(search: ContactSearch, place: float, noise: Noise, *, known: bool = False) -> None:
    """Raises InputError for a force that does not rise, or a contact at an end of the curve if it is not ``known``."""
    gain = search.gain(place)
    if not gain > max(MIN_RISE_SIGMA**2 * noise.long_run, ROUNDING**2 * float(search.force_given @ search.force_given)):
        limit = f"it must rise above its baseline by {MIN_RISE_SIGMA:g} standard errors: no contact was found"
        raise InputError("force", "not rising with depth", limit, next_step=FLIP_SIGN)
    free = int((search.depth <= place).sum())
    if free < MIN_FREE_SAMPLES and not known:
        raise InputError(
            "contact depth",
            f"at the start of the curve ({free} samples before it)",
            f"at least {MIN_FREE_SAMPLES} samples of free travel are needed",
            next_step="Give a curve that begins above the surface, another tip or baseline, or the depth of the "
            "surface if the curve begins in contact (contact_depth, --contact-depth-um).",
        )
    if (search.depth > place).sum() <= MIN_IN_CONTACT:
        limit = f"more than {MIN_IN_CONTACT} samples in contact are needed"
        raise InputError("contact depth", "at the end of the curve", limit, next_step="Give a curve that goes deeper.")


def notes_on(
    search: ContactSearch, place: float, modulus: float, half: np.ndarray, residual: np.ndarray
) -> tuple[str, ...]:
    """Sentences on a fit with contact at ``place``; ``half`` are the half widths of the intervals of modulus and
    contact."""
    notes = [_contact(search, place, half[1]), _slope(search, place), _misfit(search, place, residual)]
    if not half[0] < modulus:
        notes.append("The interval of the reduced modulus contains 0: this curve does not identify a stiffness.")
    return tuple(sentence for sentence in notes if sentence)


def _contact(search: ContactSearch, place: float, half: float) -> str:
    if half == 0.0:  # it is given
        return ""
    if not half < place:
        return "The interval of the contact depth reaches the start of the curve: there is too little free travel."
    share = half / (search.span - place)
    if share <= MAX_CONTACT_INTERVAL:
        return ""
    return (
        f"The interval of the contact depth is ± {percent(share)} of the indentation. The modulus changes with it; "
        "its interval assumes small errors and is too narrow."
    )


def _slope(search: ContactSearch, place: float) -> str:
    """Sentence on the limit of small slopes, at the edge of the deepest contact, where a tip is steepest."""
    deepest = contact(search.tip, depth=search.span - place, reduced_modulus=1.0, shank_radius=search.shank_radius)
    radius = min(deepest.contact_radius, deepest.tip.end * (1.0 - 1e-9))
    slope = float(deepest.tip.slope(radius))
    if slope <= (1.0 + 1e-9) / math.tan(SMALL_SLOPE_ANGLE):
        return ""
    return (
        f"At the deepest sample the tip's slope at the edge of the contact is {slope:.3g}, as of a cone with a half "
        f"angle of {math.degrees(math.atan2(1.0, slope)):.3g} degrees, below the limit of 60: representative strain "
        f"{0.2 * slope:.2f}, so the modulus is that of a scaling law, not of the tissue at small strain."
    )


def _misfit(search: ContactSearch, place: float, residual: np.ndarray) -> str:
    inside = search.depth > place
    if (~inside).sum() < MIN_LOADING_SAMPLES:
        return ""
    free, within = (float(np.sqrt(np.mean(residual[part] ** 2))) for part in (~inside, inside))
    ratio = within / max(free, ROUNDING * float(np.abs(search.force_given).max()))
    if ratio <= MAX_RESIDUAL_RATIO:
        return ""
    return (
        f"In contact the residual is {ratio:.2g} times that of the free travel: tip or half-space do not describe this "
        "curve, and the intervals treat the misfit as noise."
    )
