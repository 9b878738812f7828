# SPDX-License-Identifier: Apache-2.0
"""Large deformation of hyperelastic tissue: prescribed displacements and nodal forces in steps, each by Newton."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from ..elastic.elements import Symmetry
from ..elastic.factorisation import Factor
from ..elastic.stress import Stress, checked_solution
from ..elastic.supports import facets_of, unknowns_of
from ..elastic.tissue import BodyOptions, Tissue
from ..materials import Elastic, Hyperelastic, by_label
from ..mesh.mesh import Mesh
from .elements import HyperelasticElements, Moduli

Prescribed = Sequence[float | None] | Callable[[np.ndarray], ArrayLike]
"""Displacement of a boundary along each axis [m], None where it is free; or that of points (n, d) [m], with NaN."""
Progress = Callable[[int, float], None]
"""Called with the number of iterations and the share of the load that is reached."""

_MAX_ITERATIONS = 16  # of a step
_FEW_ITERATIONS = 6  # after which the next step is larger
_MAX_CUTS = 5  # of the length of an iteration
_MIN_STEP = 1e-3  # share of the load
_MAX_RATIO = 0.49999  # Poisson's, of the linear tissue
_CORRECTION = 1e-10  # of the largest displacement, below which the last iteration was one


@dataclass(frozen=True)
class HyperelasticSolution:
    """Outcome of ``HyperelasticTissue.solve``.

    Attributes
    ----------
    displacement : ndarray, shape (n,)
        Of all unknowns [m].
    forces : ndarray, shape (n,)
        On the body where it is held or moved, zero elsewhere [N].
    loads : ndarray, shape (s,)
        Share of the load at the end of each step; the last is 1.
    reactions : dict of str to ndarray, shape (s, d)
        Name of a boundary that is held or moved -> resultant of the forces on the body at the end of each step [N].
        Points of two boundaries count in both; of an axisymmetric body the radial one is summed around the axis.
    iterations : int
        Of all steps, those that were repeated included.
    """

    displacement: np.ndarray
    forces: np.ndarray
    loads: np.ndarray
    reactions: dict[str, np.ndarray]
    iterations: int


class HyperelasticTissue:
    """Tissue of large deformation, nearly incompressible, with elements that do not lock.

    Parameters
    ----------
    mesh : Mesh
        Of the undeformed body.
    materials : NeoHookean or MooneyRivlin, or dict of str to one
        One for all cells, or one for each label of the mesh.
    symmetry, supports, thickness, order : optional
        As of ``Tissue``; plane stress has no elements here. Supports alone must hold the body; where a displacement is
        prescribed, too, it replaces them.

    Attributes
    ----------
    tissue : Tissue
        The linear body of small strain: ``tissue.values_at(points)`` makes nodal forces, and
        ``tissue.displacement(solution, points)`` evaluates a displacement. Its Poisson's ratio is at most 0.49999.

    Raises
    ------
    InputError
        If a label has no material, the tissue can move as a rigid body, or a value does not fit.
    """

    def __init__(
        self,
        mesh: Mesh,
        materials: Hyperelastic | Mapping[str, Hyperelastic],
        **options: Unpack[BodyOptions],
    ):
        if options.get("symmetry") == Symmetry.PLANE_STRESS:
            step = "Use plane_strain, or a thin body in space with its faces free."
            raise InputError("symmetry", options["symmetry"], "is for small strain only", next_step=step)
        kinds = "nf.fe.NeoHookean(...) or nf.fe.MooneyRivlin(...)"
        self.mesh, self.materials = mesh, by_label(mesh.labels, materials, Hyperelastic, kinds)
        linear = {label: _linear(material) for label, material in self.materials.items()}
        self.tissue = Tissue(mesh, linear, **options)
        self.elements = HyperelasticElements(self.tissue.elements, _moduli(mesh, self.materials))

    def solve(
        self,
        *,
        displacements: Mapping[str, Prescribed] | None = None,
        forces: ArrayLike | None = None,
        steps: int = 1,
        tolerance: float = 1e-8,
        progress: Progress | None = None,
    ) -> HyperelasticSolution:
        """Displacement under a load that grows from zero.

        Parameters
        ----------
        displacements : dict, optional
            Name of a boundary -> displacement along each axis [m], None for an axis that stays free; or a function of
            points (n, d) [m] that returns displacements (n, d) [m], NaN where free.
        forces : array_like, shape (n,), optional
            Nodal forces that keep their direction [N], such as ``tissue.values_at(points).T @ forces``.
        steps : int, optional
            In which the load is applied; a step that does not converge is halved.
        tolerance : float, optional
            Norm of the forces out of balance, relative to that of loads and reactions.
        progress : callable, optional
            Called after each iteration with the number of iterations and the share of the load that is reached.

        Returns
        -------
        HyperelasticSolution

        Raises
        ------
        InputError
            If a boundary or a value does not fit, a cell is inverted, or the search does not converge; the last load
            that did is named.
        """
        if steps < 1 or not 0.0 < tolerance < 1.0:
            quantity, value = ("steps", steps) if steps < 1 else ("tolerance", tolerance)
            raise InputError(quantity, value, "must be 1 or more" if steps < 1 else "must be between 0 and 1")
        return _LoadPath(self, displacements or {}, self._checked_forces(forces), tolerance, progress).run(1.0 / steps)

    def stress(self, solution: ArrayLike) -> Stress:
        """Cauchy stress of each cell, of a displacement of all unknowns (n,) [m]."""
        return Stress(self.elements.cauchy(checked_solution(self.tissue, solution)))

    def _checked_forces(self, forces: ArrayLike | None) -> np.ndarray:
        if forces is None:
            return np.zeros(self.tissue.elements.count)
        array = np.asarray(forces, dtype=float)
        if array.shape != (self.tissue.elements.count,) or not np.all(np.isfinite(array)):
            limit = f"must be finite, with {self.tissue.elements.count} numbers"
            raise InputError("forces", f"of shape {array.shape}", limit)
        return array


class _LoadPath:
    """The load in steps."""

    def __init__(
        self,
        body: HyperelasticTissue,
        displacements: Mapping[str, Prescribed],
        forces: np.ndarray,
        tolerance: float,
        progress: Progress | None,
    ):
        self.elements, self.applied, self.tolerance, self.progress = body.elements, forces, tolerance, progress
        linear = body.tissue.elements
        unknowns = unknowns_of(linear)
        self.places, self.component = unknowns.places, unknowns.component
        moved, self.end = _prescribed(body.tissue, displacements, unknowns)
        self.free = np.flatnonzero(~(body.tissue.held | moved))
        names = [*(name for name, kind in body.tissue.supports.items() if kind != "free"), *displacements]
        self.boundaries = {name: linear.dofs.get_facet_dofs(facets_of(linear, name)).flatten() for name in names}
        self.iterations, self.share = 0, 0.0
        self.inverted = np.zeros(0, dtype=int)  # cells, at the last change that was tried

    def run(self, step: float) -> HyperelasticSolution:
        """All steps."""
        solution, largest = np.zeros(len(self.end)), step
        loads: list[float] = []
        forces: list[np.ndarray] = []
        while self.share < 1.0:
            target = 1.0 if self.share + step > 1.0 - 1e-9 else self.share + step
            begin = self.iterations
            found = self._step(solution, target)
            if found is None:
                step = 0.5 * (target - self.share)
                self._check_step(step)
                continue
            solution, self.share = found, target
            loads.append(target)
            forces.append(self._reaction(solution))
            step = min(2.0 * step, largest) if self.iterations - begin <= _FEW_ITERATIONS else step
        dimension = self.places.shape[1]
        rows = {
            name: np.array([np.bincount(self.component[at], row[at], dimension) for row in forces])
            for name, at in self.boundaries.items()
        }
        return HyperelasticSolution(
            displacement=solution, forces=forces[-1], loads=np.array(loads), reactions=rows, iterations=self.iterations
        )

    def _step(self, solution: np.ndarray, target: float) -> np.ndarray | None:
        """Displacement at a load, from that of the last; None if it does not converge."""
        found, moved = solution, (target - self.share) * self.end
        pressure = self.elements.pressure(found)
        forces = self.elements.forces(found)
        for _ in range(_MAX_ITERATIONS):
            self.iterations += 1
            tangent = self.elements.tangent(found, pressure)
            change = self._solved(tangent, target * self.applied - forces - tangent @ moved)
            if change is None:
                return None
            change += moved
            part = self._uninverted(found, change, bool(moved.any()))
            if not part:
                return None
            pressure += part * (self.elements.pressure(found, change) - pressure)
            found, moved = found + part * change, np.zeros_like(moved)
            forces = self.elements.forces(found)
            if self.progress:
                self.progress(self.iterations, self.share)
            if self._converged(forces, target) or np.abs(change).max() <= _CORRECTION * np.abs(found).max():
                return found
        return None

    def _solved(self, tangent, right: np.ndarray) -> np.ndarray | None:  # type: ignore[no-untyped-def]
        """Change of all unknowns; None if the tangent is singular."""
        free, change = self.free, np.zeros(len(right))
        if len(free):
            try:
                change[free] = Factor(tangent[free][:, free], self.places[free]).solve(right[free])
            except RuntimeError:  # of a singular matrix
                return None
        return change if np.all(np.isfinite(change)) else None

    def _uninverted(self, solution: np.ndarray, change: np.ndarray, whole: bool) -> float:
        """Part of a change that inverts no cell; 0 without one."""
        for part in 0.5 ** np.arange(1 if whole else _MAX_CUTS + 1):
            self.inverted = self.elements.inverted(solution + part * change)
            if not len(self.inverted):
                return float(part)
        return 0.0

    def _converged(self, forces: np.ndarray, target: float) -> bool:
        balance = (target * self.applied - forces)[self.free]
        reaction = np.delete(forces, self.free)
        scale = np.linalg.norm(reaction) + np.linalg.norm(target * self.applied[self.free])
        return bool(np.linalg.norm(balance) <= self.tolerance * scale)

    def _reaction(self, solution: np.ndarray) -> np.ndarray:
        forces = self.elements.forces(solution) - self.applied * self.share
        forces[self.free] = 0.0
        return forces

    def _check_step(self, step: float) -> None:
        if step >= _MIN_STEP:
            return
        reached = f"the last load that converged is {100.0 * self.share:.3g} % of the one asked for"
        if len(self.inverted):
            mesh, cell = self.elements.elements.mesh, self.inverted[0]
            centre = ", ".join(f"{1e3 * value:.3g}" for value in mesh.points[mesh.cells[cell]].mean(axis=0))
            advice = "Give a smaller load, or other cells there: quadrilaterals and hexahedra bear more."
            raise InputError(f"cell {cell}", f"inverted at ({centre}) mm", reached, next_step=advice)
        advice = "The body may buckle or fold: give a smaller load, other supports, or a finer mesh."
        raise InputError("search for balance", "not converging", reached, next_step=advice)


def _prescribed(tissue: Tissue, displacements: Mapping[str, Prescribed], unknowns) -> tuple[np.ndarray, np.ndarray]:  # type: ignore[no-untyped-def]
    """Which unknowns are prescribed, (n,) of bool, and their displacement, (n,) [m]."""
    elements = tissue.elements
    values = np.full(elements.count, np.nan)
    for name, given in displacements.items():
        numbers = elements.dofs.get_facet_dofs(facets_of(elements, name)).flatten()
        rows = _displacement_of(given, unknowns.places[numbers], name)
        row = rows[np.arange(len(numbers)), unknowns.component[numbers]]
        other = np.abs(row - values[numbers]) > 1e-9 * np.abs(row)
        if other.any():
            value = f"{1e3 * row[other][0]:.4g} mm and {1e3 * values[numbers][other][0]:.4g} mm"
            step = "Leave one of them free with None."
            raise InputError(f"displacement of a point of {name!r}", value, "by two boundaries", next_step=step)
        values[numbers] = np.where(np.isnan(row), values[numbers], row)
    if tissue.symmetry is Symmetry.AXISYMMETRIC:  # nothing leaves the axis
        values[(unknowns.component == 0) & (unknowns.places[:, 0] < 1e-9 * tissue.mesh.high[0])] = 0.0
    moved = np.isfinite(values)
    return moved, np.where(moved, values, 0.0)


def _displacement_of(given: Prescribed, places: np.ndarray, name: str) -> np.ndarray:
    """(n, d) [m], NaN where free."""
    if callable(given):
        rows = np.asarray(given(places), dtype=float)
    else:
        row = np.array([np.nan if each is None else each for each in given], dtype=float)
        rows = np.broadcast_to(row, (len(places), len(row)))
    if rows.shape != places.shape or np.any(np.isinf(rows)):
        limit = f"must have a finite number or None for each of {places.shape[1]} axes"
        raise InputError(f"displacement of {name!r}", f"of shape {rows.shape[1:]}", limit, next_step="Give it in m.")
    return rows


def _linear(material: Hyperelastic) -> Elastic:
    shear, bulk = material.shear_modulus, material.bulk_modulus
    ratio = min(max((3.0 * bulk - 2.0 * shear) / (6.0 * bulk + 2.0 * shear), 0.0), _MAX_RATIO)
    return Elastic(2.0 * shear * (1.0 + ratio), ratio)


def _moduli(mesh: Mesh, materials: Mapping[str, Hyperelastic]) -> Moduli:
    labels, numbers = np.unique(mesh.labels.astype(str), return_inverse=True)
    of = [materials[str(label)] for label in labels]
    c10, c01 = np.array([each.coefficients for each in of]).T
    shear, bulk = (np.array([getattr(each, name) for each in of]) for name in ("shear_modulus", "bulk_modulus"))
    return Moduli(c10=c10[numbers], c01=c01[numbers], shear=shear[numbers], bulk=bulk[numbers])
