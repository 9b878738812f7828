# SPDX-License-Identifier: Apache-2.0
"""The modulus of a half-space from an indentation curve, with contact depth and baseline as part of the model; for
one tip, or several compared."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ..core import Tissue
from ..errors import InputError
from ..mechanics.contact import contact
from ..models.validity import SMALL_SLOPE_ANGLE
from .contact_search import LEAST_IN_CONTACT, ContactSearch
from .estimates import Estimate
from .one_layer.deformation_fit import LEAST_SAMPLES, SIGN
from .statistics.noise import Z_95, Noise, noise_of
from .statistics.regression import VERY_STRONG, criterion, inverse

UNITS = {"reduced_modulus": "Pa", "contact_depth": "m", "baseline": "N", "baseline_slope": "N/m"}
BASELINES = {
    "none": lambda depth: np.empty((0, len(depth))),
    "constant": lambda depth: np.ones((1, len(depth))),
    "line": lambda depth: np.array([np.ones_like(depth), depth]),
}
LEAST_FREE = 5  # samples before contact
SURE = 5.0  # standard errors; in noise alone a search over all contact depths finds 3
ROUNDING = 1e-10  # of the force: a rise below this is none
WIDE = 0.1  # of the indentation
MISFIT = 2.0  # residual in contact over that of the free travel


@dataclass(frozen=True, eq=False)
class IndentationFit:
    """F = baseline + baseline_slope (depth - contact_depth) + E_r F_1(depth - contact_depth), with 95 % intervals.

    ``parameters`` are the estimates by name; ``young_modulus`` is None without a Poisson ratio, ``baseline`` and
    ``baseline_slope`` where they are not in the model. ``residual`` (n,) [N] is in the order given, ``bic`` Schwarz's
    criterion, each sample counting as one. ``notes`` say what the numbers do not.
    """

    tip: Any
    parameters: dict[str, Estimate]
    residual: np.ndarray = field(repr=False)
    bic: float
    notes: tuple[str, ...]

    @property
    def reduced_modulus(self) -> Estimate:
        """E_r [Pa]."""
        return self.parameters["reduced_modulus"]

    @property
    def young_modulus(self) -> Estimate | None:
        """E [Pa]."""
        return self.parameters.get("young_modulus")

    @property
    def contact_depth(self) -> Estimate:
        """Where contact begins [m], in the zero of the depths given."""
        return self.parameters["contact_depth"]

    @property
    def baseline(self) -> Estimate | None:
        """Force without contact [N], at the contact depth."""
        return self.parameters.get("baseline")

    @property
    def baseline_slope(self) -> Estimate | None:
        """Its change with depth [N/m]."""
        return self.parameters.get("baseline_slope")

    @property
    def residual_rms(self) -> float:
        """Root mean square of the residual [N]."""
        return float(np.sqrt(np.mean(self.residual**2)))


def fit_indentation(
    depth,
    force,
    tip,
    *,
    poisson_ratio: float | None = None,
    baseline: str = "constant",
    shank_radius: float | None = None,
) -> IndentationFit:
    """Least squares of Sneddon's contact of ``tip`` to one approach, ``depth`` [m] + inwards and ``force`` [N], (n,).

    ``tip`` is one of ``nf.tips``; its force is that of ``nf.contact``, with ``shank_radius`` [m] as there. No starting
    value is needed: the contact depth is sought over the whole curve. ``baseline`` is the force without contact:
    "none" (0), "constant" or "line" (by depth). All samples weigh alike. The tip is rigid; with ``poisson_ratio`` it
    gives ``young_modulus`` = E_r (1 - nu^2) [Pa] too. Samples are in the order of time: the intervals count on it.

    Raises InputError for what is no curve, for a force that does not rise out of its baseline by five standard
    errors, and for a contact depth at an end of the curve.
    """
    told = checked_options(poisson_ratio, baseline)
    depth, force = _checked(depth, force)
    zero = float(depth.min())
    parts = BASELINES[baseline](depth - zero)
    search = ContactSearch(depth - zero, force, parts, tip, shank_radius)
    place = search.best()
    values, jacobian = _solved(search, place, parts)
    residual = force - np.delete(values, 1) @ np.delete(jacobian, 1, axis=0)
    noise = noise_of(residual, len(residual), lost=len(jacobian))
    refuse_no_contact(search, place, noise)
    half = Z_95 * np.sqrt(noise.long_run * np.diagonal(inverse(jacobian @ jacobian.T)))
    notes = notes_on(search, place, values[0], half, residual)
    values[1] += zero
    found = {name: _estimate(name, *each, tip) for name, *each in zip(UNITS, values, half)}
    if told is not None:
        found["young_modulus"] = _young(found["reduced_modulus"], told)
    return IndentationFit(tip, found, residual, criterion(noise, len(values), noise.count), notes)


def checked_options(poisson_ratio: float | None, baseline: str) -> Tissue | None:
    """A tissue of 1 Pa with the Poisson ratio, if there is one. Raises InputError for what no curve can be fitted
    with."""
    if baseline not in BASELINES:
        raise InputError("baseline", repr(baseline), f"known are {', '.join(BASELINES)}")
    return None if poisson_ratio is None else Tissue(1.0, poisson_ratio)


def _checked(depth, force) -> tuple[np.ndarray, np.ndarray]:
    depth, force = np.asarray(depth, float), np.asarray(force, float)
    if depth.ndim != 1 or depth.shape != force.shape or len(depth) < LEAST_SAMPLES:
        limit = f"two columns of one length, at least {LEAST_SAMPLES}, are needed"
        raise InputError("shapes of depth and force", f"{depth.shape} and {force.shape}", limit)
    for name, column in (("depth", depth), ("force", force)):
        if not np.isfinite(column).all():
            raise InputError(name, "not finite", f"first at sample {int(np.argmin(np.isfinite(column)))}")
        if not np.ptp(column) > 0.0:
            raise InputError(name, "constant", "no indentation curve", next_step="Check the columns.")
    return depth, force


def _solved(search: ContactSearch, place: float, parts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values (p,) of ``UNITS`` with contact at ``place``, and the force's derivatives by them, (p, n)."""
    unit, slope = search.unit_force(place)
    modulus = search.modulus(place)
    line = np.array(parts)
    line[1:] -= place  # the baseline's constant is its force at contact
    size = np.linalg.norm(line, axis=1)
    numbers = np.linalg.lstsq((line / size[:, None]).T, search.force_given - modulus * unit, rcond=None)[0] / size
    by_contact = -modulus * slope - sum(numbers[1:])
    return np.array([modulus, place, *numbers]), np.array([unit, by_contact, *line])


