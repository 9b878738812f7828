# SPDX-License-Identifier: Apache-2.0
"""A cylinder in space: volume, faces, layers, and shafts in it against closed forms and the axisymmetric mesh."""

import numpy as np
import pytest

import needleforce as nf
from needleforce import fe
from needleforce.fe.elastic.supports import facets_of
from needleforce.fe.mesh.mesh import library

GEL = fe.Elastic(10e3, 0.45)
NEEDLE, RADIUS, DEPTH = 0.7e-3, 8e-3, 10e-3
HELD = {"bottom": "fixed", "sides": "fixed"}


def cup(growth=0.4, cell=NEEDLE, **options):
    return fe.cylinder(RADIUS, DEPTH, cell, growth=growth, **options)


def faces_around(mesh):
    """Number of points of the rim of the surface."""
    return int(np.sum(mesh.points[mesh.boundaries["sides"], 2] == 0.0))


def jacobians(mesh):
    """Volume of the reference cell at the corners and points of integration of each cell."""
    places = library().refdom.RefHex.p
    return mesh.skfem.mapping().detDF(np.hstack([places, 0.5 + 0.5 / np.sqrt(3.0) * (2.0 * places - 1.0)]))


def test_the_volume_is_that_of_the_polygon_and_converges_to_the_cylinder_s():
    errors, faces = [], []
    for growth in (0.4, 0.2, 0.1):
        mesh = cup(growth)
        volume = 0.125 * np.sum(jacobians(mesh)[:, 8:])
        m = faces_around(mesh)
        assert volume == pytest.approx(0.5 * m * np.sin(2.0 * np.pi / m) * RADIUS**2 * DEPTH, rel=1e-12)
        errors.append(1.0 - volume / (np.pi * RADIUS**2 * DEPTH))
        faces.append(m)
    order = -np.diff(np.log(errors)) / np.diff(np.log(faces))
    assert errors[-1] < 3e-3 and faces[-1] > 2 * faces[0] and np.all(order > 1.97)


@pytest.mark.parametrize("entry", [(0.0, 0.0), (4e-3, -2e-3), (0.0, 0.6 * RADIUS)])
@pytest.mark.parametrize("growth", [0.1, 0.4, 2.0])
def test_no_cell_is_folded_and_boundaries_are_complete(entry, growth):
    mesh = cup(growth, entry=entry, needle_depth=6e-3)
    sizes = jacobians(mesh)
    assert np.all(sizes > 0.0) and np.all(sizes.min(axis=1) > 0.02 * sizes.max(axis=1))
    m = faces_around(mesh)
    polygon = 0.5 * m * np.sin(2.0 * np.pi / m) * RADIUS**2
    sides = 2.0 * m * np.sin(np.pi / m) * RADIUS * DEPTH
    elements = fe.Tissue(mesh, GEL).elements
    facets = {name: facets_of(elements, name) for name in ("top", "bottom", "sides")}
    for name, area in (("top", polygon), ("bottom", polygon), ("sides", sides)):
        basis = library().FacetBasis(mesh.skfem, library().ElementHex1(), facets=facets[name])
        assert np.sum(basis.dx) == pytest.approx(area, rel=1e-9)
    every = np.concatenate(list(facets.values()))
    assert sorted(every) == sorted(mesh.skfem.boundary_facets())


def test_nodes_are_at_the_needle_s_surface_and_end_and_layers_at_their_depths():
    mesh = fe.cylinder(
        RADIUS, DEPTH, NEEDLE, needle_depth=6.1e-3, layers=[("skin", 1.3e-3), ("fat", 2e-3), ("gel", 1.0)],
        entry=(2e-3, 1e-3),
    )  # fmt: skip
    distance = np.hypot(*(mesh.points[:, :2] - [2e-3, 1e-3]).T)
    assert np.sum(np.isclose(distance, NEEDLE, rtol=1e-9) & (mesh.points[:, 2] == 0.0)) == 16
    assert np.any(mesh.points[:, 2] == 6.1e-3) and np.any(distance < 1e-12)
    depths = mesh.points[mesh.cells][:, :, 2]
    for label, top, bottom in (("skin", 0.0, 1.3e-3), ("fat", 1.3e-3, 3.3e-3), ("gel", 3.3e-3, DEPTH)):
        inside = depths[mesh.labels == label]
        assert inside.min() == pytest.approx(top) and inside.max() == pytest.approx(bottom)


