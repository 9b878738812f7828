# SPDX-License-Identifier: Apache-2.0
"""Tissue with mass and damping: in full, and by few modes: static ones of a needle's path, and vibrations with the path
at rest."""

from dataclasses import fields

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import cholesky, eigh, null_space, solve_triangular
from scipy.sparse import csr_array, diags_array, issparse
from scipy.sparse.linalg import LinearOperator, eigsh

from ...errors import InputError
from ..elastic.elements import Elements
from ..elastic.needle_path import NeedlePath, check_resolved
from ..elastic.supports import unknowns_of
from ..elastic.tissue import Tissue
from .dynamics import DynamicSystem, Rayleigh, product, weighted_sum

_MAX_DENSE = 400  # unknowns whose modes are all computed
_MAX_DENSE_MANY = 3000  # the same where many of them are wanted


class TissueDynamics(DynamicSystem):
    """Tissue with mass and damping; its unknowns are the displacements that no support holds.

    Parameters
    ----------
    tissue : Tissue
        Mesh, materials with densities, and supports.
    damping : Rayleigh, optional
        None by default.
    lumped : bool
        Whether the mass is a diagonal matrix, as central differences need it.
    """

    def __init__(self, tissue: Tissue, damping: Rayleigh | None = None, *, lumped: bool = False):
        self.tissue, self.rayleigh = tissue, damping or Rayleigh()
        self.free = np.flatnonzero(~tissue.held)
        density = np.array([tissue.materials[str(label)].density for label in tissue.mesh.labels])
        stiffness = csr_array(tissue.stiffness)[self.free][:, self.free]
        if lumped:
            mass = lumped_mass(tissue.elements, density)[self.free]
        else:
            mass = csr_array(tissue.elements.mass(density))[self.free][:, self.free]
        shares = [(self.rayleigh.mass, mass), (self.rayleigh.stiffness, stiffness)]
        used = [share for share in shares if share[0]]
        places = unknowns_of(tissue.elements).places[self.free]
        super().__init__(mass, weighted_sum(used) if used else np.zeros(len(self.free)), stiffness, places)

    def loads(self, path: NeedlePath) -> csr_array:
        """Forces on the unknowns for a unit force along each node of a path, (n, nodes)."""
        return csr_array(path.loads(self.tissue))[self.free]

    def values_at(self, points: ArrayLike) -> csr_array:
        """Matrix from unknowns to displacements at points (k, d) [m]: x of all points, then y, then z."""
        places = np.atleast_2d(np.asarray(points, dtype=float))
        return csr_array(self.tissue.values_at(places).tocsc()[:, self.free])

    def displacement(self, values: np.ndarray, points: ArrayLike) -> np.ndarray:
        """Displacement at points (k, d) [m] for values of the unknowns, (k, d) [m]."""
        return (self.values_at(points) @ values).reshape(self.tissue.mesh.dimension, -1).T


def lumped_mass(elements: Elements, density: np.ndarray) -> np.ndarray:
    """Mass of each unknown, (n,) [kg], for the density of each cell [kg/m^3]: the diagonal of the consistent mass,
    scaled to the mass of each cell, positive for all shapes. Hinton, Rock & Zienkiewicz (1976), Earthq. Eng. Struct.
    Dyn. 4, 245-249."""
    total = np.zeros(elements.count)
    for numbers, cells in elements.batches():
        weight = density[numbers][:, None] * cells.weight
        diagonal = np.einsum("mkdq,mq->mkd", cells.values**2, weight)
        share = weight.sum(axis=1)[:, None] / diagonal.sum(axis=1)
        np.add.at(total, cells.dofs, np.einsum("mkd,md->km", diagonal, share))
    return total


