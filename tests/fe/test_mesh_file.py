# SPDX-License-Identifier: Apache-2.0
"""Meshes of files: of gmsh itself, and round trips through the formats of meshio; what is no body is named."""

import sys
from pathlib import Path

import meshio
import numpy as np
import pytest
from test_elements import tetrahedra, triangles

import needleforce as nf
from needleforce import fe
from needleforce.fe.mesh.mesh_file import read_mesh

HERE = Path(__file__).parent
BOX = fe.grid([np.linspace(-2.0, 2.0, 5), np.linspace(-1.0, 2.0, 4), np.linspace(0.0, 3.0, 4)])
BOX = BOX.labelled("tumour", lambda points: np.linalg.norm(points, axis=1) < 1.5)
PLATE = fe.grid([np.linspace(0.0, 3.0, 4), np.linspace(0.0, 2.0, 3)])
PLATE = PLATE.labelled("tumour", lambda points: points[:, 1] > 1.0)
TOP = {"triangle": [(0, 1, 2), (0, 2, 3)], "quad": [(0, 1, 2, 3)]}  # of a hexahedron, corners of its first face


def volumes(mesh):
    """Signed, of each cell."""
    corners = mesh.points[mesh.cells]
    if mesh.shape in ("triangle", "tetra"):
        sizes = np.linalg.det(corners[:, 1:] - corners[:, :1])
        return sizes / (2.0 if mesh.shape == "triangle" else 6.0)
    weight = fe.elastic.elements.Elements(mesh, "solid" if mesh.dimension == 3 else "plane_strain", 1, 1.0)
    return np.concatenate([cells.weight.sum(axis=1) for _, cells in weight.batches()])


def saved(path, mesh, **options):
    """The mesh in mm as a file of meshio, its labels as numbers 1 and 7, of which the second is the tumour."""
    points = np.pad(mesh.points, ((0, 0), (0, 3 - mesh.dimension)))
    numbers = np.where(mesh.labels == "tumour", 7, 1)
    data = options.pop("data", "label")
    content = meshio.Mesh(points, [(mesh.shape, mesh.cells)], cell_data={data: [numbers]})
    if data == "gmsh:physical":
        content.cell_data["gmsh:geometrical"] = [numbers]
        content.field_data = {"tissue": np.array([1, mesh.dimension]), "tumour": np.array([7, mesh.dimension])}
        content.point_data = {"gmsh:dim_tags": np.tile([mesh.dimension, 1], (len(points), 1))}
    if path.suffix == ".inp":
        sets = {name: [np.flatnonzero(mesh.labels == name)] for name in ("tissue", "tumour")}
        top = np.flatnonzero(mesh.points[:, -1] == 0.0)
        every = [np.arange(len(mesh.cells))]
        content = meshio.Mesh(
            points, [(mesh.shape, mesh.cells)], cell_sets={"all": every, **sets}, point_sets={"skin": top}
        )
    content.write(path, **options)
    return path


FORMATS = {
    "msh 2.2": ("a.msh", {"file_format": "gmsh22", "data": "gmsh:physical"}),
    "msh 2.2 binary": ("a.msh", {"file_format": "gmsh22", "data": "gmsh:physical", "binary": True}),
    "vtk": ("a.vtk", {}),
    "vtk ascii": ("a.vtk", {"binary": False, "data": "Material"}),
    "vtu": ("a.vtu", {}),
    "medit": ("a.mesh", {"data": "medit:ref"}),
    "abaqus": ("a.inp", {}),
}
SHAPES = {"tetra": tetrahedra(BOX), "hexahedron": BOX, "triangle": triangles(PLATE), "quad": PLATE}
SHAPES["tetra"] = fe.Mesh(
    BOX.points, SHAPES["tetra"].cells, "tetra", np.tile(BOX.labels, 6)
)  # six tetrahedra of each hexahedron
SHAPES["triangle"] = fe.Mesh(PLATE.points, SHAPES["triangle"].cells, "triangle", np.tile(PLATE.labels, 2))


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("name, options", FORMATS.values(), ids=FORMATS)
def test_a_mesh_comes_back_from_a_file_with_its_labels(tmp_path, shape, name, options):
    mesh = SHAPES[shape]
    path = saved(tmp_path / name, mesh, **options)
    named = options.get("data") == "gmsh:physical" or name == "a.inp"
    labels, lid = None if named else {1: "tissue", 7: "tumour"}, {"skin": "lid"} if name == "a.inp" else None
    found = read_mesh(path, depth_axis="xyz"[mesh.dimension - 1], unit="mm", labels=labels, boundaries=lid)
    np.testing.assert_allclose(found.points, 1e-3 * mesh.points, rtol=1e-10, atol=1e-15)
    np.testing.assert_array_equal(found.cells, mesh.cells)
    assert found.shape == shape and list(found.labels) == list(mesh.labels)
    if name == "a.inp":
        np.testing.assert_array_equal(found.boundaries["lid"], np.flatnonzero(mesh.points[:, -1] == 0.0))


