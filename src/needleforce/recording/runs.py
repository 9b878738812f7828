# SPDX-License-Identifier: Apache-2.0
"""The recordings one below the other in a table: those that columns of labels distinguish, such as the specimen or the
repeat of each row, and runs whose time starts again; with the cycles that a column counts."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise

import numpy as np

from ..errors import InputError
from .formats.rows import MIN_ROWS
from .quantities import is_unit, plain_name, split
from .recording import Note
from .roles import Column, stated_unit
from .table import Table

_BLOCK = 1 << 20  # samples whose steps are looked at together
_MIN_RUN = 20  # rows of a run: a shorter one is a disorder of the rows
_JUMP = 3.0  # times the next step: the depth jumps between two segments
_MIN_REST = 3  # rows of the first run, which may be a short rest
_MAX_RUNS = 10_000
_SAME_FORCE = 0.1  # of the range of the force: largest change between two phases
_PHASE_SHARE = 0.2  # how much nearer a phase begins to the end of the last one than to its beginning
_NEAR_START = 0.02  # of the range of time: a run begins where the first one began
_MIN_ROWS = 2  # with one label: a column with another in every row numbers the samples
_MAX_LABELS = 10_000

# of columns that name the specimen, needle or repeat of each row, or count cycles
_LABELS = frozenset(
    "specimen specimens sample samples well needle repeat repetition replicate rep test trial run experiment insertion "
    "site spot id probe probekorper prufling nadel versuch messung wiederholung einstich echantillon eprouvette "
    "aiguille essai muestra probeta aguja ensayo repeticion campione provino ago prova ripetizione".split()
)
_COUNTERS = frozenset("cycle cycles loop loops zyklus zyklen zyklusnummer ciclo ciclos cicli".split())
# words that make a column with one of these something that varies within a recording, or that is measured
_NOT_LABELS = frozenset(
    "segment phase stage step state status type mode direction rate speed velocity time date duration temperature "
    "frequency length width thickness height area diameter volume mass weight force load depth position".split()
)

Cycles = tuple[tuple[str, int, int], ...]
"""Name, first row, and the one after the last."""


@lru_cache(4096)
def row_name(header: str) -> str:
    """``label`` for a column that names the specimen, needle or repeat of each row, ``counter`` for one that counts
    cycles, empty for any other."""
    words = set(plain_name(split(header)[0]).split("_"))
    if words & _NOT_LABELS:
        return ""
    return "label" if words & _LABELS else "counter" if words & _COUNTERS else ""


def is_label(header: str) -> bool:
    """Whether every word of a header is one of a label, such as ``specimen_id``."""
    return set(plain_name(split(header)[0]).split("_")) <= _LABELS | {"no", "nr", "number", "name", "code", "label"}


def runs_of(
    table: Table, quantities: Mapping[str, Column], by_unit: Mapping[str, Column]
) -> Iterator[tuple[str, Table, Cycles]]:
    """The recordings in the rows of a table: name, empty if there is one, table, and the cycles that a column counts.

    ``quantities`` are their columns, in whose order the rows are; ``by_unit`` are those of further ones, which show
    whether a recording continues where its time starts again.
    """
    shown = {**by_unit, **quantities}
    time = np.empty(0) if table.is_large else values_of(table, shown.get("time"))
    if table.is_large or (increases(time) and not any(map(row_name, table.headers))):
        yield "", table, ()
        return
    table = _turned(table, time, shown.get("depth"))
    labelled = [(name, table.only_rows(rows)) for name, rows in _label_groups(table, quantities, shown)]
    for label, rows in labelled or [("", table)]:
        columns = [shown.get(quantity) for quantity in ("time", "depth", "force")]
        starts = _starts(values_of(rows, columns[0]))
        depth, force = (values_of(rows, each) if len(starts) > 1 else np.empty(0) for each in columns[1:])
        runs = _joined_phases(starts, depth, force)
        for k, phases in enumerate(runs, 1):
            alone, stop = len(runs) < 2, runs[k][0] if k < len(runs) else None
            run = rows if alone else rows.only_rows(slice(phases[0], stop))
            if len(phases) > 1:
                run = run.continue_time(quantities["time"].index, tuple(row - phases[0] for row in phases[1:]))
            name = ": ".join(filter(None, (label, "" if alone else f"run {k}")))
            yield name, run, _counted_cycles(run, quantities)


def _turned(table: Table, time: np.ndarray, depth_column: Column | None) -> Table:
    """The table with the order of the rows reversed wherever its time decreases over 20 rows or more, as in segments of
    a force curve that are saved from the farthest point on."""
    falls = np.diff(time) < 0.0
    if np.count_nonzero(falls) < _MIN_RUN - 1:
        return table
    edges = np.flatnonzero(np.diff(np.concatenate(([False], falls, [False])).astype(int)))
    depth = values_of(table, depth_column)
    rows, spans = np.arange(len(time)), []
    for first, last in zip(edges[::2].tolist(), edges[1::2].tolist()):
        if last - first >= _MIN_RUN - 1:
            first += any(_ends_a_segment(values, first) for values in (time, depth[: len(time)]))
            rows[first : last + 1] = rows[first : last + 1][::-1]
            spans.append((first, last))
    if not spans:
        return table
    first = table.place(spans[0][0])
    message = f"the time runs back in {len(spans)} segments, the first from {first} on: they are read in order of time"
    note = Note("phases", message.replace("1 segments, the first from", "the segment from"), len(spans))
    return replace(table.only_rows(rows), notes=[*table.notes, note])


def _ends_a_segment(values: np.ndarray, row: int) -> bool:
    """Whether a row is the last of a segment and not the first of the next one: (n,) values jump after it."""
    steps = np.abs(np.diff(values[max(row - 1, 0) : row + 3]))
    return row > 0 and len(steps) == 3 and bool(steps[1] > max(steps[0], _JUMP * steps[2]))


def values_of(table: Table, column: Column | None) -> np.ndarray:
    """The column of each row in the file's unit; empty without one, or if it holds text: that is an error when the part
    is read."""
    return np.empty(0) if column is None else table.readable(column.index)


def increases(time: np.ndarray) -> bool:
    """Whether (n,) times, one or more, are finite and never decrease; looked at in blocks, for the sake of memory."""
    blocks = (time[k : k + _BLOCK + 1] for k in range(0, len(time), _BLOCK))
    return len(time) > 0 and all(np.isfinite(block).all() and (np.diff(block) >= 0.0).all() for block in blocks)


def _joined_phases(starts: Sequence[int], depth: np.ndarray, force: np.ndarray) -> list[list[int]]:
    """The first rows of each recording, with those of its phases, of runs whose time starts again.

    A run is a phase of the one before, such as the indentation after an approach, if that one went one way or rested,
    and this one begins at the depth and the force at which it ended: five times nearer to this depth than to that where
    the recording began, unless one of them only rests, and within a tenth of the range of the force. A repeat begins
    where the recording began, or with another force.
    """
    runs = [[starts[0]]]
    depth, force = (each if len(each) > starts[-1] else np.empty(0) for each in (depth, force))
    span, size = (float(np.ptp(each)) if len(each) else 0.0 for each in (depth, force))
    for (last, row), stop in zip(pairwise(starts), [*starts[2:], len(depth)]):
        same_force = not len(force) or abs(force[row] - force[row - 1]) <= _SAME_FORCE * size
        near = _NEAR_START * span
        rests = len(depth) and float(np.ptp(depth[row:stop])) <= near and abs(depth[row] - depth[row - 1]) <= near
        if len(depth) and same_force and (rests or _continues(depth, runs[-1][0], last, row, span)):
            runs[-1].append(row)
        else:
            runs.append([row])
    return runs


def _continues(depth: np.ndarray, first: int, last: int, row: int, span: float) -> bool:
    """Whether the depth continues at ``row`` what began at ``first``, of which the last phase began at ``last``."""
    began, ended, begins = float(depth[first]), float(depth[row - 1]), float(depth[row])
    if float(np.ptp(depth[first:row])) <= _NEAR_START * span:  # a rest alone is no recording
        return abs(begins - ended) <= _NEAR_START * span
    phase = depth[last:row]
    rested = float(np.ptp(phase)) <= _NEAR_START * span
    one_way = rested or abs(ended - float(phase[0])) > 0.5 * float(np.ptp(phase))
    near = abs(begins - ended) < _PHASE_SHARE * abs(begins - began)
    return one_way and near and abs(begins - began) > _NEAR_START * span


def _starts(time: np.ndarray) -> list[int]:
    """The first row of every run."""
    if not len(time) or increases(time):
        return [0]
    present = np.flatnonzero(np.isfinite(time))
    if len(present) < 2 * _MIN_RUN:
        return [0]
    falls = np.flatnonzero(np.diff(time[present]) < 0.0) + 1
    near = time[present[0]] + _NEAR_START * np.ptp(time[present])
    lengths = np.diff(np.concatenate([[0], falls, [len(present)]]))
    if not 0 < len(falls) <= _MAX_RUNS or lengths[1:].min() < _MIN_RUN or (time[present[falls]] > near).any():
        return [0]
    far = near - time[present[falls[0]]] > 2.0 * _NEAR_START * np.ptp(time[present])
    if lengths[0] < _MIN_RUN and (lengths[0] < _MIN_REST or far):  # the clock starts again after a short rest
        return [0]
    if (time[present[falls + 1]] >= time[present[falls - 1]]).any():  # one wrong time, after which the clock continues
        return [0]
    return [0, *present[falls].tolist()]


def _label_groups(
    table: Table, quantities: Mapping[str, Column], shown: Mapping[str, Column]
) -> list[tuple[str, np.ndarray]]:
    """The recordings that the labels in a table distinguish.

    Parameters
    ----------
    table : Table
        The table.
    quantities, shown : mapping
        As ``quantities`` of ``runs_of``, and these with further ones.

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
        depth, force = (values_of(table, shown.get(each)) if columns else np.empty(0) for each in ("depth", "force"))
        columns = {k: v for k, v in columns.items() if not (timed and _are_phases(v, depth, force))}
    return _grouped(table, columns)


