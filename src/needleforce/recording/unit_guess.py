# SPDX-License-Identifier: Apache-2.0
"""The unit of each column: given, written in its header, or the only plausible one; else asked for."""

from collections.abc import Mapping
from itertools import product

import numpy as np

from ..errors import InputError
from ..units import Unit, parse
from .columns import check_known, dimension
from .plausible import implausible, plausible, sizes_of
from .table import Table

_CANDIDATES = {"time": ("s", "ms", "us"), "depth": ("m", "mm"), "velocity": ("m/s", "mm/s")}
_FORCE = 50.0  # N: above, a force without a unit is hardly in newtons


def settle(table: Table, given: Mapping[str, str]) -> tuple[dict[str, Unit], list[str]]:
    """The unit of every column of ``table``, and sentences on what was assumed; implausible ones get a note there.

    Raises InputError where a unit is unknown and zero or several are plausible: rate 10 Hz to 20 kHz, travel 0.5 mm
    to 0.5 m, speed below 1 m/s, and a velocity that integrates to the travel.
    """
    place, units, said = str(table.layout.path), {}, []
    for quantity in given:
        check_known(quantity)
    for quantity, column in table.columns.items():
        if quantity in given:
            units[quantity] = parse(given[quantity], dimension(quantity), quantity, place)
            said += _contradiction(quantity, units[quantity], column)
        elif column.unit is not None:
            units[quantity] = parse(column.unit, dimension(quantity), quantity, place)
    assumed = _assume_motion(table, units)
    table.notes += [] if assumed else implausible(table.values, units)
    said += assumed
    said += _assume_forces(table, units)
    return {quantity: units[quantity] for quantity in table.values}, said


def _contradiction(quantity: str, unit: Unit, column) -> list[str]:
    if column.unit is None or parse(column.unit, dimension(quantity), quantity)[1:] == unit[1:]:
        return []
    return [f"{quantity} is read in {unit.symbol}, as asked for, though its header says {column.unit}"]


def _assume_motion(table: Table, units: dict[str, Unit]) -> list[str]:
    """Fill in the one plausible combination of the units of time, depth and velocity."""
    unknown = [quantity for quantity in _CANDIDATES if quantity in table.values and quantity not in units]
    if not unknown:
        return []
    sizes = sizes_of(table.values)
    found = [choice for choice in _choices(unknown) if plausible(sizes, units | choice)]
    if len(found) != 1:
        raise _unknown_unit(table, unknown, found)
    units |= found[0]
    why = "no unit is given, and no other gives a plausible rate, travel and speed"
    return [f"{quantity} is taken to be in {unit.symbol}: {why}" for quantity, unit in found[0].items()]


def _choices(unknown: list[str]):
    for symbols in product(*(_CANDIDATES[quantity] for quantity in unknown)):
        yield {q: parse(symbol, dimension(q), q) for q, symbol in zip(unknown, symbols, strict=True)}


def _unknown_unit(table: Table, unknown: list[str], found: list[dict[str, Unit]]) -> InputError:
    options = [" with ".join(f"{q} in {unit.symbol}" for q, unit in choice.items()) for choice in found]
    fit = "; ".join(options) if options else "none of " + ", ".join(s for q in unknown for s in _CANDIDATES[q])
    step = float(np.median(np.diff(table.values["time"])))
    columns = ", ".join(map(repr, table.layout.headers))
    limit = f"the columns are {columns}, the median step of time is {step:g}; plausible: {fit}"
    examples = {"time": "us", "depth": "mm", "velocity": "mm/s"}
    return InputError(
        f"unit of {' and '.join(unknown)}",
        "unknown",
        limit,
        str(table.layout.path),
        "Give " + " ".join(f"--unit {q}={examples[q]}" for q in unknown) + ", with the unit your recording has.",
    )


def _assume_forces(table: Table, units: dict[str, Unit]) -> list[str]:
    """Newtons where no unit stands and the size fits; other forces as the axial one."""
    bare = [quantity for quantity in table.values if quantity not in units]
    if not bare:
        return []
    stated = "force" in units
    units |= dict.fromkeys(bare, units["force"] if stated else _newtons(table))
    return [
        f"{', '.join(bare)} {'is' if len(bare) == 1 else 'are'} taken to be in {units['force'].symbol}: "
        + ("as the force" if stated else "no unit is given")
    ]


def _newtons(table: Table) -> Unit:
    largest = float(np.max(np.abs(table.values["force"])))
    if largest > _FORCE:
        columns = ", ".join(map(repr, table.layout.headers))
        raise InputError(
            "unit of force",
            "unknown",
            f"the columns are {columns}, and {largest:g} N is not plausible",
            str(table.layout.path),
            "Give --unit force=mN, or the unit it has.",
        )
    return parse("N", "force", "force")
