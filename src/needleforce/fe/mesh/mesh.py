# SPDX-License-Identifier: Apache-2.0
"""A mesh of tissue: points, cells and their labels, checked."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...checks import one_of
from ...errors import InputError

CORNERS = {"triangle": 3, "quad": 4, "tetra": 4, "hexahedron": 8}
DIMENSION = {"triangle": 2, "quad": 2, "tetra": 3, "hexahedron": 3}
# of a shape, corners with the others at the ends of their edges, in the order in which their volume is positive
_EDGES = {
    "triangle": [(0, [1, 2])],
    "quad": [(k, [(k + 1) % 4, (k + 3) % 4]) for k in range(4)],
    "tetra": [(0, [1, 2, 3])],
    "hexahedron": [(0, [1, 3, 4]), (1, [2, 0, 5]), (2, [3, 1, 6]), (3, [0, 2, 7]),
                   (4, [7, 5, 0]), (5, [4, 6, 1]), (6, [5, 7, 2]), (7, [6, 4, 3])],
}  # fmt: skip
_PROJECTS = {"skfem": "scikit-fem", "meshio": "meshio"}
_TO_SKFEM = {"hexahedron": [6, 2, 5, 7, 1, 3, 4, 0]}  # order of corners in VTK and meshio -> in scikit-fem


def library(name: str = "skfem") -> Any:
    """A package of the extra ``fe``. Raises InputError that names the extra if it is not installed."""
    try:
        return import_module(name)
    except ImportError as missing:
        step = 'Run pip install "needleforce[fe]".'
        raise InputError(_PROJECTS[name], "not installed", "finite elements need it", next_step=step) from missing


@dataclass(frozen=True, eq=False)
class Mesh:
    """Points and cells of one shape; depth is the last coordinate, 0 at the surface and positive inwards.

    Parameters
    ----------
    points : array_like, shape (n, 2) or (n, 3)
        Corners of the cells [m]: (x, z), (r, z) or (x, y, z).
    cells : array_like of int, shape (m, 3), (m, 4) or (m, 8)
        Corners of each cell in the order of VTK and meshio.
    shape : str
        ``"triangle"``, ``"quad"``, ``"tetra"`` or ``"hexahedron"``.
    labels : sequence of str, optional
        Of each cell, by which materials are given; ``"tissue"`` for all by default.
    boundaries : dict, optional
        Names of boundaries with the indices of their points, in addition to ``"top"``, ``"bottom"`` and ``"sides"``, or
        instead of these.

    Raises
    ------
    InputError
        If an array has another shape, an index has no point, a point is not finite, or a cell is flat or folded.
    """

    points: np.ndarray
    cells: np.ndarray
    shape: str
    labels: np.ndarray = field(default=None)  # type: ignore[assignment]
    boundaries: dict[str, np.ndarray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        points, cells = np.asarray(self.points, dtype=float), np.asarray(self.cells)
        one_of("shape of cells", self.shape, CORNERS)
        _check_arrays(points, cells, self.shape)
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "cells", cells.astype(np.int64))
        object.__setattr__(self, "labels", _labels(self.labels, len(cells)))
        _check_cells(self)

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return DIMENSION[self.shape]

    @property
    def low(self) -> np.ndarray:
        """Lowest coordinates [m]."""
        return self.points.min(axis=0)

    @property
    def high(self) -> np.ndarray:
        """Highest coordinates [m]."""
        return self.points.max(axis=0)

    def within(self, points: np.ndarray) -> np.ndarray:
        """Whether points (n, d) are within the lowest and highest coordinates, (n,)."""
        return np.all((points >= self.low - 1e-12) & (points <= self.high + 1e-12), axis=1)

    @cached_property
    def skfem(self) -> Any:
        """The same as a mesh of scikit-fem."""
        kind = {"triangle": "MeshTri", "quad": "MeshQuad", "tetra": "MeshTet", "hexahedron": "MeshHex"}[self.shape]
        order = _TO_SKFEM.get(self.shape, slice(None))
        cells = np.ascontiguousarray(self.cells[:, order].T)
        return getattr(library(), kind)(np.ascontiguousarray(self.points.T), cells)

    def labelled(self, label: str, inside: Any) -> "Mesh":
        """The mesh with another label for the cells whose centre is ``inside``, a function of points (n, d)."""
        centres = self.points[self.cells].mean(axis=1)
        chosen = np.asarray(inside(centres), dtype=bool)
        if chosen.shape != (len(self.cells),):
            raise InputError("inside", chosen.shape, f"must be a truth value for each of {len(self.cells)} centres")
        labels = np.where(chosen, np.array(label, dtype=object), self.labels)
        return Mesh(self.points, self.cells, self.shape, labels, self.boundaries)

    def refined(self) -> "Mesh":
        """The mesh, in the plane, with four cells in place of each."""
        fine, edges = self.skfem.refined(), self.skfem.facets
        boundaries = {}
        for name, numbers in self.boundaries.items():
            inside = np.isin(edges, numbers).all(axis=0)
            boundaries[name] = np.append(numbers, len(self.points) + np.flatnonzero(inside))
        return Mesh(fine.p.T, fine.t.T, self.shape, np.tile(self.labels, 4), boundaries)

    @cached_property
    def parts(self) -> np.ndarray:
        """Number of the connected part of each point, (n,)."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        first, rest = self.cells[:, :1], self.cells[:, 1:]
        rows = np.broadcast_to(first, rest.shape).ravel()
        links = coo_array((np.ones(rows.size), (rows, rest.ravel())), shape=(len(self.points),) * 2)
        return connected_components(links, directed=False)[1]