@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize("shape", SHAPES)
def test_physical_groups_of_msh_4_1_are_labels(tmp_path, shape, binary):
    mesh = SHAPES[shape]
    names, d = ["tissue", "tumour"], mesh.dimension
    parts = [mesh.cells[mesh.labels == name] for name in names]
    numbers = [np.full(len(part), k + 1) for k, part in enumerate(parts)]
    inner = np.isin(np.arange(len(mesh.points)), parts[1])
    content = meshio.Mesh(
        np.pad(mesh.points, ((0, 0), (0, 3 - d))),
        [(shape, part) for part in parts],
        cell_data={"gmsh:physical": numbers, "gmsh:geometrical": numbers},
        point_data={"gmsh:dim_tags": np.column_stack([np.full(len(inner), d), 1 + inner])},
        field_data={name: np.array([k + 1, d]) for k, name in enumerate(names)},
        cell_sets={"gmsh:bounding_entities": [np.array([]), np.array([])]},
    )
    content.write(tmp_path / "a.msh", file_format="gmsh", binary=binary)
    found = read_mesh(tmp_path / "a.msh", depth_axis="xyz"[d - 1], unit="mm")
    for name, part in zip(names, parts):
        places = found.points[found.cells[found.labels == name]]
        np.testing.assert_allclose(places, 1e-3 * mesh.points[part], rtol=1e-10, atol=1e-15)


@pytest.mark.parametrize("version", ["22", "41"])
def test_a_plate_of_gmsh_has_the_parts_that_were_drawn(version):
    # 40 mm x 30 mm with a disc of 6 mm radius, y upwards, by gmsh 4.15.2; that of version 4.1 has cells of order 2
    found = read_mesh(HERE / f"gmsh_plate_{version}.msh", depth_axis="-y", unit="mm")
    assert found.shape == "triangle" and set(found.labels) == {"gel", "hard disc"}
    sizes = np.abs(volumes(found))
    assert sizes.sum() == pytest.approx(40e-3 * 30e-3, rel=1e-9)
    corners = sizes[found.labels == "hard disc"].sum() / (0.5 * 6e-3**2)  # n sin(2 pi / n)
    assert corners in [pytest.approx(n * np.sin(2.0 * np.pi / n), rel=1e-6) for n in range(6, 40)]
    np.testing.assert_allclose([found.low, found.high], [[0.0, 0.0], [40e-3, 30e-3]], atol=1e-12)
    skin = found.points[found.boundaries["skin"]]
    np.testing.assert_allclose(skin[:, 1], 0.0, atol=1e-12)
    np.testing.assert_allclose([skin[:, 0].min(), skin[:, 0].max()], [0.0, 40e-3], atol=1e-12)
    tissue = fe.Tissue(
        found, {"gel": fe.Elastic(10e3), "hard disc": fe.Elastic(50e3)}, symmetry="plane_strain",
        supports={"skin": "fixed"},
    )  # fmt: skip
    assert tissue.unknowns > 0


def test_abaqus_of_gmsh_has_the_same_plate():
    plate = read_mesh(HERE / "gmsh_plate_22.msh", depth_axis="-y", unit="mm")
    found = read_mesh(HERE / "gmsh_plate.inp", depth_axis="-y", unit="mm", labels={"hard_disc": "hard disc"})
    np.testing.assert_allclose(found.points, plate.points, atol=1e-12)
    assert sorted(zip(map(tuple, found.cells.tolist()), found.labels)) == sorted(
        zip(map(tuple, plate.cells.tolist()), plate.labels)
    )
    np.testing.assert_array_equal(found.boundaries["skin"], plate.boundaries["skin"])