def antiplane_stiffness(mesh, entry):
    """Of a long shaft along the axis [N/m]: only displacements along it, which are even along it."""
    tissue = fe.Tissue(mesh, GEL)
    vertical = tissue.elements.dofs.nodal_dofs[2]
    matrix = tissue.stiffness[vertical][:, vertical]
    shaft = np.hypot(*(mesh.points[:, :2] - entry).T) < NEEDLE * (1.0 + 1e-9)
    held = np.isin(np.arange(len(mesh.points)), mesh.boundaries["sides"])
    free, moved = np.flatnonzero(~shaft & ~held), shaft.astype(float)
    # even along the axis: both ends of the one layer of cells move together
    section = len(mesh.points) // 2
    both = np.concatenate([np.eye(section), np.eye(section)])
    reduced = both.T @ (matrix @ both)
    free = free[free < section]
    pushed = reduced @ moved[:section]
    moved[free] = np.linalg.solve(reduced[np.ix_(free, free)], -pushed[free])
    return moved[:section] @ reduced @ moved[:section]


@pytest.mark.parametrize("entry", [(0.0, 0.0), (3e-3, 0.0), (-4e-3, 3e-3)])
def test_a_long_shaft_is_as_stiff_as_between_eccentric_cylinders(entry):
    # potential between eccentric circles: 2 pi G / arcosh((R^2 + r^2 - e^2) / (2 R r)) for each length
    off, errors, height = np.hypot(*entry), [], 2.0 * NEEDLE
    exact = np.arccosh((RADIUS**2 + NEEDLE**2 - off**2) / (2.0 * RADIUS * NEEDLE))
    exact = 2.0 * np.pi * GEL.shear_modulus * height / exact
    for growth in (0.4, 0.2, 0.1):
        mesh = fe.cylinder(RADIUS, height, NEEDLE, growth=growth, entry=entry)
        errors.append(antiplane_stiffness(mesh, np.array(entry)) / exact - 1.0)
    assert 0.0 < errors[-1] < 0.012 and np.all(np.array(errors[1:]) < 0.7 * np.array(errors[:-1]))


def test_a_bonded_shaft_is_as_stiff_as_in_the_axisymmetric_mesh():
    path = fe.NeedlePath(5e-3, 1.25e-3, NEEDLE)
    flat = fe.axisymmetric_block(RADIUS, DEPTH, 0.25 * NEEDLE, needle_depth=5e-3, growth=0.1)
    exact = fe.Tissue(flat, GEL, symmetry="axisymmetric", supports=HELD).condense(path)
    errors = []
    for cell, growth in ((NEEDLE, 0.8), (0.5 * NEEDLE, 0.4), (0.5 * NEEDLE, 0.25)):
        found = fe.Tissue(cup(growth, cell, needle_depth=5e-3), GEL, supports=HELD).condense(path)
        errors.append(
            [found.bonded_stiffness(length) / exact.bonded_stiffness(length) - 1.0 for length in (2.5e-3, 5e-3)]
        )
    assert np.all(np.abs(errors[-1]) < 0.03) and np.all(np.diff(np.abs(errors), axis=0) < 0.0)


def test_lateral_loads_along_x_and_y_displace_alike():
    tissue = fe.Tissue(cup(needle_depth=5e-3), GEL, supports=HELD)
    path = fe.NeedlePath(5e-3, 2.5e-3, NEEDLE)
    along_x, along_y = (path.loads(tissue, direction).toarray() for direction in np.eye(3)[:2])
    x, y = tissue.solve(along_x), tissue.solve(along_y)
    np.testing.assert_allclose(along_y.T @ y, along_x.T @ x, rtol=1e-9)
    np.testing.assert_allclose(along_y.T @ x, 0.0, atol=1e-9 * np.abs(along_x.T @ x).max())


