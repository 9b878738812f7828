# SPDX-License-Identifier: Apache-2.0
"""Meshes that hang, exhaust or mislead what reads them: refused within bounds, with what to do; odd bodies are read."""

import base64
import os
import time
import zlib

import meshio
import numpy as np
import pytest

import needleforce as nf
from needleforce import fe
from needleforce.recording.formats import worker

VTK = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET STRUCTURED_POINTS\nORIGIN 0 0 0\nSPACING 1 1 1\nDIMENSIONS "
MSH = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"
INP = "*NODE\n1, 0, 0\n2, 1, 0\n3, 0, 1\n*ELEMENT, TYPE=CPS3\n1, 1, 2, 3\n"
XDMF = '<Xdmf Version="3.0"><Domain><Grid><Geometry Type="XYZ"><DataItem Dimensions="1 3" Format="Binary">%s</DataItem>'


def packed_points(blocks: int) -> str:
    """A VTU whose points are zeros, 4 MiB of them in each block of 4 kB."""
    size, packed = 1 << 22, zlib.compress(bytes(1 << 22))
    head = np.array([blocks, size, size, *[len(packed)] * blocks], dtype="<u8").tobytes()
    points = (base64.b64encode(head) + base64.b64encode(packed * blocks)).decode()
    return ('<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64" '
            'compressor="vtkZLibDataCompressor"><UnstructuredGrid><Piece NumberOfPoints="9" NumberOfCells="1"><Points>'
            f'<DataArray type="Float64" NumberOfComponents="3" format="binary">{points}</DataArray></Points></Piece>'
            "</UnstructuredGrid></VTKFile>")  # fmt: skip


OTHER = r"format of the mesh is '\.{}', known are \.msh, \.vtk, \.vtu, \.mesh, \.inp\. Save it in one of them"
MORE = "memory is not enough|not readable as a mesh, the library .* took more than"
HOSTILE = {
    "an empty node file": ("a.node", "", OTHER.format("node")),
    "OFF without numbers": ("a.off", "OFF\n", OTHER.format("off")),
    "ply without end": ("a.ply", "ply\nformat ascii 1.0\n", OTHER.format("ply")),
    "XDMF with a second file": ("a.xdmf", XDMF % "/dev/zero", OTHER.format("xdmf")),
    "an included device": ("a.inp", INP + "*INCLUDE, INPUT=/dev/zero\n", "mesh is in several files, one file"),
    "an included neighbour": ("a.inp", INP + "* include , INPUT=b.inp\n", "mesh is in several files, one file"),
    "a grid of 120 bytes": ("a.vtk", VTK + "3000 3000 3000\n", MORE),
    "a grid of ten million": ("a.vtk", VTK + "220 220 220\n", rf"number of points is 10648000, at most 4194304|{MORE}"),
    "a million million nodes": ("a.msh", MSH + "$Entities\n1000000000000 0 0 0\n", f"mesh is not readable|{MORE}"),
    "points that expand": ("a.vtu", packed_points(100), MORE),
    "nodes that are announced": ("a.msh", MSH.replace("4.1", "2.2") + "$Nodes\n4000000000\n1 0 0 0\n", MORE),
    "cells of no point": ("a.inp", INP.replace("1, 1, 2, 3", "1, 1, 2, 9"), "mesh is not readable"),
}  # fmt: skip


@pytest.fixture(autouse=True)
def short(monkeypatch, tmp_path):
    """One second of the processor and 256 MiB for a file, after the process has begun."""
    (tmp_path / "begun.inp").write_text(INP)
    fe.read_mesh(tmp_path / "begun.inp", depth_axis="y")
    monkeypatch.setattr(worker, "_TIME_S", 1.0)
    monkeypatch.setattr(worker, "_MEMORY_BYTES", 1 << 28)


@pytest.mark.parametrize("name, content, words", HOSTILE.values(), ids=HOSTILE)
def test_hostile_meshes_are_refused_within_bounds(tmp_path, name, content, words):
    (tmp_path / name).write_text(content)
    (tmp_path / "b.inp").write_text(INP)
    begun = time.monotonic()
    with pytest.raises(nf.InputError, match=words) as refused:
        fe.read_mesh(tmp_path / name, depth_axis="y")
    assert str(tmp_path / name) in str(refused.value) and refused.value.next_step
    assert time.monotonic() - begun < worker._WALL_FACTOR + 2.0


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no pipes in folders")
def test_links_and_pipes_are_refused_before_they_are_opened(tmp_path):
    (tmp_path / "a.inp").write_text(INP)
    (tmp_path / "link.inp").symlink_to("a.inp")
    os.mkfifo(tmp_path / "pipe.inp")
    with pytest.raises(nf.InputError, match=r"mesh is a link.*Name the file to which it leads"):
        fe.read_mesh(tmp_path / "link.inp", depth_axis="y")
    with pytest.raises(nf.InputError, match="mesh is a pipe"):
        fe.read_mesh(tmp_path / "pipe.inp", depth_axis="y")


def test_a_mesh_larger_than_256_mib_is_refused_before_it_is_read(tmp_path):
    with (tmp_path / "a.vtk").open("wb") as file:
        file.truncate((1 << 28) + 1)
    with pytest.raises(nf.InputError, match=r"size of the mesh is 268435457 bytes, at most 268435456"):
        fe.read_mesh(tmp_path / "a.vtk", depth_axis="y")


@pytest.mark.parametrize("order", [[0, 1, 2, 3], [0, 2, 1, 3]])
def test_a_body_of_one_element_is_read_whatever_the_sense_of_its_corners(tmp_path, order):
    corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    meshio.Mesh(corners, [("tetra", [order])]).write(tmp_path / "a.vtu")
    mesh = fe.read_mesh(tmp_path / "a.vtu", depth_axis="z", unit="mm")
    body = fe.Tissue(mesh, fe.Elastic(10e3, 0.3), supports={"top": "fixed"}, order=1)
    strained = np.zeros(body.elements.count)
    strained[body.elements.dofs.nodal_dofs[2]] = mesh.points[:, 2]  # a strain of 1 along the depth
    modulus = 10e3 * 0.7 / (1.3 * 0.4)  # E (1 - nu) / ((1 + nu) (1 - 2 nu))
    assert strained @ body.stiffness @ strained == pytest.approx(modulus * 1e-9 / 6.0)


def test_the_process_reads_the_next_mesh_after_one_that_it_did_not_survive(tmp_path):
    (tmp_path / "a.vtk").write_text(VTK + "3000 3000 3000\n")
    with pytest.raises(nf.InputError):
        fe.read_mesh(tmp_path / "a.vtk", depth_axis="y")
    (tmp_path / "b.inp").write_text(INP)
    assert len(fe.read_mesh(tmp_path / "b.inp", depth_axis="y").cells) == 1


@pytest.mark.parametrize("scale", [1e-160, 5e-324])
def test_a_cell_too_small_for_its_volume_is_refused_without_a_warning(tmp_path, scale, recwarn):
    corners = scale * np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    with pytest.raises(nf.InputError, match="cell 0 is flat or folded"):
        fe.Mesh(corners, [[0, 1, 2, 3]], "tetra")
    assert not recwarn.list
