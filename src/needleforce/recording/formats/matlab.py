# SPDX-License-Identifier: Apache-2.0
"""MATLAB 4 and 5 by scipy: vectors, matrices, structs within each other and arrays of structs; version 7.3 is HDF5."""

import os
import re
import struct
import zlib
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ...files import open_regular, unpacked_limit
from ..table import Table
from .arrays import Array, FileArrays, check_size, orientation, reading

_FORMAT = "MATLAB"
_MAX_DEPTH = 16  # structs within each other
_VERSION4_NAME = re.compile(rb"[A-Za-z]\w*\0")
_HEAD_BYTES, _TAG_BYTES = 128, 8  # of a file of MATLAB 5, of an element
_MATRIX, _COMPRESSED, _OPAQUE = 14, 15, 17  # types of elements, and the class of arrays without a shape
_FLAGS = [6, 8]  # type and size of an array's first element
_VALUES = {1, 2, 3, 4, 5, 6, 7, 9, 12, 13, 16, 17, 18}  # types of elements with values
_EXPORT = (
    "In MATLAB, save it as text with writetable(T, 'run.csv'), or as a struct: S = table2struct(T, 'ToScalar', true)"
)
_UNITS = ("units", "unit", "Units", "Unit")  # a struct of texts with the names of the variables
_OBJECTS = {
    "timetable": f"{_EXPORT} with T = timetable2table(TT).",
    "timeseries": "In MATLAB, save its parts: t = ts.Time; x = ts.Data; save('run.mat', 't', 'x').",
}


def tables(path: Path) -> list[Table]:
    """The tables of a MATLAB 4 or 5 file: the vectors of one length in a struct or in the workspace, each matrix.

    Raises InputError for a damaged file, for one that would take more memory than a recording, and for MATLAB objects
    such as ``table``, with the command that exports them, if nothing else is in the file.
    """
    from scipy.io import loadmat

    found = FileArrays(path=path, format=_FORMAT, header=matlab_header)
    with reading(path, _FORMAT), open_regular(path) as file:
        _check_elements(file, path)
        variables = loadmat(file)
        _add_level(found, "", {k: v for k, v in variables.items() if not k.startswith("__")}, [], 0)
    return found.finish()


def _check_elements(file: BinaryIO, path: Path) -> None:
    """Raise ValueError where the elements of a MATLAB 5 file contradict each other: scipy skips some of their tags."""
    head, whole = file.read(_HEAD_BYTES), os.fstat(file.fileno()).st_size
    order = "<" if head[126:] == b"IM" else ">"
    while head.startswith(b"MATLAB 5.0") and whole - file.tell() >= _TAG_BYTES:
        kind, size = struct.unpack(f"{order}2I", file.read(_TAG_BYTES))
        if file.tell() + size > whole:
            raise ValueError("an array ends beyond the file")
        if kind == _COMPRESSED:
            content = zlib.decompressobj().decompress(file.read(size), unpacked_limit(whole) + 1)
            check_size(len(content), unpacked_limit(whole), path)
            _check_array(BytesIO(content), order, len(content))
        else:
            file.seek(-_TAG_BYTES, os.SEEK_CUR)
            _check_array(file, order, file.tell() + _TAG_BYTES + size)
    file.seek(0)


def _check_array(file: BinaryIO, order: str, end: int) -> None:
    """Check the elements of one array of the workspace up to its end, those of the arrays within it included."""
    while file.tell() < end:
        kind, size = _pass_element(file, order)
        if kind != _MATRIX or not size:
            continue
        *tag, flags, _ = struct.unpack(f"{order}4I", file.read(2 * _TAG_BYTES))
        if tag != _FLAGS:
            raise ValueError("an array without flags")
        if flags & 0xFF != _OPAQUE and (shape := _pass_element(file, order)[1]) < 8:
            raise ValueError(f"an array with a shape of {shape} bytes")
    if file.tell() > end:
        raise ValueError("an array ends within its values")


def _pass_element(file: BinaryIO, order: str) -> tuple[int, int]:
    """Type and size of the next element; the file is then behind its values, for an array at the first within it."""
    kind, size = struct.unpack(f"{order}2I", file.read(_TAG_BYTES))
    short, kind = kind >> 16, kind & 0xFFFF  # the size of one whose values are in the tag
    if short > 4 or (kind not in _VALUES and (short or kind != _MATRIX)):
        raise ValueError(f"an element of the type {kind} and {short or size} bytes")
    if not short and kind != _MATRIX:
        file.seek(size + -size % 8, os.SEEK_CUR)
    return kind, short or size


def matlab_header(name: str, index: int) -> str:
    """The header of a column of a matrix, as MATLAB writes it."""
    return f"{name}(:,{index + 1})"


def object_step(name: str) -> str:
    """How to export a MATLAB object of the class ``name``."""
    return _OBJECTS.get(name, f"{_EXPORT}.")


