# SPDX-License-Identifier: Apache-2.0
"""The roles of the columns of a table: which is the time, the depth, the force, and why; assigned once for each
recording."""

import shlex
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any

import numpy as np

from ..errors import InputError
from ..units import DIMENSIONS, find
from .quantities import OTHER_WORDS, QUANTITIES, RECOGNISED, names_quantity, plain_name, split
from .table import Table

MOTION_PREFIX = "motion."  # of the keys of options that apply to the motion
_RECTIFIED = 1e-3  # of the range: an absolute or clipped column agrees with its signed one, but for rounding
_MAX_LISTED = 16  # columns in a message


@dataclass(frozen=True)
class Column:
    """A column with a role: its quantity, header, index, the unit that the file states, if any, and why it has the
    role: ``given``, or what it was recognised by."""

    quantity: str
    header: str
    index: int
    unit: str | None
    reason: str = "given"


@dataclass(frozen=True, kw_only=True)
class Vocabulary:
    """The quantities of a kind of table.

    Parameters
    ----------
    dimensions : mapping
        Quantity -> its dimension, empty if the unit of a column does not tell several with one name apart.
    recognised : mapping
        Reason -> function of a header that returns a quantity or None, the surest first.
    """

    dimensions: Mapping[str, str]
    recognised: Mapping[str, Callable[[str], str | None]]


RECORDINGS = Vocabulary(dimensions={q: each for q, (each, _) in QUANTITIES.items()}, recognised=RECOGNISED)


@dataclass(frozen=True, kw_only=True)
class Roles:
    """The roles of the columns of a table.

    Parameters
    ----------
    table : Table
        The table.
    given : mapping
        Quantity -> header, or number from 1, as the user chose.
    columns : mapping
        Quantity -> its column.
    matches : mapping
        Quantity -> the columns among which its column is, one or several that are as likely.
    faults : mapping
        Quantity -> why it has no column although it was given, or several columns are as likely.
    vocabulary : Vocabulary
        The quantities.
    """

    table: Table
    given: Mapping[str, str | int]
    columns: Mapping[str, Column]
    matches: Mapping[str, Sequence[int]]
    faults: Mapping[str, InputError]
    vocabulary: Vocabulary = RECORDINGS

    def chosen(self, wanted: Sequence[str]) -> dict[str, Column]:
        """The columns of the ``wanted`` quantities that have one. Raises InputError for a fault of one of them."""
        for quantity, fault in self.faults.items():
            if quantity in wanted or quantity not in self.vocabulary.dimensions:
                raise fault
        return {quantity: column for quantity, column in self.columns.items() if quantity in wanted}

    def found(self, wanted: Sequence[str]) -> dict[str, Column]:
        """As ``chosen``, empty for a fault: it is reported when the recording is read."""
        try:
            return self.chosen(wanted)
        except InputError:
            return {}

    def alone(self) -> dict[str, Column]:
        """The column of each quantity, whatever columns were given for the others: what orders the rows of a table."""
        if not self.given:
            return dict(self.columns)
        named = assign_columns(self.table, {}, self.vocabulary).columns
        found = {q: (self.columns if q in self.given else named).get(q) for q in self.vocabulary.dimensions}
        return {quantity: column for quantity, column in found.items() if column}

    def candidates(self, quantity: str) -> list[Column]:
        """The columns without a role that have a unit of a quantity."""
        used = {column.index for column in self.columns.values()}
        found = _of_dimension(self.table, self.vocabulary.dimensions[quantity], used)
        return [Column(quantity, self.table.headers[k], k, unit, "unit") for k, unit in found.items()]

    def by_unit(self, absent: Sequence[str]) -> dict[str, Column]:
        """Of the ``absent`` quantities those for which one column alone has a unit, of those without a role."""
        found = {quantity: self.candidates(quantity) for quantity in absent}
        return {quantity: columns[0] for quantity, columns in found.items() if len(columns) == 1}

    def missing(self, absent: Sequence[str], instead: Sequence[str]) -> InputError:
        """The one error for all quantities without a column; ``instead`` are other ways to give them."""
        names = " and the ".join(absent)
        candidates = {q: [column.header for column in self.candidates(q)] for q in absent}
        like = [f"for the {q}: {_listed(headers)}" for q, headers in candidates.items() if headers]
        limit = "; ".join([columns_of(self.table), *like])
        likely = self._likely(absent)
        example = " ".join(f"--column {q}={number}" for q, number in likely.items())
        step = f"Choose {'one' if len(absent) == 1 else 'each'} by its header or number, for example {example}"
        step += "".join(f", or {each}" for each in instead) + "."
        return InputError(f"no column holds the {names}", "", limit, str(self.table.path), step)

    def _likely(self, absent: Sequence[str]) -> dict[str, int | str]:
        """The number, from 1, of a free column for each quantity: time never turns, a depth turns where the motion
        does, a force with its noise too, and none has a unit of another one. ``NAME`` where there are too few."""
        found: dict[str, int | str] = {q: each[0].index + 1 for q in absent if (each := self.candidates(q))}
        stated = {index + 1 for each in DIMENSIONS for index in _of_dimension(self.table, each, ())}
        used, turning = {column.index + 1 for column in self.columns.values()} | stated, {}
        for number in set(range(1, 1 + len(self.table.headers))) - used:
            values = self.table.readable(number - 1)
            values = values[np.isfinite(values)]
            if len(values) > 1 and (values != values[0]).any():
                turning[number] = float(np.abs(np.diff(values)).sum() / np.ptp(values))
        order = [q for q in ("time", "depth", "velocity", "force") if q in absent and q not in found]
        order = order[1:] if order[:1] == ["time"] and min(turning.values(), default=2.0) > 1.0 + 1e-6 else order
        found |= dict(zip(order, sorted(turning, key=turning.__getitem__)))
        return {quantity: found.get(quantity, "NAME") for quantity in absent}


