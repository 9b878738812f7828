# SPDX-License-Identifier: Apache-2.0
"""Large deformation against closed forms: stretch, shear, a tube; small loads; the tangent; no locking; what fails."""

import re

import numpy as np
import pytest
from scipy.integrate import quad
from test_elements import CUBE, PATCHES, SQUARE, TUBE, tetrahedra, triangles

import needleforce as nf
from needleforce import fe
from needleforce.fe.elastic.supports import unknowns_of
from needleforce.fe.hyperelastic.tissue import HyperelasticTissue
from needleforce.fe.materials import (
    MooneyRivlin,
    NeoHookean,
    cofactor,
    isochoric_stress,
    isochoric_tangent,
)
from needleforce.fe.vtk_file import write_vtk

SHEAR = 3e3
NEO = NeoHookean(SHEAR, 1e4 * SHEAR)
MOONEY = MooneyRivlin(c10=0.9e3, c01=0.6e3, bulk_modulus=1e4 * SHEAR)
MATERIALS = pytest.mark.parametrize("material", [NEO, MOONEY], ids=["neo-Hookean", "Mooney-Rivlin"])
SIDE = 4e-3  # of the cube
LARGE = {name: patch for name, patch in PATCHES.items() if patch[1] != "plane_stress"}
HELD = dict.fromkeys(("top", "bottom", "sides"), "fixed")


def quarter(mesh):
    """The mesh with names for the planes at the low ends of all axes but the depth."""
    ends = {f"low {axis}": np.isclose(mesh.points[:, axis], mesh.low[axis]) for axis in range(mesh.dimension - 1)}
    return fe.Mesh(
        mesh.points, mesh.cells, mesh.shape, mesh.labels, {name: np.flatnonzero(at) for name, at in ends.items()}
    )


@MATERIALS
@pytest.mark.parametrize("stretch", [0.5, 0.9, 1.5, 3.0])
@pytest.mark.parametrize("shape", ["hexahedron", "tetra", "axisymmetric"])
def test_a_stretched_cylinder_has_the_force_of_the_closed_form(shape, stretch, material):
    # Rivlin: force per undeformed area 2 (c10 + c01 / stretch) (stretch - stretch^-2), incompressible
    coarse = fe.block((SIDE, SIDE, SIDE), 2e-3, growth=0.0)
    mesh = {"hexahedron": coarse, "tetra": tetrahedra(coarse), "axisymmetric": TUBE}[shape]
    flat = shape == "axisymmetric"
    mesh = mesh if flat else quarter(mesh)
    height, area = (5e-3, np.pi * (5e-3) ** 2) if flat else (SIDE, SIDE**2)
    supports = dict.fromkeys(["bottom", *mesh.boundaries], "sliding")
    body = HyperelasticTissue(mesh, material, symmetry="axisymmetric" if flat else None, supports=supports)
    moved = -(stretch - 1.0) * height  # the top is at depth 0: stretch is upwards
    found = body.solve(displacements={"top": (*[None] * (mesh.dimension - 1), moved)})
    c10, c01 = material.coefficients
    exact = 2.0 * (c10 + c01 / stretch) * (stretch - stretch**-2)
    assert -found.reactions["top"][-1, -1] / area == pytest.approx(exact, rel=3e-4)
    assert found.reactions["bottom"][-1, -1] / area == pytest.approx(exact, rel=3e-4)
    tensor = body.stress(found.displacement).tensor
    axis = 1 if flat else 2
    np.testing.assert_allclose(tensor[:, axis, axis], exact * stretch, rtol=5e-4)  # true stress
    np.testing.assert_allclose(tensor[:, 0, 0], 0.0, atol=1e-5 * abs(exact))


def moving(gradient):
    return lambda points: points @ np.asarray(gradient).T