def _add_level(found: FileArrays, level: str, variables: dict[str, Any], outer: list, depth: int) -> None:
    """Add the variables of the workspace, or the fields of one struct; ``outer`` are the single values around it."""
    if depth > _MAX_DEPTH:
        raise ValueError(f"more than {_MAX_DEPTH} structs within each other")
    units = _texts_of(next((variables[key] for key in _UNITS if key in variables), None))
    arrays, comments, inner = [], [], []
    for name, value in _without_cells(variables):
        label = f"{level}.{name}".lstrip(".")
        if not isinstance(value, np.ndarray) or _class_of(value):
            _leave_out(found, label, value)
        elif facts := _facts(value):
            comments += [(f"{name}.{field}", each) for field, each in facts]
        elif signals := _signals(name, value):
            arrays += signals
        elif value.dtype.names:
            inner.append((label, value))
        elif value.dtype.kind in "USiuf" and value.size == 1:
            comments.append((name, value.flat[0]))
        elif value.dtype.kind in "iuf" and (sides := orientation(value.shape)):
            check_size(value.nbytes, unpacked_limit(found.path.stat().st_size), found.path)
            arrays.append(_array(name, value, sides, units.get(name, "")))
        elif value.size:
            found.leave_out(f"{label} ({_described(value)})")
    comments += outer
    found.add(level, arrays, comments)
    for label, structs in inner:
        for number, each in enumerate(structs.flatten("F"), 1):  # in MATLAB's order
            one = label if structs.size == 1 else f"{label}({number})"
            _add_level(found, one, {field: each[field] for field in structs.dtype.names}, comments, depth + 1)


def _signals(name: str, value: np.ndarray) -> list[Array]:
    """The signals of Simulink's "structure with time": an array of structs with ``values`` and ``label``, whose time is
    next to it. None of other structs."""
    if not value.dtype.names or not {"values", "label"} <= set(value.dtype.names):
        return []
    arrays = []
    for number, each in enumerate(value.flatten("F"), 1):
        values, label = each["values"], each["label"]
        if (
            not isinstance(values, np.ndarray)
            or values.dtype.kind not in "iuf"
            or not (sides := orientation(values.shape))
        ):
            return []
        named = isinstance(label, np.ndarray) and label.dtype.kind == "U" and label.size == 1 and str(label.flat[0])
        arrays.append(_array(named or (name if value.size == 1 else f"{name}({number})"), values, sides, ""))
    return arrays


def _facts(value: np.ndarray) -> list[tuple[str, Any]]:
    """The fields of one struct that holds single values and texts alone, such as settings; none of another."""
    if not value.dtype.names or value.size != 1:
        return []
    fields = [(name, value.flat[0][name]) for name in value.dtype.names]
    single = all(isinstance(each, np.ndarray) and each.dtype.kind in "USiuf" and each.size == 1 for _, each in fields)
    return [(name, each.flat[0]) for name, each in fields] if single else []


def _without_cells(variables: dict[str, Any]) -> Iterator[tuple[str, Any]]:
    """The variables, and the contents of cell arrays that hold arrays or structs instead of texts."""
    for name, value in variables.items():
        cells = isinstance(value, np.ndarray) and value.dtype == object and not _class_of(value)
        if not cells or not any(isinstance(each, np.ndarray) and _is_data(each) for each in value.flat):
            yield name, value
        elif value.size == 1:
            yield name, value.flat[0]
        else:
            yield from ((f"{name}{{{number}}}", each) for number, each in enumerate(value.flatten("F"), 1))


def _is_data(value: np.ndarray) -> bool:
    return bool(value.dtype.names) or (value.dtype.kind in "iuf" and value.size > 1)


def _array(name: str, value: np.ndarray, sides: tuple[int, int, bool], unit: str) -> Array:
    rows, columns, transposed = sides
    flat = value.reshape([size for size in value.shape if size != 1] if columns > 1 else [rows, 1])
    flat = flat.T if transposed and columns > 1 else flat
    return Array(
        name=name,
        rows=rows,
        columns=columns,
        read=lambda column: flat[:, column],
        units=[unit] * columns,
        vector=columns == 1,
    )


def _texts_of(value: Any) -> dict[str, str]:
    """The texts of a struct of texts, such as units by the name of the variable."""
    if not isinstance(value, np.ndarray) or not value.dtype.names or value.size != 1:
        return {}
    fields = {name: value.flat[0][name] for name in value.dtype.names}
    return {
        name: str(each.flat[0])
        for name, each in fields.items()
        if isinstance(each, np.ndarray) and each.dtype.kind == "U" and each.size == 1
    }


def _class_of(value: Any) -> str:
    """The class of a MATLAB object, empty for plain arrays and structs."""
    from scipy.io.matlab import MatlabFunction, MatlabObject, MatlabOpaque

    if isinstance(value, MatlabOpaque):
        return _text(value.flat[0]["s2"]) or "object"
    if isinstance(value, MatlabObject):
        return value.classname or "object"
    return "function" if isinstance(value, MatlabFunction) else ""


def _leave_out(found: FileArrays, name: str, value: Any) -> None:
    from scipy.io.matlab import MatlabOpaque

    kind = _class_of(value)
    if isinstance(value, MatlabOpaque):  # scipy names none of them
        name = _text(value.flat[0]["s0"]) or name
    if kind:
        found.step = object_step(kind)
    found.leave_out(f"{name} (of the MATLAB class {kind})" if kind else name)


def _text(value: Any) -> str:
    return value.decode("latin-1") if isinstance(value, bytes) else str(value)


def _described(value: np.ndarray) -> str:
    shape = "x".join(map(str, value.shape))
    return f"{shape} cells" if value.dtype == object else f"{shape} {value.dtype.name}"


def is_version4(start: bytes) -> bool:
    """Whether a file begins with an array of MATLAB 4: type, rows, columns, complex or not, and its name."""
    if len(start) < 24:
        return False
    for order, machine in (("<", 0), (">", 1)):
        kind, _, _, is_complex, length = struct.unpack_from(f"{order}5I", start)
        digits = kind // 1000, kind // 100 % 10, kind // 10 % 10, kind % 10
        if digits[:2] == (machine, 0) and digits[2] <= 5 and digits[3] <= 2 and is_complex <= 1 and 1 < length <= 64:
            return bool(_VERSION4_NAME.fullmatch(start[20 : 20 + length]))
    return False
