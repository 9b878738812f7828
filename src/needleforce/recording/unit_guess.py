# SPDX-License-Identifier: Apache-2.0
"""The unit of each column: given, written in its header, or the only one with a plausible rate, travel and speed;
otherwise an InputError asks for it."""

from collections.abc import Iterator, Mapping
from itertools import product

import numpy as np

from ..errors import InputError
from ..units import Unit, find, parse
from .quantities import check_known, dimension
from .recording import Note
from .roles import Column, columns_of
from .samples import Samples

_RATE_RANGE_HZ = (9.0, 20e3)  # Hz: 10 Hz with its jitter
_TRAVEL_RANGE_M = (50e-6, 0.3)  # m
_MAX_SPEED_M_S = 1.0  # m/s
_MAX_TRAVEL_RATIO = 3.0  # largest ratio of a velocity's integral and the travel
_PERCENTILE_SAMPLES = 2000  # samples: enough for a percentile
_CANDIDATES = {"time": ("s", "ms", "us"), "depth": ("m", "mm"), "velocity": ("m/s", "mm/s")}
_PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
_MAX_FORCE_N = 50.0  # N: a larger force without a unit is probably not in newtons


def motion_sizes(values: Mapping[str, np.ndarray], integral: bool = True) -> dict[str, float]:
    """Median step, travels and 95 % speeds in the units of the file; with ``integral`` also that of the velocity.

    Without a time there are travels only.
    """
    sizes = {"travel": float(np.ptp(values["depth"]))} if "depth" in values else {}
    if "time" not in values:
        return sizes
    count = len(values["time"])
    selected = np.arange(0, count - 1, 1 + (count - 1) // _PERCENTILE_SAMPLES)
    steps = values["time"][selected + 1] - values["time"][selected]
    sizes["step"] = float(np.median(steps))
    if "depth" in values:
        depth = values["depth"]
        with np.errstate(over="ignore"):  # steps of less than 1e-300
            speeds = np.abs(depth[selected + 1] - depth[selected]) / steps
        sizes["speed"] = float(np.percentile(speeds, 95))
    if "velocity" in values:
        velocity = values["velocity"]
        sizes["velocity"] = float(np.percentile(np.abs(velocity[selected]), 95))
        if integral:
            areas = 0.5 * (velocity[1:] + velocity[:-1]) * np.diff(values["time"])
            sizes["integral"] = float(np.ptp(np.cumsum(areas)))
    return sizes


def plausible(sizes: Mapping[str, float], units: Mapping[str, Unit]) -> bool:
    """Whether rate, travel and speed in these units are in the range of a needle insertion, and the travels agree."""
    rate, travels, speeds = _in_si(sizes, units)
    steady = rate is None or _RATE_RANGE_HZ[0] <= rate <= _RATE_RANGE_HZ[1]
    moves = all(_TRAVEL_RANGE_M[0] <= each <= _TRAVEL_RANGE_M[1] for each in travels)
    moves &= all(each <= _MAX_SPEED_M_S for each in speeds)
    return steady and moves and max(travels, default=1.0) < _MAX_TRAVEL_RATIO * min(travels, default=1.0)


def plausibility_notes(values: Mapping[str, np.ndarray], units: Mapping[str, Unit]) -> list[Note]:
    """A note if rate, travel or speed in the stated units are outside the range of a needle insertion."""
    rate, travels, speeds = _in_si(motion_sizes(values, integral="depth" not in values), units)
    unusual = [] if rate is None or _RATE_RANGE_HZ[0] <= rate <= _RATE_RANGE_HZ[1] else [f"a rate of {rate:.3g} Hz"]
    unusual += [f"a travel of {each:.3g} m" for each in travels if not _TRAVEL_RANGE_M[0] <= each <= _TRAVEL_RANGE_M[1]]
    unusual += [f"a speed of {each:.3g} m/s" for each in speeds if each > _MAX_SPEED_M_S]
    if not unusual:
        return []
    limits = f"{_RATE_RANGE_HZ[0]:g} to {_RATE_RANGE_HZ[1]:g} Hz, {_TRAVEL_RANGE_M[0]:g} to {_TRAVEL_RANGE_M[1]:g} m "
    limits += f"and up to {_MAX_SPEED_M_S:g} m/s"
    message = f"the stated units give {' and '.join(unusual)}, outside the usual range of {limits} of a needle"
    others = [choice for q in _CANDIDATES if q in values for choice in _choices([q])]
    sizes = motion_sizes(values)
    usual = [f"--unit {q}={u.symbol}" for each in others for q, u in each.items() if plausible(sizes, units | each)]
    advice = f"; within it would be {' or '.join(usual)}, if the file states it wrongly" if usual else ""
    return [Note("implausible", message + advice, len(unusual))]


def _in_si(sizes: Mapping[str, float], units: Mapping[str, Unit]) -> tuple[float | None, list[float], list[float]]:
    """Rate [Hz], travels [m] and speeds [m/s] as magnitudes, because a unit may reverse the sign."""
    second, travels, speeds = units["time"].to_si(1.0) if "time" in units else 1.0, [], []
    if "travel" in sizes:
        travels.append(units["depth"].to_si(sizes["travel"]))
    if "speed" in sizes:
        speeds.append(units["depth"].to_si(sizes["speed"]) / second)
    if "integral" in sizes:
        travels.append(units["velocity"].to_si(sizes["integral"]) * second)
    if "velocity" in sizes:
        speeds.append(units["velocity"].to_si(sizes["velocity"]))
    rate = 1.0 / (sizes["step"] * second) if "step" in sizes else None
    return rate, [abs(each) for each in travels], [abs(each) for each in speeds]


def assign_units(
    samples: Samples, given: Mapping[str, str], *, needle: bool = True
) -> tuple[dict[str, Unit], list[str]]:
    """The unit of every column of ``samples``, and sentences on what was assumed; implausible units add a note to it.

    A stated unit is believed. Raises InputError if a unit is unknown and none or several are plausible. Plausible of a
    ``needle`` are a rate of 9 Hz to 20 kHz, a travel of 0.05 mm to 0.3 m, a speed below 1 m/s, and a velocity whose
    integral agrees with the travel.
    """
    place, units, sentences = str(samples.table.path), {}, []
    for quantity in given:
        check_known(quantity)
    for quantity, column in samples.columns.items():
        if quantity in given:
            units[quantity] = parse(given[quantity], dimension(quantity), quantity, place)
            sentences += _contradiction(quantity, units[quantity], column)
        elif column.unit is not None:
            units[quantity] = parse(column.unit, dimension(quantity), quantity, place)
    assumed = _assume_motion(samples, units)
    samples.notes += [] if assumed or not needle else plausibility_notes(samples.values, units)
    sentences += assumed
    sentences += _assume_forces(samples, units)
    return {quantity: units[quantity] for quantity in samples.values}, sentences


def _contradiction(quantity: str, unit: Unit, column: Column) -> list[str]:
    stated = None if column.unit is None else find(column.unit, dimension(quantity))
    if column.unit is None or (stated is not None and stated[1:] == unit[1:]):
        return []
    return [f"{quantity} is read in {unit.symbol}, as given, although its header states {column.unit}"]


def _assume_motion(samples: Samples, units: dict[str, Unit]) -> list[str]:
    """Assume the only plausible combination of the units of time, depth and velocity."""
    unknown = [quantity for quantity in _CANDIDATES if quantity in samples.values and quantity not in units]
    if not unknown:
        return []
    of_calendar = _calendar_unit(samples) if "time" in unknown else None
    if of_calendar:
        units["time"] = parse(of_calendar, "time", "time")
        return [
            f"time is assumed to be in {of_calendar} from 1970 on, as its size shows",
            *_assume_motion(samples, units),
        ]
    sizes = motion_sizes(samples.values)
    found = [choice for choice in _choices(unknown) if plausible(sizes, units | choice)]
    if len(found) != 1:
        raise _unknown_unit(samples, unknown, found)
    units |= found[0]
    reason = "no unit is given, and no other gives a plausible rate, travel and speed"
    return [f"{quantity} is assumed to be in {unit.symbol}: {reason}" for quantity, unit in found[0].items()]


def _calendar_unit(samples: Samples) -> str | None:
    """The unit in which the first time is a date between 2001 and 2096, counted from 1970, if it gives a plausible
    rate: a counter of microseconds may be as large."""
    first = float(samples.values["time"][0])
    found = next((unit for unit, size in _PER_SECOND.items() if 1e9 <= first / size < 4e9), None)
    step = {"step": float(np.median(np.diff(samples.values["time"])))}
    return found if found and plausible(step, {"time": parse(found, "time", "time")}) else None


def _choices(unknown: list[str]) -> Iterator[dict[str, Unit]]:
    for symbols in product(*(_CANDIDATES[quantity] for quantity in unknown)):
        yield {q: parse(symbol, dimension(q), q) for q, symbol in zip(unknown, symbols, strict=True)}


def _unknown_unit(samples: Samples, unknown: list[str], found: list[dict[str, Unit]]) -> InputError:
    options = [" with ".join(f"{q} in {unit.symbol}" for q, unit in choice.items()) for choice in found]
    candidates = "; ".join(options) if options else "none of " + ", ".join(s for q in unknown for s in _CANDIDATES[q])
    step = f", the median step of time is {np.median(np.diff(samples.values['time'])):g}" if "time" in unknown else ""
    limit = f"{columns_of(samples.table)}{step}; plausible: {candidates}"
    example = found[0] if found else next(_choices(unknown))
    given = " ".join(f"--unit {q}={example[q].symbol}" for q in unknown)
    step = f"Give the unit of your recording, for example {given}."
    return InputError(f"unit of {' and '.join(unknown)}", "unknown", limit, str(samples.table.path), step)


def _assume_forces(samples: Samples, units: dict[str, Unit]) -> list[str]:
    """Assume newtons for a force without a unit if its size is plausible, and the unit of the force for its axes."""
    without_unit = [quantity for quantity in samples.values if quantity not in units]
    if not without_unit:
        return []
    largest, reason = float(np.max(np.abs(samples.values["force"]))), "as the force"
    if "force" not in units:
        grams = parse("g", "force", "force").to_si(largest)
        reason = f"no unit is given; the largest value is {largest:.3g} N, in g it would be {grams:.3g} N"
    units |= dict.fromkeys(without_unit, units["force"] if "force" in units else _newtons(samples, largest))
    names = f"{', '.join(without_unit)} {'is' if len(without_unit) == 1 else 'are'}"
    return [f"{names} assumed to be in {units['force'].symbol}: {reason}"]


def _newtons(samples: Samples, largest: float) -> Unit:
    if largest > _MAX_FORCE_N:
        limit = f"{columns_of(samples.table)}; the largest value is {largest:g}, which may be in N, mN or g"
        step = "Give the unit of the force, for example --unit force=mN."
        raise InputError("unit of force", "unknown", limit, str(samples.table.path), step)
    return parse("N", "force", "force")
