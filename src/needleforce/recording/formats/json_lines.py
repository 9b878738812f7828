# SPDX-License-Identifier: Apache-2.0
"""JSON: an object a line, a list of objects, or an object of lists of one length, by msgspec."""

from array import array
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from ...files import MAX_RECORDING_BYTES, check_count, open_regular, read_bytes, unpacked_limit
from ..recording import Note
from ..table import Table
from .arrays import MAX_COLUMNS, MAX_SIGNALS, MAX_TABLES, Array, FileArrays, check_size, reading

_FORMAT = "JSON"
_BOM = b"\xef\xbb\xbf"
_MAX_DOCUMENT_BYTES = 256 << 20  # of one value, which is in memory as a whole; lines are read one by one
_MAX_LINE_BYTES = 1 << 20
_MAX_DEPTH = 16
_NUMBER_BYTES = 8
_SHOWN_CHARS = 40
_CHECK = "Correct or remove the line."
_UNITS = ("units", "unit")
_MISSING = array("d", [np.nan])


def tables(path: Path) -> list[Table]:
    """The tables of a JSON file.

    JSON lines, and a list of objects, are one table with a row for each object; objects within it are columns such as
    ``wrench.fz``, lists of numbers ``q[0]``, ``q[1]``. An object of lists is a table for each length, and for each
    object within it. Raises InputError for a damaged line other than the last, which is left out with a note.
    """
    found = FileArrays(path=path, format=_FORMAT, header=lambda name, index: f"{name}[:,{index}]" if name else "")
    if _is_lines(path):
        rows, notes = _of_lines(path)
        found.add("", rows.arrays())
        made = found.finish()
        for each in made:
            each.notes.extend(notes)
        return made
    with reading(path, _FORMAT):
        content = read_bytes(path, "JSON file", _MAX_DOCUMENT_BYTES)
        _add(found, "", _decoded(content.removeprefix(_BOM)), [], 0)
    return found.finish()


def _decoded(text: bytes) -> Any:
    """A JSON value; NaN and Infinity, which JSON does not have, are accepted, because Python writes them."""
    import msgspec

    try:
        return msgspec.json.decode(text)
    except msgspec.DecodeError:
        if b"NaN" not in text and b"Infinity" not in text:
            raise
    import json

    return json.loads(text)


def _is_lines(path: Path) -> bool:
    """Whether the first line is an object and more follow."""
    import msgspec

    with open_regular(path) as file:
        first = next((line for line in iter(lambda: file.readline(_MAX_LINE_BYTES), b"") if line.strip()), b"")
        after = file.read(256).lstrip()
    try:
        return isinstance(_decoded(first.removeprefix(_BOM)), dict) and after.startswith(b"{")
    except (msgspec.DecodeError, ValueError, RecursionError):
        return False


def _of_lines(path: Path) -> "tuple[_Rows, list[Note]]":
    import msgspec

    rows, damaged = _Rows(path, "line"), 0
    with open_regular(path, "file", MAX_RECORDING_BYTES) as file:
        for number, line in enumerate(iter(lambda: file.readline(_MAX_LINE_BYTES), b""), 1):
            if not line.strip():
                continue
            if damaged:
                limit = "not an object of JSON" if len(line) < _MAX_LINE_BYTES else "too long"
                raise InputError("line", "not readable", limit, f"{path}, line {damaged}", _CHECK)
            try:
                rows.add(_object(_decoded(line.removeprefix(_BOM))), number)
            except (msgspec.DecodeError, RecursionError, ValueError) as error:
                if isinstance(error, InputError):
                    raise
                damaged = number
    return rows, [Note("cut_off", "the last line is truncated and is left out")] if damaged else []


def _object(value: Any) -> dict:
    if not isinstance(value, dict):
        raise ValueError("not an object")
    return value


class _Rows:
    """Objects as rows of columns of 8 bytes a value, NaN where an object lacks a value."""

    def __init__(self, path: Path, what: str):
        self._path, self._what, self._count = path, what, 0
        self._limit = unpacked_limit(path.stat().st_size)
        self._columns: dict[str, array] = {}
        self._texts: dict[str, tuple[int, str]] = {}  # the first text of a column, and where it is

    def add(self, row: dict, number: int) -> None:
        """Add the object in the line or entry ``number``."""
        for name, value in _flat(row):
            column = self._columns.get(name)
            if column is None:
                check_count("columns", len(self._columns) + 1, MAX_COLUMNS, self._path)
                column = self._columns[name] = array("d")
            if len(column) > self._count:
                continue  # a name that is there twice
            column.extend(_MISSING * (self._count - len(column)))
            column.append(self._number(name, value, number))
        self._count += 1
        if self._count % 1024 == 0:
            check_size(_NUMBER_BYTES * sum(map(len, self._columns.values())), self._limit, self._path)

    def _number(self, name: str, value: Any, number: int) -> float:
        if isinstance(value, int | float) and not isinstance(value, bool):
            return _float(value)
        if value is not None:
            self._texts.setdefault(name, (number, str(value)[:_SHOWN_CHARS]))
        return np.nan

    def arrays(self) -> list[Array]:
        """The columns."""
        return [
            Array(
                name=name,
                rows=self._count,
                read=lambda _, name=name: self._values(name),
                numeric=name not in self._texts or not np.isnan(self._columns[name]).all(),
            )
            for name in self._columns
        ]

    def _values(self, name: str) -> np.ndarray:
        if name in self._texts:
            number, text = self._texts[name]
            place = f"{self._path}, {self._what} {number}"
            raise InputError(f"column {name!r}", repr(text), "a number is needed", place, _CHECK)
        found = np.full(self._count, np.nan)
        found[: len(self._columns[name])] = self._columns[name]
        return found


