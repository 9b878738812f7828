# SPDX-License-Identifier: Apache-2.0
"""Element matrices of linear elasticity that do not lock, in batches of cells, with scikit-fem's shape functions.

Energy of a cell: G eps:eps + lambda / 2 (P div u)^2, integrated; P is the projection of the dilatation onto a constant,
or onto a linear function in quadrilaterals of second order (mean dilatation: Nagtegaal, Parks & Rice 1974).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from scipy.sparse import csc_array

from ..mesh.mesh import Mesh, library

_BATCH_BYTES = 2e8


class Symmetry(StrEnum):
    """How a mesh stands for a solid."""

    AXISYMMETRIC = "axisymmetric"
    PLANE_STRAIN = "plane_strain"
    PLANE_STRESS = "plane_stress"
    SOLID = "solid"


@dataclass(frozen=True)
class Cells:
    """What scikit-fem knows of a batch of m cells with k unknowns each, at their q points of integration."""

    dofs: np.ndarray  # (k, m) unknowns of each cell
    strain: np.ndarray  # (m, k, s, q) by unknown, shear times sqrt(2), so that eps:eps is a sum of squares
    dilatation: np.ndarray  # (m, k, q) its trace
    values: np.ndarray  # (m, k, d, q) displacement by unknown
    weight: np.ndarray  # (m, q) volume of each point
    places: np.ndarray  # (d, m, q) [m]


class Elements:
    """Shape functions of displacement on a mesh, of an order 1 or 2, and the matrices that are made of them; thickness
    is that of a plane body [m]."""

    def __init__(self, mesh: Mesh, symmetry: Symmetry, order: int, thickness: float):
        skfem = library()
        self.mesh, self.symmetry, self.order, self.thickness = mesh, symmetry, order, thickness
        self.element = skfem.ElementVector(_scalar(mesh.shape, order))
        self.mapping = mesh.skfem.mapping()
        self.dofs = skfem.assembly.Dofs(mesh.skfem, self.element)
        self.count = int(self.dofs.N)

    def batches(self) -> Iterator[tuple[np.ndarray, Cells]]:
        """Numbers of cells with what is known of them."""
        unknowns = self.dofs.element_dofs.shape[0]
        points = 8 * (self.order + 1) ** self.mesh.dimension
        batch = max(int(_BATCH_BYTES / (unknowns * 9.0 * 2.0 * points)), 1)
        for first in range(0, len(self.mesh.cells), batch):
            numbers = np.arange(first, min(first + batch, len(self.mesh.cells)))
            yield numbers, self._cells(numbers)

    def stiffness(self, shear: np.ndarray, lame: np.ndarray) -> csc_array:
        """Stiffness for moduli of each cell, (m,) [Pa]; plane stress takes its own Lamé modulus."""
        return self._assembled(lambda numbers, cells: _stiffness(cells, shear[numbers], lame[numbers], self.linear))

    def mass(self, density: np.ndarray) -> csc_array:
        """Consistent mass for the density of each cell, (m,) [kg/m^3]."""
        return self._assembled(lambda numbers, cells: _mass(cells, density[numbers]))

    @property
    def linear(self) -> bool:
        """Whether the dilatation of a cell is projected onto linear functions, not onto constants."""
        return self.order == 2 and self.mesh.shape in ("quad", "hexahedron")

    def at(self, points: np.ndarray) -> csc_array:
        """Matrix from unknowns to displacements at points (n, d), row by row: x of all points, y of all, and so on.

        Raises ValueError for a point outside the mesh.
        """
        cells = self.mesh.skfem.element_finder(mapping=self.mapping)(*points.T)
        places = self.mapping.invF(points.T[:, :, None], tind=cells)
        unknowns, (n, dimension) = self.dofs.element_dofs[:, cells], points.shape
        values = [
            np.asarray(self.element.gbasis(self.mapping, places, k, tind=cells)[0])[..., 0]
            for k in range(len(unknowns))
        ]
        rows = np.broadcast_to(np.arange(n * dimension), (len(unknowns), n * dimension))
        columns = np.tile(unknowns, dimension)
        return csc_array(
            (np.array(values).reshape(len(unknowns), -1).ravel(), (rows.ravel(), columns.ravel())),
            shape=(n * dimension, self.count),
        )

    def _assembled(self, matrices) -> csc_array:  # type: ignore[no-untyped-def]
        total = csc_array((self.count, self.count))
        for numbers, cells in self.batches():
            local, k = matrices(numbers, cells), len(cells.dofs)
            rows = np.repeat(cells.dofs.T, k, axis=1).ravel()
            columns = np.tile(cells.dofs.T, (1, k)).ravel()
            total = total + csc_array((local.ravel(), (rows, columns)), shape=total.shape)
        return total

    def _cells(self, numbers: np.ndarray) -> Cells:
        basis = library().Basis(
            self.mesh.skfem, self.element, mapping=self.mapping, intorder=2 * self.order + (self.order == 2),
            elements=numbers, dofs=self.dofs, disable_doflocs=True,
        )  # fmt: skip
        places = np.asarray(basis.global_coordinates())
        gradients = np.array([each[0].grad for each in basis.basis])  # (k, d, d, m, q)
        values = np.array([np.asarray(each[0]) for each in basis.basis])  # (k, d, m, q)
        strain = self._strain(gradients, values, places)
        return Cells(
            dofs=self.dofs.element_dofs[:, numbers],
            strain=np.moveaxis(strain, (2, 0), (0, 1)),
            dilatation=np.moveaxis(strain[:, :3].sum(axis=1), 1, 0),
            values=np.moveaxis(values, (2, 0), (0, 1)),
            weight=basis.dx * self._measure(places),
            places=places,
        )

    def _strain(self, gradients: np.ndarray, values: np.ndarray, places: np.ndarray) -> np.ndarray:
        """Components (k, s, m, q): three normal ones, then shear."""
        shear = lambda i, j: np.sqrt(0.5) * (gradients[:, i, j] + gradients[:, j, i])  # noqa: E731
        if self.symmetry is Symmetry.SOLID:
            normal = [gradients[:, i, i] for i in range(3)]
            return np.stack([*normal, shear(0, 1), shear(1, 2), shear(0, 2)], axis=1)
        across = np.zeros_like(gradients[:, 0, 0])
        if self.symmetry is Symmetry.AXISYMMETRIC:
            across = values[:, 0] / places[0]
        return np.stack([gradients[:, 0, 0], across, gradients[:, 1, 1], shear(0, 1)], axis=1)

    def _measure(self, places: np.ndarray) -> np.ndarray | float:
        if self.symmetry is Symmetry.AXISYMMETRIC:
            return 2.0 * np.pi * places[0]
        return 1.0 if self.symmetry is Symmetry.SOLID else self.thickness


def _stiffness(cells: Cells, shear: np.ndarray, lame: np.ndarray, linear: bool) -> np.ndarray:
    m, k = cells.strain.shape[:2]
    weighted = cells.strain * (2.0 * shear[:, None] * cells.weight)[:, None, None]
    distortion = weighted.reshape(m, k, -1) @ cells.strain.reshape(m, k, -1).transpose(0, 2, 1)
    projected, gram = _projected(cells, linear)
    return distortion + lame[:, None, None] * (projected @ np.linalg.solve(gram, projected.transpose(0, 2, 1)))


def _projected(cells: Cells, linear: bool) -> tuple[np.ndarray, np.ndarray]:
    """Dilatation by unknown times the functions it is projected onto, integrated, (m, k, p); their Gram matrix."""
    functions = np.ones((1, *cells.weight.shape))
    if linear:
        centred = cells.places - cells.places.mean(axis=2, keepdims=True)
        functions = np.concatenate([functions, centred / np.abs(centred).max(axis=2, keepdims=True)])
    functions = np.moveaxis(functions, 0, 1)  # (m, p, q)
    weighted = functions * cells.weight[:, None]
    return cells.dilatation @ weighted.transpose(0, 2, 1), weighted @ functions.transpose(0, 2, 1)


def _mass(cells: Cells, density: np.ndarray) -> np.ndarray:
    m, k = cells.values.shape[:2]
    weighted = cells.values * (density[:, None] * cells.weight)[:, None, None]
    return weighted.reshape(m, k, -1) @ cells.values.reshape(m, k, -1).transpose(0, 2, 1)


def _scalar(shape: str, order: int) -> Any:
    names = {"triangle": "ElementTriP", "quad": "ElementQuad", "tetra": "ElementTetP", "hexahedron": "ElementHex"}
    return getattr(library(), f"{names[shape]}{order}")()