@MATERIALS
@pytest.mark.parametrize("amount", [0.1, 1.0, 2.0])
@pytest.mark.parametrize("name", [name for name, patch in LARGE.items() if patch[1] != "axisymmetric"])
def test_simple_shear_of_a_patch_has_the_stress_of_the_closed_form(name, amount, material):
    # Rivlin: shear G k; differences of the normal stresses 2 c10 k^2 and -2 c01 k^2, whatever the bulk modulus
    mesh, symmetry, order = LARGE[name]
    body = HyperelasticTissue(mesh, material, symmetry=symmetry, supports=HELD, order=order)
    gradient = np.zeros((mesh.dimension,) * 2)
    gradient[0, -1] = amount
    found = body.solve(displacements=dict.fromkeys(HELD, moving(gradient)))
    unknowns = unknowns_of(body.tissue.elements)
    exact = moving(gradient)(unknowns.places)[np.arange(len(unknowns.places)), unknowns.component]
    np.testing.assert_allclose(found.displacement, exact, atol=1e-8 * np.abs(exact).max())
    tensor = body.stress(found.displacement).tensor
    across, depth = (1, 2) if mesh.dimension == 3 else (2, 1)
    c10, c01 = material.coefficients
    size = SHEAR * amount
    np.testing.assert_allclose(tensor[:, 0, depth], size, rtol=1e-6)
    for axis, difference in ((0, 2.0 * c10 * amount**2), (depth, -2.0 * c01 * amount**2)):
        found_difference = tensor[:, axis, axis] - tensor[:, across, across]
        np.testing.assert_allclose(found_difference, difference, atol=1e-6 * size * (1.0 + amount))


INNER, OUTER, LENGTH = 10e-3, 20e-3, 2e-3


def inflated(cells, moved, material, shape="quad", order=2):
    """Pressure on the inner face of a long thick tube, from the force that moves it outwards."""
    mesh = fe.grid([np.linspace(INNER, OUTER, cells + 1), np.linspace(0.0, LENGTH, 2)])
    mesh = mesh if shape == "quad" else triangles(mesh)
    inner = np.flatnonzero(mesh.points[:, 0] == INNER)
    mesh = fe.Mesh(mesh.points, mesh.cells, shape, boundaries={"inner": inner})
    ends = {"top": "sliding", "bottom": "sliding"}
    body = HyperelasticTissue(mesh, material, symmetry="axisymmetric", supports=ends, order=order)
    found = body.solve(displacements={"inner": (moved, None)})
    return found.reactions["inner"][-1, 0] / (2.0 * np.pi * (INNER + moved) * LENGTH), found


def tube_pressure(moved):
    """Green & Zerna: integral of G (r^2 / R^2 - R^2 / r^2) / r over the wall, r^2 = R^2 + a^2 - A^2."""
    grown = (INNER + moved) ** 2 - INNER**2

    def slope(radius):
        ratio = (radius**2 + grown) / radius**2
        return SHEAR * (ratio - 1.0 / ratio) * radius / (radius**2 + grown)

    return quad(slope, INNER, OUTER, epsabs=0.0, epsrel=1e-12)[0]


@pytest.mark.parametrize("moved", [1e-3, 5e-3, 10e-3])
@pytest.mark.parametrize(
    "shape, order, rate, final", [("quad", 1, 1.8, 2e-3), ("quad", 2, 3.0, 1e-5), ("triangle", 2, 1.6, 1e-3)]
)
def test_a_thick_tube_converges_to_the_pressure_of_the_closed_form(shape, order, rate, final, moved):
    stiff = NeoHookean(SHEAR, 1e6 * SHEAR)
    exact = tube_pressure(moved)
    errors = [abs(inflated(cells, moved, stiff, shape, order)[0] / exact - 1.0) for cells in (2, 4, 8)]
    assert errors[-1] < final and np.log2(errors[0] / errors[-1]) > 2.0 * rate


@pytest.mark.parametrize("shape, order", [("quad", 1), ("quad", 2), ("triangle", 2)])
def test_a_tube_does_not_lock(shape, order):
    # a mesh that locks has a pressure in proportion to the bulk modulus
    soft, stiff = (inflated(4, 5e-3, NeoHookean(SHEAR, ratio * SHEAR), shape, order)[0] for ratio in (1e3, 1e5))
    assert stiff == pytest.approx(soft, rel=1e-3)


@pytest.mark.parametrize("name", LARGE)
def test_small_loads_give_the_linear_solution(name):
    mesh, symmetry, order = LARGE[name]
    material = fe.Elastic(10e3, 0.49)
    body = HyperelasticTissue(mesh, NeoHookean.of(material), symmetry=symmetry, order=order)
    linear = fe.Tissue(mesh, material, symmetry=symmetry, order=order)
    down = linear.values_at(np.zeros((1, mesh.dimension))).toarray()[-1]
    unit, differences = down * (1.0 if symmetry == "plane_strain" else 1e-3), []
    for load in (0.4, 0.2, 0.1):
        expected = linear.solve(load * unit)
        found = body.solve(forces=load * unit, tolerance=1e-12).displacement
        differences.append(np.abs(found - expected).max() / np.abs(linear.solve(unit)).max())
    rates = np.log2(np.array(differences[:-1]) / differences[1:])
    np.testing.assert_allclose(rates, 2.0, atol=0.15)


