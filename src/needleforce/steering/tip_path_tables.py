# SPDX-License-Identifier: Apache-2.0
"""Tables of steered insertions: which column is which, and from the tracker's frame to that of the tissue."""

import re
from os import PathLike
from pathlib import Path

import numpy as np

from ..checks import PLACE, ROLL, SLOPE, TRAVEL, Range, in_range
from ..errors import InputError
from ..recording.force_signal import outliers
from ..recording.formats.detect import tables_of
from ..recording.formats.rows import is_unit
from ..recording.quantities import split
from ..recording.roles import Column, Vocabulary, assign_columns, columns_of
from ..recording.table import Table
from ..units import parse
from .tip_paths import TipPath, rows_of_each

AXES = ("x", "y", "z")
_TIP = tuple(f"tip_{axis}" for axis in AXES)
_QUATERNION = ("tip_qw", "tip_qx", "tip_qy", "tip_qz")
_FAR_FROM_UNIT = 0.1  # of a quaternion: more is no rounding
_PART = Range(-1.0 - _FAR_FROM_UNIT, 1.0 + _FAR_FROM_UNIT, "", "of a rotation")
_FEWEST = 8  # rows among which a spike is found
_QUANTUM = 2.0 * 0.6745 * 0.5e-3  # [m] whose half is the median size of the noise of a bad tracker
_CORRECT = "Check the unit, or leave the row out."
_LABELS = ("file", "insertion", "trial", "run")
_BASE = ["base_x, base_y, base_z without the one along the insertion"]


def read(file: str | PathLike, *, unit: str | None = None) -> list[TipPath]:
    """Read insertions from a table with a row a step or a sample.

    Parameters
    ----------
    file : path
        A table of any format that ``nf.read`` opens, with the columns ``tip_x``, ``tip_y``, ``tip_z`` and the two of
        ``base_x``, ``base_y``, ``base_z`` across, each with its unit (``tip_x_mm``, ``tip x [mm]``); optionally the
        tip's orientation ``tip_qw`` to ``tip_qz`` or its slopes ``tip_slope_x`` and so on, the nominal ``depth``, and
        the needle's ``roll``. A column ``file``, ``insertion``, ``trial`` or ``run`` separates insertions. Without
        columns of the base it is at rest.
    unit : str, optional
        Of all lengths, where the table states none.

    Returns
    -------
    list of TipPath
        In the order of the file. The insertion axis is the one without a base column, or along which the tip goes
        farthest; its direction is that in which the tip goes, about which the roll is right-handed. Rows in which the
        tip stays the same to the last digit while the base moves are those of a lost sensor, and left out.

    Raises
    ------
    InputError
        If a column or unit is missing, a value is not a number, or the tip does not advance.
    """
    tables = tables_of(Path(file))
    table = max(tables, key=lambda each: len(_columns(each)))
    columns = _columns(table)
    _check(table, columns)
    series = {name: _series(table, columns[name], unit) for name in columns}
    rows = len(series["tip_x"])
    if not rows:
        raise InputError("rows", 0, "an empty table", str(file), "Give a table with a header and a row a step.")
    groups = rows_of_each(_labels(table, rows), str(file))
    return [_path(label, series, group, table) for label, group in groups.items()]


def _quantity(header: str) -> str | None:
    """The quantity of a header: of tip or base, orientation or slope, roll and depth."""
    match = re.fullmatch(
        r"(?:needle_)?(tip|base|guide|hub)_(q[wxyz]|(?:slope_)?[xyz])|(?:base_|step_)?(depth|roll)",
        split_header(header)[0],
    )
    return match and (match[3] or f"{'tip' if match[1] == 'tip' else 'base'}_{match[2]}")


_QUANTITIES = [
    f"{body}_{each}"
    for body in ("tip", "base")
    for each in (*AXES, *(f"slope_{axis}" for axis in AXES), "qw", "qx", "qy", "qz")
]
_VOCABULARY = Vocabulary(dimensions=dict.fromkeys([*_QUANTITIES, "depth", "roll"], ""), recognised={"name": _quantity})


def _columns(table: Table) -> dict[str, Column]:
    """Quantity -> column, the first of several, with its unit."""
    found = assign_columns(table, {}, _VOCABULARY).matches
    return {quantity: column_at(table, quantity, indices[0]) for quantity, indices in found.items()}


def column_at(table: Table, quantity: str, index: int) -> Column:
    """A column as that of a quantity, with its unit, empty without one."""
    stated = table.units[index] if index < len(table.units) else ""
    return Column(quantity, table.headers[index], index, stated or split_header(table.headers[index])[1], "name")


def split_header(header: str) -> tuple[str, str]:
    """Name in words joined by underscores, and unit: ``tip_x_mm``, ``Tip x [mm]``, ``tip.x (mm)``."""
    name, unit = split(header, is_unit)
    if unit is None:
        name, unit = split("_".join(_words(header)), is_unit)
    return "_".join(_words(name)), unit or ""


