# SPDX-License-Identifier: Apache-2.0
"""The recordings of one file: tables one after the other, groups of columns, runs of rows; and which of them a name or
number means."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from .quantities import MAIN, by_name, by_numbered_name, dimension, plain_name, split
from .roles import Roles, assign_columns, fitting_unit
from .runs import runs_of
from .stated import stated_by
from .table import Table

_CYCLE = re.compile(r"(?:(.*): )?(cycle ?\S+)", re.IGNORECASE | re.DOTALL)
_MAX_LISTED = 12  # names in a message


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
        Quantity -> header or number, or headers of which the first that a table has is used; one with ``*`` stands for
        several columns, each of a recording of its own.
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
    given = {q: tuple(h) if isinstance(h, list | tuple) else str(h) for q, h in given.items()}
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
    found |= part.roles.by_unit([quantity for quantity in MAIN if quantity not in found])
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
    taken = {column.index for column in part_of(table, fixed).roles.chosen(tuple(fixed)).values()}
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
    values = table.readable(index)
    return len(values) > 0 and not np.isfinite(values).any()


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
    """The recordings of a part, one below the other."""
    quantities = part.roles.alone()
    by_unit = part.roles.by_unit([quantity for quantity in ("depth", "force") if quantity not in quantities])
    for name, run, cycles in runs_of(part.table, quantities, by_unit):
        yield replace(part, name=_joined(part.name, name), table=run, cycles=cycles)


def asked(wanted: str | int | None, names: Sequence[str]) -> tuple[str | int | None, str]:
    """The recording of a file with these names, and the cycle of it that is asked for, empty for the whole; a number is
    that of a cycle where the file has one recording."""
    text = "" if wanted is None else str(wanted).strip()
    if not text or text.casefold() in [name.casefold() for name in names]:
        return wanted, ""
    if len(names) < 2 and text.isdecimal():
        return None, text
    found = _CYCLE.fullmatch(text)
    return (wanted, "") if found is None else (found[1], found[2])


def chosen_part(parts: Sequence[Part], wanted: str | int | None, path: Path, option: str = "--part") -> Part:
    """The part with this name or number from 1. Raises InputError if it is absent, or needed and not given."""
    if wanted is None:
        if len(parts) == 1:
            return parts[0]
        step = f"Choose one by its name or number, such as {option} {parts[0].name!r} or {option} 1"
        step += "; campaign takes all." if option == "--part" else "."
        what = "number of recordings" if option == "--part" else "number of tables with a motion"
        raise InputError(what, len(parts), f"the file has {listed(parts)}", str(path), step)
    text = str(wanted).strip()
    plain = text.casefold().strip("/")  # the slash of a group is optional
    named = [] if isinstance(wanted, int) else [p for p in parts if p.name.casefold().strip("/") == plain]
    if len(named) == 1:
        return named[0]
    of_table = [part for part in parts if part.name.casefold().startswith(f"{text.casefold()}: ")]
    if of_table:
        return chosen_part(of_table, None, path, option)
    if text.isdecimal() and 1 <= int(text) <= len(parts):
        return parts[int(text) - 1]
    several = len(parts) > 1 or parts[0].name
    limit = f"the file has {listed(parts)}" if several else "the file has one recording, without a name"
    step = f"Give one of these names, or a number from 1 to {len(parts)}." if several else "Leave it out."
    raise InputError(option.removeprefix("--").replace("-", " "), repr(text[:60]), limit, str(path), step)


def fitting_parts(names: Sequence[str], pattern: str, place: str) -> list[int]:
    """The numbers, from 1, of the recordings whose names fit a pattern such as ``B*``, or of all. Raises InputError if
    none fits."""
    text = "*" if pattern.casefold() == "all" else pattern.casefold()
    found = [number for number, name in enumerate(names, 1) if fnmatchcase(name.casefold(), text)]
    if not found:
        shown = ", ".join(map(repr, names[:_MAX_LISTED]))
        step = "Give a pattern that one of them fits."
        raise InputError("part", repr(pattern[:60]), f"the file has {shown}", place, step)
    return found


def listed(parts: Sequence[Any]) -> str:
    """The names of the first parts, or cycles, as a message shows them."""
    names = ", ".join(repr(part.name) for part in parts[:_MAX_LISTED])
    return names + (f" and {len(parts) - _MAX_LISTED} more" if len(parts) > _MAX_LISTED else "")
