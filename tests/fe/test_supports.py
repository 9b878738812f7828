# SPDX-License-Identifier: Apache-2.0
"""Supports, meshes and materials that cannot work are named, with what to do."""

import numpy as np
import pytest
from test_elements import tetrahedra

import needleforce as nf
from needleforce import fe

GEL = fe.Elastic(10e3, 0.45)
BLOCK = fe.block((4e-3, 4e-3, 4e-3), 1e-3, growth=0.0)
SQUARE = fe.block((4e-3, 4e-3), 1e-3, growth=0.0)
TUBE = fe.axisymmetric_block(4e-3, 4e-3, 1e-3, growth=0.0)


@pytest.mark.parametrize(
    "mesh, symmetry, supports, motion",
    [
        (BLOCK, None, {}, "can move along"),
        (BLOCK, None, {"bottom": "sliding"}, "can (move along x|move along y|turn about z)"),
        (SQUARE, "plane_strain", {"bottom": "free"}, "can (move|turn)"),
        (SQUARE, "plane_strain", {"bottom": "sliding"}, "can move along x"),
        (TUBE, "axisymmetric", {"sides": "sliding"}, "can move along z"),
    ],
)
def test_a_body_that_can_move_is_named_with_its_motion(mesh, symmetry, supports, motion):
    with pytest.raises(nf.InputError, match=f"support is missing, the tissue {motion}.*Give supports"):
        fe.Tissue(mesh, GEL, symmetry=symmetry, supports=supports)


def test_supports_that_hold_are_accepted():
    sides = {"bottom": "sliding", "sides": "sliding"}
    assert fe.Tissue(BLOCK, GEL, supports=sides).unknowns > 0
    assert fe.Tissue(TUBE, GEL, symmetry="axisymmetric", supports={"sides": "fixed"}).unknowns > 0


def test_a_body_has_as_many_motions_without_energy_as_it_can_make():
    for mesh, symmetry, count in ((BLOCK, "solid", 6), (SQUARE, "plane_strain", 3), (TUBE, "axisymmetric", 1)):
        held = dict.fromkeys(("top", "bottom", "sides"), "fixed")
        tissue = fe.Tissue(mesh, GEL, symmetry=symmetry, supports=held)
        sizes = np.linalg.eigvalsh(tissue.stiffness.toarray())
        assert np.sum(sizes < 1e-9 * sizes[-1]) == count and sizes[0] > -1e-9 * sizes[-1]


def test_each_part_of_a_mesh_must_be_held():
    apart = fe.Mesh(
        np.concatenate([SQUARE.points, SQUARE.points + np.array([0.1, -0.05])]),
        np.concatenate([SQUARE.cells, SQUARE.cells + len(SQUARE.points)]),
        "quad",
    )
    with pytest.raises(nf.InputError, match=r"the part of the mesh around .* can .*The mesh has 2 parts"):
        fe.Tissue(apart, GEL, symmetry="plane_strain")


def test_flat_and_folded_cells_are_named():
    points, cells = SQUARE.points.copy(), SQUARE.cells
    points[cells[5]] = points[cells[5]][[0, 2, 1, 3]]
    with pytest.raises(nf.InputError, match=r"cell .* is flat or folded at"):
        fe.Mesh(points, cells, "quad")
    flat = tetrahedra(BLOCK)
    points = flat.points.copy()
    points[flat.cells[7, 0]] = points[flat.cells[7, 1:]].mean(axis=0)
    with pytest.raises(nf.InputError, match="flat or folded"):
        fe.Mesh(points, flat.cells, "tetra")


def test_a_mesh_in_the_other_sense_is_the_same_body():
    mirrored = fe.Mesh(SQUARE.points, SQUARE.cells[:, ::-1], "quad")
    one, other = (fe.Tissue(mesh, GEL, symmetry="plane_strain") for mesh in (SQUARE, mirrored))
    forces = [each.values_at(np.array([[0.3e-3, 0.0]])).toarray()[1] for each in (one, other)]
    moved = [each.displacement(each.solve(f), [[0.0, 0.0]]) for each, f in zip((one, other), forces)]
    np.testing.assert_allclose(moved[0], moved[1], rtol=1e-10)


@pytest.mark.parametrize(
    "points, cells, shape, labels, words",
    [
        ([[0, 0], [1, 0], [np.nan, 1]], [[0, 1, 2]], "triangle", None, "point is 2, must be finite"),
        ([[0, 0], [1, 0], [0, 1]], [[0, 1, 3]], "triangle", None, "indices of the 3 points"),
        ([[0, 0], [1, 0], [0, 1]], [[0, 1, 2, 2]], "triangle", None, r"must be \(m, 3\)"),
        ([[0, 0, 0]] * 3, [[0, 1, 2]], "triangle", None, r"must be \(n, 2\)"),
        ([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]], "hexagon", None, "is 'hexagon', unknown. Give one of triangle"),
        ([[0, 0], [1, 0], [0, 1]], [[0, 1, 2]], "triangle", ["a", "b"], "labels is 2"),
    ],
)
def test_arrays_that_are_no_mesh_are_refused(points, cells, shape, labels, words):
    with pytest.raises(nf.InputError, match=words):
        fe.Mesh(points, cells, shape, labels)