def _words(text: str) -> list[str]:
    return [word for word in re.split(r"[\W_]+", text.casefold()) if word]


def _check(table: Table, columns: dict[str, Column]) -> None:
    missing = [f"tip_{axis}" for axis in AXES if f"tip_{axis}" not in columns]
    across = [axis for axis in AXES if f"base_{axis}" in columns]
    if missing or len(across) == 1:
        step = f"Name them {', '.join([*_TIP, *_BASE])}, with units as suffixes (tip_x_mm)."
        if all(axis in (split_header(header)[0] for header in table.headers) for axis in AXES):
            step = "For points along needles, x_mm, y_mm, z_mm and depth_mm, call nf.steering.read_shapes."
        raise without_columns(table, missing or _BASE, {"tip", "base"}, step)


def without_columns(table: Table, missing: list[str], words: set[str], step: str) -> InputError:
    """The error for a table that lacks columns, of which each of another such table has one of these words."""
    found = columns_of(table, lambda header: not words.isdisjoint(_words(header)))
    return InputError(" and ".join(missing), "missing", found, str(table.path), step)


def _labels(table: Table, rows: int) -> list[str]:
    """The insertion of each row."""
    names = [split_header(header)[0] for header in table.headers]
    label = next((names.index(name) for name in _LABELS if name in names), None)
    return [table.path.stem] * rows if label is None else table.texts(label)[:rows]


def _series(table: Table, source: Column, unit: str | None) -> np.ndarray:
    try:
        values = table.numbers(source.index)
    except InputError as error:
        column = f"column {source.header}"
        raise InputError(column, error.value, error.limit, error.place, error.next_step) from None
    bad = ~np.isfinite(values)
    if bad.any():
        row = int(np.argmax(bad))
        limit = "not a number in each row"
        raise InputError(source.header, f"{values[row]:g}", limit, table.place(row), "Leave the row out.")
    quantity = source.quantity
    if "_q" in quantity:
        found, allowed = values, _PART
    elif "slope" in quantity:
        found, allowed = _slope(values, source, table), SLOPE
    elif quantity == "roll":
        found, allowed = _angle(values, source, table), ROLL
    else:
        found, allowed = lengths(values, source, table, unit), TRAVEL if quantity == "depth" else PLACE
    # spikes of a tip are sought before its range
    return found if quantity in _TIP else in_range(source.header, found, allowed, _CORRECT, place=table.place)


def _slope(values: np.ndarray, source: Column, table: Table) -> np.ndarray:
    """Slopes, as the table has them or of its angles."""
    if source.unit in ("", "1", "-"):
        return values
    angle = _angle(values, source, table)
    return np.where(np.abs(angle) < 0.5 * np.pi, np.tan(angle), np.inf)


def lengths(values: np.ndarray, source: Column, table: Table, unit: str | None) -> np.ndarray:
    """Lengths [m], in the unit of the column or the one given. Raises InputError without a unit."""
    if not (source.unit or unit):
        name = "tip_x_mm" if "tip" in source.quantity or "base" in source.quantity else "x_mm"
        step = f"Name the column with its unit ({name}), or give unit='mm'."
        raise InputError(source.header, "no unit", "a unit is needed", str(table.path), step)
    return parse(source.unit or unit or "", "length", source.header, str(table.path)).to_si(values)


def _angle(values: np.ndarray, source: Column, table: Table) -> np.ndarray:
    """Angles [rad]. Raises InputError without a unit."""
    if not source.unit:
        step = "Name the column with its unit, such as roll_deg or roll_rad."
        raise InputError(source.header, "no unit", "a unit is needed", str(table.path), step)
    with np.errstate(over="ignore"):  # out of range, as which it is refused
        return parse(source.unit, "angle", source.header, str(table.path)).to_si(values)


def _path(name: str, series: dict[str, np.ndarray], rows: np.ndarray, table: Table) -> TipPath:
    place = f"{table.path}, {name}"
    one = {key: values[rows] for key, values in series.items()}
    doubts = _without_spikes(one)
    for key in _TIP:
        in_range(f"{key} of {name}", one[key], PLACE, _CORRECT, place=lambda row: table.place(int(rows[row])))
    along = _along(one)
    across = [axis for axis in AXES if axis != along]
    sign = _direction(one[f"tip_{along}"], place)
    base = np.column_stack([one.get(f"base_{axis}", np.zeros(len(rows))) for axis in across])
    tip = np.column_stack([*(one[f"tip_{axis}"] for axis in across), sign * one[f"tip_{along}"]])
    slope = _slopes(one, across, along, sign)
    n = _tracked(tip, base)
    notes = [f"insertion along {'+' if sign > 0 else '-'}{along}", *doubts]
    if n < len(rows):
        notes.append(f"the last {len(rows) - n} rows are left out: the tip is the same to the last digit")
    start = tip[0, 2] - (one["depth"][0] if "depth" in one else 0.0)
    roll = one["roll"][:n] * _handedness(across, along, sign) if "roll" in one else np.zeros(n)
    slope = None if slope is None else slope[:n]
    try:
        return TipPath(name, base[:n], tip[:n], slope, float(start), note="; ".join(notes), roll=roll)
    except InputError as error:
        raise error.at(str(table.path)) from None


