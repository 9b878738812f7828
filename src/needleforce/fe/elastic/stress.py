# SPDX-License-Identifier: Apache-2.0
"""Stress of each cell: of linear tissue from a solution, and what is derived from any tensor of stress."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from .elements import Cells, Symmetry
from .tissue import Tissue

_ROWS = {2: [0, 2, 1, 0], 3: [0, 1, 2, 0, 1, 0]}  # of the components of strain in a tensor: normal ones, then shear
_COLUMNS = {2: [0, 2, 1, 1], 3: [0, 1, 2, 1, 2, 2]}


@dataclass(frozen=True, eq=False)
class Stress:
    """Stress of each cell, averaged over its volume.

    Attributes
    ----------
    tensor : ndarray, shape (m, 3, 3)
        [Pa], + pulls. Axes of the mesh; in the plane the third is across it, around the axis if axisymmetric.
    """

    tensor: np.ndarray

    @property
    def pressure(self) -> np.ndarray:
        """Negative mean of the normal components, (m,) [Pa]."""
        return -np.trace(self.tensor, axis1=1, axis2=2) / 3.0

    @property
    def von_mises(self) -> np.ndarray:
        """sqrt(3/2 s:s) of the deviator s, (m,) [Pa]."""
        deviator = self.tensor + self.pressure[:, None, None] * np.eye(3)
        return np.sqrt(1.5 * np.sum(deviator**2, axis=(1, 2)))


def stress(tissue: Tissue, solution: ArrayLike) -> Stress:
    """Stress of each cell of linear tissue.

    Parameters
    ----------
    tissue : Tissue
        The tissue.
    solution : array_like, shape (n,)
        Displacement of all unknowns [m], of ``tissue.solve``.

    Returns
    -------
    Stress
        ``2 G eps + lambda (P div u) I`` of the mean strain of a cell. The mean of the projected dilatation ``P div u``
        is that of the dilatation, so that the pressure is that of the elements, free of the oscillation within a cell.

    Raises
    ------
    InputError
        If the solution has another size or is not finite.
    """
    values = checked_solution(tissue, solution)
    shear, lame = tissue.moduli()
    tensor = np.zeros((len(tissue.mesh.cells), 3, 3))
    for numbers, cells in tissue.elements.batches():
        strain = _mean_strain(cells, values, tissue.mesh.dimension)
        dilatation = np.trace(strain, axis1=1, axis2=2)
        normal = (lame[numbers] * dilatation)[:, None, None] * np.eye(3)
        tensor[numbers] = 2.0 * shear[numbers, None, None] * strain + normal
    if tissue.symmetry is Symmetry.PLANE_STRESS:
        tensor[:, 2, 2] = 0.0
    return Stress(tensor)


def checked_solution(tissue: Tissue, solution: ArrayLike) -> np.ndarray:
    """A solution as an array. Raises InputError if it has another size than the tissue or is not finite."""
    values = np.asarray(solution, dtype=float)
    if values.shape != (tissue.elements.count,) or not np.all(np.isfinite(values)):
        limit = f"must be finite, with {tissue.elements.count} displacements"
        step = "Give one column of what tissue.solve returned."
        raise InputError("solution", f"of shape {values.shape}", limit, next_step=step)
    return values


def _mean_strain(cells: Cells, solution: np.ndarray, dimension: int) -> np.ndarray:
    """Of each cell, (m, 3, 3)."""
    share = cells.weight / cells.weight.sum(axis=1, keepdims=True)
    components = np.einsum("mksq,km,mq->ms", cells.strain, solution[cells.dofs], share, optimize=True)
    components[:, 3:] *= np.sqrt(0.5)
    rows, columns = _ROWS[dimension], _COLUMNS[dimension]
    strain = np.zeros((len(components), 3, 3))
    strain[:, rows, columns] = components
    strain[:, columns, rows] = components
    return strain
