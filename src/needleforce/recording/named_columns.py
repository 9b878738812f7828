# SPDX-License-Identifier: Apache-2.0
"""Columns in memory, as a DataFrame or a mapping, read like those of a file."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from .columns import Column


@dataclass(frozen=True, eq=False)
class NamedColumns:
    """Columns in memory, as ``Layout`` is of a text file: headers are recognised, or asked for, in the same way."""

    columns: Mapping[str, Any]
    path: Path = Path("DataFrame")
    comments: tuple[tuple[int, str], ...] = ()

    @property
    def headers(self) -> list[str]:
        """The names of the columns."""
        return [str(name) for name in self.columns]

    def place(self, row: int) -> str:
        """Where a row is: from 0, as in the DataFrame."""
        return f"{self.path}, row {row}"

    def numbers(self, columns: Mapping[str, Column]) -> tuple[dict[str, np.ndarray], str, bool]:
        """The columns as (n,) float64, no hash, and that every row has all its cells.

        Raises InputError for a column that holds no numbers or has another length than the first.
        """
        found = {quantity: self._numbers(column) for quantity, column in columns.items()}
        lengths = {len(values) for values in found.values()}
        if len(lengths) > 1:
            raise InputError("length of the columns", sorted(lengths), "one equal length is needed", str(self.path))
        return found, "", True

    def _numbers(self, column: Column) -> np.ndarray:
        values = list(self.columns.values())[column.index] if isinstance(self.columns, dict) else self._of_frame(column)
        try:
            found = np.array(values, dtype=float)
        except (TypeError, ValueError):
            kind = str(getattr(values, "dtype", type(values).__name__))
            limit, step = "a column of numbers is needed", "Convert the column."
            raise InputError(
                f"{column.quantity} (column {column.header!r})", f"of type {kind}", limit, str(self.path), step
            ) from None
        if found.ndim != 1:
            raise InputError(f"shape of {column.header!r}", found.shape, "one value a row is needed", str(self.path))
        return found

    def _of_frame(self, column: Column) -> Any:
        return self.columns.iloc[:, column.index]
