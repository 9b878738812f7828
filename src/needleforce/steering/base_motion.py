# SPDX-License-Identifier: Apache-2.0
"""The motion of the base step by step, as a table that a robot follows."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError
from ..files import atomic_write
from ..recording.formats.detect import tables_of
from ..recording.table import Table

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = ("depth_mm", "base_x_mm", "base_y_mm", "roll_deg")


@dataclass(frozen=True, eq=False)
class BaseMotion:
    """In each step the base first moves across and rolls at rest, then the needle is pushed to the depth.

    Attributes
    ----------
    depth : ndarray, shape (n,)
        Travel of the needle in tissue at the end of each step [m]; the first is where the insertion begins.
    lateral : ndarray, shape (n, 2)
        Position of the base across, from its position at the start [m].
    roll : ndarray, shape (n,)
        Rotation of the needle about its axis, from that at the start [rad].
    """

    depth: np.ndarray
    lateral: np.ndarray
    roll: np.ndarray

    def __post_init__(self) -> None:
        n = len(self.depth)
        if np.shape(self.lateral) != (n, 2) or np.shape(self.roll) != (n,):
            shapes = f"{np.shape(self.depth)}, {np.shape(self.lateral)}, {np.shape(self.roll)}"
            raise InputError(
                "shapes of depth, lateral, roll", shapes, "must be (n,), (n, 2), (n,)", next_step="Give a row a step."
            )
        for quantity in ("depth", "lateral", "roll"):
            if not np.all(np.isfinite(getattr(self, quantity))):
                raise InputError(
                    f"{quantity} of a base motion", "not finite", "must be numbers", next_step="Leave the row out."
                )

    def __len__(self) -> int:
        return len(self.depth)

    def rows(self) -> list[dict[str, float]]:
        """Rows with units in the names: ``depth_mm``, ``base_x_mm``, ``base_y_mm``, ``roll_deg``."""
        columns = np.column_stack([1e3 * self.depth, 1e3 * self.lateral, np.degrees(self.roll)])
        return [dict(zip(COLUMNS, map(float, row), strict=True)) for row in columns]

    def to_dataframe(self) -> "pd.DataFrame":
        """The rows as a pandas table, with units in the names of its columns."""
        import pandas as pd

        return pd.DataFrame(self.rows(), columns=list(COLUMNS))

    def write(self, path: str | os.PathLike) -> None:
        """Write the rows as CSV. Raises InputError if the file cannot be written."""
        with atomic_write(path) as file:
            file.write(",".join(COLUMNS) + "\n")
            for row in self.rows():
                file.write(",".join(f"{value:.6g}" for value in row.values()) + "\n")

    @classmethod
    def read(cls, path: str | os.PathLike) -> "BaseMotion":
        """Read the rows that ``write`` wrote. Raises InputError if a column is missing or a cell is no number."""
        (table,) = tables_of(Path(path))[:1]
        if missing := [name for name in COLUMNS if name not in table.headers]:
            step = f"Give the columns {', '.join(COLUMNS)}."
            raise InputError("columns", ", ".join(table.headers), f"{missing[0]} is missing", str(path), step)
        series = [_numbers(table, name) for name in COLUMNS]
        depth, x, y, roll = (np.asarray(each) for each in series)
        return cls(1e-3 * depth, 1e-3 * np.column_stack([x, y]), np.radians(roll))


def _numbers(table: Table, name: str) -> np.ndarray:
    values = table.numbers(table.headers.index(name))
    if not np.all(np.isfinite(values)):
        row = int(np.argmax(~np.isfinite(values)))
        raise InputError(name, "empty or no number", "in one row", table.place(row), "Correct the cell.")
    return values
