# SPDX-License-Identifier: Apache-2.0
"""Shapes of a needle in tissue as cameras, fibre gratings or images give them, and their tables."""

import re
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from ..checks import TRAVEL, in_range
from ..errors import InputError
from ..recording.formats.detect import tables_of
from ..recording.roles import Column, Vocabulary, assign_columns
from ..recording.table import Table
from .tip_path_tables import AXES, column_at, lengths, split_header, without_columns
from .tip_paths import rows_of_each

_LABELS = ("insertion", "insertion_hole", "hole", "needle", "trial", "run", "file", "source", "sensor")
_WANTED = (*AXES, "depth")
_FEWEST = 4  # points of a shape
_SHORT_OF_DEPTH = 0.1  # by which a tip may be less deep than the needle's travel: slopes of 0.45 make 10 %


def _at_depth(tip: float, depth: float) -> bool:
    return bool(abs(tip - depth) <= _SHORT_OF_DEPTH * depth)


@dataclass(frozen=True, eq=False)
class NeedleShape:
    """The part of a needle that is in tissue, from the surface to the tip.

    Attributes
    ----------
    name : str
        Of the insertion, with its depth.
    depth : float
        Travel of the needle in tissue [m].
    points : ndarray, shape (n, 3)
        Along the needle, from the surface to the tip: across, and along the insertion, from 0 at the surface, positive
        inwards [m].

    Raises
    ------
    InputError
        If there are less than four points, a value is not finite, z decreases, or the tip is not at the depth.
    """

    name: str
    depth: float
    points: np.ndarray

    def __post_init__(self) -> None:
        quantity, points = f"points of shape {self.name}", np.asarray(self.points, dtype=float)
        if points.ndim != 2 or points.shape[1] != 3 or len(points) < _FEWEST:
            limit = f"must have {_FEWEST} rows at least, of x, y and z"
            raise InputError(quantity, f"an array of shape {points.shape}", limit, next_step="Give all points.")
        in_range(quantity, points, TRAVEL, "Leave the others out.")
        in_range(f"depth of shape {self.name}", self.depth, TRAVEL, "Give it in m.", ())
        if np.any(np.diff(points[:, 2]) < 0.0):
            step = "Order them from the surface to the tip."
            raise InputError(f"z of the {quantity}", "it decreases", "must go inwards", next_step=step)
        if not _at_depth(points[-1, 2], self.depth):
            limit = f"must be within 10 % of the depth of {1e3 * self.depth:.1f} mm"
            step = "Count z from the surface, inwards, and the depth as the travel of the tip in tissue."
            raise InputError(f"z of the tip of shape {self.name}", f"{1e3 * points[-1, 2]:.1f} mm", limit, "", step)

    def __len__(self) -> int:
        return len(self.points)

    @property
    def tip(self) -> np.ndarray:
        """Position of the tip, (3,) [m]."""
        return self.points[-1]

    def at(self, along: np.ndarray) -> np.ndarray:
        """Position across at places along the insertion (m,) [m], (m, 2)."""
        return np.column_stack([np.interp(along, self.points[:, 2], column) for column in self.points[:, :2].T])


def read_shapes(file: str | PathLike, *, unit: str | None = None) -> list[NeedleShape]:
    """Read shapes from a table with a row a point.

    Parameters
    ----------
    file : path
        A table with the columns ``x``, ``y``, ``z`` and ``depth``, each with its unit (``x_mm``); columns such as
        ``insertion``, ``hole`` and ``source`` separate shapes, as does each depth.
    unit : str, optional
        Of all lengths, where the table states none.

    Returns
    -------
    list of NeedleShape
        In the order of the file. z is the axis along which the points extend farthest, positive towards the tip.

    Raises
    ------
    InputError
        If a column or unit is missing, a value is not a number, a shape has less than four points, or its tip is not
        at its depth: z is 0 at the surface.
    """
    table = tables_of(Path(file))[0]
    found = assign_columns(table, {}, _VOCABULARY).matches
    if missing := [name for name in _WANTED if name not in found]:
        step = "Name them x_mm, y_mm, z_mm and depth_mm."
        raise without_columns(table, missing, set(_WANTED), step)
    series = {name: _lengths(table, column_at(table, name, found[name][-1]), unit) for name in found if name != "label"}
    labels = [table.texts(k) for k in found.get("label", ())]
    keys = list(zip(*labels, series["depth"])) if labels else [(depth,) for depth in series["depth"]]
    return [_shape(key, series, rows, str(file)) for key, rows in rows_of_each(keys, str(file)).items()]


def _quantity(header: str) -> str | None:
    """The quantity of a header: of a point, of its insertion, or ``label``."""
    name = split_header(header)[0]
    return name if name in _WANTED else "label" if name in _LABELS else None


_VOCABULARY = Vocabulary(dimensions=dict.fromkeys((*_WANTED, "label"), ""), recognised={"name": _quantity})


def _lengths(table: Table, source: Column, unit: str | None) -> np.ndarray:
    found = lengths(table.numbers(source.index), source, table, unit)
    return in_range(source.header, found, TRAVEL, "Check the unit, or leave the row out.", place=table.place)


def _shape(key: tuple, series: dict[str, np.ndarray], rows: np.ndarray, file: str) -> NeedleShape:
    points = np.column_stack([series[axis][rows] for axis in AXES])
    depth = float(series["depth"][rows[0]])
    name = re.sub(r"\s+", " ", f"{' '.join(map(str, key[:-1]))} {1e3 * depth:g} mm").strip()
    along = int(np.argmax(np.ptp(points, axis=0)))
    points = points[:, [*(k for k in range(3) if k != along), along]]
    if -points[:, 2].min() > points[:, 2].max() and not _at_depth(points[:, 2].max(), depth):
        points = points * [1.0, 1.0, -1.0]  # a table whose axis points out of the tissue
    try:
        return NeedleShape(name, depth, points[np.argsort(points[:, 2], kind="stable")])
    except InputError as error:
        raise error.at(file) from None
