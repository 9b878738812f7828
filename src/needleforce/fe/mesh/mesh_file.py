# SPDX-License-Identifier: Apache-2.0
"""Meshes of files: the safest formats that meshio reads, in the limited process that reads recordings, as cells of one
shape, labels and boundaries, in the frame of this package."""

import io
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from ... import units
from ...errors import InputError
from ...files import open_regular
from ...recording.formats import Format
from ...recording.formats.detect import read_tables
from ...recording.table import Table
from .mesh import CORNERS, DIMENSION, Mesh, library

_MAX_SIZE_M = 10.0
_MAX_BYTES = 1 << 28  # of a file
_MAX_COUNT = 1 << 22  # points, or cells of a shape: more than any solver here takes
# in a file there are also boundaries, and shapes that are named when they are refused
_DIMENSION = {"vertex": 0, "line": 1, "wedge": 3, "pyramid": 3, **DIMENSION}
_CORNERS = {"vertex": 1, "line": 2, "wedge": 6, "pyramid": 5, **CORNERS}
_LAGRANGE = {"CURVE": "line", "TRIANGLE": "triangle", "QUADRILATERAL": "quad", "TETRAHEDRON": "tetra"}
# cell data with the number of a label, in order of preference; the last is the number of a shape in gmsh
_NUMBERS = ("gmsh:physical", "medit:ref", "label", "labels", "material", "material_id", "materialid",
            "region", "gmsh:geometrical")  # fmt: skip
_SETS = "named sets of cells"  # header of the column with the number of a name
# formats that are complete in one file and of plain numbers; docs/howto/solid_meshes.md has the reasons
_ENDINGS = {".msh": "gmsh", ".vtk": "vtk", ".vtu": "vtu", ".mesh": "medit", ".inp": "abaqus"}
_MESH = Format(module=__name__, name="a mesh", limited=True, bytes_per_s=1e6, package="meshio")


@dataclass(frozen=True)
class _Block:
    """Cells of one shape in the file, reduced to their corners; number or name of their label; names of numbers."""

    shape: str
    cells: np.ndarray
    labels: np.ndarray
    names: dict[int, str]

    @property
    def dimension(self) -> int:
        return _DIMENSION[self.shape]


def read_mesh(
    path: str | os.PathLike,
    *,
    depth_axis: str,
    unit: str = "m",
    surface: float | None = None,
    labels: Mapping[int | str, str] | None = None,
    boundaries: Mapping[int | str, str] | None = None,
    label_data: str | None = None,
) -> Mesh:
    """A mesh from a file of gmsh (msh), VTK (vtk, vtu), MEDIT (mesh) or Abaqus (inp).

    The cells of the highest dimension are the body. Those of the next lower one that have a name are boundaries, and so
    are named sets of points. Cells of higher order are reduced to their corners, and points of no cell are dropped.

    Parameters
    ----------
    path : str or os.PathLike
        The file; its ending states the format. It may be no link, name no second file, and have at most 256 MiB and
        4 194 304 points and as many cells.
    depth_axis : str
        Axis of the file along which the depth increases: ``"z"``, or ``"-z"`` if z points out of the tissue. A file
        that ``write_vtk`` wrote has ``"z"`` in space and ``"y"`` in the plane.
    unit : str, optional
        Of the coordinates in the file, such as ``"mm"``; most formats do not state it.
    surface : float, optional
        Coordinate of the surface on that axis, in the unit of the file. Default: where the body begins.
    labels : dict, optional
        Number of a label in the file, or its name there -> label, such as ``{3: "liver"}``.
    boundaries : dict, optional
        The same for boundaries.
    label_data : str, optional
        Name of the cell data with the labels. Default: ``gmsh:physical``, ``medit:ref``, ``label``, ``material`` and
        others; without them the named sets of cells, of which the smallest counts; otherwise ``"tissue"``.

    Returns
    -------
    Mesh
        In m, with the depth last, positive inwards and 0 at the surface. The other axes keep their order from the depth
        axis on (z: x, y, z; x: y, z, x; y: z, x, y); the sense of the last of them is reversed with that of the
        depth in space, which keeps the body from being mirrored, and kept in the plane. Of a file in the plane the
        coordinate that is constant is dropped.

    Raises
    ------
    InputError
        If the package meshio is missing, the file cannot be read within the limits of docs/evidence/hostile_files.md,
        has no cells of a body, has cells of several shapes, a coordinate that is not finite, or a body larger than
        10 m; or if an axis, a unit, or a label is not known.
    """
    library("meshio")
    open_regular(path, "mesh", _MAX_BYTES, links=False).close()
    place, ending = str(path), Path(path).suffix
    if ending.lower() not in _ENDINGS:
        step = "Save it in one of them: in gmsh as msh, in ParaView as vtu, or with meshio convert."
        raise InputError("format of the mesh", repr(ending), f"known are {', '.join(_ENDINGS)}", place, step)
    nodes, sets, *shapes = read_tables(_MESH, Path(path))
    data = _number_data(shapes, label_data, place)
    blocks = [_block(each, data) for each in shapes]
    body = _body(blocks, place)
    used, cells = np.unique(np.concatenate([each.cells for each in body]), return_inverse=True)
    points = np.column_stack([nodes.numbers(k) for k in range(len(nodes.headers))])
    if used[0] < 0 or used[-1] >= len(points):
        limit = f"the file has {len(points)} points"
        raise InputError("cells", f"from point {used[0]} to {used[-1]}", limit, place, "Save the mesh again.")
    points = _turned(_flattened(points[used], body[0].dimension, place), depth_axis, surface, place)
    points = _in_metres(points, unit, place)
    named = _named(body, labels, "labels", place)
    edges = _boundaries(blocks, sets, boundaries, place)
    inside = {name: np.flatnonzero(np.isin(used, numbers)) for name, numbers in edges.items()}
    every = ["tissue" if label is None else label for _, row in named for label in row]
    shape = body[0].shape
    try:
        return Mesh(points, cells.reshape(-1, _CORNERS[shape]), shape, every, inside)
    except InputError as error:
        raise error.at(place) from None


