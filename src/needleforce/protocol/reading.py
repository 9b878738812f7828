# SPDX-License-Identifier: Apache-2.0
"""Reading of a protocol file: each key contains its unit, unknown keys are refused, and values are checked against
each other and against the range of an axis."""

import hashlib
import math
import os
import re
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import Annotated, Any, Literal

from msgspec import Meta, Struct

from ..errors import InputError
from ..files import decode_toml, read_bytes
from ..preset_files.schema import to_si
from ..wire.axis_lines import AxisRange
from .protocol import Protocol, Series

FOLDER = Path(__file__).parent / "protocols"
_MILLI = "1/1000"
_MAX_SITES = 9999
Text = Annotated[
    str, Meta(min_length=1, max_length=1000, pattern=r"^[^\x00-\x1f\x7f-\x9f]*$")
]  # without control characters, as it is printed
Length = Annotated[float, Meta(gt=0, le=1000)]  # [mm]
Speed = Annotated[float, Meta(ge=1e-3, le=1000)]  # [mm/s]
Time = Annotated[float, Meta(ge=0, le=86400)]  # [s]
Number = Annotated[int, Meta(ge=1, le=9999)]
Sites = Number | Annotated[tuple[Number, ...], Meta(min_length=1, max_length=9999)]
_PLAIN = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")


