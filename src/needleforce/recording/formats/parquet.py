# SPDX-License-Identifier: Apache-2.0
"""Parquet by pyarrow: a file is one table, with its card and the values of the used columns."""

import hashlib
import os
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from ...errors import InputError
from ...files import MAX_RECORDING_BYTES, MAX_SAMPLES, read_bytes, unpacked_limit
from ..file_table import FileTable
from ..quantities import split

EXTRA = "needleforce[parquet]"
CARD = b"needleforce.card"  # the key of the card's lines in the file's metadata
_MAX_FOOTER_BYTES = 2 << 20  # the description of columns and row groups, about 100 for each column of each group
_MAX_NESTED = 12  # structures or groups within each other; the format has 6
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


def tables(path: Path) -> list[FileTable]:
    """The one table of a Parquet file. Raises InputError as ``open_parquet``."""
    opened = open_parquet(path)
    return [
        FileTable(
            path=path,
            headers=opened.headers,
            read_column=opened.read_column,
            read_texts=opened.read_texts,
            comments=opened.comments,
            sha256=opened.sha256,
        )
    ]


@dataclass(frozen=True, kw_only=True)
class ParquetFile:
    """An open Parquet file; ``comments`` are the card's lines with their numbers."""

    path: Path
    headers: list[str]
    comments: list[tuple[int, str]]
    sha256: str
    file: Any
    content: bytes
    groups: list
    read: set[bytes] = field(default_factory=set)

    def read_column(self, index: int) -> np.ndarray:
        """A column as (n,) float64, NaN for nulls. Raises InputError for one without numbers and for damage."""
        return self._numbers(self._values(index), self.headers[index])

    def read_texts(self, index: int) -> list[str]:
        """A column as texts, empty for nulls. Raises InputError for damage."""
        with _as_input_error(self.path):
            return ["" if value is None else str(value) for value in self._values(index).to_pylist()]

    def _values(self, index: int) -> Any:
        name = self.file.schema_arrow.names[index]
        with _as_input_error(self.path):
            self.read.add(name.encode())  # columns that were read before are still in memory
            self._check_pages(self.read)
            self._check_size(8 * self.file.metadata.num_rows * len(self.read))  # pages of equal values state less
            table, nth = self._table([name]), self.file.schema_arrow.names[:index].count(name)
            return table.column(table.schema.get_all_field_indices(name)[nth])

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

    def _check_pages(self, names: Collection[bytes]) -> None:
        """Refuse what would not fit into memory, before it is unpacked: each page states its own size, to which it is
        unpacked whatever the description of the file states."""
        size = 0
        for group in self.groups:
            for chunk in group[_COLUMNS]:
                column = chunk[_COLUMN_METADATA]
                if column[_PATH][0] in names:
                    for unpacked in page_sizes(self.content, column):
                        size += unpacked
                        self._check_size(size, unpacked)

    def _check_size(self, size: int, page: int = 0) -> None:
        limit = unpacked_limit(len(self.content))
        if size > limit or page > _MAX_PAGE_BYTES:
            limits = f"at most {limit >> 20} MiB, {_MAX_PAGE_BYTES >> 20} MiB a page, for a file of this size"
            value = f"{max(size, page) >> 20} MiB"
            step = "Check that it is a recording; if it is, save it without compression."
            raise InputError("unpacked size", value, limits, str(self.path), step)

    def _numbers(self, values: Any, header: str) -> np.ndarray:
        from pyarrow import float64, int64, types

        kind = values.type
        counts = types.is_temporal(kind) and hasattr(kind, "unit")
        if not (counts or types.is_integer(kind) or types.is_floating(kind)):
            limit = "a column of numbers is needed"
            value = f"of type {str(kind)[:_MESSAGE_CHARS]}"
            raise InputError(f"column {header!r}", value, limit, str(self.path), "Convert the column.")
        with _as_input_error(self.path):
            if counts:
                values = values.cast(int64() if kind.bit_width == 64 else "int32").cast(int64())
            numbers = values.cast(float64(), safe=False).to_numpy()
        return numbers / _PER_SECOND[kind.unit] if counts else np.array(numbers)  # pyarrow's own is read-only


