# SPDX-License-Identifier: Apache-2.0
"""A Parquet file as a table: its headers, its card, and the numbers of the columns in use."""

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from .columns import Column, split

EXTRA = "needleforce[parquet]"
CARD = b"needleforce.card"  # the key of the card's lines in the file's metadata
_MOST_ROWS = 1 << 28  # three days at 1 kHz: a damaged count of rows shall not ask for all memory
_SHOWN = 160  # characters of a library's message
_PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}


def pyarrow_for(path):
    """The library ``pyarrow`` with its ``parquet``. Raises InputError naming the extra where it is not installed."""
    try:
        import pyarrow.parquet
    except ImportError:
        raise InputError(
            "Parquet", "not available", "it needs pyarrow", str(path), f"pip install '{EXTRA}', or use a .csv file."
        ) from None
    return pyarrow


@dataclass(frozen=True)
class Stored:
    """What ``Layout`` is to a text file; ``comments`` are the lines of the card, each after its number."""

    path: Path
    headers: list[str]
    comments: list[tuple[int, str]]
    sha256: str
    file: Any

    def place(self, row: int) -> str:
        """Where a row stands: file and row, from 1."""
        return f"{self.path}, row {row + 1}"

    def numbers(self, columns: dict[str, Column]) -> tuple[dict[str, np.ndarray], str, bool]:
        """The columns as (n,) float64, NaN for nulls; the file's SHA-256; that every row has all its cells.

        Raises InputError for a column that holds no numbers, and for a damaged file.
        """
        names = {quantity: self.file.schema_arrow.names[column.index] for quantity, column in columns.items()}
        with _refusing(self.path):
            table = self.file.read(columns=list(names.values()))
            table.validate(full=True)
            found = {quantity: table.column(table.schema.get_field_index(name)) for quantity, name in names.items()}
        return {q: self._numbers(values, columns[q]) for q, values in found.items()}, self.sha256, True

    def _numbers(self, values, column: Column) -> np.ndarray:
        from pyarrow import float64, int64, types

        kind = values.type
        counts = types.is_temporal(kind) and hasattr(kind, "unit")
        if not (counts or types.is_integer(kind) or types.is_floating(kind)):
            limit = "a column of numbers is needed"
            quantity = f"{column.quantity} (column {column.header!r})"
            raise InputError(quantity, f"of type {str(kind)[:_SHOWN]}", limit, str(self.path), "Convert the column.")
        with _refusing(self.path):
            if counts:
                values = values.cast(int64() if kind.bit_width == 64 else "int32").cast(int64())
            numbers = values.cast(float64(), safe=False).to_numpy()
        return numbers / _PER_SECOND[kind.unit] if counts else np.array(numbers)  # pyarrow's own is read-only


def find_stored(path: Path) -> Stored:
    """Open a Parquet file. Raises InputError where it is damaged, has no rows, or pyarrow is missing."""
    pyarrow, data = pyarrow_for(path), path.read_bytes()
    with _refusing(path):
        file = pyarrow.parquet.ParquetFile(pyarrow.BufferReader(data), page_checksum_verification=True)
        rows, fields = file.metadata.num_rows, list(file.schema_arrow)
        lines = (file.schema_arrow.metadata or {}).get(CARD, b"").decode("utf-8", "replace").split("\n")
    if not 0 < rows <= _MOST_ROWS:
        limit = f"1 to {_MOST_ROWS} are read"
        raise InputError("number of samples", rows, limit, str(path), "Check that the export was complete.")
    comments = [(number, line.removeprefix("# ")) for number, line in enumerate(lines, 1) if line]
    return Stored(path, [_header(field) for field in fields], comments, hashlib.sha256(data).hexdigest(), file)


def _header(field) -> str:
    """The name of a column; time stamps and durations have a unit of their own, and are read in seconds."""
    from pyarrow import types

    name = field.name.strip()
    return f"{split(name)[0]} [s]" if types.is_temporal(field.type) and hasattr(field.type, "unit") else name


@contextmanager
def _refusing(path: Path) -> Iterator[None]:
    """Whatever the library says of a damaged file, as an InputError: its exceptions have no common base."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        why = (str(error).splitlines() or [""])[0][:_SHOWN]
        advice = "Check that the file is complete, or export it again."
        raise InputError("file", "not readable as Parquet", why, str(path), advice) from error