def tables(path: Path) -> list[Table]:
    """Those of a file, called in the limited process."""
    try:
        found = _read(path)
        points = np.asarray(found.points, dtype=float)
        points = points if points.ndim == 2 else np.empty((0, 3))
        shapes = [_shape(each.type, path) * bool(len(each.data)) for each in found.cells]  # "" without cells
        cells = [_cells_table(found, shape, shapes, path) for shape in dict.fromkeys(filter(None, shapes))]
    except (InputError, MemoryError):
        raise
    except (Exception, SystemExit) as error:  # parsers without errors of their own
        reason = " ".join(str(error).split())[:200].rstrip(".") or "it is damaged, or of another format"
        step = "Check that the file is complete, or save it in another format, such as .msh of gmsh."
        if "gmsh:physical" in reason:
            step = "Some cells are in a physical group and some are not: save without Mesh.SaveAll, or group all."
        raise InputError("mesh", "not readable", reason, str(path), step) from None
    for what, count in [("points", len(points)), *((f"cells of shape {each.name}", each.first_row) for each in cells)]:
        if count > _MAX_COUNT:
            raise InputError(f"number of {what}", count, f"at most {_MAX_COUNT}", str(path), "Mesh it coarser.")
    sets = [np.asarray(each, dtype=float) for each in found.point_sets.values()]
    nodes = Table(path=path, headers=list("xyz"[: points.shape[1]]), read_column=lambda k: points[:, k])
    return [nodes, Table(path=path, headers=list(found.point_sets), read_column=sets.__getitem__), *cells]


def _read(path: Path) -> Any:
    """What meshio reads of a file, which is opened once and may include no other."""
    kind = _ENDINGS[path.suffix.lower()]
    with open_regular(path, "mesh", _MAX_BYTES, links=False) as file:
        source: Any = f"/dev/fd/{file.fileno()}" if os.path.exists("/dev/fd") else os.fspath(path)
        if kind == "abaqus":
            source = io.StringIO(file.read().decode("utf-8", "replace"), newline=None)
            lines = (line for line in source if not line.startswith("**"))
            if any(line.partition(",")[0].replace("*", "").strip().upper() == "INCLUDE" for line in lines):
                step = "Save it as one file, such as msh or vtu."
                raise InputError("mesh", "in several files", "one file without INCLUDE is read", str(path), step)
            source.seek(0)
        return import_module(f"meshio.{kind}").read(source)


