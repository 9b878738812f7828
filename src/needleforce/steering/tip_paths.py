# SPDX-License-Identifier: Apache-2.0
"""Tables of steered insertions: the base's motion and the tip that was tracked, in the frame of the tissue."""

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..files import read_bytes
from ..units import parse

_MAX_BYTES = 64 * 1024**2
_QUATERNION = ("tip_qw", "tip_qx", "tip_qy", "tip_qz")
_AXES = ("x", "y", "z")


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
        How the frame was found, and which rows were left out.
    """

    name: str
    base: np.ndarray
    tip: np.ndarray
    slope: np.ndarray | None
    start: float = 0.0
    note: str = ""

    def __len__(self) -> int:
        return len(self.base)

    @property
    def depth(self) -> np.ndarray:
        """Travel of the tip [m] from where the insertion counts: its deepest position so far, (n,)."""
        return np.maximum.accumulate(self.tip[:, 2]) - self.start

    @property
    def steered(self) -> bool:
        """Whether the base moved across."""
        return bool(np.any(self.base != self.base[0]))

    @property
    def entry_rows(self) -> int:
        """Rows at the beginning that were read before the base moved, at least one."""
        moved = np.any(self.base != self.base[0], axis=1)
        first = int(np.argmax(moved)) if moved.any() else len(self)
        return max(first, 1)


def read(file: str | PathLike) -> list[TipPath]:
    """Read insertions from a table with a row a step.

    Parameters
    ----------
    file : path
        CSV with headers: ``tip_x``, ``tip_y``, ``tip_z`` and the two of ``base_x``, ``base_y``, ``base_z`` across, each
        with its unit as a suffix (``tip_x_mm``); optionally the tip's orientation ``tip_qw`` to ``tip_qz`` and the
        nominal ``depth``. A column ``file``, ``insertion`` or ``trial`` separates insertions.

    Returns
    -------
    list of TipPath
        In the order of the file. The insertion axis is the one without a base column, its direction that in which the
        tip goes. Rows in which the tip stays the same to the last digit while the base moves are those of a lost
        sensor, and left out.

    Raises
    ------
    InputError
        If a column is missing, a value is not a number, or the tip does not advance.
    """
    text = read_bytes(file, "table of tip paths", _MAX_BYTES).decode("utf-8-sig", errors="replace")
    rows = list(csv.DictReader(io.StringIO(text)))
    if not rows:
        raise InputError("rows", 0, "an empty table", str(file), "Give a CSV file with a header and a row a step.")
    columns = _columns(rows[0], str(file))
    label = next((name for name in ("file", "insertion", "trial") if name in rows[0]), None)
    groups: dict[str, list[dict]] = {}
    for row in rows:
        groups.setdefault(row[label] if label else Path(file).stem, []).append(row)
    return [_path(name, group, columns, str(file)) for name, group in groups.items()]


def _columns(header: dict, place: str) -> dict[str, tuple[str, str]]:
    """Quantity -> (column, unit), for tip, base and orientation."""
    found: dict[str, tuple[str, str]] = {name: (name, "1") for name in _QUATERNION if name in header}
    for name in header:
        match = re.fullmatch(r"(tip|base)_([xyz])_(\w+)", name or "")
        if match:
            found[f"{match[1]}_{match[2]}"] = (name, match[3])
        stated = re.fullmatch(r"(?:step_)?depth_(\w+)", name or "")
        if stated:
            found["depth"] = (name, stated[1])
    missing = [f"tip_{axis}" for axis in _AXES if f"tip_{axis}" not in found]
    across = [axis for axis in _AXES if f"base_{axis}" in found]
    if missing or len(across) != 2:
        given = ", ".join(name for name in header if name)
        wanted = "tip_x, tip_y, tip_z and two columns of base_x, base_y, base_z, with units as suffixes (tip_x_mm)"
        raise InputError("columns", given, "not those of a tip path", place, f"Name them {wanted}.")
    return found


def _path(name: str, rows: Sequence[dict], columns: dict[str, tuple[str, str]], place: str) -> TipPath:
    across = [axis for axis in _AXES if f"base_{axis}" in columns]
    along = next(axis for axis in _AXES if axis not in across)
    series = {key: _series(rows, *columns[key], f"{place}, {name}") for key in columns}
    sign = _direction(series[f"tip_{along}"], f"{place}, {name}")
    base = np.column_stack([series[f"base_{axis}"] for axis in across])
    tip = np.column_stack([*(series[f"tip_{axis}"] for axis in across), sign * series[f"tip_{along}"]])
    slope = _slopes(series, [_AXES.index(axis) for axis in (*across, along)], sign)
    n = _tracked(tip, base)
    notes = [f"insertion along {'+' if sign > 0 else '-'}{along}"]
    if n < len(rows):
        notes.append(f"the last {len(rows) - n} rows are left out: the tip is the same to the last digit")
    start = tip[0, 2] - (series["depth"][0] if "depth" in series else 0.0)
    return TipPath(name, base[:n], tip[:n], None if slope is None else slope[:n], float(start), note="; ".join(notes))


def _series(rows: Sequence[dict], column: str, unit: str, place: str) -> np.ndarray:
    try:
        values = np.array([float(row[column]) for row in rows])
    except (TypeError, ValueError):
        raise InputError(column, "a text or nothing", "not a number in each row", place, "Correct the rows.") from None
    if not np.all(np.isfinite(values)):
        bad = int(np.argmin(np.isfinite(values))) + 1
        raise InputError(column, values[bad - 1], "not finite", f"{place}, row {bad}", "Leave the row out.")
    return values if unit == "1" else parse(unit, "length", column, place).to_si(values)


def _direction(along: np.ndarray, place: str) -> float:
    """+1 or -1, so that the tip goes inwards along the axis."""
    travel = along[-1] - along[0]
    if len(along) < 2 or not abs(travel) > 0.5 * np.ptp(along):
        raise InputError(
            "tip along the insertion", f"{travel:.4g} m", "does not advance", place, "Give whole insertions."
        )
    return float(np.sign(travel))


def _slopes(series: dict[str, np.ndarray], order: list[int], sign: float) -> np.ndarray | None:
    """Slopes across from the orientation: of the sensor's axis that is closest to the insertion."""
    if not all(name in series for name in _QUATERNION):
        return None
    w, x, y, z = (series[name] for name in _QUATERNION)
    axes = np.stack(
        [
            np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)], axis=1),
            np.stack([2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)], axis=1),
            np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1),
        ]
    )[:, :, order]
    needle = axes[int(np.argmax(np.abs(axes[:, :, 2]).mean(axis=1)))]
    inwards = sign * needle[:, 2]
    return needle[:, :2] / inwards[:, None]


def _tracked(tip: np.ndarray, base: np.ndarray) -> int:
    """Rows before the tip is frozen: the same in three rows or more up to the end while the base moves."""
    same = np.all(tip[1:] == tip[-1], axis=1)
    moving = np.where(same)[0]
    frozen = len(tip) - int(np.argmin(same[::-1])) if not same.all() and same[-1] else len(tip)
    lasts = len(tip) - frozen
    return frozen if lasts >= 2 and len(moving) and np.any(base[frozen:] != base[frozen - 1]) else len(tip)
