# SPDX-License-Identifier: Apache-2.0
"""How tissue is held: boundaries that are fixed, slide along their plane, or are free; what is not held is named."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from ...checks import one_of
from ...errors import InputError
from ..mesh.mesh import Mesh
from .elements import Elements, Symmetry


class Support(StrEnum):
    """Of a boundary."""

    FIXED = "fixed"
    SLIDING = "sliding"
    FREE = "free"


@dataclass(frozen=True)
class Unknowns:
    """Component and place of each unknown."""

    component: np.ndarray  # (n,) axis of the displacement
    places: np.ndarray  # (n, d) [m]
    points: np.ndarray  # (n,) a corner of the same cell, to find its part of the mesh


def unknowns_of(elements: Elements) -> Unknowns:
    """Of nodes, and for elements of second order of the middles of edges, facets and cells."""
    mesh, dofs = elements.mesh.skfem, elements.dofs
    component, points = np.zeros(elements.count, dtype=int), np.zeros(elements.count, dtype=int)
    places = np.zeros((elements.count, elements.mesh.dimension))
    corners = [
        (dofs.nodal_dofs, np.arange(mesh.nvertices)[None]),
        (dofs.facet_dofs, mesh.facets),
        (dofs.edge_dofs, mesh.edges if mesh.dim() == 3 else np.zeros((2, 0), dtype=int)),
        (dofs.interior_dofs, mesh.t),
    ]
    for numbers, of in corners:
        for axis, row in enumerate(numbers):
            component[row], points[row] = axis, of[0]
            places[row] = mesh.p[:, of].mean(axis=1).T
    return Unknowns(component, places, points)


def held(elements: Elements, supports: Mapping[str, str]) -> np.ndarray:
    """Which unknowns are zero, (n,) of bool. Raises InputError if a boundary is unknown, a support is none, a sliding
    boundary is not along an axis, or a part of the mesh can move as a rigid body."""
    mesh, mask = elements.mesh, np.zeros(elements.count, dtype=bool)
    for name, kind in supports.items():
        one_of(f"support of {name!r}", kind, Support)
        if kind != Support.FREE:
            _hold(mask, elements, facets_of(elements, name), Support(kind), name)
    if _has_axis(elements):
        _hold(mask, elements, _facets_at(mesh, 0, 0.0), Support.SLIDING, "axis")
    _check_rigid(elements, mask)
    return mask


def _hold(mask: np.ndarray, elements: Elements, facets: np.ndarray, support: Support, name: str) -> None:
    dofs, mesh = elements.dofs, elements.mesh.skfem
    if support is Support.FIXED:
        mask[dofs.get_facet_dofs(facets).flatten()] = True
        return
    spread = np.ptp(mesh.p[:, mesh.facets[:, facets]], axis=1)  # (d, facets)
    axis = spread.argmin(axis=0)
    if np.any(spread.min(axis=0) > 1e-6 * spread.max(axis=0)):
        step = "Fix it, or set it free; or give a mesh whose boundary is along an axis."
        raise InputError(f"boundary {name!r}", "not along an axis", "where it is to slide", next_step=step)
    component = unknowns_of(elements).component
    for each in np.unique(axis):
        numbers = dofs.get_facet_dofs(facets[axis == each]).flatten()
        mask[numbers[component[numbers] == each]] = True


def facets_of(elements: Elements, name: str) -> np.ndarray:
    """Outer facets of a boundary: one of the mesh, or its top, bottom or sides. Raises InputError if there is no such
    boundary, or no outer facet has all of its corners in it."""
    mesh = elements.mesh
    if name in mesh.boundaries:
        chosen = np.zeros(len(mesh.points), dtype=bool)
        chosen[mesh.boundaries[name]] = True
        facets = _outer(mesh, chosen)
        if not len(facets):
            limit = "no outer facet has all of its corners in it"
            raise InputError(f"boundary {name!r}", "empty", limit, next_step="Give all points of its facets.")
        return facets
    if name not in ("top", "bottom", "sides"):
        known = ", ".join(["top", "bottom", "sides", *mesh.boundaries])
        raise InputError("boundary", name, "is not one of the mesh", next_step=f"Use one of {known}.")
    return _ends(elements, name)


def _ends(elements: Elements, name: str) -> np.ndarray:
    """Facets at the lowest or highest depth, or at the ends across."""
    mesh, last = elements.mesh, elements.mesh.dimension - 1
    if name != "sides":
        return _facets_at(mesh, last, (mesh.low if name == "top" else mesh.high)[last])
    outer = (mesh.high,) if _has_axis(elements) else (mesh.low, mesh.high)
    ends = [_facets_at(mesh, axis, end[axis]) for axis in range(last) for end in outer]
    return np.unique(np.concatenate(ends))


def _has_axis(elements: Elements) -> bool:
    mesh = elements.mesh
    return elements.symmetry is Symmetry.AXISYMMETRIC and bool(mesh.low[0] < 1e-9 * mesh.high[0])


def _facets_at(mesh: Mesh, axis: int, value: float) -> np.ndarray:
    near = 1e-6 * np.ptp(mesh.points[:, axis])
    return _outer(mesh, np.abs(mesh.points[:, axis] - value) < near)


def _outer(mesh: Mesh, chosen: np.ndarray) -> np.ndarray:
    outer = mesh.skfem.boundary_facets()
    return outer[chosen[mesh.skfem.facets[:, outer]].all(axis=0)]


_MODES = {
    Symmetry.AXISYMMETRIC: ("move along z",),
    Symmetry.SOLID: ("move along x", "move along y", "move along z", "turn about x", "turn about y", "turn about z"),
}
_PLANE_MODES = ("move along x", "move along z", "turn")


def _check_rigid(elements: Elements, mask: np.ndarray) -> None:
    unknowns, parts = unknowns_of(elements), elements.mesh.parts
    modes = _rigid(elements.symmetry, unknowns.places, unknowns.component)
    names = _MODES.get(elements.symmetry, _PLANE_MODES)
    used = np.unique(elements.mesh.cells)
    loose = len(elements.mesh.points) - len(used)
    if loose:
        raise InputError("mesh", f"with {loose} points of no cell", next_step="Remove them from the mesh.")
    for part in np.unique(parts):
        here = parts[unknowns.points] == part
        free = _free_mode(modes[here & mask], modes[here])
        if free is not None:
            centre = ", ".join(f"{1e3 * each:.3g}" for each in unknowns.places[here].mean(axis=0))
            where = f"the part of the mesh around ({centre}) mm" if parts.max() else "the tissue"
            step = 'Give supports, such as supports={"bottom": "fixed"}.'
            if parts.max():
                step = f"The mesh has {parts.max() + 1} parts: join them, or hold each."
            raise InputError("support", "missing", f"{where} can {names[free]}", next_step=step)


def _free_mode(held_rows: np.ndarray, all_rows: np.ndarray) -> int | None:
    """Number of a rigid motion that no support prevents."""
    scaled = held_rows / np.linalg.norm(all_rows, axis=0)
    sizes, modes = np.linalg.eigh(scaled.T @ scaled)
    return int(np.abs(modes[:, 0]).argmax()) if sizes[0] < 1e-12 else None


def _rigid(symmetry: Symmetry, places: np.ndarray, component: np.ndarray) -> np.ndarray:
    """Rigid motions by unknown, (n, modes)."""
    moves = np.eye(places.shape[1])[component]
    if symmetry is Symmetry.AXISYMMETRIC:
        return moves[:, 1:]
    at, rows = places - places.mean(axis=0), np.arange(len(places))
    if symmetry is not Symmetry.SOLID:
        return np.column_stack([moves, np.stack([-at[:, 1], at[:, 0]])[component, rows]])
    turns = [np.cross(axis, at)[rows, component] for axis in np.eye(3)]
    return np.column_stack([moves, *turns])
