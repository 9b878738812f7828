# SPDX-License-Identifier: Apache-2.0
"""Elements against closed forms: patch tests on distorted meshes, Lamé, Kelvin, orders of convergence, no locking."""

import sys
from pathlib import Path

import numpy as np
import pytest
from closed_forms import ring_displacement

from needleforce import fe
from needleforce.fe.elastic.factorisation import Factor
from needleforce.fe.elastic.supports import unknowns_of
from needleforce.fe.mesh.block import graded_lines

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import reference

VALUES = {each["name"]: each for each in reference.load(reference.FILE.with_name("reference_values_deflection.json"))}
KUHN = ([0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6])


def distorted(mesh, size=1e-3, seed=0):
    """The mesh with inner points moved at random by up to a fifth of a cell."""
    inner = np.all((mesh.points > mesh.low + 1e-9) & (mesh.points < mesh.high - 1e-9), axis=1)
    points = mesh.points.copy()
    points[inner] += np.random.default_rng(seed).uniform(-0.2 * size, 0.2 * size, (inner.sum(), mesh.dimension))
    return fe.Mesh(points, mesh.cells, mesh.shape, mesh.labels)


def triangles(mesh):
    cells = np.concatenate([mesh.cells[:, [0, 1, 2]], mesh.cells[:, [0, 2, 3]]])
    return fe.Mesh(mesh.points, cells, "triangle")


def tetrahedra(mesh):
    return fe.Mesh(mesh.points, np.concatenate([mesh.cells[:, corners] for corners in KUHN]), "tetra")


SQUARE = fe.block((5e-3, 5e-3), 1e-3, growth=0.0)
CUBE = fe.block((4e-3, 4e-3, 4e-3), 1e-3, growth=0.0)
TUBE = fe.axisymmetric_block(5e-3, 5e-3, 1e-3, growth=0.0)
PATCHES = {
    "quad 1": (distorted(SQUARE), "plane_strain", 1),
    "quad 2": (distorted(SQUARE), "plane_strain", 2),
    "quad 2, plane stress": (distorted(SQUARE), "plane_stress", 2),
    "triangle 2": (triangles(distorted(SQUARE)), "plane_strain", 2),
    "hexahedron 1": (distorted(CUBE), "solid", 1),
    "hexahedron 2": (distorted(CUBE), "solid", 2),
    "tetra 2": (tetrahedra(distorted(CUBE)), "solid", 2),
    "axisymmetric 1": (distorted(TUBE), "axisymmetric", 1),
    "axisymmetric 2": (distorted(TUBE), "axisymmetric", 2),
}


@pytest.mark.parametrize("mesh, symmetry, order", PATCHES.values(), ids=PATCHES)
@pytest.mark.parametrize("ratio", [0.0, 0.3, 0.4999])
def test_a_patch_of_any_shape_has_an_even_strain(mesh, symmetry, order, ratio):
    held = dict.fromkeys(("top", "bottom", "sides"), "fixed")
    tissue = fe.Tissue(mesh, fe.Elastic(10e3, ratio), symmetry=symmetry, supports=held, order=order)
    gradient = np.random.default_rng(1).normal(0.0, 1e-2, (mesh.dimension, mesh.dimension))
    if symmetry == "axisymmetric":
        gradient = np.diag([0.01, -0.03])
    unknowns = unknowns_of(tissue.elements)
    exact = np.take_along_axis(unknowns.places @ gradient.T, unknowns.component[:, None], 1)[:, 0]
    forces = -(tissue.stiffness @ np.where(tissue.held, exact, 0.0))[~tissue.held]
    inside = Factor(tissue.stiffness[~tissue.held][:, ~tissue.held], unknowns.places[~tissue.held]).solve(forces)
    np.testing.assert_allclose(inside, exact[~tissue.held], atol=1e-11 * np.abs(exact).max())


A, B, PRESSURE, YOUNG = 1.0, 3.0, 100.0, 10e3


def ring(cells, order, ratio):
    """Displacement of the inner face of a thick ring under pressure, in plane strain."""
    mesh = fe.grid([np.linspace(A, B, cells + 1), np.linspace(0.0, 0.5, 2)])
    supports = {"top": "sliding", "bottom": "sliding"}
    tissue = fe.Tissue(mesh, fe.Elastic(YOUNG, ratio), symmetry="axisymmetric", supports=supports, order=order)
    at, weights = np.polynomial.legendre.leggauss(3)
    places = np.column_stack([np.full(3, A), 0.25 * (1.0 + at)])
    pushes = np.concatenate([2.0 * np.pi * A * PRESSURE * 0.25 * weights, np.zeros(3)])
    solution = tissue.solve(tissue.values_at(places).T @ pushes)
    return tissue.displacement(solution, [[A, 0.25]])[0, 0]


@pytest.mark.parametrize("order, rate", [(1, 2.0), (2, 4.0)])
@pytest.mark.parametrize("ratio", [0.3, 0.49, 0.49999])
def test_lame_s_ring_converges_as_the_order_promises_up_to_incompressible(order, rate, ratio):
    exact = ring_displacement(fe.Elastic(YOUNG, ratio), PRESSURE, A, B)
    errors = [abs(ring(cells, order, ratio) / exact - 1.0) for cells in (10, 20, 40)]
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(rates, rate, atol=0.2)


