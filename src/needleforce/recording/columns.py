# SPDX-License-Identifier: Apache-2.0
"""The columns of the quantities of a recording: those given, or recognised by their headers."""

import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from ..errors import InputError
from .quantities import RECOGNISED, check_known, dimension, listed, plain_name, split

MOTION_PREFIX = "motion."  # of the keys of options that apply to the motion
_MAX_LISTED = 16  # columns in a message


class HasColumns(Protocol):
    """What a table has before its values are read."""

    path: Path
    headers: list[str]
    units: list[str]


@dataclass(frozen=True)
class Column:
    """One used column: its quantity, header, index in the row, and the unit that the file states, if any."""

    quantity: str
    header: str
    index: int
    unit: str | None


@dataclass(frozen=True)
class Headers:
    """Headers alone, of a stream at ``path``."""

    path: Path
    headers: list[str]
    units: list[str] = field(default_factory=list)


def choose(
    table: HasColumns,
    wanted: Sequence[str],
    given: Mapping[str, str | int],
    recognised: Sequence[Callable[[str], str | None]] = RECOGNISED,
) -> dict[str, Column]:
    """Find the columns of the ``wanted`` quantities.

    Parameters
    ----------
    table : FileTable or TextTable
        The table.
    wanted : sequence of str
        Quantities to find, keys of ``QUANTITIES``.
    given : mapping
        Quantity -> header, or number from 1, chosen by the user; the others are recognised by their headers.
    recognised : sequence of callables
        Header -> quantity or None, the surest first.

    Returns
    -------
    dict
        Quantity -> Column for the quantities found.

    Raises
    ------
    InputError
        A given header is absent, two columns match one quantity, or a used header occurs twice.
    """
    for quantity in given:
        check_known(quantity)
    taken = {q: _named(table, str(header), q) for q, header in given.items() if q in wanted}
    for recognise in recognised:
        used = {index for found in taken.values() for index in found}
        found: dict[str, list[int]] = {}
        for index, header in enumerate(table.headers):
            quantity = recognise(header)
            if quantity in wanted and quantity not in taken and index not in used:
                found.setdefault(quantity, []).append(index)
        taken |= {q: with_fitting_unit(table, q, indices) for q, indices in found.items()}
    return {quantity: _single(table, quantity, found) for quantity, found in taken.items()}


def with_fitting_unit(table: HasColumns, quantity: str, found: Sequence[int]) -> list[int]:
    """Of several columns with the name of a quantity those without the unit of another one, such as ``Load (V)`` next
    to ``Load (mN)``; all if none has a unit of the quantity."""
    from ..units import find

    units = [stated_unit(table, index) for index in found]
    fitting = [not unit or bool(find(unit, dimension(quantity))) for unit in units]
    sure = any(fits and unit for fits, unit in zip(fitting, units))
    return [index for index, fits in zip(found, fitting) if fits or not sure]


def of_main(options: Mapping[str, Any] | None) -> dict[str, Any]:
    """The options that do not apply to the motion."""
    return {key: value for key, value in (options or {}).items() if not key.startswith(MOTION_PREFIX)}


def of_motion(options: Mapping[str, Any] | None) -> dict[str, Any]:
    """The options that apply to the motion, without the prefix of their keys."""
    return {
        key.removeprefix(MOTION_PREFIX): value
        for key, value in (options or {}).items()
        if key.startswith(MOTION_PREFIX)
    }


def stated_unit(table: HasColumns, index: int) -> str | None:
    """The unit that a file states for a column, apart from its header or in it; None without one."""
    apart = table.units[index] if table.units else ""
    return apart or split(table.headers[index])[1]


def columns_of(table: HasColumns) -> str:
    """The columns of a table as a message lists them: headers, or the numbers of a table without."""
    headers = table.headers[:_MAX_LISTED]
    more = f" and {len(table.headers) - _MAX_LISTED} more" if len(table.headers) > _MAX_LISTED else ""
    first = getattr(table, "first_cells", None)
    if first is not None and not table.has_header:
        return f"the file has no header; its first row is {', '.join(first()[:_MAX_LISTED])}{more}"
    return f"the columns are {listed(headers)}{more}"


def missing(
    table: HasColumns, absent: Sequence[str], chosen: Mapping[str, Column], instead: Sequence[str]
) -> InputError:
    """The one error for all quantities without a column; ``instead`` are other ways to give them."""
    names = " and the ".join(absent)
    like = [f"for the {q}: {listed(found)}" for q in absent if (found := _candidates(table, q, chosen))]
    limit = "; ".join([columns_of(table), *like])
    step = f"Choose {'one' if len(absent) == 1 else 'each'} with " + " ".join(f"--column {q}=NAME" for q in absent)
    step += "".join(f", or {each}" for each in instead) + "; NAME is a header or the number of a column."
    return InputError(f"no column holds the {names}", "", limit, str(table.path), step)


def by_unit(table: HasColumns, absent: Sequence[str], chosen: Mapping[str, Column]) -> dict[str, Column]:
    """Of the ``absent`` quantities those for which one column alone has a unit, of those that are not chosen."""
    found = {}
    for quantity in absent:
        headers = _candidates(table, quantity, chosen)
        if len(headers) == 1:
            index = next(k for k in range(len(table.headers)) if table.headers[k] == headers[0])
            found[quantity] = Column(quantity, headers[0], index, stated_unit(table, index))
    return found


def _candidates(table: HasColumns, quantity: str, chosen: Mapping[str, Column]) -> list[str]:
    """The headers of columns that are not used and have a unit of this quantity."""
    from ..units import find

    used = {column.index for column in chosen.values()}
    free = [k for k in range(len(table.headers)) if k not in used]
    return [table.headers[k] for k in free if find(stated_unit(table, k) or "", dimension(quantity))]


def _named(table: HasColumns, wanted: str, quantity: str) -> list[int]:
    """The indices of the column that the user chose: its header as written, without the unit, or its number."""
    headers = table.headers
    exact = [i for i, header in enumerate(headers) if header == wanted.strip()]
    found = exact or [i for i, header in enumerate(headers) if plain_name(split(header)[0]) == plain_name(wanted)]
    if not found and wanted.isdecimal() and 1 <= int(wanted) <= len(headers):
        found = [int(wanted) - 1]
    if not found:
        step = f"Give one of them, or its number from 1 to {len(headers)}, with --column {quantity}=NAME."
        raise InputError(f"column for the {quantity}", repr(wanted), columns_of(table), str(table.path), step)
    return found


def _single(table: HasColumns, quantity: str, found: list[int]) -> Column:
    names = [table.headers[index] for index in found]
    if len(names) > 1 and len(set(names)) == 1:
        limit = "each used header must be unique"
        step = f"Choose one by its number, for example --column {quantity}={found[0] + 1}."
        raise InputError(f"column {names[0]!r}", f"present {len(names)} times", limit, str(table.path), step)
    if len(names) > 1:
        limit = f"{' and '.join(map(repr, names))} match"
        step = f"Choose one, for example with --column {shlex.quote(f'{quantity}={names[0]}')}."
        raise InputError(f"column of the {quantity}", "ambiguous", limit, str(table.path), step)
    return Column(quantity, names[0], found[0], stated_unit(table, found[0]))
