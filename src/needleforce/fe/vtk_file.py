# SPDX-License-Identifier: Apache-2.0
"""Solutions as VTU files, for ParaView: displacement of points, stress and label of cells."""

import os
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..files import atomic_write
from .elastic.stress import Stress, checked_solution, stress
from .elastic.tissue import Tissue
from .mesh.mesh import Mesh, library


class Body(Protocol):
    """A nonlinear body, such as ``HyperelasticTissue``."""

    mesh: Mesh
    tissue: Tissue

    def stress(self, solution: ArrayLike) -> Stress:
        """Stress of each cell [Pa]."""
        ...


def write_vtk(path: str | os.PathLike, tissue: Tissue | Body, solution: ArrayLike) -> dict[int, str]:
    """Write a solution for ParaView.

    Points have ``displacement`` [m]. Cells have ``stress`` (nine components, [Pa]), ``von_mises`` and ``pressure``
    [Pa], and ``label``, a number. Vectors and tensors have three axes: those of the mesh, and in the plane the third
    is across it, so that the depth is y.

    Parameters
    ----------
    path : str or os.PathLike
        The file, ``.vtu``. It is replaced when it is complete.
    tissue : Tissue or HyperelasticTissue
        What was solved.
    solution : array_like, shape (n,)
        Displacement of all unknowns [m]; of elements of second order the corners of cells are written.

    Returns
    -------
    dict of int to str
        The label of each number, as ``read_mesh`` takes it.

    Raises
    ------
    InputError
        If the ending is another, the solution does not fit, the package meshio is missing, or the file cannot be
        written.
    """
    if Path(path).suffix.lower() != ".vtu":
        raise InputError("ending of the file", Path(path).suffix or "missing", "must be .vtu", str(path))
    linear = tissue if isinstance(tissue, Tissue) else tissue.tissue
    values = checked_solution(linear, solution)
    cells = stress(linear, values) if isinstance(tissue, Tissue) else tissue.stress(values)
    labels, numbers = np.unique(tissue.mesh.labels.astype(str), return_inverse=True)
    content = library("meshio").Mesh(
        _three(tissue.mesh.points), [(tissue.mesh.shape, tissue.mesh.cells)],
        point_data={"displacement": _three(values[linear.elements.dofs.nodal_dofs].T)},
        cell_data={
            "label": [numbers.astype(np.int32)], "stress": [cells.tensor.reshape(-1, 9)],
            "von_mises": [cells.von_mises], "pressure": [cells.pressure],
        },
    )  # fmt: skip
    with TemporaryDirectory() as folder, atomic_write(path) as file:  # meshio wants a name
        content.write(Path(folder) / "part.vtu")
        file.buffer.write((Path(folder) / "part.vtu").read_bytes())
    return {number: str(label) for number, label in enumerate(labels)}


def _three(rows: np.ndarray) -> np.ndarray:
    """Rows with three coordinates."""
    return np.pad(rows, ((0, 0), (0, 3 - rows.shape[1])))
