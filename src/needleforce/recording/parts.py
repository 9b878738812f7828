# SPDX-License-Identifier: Apache-2.0
"""The recordings of one file: tables one after the other, groups of columns, runs whose time starts again."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from .formats.detect import tables_of
from .quantities import MAIN, by_name, by_numbered_name, dimension, plain_name, row_name, split
from .roles import Column, Roles, assign_columns, fitting_unit, of_main, stated_unit
from .stated import stated_by
from .table import Table

_MIN_RUN = 20  # rows of a run: a shorter one is a disorder of the rows
_MAX_RUNS = 10_000
_SAME_FORCE = 0.1  # of the range of the force: largest change between two phases
_PHASE_SHARE = 0.2  # how much nearer a phase begins to the end of the last one than to its beginning
_BLOCK = 1 << 20  # samples whose steps are looked at together
_NEAR_START = 0.02  # of the range of time: a run begins where the first one began
_last: list = []  # the recordings of the last file that had several


@dataclass(frozen=True, kw_only=True)
class Part:
    """One recording of a file: its name, empty if there is no other; its table, with the roles of the columns; and the
    cycles that a column counts, with name, first row, and the one after the last."""

    name: str = ""
    table: Table
    roles: Roles
    cycles: tuple[tuple[str, int, int], ...] = ()

    def from_row(self, number: int) -> "Part":
        """The part without the rows above the one with this number in the file. Raises InputError as ``Table``."""
        table = self.table.from_row(number)
        return replace(self, table=table, roles=replace(self.roles, table=table))


def part_of(table: Table, given: Mapping[str, str], name: str = "") -> Part:
    """A table as a recording, of which ``given`` columns were chosen by the user, or belong together."""
    return Part(name=name, table=table, roles=assign_columns(table, given))


def parts_of(
    tables: Sequence[Table], given: Mapping[str, Any], belongs: "Sequence[Callable[[Part], bool]] | None" = None
) -> list[Part]:
    """The recordings of a file with these tables.

    Parameters
    ----------
    tables : sequence of Table
        All tables of the file.
    given : mapping
        Quantity -> header, or headers of which the first that a table has is used; one with ``*`` stands for several
        columns, each of a recording of its own.
    belongs : sequence of callables, optional
        Part -> whether it is one of those that are looked for, the surest first; default: whether it is a recording.

    Returns
    -------
    list of Part
        Those with the columns of a recording; those with a force if none has them; all if none has a force.

    Raises
    ------
    InputError
        A header with ``*`` matches no column of any table.
    """
    found, refused = [], None
    for table in tables:
        try:
            found += [(table, part) for each in _groups(table, given) for part in _runs(each)]
        except InputError as error:
            refused = error
    if not found and refused:
        raise refused
    usable = _usable(found, belongs or (_is_recording, _has_force))
    if len(usable) > 1 and all(table is usable[0][0] for table, _ in usable):  # its name distinguishes nothing
        name = usable[0][0].name
        return [replace(part, name=part.name.removeprefix(f"{name}: ")) for _, part in usable]
    return [part for _, part in usable]


def recordings_in(path: Path, columns: Mapping[str, str | int] | None = None) -> list[Part]:
    """The recordings of a file that is no log. Those of a file with several are kept until another file is read, so
    that each can be read without opening the file again. Raises InputError as ``read``."""
    found = path.stat() if path.exists() else None
    given = of_main(header_texts(columns))
    key = (path.absolute(), found and (found.st_mtime_ns, found.st_size), tuple(sorted(given.items())))
    if _last and _last[0][0] == key:
        return _last[0][1]
    _last.clear()
    parts = parts_of(tables_of(path), given)
    _last.extend([(key, parts)] if len(parts) > 1 else [])
    return parts


def header_texts(columns: Mapping[str, Any] | None) -> dict[str, Any]:
    """The given columns with numbers as text; several headers of one quantity as a tuple."""
    return {q: tuple(h) if isinstance(h, list | tuple) else str(h) for q, h in (columns or {}).items()}


def _usable(
    found: Sequence[tuple[Table, Part]], tests: "Sequence[Callable[[Part], bool]]"
) -> Sequence[tuple[Table, Part]]:
    """The parts that pass the first test that any of them passes; all if none passes one."""
    if len(found) > 1:
        for test in tests:
            if passing := [each for each in found if test(each[1])]:
                return passing
    return found


def _is_recording(part: Part) -> bool:
    """Whether a table has a force and something that it varies over."""
    try:
        found = part.roles.chosen(MAIN)
    except InputError as error:
        return error.value == "ambiguous"
    return "force" in found and (len(found) > 1 or bool(part.roles.given) or stated_by(part.table).rate is not None)


def _has_force(part: Part) -> bool:
    """Whether a table has a force, though nothing that it varies over."""
    fault = part.roles.faults.get("force")
    return "force" in part.roles.columns or (fault is not None and fault.value == "ambiguous")


def _first_present(table: Table, given: Mapping[str, Any]) -> dict[str, str]:
    """The given headers; of several for one quantity the first that the table has, none if it has none of them."""
    names = {plain_name(text): text for header in reversed(table.headers) for text in (split(header)[0], header)}
    names |= {header: header for header in table.headers}
    chosen = {}
    for quantity, header in given.items():
        if isinstance(header, str):
            chosen[quantity] = header
        elif found := [each for each in header if each in names or plain_name(each) in names]:
            chosen[quantity] = found[0]
    return chosen


def _groups(table: Table, given: Mapping[str, Any]) -> list[Part]:
    """The recordings side by side in a table."""
    given = _first_present(table, given)
    if any("*" in str(header) and header not in table.headers for header in given.values()):
        return _by_pattern(table, given)
    period = _period(table.headers)
    if period and not any(str(h).isdecimal() and int(h) > period for h in given.values()):
        names = [f"columns {k + 1} to {k + period}" for k in range(0, len(table.headers), period)]
        parts = [table.only_columns(k, k + period) for k in range(0, len(table.headers), period)]
        return [part_of(part, given, _joined(table.name, name)) for part, name in zip(parts, names)]
    for recognise in (by_name, by_numbered_name):
        groups = _repeated(table, recognise, given)
        if groups:
            return groups
    return [part_of(table, given, table.name)]


def _by_pattern(table: Table, given: Mapping[str, str]) -> list[Part]:
    """A recording for each text that ``*`` stands for."""
    fixed = {q: header for q, header in given.items() if "*" not in str(header)}
    taken = {column.index for column in assign_columns(table, fixed).chosen(tuple(fixed)).values()}
    bare = any(header == "*" for header in given.values())
    left = taken | (table.text_columns if bare else frozenset())
    groups: dict[str, dict[str, str]] = {}
    for quantity, pattern in given.items():
        if quantity in fixed:
            continue
        for index, header in enumerate(table.headers):
            name = next((each for each in (split(header)[0], header) if fnmatchcase(each, pattern)), "")
            if index not in left and name and not _is_empty(table, index):
                before, _, after = pattern.partition("*")
                key = name[len(before) : len(name) - len(after)].strip()
                groups.setdefault(key or name, {})[quantity] = str(index + 1)
    if not groups:
        patterns = ", ".join(f"{q}={given[q]}" for q in given if q not in fixed)
        limit = "no column with numbers matches"
        raise InputError("--column", patterns, limit, str(table.path), "Give a header in which * stands for any text.")
    return [part_of(table, fixed | chosen, _joined(table.name, key)) for key, chosen in groups.items()]


def _period(headers: Sequence[str]) -> int:
    """After how many columns the headers repeat, all of them and in any language; 0 if they do not."""
    for period in range(2, len(headers) // 2 + 1):
        first = headers[:period]
        if len(headers) % period == 0 and len(set(first)) == period and all(first):
            if all(headers[k : k + period] == first for k in range(period, len(headers), period)):
                return period
    return 0


def _is_empty(table: Table, index: int) -> bool:
    """Whether a column has neither a number nor a text."""
    try:
        return not np.isfinite(table.numbers(index)).any()
    except InputError:
        return False


def _repeated(table: Table, recognise: Callable[[str], str | None], given: Mapping[str, str]) -> list[Part]:
    """The groups of columns in which force, and depth or time, occur equally often; columns that occur once belong to
    each group."""
    columns: dict[str, list[int]] = {}
    for index, header in enumerate(table.headers):
        quantity = recognise(header)
        if quantity in MAIN and quantity not in given:
            columns.setdefault(quantity, []).append(index)
    columns = {q: fitting_unit(table, dimension(q), found) for q, found in columns.items()}
    many = {q: found for q, found in columns.items() if len(found) > 1}
    counts = {len(found) for found in many.values()}
    if "force" not in many or len(many) < 2 or len(counts) != 1:
        return []
    alone = {q: str(found[0] + 1) for q, found in columns.items() if len(found) == 1}
    groups = [{q: found[k] for q, found in many.items()} for k in range(counts.pop())]
    names = [_group_name(table, group) for group in groups]
    if len(set(names)) < len(names):
        names = [f"columns {min(group.values()) + 1} to {max(group.values()) + 1}" for group in groups]
    chosen = [dict(given) | alone | {q: str(k + 1) for q, k in group.items()} for group in groups]
    return [part_of(table, columns, _joined(table.name, name)) for name, columns in zip(names, chosen)]


def _group_name(table: Table, group: Mapping[str, int]) -> str:
    """The end that the names of the columns of a group have in common, such as the number of a specimen."""
    names = [split(table.headers[index])[0] for index in group.values()]
    ends = [name.rstrip("0123456789") for name in names]
    numbers = {name[len(end) :] for name, end in zip(names, ends)}
    return numbers.pop() if len(numbers) == 1 and by_numbered_name(names[0]) and not by_name(names[0]) else ""


def _joined(table: str, group: str) -> str:
    return f"{table}: {group}" if table and group else table or group


def _runs(part: Part) -> Iterator[Part]:
    """The recordings of a part, one below the other: those that labels name, and runs with a time that starts again."""
    quantities = part.roles.alone()
    time = np.empty(0) if part.table.is_large else _values(part.table, quantities.get("time"))
    in_order = len(time) > 0 and _increases(time) and not any(map(row_name, part.table.headers))
    if in_order or part.table.is_large:
        yield part
        return
    from .label_columns import counted_cycles, label_groups  # few files need these

    labelled = [
        replace(part, name=_joined(part.name, name), table=part.table.only_rows(rows))
        for name, rows in label_groups(part.table, quantities)
    ]
    for each in labelled or [part]:
        columns = [quantities.get(quantity) for quantity in ("time", "depth", "force")]
        starts = _starts(_values(each.table, columns[0]))
        depth, force = (_values(each.table, c) if len(starts) > 1 else np.empty(0) for c in columns[1:])
        runs = _joined_phases(starts, depth, force)
        for k, phases in enumerate(runs, 1):
            alone, stop = len(runs) < 2, runs[k][0] if k < len(runs) else None
            table = each.table if alone else each.table.only_rows(slice(phases[0], stop))
            if len(phases) > 1:
                table = table.continue_time(quantities["time"].index, tuple(row - phases[0] for row in phases[1:]))
            name = each.name if alone else _joined(each.name, f"run {k}")
            yield replace(each, name=name, table=table, cycles=counted_cycles(table, quantities))


def _values(table: Table, column: Column | None) -> np.ndarray:
    """The column of each row in the file's unit; empty without one."""
    try:
        return np.empty(0) if column is None else table.numbers(column.index)
    except InputError:  # reported when the part is read
        return np.empty(0)


