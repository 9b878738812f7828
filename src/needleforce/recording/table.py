# SPDX-License-Identifier: Apache-2.0
"""The used columns of a table, without the rows and columns whose values are missing."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..errors import InputError
from .columns import Column
from .file_table import FileTable
from .formats.text_table import TextTable
from .recording import Note

MAX_MISSING_SHARE = 0.01  # share of rows with a missing value that may be left out, with a note


@dataclass(kw_only=True)
class Table:
    """The used columns as (n,) float64 arrays in the file's units; ``rows`` are their row numbers in the file, None
    if no row was left out."""

    layout: Any  # FileTable, TextTable, or rows of one
    columns: dict[str, Column]
    values: dict[str, np.ndarray]
    notes: list[Note] = field(default_factory=list)
    rows: np.ndarray | None = None
    sha256: str = ""

    def place(self, row: int) -> str:
        """The place of a row of ``values`` in the file."""
        return self.layout.place(row if self.rows is None else int(self.rows[row]))

    def keep(self, mask: np.ndarray) -> None:
        """Keep the rows where ``mask`` is True."""
        self.rows = np.flatnonzero(mask) if self.rows is None else self.rows[mask]
        self.values = {quantity: values[mask] for quantity, values in self.values.items()}


def load(layout: FileTable | TextTable, columns: dict[str, Column]) -> tuple[Table, bool, bool]:
    """Read the columns: the table, whether no value is missing, and whether its last line is truncated.

    Rows at the end without any value are no rows. Raises InputError for text and for a wrong number of cells.
    """
    values, sha256, all_cells = layout.numbers(columns)
    complete = all_cells and all(map(_finite, values.values()))
    if not complete:
        values = _without_blank_end(values)
        complete = all_cells and all(map(_finite, values.values()))
    cut_off = not complete and layout.fault(columns)
    notes = list(getattr(layout, "notes", []))
    return Table(layout=layout, columns=columns, values=values, sha256=sha256, notes=notes), complete, cut_off


def _without_blank_end(values: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The columns up to the last row in which any has a value."""
    present = np.any([~np.isnan(each) for each in values.values()], axis=0)
    stop = int(np.flatnonzero(present)[-1]) + 1 if present.any() else 0
    return {quantity: each[:stop] for quantity, each in values.items()}


def _finite(values: np.ndarray) -> bool:
    """Whether all of (n,) values are finite; a finite sum proves it faster than a test of each value."""
    with np.errstate(all="ignore"):
        return bool(np.isfinite(values.sum()) or np.isfinite(values).all())


def drop_incomplete(table: Table, required: tuple[str, ...], cut_off: bool) -> None:
    """Leave out rows with missing values, with a note, if they are at most 1 % or a truncated last line.

    A column that is not ``required`` and misses more values is left out itself. Raises InputError for infinite values
    and for a required column with more missing values.
    """
    for quantity, values in table.values.items():
        infinite = np.flatnonzero(np.isinf(values))
        if len(infinite):
            raise _not_finite(table, quantity, infinite, "infinite")
    for quantity in list(table.values):
        _drop_column_if_incomplete(table, quantity, quantity in required, cut_off)
    complete = ~np.any([np.isnan(values) for values in table.values.values()], axis=0)
    if cut_off:
        complete[-1] = False  # also where the truncated cell is the last that is used
        table.notes.append(Note("cut_off", "the last line is truncated and is left out"))
    lost = int(np.count_nonzero(~complete)) - cut_off
    if lost:
        first = table.place(int(np.argmin(complete)))
        message = f"{lost} of {len(complete)} rows have a missing value and are left out; the first is {first}"
        table.notes.append(Note("missing", message, lost))
    if not complete.all():
        table.keep(complete)


def _drop_column_if_incomplete(table: Table, quantity: str, required: bool, cut_off: bool) -> None:
    """Raise InputError for a required column with too many missing values; leave out another one, with a note."""
    gaps = np.flatnonzero(np.isnan(table.values[quantity]))
    count = len(gaps) - bool(cut_off and len(gaps) and gaps[-1] == len(table.values[quantity]) - 1)
    if count <= MAX_MISSING_SHARE * len(table.values[quantity]):
        return
    if required:
        raise _not_finite(table, quantity, gaps, "missing or not a number")
    table.notes.append(Note("left_out", f"{quantity} has {count} missing values: the column is left out", count))
    del table.values[quantity]


def _not_finite(table: Table, quantity: str, rows: np.ndarray, what: str) -> InputError:
    total = len(table.values[quantity])
    advice = "Remove these lines, or record again."
    if 0.2 * total < len(rows) < total:
        advice = "If this column has a slower clock than the others, save it in its own file and give it with --motion."
    header = table.columns[quantity].header
    limit = f"{len(rows)} of {total} rows, at most 1 % may be missing" if what[0] == "m" else f"in {len(rows)} rows"
    return InputError(f"{quantity} (column {header!r})", what, limit, table.place(int(rows[0])), advice)