class ReducedTissue(DynamicSystem):
    """Tissue that moves by static modes and vibrations: a step costs the same on any mesh.

    The static modes are the displacements for a unit force at each node of the path, so that slow motion is that of the
    full model. The vibrations are those in which the averages of displacement at the nodes of the path are zero. All
    are then combined into modes without coupling, with unit mass.

    Parameters
    ----------
    full : TissueDynamics
        The full model.
    path : NeedlePath
        Of the needle.
    modes : int
        Number of vibrations, from the lowest frequency; 0 to the number of unknowns minus that of the path's nodes, for
        which the reduced model is the full one.

    Attributes
    ----------
    basis : ndarray, shape (n, r)
        Unknowns of the full model for each mode [1/sqrt(kg)].
    frequencies : ndarray, shape (r,)
        Of the modes [Hz].
    interface_frequencies : ndarray, shape (modes,)
        Of the vibrations with the path at rest [Hz]; motion of higher frequency is not resolved.

    Raises
    ------
    InputError
        If the number of modes is out of its range, or the mesh is too coarse for the path.

    Notes
    -----
    Craig & Bampton (1968), AIAA J. 6, 1313-1319, with averages along the path in place of nodes of the mesh.
    """

    def __init__(self, full: TissueDynamics, path: NeedlePath, modes: int):
        loads = full.loads(path).toarray()
        if not 0 <= modes <= full.count - loads.shape[1] or int(modes) != modes:
            limit = f"must be 0 to {full.count - loads.shape[1]}"
            raise InputError("number of modes", modes, limit, next_step="Use 40, and compare with 80.")
        static = _static_modes(full, loads, path)
        vibrations, angular = _vibrations(full, loads, static, int(modes))
        self.full, self.path, self.rayleigh = full, path, full.rayleigh
        self.interface_frequencies = angular / (2.0 * np.pi)
        self.basis, squared = _uncoupled(full, np.column_stack([static, vibrations / angular]))
        self.frequencies = np.sqrt(squared) / (2.0 * np.pi)
        damping = self.rayleigh.mass + self.rayleigh.stiffness * squared
        super().__init__(np.ones(len(squared)), damping, squared)

    def loads(self, path: NeedlePath) -> np.ndarray:
        """Forces on the modes for a unit force along each node of the path, (r, nodes).

        Raises InputError for another path than that of the model.
        """
        if any(getattr(path, each.name) != getattr(self.path, each.name) for each in fields(NeedlePath)):
            step = "Make a ReducedTissue for this path, or use TissueDynamics."
            raise InputError("path", "another", "than the one of the reduced model", next_step=step)
        return self.basis.T @ self.full.loads(path).toarray()

    def values_at(self, points: ArrayLike) -> np.ndarray:
        """Matrix from modes to displacements at points (k, d) [m]: x of all points, then y, then z."""
        return self.full.values_at(points) @ self.basis

    def displacement(self, values: np.ndarray, points: ArrayLike) -> np.ndarray:
        """Displacement at points (k, d) [m] for values of the modes, (k, d) [m]."""
        return self.full.displacement(self.basis @ values, points)

    def projected(self, values: ArrayLike) -> np.ndarray:
        """Values of the modes, (r,), nearest in mass to values of the unknowns (n,) of the full model."""
        return self.basis.T @ product(self.full.mass, np.asarray(values, dtype=float))


def _static_modes(full: TissueDynamics, loads: np.ndarray, path: NeedlePath) -> np.ndarray:
    """Displacements for loads, orthonormal in strain energy, (n, nodes)."""
    moved = full.tissue.factor.solve(loads)
    compliance = loads.T @ moved
    check_resolved(compliance, path)
    triangle = cholesky(compliance, lower=True)
    return solve_triangular(triangle, moved.T, lower=True).T


def _vibrations(full: TissueDynamics, loads: np.ndarray, static: np.ndarray, modes: int):  # type: ignore[no-untyped-def]
    """Shapes (n, modes) of unit mass and angular frequencies [rad/s], with the path at rest."""
    if modes == 0:
        return np.zeros((full.count, 0)), np.zeros(0)
    if full.count <= (_MAX_DENSE_MANY if modes > full.count // 4 else _MAX_DENSE):
        return _all_vibrations(full, loads, modes)

    def solve(right: np.ndarray) -> np.ndarray:
        return full.tissue.factor.solve(right) - static @ (static.T @ right)

    mass = full.mass if issparse(full.mass) else csr_array(diags_array(full.mass))
    inverse = LinearOperator((full.count,) * 2, matvec=solve, dtype=float)
    start = solve(np.random.default_rng(0).standard_normal(full.count))
    squared, shapes = eigsh(full.stiffness, k=modes, M=mass, sigma=0.0, OPinv=inverse, v0=start)
    order = np.argsort(squared)
    return shapes[:, order], np.sqrt(squared[order])


def _all_vibrations(full: TissueDynamics, loads: np.ndarray, modes: int):  # type: ignore[no-untyped-def]
    """The same for small models, from all of them."""
    resting = null_space(loads.T)
    stiffness, mass = (resting.T @ product(each, resting) for each in (full.stiffness, full.mass))
    squared, shapes = eigh(stiffness, mass, subset_by_index=(0, modes - 1))
    return resting @ shapes, np.sqrt(squared)


def _uncoupled(full: TissueDynamics, shapes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Modes of unit mass and squared angular frequencies, from shapes that are orthonormal in strain energy."""
    periods, turned = np.linalg.eigh(shapes.T @ product(full.mass, shapes))  # 1 / w^2
    return (shapes @ turned[:, ::-1]) / np.sqrt(periods[::-1]), 1.0 / periods[::-1]
