# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: E501 - the content of hostile files has long lines
"""Meshes for ``hostile_files.py``: valid ones of every format that is read, changes of their numbers, counts and
sections, and small files that stand for large meshes."""

import base64
import random
import re
import tempfile
import zlib
from collections.abc import Callable
from pathlib import Path

import meshio
import numpy as np

CORNERS = np.array([[x, y, z] for z in range(3) for y in range(3) for x in range(4)], dtype=float)
HEXAHEDRA = np.array([[0, 1, 5, 4, 12, 13, 17, 16], [1, 2, 6, 5, 13, 14, 18, 17], [16, 17, 21, 20, 28, 29, 33, 32]])
CELLS = {
    "hexahedron": HEXAHEDRA,
    "tetra": HEXAHEDRA[:, [[0, 1, 2, 6], [0, 2, 3, 6], [0, 1, 6, 5]]].reshape(-1, 4),
    "quad": HEXAHEDRA[:2, :4],
    "triangle": HEXAHEDRA[:2][:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3),
}
HUGE = [
    "-1",
    "0",
    "7",
    "255",
    "99999999",
    "2147483647",
    "2147483648",
    "4294967296",
    "9223372036854775807",
    "1" * 30,
    "1e308",
]
WORDS = [*HUGE, "nan", "inf", "x", "", "tetra", "\n", "\n\n", "$Nodes\n9\n", "$EndNodes\n", "$Elements\n4\n", "$Periodic\n1\n",
         "$PhysicalNames\n99999999\n", "$Comments\n", "$x\n", "\nPOINTS 9 float\n", "\nCELLS 999999999 999999999\n",
         "\nCELL_TYPES 3\n", "\nFIELD f 99999999\n", "\nDATASET STRUCTURED_POINTS\n", "\nDIMENSIONS 3000 3000 3000\n",
         "\nLOOKUP_TABLE x 99999999999\n", "\nMETADATA\n", "\nVertices\n", "\nRidges\n99999999999\n", "\nCorners\n9999999999\n",
         "\nDimension 0\n", "\n*INCLUDE, INPUT=/dev/zero\n", "\n*INCLUDE, INPUT=valid.inp\n", "\n*NSET, NSET=a, GENERATE\n1, 2147483647, 1\n",
         "\n*ELSET, ELSET=b\na\n", "<DataArray>", "</DataArray>", '"', "<", ">", "&b;", "<!DOCTYPE a>", "vtkZLibDataCompressor",
         "ascii", "binary", "appended", "Float64", "UInt8", "polyhedron", "\0", "\x1b[2J"]  # fmt: skip


def _saved(ending: str, shape: str, **options: object) -> bytes:
    numbers = [np.arange(len(CELLS[shape])) % 2 + 1]
    content = meshio.Mesh(CORNERS, [(shape, CELLS[shape])], cell_data={options.pop("data", "label"): numbers})
    if ending == ".msh":
        content.cell_data = {"gmsh:physical": numbers, "gmsh:geometrical": numbers}
        dimension = 2 if shape in ("quad", "triangle") else 3
        content.field_data = {"fat": np.array([1, dimension]), "muscle": np.array([2, dimension])}
        if options["fmt_version"] == "4.1":
            content.point_data = {"gmsh:dim_tags": np.tile([dimension, 1], (len(CORNERS), 1))}
        content.cell_sets = {"gmsh:bounding_entities": [np.array([])]}
    if ending == ".inp":
        content.cell_data, content.point_sets = {}, {"skin": np.arange(12)}
        content.cell_sets = {"fat": [np.array([0])], "all": [np.arange(len(CELLS[shape]))]}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"x{ending}"
        meshio.gmsh.write(path, content, **options) if ending == ".msh" else content.write(path, **options)
        return path.read_bytes()


def _gmsh(shape: str, form: int) -> bytes:
    return _saved(".msh", shape, fmt_version=("2.2", "4.0", "4.1")[form % 3], binary=form >= 3)


def _vtk(shape: str, form: int) -> bytes:
    if form == 4:
        return (b"# vtk DataFile Version 3.0\nvoxels\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 3 3 4\nORIGIN 0 0 0\n"
                b"SPACING 1 2 0.5\nCELL_DATA 12\nSCALARS label int 1\nLOOKUP_TABLE default\n" + b"0 1 " * 6 + b"\n")  # fmt: skip
    if form == 5:
        axes = b"".join(b"%c_COORDINATES 3 double\n0 1 2\n" % axis for axis in b"XYZ")
        return b"# vtk DataFile Version 3.0\nx\nASCII\nDATASET RECTILINEAR_GRID\nDIMENSIONS 3 3 3\n" + axes
    return _saved(".vtk", shape, file_format=("vtk42", "vtk51")[form % 2], binary=form >= 2)


def _vtu(shape: str, form: int) -> bytes:
    if form == 0:
        return _saved(".vtu", shape, binary=False)
    return _saved(".vtu", shape, compression=(None, "zlib", "lzma")[form % 3])


def content(kind: str) -> Callable[[random.Random], bytes]:
    """What makes a valid mesh of a format."""
    makers = {
        "msh": _gmsh,
        "vtk": _vtk,
        "vtu": _vtu,
        "medit": lambda shape, _: _saved(".mesh", shape, data="medit:ref"),
        "abaqus": lambda shape, _: _saved(".inp", shape),
    }
    made: dict[tuple[str, int], bytes] = {}

    def valid(chance: random.Random) -> bytes:
        key = chance.choice(list(CELLS)), chance.randrange(6)
        if key not in made:
            made[key] = makers[kind](*key)
        return made[key]

    return valid


