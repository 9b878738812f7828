# SPDX-License-Identifier: Apache-2.0
"""The line along which a needle lies in a solid: loads spread along and around it, displacements averaged likewise."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, Protocol

import numpy as np
from scipy.sparse import csc_array

from ...checks import LENGTH, PLACE, above_zero, in_range
from ...errors import InputError
from ..mesh.mesh import Mesh
from .elements import Elements, Symmetry

_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_MIN_SHARE = 1e-7  # of the smallest principal compliance of a path in the largest
_AROUND = 24  # points around the circumference of a needle in space


class Body(Protocol):
    """What a path needs of a ``Tissue``."""

    mesh: Mesh
    symmetry: Symmetry
    elements: Elements
    materials: dict[str, Any]
    supports: dict[str, str]
    unknowns: int

    def values_at(self, points: np.ndarray) -> Any:
        """Matrix from unknowns to displacements at points."""

    def solve(self, forces: np.ndarray) -> np.ndarray:
        """Displacements for nodal forces."""


@dataclass(frozen=True, eq=False)
class NeedlePath:
    """A straight path from the surface, with nodes at even spacing.

    Parameters
    ----------
    depth : float
        Its end [m].
    spacing : float
        Of its nodes [m]; the last spacing is not shorter than the others.
    radius : float
        Of the needle [m]: loads are spread over its circumference.
    entry : (float,) or (float, float), optional
        Where it begins at the surface: x, or x and y [m]; the axis by default.
    direction : array_like, optional
        Along it, of any length; straight down by default.

    Raises
    ------
    InputError
        If a length is not above 0, or the path has less than two nodes.
    """

    depth: float
    spacing: float
    radius: float
    entry: tuple[float, ...] = ()
    direction: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        for quantity in ("depth", "spacing", "radius"):
            length = above_zero(f"{quantity} of the path", getattr(self, quantity), "m")
            in_range(f"{quantity} of the path", length, LENGTH, "Give it in m.")
        if self.depth < self.spacing:
            raise InputError("spacing", f"{1e3 * self.spacing:g} mm", f"the path is {1e3 * self.depth:g} mm deep")

    @cached_property
    def nodes(self) -> np.ndarray:
        """Distances of the nodes along the path [m]."""
        return np.linspace(0.0, self.depth, int(self.depth / self.spacing + 1e-9) + 1)

    @property
    def lengths(self) -> np.ndarray:
        """Length of the path that belongs to each node [m]."""
        step = self.nodes[1]
        return step * np.where((self.nodes == 0.0) | (self.nodes == self.depth), 0.5, 1.0)

    def loads(self, tissue: Body, direction: np.ndarray | None = None) -> csc_array:
        """Nodal forces of the tissue for a unit force at each node of the path, (unknowns, nodes).

        Each is spread with the density of its hat function. The transpose averages displacements with the same weights.

        Parameters
        ----------
        tissue : Tissue
            Its mesh contains the path.
        direction : ndarray, optional
            Of the forces; along the path by default.

        Raises
        ------
        InputError
            If a point of the path is outside the mesh.
        """
        along = self.along(tissue.mesh.dimension)
        toward = along if direction is None else np.asarray(direction, dtype=float)
        at, hats = self._integrated()
        around = self._around(tissue, along)
        total = csc_array((tissue.elements.count, len(self.nodes)))
        for offset in around:
            points = self.start(tissue.mesh.dimension) + at[:, None] * along + offset
            points[:, -1] = np.maximum(points[:, -1], tissue.mesh.low[-1])  # where an oblique shaft comes out
            matrix = tissue.values_at(points)
            for axis in np.flatnonzero(toward):
                rows = matrix[axis * len(at) : (axis + 1) * len(at)]
                total = total + rows.T @ csc_array(hats * (toward[axis] / len(around)))
        return total.tocsc()

    def along(self, dimension: int) -> np.ndarray:
        """Unit vector of the path."""
        if len(self.direction) == 0:
            return np.eye(dimension)[-1]
        vector = np.asarray(self.direction, dtype=float)
        if vector.shape != (dimension,) or not 0.0 < np.linalg.norm(vector) < np.inf:
            limit = f"must be {dimension} finite coordinates, not all 0"
            raise InputError(
                "direction of the path", self.direction, limit, next_step="Give x, y and depth, or x and depth."
            )
        return vector / np.linalg.norm(vector)

    def start(self, dimension: int) -> np.ndarray:
        """Where the path begins [m]."""
        if len(self.entry) == 0:
            return np.zeros(dimension)
        if len(self.entry) != dimension - 1:
            limit = f"must have {dimension - 1} coordinates"
            raise InputError("entry of the path", self.entry, limit, next_step="Give where it is on the surface [m].")
        return np.append(in_range("entry of the path", self.entry, PLACE, "Give it in m."), 0.0)

    def _integrated(self) -> tuple[np.ndarray, np.ndarray]:
        """Points of integration along the path (q,) [m], and the density of each node's load there, (q, nodes)."""
        step, count = self.nodes[1], len(self.nodes) - 1
        share = 0.5 * (1.0 + _POINTS)
        at = (self.nodes[:-1, None] + step * share).ravel()
        hats = np.zeros((count, len(share), count + 1))
        for k in range(count):
            hats[k, :, k], hats[k, :, k + 1] = (1.0 - share), share
        weighted = hats * (0.5 * step * _WEIGHTS)[:, None]
        return at, weighted.reshape(-1, count + 1) / self.lengths

    def _around(self, tissue: Body, along: np.ndarray) -> np.ndarray:
        """Offsets from the line at which the load acts, (k, d) [m]."""
        if tissue.symmetry is Symmetry.AXISYMMETRIC:
            if len(self.entry) or len(self.direction):
                raise InputError("path", "off the axis", "in an axisymmetric mesh", next_step="Use a mesh in space.")
            return np.array([[self.radius, 0.0]])
        if tissue.symmetry is not Symmetry.SOLID:
            across = np.array([along[1], -along[0]])
            return self.radius * np.array([across, -across])
        first = np.cross(along, np.eye(3)[np.abs(along).argmin()])
        first /= np.linalg.norm(first)
        angles = 2.0 * np.pi * (np.arange(_AROUND) + 0.5) / _AROUND
        return self.radius * (np.cos(angles)[:, None] * first + np.sin(angles)[:, None] * np.cross(along, first))


