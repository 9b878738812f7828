# SPDX-License-Identifier: Apache-2.0
"""Sensor and axis by their names, as a person gives them, and the force limit of what the axis moves."""

import math
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from ...errors import InputError

if TYPE_CHECKING:
    from ...wire.net_ft import SensorConfiguration
    from .standard_input import StandardInput

DEFAULT_LIMIT_SHARE = 0.8  # of the sensor's rated range: the default force limit
MAX_DEFAULT_LIMIT_N = 100.0  # that an axis gets without being asked for: published needle forces are smaller
_MAX_COUNT = 2**31  # of a reading


def open_sources(
    sensor: str | None, page: str, axis: str | None, calibration: Path | None
) -> tuple[Callable[[], tuple], "SensorConfiguration | None"]:
    """A function that opens force source and axis for a run, and the sensor's configuration.

    ``sensor`` None means standard input, without a configuration. Raises InputError for an invalid address, for an
    incomplete configuration, and, when a run is opened, for one that has changed.
    """
    from ...wire import axis_lines, net_ft
    from .axis import AxisClient
    from .net_ft_sensor import SensorClient, read_configuration

    axis_address = address(axis, axis_lines.PORT) if axis else None
    if sensor is None:
        lines = standard_input(calibration)  # one for all runs, because the header arrives once
        return lambda: (lines, AxisClient(*axis_address) if axis_address else None), None
    host, port = address(sensor, net_ft.PORT)
    configuration = read_configuration(host, page)
    watched = page or f"http://{host}/{net_ft.PAGE}"

    def opened() -> tuple:
        if read_configuration(host, page) != configuration:
            limit, advice = "the sensor was exchanged or set up anew", "Start again."
            raise InputError("sensor's configuration", "changed", limit, next_step=advice)
        return SensorClient(host, port, configuration, watched), AxisClient(*axis_address) if axis_address else None

    return opened, configuration


def standard_input(calibration: Path | None, **chosen: Mapping[str, str]) -> "StandardInput":
    """Readings as lines on standard input, with columns and units where they are chosen (``given``, ``units``). Raises
    InputError if it is closed."""
    from .gauge_calibration import read_calibration
    from .standard_input import StandardInput

    if sys.stdin is None:
        raise InputError("standard input", "closed", next_step="Pipe the output of a program into this command.")
    return StandardInput(sys.stdin.buffer, read_calibration(calibration) if calibration else None, **chosen)


def address(text: str, port: int) -> tuple[str, int]:
    """HOST and PORT of HOST[:PORT]. Raises InputError for an invalid port."""
    host, colon, number = text.rpartition(":")
    if not colon:
        return text, port
    if not number.isdecimal() or not 0 < int(number) < 65536 or not host:
        limit = "HOST or HOST:PORT is needed, with a port from 1 to 65535"
        raise InputError("address", repr(text), limit, next_step="Correct the address.")
    return host, int(number)


def force_limit(
    given: float | None, configuration: "SensorConfiguration | None", axial: str, axis: str | None
) -> tuple[float, str]:
    """The force limit [N] and where it comes from: ``given``, or a share of the rated range on the sensor's page.

    Raises InputError for an axis without a limit, and for a limit that cannot protect what the axis moves.
    """
    rating = _rating(configuration, axial)
    if given is not None:
        if axis and not 0.0 < given <= (rating or 1e4):
            limit = f"the sensor measures up to {rating:g} N" if rating else "no needle needs more than 1e4 N"
            raise InputError("--force-limit-N", given, limit, next_step="Give a smaller limit.")
        return given, "given"
    share, advice = DEFAULT_LIMIT_SHARE * rating, "Give --force-limit-N."
    if axis and not rating:
        limit = "an axis needs a force limit, and the sensor's configuration has no rated range"
        raise InputError("--force-limit-N", "not given", limit, next_step=advice)
    if axis and share > MAX_DEFAULT_LIMIT_N:
        limit = f"more than {MAX_DEFAULT_LIMIT_N:g} N, which no needle needs"
        raise InputError("force limit from the sensor's rated range", f"{share:g} N", limit, next_step=advice)
    return (share, f"{DEFAULT_LIMIT_SHARE:g} of the rated range on the sensor's page") if rating else (math.inf, "none")


def _rating(configuration: "SensorConfiguration | None", axial: str) -> float:
    """The rated range [N] of the axial force, 0 if unknown. Raises InputError for one that counts cannot reach."""
    from ...wire.net_ft import AXES

    column = axial.removeprefix("-")
    if configuration is None or column not in AXES[:3]:
        return 0.0
    rating, largest = configuration.ratings[AXES.index(column)], _MAX_COUNT / configuration.counts_per_force
    if rating > largest:
        limit, advice = f"its counts end at {largest:.3g} N", "Check <cfgmr> and <cfgcpf> on the sensor's page."
        raise InputError("rated range of the sensor", f"{rating:g} N", limit, next_step=advice)
    return rating
