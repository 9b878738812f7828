# SPDX-License-Identifier: Apache-2.0
"""Nodal forces and tangent of hyperelastic elements that do not lock, on the undeformed mesh (total Lagrangian).

Energy of a cell: W(F) without the bulk modulus + K / 2 (P J - 1)^2 + G / 3 (J - P J)^2, integrated; P is the projection
of ``elements``. The last term vanishes as cells get smaller; with it small strain is that of the linear elements.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csc_array

from ..elastic.elements import Elements, Symmetry
from ..materials import cofactor, cofactor_tangent, isochoric_stress, isochoric_tangent
from ..mesh.mesh import library

_BATCH_BYTES = 1e8
_COMPONENTS = {2: [(0, 0), (0, 1), (1, 0), (1, 1), (2, 2)], 3: [(i, j) for i in range(3) for j in range(3)]}


@dataclass(frozen=True)
class Moduli:
    """Of each cell, (m,) [Pa]: those of the energy, and shear and bulk modulus at small strain."""

    c10: np.ndarray
    c01: np.ndarray
    shear: np.ndarray
    bulk: np.ndarray

    def of(self, numbers: np.ndarray, points: int) -> "Moduli":
        """Of some cells, repeated for their points of integration."""
        return Moduli(*(np.repeat(each[numbers], points) for each in (self.c10, self.c01, self.shear, self.bulk)))


@dataclass(frozen=True)
class _Batch:
    """Cells at their points of integration.

    ``numbers`` (m,); ``dofs`` (k, m); ``gradient`` (a, d, m, q) of scalar shape functions [1/m]; ``hoop`` (a, m, q),
    the functions by radius [1/m], zero but in an axisymmetric body; ``weight`` (m, q) [m^3]; ``functions`` (m, p, q)
    of the projection, orthonormal in the weight.
    """

    numbers: np.ndarray
    dofs: np.ndarray
    gradient: np.ndarray
    hoop: np.ndarray
    weight: np.ndarray
    functions: np.ndarray

    def displacement_gradient(self, solution: np.ndarray) -> np.ndarray:
        """Of the points of integration, (m q, 3, 3); the last axis is across a plane or axisymmetric body."""
        dimension = self.gradient.shape[1]
        nodal = solution[self.dofs].reshape(len(self.gradient), dimension, -1)  # (a, d, m)
        total = np.zeros((*self.weight.shape, 3, 3))
        total[:, :, :dimension, :dimension] = np.einsum("aim,ajmq->mqij", nodal, self.gradient, optimize=True)
        if dimension == 2:
            total[:, :, 2, 2] = np.einsum("am,amq->mq", nodal[:, 0], self.hoop, optimize=True)
        return total.reshape(-1, 3, 3)

    def operator(self) -> np.ndarray:
        """Components of the gradient by unknown, (m, q, k, c)."""
        nodes, dimension, m, q = self.gradient.shape
        components = _COMPONENTS[dimension]
        total = np.zeros((m, q, nodes * dimension, len(components)))
        for c, (i, j) in enumerate(components):
            row, axis = (self.gradient[:, j], i) if i < dimension else (self.hoop, 0)
            total[:, :, axis::dimension, c] = np.moveaxis(row, 0, 2)
        return total

    def projected(self, values: np.ndarray) -> np.ndarray:
        """P of values (m, q)."""
        moments = np.einsum("mpq,mq,mq->mp", self.functions, self.weight, values, optimize=True)
        return np.einsum("mp,mpq->mq", moments, self.functions)


@dataclass(frozen=True)
class _State:
    """Of the points of integration of a batch: F (n, 3, 3); J - 1 (n,); and p (n,) [Pa], p dJ/dF being a stress."""

    deformation: np.ndarray
    growth: np.ndarray
    pressure: np.ndarray

    @property
    def volume(self) -> np.ndarray:
        return 1.0 + self.growth


class HyperelasticElements:
    """Forces and tangent by displacement, of elements that are not of plane stress, with the moduli of their cells."""

    def __init__(self, elements: Elements, moduli: Moduli):
        self.elements, self.moduli = elements, moduli
        self._batches = list(_batches(elements))

    def forces(self, solution: np.ndarray) -> np.ndarray:
        """Nodal forces on the body that hold a displacement (n,) [N], which inverts no cell."""
        total = np.zeros(self.elements.count)
        for batch in self._batches:
            state = self._state(batch, solution)
            stress = self._stress(batch, state) * batch.weight.reshape(-1, 1, 1)
            components = _picked(stress, self.elements.mesh.dimension).reshape(*batch.weight.shape, -1)
            local = np.einsum("mqkc,mqc->km", batch.operator(), components, optimize=True)
            total += np.bincount(batch.dofs.ravel(), local.ravel(), self.elements.count)
        return total

    def pressure(self, solution: np.ndarray, change: np.ndarray | None = None) -> np.ndarray:
        """K (P J - 1) at the points of integration, (m, q) [Pa], made linear in a change of the displacement."""
        rows = []
        for batch in self._batches:
            state = self._state(batch, solution)
            growth = state.growth
            if change is not None:
                slope = cofactor(state.deformation, state.volume)
                growth = growth + np.sum(slope * batch.displacement_gradient(change), axis=(1, 2))
            rows.append(self.moduli.bulk[batch.numbers, None] * batch.projected(growth.reshape(batch.weight.shape)))
        return np.concatenate(rows)

    def tangent(self, solution: np.ndarray, pressure: np.ndarray | None = None) -> csc_array:
        """Derivative of the forces, sparse (n, n) [N/m].

        With a pressure of its own (m, q) [Pa] it is the tangent of the mixed elements, condensed: a change of volume
        that the bulk modulus has not undone yet does not stiffen or soften it.
        """
        parts = [self._local_tangent(batch, solution, pressure) for batch in self._batches]
        rows = [np.repeat(batch.dofs.T, len(batch.dofs), axis=1).ravel() for batch in self._batches]
        columns = [np.tile(batch.dofs.T, (1, len(batch.dofs))).ravel() for batch in self._batches]
        values = np.concatenate([each.ravel() for each in parts])
        places = (np.concatenate(rows), np.concatenate(columns))
        return coo_array((values, places), shape=(self.elements.count,) * 2).tocsc()

    def cauchy(self, solution: np.ndarray) -> np.ndarray:
        """Cauchy stress of each cell, averaged over its deformed volume, (m, 3, 3) [Pa]."""
        total = np.zeros((len(self.elements.mesh.cells), 3, 3))
        for batch in self._batches:
            state = self._state(batch, solution)
            kirchhoff = self._stress(batch, state) @ state.deformation.transpose(0, 2, 1)
            share = batch.weight / np.sum(batch.weight * state.volume.reshape(batch.weight.shape), axis=1)[:, None]
            total[batch.numbers] = np.einsum("mq,mqij->mij", share, kirchhoff.reshape(*share.shape, 3, 3))
        return total

    def inverted(self, solution: np.ndarray) -> np.ndarray:
        """Numbers of the cells whose volume is not above 0 at a point of integration."""
        volumes = ((each, self._state(each, solution).volume) for each in self._batches)
        return np.concatenate(
            [each.numbers[np.any(volume.reshape(each.weight.shape) <= 0.0, axis=1)] for each, volume in volumes]
        )

    def _state(self, batch: _Batch, solution: np.ndarray, pressure: np.ndarray | None = None) -> _State:
        gradient = batch.displacement_gradient(solution)
        trace = np.trace(gradient, axis1=1, axis2=2)
        square = np.sum(gradient * gradient.transpose(0, 2, 1), axis=(1, 2))
        growth = trace + 0.5 * (trace**2 - square) + np.linalg.det(gradient)  # J - 1, without cancellation
        mean = batch.projected(growth.reshape(batch.weight.shape)).ravel()
        moduli = self.moduli.of(batch.numbers, batch.weight.shape[1])
        projected = moduli.bulk * mean if pressure is None else pressure[batch.numbers].ravel()
        return _State(gradient + np.eye(3), growth, projected + 2.0 / 3.0 * moduli.shear * (growth - mean))

    def _stress(self, batch: _Batch, state: _State) -> np.ndarray:
        """First Piola-Kirchhoff stress, (m q, 3, 3) [Pa]."""
        moduli = self.moduli.of(batch.numbers, batch.weight.shape[1])
        slope = cofactor(state.deformation, state.volume)
        return isochoric_stress(state.deformation, moduli.c10, moduli.c01) + state.pressure[:, None, None] * slope

    def _local_tangent(self, batch: _Batch, solution: np.ndarray, pressure: np.ndarray | None) -> np.ndarray:
        """(m, k, k)"""
        state = self._state(batch, solution, pressure)
        moduli = self.moduli.of(batch.numbers, batch.weight.shape[1])
        slope = cofactor(state.deformation, state.volume)
        total = isochoric_tangent(state.deformation, moduli.c10, moduli.c01)
        total += state.pressure[:, None, None, None, None] * cofactor_tangent(slope, state.volume)
        total += np.einsum("n,nij,nkl->nijkl", 2.0 / 3.0 * moduli.shear, slope, slope)
        return self._integrated(batch, total, slope)

    def _integrated(self, batch: _Batch, moduli_of_points: np.ndarray, slope: np.ndarray) -> np.ndarray:
        operator, dimension = batch.operator(), self.elements.mesh.dimension
        m, q, k, c = operator.shape
        weighted = _picked(_picked(moduli_of_points, dimension).swapaxes(1, 2).swapaxes(2, 3), dimension)
        weighted = weighted.reshape(m, q, c, c) * batch.weight[:, :, None, None]
        left = np.moveaxis(operator @ weighted, 2, 1).reshape(m, k, q * c)
        total = left @ operator.transpose(0, 1, 3, 2).reshape(m, q * c, k)
        growth = operator @ _picked(slope, dimension).reshape(m, q, c, 1)  # dJ by unknown, (m, q, k, 1)
        projected = growth[..., 0].transpose(0, 2, 1) @ (batch.functions * batch.weight[:, None]).transpose(0, 2, 1)
        lame = (self.moduli.bulk - 2.0 / 3.0 * self.moduli.shear)[batch.numbers]
        return total + lame[:, None, None] * (projected @ projected.transpose(0, 2, 1))


def _picked(tensors: np.ndarray, dimension: int) -> np.ndarray:
    """Components that a body has, of the axes 1 and 2: (n, 3, 3, ...) -> (n, c, ...)."""
    rows, columns = np.array(_COMPONENTS[dimension]).T
    return tensors[:, rows, columns]


def _batches(elements: Elements) -> Iterator[_Batch]:
    unknowns, dimension = len(elements.dofs.element_dofs), elements.mesh.dimension
    components = len(_COMPONENTS[dimension])
    points = (elements.order + 1) ** dimension
    batch = max(int(_BATCH_BYTES / (8.0 * points * (3.0 * unknowns * components + 500.0))), 1)
    for first in range(0, len(elements.mesh.cells), batch):
        yield _batch(elements, np.arange(first, min(first + batch, len(elements.mesh.cells))))


def _batch(elements: Elements, numbers: np.ndarray) -> _Batch:
    basis = library().Basis(
        elements.mesh.skfem, elements.element.elem, mapping=elements.mapping,
        intorder=2 * elements.order + (elements.order == 2), elements=numbers, disable_doflocs=True,
    )  # fmt: skip
    places = np.asarray(basis.global_coordinates())
    values = np.array([np.broadcast_to(np.asarray(each[0]), basis.dx.shape) for each in basis.basis])
    around = elements.symmetry is Symmetry.AXISYMMETRIC
    weight = basis.dx * (2.0 * np.pi * places[0] if around else 1.0)
    if elements.symmetry is Symmetry.PLANE_STRAIN:
        weight = weight * elements.thickness
    return _Batch(
        numbers=numbers,
        dofs=elements.dofs.element_dofs[:, numbers],
        gradient=np.array([np.broadcast_to(each[0].grad, places.shape) for each in basis.basis]),
        hoop=values / places[0] if around else np.zeros_like(values),
        weight=weight,
        functions=_functions(places, weight, elements.linear),
    )


def _functions(places: np.ndarray, weight: np.ndarray, linear: bool) -> np.ndarray:
    """Those that the elements project the dilatation onto, made orthonormal, (m, p, q)."""
    functions = np.ones((1, *weight.shape))
    if linear:
        centred = places - places.mean(axis=2, keepdims=True)
        functions = np.concatenate([functions, centred / np.abs(centred).max(axis=2, keepdims=True)])
    functions = np.moveaxis(functions, 0, 1)
    gram = (functions * weight[:, None]) @ functions.transpose(0, 2, 1)
    return np.linalg.solve(np.linalg.cholesky(gram), functions)
