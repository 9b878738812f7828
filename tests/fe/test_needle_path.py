# SPDX-License-Identifier: Apache-2.0
"""Loads along the needle's line, and tips on the surface: closed forms, reciprocity, convergence, plane and space."""

import sys

import numpy as np
import pytest
from closed_forms import bonded_shaft_stiffness, punch_stiffness

import needleforce as nf
from needleforce import fe

GEL = fe.Elastic(10e3, 0.45)
RADIUS = 0.35e-3
ALL_HELD = {"bottom": "fixed", "sides": "fixed"}


def compliance(tissue, path):
    loads = path.loads(tissue).toarray()
    return loads.T @ tissue.solve(loads)


def bonded(length, size, cell=RADIUS, spacing=0.5e-3):
    """Force per displacement of a rigid shaft that sticks along its length."""
    mesh = fe.axisymmetric_block(size, size, cell, needle_depth=length)
    tissue = fe.Tissue(mesh, GEL, symmetry="axisymmetric", supports=ALL_HELD)
    matrix = compliance(tissue, fe.NeedlePath(length, spacing, RADIUS))
    return np.linalg.solve(matrix, np.ones(len(matrix))).sum()


def test_a_bonded_shaft_is_as_stiff_as_randolph_and_wroth_say():
    for length in (10e-3, 20e-3, 40e-3):
        assert bonded(length, 0.4) == pytest.approx(bonded_shaft_stiffness(GEL, RADIUS, length), rel=0.08)


def test_the_stiffness_of_a_bonded_shaft_converges_in_cells_nodes_and_block():
    cells = [bonded(20e-3, 0.2, cell) for cell in (4 * RADIUS, 2 * RADIUS, RADIUS, 0.5 * RADIUS)]
    nodes = [bonded(20e-3, 0.2, spacing=spacing) for spacing in (2e-3, 1e-3, 0.5e-3)]
    blocks = [bonded(20e-3, size) for size in (0.1, 0.2, 0.4, 0.8)]
    for values, final in ((cells, 0.01), (nodes, 0.01), (blocks, 0.02)):
        steps = np.abs(np.diff(values)) / values[-1]
        assert steps[-1] < final and steps[-1] < 0.7 * steps[0]


def test_a_load_along_the_path_and_what_it_moves_are_reciprocal():
    mesh = fe.block((40e-3, 30e-3, 30e-3), 2e-3, needle_depth=20e-3)
    tissue = fe.Tissue(mesh, GEL, supports=ALL_HELD)
    path = fe.NeedlePath(20e-3, 2e-3, RADIUS, entry=(3e-3, -2e-3), direction=(0.2, 0.1, 1.0))
    for direction in (None, (1.0, 0.0, 0.0), (0.3, 0.5, -0.2)):
        loads = path.loads(tissue, None if direction is None else np.array(direction)).toarray()
        matrix = loads.T @ tissue.solve(loads)
        np.testing.assert_allclose(matrix, matrix.T, atol=1e-10 * matrix.max())
        assert np.linalg.eigvalsh(matrix).min() > 0.0
    along = (
        path.loads(tissue).toarray().sum(axis=0)
    )  # shape functions add up to one, the components of a unit vector to this
    np.testing.assert_allclose(along, 1.3 / np.linalg.norm([0.2, 0.1, 1.0]), rtol=1e-9)


@pytest.mark.parametrize("degrees", [0, 10, 20, 45])
def test_oblique_paths_are_condensed(degrees):
    mesh = fe.block((40e-3, 30e-3), 1e-3, needle_depth=15e-3)
    tissue = fe.Tissue(mesh, GEL, symmetry="plane_strain", supports=ALL_HELD)
    direction = np.array([np.sin(np.radians(degrees)), np.cos(np.radians(degrees))])
    straight = tissue.condense(fe.NeedlePath(12e-3, 2e-3, RADIUS))
    oblique = tissue.condense(fe.NeedlePath(12e-3, 2e-3, RADIUS, direction=direction))
    np.testing.assert_allclose(oblique.bonded_stiffness(12e-3), straight.bonded_stiffness(12e-3), rtol=0.25)


def test_a_body_in_space_moves_as_the_axisymmetric_one():
    size, length = 40e-3, 10e-3
    flat = fe.axisymmetric_block(size / np.sqrt(np.pi), 24e-3, 1e-3, needle_depth=length)
    space = fe.block((size, size, 24e-3), 2e-3, needle_depth=length, growth=0.6)
    path = fe.NeedlePath(length, 2e-3, 1.4e-3)
    fixed = {"bottom": "fixed"}
    one = compliance(fe.Tissue(flat, GEL, symmetry="axisymmetric", supports=fixed), path)
    other = compliance(fe.Tissue(space, GEL, supports=fixed, order=2), path)
    np.testing.assert_allclose(other, one, rtol=0.06)


def surface(size, cell, ratio=0.45):
    mesh = fe.axisymmetric_block(size, size, cell)
    return fe.Tissue(mesh, fe.Elastic(10e3, ratio), symmetry="axisymmetric", supports=ALL_HELD)