def assign_columns(table: Table, given: Mapping[str, str | int], vocabulary: Vocabulary = RECORDINGS) -> Roles:
    """Assign the columns of a table to the quantities of a vocabulary.

    A column is that of the quantity for which it was given; the others are recognised by their headers, the surest way
    first. Columns with the name of a quantity and the unit of another one, such as a depth in per cent, are left out
    where another column fits. A header that is
    absent, several columns that match one quantity, and a used header that occurs twice are faults, which ``chosen``
    raises.

    Parameters
    ----------
    table : Table
        The table.
    given : mapping
        Quantity -> header, or number from 1, chosen by the user.
    vocabulary : Vocabulary
        The quantities, and how they are recognised.

    Returns
    -------
    Roles
    """
    faults = {q: _unknown(q, vocabulary) for q in given if q not in vocabulary.dimensions}
    taken: dict[str, tuple[str, list[int]]] = {}
    others: dict[str, tuple[str, list[int]]] = {}
    for quantity in [q for q in given if q not in faults]:
        try:
            taken[quantity] = "given", _named(table, str(given[quantity]), quantity)
        except InputError as error:
            faults[quantity] = error
    for reason, recognise in vocabulary.recognised.items():
        used = {index for _, found in taken.values() for index in found}
        recognised: dict[str, list[int]] = {}
        for index, header in enumerate(table.headers):
            quantity = recognise(header)
            if quantity and quantity not in taken and quantity not in faults and index not in used:
                recognised.setdefault(quantity, []).append(index)
        for quantity, found in recognised.items():
            dimension = vocabulary.dimensions[quantity]
            found = fitting_unit(table, dimension, found)
            units = [stated_unit(table, index) for index in found]
            of_another = bool(dimension) and all(unit and not find(unit, dimension) for unit in units)
            (others if of_another else taken).setdefault(quantity, (reason, found))
    used = {index for _, found in taken.values() for index in found}
    for quantity in [q for q in others if q not in taken]:
        headers = [table.headers[k] for k in _of_dimension(table, vocabulary.dimensions[quantity], used)]
        if len(headers) != 1 or OTHER_WORDS & set(plain_name(split(headers[0])[0]).split("_")):
            taken[quantity] = others[quantity]
    columns = {}
    for quantity, (reason, found) in taken.items():
        try:
            columns[quantity] = _single(table, quantity, found, reason)
        except InputError as error:
            faults[quantity] = error
    matches = {quantity: found for quantity, (_, found) in taken.items()}
    if vocabulary is RECORDINGS and not table.is_large:
        columns |= _before_rectifying(table, columns)
    return Roles(table=table, given=given, columns=columns, matches=matches, faults=faults, vocabulary=vocabulary)


def _before_rectifying(table: Table, columns: Mapping[str, Column]) -> dict[str, Column]:
    """Force and depth that never are below zero where a column without a role is their signed one: the force is its
    absolute value, the depth is clipped at zero, but for the zero of the depth."""
    used, found = {column.index for column in columns.values()}, {}
    for quantity, column in columns.items():
        if quantity not in _SIGNED or column.reason == "given":
            continue
        free = [k for k in range(len(table.headers)) if k not in used and stated_unit(table, k) == column.unit]
        values = np.nan_to_num(table.readable(column.index)) if free else np.empty(0)
        if not len(values) or values.min() < 0.0 or not np.ptp(values) > 0.0:
            continue
        for index in free[:_MAX_LISTED]:
            other = np.nan_to_num(table.readable(index))
            if len(other) == len(values) and _SIGNED[quantity](values, other):
                reason = f"whose {'absolute value' if quantity == 'force' else 'part above zero'} is {column.header!r}"
                found[quantity] = Column(quantity, table.headers[index], index, column.unit, reason)
                break
    return found


def _is_absolute(values: np.ndarray, signed: np.ndarray) -> bool:
    tolerance = _RECTIFIED * float(np.ptp(values))
    return bool(signed.min() < -tolerance and np.abs(np.abs(signed) - values).max() <= tolerance)


def _is_clipped(values: np.ndarray, signed: np.ndarray) -> bool:
    above, tolerance = values > 0.0, _RECTIFIED * float(np.ptp(values))
    if above.all():
        return False
    moved = float(np.ptp(signed[~above])) > 10.0 * tolerance
    return moved and float(np.ptp((signed - values)[above])) <= 2.0 * tolerance