AXES = {"x": (0, 1.0), "-x": (0, -1.0), "y": (1, 1.0), "-y": (1, -1.0), "z": (2, 1.0), "-z": (2, -1.0)}


@pytest.mark.parametrize("depth_axis", AXES)
@pytest.mark.parametrize("surface", [None, 0.5])
def test_the_body_is_turned_and_not_mirrored(tmp_path, depth_axis, surface):
    axis, sense = AXES[depth_axis]
    box = SHAPES["tetra"]
    path = saved(tmp_path / "a.vtu", box)
    found = read_mesh(path, depth_axis=depth_axis, surface=surface)
    along = sense * box.points[:, axis]
    begin = along.min() if surface is None else sense * surface
    np.testing.assert_allclose(found.points[:, 2], along - begin, atol=1e-12)
    np.testing.assert_allclose(volumes(found), volumes(box), rtol=1e-9)  # with their sign
    flat = PLATE if axis < 2 else None
    if flat is not None:
        found = read_mesh(saved(tmp_path / "b.vtu", flat), depth_axis=depth_axis, surface=surface)
        np.testing.assert_allclose(found.points[:, 0], flat.points[:, 1 - axis])  # a radius stays one


def test_a_plate_in_any_plane_is_one(tmp_path):
    for k, axes in enumerate(("xy", "xz", "yz")):
        points = np.full((len(PLATE.points), 3), 0.7)
        points[:, ["xyz".index(axis) for axis in axes]] = PLATE.points
        meshio.Mesh(points, [("quad", PLATE.cells)]).write(tmp_path / f"{k}.vtu")
        found = read_mesh(tmp_path / f"{k}.vtu", depth_axis=axes[1])
        np.testing.assert_allclose(found.points, PLATE.points, atol=1e-12)
        assert set(found.labels) == {"tissue"}


HIGHER = {"tetra10": "tetra", "triangle6": "triangle", "quad8": "quad", "quad9": "quad", "hexahedron20": "hexahedron"}


@pytest.mark.parametrize("kind, shape", HIGHER.items())
def test_cells_of_second_order_are_reduced_to_their_corners(tmp_path, kind, shape):
    mesh = SHAPES[shape]
    more = int(kind.removeprefix(shape)) - mesh.cells.shape[1]
    points = np.pad(mesh.points, ((0, 0), (0, 3 - mesh.dimension)))
    middles = points[mesh.cells].mean(axis=1).repeat(more, axis=0)  # where they are does not matter: they are dropped
    numbers = len(points) + np.arange(len(middles)).reshape(-1, more)
    meshio.Mesh(np.concatenate([points, middles]), [(kind, np.hstack([mesh.cells, numbers]))]).write(tmp_path / "a.vtu")
    found = read_mesh(tmp_path / "a.vtu", depth_axis="xyz"[mesh.dimension - 1])
    np.testing.assert_array_equal(found.cells, mesh.cells)
    np.testing.assert_array_equal(found.points, mesh.points)


def test_points_of_no_cell_are_dropped_and_boundaries_keep_theirs(tmp_path):
    box, order = SHAPES["tetra"], np.random.default_rng(0).permutation(len(BOX.points) + 5)
    points = np.full((len(order), 3), 99.0)
    points[order[: len(BOX.points)]] = BOX.points
    faces = order[BOX.cells[:, [0, 1, 2]]][BOX.points[BOX.cells[:, :4], 2].max(axis=1) == 0.0]
    stray = np.array([[order[-1], order[-2], order[-3]]])
    content = meshio.Mesh(
        points, [("vertex", [[order[-1]]]), ("triangle", faces), ("triangle", stray), ("tetra", order[box.cells])],
        cell_data={"medit:ref": [np.array([1]), np.full(len(faces), 4), np.array([5]), np.full(len(box.cells), 4)]},
    )  # fmt: skip
    content.write(tmp_path / "a.mesh")
    found = read_mesh(tmp_path / "a.mesh", depth_axis="z", labels={4: "liver"}, boundaries={4: "capsule", 5: "nothing"})
    assert len(found.points) == len(BOX.points) and set(found.labels) == {"liver"}
    np.testing.assert_allclose(np.sort(volumes(found)), np.sort(volumes(box)), rtol=1e-9)
    capsule = found.points[found.boundaries["capsule"]]
    expected = np.unique(BOX.points[BOX.points[:, 2] == 0.0], axis=0)
    assert np.all(capsule[:, 2] == 0.0) and len(capsule) <= len(expected)
    assert len(capsule) == len(np.unique(faces)) and len(found.boundaries["nothing"]) == 0