def _joined_phases(starts: Sequence[int], depth: np.ndarray, force: np.ndarray) -> list[list[int]]:
    """The first rows of each recording, with those of its phases, of runs whose time starts again.

    A run is a phase of the one before, such as the indentation after an approach, if that one went one way or rested,
    and this one begins at the depth and the force at which it ended: five times nearer to this depth than to that where
    the recording began, and within a tenth of the range of the force. A repeat begins where the recording began, or
    with another force.
    """
    runs = [[starts[0]]]
    span, size = (float(np.ptp(each)) if len(each) else 0.0 for each in (depth, force))
    for last, row in pairwise(starts):
        same_force = not len(force) or abs(force[row] - force[row - 1]) <= _SAME_FORCE * size
        if len(depth) and same_force and _continues(depth, runs[-1][0], last, row, span):
            runs[-1].append(row)
        else:
            runs.append([row])
    return runs


def _continues(depth: np.ndarray, first: int, last: int, row: int, span: float) -> bool:
    """Whether the depth continues at ``row`` what began at ``first``, of which the last phase began at ``last``."""
    began, ended, begins = float(depth[first]), float(depth[row - 1]), float(depth[row])
    phase = depth[last:row]
    rested = float(np.ptp(phase)) <= _NEAR_START * span
    one_way = rested or abs(ended - float(phase[0])) > 0.5 * float(np.ptp(phase))
    near = abs(begins - ended) < _PHASE_SHARE * abs(begins - began)
    return one_way and near and abs(begins - began) > _NEAR_START * span


