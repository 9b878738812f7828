# SPDX-License-Identifier: Apache-2.0
"""The numbers of a file as a table, without the rows and columns that lack too much."""

from dataclasses import dataclass, field

import numpy as np

from ..errors import InputError
from .columns import Column
from .numbers import numbers, search_fault
from .parquet_table import Stored
from .recording import Note
from .text_layout import Layout

LOST_AT_MOST = 0.01  # share of rows without a value that is left out, and told


@dataclass
class Table:
    """The used columns as (n,) float64 arrays in the file's units; ``rows`` are their rows in the file if some went."""

    layout: Layout | Stored
    columns: dict[str, Column]
    values: dict[str, np.ndarray]
    notes: list[Note] = field(default_factory=list)
    rows: np.ndarray | None = None
    sha256: str = ""

    def place(self, row: int) -> str:
        """Where a row of ``values`` stands in the file."""
        return self.layout.place(row if self.rows is None else int(self.rows[row]))

    def keep(self, mask: np.ndarray) -> None:
        """Leave out the rows where ``mask`` is False."""
        self.rows = np.flatnonzero(mask) if self.rows is None else self.rows[mask]
        self.values = {quantity: values[mask] for quantity, values in self.values.items()}


def load(layout: Layout | Stored, columns: dict[str, Column]) -> tuple[Table, bool, bool]:
    """Read the columns: the table, whether it has all its values, and whether its last line is cut off.

    Raises InputError for text and wrong numbers of cells.
    """
    text = isinstance(layout, Layout)
    values, sha256, sound = numbers(layout, columns) if text else layout.numbers(columns)
    complete = sound and all(map(_finite, values.values()))
    cut_off = text and not complete and search_fault(layout, columns)
    return Table(layout, columns, values, sha256=sha256), complete, cut_off


def _finite(values: np.ndarray) -> bool:
    """Whether all of (n,) values are: a finite sum says so faster than a look at each."""
    with np.errstate(all="ignore"):
        return bool(np.isfinite(values.sum()) or np.isfinite(values).all())


def drop_incomplete(table: Table, required: tuple[str, ...], cut_off: bool) -> None:
    """Leave out the rows that lack a ``required`` value, with a note, if they are below 1 % or a last line cut off.

    Another column that lacks more is left out itself. Raises InputError for infinite and too many missing values.
    """
    for quantity, values in table.values.items():
        infinite = np.flatnonzero(np.isinf(values))
        if len(infinite):
            raise _not_finite(table, quantity, infinite, "infinite")
    for quantity in list(table.values):
        _leave_out(table, quantity, quantity in required, cut_off)
    whole = ~np.any([np.isnan(values) for values in table.values.values()], axis=0)
    if cut_off and not whole[-1]:
        table.notes.append(Note("cut_off", "the last line is cut off: left out"))
    lost = int(np.count_nonzero(~whole)) - (cut_off and not whole[-1])
    if lost:
        first = table.place(int(np.argmin(whole)))
        what = f"{lost} of {len(whole)} rows lack a value: left out, the first is {first}"
        table.notes.append(Note("missing", what, lost))
    if not whole.all():
        table.keep(whole)


def _leave_out(table: Table, quantity: str, required: bool, cut_off: bool) -> None:
    """Refuse a required column with too many holes; leave out another one, and say so."""
    holes = np.flatnonzero(np.isnan(table.values[quantity]))
    count = len(holes) - bool(cut_off and len(holes) and holes[-1] == len(table.values[quantity]) - 1)
    if count <= LOST_AT_MOST * len(table.values[quantity]):
        return
    if required:
        raise _not_finite(table, quantity, holes, "missing or not a number")
    table.notes.append(Note("left_out", f"{quantity} lacks {count} values: the column is left out", count))
    del table.values[quantity]


def _not_finite(table: Table, quantity: str, rows: np.ndarray, what: str) -> InputError:
    total = len(table.values[quantity])
    advice = "Remove these lines, or record again."
    if 0.2 * total < len(rows) < total:
        advice = "If this column has a slower clock than the others, save it in its own file and join it with motion."
    header = table.columns[quantity].header
    limit = f"{len(rows)} of {total} rows, at most 1 % may be missing" if what[0] == "m" else f"in {len(rows)} rows"
    return InputError(f"{quantity} (column {header!r})", what, limit, table.place(int(rows[0])), advice)
