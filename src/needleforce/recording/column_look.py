# SPDX-License-Identifier: Apache-2.0
"""A look at the columns of a table."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from .columns import Column
from .parts import MAIN, Part, column_table

MAX_LISTED = 20  # columns, and recordings, that are shown


@dataclass(frozen=True, kw_only=True)
class ColumnLook:
    """One column: header, stated unit, the quantity it is read as, empty if it is not used, number of values, first,
    last, smallest and largest value in the file's unit; NaN where it holds no numbers."""

    header: str
    unit: str
    quantity: str
    count: int
    first: float
    last: float
    smallest: float
    largest: float

    def cells(self, number: int) -> tuple[str, ...]:
        """What a table shows of the column with this number."""
        values = (self.first, self.last, self.smallest, self.largest)
        shown = ["" if np.isnan(value) else f"{value:.6g}" for value in values]
        return (str(number), self.header, self.unit, self.quantity, *shown)


def column_looks(part: Part, used: Sequence[str] = MAIN) -> tuple[ColumnLook, ...]:
    """The first columns of a part; of the quantities, those ``used`` are named."""
    return tuple(
        ColumnLook(header=header, unit=unit, quantity=quantity if quantity in used else "", **_range(part.table, k))
        for k, (header, unit, quantity) in enumerate(column_table(part)[:MAX_LISTED])
    )


def _range(table: Any, index: int) -> dict[str, Any]:
    """Number of values, first, last, smallest and largest of a column."""
    column = Column("force", table.headers[index], index, None)
    try:
        values = table.numbers({"force": column})[0]["force"]
    except InputError:
        values = np.empty(0)
    values = values[np.isfinite(values)]
    if not len(values):
        return dict.fromkeys(("first", "last", "smallest", "largest"), float("nan")) | {"count": 0}
    ends = {"first": float(values[0]), "last": float(values[-1])}
    return ends | {"smallest": float(values.min()), "largest": float(values.max()), "count": len(values)}
