# SPDX-License-Identifier: Apache-2.0
"""A Parquet file as a table: its headers, its card, and the values of the used columns."""

import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from ..errors import InputError
from .columns import Column, split

EXTRA = "needleforce[parquet]"
CARD = b"needleforce.card"  # the key of the card's lines in the file's metadata
_MAX_ROWS = 1 << 28  # three days at 1 kHz: a damaged row count must not allocate all memory
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

    def place(self, row: int) -> str:
        """The place of a row: file and row number from 1."""
        return f"{self.path}, row {row + 1}"

    def numbers(self, columns: dict[str, Column]) -> tuple[dict[str, np.ndarray], str, bool]:
        """The columns as (n,) float64, NaN for nulls; the file's SHA-256; True, because every row has all its cells.

        Raises InputError for a column that does not contain numbers, and for a damaged file.
        """
        names = {quantity: self.file.schema_arrow.names[column.index] for quantity, column in columns.items()}
        with _as_input_error(self.path):
            table = self.file.read(columns=list(names.values()))
            table.validate(full=True)
            found = {quantity: table.column(table.schema.get_field_index(name)) for quantity, name in names.items()}
        return {q: self._numbers(values, columns[q]) for q, values in found.items()}, self.sha256, True

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
    pyarrow, data = pyarrow_for(path), path.read_bytes()
    with _as_input_error(path):
        file = pyarrow.parquet.ParquetFile(pyarrow.BufferReader(data), page_checksum_verification=True)
        rows, fields = file.metadata.num_rows, list(file.schema_arrow)
        lines = (file.schema_arrow.metadata or {}).get(CARD, b"").decode("utf-8", "replace").split("\n")
    if not 0 < rows <= _MAX_ROWS:
        limit = f"1 to {_MAX_ROWS} can be read"
        raise InputError("number of samples", rows, limit, str(path), "Check that the export was complete.")
    comments = [(number, line.removeprefix("# ")) for number, line in enumerate(lines, 1) if line]
    return ParquetLayout(
        path=path,
        headers=[_header(field) for field in fields],
        comments=comments,
        sha256=hashlib.sha256(data).hexdigest(),
        file=file,
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
        advice = "Check that the file is complete, or export it again."
        raise InputError("file", "not readable as Parquet", why, str(path), advice) from error
