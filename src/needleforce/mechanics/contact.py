# SPDX-License-Identifier: Apache-2.0
"""Contact of a rigid axisymmetric tip with an elastic half-space, over arrays."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .. import core
from ..errors import InputError
from .slope_contact import SlopeContact


@dataclass(frozen=True)
class Contact:
    """Depth [m], contact radius [m], force [N] and slope dF/dh [N/m]; shaped like the input.

    ``energy`` [J] is the elastic energy stored, integrated when it is first asked for.
    """

    depth: np.ndarray
    contact_radius: np.ndarray
    force: np.ndarray
    slope: np.ndarray
    tip: Any = field(repr=False, compare=False)
    reduced_modulus: float = field(repr=False, compare=False)

    @property
    def energy(self):
        """Elastic energy stored [J], shaped like the input."""
        depth, radius = np.atleast_1d(self.depth).ravel(), np.atleast_1d(self.contact_radius).ravel()
        energy = _mechanics(self.tip).contact_energy(self.tip, depth, radius, self.reduced_modulus)
        return _shaped(energy, self._shape)

    def pressure(self, radius) -> np.ndarray:
        """Contact pressure [Pa] at radii [m] from the axis, any shape; shaped like the contact, then like ``radius``.

        Zero outside the contact, infinite at an edge that the shank or a flat face fixes and under a sharp apex. To
        1e-8, for pictures. Raises InputError for radii that are negative or not finite.
        """
        given = np.asarray(radius, dtype=float)
        if not (np.isfinite(given).all() and (given >= 0).all()):
            raise InputError("radius", "negative or not finite", next_step="Give distances from the axis in m.")
        flat = np.ascontiguousarray(given.ravel())
        states = zip(np.ravel(self.depth), np.ravel(self.contact_radius))
        pressure = _mechanics(self.tip).contact_pressure
        rows = [
            pressure(self.tip, h, a, self.reduced_modulus, flat) if a > 0 else np.zeros(flat.shape) for h, a in states
        ]
        return np.array(rows).reshape((*self._shape, *given.shape))[()]

    @property
    def _shape(self) -> tuple[int, ...]:
        return np.shape(self.depth)


def contact(
    tip,
    *,
    reduced_modulus: float,
    depth=None,
    contact_radius=None,
    shank_radius: float | None = None,
    slope_breaks=(),
) -> Contact:
    """Sneddon's contact of ``tip`` at a depth or at a contact radius [m], any shape; give exactly one of the two.

    ``tip`` is one of ``nf.tips``, of which ``Profile`` takes arrays, or a function that gives the slope df/dr of a
    profile at an array of radii [m], integrated at Gauss nodes between the radii ``slope_breaks`` [m] where it breaks.
    ``reduced_modulus`` [Pa] > 0. ``shank_radius`` [m]: the tip sits on a cylinder of that radius, where the contact
    stops growing (Galin's form with a fixed edge), as it does at the tip's own end; None is a tip that goes on for
    ever, as the paper's eq. (6) has it.
    Raises InputError for a modulus or radius that is not positive, for values that are not finite or negative radii,
    for a radius that does not tell the depth, and for a slope that falls, is vertical or makes the contact jump.
    """
    if (depth is None) == (contact_radius is None):
        raise InputError("contact", next_step="Give exactly one of depth and contact_radius.")
    _positive("reduced_modulus", reduced_modulus, "Pa")
    given = np.asarray(depth if contact_radius is None else contact_radius, dtype=float)
    if not np.isfinite(given).all():
        raise InputError("contact", "not finite", "at least one depth or radius is NaN or infinite")
    values = np.ascontiguousarray(given.ravel())
    shank = np.inf if shank_radius is None else _positive("shank_radius", shank_radius, "m")
    tip = _checked(tip, slope_breaks, shank, values)
    if contact_radius is None:
        columns = _mechanics(tip).contact_at_depth(tip, values, reduced_modulus, shank)
    else:
        _within(values, tip, shank)
        columns = _mechanics(tip).contact_at_radius(tip, values, reduced_modulus)
    depth_, radius, force = (_shaped(column, given.shape) for column in columns)
    return Contact(depth_, radius, force, 2.0 * reduced_modulus * radius, tip, float(reduced_modulus))


def _checked(tip, slope_breaks, shank: float, values: np.ndarray):
    """A tip of the core as it is; a function as a tip of its own, checked as far as the values reach."""
    if type(tip) in vars(core.tips).values():
        return tip
    if not callable(tip):
        raise InputError(
            "tip", repr(tip), "neither one of nf.tips nor a function", next_step="Arrays make a tips.Profile."
        )
    return SlopeContact(tip, slope_breaks, shank, values)


def _mechanics(tip):
    """Where the contact of a tip is computed: the core, or a slope's own quadrature."""
    return tip if isinstance(tip, SlopeContact) else core


def _positive(quantity: str, value: float, unit: str) -> float:
    if not (np.isfinite(value) and value > 0):
        raise InputError(quantity, value, f"must be above 0 {unit}")
    return float(value)


def _within(radius: np.ndarray, tip, shank_radius: float) -> None:
    limit = min(shank_radius, tip.end)
    if radius.size and (radius.min() < 0 or radius.max() > limit or (radius.max() == tip.end > tip.flat)):
        next_step = "Give the depth instead: beyond the shank or the end of the tip the radius no longer tells it."
        raise InputError(
            "contact_radius",
            f"{radius.min():.4g} to {radius.max():.4g} m",
            f"outside 0 to {limit:.4g} m",
            next_step=next_step,
        )
    if radius.size and radius.max() > 0 and radius[radius > 0].min() <= tip.flat:
        raise InputError(
            "contact_radius",
            f"{radius[radius > 0].min():.4g} m",
            f"not beyond the flat face, {tip.flat:.4g} m, which touches at once",
            next_step="Give the depth instead.",
        )


def _shaped(column: np.ndarray, shape: tuple[int, ...]):
    return column.reshape(shape) if shape else float(column[0])
