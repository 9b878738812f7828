# SPDX-License-Identifier: Apache-2.0
"""Meshes of files: what meshio reads (gmsh, VTK, XDMF, Abaqus, MEDIT, MED ...) as cells of one shape, labels and
boundaries, in the frame of this package."""

import io
import os
import re
import warnings
from collections.abc import Iterator, Mapping
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from typing import Any

import numpy as np

from ... import units
from ...errors import InputError
from ...files import enough_memory, open_regular
from .mesh import CORNERS, DIMENSION, Mesh, library

_MAX_SIZE_M = 10.0
# in a file there are also boundaries, and shapes that are named when they are refused
_DIMENSION = {"vertex": 0, "line": 1, "wedge": 3, "pyramid": 3, **DIMENSION}
_CORNERS = {"vertex": 1, "line": 2, **CORNERS}
_LAGRANGE = {"CURVE": "line", "TRIANGLE": "triangle", "QUADRILATERAL": "quad", "TETRAHEDRON": "tetra"}
# cell data with the number of a label, in order of preference; the last is the number of a shape in gmsh
_NUMBERS = ("gmsh:physical", "medit:ref", "cell_tags", "su2:tag", "label", "labels", "material", "material_id",
            "materialid", "region", "gmsh:geometrical")  # fmt: skip


@dataclass(frozen=True)
class _Block:
    """Cells of one shape in the file, reduced to their corners; number or name of their label; names of numbers."""

    shape: str
    cells: np.ndarray
    labels: np.ndarray
    names: dict[int, str]

    @property
    def dimension(self) -> int:
        return _DIMENSION.get(self.shape, 3)


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
    """A mesh from a file of gmsh, VTK, VTU, XDMF, Abaqus, MEDIT, MED or another format that meshio reads.

    The cells of the highest dimension are the body. Those of the next lower one that have a name are boundaries, and so
    are named sets of points. Cells of higher order are reduced to their corners, and points of no cell are dropped.

    Parameters
    ----------
    path : str or os.PathLike
        The file; its ending states the format.
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
        If the package meshio is missing, the file cannot be read, has no cells of a body, has cells of several shapes,
        a coordinate that is not finite, or a body larger than 10 m; or if an axis, a unit, or a label is not known.
    """
    place = str(path)
    found = _read(path)
    blocks = list(_blocks(found, _number_data(found, label_data, place), place))
    body = _body(blocks, place)
    used, cells = np.unique(np.concatenate([each.cells for each in body]), return_inverse=True)
    if used[0] < 0 or used[-1] >= len(found.points):
        raise InputError("cells", f"up to point {used[-1]}", f"the file has {len(found.points)} points", place)
    points = _turned(_flattened(found.points[used], body[0].dimension, place), depth_axis, surface, place)
    points = _in_metres(points, unit, place)
    named = _named(body, labels, "labels", place)
    edges = _boundaries(blocks, found, boundaries, place)
    inside = {name: np.flatnonzero(np.isin(used, numbers)) for name, numbers in edges.items()}
    every = ["tissue" if label is None else label for _, row in named for label in row]
    shape = body[0].shape
    try:
        return Mesh(points, cells.reshape(-1, _CORNERS[shape]), shape, every, inside)
    except InputError as error:
        raise error.at(place) from None


def _read(path: str | os.PathLike) -> Any:
    """What meshio reads, which prints and ends the program where it cannot."""
    meshio, printed = library("meshio"), io.StringIO()
    open_regular(path, "mesh").close()
    try:
        with enough_memory(path), warnings.catch_warnings(), redirect_stdout(printed), redirect_stderr(printed):
            warnings.simplefilter("ignore")
            return meshio.read(path)
    except ModuleNotFoundError as missing:
        step = f"Run pip install {missing.name}, or save the mesh in another format."
        raise InputError(str(missing.name), "not installed", "this format needs it", str(path), step) from None
    except InputError:
        raise
    except (Exception, SystemExit) as error:  # parsers of some thirty formats, without errors of their own
        reason = " ".join((printed.getvalue().strip() or str(error)).split()).rstrip(".") or type(error).__name__
        step = "Check that the file is complete, or save it in another format, such as .msh of gmsh."
        if "gmsh:physical" in reason:
            step = "Some cells are in a physical group and some are not: save without Mesh.SaveAll, or group all."
        raise InputError("mesh", "not readable", reason, str(path), step) from None