_SIGNED = {"force": _is_absolute, "depth": _is_clipped}


def _unknown(quantity: str, vocabulary: Vocabulary) -> InputError:
    known = f"known are {', '.join(vocabulary.dimensions)}"
    return InputError("quantity", repr(quantity), known, next_step="Give one of these.")


def fitting_unit(table: Table, dimension: str, found: Sequence[int]) -> list[int]:
    """Of several columns with the name of a quantity those without the unit of another one, such as ``Load (V)`` next
    to ``Load (mN)``; all if none has a unit of the quantity."""
    units = [stated_unit(table, index) if dimension else None for index in found]
    fitting = [not unit or bool(find(unit, dimension)) for unit in units]
    sure = any(fits and unit for fits, unit in zip(fitting, units))
    return [index for index, fits in zip(found, fitting) if fits or not sure]


def _of_dimension(table: Table, dimension: str, used: Collection[int]) -> dict[int, str]:
    """Index and unit of the columns, but for those in use, that have a unit of a dimension."""
    units = {k: stated_unit(table, k) for k in range(len(table.headers)) if k not in used}
    return {k: unit for k, unit in units.items() if unit and find(unit, dimension)} if dimension else {}


def of_main(options: Mapping[str, Any] | None) -> dict[str, Any]:
    """The options that do not apply to the motion."""
    return {key: value for key, value in (options or {}).items() if not key.startswith(MOTION_PREFIX)}


def of_motion(options: Mapping[str, Any] | None) -> dict[str, Any]:
    """The options that apply to the motion, without the prefix of their keys."""
    found = (options or {}).items()
    return {key.removeprefix(MOTION_PREFIX): value for key, value in found if key.startswith(MOTION_PREFIX)}


def stated_unit(table: Table, index: int) -> str | None:
    """The unit that a file states for a column, apart from its header or in it; None without one."""
    apart = table.units[index] if table.units else ""
    return apart or split(table.headers[index])[1]


def is_named(table: Table, known: Callable[[str], bool] = names_quantity) -> bool:
    """Whether any header or unit is one of a measurement, by ``known``: a file that has none may be no measurement, and
    messages quote nothing of it."""
    return table.has_header and any(map(known, filter(None, [*table.headers, *table.units])))


def columns_of(table: Table, known: Callable[[str], bool] = names_quantity) -> str:
    """The columns of a table as a message lists them: headers, none of one that is not ``is_named``."""
    if not is_named(table, known):
        what = "none has a known name or unit" if table.has_header else "the file has no header"
        return f"{what}; inspect shows its columns"
    more = f" and {len(table.headers) - _MAX_LISTED} more" if len(table.headers) > _MAX_LISTED else ""
    return f"the columns are {_listed(table.headers[:_MAX_LISTED])}{more}"


def _named(table: Table, wanted: str, quantity: str) -> list[int]:
    """The indices of the column that the user chose: its header as written, without the unit, or its number."""
    headers = table.headers
    exact = [i for i, header in enumerate(headers) if header == wanted.strip()]
    found = exact or [i for i, header in enumerate(headers) if plain_name(split(header)[0]) == plain_name(wanted)]
    if not found and wanted.isdecimal() and 1 <= int(wanted) <= len(headers):
        found = [int(wanted) - 1]
    if not found:
        fitting = _of_dimension(table, RECORDINGS.dimensions.get(quantity, ""), ()) or range(len(headers))
        words = {k: plain_name(headers[k]) for k in fitting}
        shown = {k: headers[k] if is_named(table) else str(k + 1) for k in words}
        names = {word: shown[k] for k, name in words.items() for word in (name, *name.split("_"))}
        like = get_close_matches(plain_name(wanted), names, 1) or get_close_matches(quantity, names, 1, 0.0)
        step = f"Give one of them, or its number from 1 to {len(headers)}, for example --column "
        step += f"{shlex.quote(f'{quantity}={names[like[0]]}')}."
        raise InputError(f"column for the {quantity}", repr(wanted), columns_of(table), str(table.path), step)
    return found


def _single(table: Table, quantity: str, found: list[int], reason: str) -> Column:
    names = [table.headers[index] for index in found]
    if len(names) > 1 and len(set(names)) == 1:
        limit = "each used header must be unique"
        step = f"Choose one by its number, for example --column {quantity}={found[0] + 1}."
        raise InputError(f"column {names[0]!r}", f"present {len(names)} times", limit, str(table.path), step)
    if len(names) > 1:
        limit = f"{' and '.join(map(repr, names))} match"
        step = f"Choose one, for example with --column {shlex.quote(f'{quantity}={names[0]}')}."
        raise InputError(f"column of the {quantity}", "ambiguous", limit, str(table.path), step)
    return Column(quantity, names[0], found[0], stated_unit(table, found[0]), reason)


def _listed(headers: Iterable[str]) -> str:
    """Headers as a message shows them."""
    return ", ".join(map(repr, headers))
