# SPDX-License-Identifier: Apache-2.0
"""Faults of the rig by name: one table of meanings and ranges."""

import math
from collections.abc import Mapping
from typing import NamedTuple

from ...errors import InputError


class Fault(NamedTuple):
    """Meaning of a fault, the range of its value, and its value when it is absent."""

    meaning: str
    low: float
    high: float
    absent: float


def _share(meaning: str) -> Fault:
    return Fault(f"share of {meaning}", 0.0, 1.0, 0.0)


def _moment(meaning: str) -> Fault:
    return Fault(f"rig seconds after which {meaning}", 0.0, 1e6, math.inf)


FAULTS = {
    "lost": _share("packets that never arrive"),
    "lost_burst": Fault("packets lost in a row each time; the share stays", 1.0, 1000.0, 1.0),
    "duplicated": _share("packets that arrive twice"),
    "reordered": _share("packets that one to three later ones overtake"),
    "late": _share("packets delayed, each by up to late_ms"),
    "late_ms": Fault("longest delay of a late packet [ms]", 1.0, 10_000.0, 20.0),
    "status_error": _share("records whose status reports a failed serial link of the sensor"),
    "stale": _share("records that repeat the previous reading: sample counter and counts do not change"),
    "foreign": _share("packets with an additional packet of random counts from another socket"),
    "wrong_size": _share("packets with an additional packet that is too short or too long"),
    "sensor_drift_ppm": Fault(
        "how much faster the sensor's clock runs than the rig's [1e-6]", -10_000.0, 10_000.0, 0.0
    ),
    "axis_drift_ppm": Fault("how much faster the axis' clock runs than the rig's [1e-6]", -10_000.0, 10_000.0, 0.0),
    "clock_offset_s": Fault("time of the axis' clock at the rig's start [s]", -1e6, 1e6, 0.0),
    "stall_at_s": _moment("the axis is stuck"),
    "axis_silent_at_s": _moment("the axis neither receives nor sends anything"),
    "sensor_silent_at_s": _moment("the sensor neither receives nor sends anything"),
    "power_cut_s": _moment("everything stops and nothing answers"),
}


def checked_faults(given: Mapping[str, float]) -> dict[str, float]:
    """The value of every fault; faults that are not ``given`` are absent.

    Raises InputError for an unknown fault and for a value outside its range.
    """
    for name, value in given.items():
        if name not in FAULTS:
            raise InputError("fault", repr(name), "unknown", next_step=f"Give one of {', '.join(FAULTS)}.")
        fault = FAULTS[name]
        if not fault.low <= value <= fault.high:
            raise InputError(f"fault {name}", value, f"outside {fault.low:g} to {fault.high:g}: {fault.meaning}")
    if given.get("lost_burst", 1.0) != int(given.get("lost_burst", 1.0)):
        raise InputError("fault lost_burst", given["lost_burst"], "must be an integer number of packets")
    return {name: float(given.get(name, fault.absent)) for name, fault in FAULTS.items()}


def parse_fault(text: str) -> tuple[str, float]:
    """Name and value of a text such as ``lost=0.05``. Raises InputError for any other text."""
    name, _, number = text.partition("=")
    try:
        return name.strip(), float(number)
    except ValueError:
        raise InputError("fault", repr(text), "not a name with a number", next_step="Write it as lost=0.05.") from None