def _estimate(name: str, value: float, half: float, tip) -> Estimate:
    source = f"indentation curve, rigid tip {tip!r}" if name == "reduced_modulus" else "indentation curve"
    half = half if np.isfinite(half) else np.inf
    low, high = float(value - half), float(value + half)
    told = low > (0.0 if name == "reduced_modulus" else -np.inf)
    return Estimate(name, float(value), UNITS[name], low, high, identifiable=told, source=source)


def _young(reduced: Estimate, tissue: Tissue) -> Estimate:
    """E = E_r (1 - nu^2): as sure as the Poisson ratio, which no curve tells."""
    factor, source = (
        1.0 / tissue.plane_strain_modulus,
        f"reduced modulus and a Poisson ratio of {tissue.poisson_ratio:g}",
    )
    limits = (factor * each for each in (reduced.low, reduced.high))
    return Estimate("young_modulus", factor * reduced.value, "Pa", *limits, identifiable=False, source=source)


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


class TipFit(NamedTuple):
    """One tip: its fit, its BIC above the lowest with the 95 % noise of that difference, and whether they differ.

    ``distinguishable`` is False for a difference below 10 or below its noise, and for the best itself.
    """

    fit: IndentationFit
    more_than_best: float
    noise: float
    distinguishable: bool


def compare_tips(depth, force, tips: Sequence, *, progress=None, **options) -> tuple[TipFit, ...]:
    """The fit of ``fit_indentation`` with each of ``tips``, the lowest BIC first; ``options`` are its own.

    Tips of one shape, as cones of any angle, fit alike: a curve does not choose between the moduli that they give.
    ``progress(iterable, text)`` wraps the tips. Raises InputError for no tip, and, naming the tip, where a fit does.
    """
    if not tips:
        raise InputError("tips", "none", "nothing to fit", next_step="Give at least one of nf.tips.")
    watched = progress(tips, "fitting") if progress else tips
    fits = sorted((_fit(depth, force, tip, options) for tip in watched), key=lambda fit: fit.bic)
    return tuple(_row(fit, fits[0]) for fit in fits)


def _fit(depth, force, tip, options: dict) -> IndentationFit:
    try:
        return fit_indentation(depth, force, tip, **options)
    except InputError as error:
        raise error.at(repr(tip)) from None


def _row(fit: IndentationFit, best: IndentationFit) -> TipFit:
    """The noise is that of a sum of differences of squares, which are alike among neighbours (after Vuong 1989)."""
    more = fit.bic - best.bic
    apart = (fit.residual**2 - best.residual**2) / (best.residual_rms * fit.residual_rms)
    noise = Z_95 * math.sqrt(len(apart) * noise_of(apart - np.mean(apart), len(apart)).long_run)
    return TipFit(fit, more, noise, more > max(VERY_STRONG, noise))