def _flat(row: dict, prefix: str = "", depth: int = 0) -> Iterator[tuple[str, Any]]:
    """The values of an object by name, with those of the objects and short lists within it."""
    if depth > _MAX_DEPTH:
        raise ValueError(f"more than {_MAX_DEPTH} objects within each other")
    for key, value in row.items():
        name = f"{prefix}{key}"
        if isinstance(value, dict):
            yield from _flat(value, f"{name}.", depth + 1)
        elif isinstance(value, list):
            if len(value) <= MAX_SIGNALS:
                yield from ((f"{name}[{index}]", each) for index, each in enumerate(value) if _is_number(each))
        else:
            yield name, value


def _add(found: FileArrays, level: str, value: Any, outer: list, depth: int) -> None:
    """Add a list of objects as a table, or the lists of an object as tables, with the objects within it."""
    if depth > _MAX_DEPTH:
        raise ValueError(f"more than {_MAX_DEPTH} objects within each other")
    if isinstance(value, list):
        rows = _Rows(found.path, "entry")
        for number, each in enumerate(value, 1):
            rows.add(_object(each), number)
        found.add(level, rows.arrays(), outer)
    elif isinstance(value, dict):
        _add_object(found, level, value, outer, depth)


def _add_object(found: FileArrays, level: str, fields: dict, outer: list, depth: int) -> None:
    units = next((fields[key] for key in _UNITS if _is_all(fields.get(key), str)), {})
    arrays, comments, inner = [], [], []
    for name, value in fields.items():
        if isinstance(value, dict) and _is_indexed(value):  # as pandas writes a column
            value = list(value.values())
        label = f"{level}.{name}".lstrip(".")
        if isinstance(value, str | int | float) and not isinstance(value, bool):
            comments.append((name, value))
        elif isinstance(value, list) and value and all(isinstance(each, dict) for each in value[:2]):
            inner.append((label, value))
        elif _is_all(value, str | int | float) and value is not units:  # such as metadata
            comments += [(f"{name}.{key}", each) for key, each in value.items()]
        elif isinstance(value, dict) and value is not units:
            inner.append((label, value))
        elif isinstance(value, list) and name != "columns":  # the names of those of data, as pandas writes them
            array_of = _array(name, value, units.get(name, ""), fields.get("columns"))
            arrays += [array_of] if array_of else []
            found.leave_out(label) if array_of is None and len(value) > 1 else None
    comments += outer
    found.add(level, arrays, comments)
    check_count("tables", len(inner), MAX_TABLES, found.path)
    for label, value in inner:
        _add(found, label, value, comments, depth + 1)


def _array(name: str, values: list, unit: str, headers: Any) -> Array | None:
    """A list of numbers, or of lists of numbers of one length; None for anything else."""
    if len(values) < 2:
        return None
    if not isinstance(values[0], list):
        numeric = any(map(_is_number, values))
        return Array(name=name, rows=len(values), read=lambda _: _column(values), numeric=numeric, units=[unit])
    width = len(values[0])
    if not 1 <= width <= MAX_SIGNALS or any(not isinstance(row, list) or len(row) != width for row in values):
        return None
    names = headers if isinstance(headers, list) and len(headers) == width and name == "data" else []
    return Array(
        name=name,
        rows=len(values),
        columns=width,
        read=lambda column: _column([row[column] for row in values]),
        headers=[str(each) for each in names],
        units=[unit] * width,
        vector=False,
    )


def _column(values: list) -> np.ndarray:
    """Values as float64, NaN for null; texts keep a type that is no number."""
    if all(each is None or _is_number(each) for each in values):
        return np.array([np.nan if each is None else _float(each) for each in values])
    return np.array([""] * len(values))


def _float(value: float) -> float:
    """A number, infinite for an integer that is larger than any float."""
    try:
        return float(value)
    except OverflowError:
        return np.inf if value > 0 else -np.inf


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_all(value: Any, kind: type) -> bool:
    return isinstance(value, dict) and bool(value) and all(isinstance(each, kind) for each in value.values())


def _is_indexed(value: dict) -> bool:
    """Whether the keys of an object are the numbers of rows: 0, 1, 2 ..."""
    return len(value) > 1 and all(key == str(number) for number, key in enumerate(value))