def _cells_table(found: Any, shape: str, shapes: list[str], path: Path) -> Table:
    """The cells of one shape: columns of their corners, of the number of a named set, and of data; ``comments`` are
    numbers with their names, ``preamble`` the names of the sets."""
    chosen = [k for k, each in enumerate(shapes) if each == shape]
    cells = np.concatenate([np.asarray(found.cells[k].data)[:, : _CORNERS[shape]] for k in chosen])
    starts = dict(zip(chosen, np.cumsum([0, *(len(found.cells[k].data) for k in chosen)])))
    sets = {name: parts for name, parts in found.cell_sets.items() if not name.startswith("gmsh:")}
    names = found.field_data if "gmsh:physical" in found.cell_data else {}

    def column(index: int) -> np.ndarray:
        if index <= len(cells.T):
            return cells[:, index] if index < len(cells.T) else _set_numbers(sets, starts, len(cells))
        name = list(found.cell_data)[index - len(cells.T) - 1]
        return _whole_numbers(np.concatenate([found.cell_data[name][k] for k in chosen]), name, str(path))

    return Table(path=path, name=shape, headers=[*map(str, range(len(cells.T))), _SETS, *found.cell_data],
                 read_column=column, preamble=(list(sets),), first_row=len(cells),
                 comments=[(int(k), name) for name, (k, of) in names.items() if of == _DIMENSION[shape]])  # fmt: skip


def _number_data(tables: list[Table], label_data: str | None, place: str) -> str | None:
    """Name of the cell data with labels."""
    known = tables[0].headers[_CORNERS[tables[0].name] + 1 :] if tables else []
    if label_data is not None:
        if label_data not in known:
            listed = ", ".join(known) or "none"
            limit = f"is not in the file, which has {listed}"
            raise InputError("label_data", label_data, limit, place, "Name one of these, or leave it out.")
        return label_data
    names = {name.lower(): name for name in known}
    return next((names[each] for each in _NUMBERS if each in names), None)


def _block(table: Table, data: str | None) -> _Block:
    """The cells of a table with the numbers of ``data`` as labels, or without them the names of their sets."""
    corners = _CORNERS[table.name]
    cells = np.column_stack([table.numbers(k) for k in range(corners)]).astype(int)
    column = corners if data is None else table.headers.index(data, corners + 1)
    numbers = table.numbers(column).astype(int)
    if data is None:
        return _Block(table.name, cells, np.array([*table.preamble[0], None], dtype=object)[numbers], {})
    return _Block(table.name, cells, numbers.astype(object), dict(table.comments) if data == "gmsh:physical" else {})


def _shape(kind: str, path: Path) -> str:
    """Of the corners: of ``tetra10`` it is ``tetra``."""
    bare = kind.removeprefix("VTK_LAGRANGE_")
    plain = re.fullmatch(r"([a-z]+)\d*", _LAGRANGE.get(bare, bare.lower()))
    if plain is None or plain[1] not in _DIMENSION:
        step = "Save triangles, quadrilaterals, tetrahedra or hexahedra."
        raise InputError("shape of cells", kind, "has no elements here", str(path), step)
    return plain[1]


def _whole_numbers(values: np.ndarray, data: str, place: str) -> np.ndarray:
    values = np.asarray(values)
    if values.ndim == 2 and values.shape[1] == 1:
        values = values[:, 0]
    if values.ndim != 1 or not np.all(np.isfinite(values)) or np.any(values != np.round(values)):
        step = "Name other cell data in label_data, such as numbers of materials."
        raise InputError(f"cell data {data!r}", "not whole numbers", "as labels need", place, step)
    numbers = values.astype(int)
    return np.abs(numbers) if data.startswith("gmsh:") else numbers  # a sign there is a sense


def _set_numbers(sets: Mapping[str, list], starts: Mapping[int, int], count: int) -> np.ndarray:
    """Number of the smallest set that contains each cell, -1 without one; ``starts`` has where each block begins."""
    sizes = [sum(np.size(part) for part in parts if part is not None) for parts in sets.values()]
    numbers, every = np.full(count, -1), list(sets.values())
    for number in sorted(range(len(every)), key=sizes.__getitem__)[::-1]:  # of equal ones the first comes last
        for k, part in enumerate(every[number]):
            if k in starts and np.ndim(part) == 1 and np.size(part):
                numbers[starts[k] + np.asarray(part, dtype=int)] = number
    return numbers


def _body(blocks: list[_Block], place: str) -> list[_Block]:
    """The blocks of the highest dimension, of one shape."""
    dimension = max((each.dimension for each in blocks), default=0)
    if dimension < 2:
        value = "without cells" if not blocks else "of points and lines only"
        step = "Mesh the body before it is saved; in gmsh with Mesh > 2D or 3D."
        raise InputError("mesh", value, "triangles, quadrilaterals, tetrahedra or hexahedra are needed", place, step)
    body = [each for each in blocks if each.dimension == dimension]
    counts: dict[str, int] = {}
    for each in body:
        counts[each.shape] = counts.get(each.shape, 0) + len(each.cells)
    unknown = next((shape for shape in counts if shape not in CORNERS), None)
    if len(counts) > 1 or unknown:
        value = " and ".join(f"{count} of shape {shape}" for shape, count in counts.items())
        step = "Mesh it with triangles or tetrahedra only; in gmsh without Recombine and Layers."
        raise InputError("cells", value, "must be of one shape: triangle, quad, tetra or hexahedron", place, step)
    return body


