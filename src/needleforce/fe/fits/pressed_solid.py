# SPDX-License-Identifier: Apache-2.0
"""A hyperelastic solid under a plate or a flat end: its stiffness by indentation, the numbers of its moduli that are
found, and what a linear solid and closed forms make of the curve."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...checks import instance_of
from ...core import tips
from ...errors import InputError
from ...identification.contact_search import MIN_IN_CONTACT, ContactSearch
from ...identification.one_layer.deformation_fit import FLIP_SIGN
from ..elastic.elements import Symmetry
from ..elastic.factorisation import Factor
from ..elastic.supports import facets_of, unknowns_of
from ..hyperelastic.tissue import HyperelasticTissue
from ..materials import Hyperelastic, MooneyRivlin, NeoHookean, check_labels
from ..mesh.mesh import library

_MIN_STEPS = 4


class PressedSolid:
    """A solid and the boundary that is pressed into it: the top, or a boundary of the mesh that is a part of it.

    ``bonded`` is whether its points keep their place across; without, they slide. The stiffness is solved at ``steps``
    depths, 4 or more. ``area`` is that of the boundary [m^2], ``radius`` that of a circle as large [m]. Raises
    InputError if the boundary is unknown or not on the surface, or the solid is another.
    """

    def __init__(self, tissue: HyperelasticTissue, boundary: str, *, bonded: bool, steps: int):
        instance_of("tissue", tissue, HyperelasticTissue, "Use nf.fe.fit_modulus for linear tissue.")
        if steps < _MIN_STEPS:
            raise InputError("steps", steps, f"must be {_MIN_STEPS} or more", next_step="Use 10.")
        self.tissue, self.boundary, self.bonded, self.steps = tissue, boundary, bonded, steps
        self.mesh, self.elements = tissue.mesh.skfem, tissue.tissue.elements
        self.facets, self.height = facets_of(self.elements, boundary), float(np.ptp(tissue.mesh.points[:, -1]))
        corners = self.mesh.p[:, self.mesh.facets[:, self.facets]]
        self.reach = corners[0].min(), corners[0].max()  # along the first axis [m]
        if corners[-1].max() > tissue.mesh.low[-1] + 1e-6 * self.height:
            value = f"{1e3 * corners[-1].min():.3g} to {1e3 * corners[-1].max():.3g} mm deep"
            step = "Give facets of the top, which is at the least depth."
            raise InputError(f"boundary {boundary!r}", value, "is not on the surface", next_step=step)
        self.area = self._area()
        self.radius = float(np.sqrt(self.area / np.pi))  # of a circle that is as large [m]

    def _area(self) -> float:
        """Of the boundary [m^2]."""
        basis = library().FacetBasis(self.mesh, self.elements.element, facets=self.facets, intorder=2)
        if self.elements.symmetry is Symmetry.AXISYMMETRIC:
            return float(np.sum(2.0 * np.pi * np.asarray(basis.global_coordinates())[0] * basis.dx))
        return float(basis.dx.sum()) * (self.elements.thickness if self.tissue.mesh.dimension == 2 else 1.0)

    def closed_form(self, slope: float) -> tuple[str, float]:
        """Name and Young's modulus [Pa], from a force by depth [N/m]."""
        if set(self.facets) == set(facets_of(self.elements, "top")):
            return "uniform compression", slope * self.height / self.area
        around = self.elements.symmetry is Symmetry.AXISYMMETRIC
        if not around or abs(self.reach[1] - self.radius) > 1e-6 * self.radius:  # not a full circle
            return "none", float("nan")
        label = str(self.tissue.mesh.labels[self.mesh.f2t[0, self.facets[0]]])
        ratio = self.tissue.tissue.materials[label].poisson_ratio
        return "half-space", (1.0 - ratio**2) * slope / (2.0 * self.radius)

    def stiffness(self, materials: Mapping[str, Hyperelastic], deepest: float) -> Any:
        """Logarithm of force by indentation [N/m] as a function of indentations (n,), at least 0 [m], solved up to the
        deepest and beyond it a line, for the materials of all labels. Raises InputError if there is no solution; the
        last depth that was reached is named."""
        from scipy.interpolate import CubicSpline

        linear, reached = self.tissue.tissue, [0.0]
        body = HyperelasticTissue(linear.mesh, materials, **linear.options)
        motion = (*[0.0 if self.bonded else None] * (self.tissue.mesh.dimension - 1), deepest)
        try:
            found = body.solve(
                displacements={self.boundary: motion},
                steps=self.steps,
                progress=lambda _, share: reached.append(deepest * share),
            )
        except InputError as error:
            raise self._unsolved(error, deepest, reached[-1]) from error
        depths, forces = deepest * found.loads, found.reactions[self.boundary][:, -1]
        spline = CubicSpline(np.append(0.0, depths), np.log(np.append(self.at_rest(body), forces / depths)))
        slope = float(spline(deepest, 1))
        return lambda at: spline(np.minimum(at, deepest)) + slope * np.maximum(at - deepest, 0.0)

    def at_rest(self, body: HyperelasticTissue) -> float:
        """Force by indentation of the linear solid [N/m]."""
        linear, unknowns = body.tissue, unknowns_of(self.elements)
        pressed = self.elements.dofs.get_facet_dofs(self.facets).flatten()
        downwards = pressed[unknowns.component[pressed] == linear.mesh.dimension - 1]
        solution, fixed = np.zeros(self.elements.count), linear.held.copy()
        fixed[pressed if self.bonded else downwards] = True
        solution[downwards] = 1.0
        free = np.flatnonzero(~fixed)
        force = -(linear.stiffness @ solution)[free]
        if len(free):
            solution[free] = Factor(linear.stiffness[free][:, free], unknowns.places[free]).solve(force)
        return float(np.sum((linear.stiffness @ solution)[downwards]))

    def _unsolved(self, error: InputError, deepest: float, reached: float) -> InputError:
        limit = f"the solid has no solution there ({error.quantity} is {error.value}); the last depth reached is"
        limit += f" {1e3 * reached:.3g} mm, {100.0 * reached / self.height:.3g} % of the height"
        step = "Give the curve up to there, with contact_depth if it is known, or a mesh of other cells."
        return InputError("indentation", f"{1e3 * deepest:.3g} mm", limit, next_step=step)