def _number_data(found: Any, label_data: str | None, place: str) -> str | None:
    """Name of the cell data with labels."""
    if label_data is not None:
        if label_data not in found.cell_data:
            known = ", ".join(found.cell_data) or "none"
            raise InputError("label_data", label_data, f"is not in the file, which has {known}", place)
        return label_data
    names = {name.lower(): name for name in found.cell_data}
    return next((names[each] for each in _NUMBERS if each in names), None)


def _blocks(found: Any, data: str | None, place: str) -> Iterator[_Block]:
    sets = {} if data else found.cell_sets
    for k, block in enumerate(found.cells):
        shape = _shape(block.type)
        if shape is None:
            step = "Save triangles, quadrilaterals, tetrahedra or hexahedra."
            raise InputError("shape of cells", block.type, "has no elements here", place, step)
        cells = np.asarray(block.data)[:, : _CORNERS.get(shape)]
        labels = _whole_numbers(found.cell_data[data][k], data, place) if data else _set_names(sets, k, len(cells))
        if len(cells):
            yield _Block(shape, cells, labels, _names(found, data, _DIMENSION[shape]))


def _shape(kind: str) -> str | None:
    """Of the corners: of ``tetra10`` it is ``tetra``."""
    kind = kind.removeprefix("VTK_LAGRANGE_")
    kind = _LAGRANGE.get(kind, kind.lower())
    plain = re.fullmatch(r"([a-z]+)\d*", kind)
    return plain[1] if plain and plain[1] in _DIMENSION else None


def _whole_numbers(values: np.ndarray, data: str, place: str) -> np.ndarray:
    values = np.asarray(values)
    if values.ndim == 2 and values.shape[1] == 1:
        values = values[:, 0]
    if values.ndim != 1 or not np.all(np.isfinite(values)) or np.any(values != np.round(values)):
        step = "Name other cell data in label_data, such as numbers of materials."
        raise InputError(f"cell data {data!r}", "not whole numbers", "as labels need", place, step)
    numbers = values.astype(int)
    return (np.abs(numbers) if data.startswith("gmsh:") else numbers).astype(object)  # a sign there is a sense


def _set_names(sets: Mapping[str, list], block: int, count: int) -> np.ndarray:
    """Name of the smallest set that contains each cell, None without one."""
    sizes = {name: sum(np.size(part) for part in parts if part is not None) for name, parts in sets.items()}
    names = np.full(count, None, dtype=object)
    for name in sorted(sets, key=sizes.__getitem__)[::-1]:  # the smallest, and of equal ones the first, comes last
        parts = sets[name]
        if block < len(parts) and parts[block] is not None and not name.startswith("gmsh:"):
            inside = np.asarray(parts[block])
            if inside.ndim == 1 and inside.size:
                names[inside.astype(int)] = name
    return names


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
    unknown = next((shape for shape in counts if shape not in _CORNERS), None)
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
        raise InputError("coordinate", value, f"must be finite, as {wrong.sum()} are not", place)
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
        known = ", ".join(_shown(key, name) for key, name in seen.items() if key is not None) or "none"
        raise InputError(option, repr(unknown[0]), f"is not in the file, which has {known}", place)
    return result


def _names(found: Any, data: str | None, dimension: int) -> dict[int, str]:
    """Number of a label -> its name: physical names of gmsh, families of MED."""
    if data == "cell_tags":
        return {number: " and ".join(each) for number, each in getattr(found, "cell_tags", {}).items() if each}
    if data != "gmsh:physical":
        return {}
    return {int(number): name for name, (number, of) in found.field_data.items() if of == dimension}


def _shown(key: int | str, name: object) -> str:
    return str(key) if key == name else f"{key} ({name})"


def _boundaries(blocks: list[_Block], found: Any, renamed: Mapping | None, place: str) -> dict[str, np.ndarray]:
    """Name -> points in the file: of the cells of one dimension less that have a name, and of named sets of points."""
    dimension = max(each.dimension for each in blocks) - 1
    renamed, sets = dict(renamed or {}), found.point_sets
    parts: dict[str, list[np.ndarray]] = {renamed.pop(name, name): [np.asarray(each)] for name, each in sets.items()}
    for block, names in _named([x for x in blocks if x.dimension == dimension], renamed, "boundaries", place):
        for name in dict.fromkeys(names):
            if isinstance(name, str):
                parts.setdefault(name, []).append(block.cells[names == name].ravel())
    return {name: np.unique(np.concatenate(each)) for name, each in parts.items()}
