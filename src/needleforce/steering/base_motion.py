# SPDX-License-Identifier: Apache-2.0
"""The motion of the base step by step: a table that a robot follows, its single moves, and insertions that are run
again with similar moves."""

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..checks import ROLL, TRAVEL, in_range
from ..errors import InputError
from ..files import write_rows
from ..models.flexible_insertion import FlexibleInsertion
from ..recording.formats.detect import tables_of
from ..recording.roles import Vocabulary, assign_columns
from .tip_path_tables import without_columns
from .tip_paths import TipPath

if TYPE_CHECKING:
    import pandas as pd

COLUMNS = ("depth_mm", "base_x_mm", "base_y_mm", "roll_deg")
SPEED = 5e-3  # [m/s] of the push, where the axial law depends on it
_CELLS = ((1e-3, TRAVEL), (1e-3, TRAVEL), (1e-3, TRAVEL), (np.pi / 180.0, ROLL))
_MOVES = 3  # in each step: across at rest, along, and the share of the next motion that a reading sees

AT_REST = 0.1  # [s] of a step across without travel: 100 mm at the largest speed that an insertion accepts by default


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
        shapes, step = tuple(map(np.shape, (self.depth, self.lateral, self.roll))), "Give a row a step, in m and rad."
        if shapes != ((n,), (n, 2), (n,)):
            limit = "must be (n,), (n, 2), (n,)"
            raise InputError("shapes of depth, lateral, roll", str(shapes), limit, next_step=step)
        for quantity, allowed in (("depth", TRAVEL), ("lateral", TRAVEL), ("roll", ROLL)):
            in_range(f"{quantity} of a base motion", getattr(self, quantity), allowed, step)

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
        write_rows(path, COLUMNS, self.rows())

    @classmethod
    def read(cls, path: str | os.PathLike) -> "BaseMotion":
        """Read the rows that ``write`` wrote. Raises InputError if a column is missing or a cell is no number."""
        (table,) = tables_of(Path(path))[:1]
        found = assign_columns(table, {}, _VOCABULARY).matches
        if missing := [name for name in COLUMNS if name not in found]:
            step = f"Give the columns {', '.join(COLUMNS)}."
            raise without_columns(table, missing, {"depth", "base", "roll"}, step)
        cells = [
            in_range(name, factor * table.numbers(found[name][0]), allowed, "Correct the cell.", place=table.place)
            for name, (factor, allowed) in zip(COLUMNS, _CELLS)
        ]
        return cls(cells[0], np.column_stack(cells[1:3]), cells[3])


_VOCABULARY = Vocabulary(
    dimensions=dict.fromkeys(COLUMNS, ""), recognised={"name": lambda header: header if header in COLUMNS else None}
)


@dataclass(frozen=True)
class BaseMoves:
    """Single moves of a base, three a step: depth (m,), lateral (m, 2), roll (m,), and the time of each (m,)."""

    depth: np.ndarray
    lateral: np.ndarray
    roll: np.ndarray
    dt: np.ndarray


def base_moves(depth: np.ndarray, path: TipPath, lead: float = 0.0) -> BaseMoves:
    """The moves of the steps of a path to the depths (n,) [m]; ``lead`` is the share of the next step's motion across
    that comes before the tip is read."""
    moved = path.base - path.base[0]
    seen = moved + lead * (np.vstack([moved[1:], moved[-1:]]) - moved)
    before = np.append(min(0.0, depth[0]), depth[:-1])
    return BaseMoves(
        depth=np.column_stack([before, depth, depth]).ravel(),
        lateral=np.stack([moved, moved, seen], axis=1).reshape(-1, 2),
        roll=np.repeat(np.unwrap(path.roll), _MOVES),  # what the tip is turned by at rest leaves no trace
        dt=np.repeat(np.maximum(np.abs(depth - before) / SPEED, AT_REST), _MOVES),
    )


class Replay:
    """An insertion that is run again and again with motions whose beginnings are the same: each run continues from the
    last state that it shares with the run before. One that is run ``once`` keeps no states."""

    def __init__(self, flex: FlexibleInsertion, once: bool = False):
        self.flex = flex
        self._once = once
        self._done: np.ndarray = np.empty((0, 5))
        self._states: list[Any] = []
        self._rows: list[dict[str, np.ndarray]] = []

    def run(self, moves: BaseMoves) -> dict[str, np.ndarray]:
        """Rows of ``FlexibleInsertion.run`` for all moves, from before the first contact on."""
        if self._once:
            self.flex.reset()
            return self.flex.run(moves.depth, moves.lateral, roll=moves.roll, dt=moves.dt)
        sought = np.column_stack([moves.depth, moves.lateral, moves.roll, moves.dt])
        begin = self._shared(sought)
        self.flex.restore(self._states[begin]) if begin < len(self._states) else self.flex.reset()
        del self._states[begin:], self._rows[begin:]
        for at in range(begin * _MOVES, len(sought), _MOVES):
            depth, lateral, roll, dt = np.split(sought[at : at + _MOVES], [1, 3, 4], axis=1)
            self._states.append(self.flex.snapshot())
            self._rows.append(self.flex.run(depth.ravel(), lateral, roll=roll.ravel(), dt=dt.ravel()))
        self._done = sought
        return {name: np.concatenate([row[name] for row in self._rows]) for name in self._rows[0]}

    def _shared(self, sought: np.ndarray) -> int:
        """Number of steps that are the same as in the last run, at most all but one."""
        n = min(len(self._done), len(sought))
        different = np.any(self._done[:n] != sought[:n], axis=1)
        moves = int(np.argmax(different)) if different.any() else n
        return min(moves // _MOVES, max(len(self._states) - 1, 0))


Replays = dict[str, Replay]
"""Insertions of a search by what they are, such as ``"x"`` for the plane of x."""


def rows_of(replay: Replay, moves: BaseMoves) -> dict[str, np.ndarray]:
    """Tip, slope, wrench, force and whether the needle was lost at the end of each step, from single moves."""
    rows = replay.run(moves)
    last = {name: values[_MOVES - 1 :: _MOVES] for name, values in rows.items()}
    tangent = last["tangent"]
    return {
        "tip": last["tip"][:, :2],
        "along": last["tip"][:, 2],
        "slope": tangent[:, :2] / tangent[:, 2:],
        "wrench": last["wrench"],
        "force": last["force"],
        "lost": np.logical_or.reduceat(rows["status"] != 0, np.arange(0, len(rows["status"]), _MOVES)),
    }


def replay_of(replays: Replays | None, name: str, make: Callable[[], FlexibleInsertion]) -> Replay:
    """The replay of a search with this name, made if there is none."""
    if replays is None:
        return Replay(make(), once=True)
    if name not in replays:
        replays[name] = Replay(make())
    return replays[name]