def with_counts(data: bytes, chance: random.Random) -> bytes:
    """Numbers, names and sections replaced by others, among them counts of what is not there; lines moved or left out."""
    for _ in range(chance.choice([1, 1, 2, 4])):
        way = chance.random()
        if way < 0.7:
            places = [found.span() for found in re.finditer(rb"(?<![\w.])-?\d+(?![\w.])|[A-Za-z]{3,}", data[: 1 << 14])]
            begin, end = chance.choice(places or [(0, 0)])
            likely = [str(chance.randrange(40)), f"{chance.uniform(-3, 3):.3g}"]
            data = data[:begin] + chance.choice(likely if chance.random() < 0.5 else WORDS).encode() + data[end:]
        else:
            lines = data.splitlines(keepends=True)
            at, size = chance.randrange(len(lines) + 1), chance.choice([1, 1, 3, 20])
            lines[at : at + chance.choice([0, size])] = [*chance.choice([[], lines[at : at + size] * 2]),
                                                         chance.choice(WORDS).encode() + b"\n"]  # fmt: skip
            data = b"".join(lines)
    return data


def vtk_bomb(many: int, chance: random.Random) -> str:
    side = chance.choice([200, 1000, 3000, 2**31])
    axes = "".join(f"{axis}_COORDINATES {side} double\n{'0 ' * min(side, many)}\n" for axis in "XYZ")
    forms = [f"DATASET STRUCTURED_POINTS\nDIMENSIONS {side} {side} {side}\nORIGIN 0 0 0\nSPACING 1 1 1\n",
             f"DATASET RECTILINEAR_GRID\nDIMENSIONS {side} {side} {side}\n{axes}",
             f"DATASET UNSTRUCTURED_GRID\nPOINTS {side**3} double\n0 0 0\n",
             f"DATASET UNSTRUCTURED_GRID\nPOINTS 3 float\n0 0 0 1 0 0 0 1 0\nCELLS {many} {side**3}\n3 0 1 2\n",
             "DATASET STRUCTURED_POINTS\n" + "FIELD a 1\n" * many]  # fmt: skip
    return "# vtk DataFile Version 3.0\nx\nASCII\n" + chance.choice(forms)


def vtu_bomb(many: int, chance: random.Random) -> str:
    """Points of zeros, which take hardly any space when they are packed; or elements within each other."""
    if chance.random() < 0.3:
        return "<VTKFile type='UnstructuredGrid'>" + "<UnstructuredGrid>" * many
    blocks, size = max(1, many // 1000), 1 << 22
    packed = zlib.compress(bytes(size))
    head = base64.b64encode(np.array([blocks, size, size, *[len(packed)] * blocks], dtype="<u8").tobytes())
    points = (head + base64.b64encode(packed * blocks)).decode()
    return ('<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64" '
            'compressor="vtkZLibDataCompressor"><UnstructuredGrid><Piece NumberOfPoints="9" NumberOfCells="1"><Points>'
            f'<DataArray type="Float64" NumberOfComponents="3" format="binary">{points}</DataArray></Points></Piece>'
            "</UnstructuredGrid></VTKFile>")  # fmt: skip


def msh_bomb(many: int, chance: random.Random) -> str:
    count = chance.choice([10**9, 10**12, 2**62])
    forms = [f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{count}\n1 0 0 0\n",
             f"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n{count} 0 0 0\n",
             f"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n{count}\n" + '2 1 "a"\n' * many,
             "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n" + "$Comments\n$EndComments\n" * many]  # fmt: skip
    return chance.choice(forms)


def medit_bomb(many: int, chance: random.Random) -> str:
    count = chance.choice([10**9, 10**12, 2**62])
    forms = [f"Vertices\n{count}\n0 0 0 0\n", f"Ridges\n{count}\n" + "1\n" * many, "Identifier\n\n" * many]
    return "MeshVersionFormatted 2\nDimension 3\n" + chance.choice(forms)


def abaqus_bomb(many: int, chance: random.Random) -> str:
    nodes = "*NODE\n1, 0, 0\n2, 1, 0\n3, 0, 1\n*ELEMENT, TYPE=CPS3\n1, 1, 2, 3\n"
    forms = [nodes + "*NSET, NSET=a, GENERATE\n1, 2147483647, 1\n", nodes + "*ELEMENT, TYPE=CPS3\n1, 1, 2, 3\n" * many,
             nodes + "*ELSET, ELSET=a\n1\n" * many, nodes + "".join(f"*ELSET, ELSET=a{k}\n1\n" for k in range(many)),
             "*NODE\n1" + ", 0" * many, nodes + "*INCLUDE, INPUT=/dev/zero\n"]  # fmt: skip
    return chance.choice(forms)


BOMBS = {"msh": msh_bomb, "vtk": vtk_bomb, "vtu": vtu_bomb, "medit": medit_bomb, "abaqus": abaqus_bomb}
ENDINGS = {"msh": ".msh", "vtk": ".vtk", "vtu": ".vtu", "medit": ".mesh", "abaqus": ".inp"}
