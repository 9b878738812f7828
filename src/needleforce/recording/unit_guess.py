# SPDX-License-Identifier: Apache-2.0
"""The unit of each column: given, written in its header, or the only one that gives a plausible rate, travel and
speed; otherwise asked for."""

from collections.abc import Mapping
from itertools import product

import numpy as np

from ..errors import InputError
from ..units import Unit, parse
from .columns import check_known, dimension
from .recording import Note
from .table import Table

_RATE = (10.0, 20e3)  # Hz
_TRAVEL = (0.5e-3, 0.5)  # m
_SPEED = 1.0  # m/s
_AGREE = 3.0  # a velocity's integral and the depth differ by less than this factor
_SOME = 2000  # samples are enough for a percentile
_CANDIDATES = {"time": ("s", "ms", "us"), "depth": ("m", "mm"), "velocity": ("m/s", "mm/s")}
_FORCE = 50.0  # N: above, a force without a unit is hardly in newtons


def sizes_of(values: Mapping[str, np.ndarray], integral: bool = True) -> dict[str, float]:
    """Median step, travels and 95 % speeds in the units of the file; ``integral`` asks for that of the velocity."""
    count = len(values["time"])
    some = np.arange(0, count - 1, 1 + (count - 1) // _SOME)
    steps = values["time"][some + 1] - values["time"][some]
    sizes = {"step": float(np.median(steps))}
    if "depth" in values:
        depth = values["depth"]
        sizes["travel"] = float(np.ptp(depth))
        sizes["speed"] = float(np.percentile(np.abs(depth[some + 1] - depth[some]) / steps, 95))
    if "velocity" in values:
        velocity = values["velocity"]
        sizes["velocity"] = float(np.percentile(np.abs(velocity[some]), 95))
        if integral:
            areas = 0.5 * (velocity[1:] + velocity[:-1]) * np.diff(values["time"])
            sizes["integral"] = float(np.ptp(np.cumsum(areas)))
    return sizes


def plausible(sizes: Mapping[str, float], units: Mapping[str, Unit]) -> bool:
    """Whether the units make a needle's rate, travel and speed of the sizes, and all travels agree."""
    rate, travels, speeds = _in_si(sizes, units)
    steady = _RATE[0] <= rate <= _RATE[1] and all(each <= _SPEED for each in speeds)
    moves = all(_TRAVEL[0] <= each <= _TRAVEL[1] for each in travels)
    return steady and moves and max(travels, default=1.0) < _AGREE * min(travels, default=1.0)


def implausible(values: Mapping[str, np.ndarray], units: Mapping[str, Unit]) -> list[Note]:
    """A note on the rate, travel and speed that stated units make of the numbers, where they hardly are a needle's."""
    rate, travels, speeds = _in_si(sizes_of(values, integral="depth" not in values), units)
    wrong = [] if _RATE[0] <= rate <= _RATE[1] else [f"a rate of {rate:.3g} Hz"]
    wrong += [f"a travel of {each:.3g} m" for each in travels if not _TRAVEL[0] <= each <= _TRAVEL[1]]
    wrong += [f"a speed of {each:.3g} m/s" for each in speeds if each > _SPEED]
    if not wrong:
        return []
    limits = f"{_RATE[0]:g} to {_RATE[1]:g} Hz, {_TRAVEL[0]:g} to {_TRAVEL[1]:g} m and up to {_SPEED:g} m/s"
    told = f"the stated units give {' and '.join(wrong)}, but a needle's are {limits}"
    return [Note("implausible", f"{told}: if a unit is wrong, give the right one, as --unit depth=mm", len(wrong))]


def _in_si(sizes: Mapping[str, float], units: Mapping[str, Unit]) -> tuple[float, list[float], list[float]]:
    """Rate [Hz], travels [m] and speeds [m/s]; a sign that a unit turns round does not count."""
    second, travels, speeds = units["time"].to_si(1.0), [], []
    if "travel" in sizes:
        travels.append(units["depth"].to_si(sizes["travel"]))
        speeds.append(units["depth"].to_si(sizes["speed"]) / second)
    if "integral" in sizes:
        travels.append(units["velocity"].to_si(sizes["integral"]) * second)
    if "velocity" in sizes:
        speeds.append(units["velocity"].to_si(sizes["velocity"]))
    return 1.0 / (sizes["step"] * second), [abs(each) for each in travels], [abs(each) for each in speeds]


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
