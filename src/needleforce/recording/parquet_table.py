# SPDX-License-Identifier: Apache-2.0
"""A Parquet file as a table: its headers, its card, and the values of the used columns."""

import hashlib
import os
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from ..errors import InputError
from ..files import MAX_RECORDING_BYTES, MAX_SAMPLES, read_bytes, unpacked_limit
from .columns import Column, split

EXTRA = "needleforce[parquet]"
CARD = b"needleforce.card"  # the key of the card's lines in the file's metadata
_MAX_FOOTER_BYTES = 16 << 20  # the description of columns and row groups
_MAX_COLUMNS = 1024  # as of a text file
_MAX_PAGE_BYTES = 64 << 20  # unpacked; writers make pages of 1 MiB
_BATCH_ROWS = 1 << 16
_CHECK = "Check that the file is complete, or export it again."
_MESSAGE_CHARS = 160  # characters of a library's message that are printed
_PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}


def pyarrow_for(path: str | os.PathLike) -> ModuleType:
    """The library ``pyarrow`` with its ``parquet``. Raises InputError with the extra to install if it is missing."""
    try:
        import pyarrow.parquet
    except ImportError:
        raise InputError(
            "Parquet",
            "not available",
            "it needs pyarrow",
            str(path),
            f"Install it with pip install '{EXTRA}', or use a .csv file.",
        ) from None
    return pyarrow


@dataclass(frozen=True, kw_only=True)
class ParquetLayout:
    """An open Parquet file, with the interface of ``Layout``; ``comments`` are the card's lines with their numbers."""

    path: Path
    headers: list[str]
    comments: list[tuple[int, str]]
    sha256: str
    file: Any
    content: bytes

    def place(self, row: int) -> str:
        """The place of a row: file and row number from 1."""
        return f"{self.path}, row {row + 1}"

    def numbers(self, columns: dict[str, Column]) -> tuple[dict[str, np.ndarray], str, bool]:
        """The columns as (n,) float64, NaN for nulls; the file's SHA-256; True, because every row has all its cells.

        Raises InputError for a column that does not contain numbers, and for a damaged file.
        """
        names = {quantity: self.file.schema_arrow.names[column.index] for quantity, column in columns.items()}
        with _as_input_error(self.path):
            self._check_pages({column.index for column in columns.values()})
            table = self._table(list(names.values()))
            found = {quantity: table.column(table.schema.get_field_index(name)) for quantity, name in names.items()}
        return {q: self._numbers(values, columns[q]) for q, values in found.items()}, self.sha256, True

    def _table(self, names: list[str]) -> Any:
        """The columns, read in batches: their sizes as stated may be wrong."""
        import pyarrow

        batches, size = [], 0
        for batch in self.file.iter_batches(_BATCH_ROWS, columns=names, use_threads=False):
            batch.validate(full=True)
            batches.append(batch)
            size += batch.nbytes
            self._check_size(size)
        return pyarrow.Table.from_batches(batches, batches[0].schema)

    def _check_pages(self, used: Collection[int]) -> None:
        """Refuse what would not fit into memory, before it is unpacked: each page states its own size, to which it is
        unpacked whatever the description of the file states."""
        size, metadata = 0, self.file.metadata
        for group in range(metadata.num_row_groups):
            for index in range(metadata.num_columns):
                column = metadata.row_group(group).column(index)
                if metadata.schema.column(index).path.split(".")[0] in self._names(used):
                    for unpacked in page_sizes(self.content, column):
                        size += unpacked
                        self._check_size(size, unpacked)

    def _names(self, used: Collection[int]) -> set[str]:
        return {self.file.schema_arrow.names[index] for index in used}

    def _check_size(self, size: int, page: int = 0) -> None:
        limit = unpacked_limit(len(self.content))
        if size > limit or page > _MAX_PAGE_BYTES:
            limits = f"at most {limit >> 20} MiB, {_MAX_PAGE_BYTES >> 20} MiB a page, for a file of this size"
            value = f"{max(size, page) >> 20} MiB"
            raise InputError("unpacked size", value, limits, str(self.path), "Check that it is a recording.")

    def _numbers(self, values: Any, column: Column) -> np.ndarray:
        from pyarrow import float64, int64, types

        kind = values.type
        counts = types.is_temporal(kind) and hasattr(kind, "unit")
        if not (counts or types.is_integer(kind) or types.is_floating(kind)):
            limit = "a column of numbers is needed"
            quantity = f"{column.quantity} (column {column.header!r})"
            raise InputError(
                quantity, f"of type {str(kind)[:_MESSAGE_CHARS]}", limit, str(self.path), "Convert the column."
            )
        with _as_input_error(self.path):
            if counts:
                values = values.cast(int64() if kind.bit_width == 64 else "int32").cast(int64())
            numbers = values.cast(float64(), safe=False).to_numpy()
        return numbers / _PER_SECOND[kind.unit] if counts else np.array(numbers)  # pyarrow's own is read-only