def _starts(time: np.ndarray) -> list[int]:
    """The first row of every run."""
    if _increases(time):
        return [0]
    present = np.flatnonzero(np.isfinite(time))
    if len(present) < 2 * _MIN_RUN:
        return [0]
    falls = np.flatnonzero(np.diff(time[present]) < 0.0) + 1
    near = time[present[0]] + _NEAR_START * np.ptp(time[present])
    lengths = np.diff(np.concatenate([[0], falls, [len(present)]]))
    if not 0 < len(falls) <= _MAX_RUNS or lengths.min() < _MIN_RUN or (time[present[falls]] > near).any():
        return [0]
    if (time[present[falls + 1]] >= time[present[falls - 1]]).any():  # one wrong time, after which the clock continues
        return [0]
    return [0, *present[falls].tolist()]


def _increases(time: np.ndarray) -> bool:
    """Whether (n,) times are finite and never decrease; looked at in blocks, for the sake of memory."""
    blocks = (time[k : k + _BLOCK + 1] for k in range(0, len(time), _BLOCK))
    return all(np.isfinite(block).all() and (np.diff(block) >= 0.0).all() for block in blocks)


def column_table(part: Part) -> list[tuple[str, str, str]]:
    """Header, stated unit, and quantity of each column of a part, for a look at it."""
    try:
        chosen = part.roles.chosen(MAIN)
        wanted = ("time", "force") if "velocity" in chosen else ("time", "depth", "force")
        chosen |= part.roles.by_unit([q for q in wanted if q not in chosen])
    except InputError:
        chosen = {}
    found = {column.index: quantity for quantity, column in chosen.items()}
    headers = enumerate(part.table.headers)
    return [(header, stated_unit(part.table, k) or "", found.get(k, "")) for k, header in headers]
