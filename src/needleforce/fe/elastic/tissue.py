# SPDX-License-Identifier: Apache-2.0
"""A solid of tissue: mesh, materials and supports; displacements for forces."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import TypedDict

import numpy as np
from numpy.typing import ArrayLike

from ...checks import PLACE, above_zero, in_range, instance_of
from ...errors import InputError
from ..materials import Elastic, by_label
from ..mesh.mesh import Mesh
from .condensed import CondensedTissue, condensed
from .elements import Elements, Symmetry
from .factorisation import Factor
from .needle_path import NeedlePath
from .supports import held, unknowns_of

_INSIDE = "Give it in m in the frame of the mesh, or a larger mesh."
_MAX_RATIO_SIMPLEX = 0.45  # of triangles and tetrahedra of first order


class BodyOptions(TypedDict, total=False):
    """What every body has in addition to mesh and materials, as the keywords of ``Tissue``."""

    symmetry: str | None
    supports: Mapping[str, str] | None
    thickness: float
    order: int | None


class Tissue:
    """Linear elastic tissue.

    Parameters
    ----------
    mesh : Mesh
        Of ``block``, ``axisymmetric_block``, ``read_mesh``, or points and cells.
    materials : Elastic or dict of str to Elastic
        One for all cells, or one for each label of the mesh.
    symmetry : str, optional
        ``"axisymmetric"``, ``"plane_strain"`` or ``"plane_stress"`` of a mesh in the plane, which must be stated;
        ``"solid"`` of one in space.
    supports : dict of str to str, optional
        ``"fixed"``, ``"sliding"`` or ``"free"`` for ``"top"``, ``"bottom"``, ``"sides"`` and the boundaries of the
        mesh; what is not named is free. Default: the bottom is fixed, as on a base.
    thickness : float, optional
        Of a plane body [m].
    order : int, optional
        Of the elements: 1 or 2. Default 2, for hexahedra 1. Triangles and tetrahedra of first order lock: they are
        refused above a Poisson ratio of 0.45.

    Raises
    ------
    InputError
        If a label has no material, the tissue can move as a rigid body, or a value does not fit.
    """

    def __init__(
        self,
        mesh: Mesh,
        materials: Elastic | Mapping[str, Elastic],
        *,
        symmetry: str | None = None,
        supports: Mapping[str, str] | None = None,
        thickness: float = 1.0,
        order: int | None = None,
    ):
        self.mesh = mesh
        self.materials = by_label(mesh.labels, materials, Elastic, "nf.fe.Elastic(young_modulus, poisson_ratio)")
        self.symmetry = _symmetry(mesh, symmetry)
        self.supports = dict({"bottom": "fixed"} if supports is None else supports)
        in_range("thickness", above_zero("thickness", thickness, "m"), PLACE, "Give it in m.", ())
        self.elements = Elements(mesh, self.symmetry, _order(mesh, order, self.materials), thickness)
        self.held = held(self.elements, self.supports)

    @property
    def options(self) -> BodyOptions:
        """The keywords with which the same body is made of other materials."""
        thickness, order = self.elements.thickness, self.elements.order
        return {"symmetry": self.symmetry, "supports": self.supports, "thickness": thickness, "order": order}

    def with_materials(self, materials: Elastic | Mapping[str, Elastic]) -> "Tissue":
        """The same body of other materials."""
        return Tissue(self.mesh, materials, **self.options)

    def scaled(self, factors: Mapping[str, float]) -> "Tissue":
        """The same body with Young's moduli times a factor by label, 1 where none is given."""
        moduli = {label: each.young_modulus * float(factors.get(label, 1.0)) for label, each in self.materials.items()}
        return self.with_materials(
            {label: replace(each, young_modulus=moduli[label]) for label, each in self.materials.items()}
        )

    @property
    def unknowns(self) -> int:
        """Number of unknown displacements."""
        return int((~self.held).sum())

    @cached_property
    def stiffness(self):  # type: ignore[no-untyped-def]
        """Stiffness of all unknowns, held ones included, sparse [N/m]."""
        shear, lame = self.moduli()
        return self.elements.stiffness(shear, lame)

    @cached_property
    def factor(self) -> Factor:
        """Of the stiffness of the free unknowns."""
        free = np.flatnonzero(~self.held)
        return Factor(self.stiffness[free][:, free], unknowns_of(self.elements).places[free])

    def solve(self, forces: ArrayLike) -> np.ndarray:
        """Displacements for nodal forces.

        Parameters
        ----------
        forces : array_like, shape (n,) or (n, k)
            Conjugate to the unknowns [N], such as ``tissue.at(point, direction)``.

        Returns
        -------
        ndarray
            Displacements of all unknowns [m], zero where held.
        """
        forces = np.asarray(forces, dtype=float)
        if forces.shape[0] != self.elements.count or not np.all(np.isfinite(forces)):
            limit = f"must be finite, with {self.elements.count} rows"
            raise InputError("forces", f"of shape {forces.shape}", limit)
        solution = np.zeros_like(forces)
        solution[~self.held] = self.factor.solve(forces[~self.held])
        return solution

    def displacement(self, solution: np.ndarray, points: ArrayLike) -> np.ndarray:
        """Displacement at points (n, d) [m] of a solution of ``solve``, (n, d) [m]."""
        places = np.atleast_2d(np.asarray(points, dtype=float))
        return (self.values_at(places) @ solution).reshape(places.shape[1], len(places)).T

    def condense(self, path: NeedlePath) -> CondensedTissue:
        """Condense onto a needle's path: what the loop needs of this solid.

        Parameters
        ----------
        path : NeedlePath
            In the mesh, with 2 to 64 nodes.

        Returns
        -------
        CondensedTissue
            Compliance between the nodes of the path, for ``nf.fe.CondensedInsertion``.

        Raises
        ------
        InputError
            If the path leaves the mesh or has too many nodes, or a layer on it is thinner than the needle.
        """
        return condensed(self, path)

    def values_at(self, points: np.ndarray):  # type: ignore[no-untyped-def]
        """Matrix from unknowns to displacements at points (n, d), sparse: x of all points, then y, then z.

        Its transpose gives nodal forces for forces at the points.
        """
        for point in points[~self.mesh.within(points)]:
            raise self._outside(point)
        try:
            return self.elements.at(points)
        except ValueError:  # of a mesh that is no box
            for point in points:
                self._check_inside(point)
            raise InputError("points", "outside", "the mesh") from None

    def _check_inside(self, point: np.ndarray) -> None:
        try:
            self.elements.at(point[None])
        except ValueError:
            raise self._outside(point) from None

    def _outside(self, point: np.ndarray) -> InputError:
        place = ", ".join(f"{1e3 * each:.4g}" for each in point)
        low, high = ([f"{1e3 * each:.4g}" for each in end] for end in (self.mesh.low, self.mesh.high))
        limit = f"is outside the mesh, which extends over ({', '.join(f'{a} to {b}' for a, b in zip(low, high))}) mm"
        return InputError("point", f"({place}) mm", limit, next_step=_INSIDE)

    def moduli(self) -> tuple[np.ndarray, np.ndarray]:
        """Shear and Lamé modulus of each cell [Pa]."""
        labels, numbers = np.unique(self.mesh.labels.astype(str), return_inverse=True)
        shear = np.array([self.materials[label].shear_modulus for label in labels])
        lame = np.array([self.materials[label].lame_modulus for label in labels])
        if self.symmetry is Symmetry.PLANE_STRESS:
            lame = 2.0 * shear * lame / (lame + 2.0 * shear)
        return shear[numbers], lame[numbers]


