# SPDX-License-Identifier: Apache-2.0
"""NumPy arrays in npy and npz files: read as a stream, column by column; pickled objects are never loaded."""

import math
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from ...errors import InputError
from ...files import open_regular, unpacked_limit
from ..file_table import FileTable
from .arrays import Array, FileArrays, check_count, check_size, orientation, reading, seconds_header, size_of

_FORMAT = "NumPy"
_ZIP = b"PK"
_BLOCK_BYTES = 1 << 20
_MAX_MEMBERS = 4096
_MAX_HEADER_BYTES = 1 << 16
_MAX_FIELDS, _MAX_DEPTH = 1024, 4  # of a structured array
_MAX_FIELD_VALUES = 64  # of a vector in a field
_NUMERIC = "iufmM"  # kinds of types; times are read in seconds
_PICKLED = "pickled Python objects"
_STEP = "Save plain arrays of numbers, such as np.savez(path, time=time, force=force)."
_MAX_SINGLE_BYTES = 4096  # of a single value that is kept with the table
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)  # those of np.savez and np.savez_compressed


def tables(path: Path) -> list[FileTable]:
    """The tables of an npy or npz file: vectors of one length, the fields of a structured array, each matrix.

    Raises InputError for a damaged file, for one that would take more memory than a recording, and if all arrays are
    pickled Python objects.
    """
    with open_regular(path) as file:
        zipped = file.read(2) == _ZIP
    found = FileArrays(path=path, format=_FORMAT, header=_header, step=_STEP)
    with reading(path, _FORMAT):
        stored = _members(path) if zipped else [_Stored(path=path, member="", name="")]
        comments: list[tuple[str, object]] = []
        level = [array for each in stored for array in each.arrays(found, comments)]
    found.add("", level, comments)
    return found.finish()


def _header(name: str, index: int) -> str:
    return f"{name}[:,{index}]" if name else f"column {index + 1}"


def _members(path: Path) -> "list[_Stored]":
    """The arrays of an archive, by its directory, which states their unpacked sizes."""
    with open_regular(path) as file, zipfile.ZipFile(file) as archive:
        members = archive.infolist()
        check_count("arrays", len(members), _MAX_MEMBERS, path)
        check_size(sum(each.file_size for each in members), unpacked_limit(path.stat().st_size), path)
        for each in members:
            if each.compress_type not in _METHODS or each.flag_bits & 1:
                limit = "deflate without encryption is read"
                raise InputError("compression", each.compress_type, limit, str(path), "Save it with np.savez.")
    names = [each.filename for each in members if each.filename.endswith(".npy")]
    return [_Stored(path=path, member=name, name=name.removesuffix(".npy")) for name in names]