def _without_spikes(series: dict[str, np.ndarray]) -> list[str]:
    """Put what lies between its neighbours in place of a tip that is far from them, and say so."""
    tip = np.column_stack([series[key] for key in _TIP])
    found = spikes(tip)
    others = np.setdiff1d(np.arange(len(tip)), found)
    for key in _TIP if len(found) else ():
        series[key] = np.interp(np.arange(len(tip)), others, series[key][others])
    off = np.abs(np.column_stack([series[key] for key in _TIP]) - tip).max(axis=1)
    between = "what lies between its neighbours is taken"
    return [f"in row {k + 1} the tip is a spike, {1e3 * off[k]:.4g} mm away: {between}" for k in found]


def spikes(tip: np.ndarray) -> np.ndarray:
    """The rows in which tips (n, 3) [m] are far from those before and after, which agree: outliers as those of a force,
    after the usual step from row to row is taken off, with a tracker's noise. Along the insertion a longer or shorter
    step is no spike. Needs eight rows."""
    count = len(tip)
    if count < _FEWEST:
        return np.empty(0, int)
    found = set[int]()
    for values in np.clip(tip, 10.0 * PLACE.low, 10.0 * PLACE.high).T:
        steps, ahead = np.diff(values), max(10 - count // 2, 0)
        level = np.pad(values - np.median(steps) * np.arange(count), ahead, mode="reflect")
        rows = [k - ahead for k in outliers(level, _QUANTUM).tolist() if ahead <= k < ahead + count]
        found.update(k for k in rows if _is_beyond(values, k, float(np.median(np.abs(steps)))))
    return np.array(sorted(found), int)


def _is_beyond(values: np.ndarray, row: int, step: float) -> bool:
    """Whether a value is more than a step outside those of two rows before and after."""
    near = np.append(values[max(row - 2, 0) : row], values[row + 1 : row + 3])
    return not near.min() - step <= values[row] <= near.max() + step


def _handedness(across: list[str], along: str, sign: float) -> float:
    """1 if the axes across and the direction of the insertion are right-handed, so that its roll goes from the first to
    the second; else -1."""
    axes = np.eye(3)[[AXES.index(axis) for axis in (*across, along)]]
    return sign * round(float(np.linalg.det(axes)))


def _along(series: dict[str, np.ndarray]) -> str:
    """The axis of the insertion."""
    without = [axis for axis in AXES if f"base_{axis}" not in series]
    return without[0] if len(without) == 1 else max(AXES, key=lambda axis: float(np.ptp(series[f"tip_{axis}"])))


def _direction(along: np.ndarray, place: str) -> float:
    """+1 or -1, so that the tip goes inwards along the axis."""
    travel = along[-1] - along[0]
    if len(along) < 2 or not abs(travel) > 0.5 * np.ptp(along):
        raise InputError(
            "tip along the insertion", f"{travel:.4g} m", "does not advance", place, "Give whole insertions."
        )
    return float(np.sign(travel))


def _slopes(series: dict[str, np.ndarray], across: list[str], along: str, sign: float) -> np.ndarray | None:
    """Slopes across, as they are given or from the orientation: of the sensor's axis that is closest to the
    insertion."""
    given = [f"tip_slope_{axis}" for axis in across]
    if all(name in series for name in given):
        return np.column_stack([series[name] for name in given])
    if not all(name in series for name in _QUATERNION):
        return None
    size = np.sqrt(sum(series[name] ** 2 for name in _QUATERNION))
    if np.any(np.abs(size - 1.0) > _FAR_FROM_UNIT):
        row = int(np.argmax(np.abs(size - 1.0)))
        limit, step = "must be 1, as of a rotation", "Leave rows without an orientation out, or its four columns."
        value = f"{size[row]:.3g} in row {row + 1} of an insertion"
        raise InputError("norm of tip_qw to tip_qz", value, limit, next_step=step)
    from scipy.spatial.transform import Rotation

    turns = Rotation.from_quat(np.column_stack([series[name] for name in _QUATERNION]), scalar_first=True)
    axes = turns.as_matrix().transpose(2, 0, 1)[:, :, [AXES.index(axis) for axis in (*across, along)]]
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
