# SPDX-License-Identifier: Apache-2.0
"""A section through a solved solid along the needle's line: displacement and stress on a grid, and at the surface."""

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from ..checks import one_of
from ..errors import InputError
from .elastic.elements import Symmetry
from .elastic.needle_path import NeedlePath
from .elastic.stress import checked_solution, stress
from .elastic.tissue import Tissue
from .mesh.mesh import library

_PIXELS = 600  # of the longer side
_WIDE, _DEEP = 1.5, 1.5  # what is shown of a large body, to either side and down, in depths of the path


def _boxes(dimension: int, simplices: list[tuple[int, ...]]) -> tuple[np.ndarray, np.ndarray]:
    """Points of a square or cube halved along each axis, and simplices (n, k) of the parts, by corners of each part."""
    corners = np.array(list(product((0, 1), repeat=dimension)))
    powers = 3 ** np.arange(dimension)[::-1]
    parts = [(each + corners[list(one)]) @ powers for each in corners for one in simplices]
    return 0.5 * np.array(list(product((0, 1, 2), repeat=dimension))), np.array(parts)


# points in the reference cell and the simplices between them: corners, middles of edges, and so on, as many as elements
# of second order have
_PARTS = {
    "triangle": (
        np.array([(0, 0), (1, 0), (0, 1), (0.5, 0), (0.5, 0.5), (0, 0.5)]),
        np.array([(0, 3, 5), (1, 4, 3), (2, 5, 4), (3, 4, 5)]),
    ),
    "quad": _boxes(2, [(0, 1, 3), (0, 3, 2)]),
    "tetra": (
        0.5 * np.array([(0, 0, 0), (2, 0, 0), (0, 2, 0), (0, 0, 2), (1, 0, 0),
                        (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, 0, 1), (0, 1, 1)]),
        np.array([(0, 4, 5, 6), (1, 4, 7, 8), (2, 5, 7, 9), (3, 6, 8, 9),
                  (4, 9, 5, 6), (4, 9, 6, 8), (4, 9, 8, 7), (4, 9, 7, 5)]),
    ),
    "hexahedron": _boxes(3, [(0, 1, 3, 7), (0, 3, 2, 7), (0, 2, 6, 7), (0, 6, 4, 7), (0, 4, 5, 7), (0, 5, 1, 7)]),
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Field:
    """A quantity in a section, and its extremes over all cells of it, also those that are smaller than the grid."""

    values: np.ndarray  # (rows, columns) [m] or [Pa], NaN where there is no tissue
    low: float
    high: float
    low_at: tuple[float, float]  # [m] distance from the needle's line, and depth
    high_at: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Section:
    """Triangles of a plane through the needle's line, and what they show.

    Attributes
    ----------
    across : ndarray, shape (columns,)
        Distance from the needle's entry in the plane [m].
    depth : ndarray, shape (rows,)
        [m]
    corners : ndarray, shape (t, 3, 2)
        Of the triangles: distance and depth [m].
    moved : ndarray, shape (t, 3, d)
        Displacement at their corners [m].
    tensor : ndarray, shape (t, 3, 3)
        Stress of their cells [Pa].
    von_mises : ndarray, shape (t,)
        Of their cells [Pa].
    label : ndarray of int, shape (t,)
        Number of their label in ``names``.
    names : tuple of str
        Labels.
    along : ndarray, shape (d,)
        Unit vector of the needle.
    """

    across: np.ndarray
    depth: np.ndarray
    corners: np.ndarray
    moved: np.ndarray
    tensor: np.ndarray
    von_mises: np.ndarray
    label: np.ndarray
    names: tuple[str, ...]
    along: np.ndarray

    def field(self, quantity: str) -> Field:
        """A quantity: ``displacement`` along the needle, its ``magnitude``, ``von_mises``, ``stress`` along the needle.

        Raises
        ------
        InputError
            If the quantity is another.
        """
        at_corners = {
            "displacement": lambda: self.moved @ self.along,
            "magnitude": lambda: np.linalg.norm(self.moved, axis=2),
            "von_mises": lambda: np.repeat(self.von_mises[:, None], 3, axis=1),
            "stress": lambda: np.repeat(self._stress_along[:, None], 3, axis=1),
        }
        one_of("quantity", quantity, at_corners)
        values = at_corners[quantity]()
        centres = np.repeat(self.corners.mean(axis=1, keepdims=True), 3, axis=1)
        places = self.corners if quantity in ("displacement", "magnitude") else centres
        seen = np.where(self._inside(places), values, np.nan)
        low, high = np.nanargmin(seen), np.nanargmax(seen)
        at = [tuple(map(float, places.reshape(-1, 2)[each])) for each in (low, high)]
        return Field(self.on_grid(values), float(values.flat[low]), float(values.flat[high]), at[0], at[1])

    def on_grid(self, values: np.ndarray) -> np.ndarray:
        """Values at the corners of the triangles (t, 3) on the grid, linear within each, NaN outside."""
        grid = np.full((len(self.depth), len(self.across)), np.nan)
        rows, columns, triangles, weights = self._pixels
        grid[rows, columns] = np.einsum("nk,nk->n", weights, values[triangles])
        return grid

    @cached_property
    def surface(self) -> tuple[np.ndarray, np.ndarray]:
        """Distance from the needle (k,) and displacement along the depth (k,) at the surface [m]; + is inwards."""
        top = self.corners[:, :, 1].min()
        here = self.corners[:, :, 1] <= top + 1e-6 * np.ptp(self.corners[:, :, 1])
        distance, first = np.unique(np.round(self.corners[here][:, 0], 9), return_index=True)
        return distance, self.moved[here][first, -1]

    @property
    def _stress_along(self) -> np.ndarray:
        axes = self.tensor[:, : len(self.along), : len(self.along)]
        return np.einsum("i,tij,j->t", self.along, axes, self.along)

    def _inside(self, places: np.ndarray) -> np.ndarray:
        half = 0.5 * (self.across[1] - self.across[0])
        low, high = (np.array([self.across[end], self.depth[end]]) for end in (0, -1))
        return np.all((places >= low - 1.01 * half) & (places <= high + 1.01 * half), axis=-1)

    @cached_property
    def _pixels(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Row, column and triangle of each point of the grid that is in one, and the weights of its corners (n, 3)."""
        origin, step = np.array([self.across[0], self.depth[0]]), self.across[1] - self.across[0]
        scaled = (self.corners - origin) / step
        last = np.array([len(self.across), len(self.depth)]) - 1
        low = np.clip(np.ceil(scaled.min(axis=1) - 1e-9), 0, last + 1).astype(int)
        high = np.clip(np.floor(scaled.max(axis=1) + 1e-9), -1, last).astype(int)
        width, height = np.maximum(high - low + 1, 0).T
        triangles = np.repeat(np.arange(len(scaled)), width * height)
        number = np.arange(len(triangles)) - np.repeat(np.cumsum(width * height) - width * height, width * height)
        columns = low[triangles, 0] + number % np.maximum(width, 1)[triangles]
        rows = low[triangles, 1] + number // np.maximum(width, 1)[triangles]
        weights = _barycentric(scaled[triangles], np.column_stack([columns, rows]))
        inside = weights.min(axis=1) >= -1e-6
        return rows[inside], columns[inside], triangles[inside], weights[inside]


def section(tissue: Tissue, solution: ArrayLike, path: NeedlePath | None = None) -> Section:
    """The plane through the needle's line of a solid in space; a plane mesh itself, axisymmetric ones with the mirror.

    Parameters
    ----------
    tissue : Tissue
        What was solved.
    solution : array_like, shape (n,)
        Displacement of all unknowns [m], of ``tissue.solve``.
    path : NeedlePath, optional
        The plane is vertical, through its line; of a path straight down, and without one, along x. Of a body that is
        more than 1.5 depths of the path wide to a side or deep, only that much is shown.

    Returns
    -------
    Section
        What ``picture`` draws.

    Raises
    ------
    InputError
        If the solution does not fit, or the plane does not meet the mesh.
    """
    values = checked_solution(tissue, solution)
    dimension = tissue.mesh.dimension
    along = np.eye(dimension)[-1] if path is None else path.along(dimension)
    start = np.zeros(dimension) if path is None else path.start(dimension)
    cut = _sliced if dimension == 3 else _flat
    corners, moved, cells = cut(tissue, values, start, along)
    if not len(corners):
        step = "Give a path whose entry is in the mesh."
        raise InputError("plane of the section", "outside the mesh", "it shows nothing", next_step=step)
    found = stress(tissue, values)
    names, numbers = np.unique(tissue.mesh.labels.astype(str), return_inverse=True)
    across, depth = _grid(corners, path)
    return Section(
        across=across, depth=depth, corners=corners, moved=moved, tensor=found.tensor[cells],
        von_mises=found.von_mises[cells], label=numbers[cells], names=tuple(map(str, names)), along=along,
    )  # fmt: skip


def _grid(corners: np.ndarray, path: NeedlePath | None) -> tuple[np.ndarray, np.ndarray]:
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    if path is not None:
        low[0], high[0] = max(low[0], -_WIDE * path.depth), min(high[0], _WIDE * path.depth)
        high[1] = min(high[1], _DEEP * path.depth)
    step = (high - low).max() / _PIXELS
    counts = np.maximum(np.round((high - low) / step).astype(int), 2)
    return tuple(start + step * (np.arange(count) + 0.5) for start, count in zip(low, counts))  # type: ignore[return-value]


def _flat(tissue: Tissue, values: np.ndarray, start: np.ndarray, along: np.ndarray) -> tuple[np.ndarray, ...]:
    """Triangles of a mesh in the plane; of an axisymmetric one also those on the other side of the axis."""
    numbers, cells, places, moved = _parts(tissue, values, np.arange(len(tissue.mesh.cells)))
    corners, moved = places[numbers] - np.append(start[:-1], 0.0), moved[numbers]
    if tissue.symmetry is Symmetry.AXISYMMETRIC:
        mirror = np.array([-1.0, 1.0])
        corners, moved = np.concatenate([corners, mirror * corners]), np.concatenate([moved, mirror * moved])
        cells = np.tile(cells, 2)
    return corners, moved, cells


def _sliced(tissue: Tissue, values: np.ndarray, start: np.ndarray, along: np.ndarray) -> tuple[np.ndarray, ...]:
    """Triangles in which a vertical plane meets the tetrahedra of a mesh in space."""
    mesh, size = tissue.mesh, np.linalg.norm(along[:2])
    toward = along[:2] / size if size > 1e-9 else np.array([1.0, 0.0])
    normal = np.array([-toward[1], toward[0]])
    front = ((mesh.points[:, :2] - start[:2]) @ normal)[mesh.cells]
    near = 1e-10 * np.ptp(mesh.points, axis=0).max()
    met = np.flatnonzero((front.min(axis=1) <= near) & (front.max(axis=1) > -near))
    if not len(met):
        return np.zeros((0, 3, 2)), np.zeros((0, 3, 3)), met
    numbers, cells, places, moved = _parts(tissue, values, met)
    offset = places[:, :2] - start[:2]
    side = offset @ normal
    side = np.where(np.abs(side) < near, near, side)  # a point in the plane counts as in front of it
    ends, cells = _crossed(numbers, cells, side)
    share = side[ends[..., 0]] / (side[ends[..., 0]] - side[ends[..., 1]])
    between = lambda rows: rows[ends[..., 0]] + share[..., None] * (rows[ends[..., 1]] - rows[ends[..., 0]])  # noqa: E731
    return between(np.column_stack([offset @ toward, places[:, 2]])), between(moved), met[cells]


def _parts(tissue: Tissue, values: np.ndarray, chosen: np.ndarray) -> tuple[np.ndarray, ...]:
    """Corners of the simplices of the chosen cells (n, k), number of the cell of each (n,); places and displacements
    (points, d) [m]."""
    points, simplices = _PARTS[tissue.mesh.shape]
    elements, dimension = tissue.elements, tissue.mesh.dimension
    basis = library().Basis(
        tissue.mesh.skfem, elements.element, mapping=elements.mapping, dofs=elements.dofs, elements=chosen,
        quadrature=(points.T, np.ones(len(points))), disable_doflocs=True,
    )  # fmt: skip
    found = (basis.global_coordinates(), basis.interpolate(values))
    places, moved = (np.asarray(each).reshape(dimension, -1).T for each in found)
    numbers = (simplices + len(points) * np.arange(len(chosen))[:, None, None]).reshape(-1, dimension + 1)
    return numbers, np.repeat(np.arange(len(chosen)), len(simplices)), places, moved


def _crossed(numbers: np.ndarray, cells: np.ndarray, side: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Edges of tetrahedra that a plane meets, three for each triangle (t, 3, 2), and the cell of each."""
    ordered = np.take_along_axis(numbers, np.argsort(side[numbers], axis=1), axis=1)
    front = np.sum(side[ordered] > 0.0, axis=1)
    edges = {  # by how many corners are in front of the plane
        1: [[(3, 0), (3, 1), (3, 2)]],
        2: [[(0, 2), (0, 3), (1, 3)], [(0, 2), (1, 3), (1, 2)]],
        3: [[(0, 1), (0, 2), (0, 3)]],
    }
    found = [(ordered[front == n][:, triangle], cells[front == n]) for n, every in edges.items() for triangle in every]
    return np.concatenate([each for each, _ in found]), np.concatenate([each for _, each in found])


def _barycentric(corners: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Weights of the corners (n, 3, 2) at places (n, 2); negative outside, and for a triangle without area."""
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    at = places - corners[:, 0]
    area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    safe = np.where(np.abs(area) > 1e-12, area, np.inf)
    one = (at[:, 0] * second[:, 1] - at[:, 1] * second[:, 0]) / safe
    other = (first[:, 0] * at[:, 1] - first[:, 1] * at[:, 0]) / safe
    weights = np.column_stack([1.0 - one - other, one, other])
    return np.where(np.isinf(safe)[:, None], -1.0, weights)