def test_points_of_no_cell_are_named():
    loose = fe.Mesh(np.concatenate([SQUARE.points, [[9.0, 9.0]]]), SQUARE.cells, "quad")
    with pytest.raises(nf.InputError, match="1 points of no cell"):
        fe.Tissue(loose, GEL, symmetry="plane_strain")


@pytest.mark.parametrize(
    "options, words",
    [
        ({}, "symmetry is None, must be axisymmetric or plane_strain or plane_stress"),
        ({"symmetry": "solid"}, "symmetry is solid"),
        ({"symmetry": "axisymmetric"}, "radius is -2 mm, must not be below 0"),
        ({"symmetry": "plane_strain", "supports": {"lid": "fixed"}}, "boundary is lid.*Use one of top, bottom, sides"),
        ({"symmetry": "plane_strain", "supports": {"bottom": "glued"}}, "support of 'bottom' is 'glued', unknown"),
        ({"symmetry": "plane_strain", "thickness": 0.0}, "thickness"),
        ({"symmetry": "plane_strain", "order": 3}, "order is 3"),
    ],
)
def test_options_that_do_not_fit_are_named(options, words):
    with pytest.raises(nf.InputError, match=words):
        fe.Tissue(SQUARE, GEL, **options)


def test_boundaries_of_the_mesh_come_first_and_must_have_facets():
    left = np.flatnonzero(SQUARE.points[:, 0] == SQUARE.low[0])
    named = fe.Mesh(SQUARE.points, SQUARE.cells, "quad", boundaries={"bottom": left, "one": left[:1]})
    tissue = fe.Tissue(named, GEL, symmetry="plane_strain", supports={"bottom": "fixed"})
    other = fe.Tissue(
        fe.Mesh(SQUARE.points, SQUARE.cells, "quad", boundaries={"left": left}), GEL, symmetry="plane_strain",
        supports={"left": "fixed"},
    )  # fmt: skip
    assert np.array_equal(tissue.held, other.held)
    with pytest.raises(nf.InputError, match="boundary 'one' is empty, no outer facet"):
        fe.Tissue(named, GEL, symmetry="plane_strain", supports={"bottom": "fixed", "one": "fixed"})


def test_a_label_without_material_is_named():
    mesh = SQUARE.labelled("tumour", lambda points: points[:, 1] > 3e-3)
    with pytest.raises(
        nf.InputError, match=r"material of label 'tumour' is missing, the mesh has \['tissue', 'tumour'\]"
    ):
        fe.Tissue(mesh, {"tissue": GEL}, symmetry="plane_strain")


@pytest.mark.parametrize(
    "values, words",
    [
        ((10e3, 0.5), "must be 0 to 0.49999. Use 0.4999"),
        ((10e3, 0.6), "Soft tissue is at"),
        ((10e3, -0.1), "must be 0 to"),
        ((0.0, 0.3), "young_modulus"),
        ((np.nan, 0.3), "young_modulus"),
        ((10e3, np.nan), "poisson_ratio"),
        ((10e3, 0.3, 0.0), "density"),
    ],
)
def test_materials_out_of_range_are_refused(values, words):
    with pytest.raises(nf.InputError, match=words):
        fe.Elastic(*values)


def test_elements_that_lock_are_refused():
    with pytest.raises(nf.InputError, match=r"order is 1, locks at a Poisson ratio of 0\.49"):
        fe.Tissue(tetrahedra(BLOCK), fe.Elastic(10e3, 0.49), order=1)


def test_a_mesh_that_does_not_fit_into_memory_is_refused(monkeypatch):
    from needleforce.fe.elastic import factorisation

    monkeypatch.setattr(factorisation, "_free_memory", lambda: 2e9)
    assert factorisation.memory_of_factor(3_000_000, 3) > 2e9  # of a million hexahedra
    with pytest.raises(nf.InputError, match=r"of 3000000 unknowns, the factor would need .* GB .*Use larger cells"):
        factorisation._check_memory(3_000_000, 3)


def test_layers_and_inclusions_label_cells():
    mesh = fe.block((4e-3, 4e-3), 0.5e-3, growth=0.0, layers=[("skin", 1e-3), ("fat", 1.3e-3), ("muscle", 1.0)])
    centres = mesh.points[mesh.cells].mean(axis=1)[:, 1]
    expected = np.where(centres < 1e-3, "skin", np.where(centres < 2.3e-3, "fat", "muscle"))
    assert list(mesh.labels) == list(expected)
    assert np.isclose(mesh.points[:, 1], 2.3e-3).any()  # an interface is a line of the mesh
    with pytest.raises(nf.InputError, match="layers is 5 mm thick, the block is 4 mm deep"):
        fe.block((4e-3, 4e-3), 0.5e-3, layers=[("skin", 5e-3), ("fat", 1.0)])


def test_loads_and_points_that_do_not_fit_are_named():
    tissue = fe.Tissue(SQUARE, GEL, symmetry="plane_strain")
    with pytest.raises(nf.InputError, match="forces is of shape"):
        tissue.solve(np.ones(3))
    with pytest.raises(nf.InputError, match=r"point is \(3, 1\) mm, is outside the mesh, which extends over"):
        tissue.displacement(np.zeros(tissue.elements.count), [[0.0, 1e-3], [3e-3, 1e-3]])
