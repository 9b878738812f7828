# SPDX-License-Identifier: Apache-2.0
"""A table of a file of any format: headers, stated units, and columns of numbers that are read when they are used."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from .columns import Column
from .recording import Note


@dataclass(frozen=True, eq=False, kw_only=True)
class FileTable:
    """One table of a file.

    Parameters
    ----------
    path : Path
        The file.
    headers : list of str
        The name of each column.
    read_column : callable
        Index of a column -> (n,) float64, NaN where a value is missing; InputError for a column without numbers.
    units : list of str
        The unit that the file states for each column apart from its header, empty where it states none.
    name : str
        The name of the table in its file, such as a sheet; empty if the file has only one.
    comments : list of (int, str)
        What the file states about the table: line, and text such as ``filter_length: 10``.
    preamble : sequence of sequences of str
        The lines above the table that may state a rate, a speed or a unit, the nearest level first.
    sha256 : str
        SHA-256 of the file.
    notes : list of Note
        What was found while the table was opened, such as a truncated last line.
    row_name, first_row : str, int
        How the rows are called in messages, and the number of the first.
    has_header : bool
        False where the headers are the numbers of the columns.
    text_columns : frozenset of int
        Columns that are known to hold no numbers.
    read_from : callable, optional
        Index of a column and of the first row -> the values from there on, where rows above may hold text.
    read_texts : callable, optional
        Index of a column -> its cells as texts.
    """

    path: Path
    headers: list[str]
    read_column: Callable[[int], np.ndarray]
    units: list[str] = field(default_factory=list)
    name: str = ""
    comments: list[tuple[int, str]] = field(default_factory=list)
    preamble: Sequence[Sequence[str]] = ()
    sha256: str = ""
    notes: list[Note] = field(default_factory=list)
    read_from: Callable[[int, int], np.ndarray] | None = None
    read_texts: Callable[[int], list[str]] | None = None
    row_name: str = "row"
    first_row: int = 1
    has_header: bool = True
    text_columns: frozenset[int] = frozenset()

    def first_cells(self) -> list[str]:
        """The values of the first row, as a message shows them."""
        return [self._first_cell(index) for index in range(len(self.headers))]

    def _first_cell(self, index: int) -> str:
        try:
            values = self.read_column(index)
        except InputError:
            return "text"
        return f"{values[0]:g}" if len(values) and values.ndim == 1 and np.isfinite(values[0]) else ""

    def fault(self, columns: Mapping[str, Column]) -> bool:
        """Whether the last row is truncated: none is, as rows of arrays are whole."""
        return False

    def texts(self, index: int) -> list[str]:
        """The values of a column as texts."""
        if self.read_texts is not None:
            return self.read_texts(index)
        return [f"{value:g}" if np.isfinite(value) else "" for value in self.read_column(index)]

    def from_row(self, number: int) -> "FileTable | None":
        """The table without the rows above the one with this number in the file; None if it ends before."""
        skipped = max(0, number - self.first_row)
        read_from = self.read_from or (lambda index, first: self.read_column(index)[first:])
        read_texts = self.read_texts and (lambda index: self.texts(index)[skipped:])
        return replace(self, read_column=lambda index: read_from(index, skipped), read_texts=read_texts,
                       first_row=self.first_row + skipped)  # fmt: skip

    def place(self, row: int) -> str:
        """The place of a row: file, table, and its number."""
        return f"{self.path}{f', {self.name}' if self.name else ''}, {self.row_name} {self.first_row + row}"

    def numbers(self, columns: Mapping[str, Column]) -> tuple[dict[str, np.ndarray], str, bool]:
        """The columns as (n,) float64, the file's SHA-256, and that every row has all its cells.

        Columns of unequal length end with the last row in which any has a value. Raises InputError for a column that
        holds no numbers.
        """
        found = {quantity: self._read(column) for quantity, column in columns.items()}
        rows = max(map(len, found.values()), default=0)
        return {quantity: _filled(values, rows) for quantity, values in found.items()}, self.sha256, True

    def _read(self, column: Column) -> np.ndarray:
        try:
            values = self.read_column(column.index)
        except InputError as error:
            if error.quantity != f"column {column.header!r}":
                raise
            quantity = f"{column.quantity} ({error.quantity})"
            raise InputError(quantity, error.value, error.limit, error.place, error.next_step) from error
        if values.ndim != 1:
            limit, step = "one value a row is needed", "Choose another column."
            raise InputError(f"shape of {column.header!r}", values.shape, limit, str(self.path), step)
        return np.asarray(values, dtype=float)


def _filled(values: np.ndarray, rows: int) -> np.ndarray:
    """The values with NaN up to ``rows``."""
    return np.concatenate([values, np.full(rows - len(values), np.nan)]) if len(values) < rows else values


def named_columns(columns: Any) -> FileTable:
    """The columns of a DataFrame or of a mapping as a table; headers are recognised as in a file."""
    names = list(columns)

    def read_column(index: int) -> np.ndarray:
        values = columns.iloc[:, index] if hasattr(columns, "iloc") else columns[names[index]]
        try:
            return np.array(values, dtype=float)
        except (TypeError, ValueError):
            kind = str(getattr(values, "dtype", type(values).__name__))
            limit, step = "a column of numbers is needed", "Convert the column."
            raise InputError(f"column {str(names[index])!r}", f"of type {kind}", limit, "DataFrame", step) from None

    return FileTable(path=Path("DataFrame"), headers=[str(name) for name in names], read_column=read_column,
                     first_row=0)  # fmt: skip