def test_groups_of_cells_faces_and_edges_may_have_the_same_number(tmp_path):
    box = SHAPES["tetra"]
    faces = BOX.cells[:, [0, 1, 2]][BOX.points[BOX.cells[:, :4], 2].max(axis=1) == 0.0]
    counts = [1, len(faces), len(box.cells)]
    content = meshio.Mesh(
        box.points, [("line", faces[:1, :2]), ("triangle", faces), ("tetra", box.cells)],
        cell_data={
            "gmsh:physical": [np.array([1]), np.full(counts[1], -1), np.ones(counts[2], dtype=int)],
            "gmsh:geometrical": [np.ones(count, dtype=int) for count in counts],
        },
        field_data={"rim": np.array([1, 1]), "skin": np.array([1, 2]), "liver": np.array([1, 3])},
    )  # fmt: skip
    content.write(tmp_path / "a.msh", file_format="gmsh22")
    found = read_mesh(tmp_path / "a.msh", depth_axis="z")
    assert set(found.labels) == {"liver"} and set(found.boundaries) == {"skin"}  # of a face in the other sense, too
    np.testing.assert_array_equal(found.boundaries["skin"], np.unique(faces))
    again = read_mesh(tmp_path / "a.msh", depth_axis="z", labels={1: "a"}, boundaries={"skin": "b"})
    assert set(again.labels) == {"a"} and set(again.boundaries) == {"b"}


def test_voxels_of_an_image_are_hexahedra(tmp_path):
    lines = [
        "# vtk DataFile Version 3.0", "voxels", "ASCII", "DATASET STRUCTURED_POINTS", "DIMENSIONS 3 3 4",
        "ORIGIN 0 0 0", "SPACING 1 2 0.5", "CELL_DATA 12", "SCALARS label int 1", "LOOKUP_TABLE default",
        " ".join(["0", "1"] * 6),
    ]  # fmt: skip
    path = tmp_path / "a.vtk"
    path.write_text("\n".join(lines) + "\n")
    found = read_mesh(path, depth_axis="z", unit="mm", labels={0: "fat", 1: "muscle"})
    assert found.shape == "hexahedron" and list(found.labels) == ["fat", "muscle"] * 6
    np.testing.assert_allclose(found.high, [2e-3, 4e-3, 1.5e-3])
    np.testing.assert_allclose(volumes(found), 1e-9)


def plain(path, points, cells, **options):
    meshio.Mesh(np.asarray(points, dtype=float), cells, **options).write(path)
    return path


