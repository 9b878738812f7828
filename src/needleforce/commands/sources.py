# SPDX-License-Identifier: Apache-2.0
"""Where force and motion come from, by the options of ``needleforce record``."""

import math
import sys
from pathlib import Path

from ..errors import InputError

SHARE = 0.8  # of the rating of a sensor: the force limit where none is given


def sources(sensor: str | None, page: str, axis: str | None, calibration: Path | None, axial: str):
    """A function that opens force source and axis for a run, and the rating [N] of the axial force, 0 where unknown.

    ``sensor`` None is standard input. Raises InputError for an address that is none, and for a page without counts.
    """
    from ..acquisition.sources.axis import AxisClient
    from ..acquisition.sources.net_ft_sensor import SensorClient, read_configuration
    from ..wire import axis_lines, rdt

    there = address(axis, axis_lines.PORT) if axis else None
    if sensor is None:
        lines = _standard_input(calibration)  # one for all runs: its header comes once
        return lambda: (lines, AxisClient(*there) if there else None), 0.0
    host, port = address(sensor, rdt.PORT)
    configuration = read_configuration(host, page)
    column = rdt.AXES.index(axial.removeprefix("-")) if axial.removeprefix("-") in rdt.AXES else 0
    ways = host, port, configuration
    return lambda: (SensorClient(*ways), AxisClient(*there) if there else None), configuration.ratings[column]


def _standard_input(calibration: Path | None):
    from ..acquisition.sources.gauge_calibration import read_calibration
    from ..acquisition.sources.standard_input import StandardInput

    if sys.stdin is None:
        raise InputError("standard input", "closed", "", "", "Pipe a program into it.")
    return StandardInput(sys.stdin.buffer, read_calibration(calibration) if calibration else None)


def address(text: str, port: int) -> tuple[str, int]:
    """HOST and PORT of HOST[:PORT]. Raises InputError for a port that is none."""
    host, colon, number = text.rpartition(":")
    if not colon:
        return text, port
    if not number.isdecimal() or not 0 < int(number) < 65536 or not host:
        raise InputError("address", repr(text), "HOST or HOST:PORT is needed, the port from 1 to 65535")
    return host, int(number)


def force_limit(given: float | None, rating: float, axis: str | None) -> float:
    """The force limit [N]: ``given``, or a share of the sensor's rating. InputError where an axis would have none."""
    if given is not None:
        return given
    if rating:
        return SHARE * rating
    if axis:
        raise InputError("--force-limit-N", "not given", "an axis needs one, and the sensor's page has no rating")
    return math.inf