@pytest.mark.parametrize("name", LARGE)
@MATERIALS
def test_stiffness_at_rest_is_the_linear_one(name, material):
    mesh, symmetry, order = LARGE[name]
    thickness = 0.3 if symmetry == "plane_strain" else 1.0
    body = HyperelasticTissue(mesh, material, symmetry=symmetry, order=order, thickness=thickness)
    difference = body.elements.tangent(np.zeros(body.tissue.elements.count)) - body.tissue.stiffness
    assert abs(difference).max() < 1e-12 * abs(body.tissue.stiffness).max()


@pytest.mark.parametrize("name", LARGE)
@MATERIALS
def test_the_tangent_is_the_derivative_of_the_forces_and_symmetric(name, material):
    mesh, symmetry, order = LARGE[name]
    body, random = HyperelasticTissue(mesh, material, symmetry=symmetry, order=order), np.random.default_rng(0)
    unknowns = unknowns_of(body.tissue.elements)
    solution = random.normal(0.0, 2e-5, len(unknowns.places)) + 0.1 * unknowns.places[:, 0] * unknowns.component
    change, step = random.normal(0.0, 1.0, len(solution)), 1e-9
    forces = [body.elements.forces(solution + sign * step * change) for sign in (1.0, -1.0)]
    tangent = body.elements.tangent(solution)
    expected = tangent @ change
    np.testing.assert_allclose((forces[0] - forces[1]) / (2.0 * step), expected, atol=1e-7 * np.abs(expected).max())
    assert abs(tangent - tangent.T).max() < 1e-12 * abs(tangent).max()


def test_the_law_is_the_derivative_of_its_energy():
    random = np.random.default_rng(3)
    deformation = np.eye(3) + 0.15 * random.normal(size=(20, 3, 3))
    c10, c01, step = np.full(20, 3.0), np.full(20, 2.0), 1e-6

    def energy(deformation):
        cauchy = deformation.transpose(0, 2, 1) @ deformation
        cauchy = cauchy / np.linalg.det(cauchy)[:, None, None] ** (1.0 / 3.0)
        first = np.trace(cauchy, axis1=1, axis2=2)
        second = 0.5 * (first**2 - np.trace(cauchy @ cauchy, axis1=1, axis2=2))
        return c10 * (first - 3.0) + c01 * (second - 3.0)

    stress, tangent = (law(deformation, c10, c01) for law in (isochoric_stress, isochoric_tangent))
    slope = cofactor(deformation, np.linalg.det(deformation))
    for i, j in np.ndindex(3, 3):
        moved = np.zeros((3, 3))
        moved[i, j] = step
        plus, minus = deformation + moved, deformation - moved
        np.testing.assert_allclose((energy(plus) - energy(minus)) / (2 * step), stress[:, i, j], atol=1e-7)
        differences = (isochoric_stress(plus, c10, c01) - isochoric_stress(minus, c10, c01)) / (2 * step)
        np.testing.assert_allclose(differences, tangent[:, :, :, i, j], atol=1e-6)
        volumes = (np.linalg.det(plus) - np.linalg.det(minus)) / (2 * step)
        np.testing.assert_allclose(volumes, slope[:, i, j], atol=1e-8)


@pytest.mark.parametrize("name", ["quad 2", "triangle 2", "hexahedron 1", "tetra 2", "axisymmetric 2"])
def test_newton_converges_quadratically_however_incompressible(name):
    mesh, symmetry, order = LARGE[name]
    body = HyperelasticTissue(mesh, NEO, symmetry=symmetry, order=order)
    elements, sizes = body.elements, []
    forces = elements.forces

    def watched(solution):
        found = forces(solution)
        sizes.append(np.linalg.norm(found[~(body.tissue.held | moved)]))
        return found

    unknowns = unknowns_of(body.tissue.elements)
    moved = np.isclose(unknowns.places[:, -1], 0.0)
    elements.forces = watched
    found = body.solve(displacements={"top": (*[0.0] * (mesh.dimension - 1), 0.15 * mesh.high[-1])}, tolerance=1e-12)
    assert list(found.loads) == [1.0] and found.iterations <= 8
    logs = np.log(np.array([each for each in sizes[1:] if each > 1e-9 * max(sizes)]) / max(sizes))
    assert logs[-1] < 1.6 * logs[-2]  # digits nearly double


