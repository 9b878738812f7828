# SPDX-License-Identifier: Apache-2.0
"""The modulus of a half-space from an indentation curve: contact depth and baseline are part of the model."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..core import Tissue
from ..errors import InputError
from .contact_search import ContactSearch
from .estimates import Estimate
from .indentation_notes import notes_on, refuse_no_contact
from .one_layer.deformation_fit import LEAST_SAMPLES
from .statistics.information import criterion
from .statistics.noise import Z_95, noise_of
from .statistics.regression import inverse

UNITS = {"reduced_modulus": "Pa", "contact_depth": "m", "baseline": "N", "baseline_slope": "N/m"}
BASELINES = {
    "none": lambda depth: np.empty((0, len(depth))),
    "constant": lambda depth: np.ones((1, len(depth))),
    "line": lambda depth: np.array([np.ones_like(depth), depth]),
}


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