def _check_arrays(points: np.ndarray, cells: np.ndarray, shape: str) -> None:
    dimension, corners = DIMENSION[shape], CORNERS[shape]
    if points.ndim != 2 or points.shape[1] != dimension:
        raise InputError("points", f"of shape {points.shape}", f"must be (n, {dimension}) for cells of shape {shape}")
    if cells.ndim != 2 or cells.shape[1] != corners or not len(cells):
        raise InputError("cells", f"of shape {cells.shape}", f"must be (m, {corners}) with m above 0")
    if not np.all(np.isfinite(points)):
        raise InputError("point", int(np.flatnonzero(~np.isfinite(points).all(axis=1))[0]), "must be finite")
    if not np.issubdtype(cells.dtype, np.integer) or cells.min() < 0 or cells.max() >= len(points):
        raise InputError("cells", f"up to {cells.max()}", f"must be indices of the {len(points)} points")


def _labels(labels: Sequence[str] | ArrayLike | None, count: int) -> np.ndarray:
    if labels is None:
        return np.full(count, "tissue", dtype=object)
    array = np.array([str(label) for label in np.asarray(labels, dtype=object)], dtype=object)
    if array.shape != (count,):
        raise InputError("labels", len(array), f"must be one for each of the {count} cells")
    return array


def _volumes(mesh: Mesh) -> np.ndarray:
    """Signed volume between the edges at each corner, of simplices once, (m, k)."""
    corners = mesh.points[mesh.cells]
    with np.errstate(all="ignore"):  # a cell smaller than any number has no volume
        return np.stack([np.linalg.det(corners[:, ends] - corners[:, [k]]) for k, ends in _EDGES[mesh.shape]], axis=1)


def _check_cells(mesh: Mesh) -> None:
    """Refuse cells without volume, and cells whose inside is not between their corners."""
    volumes = _volumes(mesh)
    size = np.ptp(mesh.points[mesh.cells], axis=1).max(axis=1) ** mesh.dimension
    sign = np.sign(volumes[:, :1])
    folded = ~np.all(volumes * sign > 1e-12 * size[:, None], axis=1)
    if folded.any():
        cell = int(np.flatnonzero(folded)[0])
        centre = ", ".join(f"{1e3 * value:.3g}" for value in mesh.points[mesh.cells[cell]].mean(axis=0))
        step = "Repair the mesh, or check the order of corners."
        raise InputError(
            f"cell {cell}", f"flat or folded at ({centre}) mm", f"as {folded.sum()} of {len(mesh.cells)} are",
            next_step=step,
        )  # fmt: skip
