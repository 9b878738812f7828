# SPDX-License-Identifier: Apache-2.0
"""Contact of a rigid axisymmetric tip with an elastic half-space, over arrays."""

from dataclasses import dataclass

import numpy as np

from . import core
from .errors import InputError


@dataclass(frozen=True)
class Contact:
    """Depth [m], contact radius [m], force [N], stored energy [J] and slope dF/dh [N/m]; shaped like the input."""

    depth: np.ndarray
    contact_radius: np.ndarray
    force: np.ndarray
    energy: np.ndarray
    slope: np.ndarray


def contact(
    tip, *, reduced_modulus: float, depth=None, contact_radius=None, shank_radius: float | None = None
) -> Contact:
    """Sneddon's contact of ``tip`` at a depth or at a contact radius [m], any shape; give exactly one of the two.

    ``reduced_modulus`` [Pa] > 0. ``shank_radius`` [m]: the tip sits on a cylinder of that radius, where the contact
    stops growing (Galin's form with a fixed edge); None is a tip that goes on for ever, as the paper's eq. (6) has it.
    Raises InputError for a modulus or radius that is not positive and for values that are not finite or negative radii.
    """
    if (depth is None) == (contact_radius is None):
        raise InputError("contact", next_step="Give exactly one of depth and contact_radius.")
    _positive("reduced_modulus", reduced_modulus, "Pa")
    given = np.asarray(depth if contact_radius is None else contact_radius, dtype=float)
    if not np.isfinite(given).all():
        raise InputError("contact", "not finite", "at least one depth or radius is NaN or infinite")
    values = np.ascontiguousarray(given.ravel())
    if contact_radius is None:
        shank = np.inf if shank_radius is None else _positive("shank_radius", shank_radius, "m")
        columns = core.contact_at_depth(tip, values, reduced_modulus, shank)
    else:
        _within(values, shank_radius)
        columns = core.contact_at_radius(tip, values, reduced_modulus)
    depth_, radius, force, energy = (_shaped(column, given.shape) for column in columns)
    return Contact(depth_, radius, force, energy, 2.0 * reduced_modulus * radius)


def _positive(quantity: str, value: float, unit: str) -> float:
    if not (np.isfinite(value) and value > 0):
        raise InputError(quantity, value, f"must be above 0 {unit}")
    return float(value)


def _within(radius: np.ndarray, shank_radius: float | None) -> None:
    limit = np.inf if shank_radius is None else _positive("shank_radius", shank_radius, "m")
    if radius.size and (radius.min() < 0 or radius.max() > limit):
        next_step = "Give the depth instead: beyond the shank the radius no longer tells it."
        raise InputError(
            "contact_radius",
            f"{radius.min():.4g} to {radius.max():.4g} m",
            f"outside 0 to {limit:.4g} m",
            next_step=next_step,
        )


def _shaped(column: np.ndarray, shape: tuple[int, ...]):
    return column.reshape(shape) if shape else float(column[0])