class StraightLine:
    """The straight line of the linear solid: force without contact, then a slope."""

    def __init__(self, depth: np.ndarray, force: np.ndarray, *, radius: float, given: float | None):
        self.depth, self.force, self.given = depth, force, given
        zero = float(depth.min())
        search = ContactSearch(depth - zero, force, np.ones((1, len(depth))), tips.Flat(radius=radius), None)
        place = search.best() if given is None else given - zero
        if not (np.isfinite(place) and (depth > zero + place).sum() > MIN_IN_CONTACT):
            limit = f"more than {MIN_IN_CONTACT} samples must be deeper"
            raise InputError("contact depth", f"{1e3 * (zero + place):.4g} mm", limit, next_step="Give a deeper curve.")
        modulus = search.modulus(place)
        if not modulus > 0.0:
            raise InputError("force", "not rising with depth", "no contact was found", next_step=FLIP_SIGN)
        unit = search.unit_force(place)[0]
        self.slope = 2.0 * modulus * radius  # [N/m]
        self.contact, self.zero = zero + place, float(np.mean(force - modulus * unit))  # [m], [N]
        self.rmse = float(np.std(force - modulus * unit))


_STEP = 0.05  # of the logarithm of a modulus, or of the share of c01, in a derivative


class HyperelasticParameters:
    """Numbers that a fit finds: logarithms of factors of moduli, then the share of c01 in c10 + c01, if searched: one
    for all Mooney-Rivlin materials that are found.

    ``labels`` are those with a factor of their own, the others keep theirs; none for one factor of all. ``found`` are
    the labels whose moduli are found, ``count`` and ``scales`` the numbers of all and of the factors. ``common`` is the
    last factor if all moduli have one: their derivatives of the logarithm of a force add up to 1. ``exact`` is whether
    one factor of all is the only number: the force is proportional to it.

    Raises InputError if a label is unknown, or no material that is found is Mooney-Rivlin where c01 is searched.
    """

    def __init__(self, start: Mapping[str, Hyperelastic], labels: tuple[str, ...], find_c01: bool):
        self.start, self.labels, self.find_c01 = start, labels, find_c01
        check_labels(labels, self.start)
        self.found = labels or tuple(self.start)
        found = [self.start[label] for label in self.found]
        self.shares = [_share(each) for each in found if isinstance(each, MooneyRivlin)]
        if find_c01 and not self.shares:
            step = "Give nf.fe.MooneyRivlin(c10, c01) to the tissue."
            raise InputError("find_c01", True, "no material that is found is Mooney-Rivlin", next_step=step)
        self.scales = max(len(labels), 1)
        self.count = self.scales + find_c01
        together = set(self.found) == set(self.start)
        self.common = self.scales - 1 if together else None
        self.exact = together and self.count == 1

    def beginning(self, factor: float) -> np.ndarray:
        """All moduli by one factor, and the share that is given."""
        share = [np.mean(self.shares)] if self.find_c01 else []
        return self.stable(np.append(np.full(self.scales, np.log(factor)), share))

    def stable(self, numbers: np.ndarray) -> np.ndarray:
        """The share of c01 within 0 to 1, where a material is stable at any stretch."""
        return np.append(numbers[: self.scales], np.clip(numbers[self.scales :], 0.0, 1.0))

    def step(self, numbers: np.ndarray, k: int) -> np.ndarray:
        """Change for a derivative by one number; of a share, inwards."""
        inwards = -1.0 if k >= self.scales and numbers[k] > 0.5 else 1.0
        return inwards * _STEP * (np.arange(self.count) == k)

    def index(self, label: str) -> int:
        """Number of the factor of a label that is found."""
        return self.labels.index(label) if self.labels else 0

    def materials(self, numbers: np.ndarray) -> dict[str, Hyperelastic]:
        """Of all labels."""
        share = float(numbers[self.scales]) if self.find_c01 else None
        return {
            label: _changed(each, float(np.exp(numbers[self.index(label)])), share) if label in self.found else each
            for label, each in self.start.items()
        }


def _share(material: MooneyRivlin) -> float:
    return material.c01 / (material.c10 + material.c01)


def _changed(material: Hyperelastic, factor: float, share: float | None) -> Hyperelastic:
    bulk = factor * material.bulk_modulus
    if isinstance(material, NeoHookean):
        return NeoHookean(factor * material.shear_modulus, bulk)
    total = factor * (material.c10 + material.c01)
    share = _share(material) if share is None else share
    return MooneyRivlin((1.0 - share) * total, share * total, bulk)


def young_modulus(material: Hyperelastic) -> float:
    """At small strain [Pa]."""
    shear, bulk = material.shear_modulus, material.bulk_modulus
    return 9.0 * bulk * shear / (3.0 * bulk + shear)
