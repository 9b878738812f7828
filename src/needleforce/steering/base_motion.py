# SPDX-License-Identifier: Apache-2.0
"""The motion of the base step by step, as a table that a robot follows."""

import os
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..files import atomic_write

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
            raise InputError("shapes of depth, lateral, roll", shapes, "must be (n,), (n, 2), (n,)")
        for quantity in ("depth", "lateral", "roll"):
            if not np.all(np.isfinite(getattr(self, quantity))):
                raise InputError(f"{quantity} of a base motion", "not finite", "must be numbers")

    def __len__(self) -> int:
        return len(self.depth)

    def rows(self) -> list[dict[str, float]]:
        """Rows with units in the names: ``depth_mm``, ``base_x_mm``, ``base_y_mm``, ``roll_deg``."""
        columns = np.column_stack([1e3 * self.depth, 1e3 * self.lateral, np.degrees(self.roll)])
        return [dict(zip(COLUMNS, map(float, row), strict=True)) for row in columns]

    def write(self, path: str | os.PathLike) -> None:
        """Write the rows as CSV. Raises InputError if the file cannot be written."""
        with atomic_write(path) as file:
            file.write(",".join(COLUMNS) + "\n")
            for row in self.rows():
                file.write(",".join(f"{value:.6g}" for value in row.values()) + "\n")

    def until(self, count: int) -> "BaseMotion":
        """The first ``count`` steps."""
        return BaseMotion(self.depth[:count], self.lateral[:count], self.roll[:count])