def test_lame_s_ring_has_its_reference_value():
    value = VALUES["lame_hole_plane_strain"]
    assert value["inputs"] == {"E": YOUNG, "nu": 0.49, "p": PRESSURE, "a": A, "b": B}
    assert ring(80, 2, 0.49) == pytest.approx(value["expected"], rel=1e-8)


def test_kelvin_s_line_force_has_its_reference_value():
    value = VALUES["kelvin_plane_strain_difference"]
    young, ratio, load, near, far = (value["inputs"][name] for name in ("E", "nu", "Q", "r1", "r2"))
    errors = []
    for cell in (1e-3, 5e-4, 2.5e-4):
        lines = [_about_zero(0.5, cell, 2e-3), _about_zero(0.5, cell, 2e-3)]
        tissue = fe.Tissue(
            fe.grid(lines), fe.Elastic(young, ratio), symmetry="plane_strain",
            supports=dict.fromkeys(("top", "bottom", "sides"), "fixed"),
        )  # fmt: skip
        forces = load * tissue.values_at(np.zeros((1, 2))).toarray()[0]
        moved = tissue.displacement(tissue.solve(forces), [[near, 0.0], [far, 0.0]])
        errors.append(moved[0, 0] - moved[1, 0] - value["expected"])
    assert abs(errors[-1]) < 1e-3 * value["expected"]
    assert abs(errors[-1]) < abs(errors[0])


def _about_zero(half, cell, fine):
    size = lambda x: cell + 0.15 * np.maximum(np.abs(x) - fine, 0.0)  # noqa: E731
    positive = graded_lines([0.0, 1e-3, 10e-3, half], size)
    return np.concatenate([-positive[:0:-1], positive])


@pytest.mark.parametrize("shape", ["quad", "triangle"])
def test_a_footing_on_incompressible_soil_does_not_lock(shape):
    # a mesh that locks is stiffer by a factor; these differ from one four times as fine by a percent
    def settlement(cells, ratio):
        line = np.linspace(0.0, 1.0, cells + 1)
        mesh = fe.grid([line, line])
        mesh = mesh if shape == "quad" else triangles(mesh)
        tissue = fe.Tissue(mesh, fe.Elastic(10e3, ratio), symmetry="plane_strain")
        at = (np.arange(400) + 0.5) / 800 + 0.25
        forces = tissue.values_at(np.column_stack([at, np.zeros(400)])).T @ np.repeat([0.0, 0.125], 400)
        return tissue.displacement(tissue.solve(forces), [[0.5, 0.0]])[0, 1]

    for ratio in (0.3, 0.49, 0.4999):
        assert settlement(8, ratio) == pytest.approx(settlement(32, ratio), rel=0.03)


@pytest.mark.parametrize("symmetry, modulus", [("plane_stress", 10e3), ("plane_strain", 10e3 / (1.0 - 0.3**2))])
def test_a_stretched_strip_is_hooke_s(symmetry, modulus):
    width, length, thickness, stress = 1.0, 2.0, 0.1, 50.0
    strip = fe.grid([np.linspace(0.0, width, 3), np.linspace(0.0, length, 5)])
    strip = fe.Mesh(strip.points, strip.cells, "quad", boundaries={"left": np.flatnonzero(strip.points[:, 0] == 0.0)})
    supports = {"bottom": "sliding", "left": "sliding"}
    tissue = fe.Tissue(strip, fe.Elastic(10e3, 0.3), symmetry=symmetry, supports=supports, thickness=thickness)
    at, weights = np.polynomial.legendre.leggauss(3)
    places = np.concatenate([0.25 * width * (1.0 + at), 0.25 * width * (3.0 + at)])  # of its two cells
    pull = -stress * thickness * 0.25 * width * np.tile(weights, 2)
    forces = tissue.values_at(np.column_stack([places, np.zeros(6)])).T @ np.concatenate([np.zeros(6), pull])
    top = tissue.displacement(tissue.solve(forces), [[0.5, 0.0], [width, 0.0]])
    np.testing.assert_allclose(top[:, 1], -stress / modulus * length, rtol=1e-9)


def test_a_triangle_of_constant_strain_has_its_reference_stiffness():
    values = {each["name"]: each for each in reference.load() if each["group"] == "fem"}
    inputs = values["cst_K12_plane_strain"]["inputs"]
    mesh = fe.Mesh(1e-3 * np.array(inputs["nodes_mm"], dtype=float), [[0, 1, 2]], "triangle")
    material = fe.Elastic(inputs["E"], inputs["nu"])
    held = dict.fromkeys(("top", "bottom", "sides"), "fixed")
    tissue = fe.Tissue(mesh, material, symmetry="plane_strain", supports=held, thickness=inputs["t"], order=1)
    stiffness = tissue.stiffness.toarray()
    assert stiffness.trace() == pytest.approx(values["cst_K_trace_plane_strain"]["expected"], rel=1e-9)
    x, z = tissue.elements.dofs.nodal_dofs[:, 0]  # of the corner at the origin
    assert stiffness[x, z] == pytest.approx(values["cst_K12_plane_strain"]["expected"], rel=1e-9)
