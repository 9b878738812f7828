# SPDX-License-Identifier: Apache-2.0
"""NumPy arrays in npy and npz files, by numpy without pickles: npy files are mapped into memory."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ...errors import InputError
from ...files import check_count, open_regular, unpacked_limit
from ..table import Table
from .arrays import Array, FileArrays, check_size, orientation, reading, seconds_header, size_of

_FORMAT = "NumPy"
_ZIP = b"PK"
_MAX_MEMBERS = 4096
_MAX_HEADER_BYTES = 1 << 16
_MAX_FIELDS, _MAX_DEPTH = 1024, 4  # of a structured array
_MAX_FIELD_VALUES = 64  # of a vector in a field
_NUMERIC = "iufmM"  # kinds of types; times are read in seconds
_PICKLED = "pickled Python objects"
_STEP = "Save plain arrays of numbers, such as np.savez(path, time=time, force=force)."
_MAX_SINGLE_BYTES = 4096  # of a single value that is kept with the table
_METHODS = (0, 8)  # stored and deflate, those of np.savez and np.savez_compressed


def tables(path: Path) -> list[Table]:
    """The tables of an npy or npz file: vectors of one length, the fields of a structured array, each matrix.

    Raises InputError for a damaged file, for one that would take more memory than a recording, and if all arrays are
    pickled Python objects.
    """
    found = FileArrays(path=path, format=_FORMAT, header=_header, step=_STEP)
    with reading(path, _FORMAT):
        comments: list[tuple[str, object]] = []
        level = [array for stored in _stored(path) for array in _arrays(stored, found, comments)]
    found.add("", level, comments)
    return found.finish()


def _header(name: str, index: int) -> str:
    return f"{name}[:,{index}]" if name else f"column {index + 1}"


@dataclass(frozen=True, kw_only=True)
class _Stored:
    """An array as its header states it: in a file of its own, or as a member of an archive, of ``size`` bytes."""

    path: Path
    member: str
    size: int
    shape: tuple[int, ...]
    fortran: bool
    dtype: np.dtype
    offset: int

    @property
    def name(self) -> str:
        return self.member.removesuffix(".npy")

    def read(self) -> np.ndarray:
        """The array; that of an npy file remains there. Raises ValueError for pickled objects and a truncated file."""
        if self.dtype.hasobject:
            raise ValueError(_PICKLED)
        if not self.member:
            order = "F" if self.fortran else "C"
            with open_regular(self.path) as file:
                return np.memmap(file, self.dtype, mode="r", offset=self.offset, shape=self.shape, order=order)
        with _opened(self.path, self.member) as file:
            return np.lib.format.read_array(file, allow_pickle=False, max_header_size=_MAX_HEADER_BYTES)


@contextmanager
def _opened(path: Path, member: str) -> Iterator[BinaryIO]:
    """A file, or a member of an archive, whose name is never used as a path."""
    with open_regular(path) as file:
        if not member:
            yield file
            return
        from zipfile import ZipFile

        with ZipFile(file) as archive, archive.open(member) as stream:
            yield stream


def _stored(path: Path) -> list[_Stored]:
    """The arrays of a file. Raises InputError for an archive that would take more memory than a recording."""
    from zipfile import ZipFile

    sizes = {"": path.stat().st_size}
    with open_regular(path) as file:
        members = ZipFile(file).infolist() if file.read(len(_ZIP)) == _ZIP else None
    if members is not None:
        check_count("arrays", len(members), _MAX_MEMBERS, path)
        check_size(sum(each.file_size for each in members), unpacked_limit(sizes[""]), path)
        for each in members:
            if each.compress_type not in _METHODS or each.flag_bits & 1:
                limit = "deflate without encryption is read"
                raise InputError("compression", each.compress_type, limit, str(path), "Save it with np.savez.")
        sizes = {each.filename: each.file_size for each in members if each.filename.endswith(".npy")}
    return [_headed(path, member, size) for member, size in sizes.items()]


def _headed(path: Path, member: str, size: int) -> _Stored:
    """An array by its header. Raises ValueError for a header that is none or too long."""
    with _opened(path, member) as file:
        version = np.lib.format.read_magic(file)
        # version 3 differs from 2 in the encoding of the names of fields
        parse = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, fortran, dtype = parse(file, max_header_size=_MAX_HEADER_BYTES)
        offset = file.tell()
    if version == (3, 0) and dtype.names:
        dtype.names = tuple(name.encode("latin-1").decode("utf-8") for name in dtype.names)
    if any(side < 0 for side in shape):
        raise ValueError("a negative size")
    return _Stored(path=path, member=member, size=size, shape=shape, fortran=fortran, dtype=dtype, offset=offset)


def _arrays(stored: _Stored, found: FileArrays, comments: list[tuple[str, object]]) -> list[Array]:
    """The columns of an array, before they are read; a single value is added to the comments, and what is no table is
    noted."""
    name, shape, dtype = stored.name, stored.shape, stored.dtype
    if math.prod(shape) == 1 and dtype.kind in "iufU" and dtype.itemsize <= _MAX_SINGLE_BYTES:
        comments.append((name, stored.read().reshape(1)[0]))
        return []
    if 0 in shape or not shape:
        found.leave_out(f"{name} ({_PICKLED if dtype.hasobject else 'a single value or empty'})".strip())
        return []
    sides = orientation(shape)
    if sides is None or (dtype.names and sides[1] > 1):
        found.leave_out(f"{name} of shape {shape}")
        return []
    _check_stated_size(stored)
    rows, columns, transposed = sides
    if dtype.names:
        found.add(name, [_field(stored, rows, *each) for each in _fields(dtype)])
        return []

    def read(column: int) -> np.ndarray:
        if dtype.hasobject:
            limit = "they are never loaded, because loading them can run any program"
            raise InputError(f"column {name!r}", f"of {_PICKLED}", limit, str(stored.path), _STEP)
        values = stored.read()
        return values.reshape(columns, rows)[column] if transposed else values.reshape(rows, columns)[:, column]

    seconds = seconds_header(name, dtype)
    return [
        Array(
            name=name,
            rows=rows,
            columns=columns,
            read=read,
            headers=[seconds] if seconds and columns == 1 else [],
            numeric=dtype.kind in _NUMERIC,
            vector=len(shape) == 1,
        )
    ]


def _check_stated_size(stored: _Stored) -> None:
    """Refuse an array that is larger than what is stored."""
    stated = stored.offset + size_of(stored.shape, stored.dtype.itemsize)
    if stated > stored.size and not stored.dtype.hasobject:
        limit = f"the file has {stored.size} bytes"
        step = "Check that the file is complete, or save it again."
        raise InputError(f"size of the array {stored.name!r}", f"{stated} bytes", limit, str(stored.path), step)


def _field(stored: _Stored, rows: int, label: str, dtype: np.dtype, part: Callable[[Any], Any]) -> Array:
    return Array(
        name=label,
        rows=rows,
        read=lambda _: part(stored.read().reshape(rows)),
        headers=[seconds_header(label, dtype)],
        numeric=dtype.kind in _NUMERIC,
    )


def _fields(dtype: np.dtype, names: tuple[str, ...] = ()) -> list[tuple[str, np.dtype, Callable[[Any], Any]]]:
    """The name, type and values of the fields of a structured array, those of fields within fields and of short vectors
    in fields included."""
    found: list[tuple[str, np.dtype, Callable[[Any], Any]]] = []
    for name in dtype.names or ():
        kind, shape = dtype[name].subdtype or (dtype[name], ())
        path = (*names, name)
        if kind.names and not shape and len(names) < _MAX_DEPTH:
            found += _fields(kind, path)
        elif not kind.names and size_of(shape, 1) <= _MAX_FIELD_VALUES:
            found += [_part(path, index, kind) for index in np.ndindex(*shape)]
        if len(found) > _MAX_FIELDS:
            raise ValueError(f"more than {_MAX_FIELDS} fields")
    return found


def _part(names: tuple[str, ...], index: tuple[int, ...], dtype: np.dtype) -> tuple[str, np.dtype, Callable]:
    def values(items: Any) -> Any:
        for name in names:
            items = items[name]
        return items[(slice(None), *index)]

    return ".".join(names) + "".join(f"[{each}]" for each in index), dtype, values
