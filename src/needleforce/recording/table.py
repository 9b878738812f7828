# SPDX-License-Identifier: Apache-2.0
"""A table of a file of any format: headers, stated units, columns of numbers or texts, and the place of each row.

A column is read when it is used, because a wide file has many that nobody needs. Some columns of a table, some of its
rows, or its columns with a time put together are tables again.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from .quantities import names_quantity
from .recording import Note

_MAX_LISTED = 12  # values in a message

if TYPE_CHECKING:
    from .formats.text_rows import TextRows


@dataclass(frozen=True)
class TimeStamp:
    """A time in two columns of a file: seconds in ``whole``, and in ``rest`` what to add, of which ``per_second`` are a
    second."""

    whole: int
    rest: int
    per_second: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Table:
    """One table of a file.

    Parameters
    ----------
    path : Path
        The file.
    reading : callable
        A context that raises InputError if the file was replaced since it was opened, as ``same_file``.
    headers : list of str
        The name of each column.
    read_column : callable, optional
        Index of a column -> (n,) float64, NaN where a value is missing; InputError for a column without numbers.
    lines : TextRows, optional
        The rows of a table of text, in place of ``read_column``.
    units : list of str
        The unit that the file states for each column apart from its header, empty where it states none.
    name : str
        The name of the table in its file, such as a sheet; empty if the file has only one.
    comments : list of (int, str)
        What the file states about the table: line, and text such as ``filter_length: 10``.
    preamble : sequence of sequences of str
        The lines above the table that may state a rate, a speed or a unit, the nearest level first.
    decimal : str
        The decimal sign in them.
    sha256 : str
        SHA-256 of the file; of a text it is computed by ``digest``.
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
    first_column : int
        The column of the file that is the first of the table.
    rows : slice or (k,) array, optional
        Which rows of the file's table are rows of this one; default: all.
    stamp : TimeStamp, optional
        Two columns of the file that are one time.
    restarts : (int, tuple of int), optional
        The column of the file with a time that is continued, and the rows at which its clock starts again.
    """

    path: Path
    reading: Callable[[], AbstractContextManager] = nullcontext
    headers: list[str]
    read_column: Callable[[int], np.ndarray] | None = None
    lines: "TextRows | None" = None
    units: list[str] = field(default_factory=list)
    name: str = ""
    comments: list[tuple[int, str]] = field(default_factory=list)
    preamble: Sequence[Sequence[str]] = ()
    decimal: str = "."
    sha256: str = ""
    notes: list[Note] = field(default_factory=list)
    read_from: Callable[[int, int], np.ndarray] | None = None
    read_texts: Callable[[int], list[str]] | None = None
    row_name: str = "row"
    first_row: int = 1
    has_header: bool = True
    text_columns: frozenset[int] = frozenset()
    first_column: int = 0
    rows: slice | np.ndarray | None = None
    stamp: TimeStamp | None = None
    restarts: tuple[int, tuple[int, ...]] | None = None

    def numbers(self, index: int) -> np.ndarray:
        """A column as (n,) float64, NaN where a value is missing. Raises InputError for one that holds no numbers."""
        return self.read([index])[0][0]

    def readable(self, index: int) -> np.ndarray:
        """As ``numbers``, empty for a column that holds no numbers."""
        try:
            return self.numbers(index)
        except InputError:
            return np.empty(0)

    def read(self, indices: Iterable[int]) -> tuple[list[np.ndarray], bool]:
        """Columns as (n,) float64 each, and whether every row certainly has all its cells.

        Columns of unequal length end with the last row in which any has a value. Raises InputError, with ``column`` and
        the header as its quantity, for a column that holds no numbers.
        """
        columns = [self.first_column + index for index in indices]
        rest = [self.stamp.rest] if self.stamp and self.stamp.whole in columns else []
        with self.reading():
            values, complete = self._whole_columns([*columns, *rest])
        if self.stamp and rest:
            parts = values.pop() / self.stamp.per_second
            values = [each + parts if k == self.stamp.whole else each for k, each in zip(columns, values)]
        if self.rows is not None:
            values = [each[self.rows].copy() if isinstance(self.rows, slice) else each[self.rows] for each in values]
        if self.restarts:
            values = [self._continued(each) if k == self.restarts[0] else each for k, each in zip(columns, values)]
        return values, complete

    def _whole_columns(self, columns: Sequence[int]) -> tuple[list[np.ndarray], bool]:
        """All rows of columns of the file."""
        if self.lines is not None:
            return self.lines.numbers(columns)
        values = [self._array(column) for column in columns]
        rows = max(map(len, values), default=0)
        return [_filled(each, rows) for each in values], True

    def _array(self, column: int) -> np.ndarray:
        assert self.read_column is not None
        values = self.read_column(column)
        if values.ndim != 1:
            limit, step = "one value a row is needed", "Choose another column."
            header = self.headers[column - self.first_column]
            raise InputError(f"shape of {header!r}", values.shape, limit, str(self.path), step)
        return np.asarray(values, dtype=float)

    def _continued(self, time: np.ndarray) -> np.ndarray:
        """A time that continues by its usual step where its clock starts again."""
        assert self.restarts is not None
        time = time.copy()
        for row in self.restarts[1]:
            time[row:] += time[row - 1] - time[row] + np.nanmedian(np.diff(time[row:]))
        return time

    def texts(self, index: int) -> list[str]:
        """The values of a column as texts."""
        with self.reading():
            cells = self._whole_texts(self.first_column + index)
        if isinstance(self.rows, np.ndarray):
            return [cells[row] for row in self.rows]
        return cells if self.rows is None else cells[self.rows]

    def _whole_texts(self, column: int) -> list[str]:
        if self.lines is not None:
            return self.lines.texts(column)
        if self.read_texts is not None:
            return self.read_texts(column)
        return [f"{value:g}" if np.isfinite(value) else "" for value in self._array(column)]

    def is_cut_off(self, indices: Iterable[int]) -> bool:
        """Whether the last row is truncated, as one of a text may be.

        Raises InputError, as ``read``, for the first line in which one of the columns holds a text.
        """
        return self.lines is not None and self.lines.fault([self.first_column + index for index in indices])

    def place(self, row: int) -> str:
        """The place of a row: file, table, and its number."""
        if isinstance(self.rows, slice):
            row += self.rows.start
        elif self.rows is not None:
            row = int(self.rows[row])
        if self.lines is not None:
            return self.lines.place(row)
        return f"{self.path}{f', {self.name}' if self.name else ''}, {self.row_name} {self.first_row + row}"

    def digest(self) -> str:
        """SHA-256 of the file."""
        with self.reading():
            return self.sha256 if self.lines is None else self.lines.digest()

    @property
    def is_large(self) -> bool:
        """Whether the values are read in chunks, only when they are used."""
        return self.lines is not None and self.lines.is_large

    def only_columns(self, first: int, stop: int) -> "Table":
        """The columns from ``first`` to the one before ``stop``."""
        text = frozenset(k - first for k in self.text_columns if first <= k < stop)
        return replace(self, headers=self.headers[first:stop], units=self.units[first:stop], text_columns=text,
                       first_column=self.first_column + first)  # fmt: skip

    def only_rows(self, rows: slice | np.ndarray) -> "Table":
        """The rows of a slice, or with the numbers ``rows`` (k,)."""
        if self.rows is None:
            return replace(self, rows=rows)
        assert isinstance(self.rows, np.ndarray)
        return replace(self, rows=self.rows[rows])

    def in_segment(self, wanted: Mapping[str, str]) -> "Table":
        """The rows in which each of the ``wanted`` columns has its value, as text or as a number. Raises InputError if
        there is no such column or value."""
        chosen = [self._has_value(header, str(value).strip()) for header, value in wanted.items()]
        return self.only_rows(np.flatnonzero(np.all(chosen, axis=0)))

    def _has_value(self, header: str, value: str) -> np.ndarray:
        stated = self.lines.stated(header) if self.lines is not None and header not in self.headers else []
        if header not in self.headers and not any(stated):
            known = any(map(names_quantity, self.headers))  # of a file that is no recording nothing is quoted
            limit = f"the columns are {', '.join(map(repr, self.headers))}" if known else "inspect shows its columns"
            raise InputError("column of the segment", repr(header), limit, str(self.path), "Give one of them.")
        cells = stated or self.texts(self.headers.index(header))
        found = np.array([cell == value or _same_number(cell, value) for cell in cells], bool)
        if not found.any():
            limit = f"it contains {', '.join(list(dict.fromkeys(cells))[:_MAX_LISTED])}"
            raise InputError(f"column {header!r}", f"never {value}", limit, str(self.path), "Give one of its values.")
        return found

    def continue_time(self, index: int, restarts: tuple[int, ...]) -> "Table":
        """The table with the time in column ``index`` continued where its clock starts again, in the rows ``restarts``:
        phases of one recording, each with its own clock."""
        count = len(restarts)
        message = f"the time starts again {count} times where the depth continues: it is continued by the usual step"
        note = Note("phases", message.replace("1 times", "once"), count)
        return replace(self, restarts=(self.first_column + index, restarts), notes=[*self.notes, note])

    def from_row(self, number: int) -> "Table":
        """The table without the rows above the one with this number in the file.

        Raises InputError if it ends before, and for a table of some rows.
        """
        if self.rows is not None or self.restarts:
            limit, step = "it cannot be given for a recording within a table", "Leave it out."
            raise InputError("first row", number, limit, str(self.path), step)
        if self.lines is not None:
            lines = self.lines.from_row(number)
            if lines is None:
                limit = f"the table begins in row {self.first_row} and ends before"
                raise InputError("first row", number, limit, str(self.path), "Give the number of a row of the table.")
            return replace(self, lines=lines, first_row=lines.first_row)
        skipped = max(0, number - self.first_row)
        read_from = self.read_from or (lambda column, first: self._array(column)[first:])
        read_texts = self.read_texts and (lambda column: self._whole_texts(column)[skipped:])
        return replace(self, read_column=lambda column: read_from(column, skipped), read_texts=read_texts,
                       first_row=self.first_row + skipped)  # fmt: skip


def _same_number(cell: str, value: str) -> bool:
    try:
        return float(cell) == float(value)
    except ValueError:
        return False


def segments_of(tables: Sequence[Table], wanted: Mapping[str, str]) -> Sequence[Table]:
    """The tables with the rows of a segment, those that have it. Raises InputError, for the first, if none has."""
    found, refused = [], []
    for table in tables if wanted else ():
        try:
            found.append(table.in_segment(wanted))
        except InputError as error:
            refused.append(error)
    if refused and not found:
        raise refused[0]
    return found if wanted else tables


def _filled(values: np.ndarray, rows: int) -> np.ndarray:
    """The values with NaN up to ``rows``."""
    return np.concatenate([values, np.full(rows - len(values), np.nan)]) if len(values) < rows else values


def named_columns(columns: Any) -> Table:
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

    return Table(path=Path("DataFrame"), headers=[str(name) for name in names], read_column=read_column, first_row=0)
