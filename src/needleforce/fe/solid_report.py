# SPDX-License-Identifier: Apache-2.0
"""What a report of a solid states: mesh, materials, supports, path, extremes, the force on the tissue."""

import os
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..display.quantities import plain
from ..errors import InputError
from .elastic.needle_path import NeedlePath
from .elastic.supports import unknowns_of
from .elastic.tissue import Tissue
from .section import Field, Section, section

Rows = list[tuple[str, ...]]


@dataclass(frozen=True, eq=False)
class SolidFacts:
    """Of one solved solid.

    Attributes
    ----------
    shown : Section
        What the pictures show.
    path : NeedlePath or None
        The needle that is drawn.
    tip : float or None
        How far it is along its path [m].
    solid, materials, supports : list of tuple of str
        Rows of tables: name and value; label, modulus, Poisson ratio, density and cells; boundary and support.
    force : float
        Of all loads on the tissue, along the depth [N].
    depth, base_force : ndarray, shape (n,), or None
        Of an insertion [m], [N].
    """

    shown: Section
    path: NeedlePath | None
    tip: float | None
    solid: Rows
    materials: Rows
    supports: Rows
    force: float
    depth: np.ndarray | None
    base_force: np.ndarray | None

    @property
    def displacement(self) -> Field:
        """Along the needle."""
        return self.shown.field("displacement")

    @property
    def von_mises(self) -> Field:
        """Von Mises stress."""
        return self.shown.field("von_mises")


def report(
    file: str | os.PathLike,
    tissue: Tissue,
    solution: ArrayLike,
    path: NeedlePath | None = None,
    *,
    tip: float | None = None,
    depth: ArrayLike | None = None,
    force: ArrayLike | None = None,
    title: str = "Tissue around a needle",
) -> None:
    """Write a solved solid as one HTML file that opens offline.

    It has pictures of displacement and stress, the surface around the needle, force over depth of an insertion, and
    tables of mesh, materials, supports and path.

    Parameters
    ----------
    file : str or os.PathLike
        The file to write; nothing is written if the page cannot be made.
    tissue : Tissue
        What was solved.
    solution : array_like, shape (n,)
        Displacement of all unknowns [m], of ``tissue.solve``.
    path : NeedlePath, optional
        The needle that is drawn.
    tip : float, optional
        How far the needle is along its path [m]; to its end by default.
    depth, force : array_like, shape (n,), optional
        Of an insertion, such as that of ``CondensedInsertion`` [m], [N]; both or none.
    title : str
        Title of the page.

    Raises
    ------
    InputError
        If the solution does not fit, depth and force are not of one length, or the file cannot be written.
    """
    found = facts(tissue, solution, path, tip=tip, depth=depth, force=force)
    from ..files import atomic_write
    from ..report.solid_page import solid_page  # loads matplotlib, which importing needleforce.fe must not do

    text = solid_page(found, title)
    with atomic_write(file) as opened:
        opened.write(text)


def facts(
    tissue: Tissue,
    solution: ArrayLike,
    path: NeedlePath | None = None,
    *,
    tip: float | None = None,
    depth: ArrayLike | None = None,
    force: ArrayLike | None = None,
) -> SolidFacts:
    """What ``report`` shows; parameters as there."""
    depths, forces = _insertion(depth, force)
    shown = section(tissue, solution, path)
    return SolidFacts(
        shown=shown, path=path, tip=tip, solid=[*_solid(tissue), *_path(tissue, path, tip)],
        materials=_materials(tissue), supports=_supports(tissue), force=_force(tissue, np.asarray(solution)),
        depth=depths, base_force=forces,
    )  # fmt: skip


def _insertion(depth: ArrayLike | None, force: ArrayLike | None) -> tuple[np.ndarray | None, np.ndarray | None]:
    if depth is None and force is None:
        return None, None
    if depth is None or force is None:
        missing = "depth" if depth is None else "force"
        raise InputError(missing, "missing", "of the insertion", next_step="Give both, or none.")
    arrays = np.asarray(depth, dtype=float), np.asarray(force, dtype=float)
    if arrays[0].ndim != 1 or arrays[0].shape != arrays[1].shape or len(arrays[0]) < 2:
        limit = f"must be as long as depth, {arrays[0].shape}, and have one row of two values or more"
        raise InputError("force of the insertion", f"of shape {arrays[1].shape}", limit, next_step="Give both (n,).")
    return arrays


def _force(tissue: Tissue, solution: np.ndarray) -> float:
    """Of the loads on unknowns that are not held, along the depth."""
    loads = tissue.stiffness @ solution
    vertical = unknowns_of(tissue.elements).component == tissue.mesh.dimension - 1
    return float(loads[vertical & ~tissue.held].sum())


def _solid(tissue: Tissue) -> Rows:
    mesh, order = tissue.mesh, {1: "first", 2: "second"}[tissue.elements.order]
    sizes = " × ".join(f"{1e3 * size:.4g}" for size in np.ptp(mesh.points, axis=0))
    across = "r" if tissue.symmetry == "axisymmetric" else "x" if mesh.dimension == 2 else "x × y"
    edges = np.ptp(mesh.points[mesh.cells], axis=1)
    rows = [
        ("symmetry", str(tissue.symmetry).replace("_", " ")),
        ("size", f"{sizes} mm ({across} × depth)"),
        ("cells", f"{len(mesh.cells)} of shape {mesh.shape} and {order} order"),
        ("shortest and longest side of a cell", f"{1e3 * edges.min():.3g} mm, {1e3 * edges.max():.3g} mm"),
        ("unknown displacements", f"{tissue.unknowns}"),
    ]
    if tissue.symmetry in ("plane_strain", "plane_stress"):
        rows.append(("thickness", plain(tissue.elements.thickness, "m")))
    return rows


def _path(tissue: Tissue, path: NeedlePath | None, tip: float | None) -> Rows:
    if path is None:
        return []
    dimension = tissue.mesh.dimension
    entry = ", ".join(f"{1e3 * each:.4g}" for each in path.start(dimension)[:-1])
    along = ", ".join(f"{each:.3g}" for each in path.along(dimension))
    return [
        ("radius of the needle", plain(path.radius, "m")),
        ("path", f"{1e3 * path.depth:.4g} mm with {len(path.nodes)} nodes {1e3 * path.nodes[1]:.4g} mm apart"),
        ("entry and direction", f"({entry}) mm, ({along})"),
        ("tip", plain(path.depth if tip is None else tip, "m")),
    ]


def _materials(tissue: Tissue) -> Rows:
    labels = tissue.mesh.labels.astype(str)
    return [
        (
            label, plain(each.young_modulus, "Pa"), f"{each.poisson_ratio:g}", f"{each.density:g} kg/m³",
            str(int(np.sum(labels == label))),
        )
        for label, each in tissue.materials.items()
    ]  # fmt: skip


def _supports(tissue: Tissue) -> Rows:
    rows = [(name, str(kind)) for name, kind in tissue.supports.items()]
    free = [name for name in ("top", "bottom", "sides") if name not in tissue.supports]
    return rows + [(name, "free") for name in free]