def protocols() -> tuple[str, ...]:
    """The names of the protocols that are shipped with needleforce."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))


def read_protocol(name_or_path: str | os.PathLike) -> Protocol:
    """Read a protocol.

    Parameters
    ----------
    name_or_path : str or path
        Name of a shipped protocol, or path of a TOML file.

    Returns
    -------
    Protocol

    Raises
    ------
    InputError
        With the path inside the file, for an unknown key, a wrong type, or an impossible value.
    """
    shipped = str(name_or_path) in protocols()
    path = FOLDER / f"{name_or_path}.toml" if shipped else Path(name_or_path)
    if not os.path.lexists(path):
        known = f"Give a path ending in .toml, or one of {', '.join(protocols())}."
        raise InputError("protocol", "not read", "no file of this name", str(path), known)
    text = read_bytes(path, "protocol")
    try:
        return _protocol(text)
    except InputError as error:
        raise error.at(path.name) from None


def _protocol(text: bytes) -> Protocol:
    file = _decoded(text)
    protocol = Protocol(
        title=file.title,
        reference=file.reference,
        needle=f"diameter {file.needle.diameter_mm:g} mm, length {file.needle.length_mm:g} mm, {file.needle.tip}",
        tissue=file.tissue.text,
        rig=file.rig,
        start=to_si(file.axis.start_mm, _MILLI),
        deepest=_milli(file.axis.deepest_mm),
        max_speed=_milli(file.axis.max_speed_mm_s),
        axial=file.sensor.axial,
        filter_length=file.sensor.filter_length,
        bias_time=file.sensor.bias_s,
        force_limit=file.force_limit_N,
        name_prefix=file.name_prefix,
        sha256=hashlib.sha256(text).hexdigest(),
        **_numbered(file),
    )
    check(protocol, needle_length=to_si(file.needle.length_mm, _MILLI))
    return protocol


def _decoded(text: bytes) -> "ProtocolFile":
    import msgspec

    file = decode_toml(text, "protocol", ProtocolFile)
    _check_finite(msgspec.to_builtins(file), "$")
    return file


def _check_finite(value: Any, place: str) -> None:
    if isinstance(value, float) and not math.isfinite(value):
        raise InputError("value", value, "a finite number is needed", place, "Correct the value.")
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list | tuple) else ()
    for key, each in inner:
        _check_finite(each, f"{place}[{key}]" if isinstance(key, int) else f"{place}.{key}")


def _milli(value: float | None) -> float | None:
    return None if value is None else to_si(value, _MILLI)


def _numbered(file: "ProtocolFile") -> dict:
    """Series and spare sites with site numbers: a count of sites gets the next numbers that are in no list."""
    lists = [each.sites for each in file.series] + [file.spare_sites]
    if sum(_count(each.sites) * len(each.depths_mm) for each in file.series) > _MAX_SITES:
        raise InputError("sites", "too many", f"at most {_MAX_SITES} in total", "$.series", "Split the protocol.")
    listed = {site for each in lists if isinstance(each, tuple) for site in each}
    free = (site for site in count(1) if site not in listed)
    series = tuple(_series(section, free) for section in file.series)
    spares = file.spare_sites
    return {
        "series": series,
        "spares": spares if isinstance(spares, tuple) else tuple(next(free) for _ in range(spares)),
    }


def _count(sites: int | tuple[int, ...]) -> int:
    return len(sites) if isinstance(sites, tuple) else sites


def _series(section: "SeriesSection", free: Iterator[int]) -> Series:
    depths = tuple(to_si(depth, _MILLI) for depth in section.depths_mm)
    if isinstance(section.sites, tuple):
        sites = tuple(
            section.sites[k :: len(depths)] for k in range(len(depths))
        )  # every n-th site of the list for each of n depths
    else:
        sites = tuple(tuple(next(free) for _ in range(section.sites)) for _ in depths)
    speed, short = to_si(section.speed_mm_s, _MILLI), to_si(section.second_pass_short_mm, _MILLI)
    return Series(
        speed=speed,
        depths=depths,
        sites=sites,
        hold=section.hold_s,
        passes=section.passes,
        short=short,
        pause=section.pause_s,
    )


class ProtocolNeedle(Struct, forbid_unknown_fields=True):
    """The needle; ``tip`` is a description."""

    diameter_mm: Length
    length_mm: Length
    tip: Text


class ProtocolTissue(Struct, forbid_unknown_fields=True):
    """The tissue, as a description."""

    text: Text


class AxisSection(Struct, forbid_unknown_fields=True):
    """The depth at which insertions begin, negative: above the surface; optionally the range of the axis."""

    start_mm: Annotated[float, Meta(lt=0, ge=-1000)]
    deepest_mm: Length | None = None
    max_speed_mm_s: Speed | None = None


class SensorSection(Struct, forbid_unknown_fields=True, frozen=True):
    """The sensor: its axis against insertion, samples in its moving-average filter, time at rest for the bias."""

    axial: Literal["fz", "-fz"] = "fz"
    filter_length: Annotated[int, Meta(ge=1, le=1_000_000)] = 1
    bias_s: Annotated[float, Meta(gt=0, le=60)] = 0.5


class SeriesSection(Struct, forbid_unknown_fields=True):
    """Insertions at one speed; ``sites`` is their count for each depth, numbered in sequence, or their numbers."""

    speed_mm_s: Speed
    sites: Sites
    depths_mm: Annotated[tuple[Length, ...], Meta(min_length=1, max_length=100)]
    hold_s: Time = 0.0
    passes: Annotated[int, Meta(ge=1, le=99)] = 1
    second_pass_short_mm: Annotated[float, Meta(ge=0, le=1000)] = 0.0
    pause_s: Time = 0.0


class ProtocolFile(Struct, forbid_unknown_fields=True):
    """A protocol file."""

    title: Text
    reference: Text
    needle: ProtocolNeedle
    tissue: ProtocolTissue
    axis: AxisSection
    force_limit_N: Annotated[float, Meta(gt=0, le=1000)]
    series: Annotated[tuple[SeriesSection, ...], Meta(min_length=1, max_length=100)]
    sensor: SensorSection = SensorSection()
    spare_sites: Annotated[int, Meta(ge=0, le=999)] | tuple[Number, ...] = 0
    rig: str = ""
    name_prefix: Annotated[str, Meta(max_length=60)] = ""


def check(protocol: Protocol, needle_length: float) -> None:
    """Raise InputError, with the path inside the file, for values that no rig can execute; lengths in m."""
    for k, series in enumerate(protocol.series):
        place = f"$.series[{k}]"
        for depth in series.depths:
            _check_depth(depth, needle_length, "the needle is {:g} m long", f"{place}.depths_mm")
            if series.short >= depth:
                limit = f"it must be less than the depth, {depth:g} m"
                where, step = f"{place}.second_pass_short_mm", "Give a smaller one."
                raise InputError("second_pass_short", f"{series.short} m", limit, where, step)
        if len(set(series.depths)) != len(series.depths):
            raise InputError("depths", series.depths, "each depth must occur once", f"{place}.depths_mm", "Add sites.")
        if not all(series.sites):
            limit = f"{len(series.depths)} depths need one site each"
            raise InputError("sites", "too few", limit, f"{place}.sites", "Add sites, or leave depths out.")
    _check_sites(protocol)
    prefix = protocol.name_prefix
    if prefix and not _PLAIN.fullmatch(prefix):
        advice = "Use letters, digits, . _ and -, and begin with a letter or digit."
        limit = "file names must not leave the folder"
        raise InputError("name_prefix", repr(prefix), limit, "$.name_prefix", advice)
    max_depth, max_speed = protocol.deepest or math.inf, protocol.max_speed or math.inf
    check_axis(protocol, AxisRange(protocol.start, max_depth, max_speed, 1.0), "$.axis")


def check_axis(protocol: Protocol, limits: AxisRange, place: str) -> None:
    """Raise InputError for moves outside the ``limits`` of an axis; ``place`` is where they come from."""
    if protocol.start < limits.lowest:
        limit = f"the axis begins at {limits.lowest:g} m"
        raise InputError("start", f"{protocol.start:g} m", limit, place, "Give a smaller distance from the surface.")
    for series in protocol.series:
        for depth in series.depths:
            _check_depth(depth, limits.highest, "the axis ends at {:g} m", place)
        if series.speed > limits.max_speed:
            limit = f"the axis moves at up to {limits.max_speed:g} m/s"
            raise InputError("speed", f"{series.speed:g} m/s", limit, place, "Insert more slowly.")


def _check_depth(depth: float, end: float, limit: str, place: str) -> None:
    if depth > end:
        raise InputError("depth", f"{depth:g} m", limit.format(end), place, "Insert less deep.")


def _check_sites(protocol: Protocol) -> None:
    """Each site is used once: another series would find a hole there, and file names would not be unique."""
    used: set[int] = set()
    places = [
        (f"$.series[{k}].sites", site) for k, each in enumerate(protocol.series) for s in each.sites for site in s
    ]
    for place, site in places + [("$.spare_sites", site) for site in protocol.spares]:
        if site in used:
            limit = "used twice: the second insertion would find a hole"
            raise InputError("site", site, limit, place, "Give another number.")
        used.add(site)