def test_a_flat_punch_is_as_stiff_as_on_a_half_space():
    punch = nf.tips.Flat(radius=RADIUS)
    exact = punch_stiffness(GEL, RADIUS)
    errors = [
        fe.press(surface(0.2, RADIUS / n), punch, 1e-5, 3 * RADIUS).force[0] / 1e-5 / exact - 1 for n in (4, 8, 16)
    ]
    assert abs(errors[-1]) < 0.02 and abs(errors[-1]) < 0.6 * abs(errors[0])


@pytest.mark.parametrize("ratio", [0.3, 0.4999])
def test_a_cone_on_a_large_block_is_sneddon_s(ratio):
    cone, depth = nf.tips.Cone(half_angle=1.0), 3e-4
    found = fe.press(surface(0.1, 2e-5, ratio), cone, [depth, 2 * depth], 3e-3)
    modulus = nf.Tissue(10e3, ratio).plane_strain_modulus
    exact = nf.contact(cone, depth=found.depth, reduced_modulus=modulus)
    np.testing.assert_allclose(found.force, exact.force, rtol=0.04)
    np.testing.assert_allclose(found.contact_radius, exact.contact_radius, atol=4e-5)
    # the surface next to a cone: h - r cot(alpha) in contact, then Sneddon's arcsine
    a, r = exact.contact_radius[1], found.radius
    outside = r > 1.3 * a
    r, slope = r[outside], 1.0 / np.tan(1.0)
    dimple = a * slope * (np.arcsin(a / r) + np.sqrt((r / a) ** 2 - 1.0) - r / a)
    np.testing.assert_allclose(found.dimple[1][outside], dimple, atol=0.03 * depth)


def test_a_thin_layer_on_a_base_is_stiffer_and_on_a_soft_one_softer():
    tip, depth = nf.tips.Sphere(radius=2e-3), 1e-4
    forces = {}
    for name, young in (("stiff base", 1e6), ("even", 10e3), ("soft base", 1e3)):
        mesh = fe.axisymmetric_block(20e-3, 20e-3, 5e-5, layers=[("layer", 1e-3), ("base", 1.0)])
        materials = {"layer": GEL, "base": fe.Elastic(young, 0.45)}
        tissue = fe.Tissue(mesh, materials, symmetry="axisymmetric")
        forces[name] = fe.press(tissue, tip, depth, 1.5e-3).force[0]
    assert forces["stiff base"] > 1.2 * forces["even"] > 1.2 * 1.2 * forces["soft base"]


@pytest.mark.parametrize(
    "arguments, words",
    [
        ((0.0, 1e-3, RADIUS), "depth of the path is 0.0 m, must be above 0"),
        ((20e-3, -1e-3, RADIUS), "spacing of the path"),
        ((20e-3, 1e-3, np.nan), "radius of the path"),
        ((1e-3, 2e-3, RADIUS), "spacing is 2 mm, the path is 1 mm deep"),
    ],
)
def test_lengths_of_a_path_are_checked(arguments, words):
    with pytest.raises(nf.InputError, match=words):
        fe.NeedlePath(*arguments)


def test_a_path_that_leaves_the_mesh_is_named():
    tissue = surface(10e-3, 1e-3)
    with pytest.raises(nf.InputError, match=r"point is \(0.35, .*\) mm, is outside the mesh"):
        fe.NeedlePath(20e-3, 1e-3, RADIUS).loads(tissue)
    with pytest.raises(nf.InputError, match="path is off the axis, in an axisymmetric mesh"):
        fe.NeedlePath(5e-3, 1e-3, RADIUS, direction=(0.1, 1.0)).loads(tissue)
    block = fe.Tissue(fe.block((10e-3, 10e-3, 10e-3), 2e-3), GEL)
    with pytest.raises(nf.InputError, match=r"entry of the path is .*, must have 2 coordinates"):
        fe.NeedlePath(5e-3, 1e-3, RADIUS, entry=(1e-3,)).loads(block)


@pytest.mark.parametrize(
    "depth, reach, words",
    [
        (-1e-4, 2e-3, "must be finite and at least 0"),
        (np.nan, 2e-3, "must be finite"),
        ([], 2e-3, "must be one row"),
        (1e-4, -1.0, "reach is -1.0 m, must be above 0"),
        (1e-3, 3e-4, "the contact reaches at least"),
        (1e-4, 1e-5, "free nodes, within 0.01 mm"),
        (1e-6, 2e-3, "is too small for the mesh"),
    ],
)
def test_contacts_that_the_mesh_does_not_resolve_are_named(depth, reach, words):
    with pytest.raises(nf.InputError, match=words):
        fe.press(surface(20e-3, 1e-4), nf.tips.Cone(half_angle=1.0), depth, reach)


def test_a_missing_package_is_named_with_its_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "skfem", None)
    with pytest.raises(nf.InputError, match=r"scikit-fem is not installed.*needleforce\[fe\]"):
        surface(10e-3, 1e-3)
