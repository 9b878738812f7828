# SPDX-License-Identifier: Apache-2.0
"""Parquet by pyarrow: a file is one table, with its card and the values of the used columns."""

import hashlib
import os
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from ...errors import InputError, install_step
from ...files import MAX_RECORDING_BYTES, MAX_SAMPLES, check_count, read_bytes, unpacked_limit
from ..quantities import split
from ..table import Table
from .arrays import MAX_COLUMNS, check_size, reading

CARD = b"needleforce.card"  # the key of the card's lines in the file's metadata
_FORMAT = "Parquet"
_BATCH_ROWS = 1 << 16
_PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}


def pyarrow_for(path: str | os.PathLike) -> ModuleType:
    """The library ``pyarrow`` with its ``parquet``. Raises InputError with the extra to install if it is missing."""
    try:
        import pyarrow.parquet
    except ImportError:
        step = f"{install_step('pyarrow', 'parquet')} Or use a .csv file."
        raise InputError("Parquet", "not available", "it needs pyarrow", str(path), step) from None
    return pyarrow


def tables(path: Path) -> list[Table]:
    """The one table of a Parquet file. Raises InputError if it is damaged or has no rows."""
    import pyarrow.parquet

    content = read_bytes(path, "file", MAX_RECORDING_BYTES)
    with reading(path, _FORMAT):
        file = pyarrow.parquet.ParquetFile(pyarrow.BufferReader(content), page_checksum_verification=True)
        rows, fields = file.metadata.num_rows, list(file.schema_arrow)
        lines = (file.schema_arrow.metadata or {}).get(CARD, b"").decode("utf-8", "replace").split("\n")
    if not 0 < rows <= MAX_SAMPLES:
        limit = f"1 to {MAX_SAMPLES} can be read"
        raise InputError("number of samples", rows, limit, str(path), "Check that the export was complete.")
    check_count("columns", len(fields), MAX_COLUMNS, path)
    columns = _Columns(path, file, unpacked_limit(len(content)))
    return [
        Table(
            path=path,
            headers=[_header(field) for field in fields],
            read_column=columns.numbers,
            read_texts=columns.texts,
            comments=[(number, line.removeprefix("# ")) for number, line in enumerate(lines, 1) if line],
            sha256=hashlib.sha256(content).hexdigest(),
        )
    ]


def _header(field: Any) -> str:
    """The name of a column; time stamps and durations contain their unit and are read in seconds."""
    from pyarrow import types

    name = field.name.strip()
    return f"{split(name)[0]} [s]" if types.is_temporal(field.type) and hasattr(field.type, "unit") else name


class _Columns:
    """The columns of an open file, which unpack together to at most ``limit`` bytes."""

    def __init__(self, path: Path, file: Any, limit: int):
        self._path, self._file, self._limit = path, file, limit
        self._read: set[int] = set()

    def numbers(self, index: int) -> np.ndarray:
        """A column as (n,) float64, NaN for nulls. Raises InputError for one without numbers and for damage."""
        from pyarrow import float64, int64, types

        values, field = self._values(index), self._file.schema_arrow.field(index)
        kind = field.type
        counts = types.is_temporal(kind) and hasattr(kind, "unit")
        if not (counts or types.is_integer(kind) or types.is_floating(kind)):
            limit = "a column of numbers is needed"
            value = f"of type {str(kind)[:160]}"
            raise InputError(f"column {_header(field)!r}", value, limit, str(self._path), "Convert the column.")
        with reading(self._path, _FORMAT):
            if counts:
                values = values.cast(int64() if kind.bit_width == 64 else "int32").cast(int64())
            floats = values if kind == float64() else values.cast(float64(), safe=False)
            numbers = np.concatenate([_floats(chunk) for chunk in floats.chunks if len(chunk)])
        return numbers / _PER_SECOND[kind.unit] if counts else numbers

    def texts(self, index: int) -> list[str]:
        """A column as texts, empty for nulls. Raises InputError for damage."""
        with reading(self._path, _FORMAT):
            return ["" if value is None else str(value) for value in self._values(index).to_pylist()]

    def _values(self, index: int) -> Any:
        """A column, read in batches: the sizes that the file states may be wrong."""
        import pyarrow

        names = self._file.schema_arrow.names
        self._read.add(index)  # columns that were read before are still in memory
        check_size(8 * self._file.metadata.num_rows * len(self._read), self._limit, self._path)
        batches, size = [], 0
        with reading(self._path, _FORMAT):
            for batch in self._file.iter_batches(_BATCH_ROWS, columns=[names[index]], use_threads=False):
                batch.validate(full=True)
                batches.append(batch)
                size += batch.nbytes
                check_size(size, self._limit, self._path)
            table = pyarrow.Table.from_batches(batches, batches[0].schema)
        return table.column(table.schema.get_all_field_indices(names[index])[names[:index].count(names[index])])


def _floats(chunk: Any) -> np.ndarray:
    """The values (n,) of an array of float64, NaN for nulls; ``to_numpy`` would import pandas, which takes longer than
    reading a recording."""
    valid, data = chunk.buffers()
    values = np.frombuffer(data, float, len(chunk), 8 * chunk.offset)
    if valid is None:
        return values
    bits = np.unpackbits(np.frombuffer(valid, np.uint8), bitorder="little")
    return np.where(bits[chunk.offset : chunk.offset + len(chunk)], values, np.nan)
