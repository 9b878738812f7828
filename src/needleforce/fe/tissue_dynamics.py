# SPDX-License-Identifier: Apache-2.0
"""Tissue with mass and damping: its matrices, consistent or lumped, loads along a path, and displacements of points."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_array

from .dynamics import DynamicSystem, Rayleigh, weighted_sum
from .elements import Elements
from .needle_path import NeedlePath
from .supports import unknowns_of
from .tissue import Tissue


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
    """Mass of each unknown, (n,) [kg], for the density of each cell [kg/m^3].

    The diagonal of the consistent mass, scaled to the mass of each cell: positive for all shapes.

    Notes
    -----
    Hinton, Rock & Zienkiewicz (1976), Earthq. Eng. Struct. Dyn. 4, 245-249.
    """
    total = np.zeros(elements.count)
    for numbers, cells in elements.batches():
        weight = density[numbers][:, None] * cells.weight
        diagonal = np.einsum("mkdq,mq->mkd", cells.values**2, weight)
        share = weight.sum(axis=1)[:, None] / diagonal.sum(axis=1)
        np.add.at(total, cells.dofs, np.einsum("mkd,md->km", diagonal, share))
    return total
