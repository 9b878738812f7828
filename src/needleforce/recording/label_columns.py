# SPDX-License-Identifier: Apache-2.0
"""Columns that name the specimen, well, needle or repeat of each row of a long table, and those that count cycles."""

from collections.abc import Mapping, Sequence

import numpy as np

from ..errors import InputError
from .formats.rows import MIN_ROWS
from .quantities import is_label, is_unit, row_name, split
from .roles import Column, stated_unit
from .table import Table

_MIN_ROWS = 2  # with one label: a column with another in every row numbers the samples
_MAX_LABELS = 10_000


def label_groups(table: Table, quantities: Mapping[str, Column]) -> list[tuple[str, np.ndarray]]:
    """The recordings that the labels in a table distinguish.

    Parameters
    ----------
    table : Table
        The table.
    quantities : mapping
        Quantity -> its column.

    Returns
    -------
    list of (str, (k,) array)
        Name, and the numbers of its rows; empty if the table has no labels.

    Notes
    -----
    A column whose header names a specimen, needle, repeat or the like is a label wherever it has several values; on one
    clock that runs through all rows only if it has texts and no other word, as a flag or a counter is none.
    Another column of text or whole numbers is one only if the recording starts again wherever it changes: the time
    goes back, or without a time the depth returns to where it first began. A phase, a segment or a state does not.
    """
    named = _free(table, quantities, [k for k in range(len(table.headers)) if row_name(table.headers[k]) == "label"])
    columns = _varying(table, named, fill=True)
    order, timed = _order_of(table, quantities) if columns else (np.empty(0), False)
    if timed and (np.diff(order) >= 0.0).all():  # one clock: what counts or flags is no label, but a name is
        columns = {k: v for k, v in columns.items() if v.dtype.kind != "f" and is_label(table.headers[k])}
        if not columns:
            return []
    if not columns:
        order, timed = _order_of(table, quantities)
        if not len(order) or (np.diff(order) >= 0.0).all():  # nothing starts again
            return []
        others = _free(table, quantities, [k for k in range(len(table.headers)) if k not in named])
        columns = {k: v for k, v in _varying(table, others).items() if _starts_again(order, v, timed)}
    return _grouped(table, columns)


def counted_cycles(table: Table, quantities: Mapping[str, Column]) -> tuple[tuple[str, int, int], ...]:
    """The cycles that a column of the table counts: name, first row, and the one after the last; empty without."""
    named = [k for k in range(len(table.headers)) if row_name(table.headers[k]) == "counter"]
    for index in _free(table, quantities, named):
        values = _values(table, index)
        if values is None or values.dtype.kind != "f":
            continue
        starts = np.concatenate([[0], np.flatnonzero(np.diff(values)) + 1])
        lengths = np.diff(np.append(starts, len(values)))
        if (
            1 < len(starts) <= _MAX_LABELS
            and np.median(lengths) >= MIN_ROWS
            and len(set(values[starts].tolist())) == len(starts)
        ):
            stops = [*starts[1:].tolist(), len(values)]
            return tuple((f"cycle {values[a]:.0f}", a, b) for a, b in zip(starts.tolist(), stops))
    return ()


def _free(table: Table, quantities: Mapping[str, Column], columns: Sequence[int]) -> list[int]:
    """Those of the columns that have no unit and are not read as a quantity."""
    free = [k for k in columns if not is_unit(stated_unit(table, k) or "")]
    used = {column.index for column in quantities.values()}
    return [k for k in free if k not in used]


def _varying(table: Table, columns: Sequence[int], *, fill: bool = False) -> dict[int, np.ndarray]:
    """Those of the columns that hold labels: several of them, each of at least two rows."""
    found = {}
    for index in columns:
        values = _values(table, index, fill)
        if values is None:
            continue
        counts = np.unique(values, return_counts=True)[1]
        if 1 < len(counts) <= _MAX_LABELS and counts.min() >= _MIN_ROWS:
            found[index] = values
    return found


def _values(table: Table, index: int, fill: bool = False) -> np.ndarray | None:
    """A column of whole numbers, or of texts; None for any other, or if a row has neither.

    With ``fill`` a row without a label has that of the row above, as in merged cells.
    """
    if index not in table.text_columns:
        try:
            values = table.numbers(index)
        except InputError:
            return _texts(table, index, fill)
        return _whole(_filled(values, ~np.isnan(values)) if fill else values)
    return _texts(table, index, fill)


def _whole(values: np.ndarray) -> np.ndarray | None:
    return values if len(values) and np.isfinite(values).all() and (values == np.round(values)).all() else None


def _texts(table: Table, index: int, fill: bool) -> np.ndarray | None:
    try:
        values = np.array(table.texts(index), dtype=object)
    except InputError:
        return None
    present = values != ""
    values = _filled(values, present) if fill else values
    return values.astype(str) if len(values) and (present[0] if fill else present.all()) else None


def _filled(values: np.ndarray, present: np.ndarray) -> np.ndarray:
    """The values, each that is absent replaced by the last one above it."""
    return values[np.maximum.accumulate(np.where(present, np.arange(len(values)), 0))] if len(values) else values


def _order_of(table: Table, quantities: Mapping[str, Column]) -> tuple[np.ndarray, bool]:
    """The time of each row, or without one the depth, and whether it is the time; empty without either."""
    column = quantities.get("time") or quantities.get("depth")
    timed = "time" in quantities
    try:
        return (np.empty(0) if column is None else table.numbers(column.index)), timed
    except InputError:
        return np.empty(0), timed


def _starts_again(order: np.ndarray, values: np.ndarray, timed: bool) -> bool:
    """Whether a recording starts again wherever the label changes."""
    if len(values) != len(order):
        return False
    at = np.flatnonzero(values[1:] != values[:-1]) + 1
    if timed:
        return bool((order[at] < order[at - 1]).all())
    return bool((np.abs(order[at] - order[0]) < np.abs(order[at] - order[at - 1])).all())


def _grouped(table: Table, columns: Mapping[int, np.ndarray]) -> list[tuple[str, np.ndarray]]:
    """Name and rows of each combination of labels, in the order of the file; columns that tell nothing further apart
    are no part of the name."""
    kept: list[int] = []
    groups = np.zeros(0, int)
    for index, values in columns.items():
        if len(kept) and len(values) != len(groups):
            continue
        both = np.unique(values, return_inverse=True)[1]
        both = both if not kept else np.unique(groups * (both.max() + 1) + both, return_inverse=True)[1]
        if not kept or both.max() > groups.max():
            kept, groups = [*kept, index], both
    if not kept or groups.max() >= _MAX_LABELS:
        return []
    first = np.unique(groups, return_index=True)[1]
    rows = np.split(np.argsort(groups, kind="stable"), np.cumsum(np.bincount(groups))[:-1])
    order = np.argsort(first)
    return [(": ".join(_name(table, k, columns[k][first[g]]) for k in kept), rows[g]) for g in order]


def _name(table: Table, index: int, value: str | float) -> str:
    """A label as part of the name of a recording: a text as it is, a number after the header."""
    if isinstance(value, str):
        return value.strip()
    header = split(table.headers[index])[0].strip() if table.has_header else "label"
    return f"{header} {value:.0f}"
