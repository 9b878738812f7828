# SPDX-License-Identifier: Apache-2.0
"""What a protocol asks for that cannot be: by itself, and of the axis that is there."""

import re

from ..errors import InputError
from ..wire.axis_lines import AxisRange
from .protocol import Protocol

_PLAIN = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")


def check(protocol: Protocol, needle_length: float) -> None:
    """Raise InputError, with the path inside the file, for what no rig can do; lengths in m."""
    for k, series in enumerate(protocol.series):
        place = f"$.series[{k}]"
        for depth in series.depths:
            _check_depth(depth, needle_length, "the needle is {:g} m long", f"{place}.depths_mm")
            if series.short >= depth:
                limit = f"the depth is {depth:g} m"
                raise InputError("second_pass_short", series.short, limit, f"{place}.second_pass_short_mm")
        if len(set(series.depths)) != len(series.depths):
            raise InputError("depths", series.depths, "each must be there once", f"{place}.depths_mm", "Add sites.")
        if not all(series.sites):
            raise InputError("sites", "too few", f"{len(series.depths)} depths need a site each", f"{place}.sites")
    _check_sites(protocol)
    prefix = protocol.name_prefix
    if prefix and not _PLAIN.fullmatch(prefix):
        advice = "Use letters, digits, . _ and -, and begin with a letter or digit."
        raise InputError("name_prefix", repr(prefix), "names of files stay in the folder", "$.name_prefix", advice)
    check_axis(protocol, AxisRange(protocol.start, *_said(protocol), 1.0), "$.axis")


def check_axis(protocol: Protocol, limits: AxisRange, place: str) -> None:
    """Raise InputError for what is beyond an axis with these ``limits``; ``place`` says whose they are."""
    if protocol.start < limits.lowest:
        raise InputError("start", protocol.start, f"the axis begins at {limits.lowest:g} m", place)
    for series in protocol.series:
        for depth in series.depths:
            _check_depth(depth, limits.highest, "the axis ends at {:g} m", place)
        if series.speed > limits.max_speed:
            raise InputError("speed", series.speed, f"the axis goes at up to {limits.max_speed:g} m/s", place)


def _said(protocol: Protocol) -> tuple[float, float]:
    """The deepest place [m] and the speed [m/s] that the file itself allows the axis."""
    beyond = float("inf")
    return protocol.deepest or beyond, protocol.max_speed or beyond


def _check_depth(depth: float, end: float, limit: str, place: str) -> None:
    if depth > end:
        raise InputError("depth", depth, limit.format(end), place, "Insert less deep.")


def _check_sites(protocol: Protocol) -> None:
    """A site is pierced by one series only: a second one would find a hole. It also gives every file its own name."""
    seen: set[int] = set()
    places = [
        (f"$.series[{k}].sites", site) for k, each in enumerate(protocol.series) for s in each.sites for site in s
    ]
    for place, site in places + [("$.spare_sites", site) for site in protocol.spares]:
        if site in seen:
            raise InputError("site", site, "stands there twice: it would be pierced already", place, "Number it anew.")
        seen.add(site)