def open_parquet(path: Path) -> ParquetFile:
    """Open a Parquet file. Raises InputError if it is damaged or has no rows, or if pyarrow is missing."""
    pyarrow, data = pyarrow_for(path), read_bytes(path, "file", MAX_RECORDING_BYTES)
    groups = _row_groups(data, path)
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
    return ParquetFile(
        path=path,
        headers=[_header(field) for field in fields],
        comments=comments,
        sha256=hashlib.sha256(data).hexdigest(),
        file=file,
        content=data,
        groups=groups,
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
    except (InputError, MemoryError):
        raise
    except Exception as error:
        why = (str(error).splitlines() or [""])[0][:_MESSAGE_CHARS]
        raise InputError("file", "not readable as Parquet", why, str(path), _CHECK) from error


# numbers of fields, https://github.com/apache/parquet-format/blob/master/src/main/thrift/parquet.thrift
_SCHEMA, _ROW_GROUPS, _CHILDREN = 2, 4, 5
_COLUMNS, _COLUMN_METADATA, _PATH, _COMPRESSED, _DATA_PAGE, _DICTIONARY_PAGE = 1, 3, 3, 7, 9, 11
_UNPACKED, _PACKED = 2, 3


def _row_groups(content: bytes, path: Path) -> list[dict]:
    """The row groups in the description at the end of a file, read before the library sees it: that takes sizes and
    nesting as they are stated. Raises InputError for more than any recording has."""
    length = int.from_bytes(content[-8:-4], "little")
    if length > min(_MAX_FOOTER_BYTES, len(content) - 8):
        limit = f"at most {_MAX_FOOTER_BYTES} bytes, and within the file"
        raise InputError("description of the columns", f"{length} bytes", limit, str(path), _CHECK)
    with _as_input_error(path):
        footer = _Compact(content, len(content) - 8 - length).structure()
        left: list[int] = []  # children that are still to come, of each group within the other
        for element in footer[_SCHEMA]:
            left.append(element.get(_CHILDREN, 0))
            if len(left) > _MAX_NESTED:
                raise ValueError("groups of columns within each other")
            while left and not left[-1]:
                left.pop()
                if left:
                    left[-1] -= 1
        return footer[_ROW_GROUPS]


def page_sizes(content: bytes, column: dict) -> Iterator[int]:
    """The unpacked size [bytes] that each page of a column of a row group states in its header.

    Raises ValueError for a header that is not one, and for pages beyond the end of the file.
    """
    starts = [column[field] for field in (_DICTIONARY_PAGE, _DATA_PAGE) if column.get(field)]
    at, end = min(starts), min(starts) + column[_COMPRESSED]
    if not 0 < at <= end <= len(content):
        raise ValueError("a column is outside the file")
    while at < end:
        header = _Compact(content, at)
        sizes = header.structure()
        if sizes[_UNPACKED] < 0 or sizes[_PACKED] < 0:
            raise ValueError("a page without a size")
        yield sizes[_UNPACKED]
        at = header.at + sizes[_PACKED]


class _Compact:
    """Reads Thrift's compact protocol; ``at`` is the place of the next byte."""

    def __init__(self, content: bytes, at: int):
        self._content, self.at = content, at

    def structure(self, depth: int = 0) -> dict[int, Any]:
        """The fields of a structure by their number."""
        if depth > _MAX_NESTED:
            raise ValueError("structures within each other")
        found, number = {}, 0
        while head := self._byte():
            number = number + (head >> 4) if head >> 4 else self._integer()
            found[number] = None if head & 15 in (1, 2) else self._value(head & 15, depth)  # None: a truth value
        return found

    def _value(self, kind: int, depth: int) -> Any:
        match kind:
            case 1 | 2 | 3:  # a truth value in a list, an integer of 8 bits
                return self._byte()
            case 4 | 5 | 6:  # integers of 16, 32 and 64 bits
                return self._integer()
            case 7:  # a double
                return self._bytes(8)
            case 8:
                return self._bytes(self._count())
            case 9 | 10:
                head = self._byte()
                count = head >> 4 if head >> 4 < 15 else self._count()
                if count > len(self._content) - self.at:
                    raise ValueError("a list is longer than the file")
                return [self._value(head & 15, depth + 1) for _ in range(count)]
            case 12:
                return self.structure(depth + 1)
        raise ValueError("a type that Parquet does not use")

    def _bytes(self, count: int) -> bytes:
        self.at += count
        if self.at > len(self._content):
            raise ValueError("it ends within its description")
        return self._content[self.at - count : self.at]

    def _byte(self) -> int:
        return self._bytes(1)[0]

    def _count(self) -> int:
        value = shift = 0
        while shift < 64:
            byte = self._byte()
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return value
        raise ValueError("an integer of more than 64 bits")

    def _integer(self) -> int:
        count = self._count()
        return (count >> 1) ^ -(count & 1)