def test_forces_and_reactions_balance():
    body = HyperelasticTissue(CUBE, MOONEY)
    pushed = body.tissue.values_at(np.zeros((1, 3))).T @ np.array([0.02, -0.01, 0.03])
    found = body.solve(forces=pushed)
    np.testing.assert_allclose(found.reactions["bottom"][-1], [-0.02, 0.01, -0.03], atol=1e-9)
    assert np.all(found.forces[~body.tissue.held] == 0.0)
    floor = body.tissue.values_at(np.array([[0.0, 0.0, 4e-3]])).T @ np.array([0.0, 0.0, 0.5])
    found = body.solve(forces=pushed + floor)  # a force where the body is held goes into the support
    np.testing.assert_allclose(found.reactions["bottom"][-1], [-0.02, 0.01, -0.53], atol=1e-9)


def test_nothing_leaves_the_axis():
    body = HyperelasticTissue(TUBE, NEO, symmetry="axisymmetric")
    found = body.solve(displacements={"top": (1e-4, 0.0)}).displacement
    unknowns = unknowns_of(body.tissue.elements)
    across = unknowns.component == 0
    assert np.all(found[across & (unknowns.places[:, 0] == 0.0)] == 0.0)
    assert np.all(found[across & (unknowns.places[:, 0] > 0.0) & (unknowns.places[:, 1] == 0.0)] == 1e-4)


def test_the_path_of_the_load_does_not_matter_and_is_recorded():
    body = HyperelasticTissue(SQUARE, NEO, symmetry="plane_strain")
    seen = []
    one, several = (
        body.solve(displacements={"top": (0.0, 1e-3)}, steps=steps, progress=lambda *args: seen.append(args))
        for steps in (1, 4)
    )
    np.testing.assert_allclose(several.displacement, one.displacement, atol=1e-10)
    np.testing.assert_allclose(several.loads, [0.25, 0.5, 0.75, 1.0])
    assert several.reactions["top"].shape == (4, 2) and np.all(np.diff(several.reactions["top"][:, 1]) > 0.0)
    assert len(seen) == one.iterations + several.iterations
    assert seen[-1] == (several.iterations, 0.75)


def test_a_load_that_is_too_large_for_one_step_is_cut():
    mesh = fe.grid([np.linspace(-10e-3, 10e-3, 9), np.linspace(0.0, 20e-3, 9)])
    body = HyperelasticTissue(mesh, NEO, symmetry="plane_strain")
    found = body.solve(displacements={"top": (0.0, -30e-3)})  # to two and a half times its height
    assert len(found.loads) > 1 and found.loads[-1] == 1.0
    assert found.reactions["top"][-1, 1] == pytest.approx(-found.reactions["bottom"][-1, 1], rel=1e-6)


def test_loads_without_balance_and_inverted_cells_are_named_with_the_last_load():
    body = HyperelasticTissue(SQUARE, NEO, symmetry="plane_strain", supports=HELD)
    last = r"the last load that converged is ([\d.]+) % of the one asked for"
    with pytest.raises(
        nf.InputError, match=rf"cell \d+ is inverted at \(.*\) mm, {last}. Give a smaller load"
    ) as error:
        body.solve(displacements=dict.fromkeys(HELD, moving(np.diag([0.0, -1.2]))))
    assert float(re.search(last, str(error.value))[1]) == pytest.approx(100.0 / 1.2, abs=0.2)  # there the volume is 0
    column = fe.grid([np.linspace(-1.0, 1.0, 3), np.linspace(0.0, 20.0, 11)])
    body = HyperelasticTissue(column, NEO, symmetry="plane_strain")
    pushed = body.tissue.values_at(np.zeros((1, 2))).T @ np.array([0.0, 5e4])
    with pytest.raises(nf.InputError, match=rf"(not converging|inverted at .* mm), {last}"):
        body.solve(forces=pushed)