def _flattened(points: np.ndarray, dimension: int, place: str) -> dict[str, np.ndarray]:
    """Coordinates of the points by axis of the file, as many as the body has dimensions."""
    wrong = ~np.isfinite(points).all(axis=1)
    if wrong.any():
        value = f"{points[wrong][0].tolist()} of a point"
        raise InputError("coordinate", value, f"must be finite, as {wrong.sum()} are not", place, "Repair the mesh.")
    axes = dict(zip("xyz", np.asarray(points, dtype=float).T))
    size = max(np.ptp(each) for each in axes.values())
    constant = [name for name in reversed(axes) if np.ptp(axes[name]) <= 1e-9 * size]
    while len(axes) > dimension and constant:
        del axes[constant.pop(0)]
    if len(axes) != dimension:
        step = "Fill the surface with tetrahedra before it is saved; in gmsh with Mesh > 3D."
        raise InputError("mesh", "a surface in space", "a body is needed", place, step)
    return axes


def _turned(axes: dict[str, np.ndarray], depth_axis: str, surface: float | None, place: str) -> np.ndarray:
    """Points whose last coordinate is the depth, in the unit of the file."""
    name = depth_axis.lower().lstrip("+-")
    if name not in axes or len(depth_axis) > len(name) + 1:
        known = ", ".join([*axes, *(f"-{each}" for each in axes)])
        step = "Name the axis along which the depth increases."
        raise InputError("depth_axis", repr(depth_axis), f"must be one of {known}", place, step)
    names = list(axes)
    first = names.index(name) + 1
    order = [*names[first:], *names[:first]]
    points = np.column_stack([axes[each] for each in order])
    if depth_axis.startswith("-"):
        points[:, -1 if len(order) == 2 else slice(1, None)] *= -1.0
        surface = None if surface is None else -surface
    points[:, -1] -= points[:, -1].min() if surface is None else surface
    return points


def _in_metres(points: np.ndarray, unit: str, place: str) -> np.ndarray:
    found = units.find(unit, "length")
    if found is None or found.symbol.startswith("-"):
        known = ", ".join(units.symbols("length"))
        raise InputError("unit", repr(unit), f"must be one of {known}", place)
    points = found.to_si(points)
    size = np.ptp(points, axis=0).max()
    if size > _MAX_SIZE_M:
        step = "Give the unit of the coordinates, such as unit='mm'."
        raise InputError("size of the body", f"{size:.4g} m", f"at most {_MAX_SIZE_M:g} m, in {unit}", place, step)
    return points


def _named(blocks: list[_Block], renamed: Mapping | None, option: str, place: str) -> list[tuple[_Block, np.ndarray]]:
    """Blocks with the labels of their cells: as the user names them, as the file does, or the number; None without."""
    renamed, seen = dict(renamed or {}), {}
    result = []
    for each in blocks:
        name_of = {key: each.names.get(key, key) for key in dict.fromkeys(each.labels)}
        seen |= name_of
        label_of = {key: renamed.get(key, renamed.get(name, name)) for key, name in name_of.items()}
        result.append((each, np.array([label_of[key] for key in each.labels], dtype=object)))
    unknown = [key for key in renamed if key not in seen and key not in seen.values()]
    if unknown:
        shown = (str(key) if key == name else f"{key} ({name})" for key, name in seen.items() if key is not None)
        known = ", ".join(shown) or "none"
        raise InputError(option, repr(unknown[0]), f"is not in the file, which has {known}", place)
    return result


def _boundaries(blocks: list[_Block], sets: Table, renamed: Mapping | None, place: str) -> dict[str, np.ndarray]:
    """Name -> points in the file: of the cells of one dimension less that have a name, and of named sets of points."""
    dimension = max(each.dimension for each in blocks) - 1
    renamed = dict(renamed or {})
    parts: dict[str, list[np.ndarray]] = {}
    for k, name in enumerate(sets.headers):
        parts[renamed.pop(name, name)] = [sets.numbers(k).astype(int)]
    for block, names in _named([x for x in blocks if x.dimension == dimension], renamed, "boundaries", place):
        for name in dict.fromkeys(names):
            if isinstance(name, str):
                parts.setdefault(name, []).append(block.cells[names == name].ravel())
    return {name: np.unique(np.concatenate(each)) for name, each in parts.items()}
