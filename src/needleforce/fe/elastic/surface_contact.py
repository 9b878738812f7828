# SPDX-License-Identifier: Apache-2.0
"""A rigid tip pressed into the surface of a solid, without friction: force, contact and dimple of a finite block."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...checks import above_zero
from ...errors import InputError
from .elements import Symmetry
from .supports import unknowns_of
from .tissue import Tissue

_MAX_TURNS = 100
_MIN_CONTACT_NODES = 4


@dataclass(frozen=True)
class SurfaceContact:
    """Outcome of ``press``.

    Attributes
    ----------
    depth : ndarray, shape (n,)
        Of the apex below the undeformed surface [m].
    force : ndarray, shape (n,)
        On the tip, + opposes insertion [N].
    contact_radius : ndarray, shape (n,)
        Of the outermost node in contact [m].
    radius : ndarray, shape (k,)
        Of the nodes of the surface around the tip [m].
    dimple : ndarray, shape (n, k)
        How far the surface is pressed down at each [m].
    """

    depth: np.ndarray
    force: np.ndarray
    contact_radius: np.ndarray
    radius: np.ndarray
    dimple: np.ndarray


def press(tissue: Tissue, tip: Any, depth: ArrayLike, reach: float) -> SurfaceContact:
    """Press a rigid tip on the axis into the surface.

    Parameters
    ----------
    tissue : Tissue
        Axisymmetric, or a solid of hexahedra; its surface is at depth 0 and is not held there.
    tip : object
        One of ``nf.tips``.
    depth : array_like, shape (n,)
        Depths of the apex, at least 0 [m].
    reach : float
        Radius within which contact is looked for [m]; the mesh should be fine there.

    Returns
    -------
    SurfaceContact
        Force, contact and dimple at each depth.

    Raises
    ------
    InputError
        If the mesh is another, a depth is negative, the contact reaches beyond ``reach``, or it has less than 4 nodes.
    """
    depths = np.atleast_1d(np.asarray(depth, dtype=float))
    if depths.ndim != 1 or not depths.size:
        raise InputError("depth", f"of shape {depths.shape}", "must be one row", next_step="Give depths (n,) in m.")
    above_zero("reach", reach, "m", "Give more than the contact radius, in m.")
    if not np.all(depths >= 0.0) or not np.all(np.isfinite(depths)):
        raise InputError("depth", depths.min(), "must be finite and at least 0", next_step="Depth is positive inwards.")
    nodes, radius = _surface(tissue, reach)
    compliance = tissue.solve(_unit(tissue, nodes))[nodes]
    height = _height(tip, radius)
    rows = [_balanced(compliance, each - height) for each in depths]
    contact = np.array([radius[row > 0.0].max(initial=0.0) for row in rows])
    _check_contact(contact, radius, depths)
    forces = np.array(rows)
    return SurfaceContact(depths, forces.sum(axis=1), contact, radius, forces @ compliance)


def _surface(tissue: Tissue, reach: float) -> tuple[np.ndarray, np.ndarray]:
    """Axial unknowns of the surface within the reach, by radius, and their radii [m]."""
    if tissue.symmetry is not Symmetry.AXISYMMETRIC and tissue.mesh.shape != "hexahedron":
        step = "Use axisymmetric_block, or block with three lengths."
        raise InputError("mesh", tissue.mesh.shape, "is not axisymmetric, nor of hexahedra", next_step=step)
    unknowns, last = unknowns_of(tissue.elements), tissue.mesh.dimension - 1
    radius = np.linalg.norm(unknowns.places[:, :last], axis=1)
    top = tissue.mesh.low[last]
    near = np.abs(unknowns.places[:, last] - top) < 1e-9 * np.ptp(tissue.mesh.points[:, last])
    nodes = np.flatnonzero(near & (unknowns.component == last) & (radius <= reach) & ~tissue.held)
    if len(nodes) < _MIN_CONTACT_NODES:
        step = "Use smaller cells or a larger reach, and leave the top free."
        raise InputError("surface", f"{len(nodes)} free nodes", f"within {1e3 * reach:g} mm", next_step=step)
    nodes = nodes[np.argsort(radius[nodes], kind="stable")]
    return nodes, radius[nodes]


def _unit(tissue: Tissue, nodes: np.ndarray) -> np.ndarray:
    forces = np.zeros((tissue.elements.count, len(nodes)))
    forces[nodes, np.arange(len(nodes))] = 1.0
    return forces


def _height(tip: Any, radius: np.ndarray) -> np.ndarray:
    """Of the profile above its apex [m]; a flat end has an edge, beyond which it is nowhere."""
    if tip.name == "flat":
        return np.where(radius <= tip.radius * (1.0 + 1e-9), 0.0, np.inf)
    return np.asarray(tip.height(radius), dtype=float)


def _balanced(compliance: np.ndarray, pressed: np.ndarray) -> np.ndarray:
    """Nodal forces: none pulls, and where none pushes the surface is below the tip. Active set."""
    touching = pressed > 0.0
    forces = np.zeros(len(pressed))
    for _ in range(_MAX_TURNS):
        forces[:] = 0.0
        if touching.any():
            forces[touching] = np.linalg.solve(compliance[np.ix_(touching, touching)], pressed[touching])
        above = compliance @ forces < pressed - 1e-12 * np.abs(pressed[touching]).max(initial=0.0)
        following = np.where(touching, forces > 0.0, above)
        if np.array_equal(following, touching):
            return forces
        touching = following
    raise InputError("contact", "not found", f"in {_MAX_TURNS} turns", next_step="Use a finer mesh at the surface.")


def _check_contact(contact: np.ndarray, radius: np.ndarray, depths: np.ndarray) -> None:
    if np.any(contact >= radius.max()):
        limit = f"the contact reaches at least {1e3 * contact.max():.3g} mm"
        raise InputError("reach", f"{1e3 * radius.max():.3g} mm", limit, next_step="Give a larger reach.")
    few = (depths > 0.0) & (contact < radius[_MIN_CONTACT_NODES - 1])
    if few.any():
        size = f"less than {_MIN_CONTACT_NODES} nodes at {1e3 * depths[few][0]:.3g} mm"
        raise InputError("contact", size, "is too small for the mesh", next_step="Use smaller cells at the surface.")