TRIANGLE = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
ONE = [("triangle", [[0, 1, 2]])]
BAD = {
    "no cells": ("a.vtu", TRIANGLE, [("vertex", [[0]])], {}, "mesh is of points and lines only.*Mesh the body"),
    "lines": ("a.vtk", TRIANGLE, [("line", [[0, 1]])], {}, "mesh is of points and lines only"),
    "a shell": ("a.vtk", TRIANGLE, [("triangle", [[0, 1, 2], [0, 1, 3]])], {}, "mesh is a surface in space, a body"),
    "mixed": (
        "a.vtu", [*TRIANGLE[:3], [1.0, 1.0, 0.0], [0.0, 2.0, 0.0]],
        [("quad", [[0, 1, 3, 2]]), ("triangle", [[2, 3, 4]])], {},
        "cells is 1 of shape quad and 1 of shape triangle, must be of one shape.*without Recombine",
    ),
    "wedges": (
        "a.vtu", [*TRIANGLE[:3], [0, 0, 1], [1, 0, 1], [0, 1, 1]], [("wedge", [[0, 1, 2, 3, 4, 5]])], {},
        "cells is 1 of shape wedge, must be of one shape",
    ),
    "not finite": (
        "a.vtu", [*TRIANGLE[:2], [np.nan, 0.0, 0.0]], ONE, {}, r"coordinate is \[nan, 0",
    ),
    "metres": (
        "a.vtu", 100.0 * np.array(TRIANGLE), ONE, {"unit": "m"},
        "size of the body is 100 m, at most 10 m, in m. Give the unit",
    ),
    "unit": ("a.vtu", TRIANGLE, ONE, {"unit": "parsec"}, "unit is 'parsec', must be one of m,"),
    "axis": ("a.vtu", TRIANGLE, ONE, {"depth_axis": "z"}, "depth_axis is 'z', must be one of x, y"),
    "sign": ("a.vtu", TRIANGLE, ONE, {"depth_axis": "--y"}, "depth_axis is '--y'"),
    "label": ("a.vtu", TRIANGLE, ONE, {"labels": {3: "a"}}, "labels is 3, is not in the file, which has none"),
    "data": ("a.vtu", TRIANGLE, ONE, {"label_data": "T1"}, "label_data is T1, is not in the file, which has none"),
    "flat": (
        "a.vtu", [*TRIANGLE[:2], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [("triangle", [[0, 1, 2], [0, 1, 3]])], {},
        r"a\.vtu: cell 0 is flat",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name, points, cells, options, words", BAD.values(), ids=BAD)
def test_files_that_are_no_body_are_named(tmp_path, name, points, cells, options, words):
    path = plain(tmp_path / name, points, cells)
    with pytest.raises(nf.InputError, match=words) as error:
        read_mesh(path, **{"depth_axis": "y", "unit": "mm", **options})
    assert str(path) in str(error.value)


def test_labels_that_are_not_whole_numbers_are_named(tmp_path):
    path = plain(tmp_path / "a.vtu", TRIANGLE, ONE, cell_data={"label": [np.array([0.5])]})
    with pytest.raises(nf.InputError, match="cell data 'label' is not whole numbers, as labels need"):
        read_mesh(path, depth_axis="y")
    path = plain(tmp_path / "b.vtu", TRIANGLE, ONE, cell_data={"T1": [np.array([2.0])]})
    assert list(read_mesh(path, depth_axis="y", label_data="T1").labels) == ["2"]
    with pytest.raises(nf.InputError, match="labels is 3, is not in the file, which has 2"):
        read_mesh(path, depth_axis="y", label_data="T1", labels={3: "liver"})


@pytest.mark.parametrize(
    "name, content, words",
    [
        ("a.msh", b"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0", "mesh is not readable"),
        ("a.msh", b"\x00\x01\x02", "mesh is not readable"),
        ("a.vtu", b"<VTKFile>", "mesh is not readable"),
        ("a.mesh", b"MeshVersionFormatted 2\nDimension 3\nVertices\n99\n0 0", "mesh is not readable"),
        ("a.inp", b"*NODE\n1, 0, 0\n*ELEMENT, TYPE=CPE4\n1, 1, 1, 1, 1\n", "Element type not available: CPE4"),
        ("a.inp", b"", "mesh is without cells"),
        ("a.docx", b"", r"format of the mesh is '.docx', known are .msh, .vtk, .vtu, .mesh, .inp. Save it in one"),
    ],
)
def test_files_that_cannot_be_read_are_named_and_nothing_is_printed(tmp_path, capfd, name, content, words):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(nf.InputError, match=words):
        read_mesh(tmp_path / name, depth_axis="z")
    assert capfd.readouterr() == ("", "")


def test_files_that_do_not_exist_and_groups_that_miss_cells_are_named(tmp_path):
    with pytest.raises(nf.InputError, match=r"mesh is missing.*Check the name"):
        read_mesh(tmp_path / "a.msh", depth_axis="z")
    text = (HERE / "gmsh_plate_41.msh").read_text()
    head, entities = text.split("$Entities\n")
    surfaces = [line for line in entities.split("\n") if line.rstrip().endswith(" 1 6 1 5") or " 1 6 " in line]
    broken = entities.replace(surfaces[0], surfaces[0].replace(" 1 6 ", " 0 ", 1), 1)
    (tmp_path / "a.msh").write_text(head + "$Entities\n" + broken)
    with pytest.raises(nf.InputError, match="Some cells are in a physical group and some are not"):
        read_mesh(tmp_path / "a.msh", depth_axis="y")


def test_a_missing_package_is_named_with_its_extra(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "meshio", None)
    with pytest.raises(nf.InputError, match=r"meshio is not installed.*needleforce\[fe\]"):
        read_mesh(tmp_path / "a.msh", depth_axis="z")