def test_layers_have_their_own_materials_and_a_file_for_paraview(tmp_path):
    mesh = fe.grid([np.linspace(0.0, 2.0, 3), np.linspace(0.0, 2.0, 3)]).labelled("soft", lambda at: at[:, 1] < 1.0)
    sides = fe.Mesh(mesh.points, mesh.cells, "quad", mesh.labels, {"left": np.flatnonzero(mesh.points[:, 0] == 0.0)})
    materials = {"tissue": NeoHookean(10e3), "soft": NeoHookean(1e3)}
    supports = {"bottom": "sliding", "sides": "sliding"}
    body = HyperelasticTissue(sides, materials, symmetry="plane_strain", supports=supports)
    found = body.solve(displacements={"top": (None, 1e-3)})  # held at its sides: only the bulk moduli resist
    tensor = body.stress(found.displacement).tensor
    np.testing.assert_allclose(tensor[:, 1, 1], tensor[0, 1, 1], rtol=1e-6)  # in series
    depths = [[1.0, 0.0], [1.0, 1.0]]
    moved = body.tissue.displacement(found.displacement, depths)[:, 1]
    assert (moved[0] - moved[1]) / moved[1] == pytest.approx(10.0, rel=1e-2)
    assert write_vtk(tmp_path / "a.vtu", body, found.displacement) == {0: "soft", 1: "tissue"}


def test_materials_have_their_moduli():
    linear = fe.Elastic(10e3, 0.45)
    neo = NeoHookean.of(linear)
    assert neo.shear_modulus == pytest.approx(10e3 / 2.9)
    assert neo.bulk_modulus == pytest.approx(10e3 / (3.0 * 0.1))
    assert MooneyRivlin(100.0, 200.0).shear_modulus == 600.0
    assert MooneyRivlin(100.0, 200.0).bulk_modulus == 600e3 and NeoHookean(5.0).bulk_modulus == 5e3


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: NeoHookean(0.0), "shear_modulus is 0.0 Pa, must be above 0"),
        (lambda: NeoHookean(1e3, 5e2), "bulk_modulus is 500.0 Pa, must be 666.7 to 1e"),
        (lambda: NeoHookean(1e3, 1e10), "bulk_modulus is .*Use 1000 times the shear modulus"),
        (lambda: NeoHookean(1e3, np.nan), "bulk_modulus is nan"),
        (lambda: MooneyRivlin(100.0, -200.0), r"c10 \+ c01 is -100.0 Pa"),
        (lambda: HyperelasticTissue(SQUARE, NEO, symmetry="plane_stress"), "symmetry is plane_stress, is for small"),
        (lambda: HyperelasticTissue(SQUARE, NEO), "symmetry is None"),
        (lambda: HyperelasticTissue(SQUARE, fe.Elastic(1e3), symmetry="plane_strain"), "Elastic, must be nf.fe.Neo"),
        (lambda: HyperelasticTissue(SQUARE, {"a": NEO}, symmetry="plane_strain"), "label 'tissue' is missing"),
        (lambda: HyperelasticTissue(CUBE, NEO, supports={}), "support is missing"),
        (lambda: HyperelasticTissue(tetrahedra(CUBE), NEO, order=1), "order is 1, locks"),
    ],
)  # fmt: skip
def test_materials_and_bodies_that_do_not_fit_are_named(make, words):
    with pytest.raises(nf.InputError, match=words):
        make()


@pytest.mark.parametrize(
    "options, words",
    [
        ({"displacements": {"lid": (0.0, 1e-3)}}, "boundary is lid"),
        ({"displacements": {"top": (0.0,)}}, r"displacement of 'top' is of shape \(1,\), must have a finite number or"),
        ({"displacements": {"top": (0.0, np.inf)}}, "displacement of 'top'"),
        ({"displacements": {"none": (0.0, 1e-3)}}, "boundary 'none' is empty"),
        (
            {"displacements": {"top": (0.0, 1e-3), "sides": (0.0, 0.0)}},
            "displacement of a point of 'sides' is 0 mm and 1 mm, by two boundaries. Leave one of them free",
        ),
        ({"forces": [1.0]}, r"forces is of shape \(1,\), must be finite"),
        ({"steps": 0}, "steps is 0, must be 1 or more"),
        ({"tolerance": 0.0}, "tolerance is 0.0, must be between 0 and 1"),
    ],
)
def test_loads_that_do_not_fit_are_named(options, words):
    mesh = fe.Mesh(SQUARE.points, SQUARE.cells, "quad", boundaries={"none": [0]})
    body = HyperelasticTissue(mesh, NEO, symmetry="plane_strain")
    with pytest.raises(nf.InputError, match=words):
        body.solve(**options)
