# SPDX-License-Identifier: Apache-2.0
"""Which rates, travels and speeds a needle may have, and what some units make of a file's numbers."""

from collections.abc import Mapping

import numpy as np

from ..units import Unit
from .recording import Note

_RATE = (10.0, 20e3)  # Hz
_TRAVEL = (0.5e-3, 0.5)  # m
_SPEED = 1.0  # m/s
_AGREE = 3.0  # a velocity's integral and the depth differ by less than this factor
_SOME = 2000  # samples are enough for a percentile


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