def check_resolved(compliance: np.ndarray, path: NeedlePath) -> None:
    """Raise InputError if the mesh cannot displace the nodes of a path independently, by their compliance [m/N]."""
    sizes = np.linalg.eigvalsh(compliance)
    if not sizes[0] > _MIN_SHARE * sizes[-1]:
        step = "Use smaller cells down to the end of the path, or a larger spacing."
        limit = "is finer than the mesh along the path"
        raise InputError("spacing of the path", f"{1e3 * path.nodes[1]:.3g} mm", limit, next_step=step)


_PER_SPACING = 50  # points of the path that are looked at, between two nodes
_ASIDE = 0.1  # of the needle's radius: not on the faces between cells on both sides


def check_thickness(tissue: Body, path: NeedlePath) -> None:
    """Raise InputError for a layer on the path that is thinner than the needle, around which loads are spread."""
    if len(np.unique(tissue.mesh.labels.astype(str))) == 1:
        return
    layers = layers_along(tissue, path)
    resolution = float(path.nodes[1]) / _PER_SPACING
    for (label, top), (_, end) in pairwise(layers):
        if end - top + resolution < 2.0 * path.radius:
            limit = f"{1e3 * (end - top):.3g} mm thick, is thinner than the needle, {2e3 * path.radius:.3g} mm"
            step = "Give it the label of its neighbour, or use a thinner needle."
            raise InputError(f"layer {label!r}", f"at {1e3 * top:.3g} mm", limit, next_step=step)


def layers_along(tissue: Body, path: NeedlePath) -> list[tuple[str, float]]:
    """Labels along the path and the distances at which they begin [m], the first at 0."""
    count = _PER_SPACING * (len(path.nodes) - 1)
    at = (np.arange(count) + 0.5) * path.depth / count
    names = labels_along(tissue, path, at)
    changes = np.flatnonzero(names[1:] != names[:-1])
    return [(str(names[0]), 0.0), *((str(names[k + 1]), float(0.5 * (at[k] + at[k + 1]))) for k in changes)]


def labels_along(tissue: Body, path: NeedlePath, distances: np.ndarray) -> np.ndarray:
    """Labels of the cells at distances along the path (n,) [m], (n,) of str. Raises InputError if it leaves the
    mesh."""
    dimension = tissue.mesh.dimension
    points = path.start(dimension) + distances[:, None] * path.along(dimension)
    points[:, 0] += _ASIDE * path.radius
    if not tissue.mesh.within(points).all():
        tissue.values_at(points)  # names the point, for which a search would take seconds
    try:
        cells = tissue.mesh.skfem.element_finder(mapping=tissue.elements.mapping)(*points.T)
    except ValueError:
        tissue.values_at(points)
        raise
    return tissue.mesh.labels[cells].astype(str)