def test_off_centre_a_quarter_turn_changes_nothing_and_the_near_side_stiffens():
    path = {"depth": 5e-3, "spacing": 1.25e-3, "radius": NEEDLE}

    def stiffness(entry):
        tissue = fe.Tissue(cup(needle_depth=5e-3, entry=entry), GEL, supports=HELD)
        return tissue.condense(fe.NeedlePath(entry=entry, **path)).bonded_stiffness(5e-3)

    middle, turned = stiffness((4e-3, 0.0)), stiffness((0.0, 4e-3))
    assert middle == pytest.approx(turned, rel=1e-9)
    assert stiffness((0.0, 0.0)) < middle < stiffness((5e-3, 0.0))


def test_a_cup_of_gelatin_has_a_moderate_number_of_cells():
    mesh = fe.cylinder(25e-3, 50e-3, 0.35e-3, needle_depth=40e-3)
    assert len(mesh.cells) < 15_000


@pytest.mark.parametrize(
    "size, options, words",
    [
        ((0.0, 1e-2, 1e-3), {}, r"radius of the cylinder is 0\.0 m, must be above 0\. Give it in m\."),
        ((1e-2, np.nan, 1e-3), {}, "depth of the cylinder is nan m, must be above 0"),
        ((1e-2, 1e-2, -1e-3), {}, "cell is -0.001 m, must be above 0"),
        ((1e-2, 1e-2, 2e-2), {}, "cell is 20 mm, must be at most a quarter of the 10 mm.*Give the radius"),
        ((0.3e-3, 1e-2, 0.35e-3), {}, "cell is 0.35 mm, must be at most a quarter of the 0.3 mm"),
        ((1e-2, 1e-2, 1e-9), {}, "cell is 1e-06 mm, must be at least 0.001 mm"),
        ((1e-2, 1e-2, 1e-3), {"growth": 0.0}, "growth is 0.0, outside 0.05 to 2. Use 0.4."),
        ((1e-2, 1e-2, 1e-3), {"needle_depth": 2e-2}, "needle_depth is 20 mm, must be 0 to 10 mm.*Give a deeper"),
        ((1e-2, 1e-2, 1e-3), {"entry": (1e-2, 0.0)}, "entry is 10 mm from the axis, must be at most 9 mm.*Move"),
        (("1e-2", 1e-2, 1e-3), {}, "radius of the cylinder is 1e-2 m, must be above 0"),
        ((1e-2, [1e-2], 1e-3), {}, "depth of the cylinder"),
        ((1e-2, 1e-2, 1e-3), {"growth": "a"}, "growth is a, outside 0.05 to 2"),
        ((1e-2, 1e-2, 1e-3), {"entry": "ab"}, "must be two numbers"),
        ((1e-2, 1e-2, 1e-3), {"layers": "ab"}, "layers is 'a', must be pairs"),
        ((1e-2, 1e-2, 1e-3), {"layers": [("a",)]}, "must be pairs of label and thickness"),
        ((1e-2, 1e-2, 1e-3), {"entry": (1e-3,)}, r"entry is \[0.001\], must be two numbers, x and y"),
        ((1e-2, 1e-2, 1e-3), {"layers": [("skin", 2e-2), ("fat", 1.0)]}, "layers is 20 mm thick, the block is"),
        (
            (25e-3, 50e-3, 3e-6), {"needle_depth": 40e-3},
            r"mesh is of about \d{7} hexahedra, must have at most 500000. Use a cell of 0.0.* mm or more",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_meshed_is_named(size, options, words):
    with pytest.raises(nf.InputError, match=words):
        fe.cylinder(*size, **options)


def test_a_side_that_is_to_slide_is_refused():
    with pytest.raises(nf.InputError, match="boundary 'sides' is not along an axis"):
        fe.Tissue(cup(), GEL, supports={"bottom": "fixed", "sides": "sliding"})
