# SPDX-License-Identifier: Apache-2.0
"""A steered insertion as it was recorded: the motion of the base and the tip, in the frame of the tissue."""

from collections.abc import Hashable, Iterable
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from ..checks import PLACE, ROLL, SLOPE, TRAVEL, in_range
from ..files import check_count

Key = TypeVar("Key", bound=Hashable)

RANGES = {"base": PLACE, "tip": PLACE, "start": PLACE, "slope": SLOPE, "roll": ROLL}

ENTRY = 6e-3  # [m] of travel that count as the entry
MAX_INSERTIONS = 1000  # of a file or table, which have tens: more are rows that were taken for insertions
MAX_COMPARED = 60  # rows of an insertion that a fit compares
_STEP = "Check units and cells: give a row a step, and leave out rows without a reading."
TIP_COLUMNS = ("tip_x_mm", "tip_y_mm", "tip_z_mm")  # of tables of steps


def rows_of_each(keys: Iterable[Key], place: str) -> dict[Key, np.ndarray]:
    """The rows of each insertion, in the order of the file, by the key of each row."""
    found: dict[Key, list[int]] = {}
    for row, key in enumerate(keys):
        found.setdefault(key, []).append(row)
    check_count("insertions", len(found), MAX_INSERTIONS, place)
    return {key: np.array(rows) for key, rows in found.items()}


@dataclass(frozen=True)
class TipPath:
    """One insertion: where the base was and where the tip was found, row by row.

    Attributes
    ----------
    name : str
        Of the insertion in its file.
    base : ndarray, shape (n, 2)
        Lateral position of the guide or hub [m].
    tip : ndarray, shape (n, 3)
        Position of the tip [m]: across, as the base, and along the insertion, positive inwards.
    slope : ndarray, shape (n, 2), or None
        Slope of the tip against the insertion axis [1], if its direction was measured.
    start : float
        Where depth counts from, along the insertion in the tip's frame [m]: the tip in the first row less the depth
        that the table states there.
    note : str
        How the frame was found, then each doubt after a semicolon.
    roll : ndarray, shape (n,)
        Rotation of the needle about its axis [rad], not wrapped; 0 if none is given.
    """

    name: str
    base: np.ndarray
    tip: np.ndarray
    slope: np.ndarray | None
    start: float = 0.0
    note: str = ""
    roll: np.ndarray = field(default=None)  # type: ignore[assignment]

    def __post_init__(self) -> None:
        if self.roll is None:
            object.__setattr__(self, "roll", np.zeros(len(self.base)))
        n = len(self.base)
        shapes = {"base": (n, 2), "tip": (n, 3), "slope": (n, 2), "roll": (n,), "start": ()}
        for quantity, shape in shapes.items():
            if (values := getattr(self, quantity)) is not None:
                in_range(f"{quantity} of {self.name}", values, RANGES[quantity], _STEP, shape)
        for quantity in ("base", "tip") if n else ():
            values = np.asarray(getattr(self, quantity), dtype=float)
            in_range(f"{quantity} of {self.name} from its first row", values - values[0], TRAVEL, _STEP)
        in_range(f"depth of {self.name}", self.depth, TRAVEL, _STEP)

    def __len__(self) -> int:
        return len(self.base)

    @property
    def doubts(self) -> list[str]:
        """Which rows were left out or are not as they were read."""
        return self.note.split("; ")[1:]

    @property
    def depth(self) -> np.ndarray:
        """Travel of the tip [m] from where the insertion counts: its deepest position so far, (n,)."""
        return np.maximum.accumulate(self.tip[:, 2]) - self.start

    @property
    def steered(self) -> bool:
        """Whether the base moved across."""
        return bool(np.any(self.base != self.base[0]))

    @property
    def compared(self) -> np.ndarray:
        """Indices of the rows that a fit compares: all, or of a continuous recording 60, evenly over the motion."""
        return self.compared_until(len(self))

    def compared_until(self, count: int) -> np.ndarray:
        """The same of the first ``count`` rows alone; the last of them is always there."""
        if count <= MAX_COMPARED:
            return np.arange(count)
        steps = np.abs(np.diff(self.depth[:count])) + np.linalg.norm(np.diff(self.base[:count], axis=0), axis=1)
        motion = np.append(0.0, np.cumsum(steps))
        return np.unique(np.append(np.searchsorted(motion, np.linspace(0.0, motion[-1], MAX_COMPARED)), count - 1))

    @property
    def entry(self) -> np.ndarray:
        """Indices of the compared rows of the entry."""
        return self.compared[: self.entry_rows]

    @property
    def entry_rows(self) -> int:
        """Compared rows at the beginning that were read before the base moved or turned, in the first 6 mm; at least
        one."""
        moved = np.any(self.base != self.base[0], axis=1) | (self.roll != self.roll[0])
        later = np.where(moved | (self.depth > self.depth[0] + ENTRY))[0]
        first = later[0] if len(later) else len(self)
        return max(int(np.searchsorted(self.compared, first)), 1)