@dataclass(frozen=True, kw_only=True)
class _Stored:
    """An array as it is stored: a file, or a member of an archive; a member's name is never used as a path."""

    path: Path
    member: str
    name: str

    @contextmanager
    def _open(self) -> Iterator[Any]:
        with open_regular(self.path) as file:
            if not self.member:
                yield file
                return
            with zipfile.ZipFile(file) as archive, archive.open(self.member) as stream:
                yield stream

    def arrays(self, found: FileArrays, comments: list[tuple[str, object]]) -> list[Array]:
        """The columns of the array, before they are read; a single value is added to the comments, and what is no
        table is noted."""
        with self._open() as file:
            head = _Head.read(file)
        shape, dtype = head.shape, head.dtype
        if math.prod(shape) == 1 and dtype.kind in "iufU" and dtype.itemsize <= _MAX_SINGLE_BYTES:
            comments.append((self.name, self._collect(head, 1, lambda block: block)[0]))
            return []
        if 0 in shape or not shape:
            found.leave_out(f"{self.name} ({_PICKLED if head.pickled else 'a single value or empty'})".strip())
            return []
        sides = orientation(shape)
        if sides is None or (dtype.names and sides[1] > 1):
            found.leave_out(f"{self.name} of shape {shape}")
            return []
        self._check_size(head)
        if dtype.names:
            found.add(self.name, [self._field(head, path, sides[0]) for path in _fields(dtype)])
            return []
        rows, columns, transposed = sides
        seconds = seconds_header(self.name, dtype)
        return [
            Array(
                name=self.name,
                rows=rows,
                columns=columns,
                read=lambda column: self._column(head, column, rows, columns, transposed),
                headers=[seconds] if seconds and columns == 1 else [],
                numeric=dtype.kind in _NUMERIC,
                vector=len(shape) == 1,
            )
        ]

    def _check_size(self, head: "_Head") -> None:
        """Refuse an array that is larger than what is stored."""
        if head.pickled:
            return
        if self.member:
            with open_regular(self.path) as file, zipfile.ZipFile(file) as archive:
                size = archive.getinfo(self.member).file_size
        else:
            size = self.path.stat().st_size
        stated = head.offset + size_of(head.shape, head.dtype.itemsize)
        if stated > size:
            limit = f"the file has {size} bytes"
            step = "Check that the file is complete, or save it again."
            raise InputError(f"size of the array {self.name!r}", f"{stated} bytes", limit, str(self.path), step)

    def _field(self, head: "_Head", path: "_Path", rows: int) -> Array:
        return Array(
            name=path.label,
            rows=rows,
            read=lambda _: self._collect(head, rows, path.of),
            headers=[seconds_header(path.label, path.dtype)],
            numeric=path.dtype.kind in _NUMERIC,
        )

    def _column(self, head: "_Head", column: int, rows: int, columns: int, transposed: bool) -> np.ndarray:
        """A column of a matrix; ``transposed`` if it is stored as a row."""
        if head.pickled:
            limit = "they are never loaded, because loading them can run any program"
            raise InputError(f"column {self.name!r}", f"of {_PICKLED}", limit, str(self.path), _STEP)
        if head.fortran != transposed or columns == 1:  # its values are next to each other
            return self._collect(head, rows, lambda block: block, first=column * rows)
        return self._collect(head, rows * columns, lambda block: block, every=columns, first=column)

    def _collect(
        self, head: "_Head", count: int, part: Callable[[np.ndarray], np.ndarray], every: int = 1, first: int = 0
    ) -> np.ndarray:
        """The ``part`` of ``count`` items in blocks, so that the other columns are never in memory together.

        With ``every``, one item of as many is taken, from ``first``; otherwise the items from ``first``.
        """
        item, blocks = head.dtype.itemsize, []
        with self._open() as file:
            file.seek(head.offset + (first * item if every == 1 else 0))
            per_block = max(1, _BLOCK_BYTES // max(1, item * every)) * every
            while count > 0:
                data = file.read(item * min(per_block, count))
                if len(data) < item * min(per_block, count):
                    raise ValueError("it ends within its values")
                block = part(np.frombuffer(data, head.dtype))
                blocks.append(block[first::every].copy() if every > 1 else block)
                count -= per_block
        return np.concatenate(blocks)


@dataclass(frozen=True, kw_only=True)
class _Head:
    """What the header of an array states."""

    shape: tuple[int, ...]
    fortran: bool
    dtype: np.dtype
    offset: int

    @property
    def pickled(self) -> bool:
        return self.dtype.hasobject

    @classmethod
    def read(cls, file: BinaryIO) -> "_Head":
        """The header at the start of a stream. Raises ValueError for one that is none or too long."""
        start = file.read(_MAX_HEADER_BYTES + 12)
        stream = BytesIO(start)
        version = np.lib.format.read_magic(stream)
        # version 3 differs from 2 in the encoding of the names of fields
        parse = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, fortran, dtype = parse(stream, max_header_size=_MAX_HEADER_BYTES)
        if version == (3, 0) and dtype.names:
            dtype.names = tuple(name.encode("latin-1").decode("utf-8") for name in dtype.names)
        if any(size < 0 for size in shape):
            raise ValueError("a negative size")
        return cls(shape=shape, fortran=fortran, dtype=dtype, offset=stream.tell())


@dataclass(frozen=True, kw_only=True)
class _Path:
    """The way to the values of a field within a structured array."""

    names: tuple[str, ...]
    index: tuple[int, ...] = ()
    dtype: np.dtype

    @property
    def label(self) -> str:
        return ".".join(self.names) + "".join(f"[{each}]" for each in self.index)

    def of(self, block: np.ndarray) -> np.ndarray:
        """The values of the field in (n,) items."""
        for name in self.names:
            block = block[name]
        return block[(slice(None), *self.index)]


def _fields(dtype: np.dtype, names: tuple[str, ...] = ()) -> list[_Path]:
    """The fields of a structured array, those of fields within fields and of short vectors in fields included."""
    found: list[_Path] = []
    for name in dtype.names or ():
        kind, shape = dtype[name].subdtype or (dtype[name], ())
        if kind.names and not shape and len(names) < _MAX_DEPTH:
            found += _fields(kind, (*names, name))
        elif not kind.names and size_of(shape, 1) <= _MAX_FIELD_VALUES:
            found += [_Path(names=(*names, name), index=index, dtype=kind) for index in np.ndindex(*shape)]
        if len(found) > _MAX_FIELDS:
            raise ValueError(f"more than {_MAX_FIELDS} fields")
    return found