def check_kinds(tissue: object, path: object) -> None:
    """Raise InputError for what is no tissue or no path."""
    instance_of("tissue", tissue, Tissue, "Give an fe.Tissue.")
    instance_of("path", path, NeedlePath, "Give an fe.NeedlePath.")


def _symmetry(mesh: Mesh, symmetry: str | None) -> Symmetry:
    if mesh.dimension == 3:
        allowed = [Symmetry.SOLID]
    else:
        allowed = [Symmetry.AXISYMMETRIC, Symmetry.PLANE_STRAIN, Symmetry.PLANE_STRESS]
    if symmetry is None and len(allowed) == 1:
        return allowed[0]
    if symmetry not in list(allowed):
        limit = f"must be {' or '.join(allowed)} for a mesh of {mesh.dimension} coordinates"
        raise InputError("symmetry", symmetry, limit)
    if symmetry == Symmetry.AXISYMMETRIC and mesh.low[0] < 0.0:
        raise InputError("radius", f"{1e3 * mesh.low[0]:.3g} mm", "must not be below 0 in an axisymmetric mesh")
    return Symmetry(symmetry)


def _order(mesh: Mesh, order: int | None, materials: Mapping[str, Elastic]) -> int:
    if order is None:
        return 1 if mesh.shape == "hexahedron" else 2
    if order not in (1, 2):
        raise InputError("order", order, "must be 1 or 2")
    ratio = max(material.poisson_ratio for material in materials.values())
    if order == 1 and mesh.shape in ("triangle", "tetra") and ratio > _MAX_RATIO_SIMPLEX:
        limit = f"locks at a Poisson ratio of {ratio:g} in cells of shape {mesh.shape}"
        raise InputError("order", order, limit, next_step="Use order=2, or a Poisson ratio of at most 0.45.")
    return order