def open_parquet(path: Path) -> ParquetLayout:
    """Open a Parquet file. Raises InputError if it is damaged or has no rows, or if pyarrow is missing."""
    pyarrow, data = pyarrow_for(path), read_bytes(path, "file", MAX_RECORDING_BYTES)
    footer = int.from_bytes(data[-8:-4], "little")
    if footer > min(_MAX_FOOTER_BYTES, len(data)):
        limit = f"at most {_MAX_FOOTER_BYTES} bytes, and within the file"
        raise InputError("description of the columns", f"{footer} bytes", limit, str(path), _CHECK)
    with _as_input_error(path):
        file = pyarrow.parquet.ParquetFile(pyarrow.BufferReader(data), page_checksum_verification=True)
        rows, fields = file.metadata.num_rows, list(file.schema_arrow)
        lines = (file.schema_arrow.metadata or {}).get(CARD, b"").decode("utf-8", "replace").split("\n")
    if not 0 < rows <= MAX_SAMPLES:
        limit = f"1 to {MAX_SAMPLES} can be read"
        raise InputError("number of samples", rows, limit, str(path), "Check that the export was complete.")
    if len(fields) > _MAX_COLUMNS:
        limit = f"at most {_MAX_COLUMNS} can be read"
        raise InputError("number of columns", len(fields), limit, str(path), "Save fewer columns.")
    comments = [(number, line.removeprefix("# ")) for number, line in enumerate(lines, 1) if line]
    return ParquetLayout(
        path=path,
        headers=[_header(field) for field in fields],
        comments=comments,
        sha256=hashlib.sha256(data).hexdigest(),
        file=file,
        content=data,
    )


def _header(field: Any) -> str:
    """The name of a column; time stamps and durations contain their unit and are read in seconds."""
    from pyarrow import types

    name = field.name.strip()
    return f"{split(name)[0]} [s]" if types.is_temporal(field.type) and hasattr(field.type, "unit") else name


@contextmanager
def _as_input_error(path: Path) -> Iterator[None]:
    """Convert any exception of the library into an InputError: its exceptions have no common base class."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        why = (str(error).splitlines() or [""])[0][:_MESSAGE_CHARS]
        raise InputError("file", "not readable as Parquet", why, str(path), _CHECK) from error


def page_sizes(content: bytes, column: Any) -> Iterator[int]:
    """The unpacked size [bytes] that each page of a column of a row group states in its header.

    Raises ValueError for a header that is not one, and for pages beyond the end of the file.
    """
    starts = [at for at in (column.dictionary_page_offset, column.data_page_offset) if at]
    at, end = min(starts), min(starts) + column.total_compressed_size
    if not 0 < at <= end <= len(content):
        raise ValueError("a column is outside the file")
    while at < end:
        header = _Compact(content, at)
        sizes = header.small_integers()
        unpacked, packed = sizes.get(_UNPACKED, -1), sizes.get(_PACKED, -1)
        if unpacked < 0 or packed < 0:
            raise ValueError("a page without a size")
        yield unpacked
        at = header.at + packed


_UNPACKED, _PACKED = 2, 3  # numbers of fields of PageHeader, https://parquet.apache.org/docs/file-format/
_MAX_DEPTH = 8  # of structures in a header, which has 3


class _Compact:
    """A structure in Thrift's compact protocol; ``at`` is the place of the next byte."""

    def __init__(self, content: bytes, at: int):
        self._content, self.at = content, at

    def small_integers(self, depth: int = 0) -> dict[int, int]:
        """Number and value of the integer fields of a structure; its other fields are skipped."""
        if depth > _MAX_DEPTH:
            raise ValueError("structures within each other")
        found, number = {}, 0
        while head := self._byte():
            number = number + (head >> 4) if head >> 4 else self._integer()
            value = self._value(head & 15, depth)
            if value is not None:
                found[number] = value
        return found

    def _value(self, kind: int, depth: int) -> int | None:
        match kind:
            case 1 | 2:  # true, false
                pass
            case 3:
                self._byte()
            case 4 | 5 | 6:  # integers of 16, 32 and 64 bits
                return self._integer()
            case 7:  # double
                self.at += 8
            case 8:  # bytes
                count = self._count()  # moves, too
                self.at += count
            case 12:
                self.small_integers(depth + 1)
            case _:
                raise ValueError("a page header with lists or maps")
        return None

    def _byte(self) -> int:
        if self.at >= len(self._content):
            raise ValueError("a page header beyond the end of the file")
        self.at += 1
        return self._content[self.at - 1]

    def _count(self) -> int:
        value = shift = 0
        while True:
            byte = self._byte()
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return value
            if shift > 63:
                raise ValueError("an integer of more than 64 bits")

    def _integer(self) -> int:
        count = self._count()
        return (count >> 1) ^ -(count & 1)
