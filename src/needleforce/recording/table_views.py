# SPDX-License-Identifier: Apache-2.0
"""Some columns or some rows of a table, as a table."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..errors import InputError
from .columns import Column
from .recording import Note


@dataclass(frozen=True, eq=False)
class ColumnRange:
    """Columns of a table from ``first`` to the one before ``stop``, with the interface of ``FileTable``."""

    table: Any
    first: int
    stop: int

    def __getattr__(self, name: str) -> Any:
        return getattr(self.table, name)

    @property
    def headers(self) -> list[str]:
        """The headers of these columns."""
        return self.table.headers[self.first : self.stop]

    @property
    def units(self) -> list[str]:
        """The units of these columns that the file states apart from the headers."""
        return self.table.units[self.first : self.stop]

    @property
    def text_columns(self) -> frozenset[int]:
        """Those of these columns that hold no numbers."""
        return frozenset(k - self.first for k in self.table.text_columns if self.first <= k < self.stop)

    def numbers(self, columns: Mapping[str, Column]) -> tuple[dict[str, np.ndarray], str, bool]:
        """As ``FileTable.numbers``, for these columns."""
        return self.table.numbers(self._moved(columns))

    def texts(self, index: int) -> list[str]:
        """As ``FileTable.texts``, for one of these columns."""
        return self.table.texts(index + self.first)

    def fault(self, columns: Mapping[str, Column]) -> bool:
        """As ``FileTable.fault``."""
        return self.table.fault(self._moved(columns))

    def _moved(self, columns: Mapping[str, Column]) -> dict[str, Column]:
        return {q: replace(column, index=column.index + self.first) for q, column in columns.items()}

    def from_row(self, number: int) -> "ColumnRange | None":
        """As ``FileTable.from_row``."""
        found = self.table.from_row(number)
        return None if found is None else replace(self, table=found)


@dataclass(frozen=True, eq=False)
class RowRange:
    """Rows of a table from ``first`` to the one before ``stop``, with the interface of ``FileTable``."""

    table: Any
    first: int
    stop: int | None

    def __getattr__(self, name: str) -> Any:
        return getattr(self.table, name)

    def place(self, row: int) -> str:
        """The place of a row in the file."""
        return self.table.place(self.first + row)

    def numbers(self, columns: Mapping[str, Column]) -> tuple[dict[str, np.ndarray], str, bool]:
        """As ``FileTable.numbers``, for these rows."""
        values, sha256, complete = self.table.numbers(columns)
        return {q: each[self.first : self.stop].copy() for q, each in values.items()}, sha256, complete

    def from_row(self, number: int) -> None:
        """Raises InputError: rows above the samples are those of the whole table."""
        raise _within(self.table, number)

    def texts(self, index: int) -> list[str]:
        """As ``FileTable.texts``, for these rows."""
        return self.table.texts(index)[self.first : self.stop]


@dataclass(frozen=True, eq=False)
class RowSubset:
    """Rows of a table with the numbers ``rows`` (k,), with the interface of ``FileTable``."""

    table: Any
    rows: np.ndarray

    def __getattr__(self, name: str) -> Any:
        return getattr(self.table, name)

    def place(self, row: int) -> str:
        """The place of a row in the file."""
        return self.table.place(int(self.rows[row]))

    def numbers(self, columns: Mapping[str, Column]) -> tuple[dict[str, np.ndarray], str, bool]:
        """As ``FileTable.numbers``, for these rows."""
        values, sha256, complete = self.table.numbers(columns)
        return {q: each[self.rows] for q, each in values.items()}, sha256, complete

    def from_row(self, number: int) -> None:
        """Raises InputError: rows above the samples are those of the whole table."""
        raise _within(self.table, number)

    def texts(self, index: int) -> list[str]:
        """As ``FileTable.texts``, for these rows."""
        cells = self.table.texts(index)
        return [cells[row] for row in self.rows]


@dataclass(frozen=True, eq=False)
class ContinuedTime:
    """A table whose time starts again at the rows ``restarts``, with a time that continues there: phases of one
    recording, each with its own clock."""

    table: Any
    restarts: tuple[int, ...]

    def __getattr__(self, name: str) -> Any:
        return getattr(self.table, name)

    @property
    def notes(self) -> list[Note]:
        """Those of the table, and one on the time."""
        count = len(self.restarts)
        message = f"the time starts again {count} times where the depth continues: it is continued by the usual step"
        return [*self.table.notes, Note("phases", message.replace("1 times", "once"), count)]

    def numbers(self, columns: Mapping[str, Column]) -> tuple[dict[str, np.ndarray], str, bool]:
        """As ``FileTable.numbers``, with the time continued."""
        values, sha256, complete = self.table.numbers(columns)
        if "time" in values:
            values = values | {"time": self._continued(values["time"])}
        return values, sha256, complete

    def _continued(self, time: np.ndarray) -> np.ndarray:
        time = time.copy()
        for row in self.restarts:
            time[row:] += time[row - 1] - time[row] + np.nanmedian(np.diff(time[row:]))
        return time

    def from_row(self, number: int) -> None:
        """Raises InputError: rows above the samples are those of the whole table."""
        raise _within(self.table, number)


def _within(table: Any, number: int) -> InputError:
    limit, step = "it cannot be given for a recording within a table", "Leave it out."
    return InputError("first row", number, limit, str(table.path), step)