def _counted_cycles(table: Table, quantities: Mapping[str, Column]) -> tuple[tuple[str, int, int], ...]:
    """The cycles that a column of the table counts: name, first row, and the one after the last; empty without."""
    named = [k for k in range(len(table.headers)) if row_name(table.headers[k]) == "counter"]
    for index in _free(table, quantities, named):
        values = _label_values(table, index)
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
        values = _label_values(table, index, fill)
        if values is None:
            continue
        counts = np.unique(values, return_counts=True)[1]
        if 1 < len(counts) <= _MAX_LABELS and counts.min() >= _MIN_ROWS:
            found[index] = values
    return found


def _label_values(table: Table, index: int, fill: bool = False) -> np.ndarray | None:
    """A column of whole numbers, or of texts; None for any other, or if a row has neither.

    With ``fill`` a row without a label has that of the row above, as in merged cells.
    """
    if index not in table.text_columns and len(values := table.readable(index)):
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
    return values_of(table, column), "time" in quantities


def _starts_again(order: np.ndarray, values: np.ndarray, timed: bool) -> bool:
    """Whether a recording starts again wherever the label changes."""
    if len(values) != len(order):
        return False
    at = np.flatnonzero(values[1:] != values[:-1]) + 1
    if timed:
        return bool((order[at] < order[at - 1]).all())
    return bool((np.abs(order[at] - order[0]) < np.abs(order[at] - order[at - 1])).all())


def _are_phases(values: np.ndarray, depth: np.ndarray, force: np.ndarray) -> bool:
    """Whether a recording continues where a label changes, as from segment to segment."""
    starts = [0, *(np.flatnonzero(values[1:] != values[:-1]) + 1).tolist()]
    return len(depth) == len(values) and len(_joined_phases(starts, depth, force)) < len(starts)


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
