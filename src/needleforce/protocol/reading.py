# SPDX-License-Identifier: Apache-2.0
"""A protocol from its file: keys carry their unit, unknown keys are refused, what cannot be is refused by itself or
by the axis that is there."""

import hashlib
import math
import os
import re
from itertools import count
from pathlib import Path
from typing import Annotated, Literal

from msgspec import Meta, Struct

from ..errors import InputError
from ..preset_files.presets import BOM
from ..preset_files.schema import to_si
from ..wire.axis_lines import AxisRange
from .protocol import Protocol, Series

FOLDER = Path(__file__).parent / "protocols"
_LONGEST = 1 << 20  # bytes
_MILLI = "1/1000"
_MOST_SITES = 9999
Text = Annotated[str, Meta(min_length=1, max_length=1000, pattern=r"^[^\x00-\x1f\x7f-\x9f]*$")]  # it is printed
Length = Annotated[float, Meta(gt=0, le=1000)]  # [mm]
Speed = Annotated[float, Meta(ge=1e-3, le=1000)]  # [mm/s]
Time = Annotated[float, Meta(ge=0, le=86400)]  # [s]
Number = Annotated[int, Meta(ge=1, le=9999)]
Sites = Number | Annotated[tuple[Number, ...], Meta(min_length=1, max_length=9999)]
_PLAIN = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")


def protocols() -> tuple[str, ...]:
    """The names of the protocols that come with needleforce."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))


def read_protocol(name_or_path: str | os.PathLike) -> Protocol:
    """The protocol of a shipped file, by name, or of a file, by path.

    Raises InputError, with the path inside the file, for an unknown key, a wrong kind, or an impossible value.
    """
    shipped = str(name_or_path) in protocols()
    path = FOLDER / f"{name_or_path}.toml" if shipped else Path(name_or_path)
    try:
        with open(path, "rb") as file:
            text = file.read(_LONGEST + 1)
        if len(text) > _LONGEST:
            raise InputError("protocol", f"over {_LONGEST} bytes", "no protocol is so long")
        return _protocol(text)
    except InputError as error:
        raise error.at(path.name) from None
    except OSError as error:
        known = f"Give a path ending in .toml, or one of {', '.join(protocols())}."
        raise InputError("protocol", "not read", error.strerror or "", str(path), known) from None


def _protocol(text: bytes) -> Protocol:
    file = _decoded(text)
    made = Protocol(
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
    check(made, needle_length=to_si(file.needle.length_mm, _MILLI))
    return made


def _decoded(text: bytes):
    import tomllib

    import msgspec

    try:
        file = msgspec.toml.decode(text.removeprefix(BOM), type=ProtocolFile)
    except (msgspec.DecodeError, tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise InputError("protocol", limit=str(error), next_step="Mend the file at this place.") from None
    _check_finite(msgspec.to_builtins(file), "$")
    return file


def _check_finite(value, place: str) -> None:
    if isinstance(value, float) and not math.isfinite(value):
        raise InputError("value", value, "a number is needed", place)
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list | tuple) else ()
    for key, each in inner:
        _check_finite(each, f"{place}[{key}]" if isinstance(key, int) else f"{place}.{key}")


def _milli(value: float | None) -> float | None:
    return None if value is None else to_si(value, _MILLI)


def _numbered(file) -> dict:
    """Series and spare sites with numbers: a number of sites takes the next ones that no list has."""
    lists = [each.sites for each in file.series] + [file.spare_sites]
    if sum(_count(each.sites) * len(each.depths_mm) for each in file.series) > _MOST_SITES:
        raise InputError("sites", "too many", f"at most {_MOST_SITES} in all", "$.series")
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


def _series(section, free) -> Series:
    depths = tuple(to_si(depth, _MILLI) for depth in section.depths_mm)
    if isinstance(section.sites, tuple):
        sites = tuple(section.sites[k :: len(depths)] for k in range(len(depths)))  # dealt out like cards
    else:
        sites = tuple(tuple(next(free) for _ in range(section.sites)) for _ in depths)
    speed, short = to_si(section.speed_mm_s, _MILLI), to_si(section.second_pass_short_mm, _MILLI)
    return Series(speed, depths, sites, section.hold_s, section.passes, short, section.pause_s)


class ProtocolNeedle(Struct, forbid_unknown_fields=True):
    """The needle; ``tip`` in words."""

    diameter_mm: Length
    length_mm: Length
    tip: Text


class ProtocolTissue(Struct, forbid_unknown_fields=True):
    """The tissue, in words."""

    text: Text


class AxisSection(Struct, forbid_unknown_fields=True):
    """Where insertions begin, as a depth: below 0 above the surface; what the axis can do, if it is to be said."""

    start_mm: Annotated[float, Meta(lt=0, ge=-1000)]
    deepest_mm: Length | None = None
    max_speed_mm_s: Speed | None = None


class SensorSection(Struct, forbid_unknown_fields=True, frozen=True):
    """The sensor: the axis that opposes insertion, samples in its average filter, time at rest for the bias."""

    axial: Literal["fz", "-fz"] = "fz"
    filter_length: Annotated[int, Meta(ge=1, le=1_000_000)] = 1
    bias_s: Annotated[float, Meta(gt=0, le=60)] = 0.5


class SeriesSection(Struct, forbid_unknown_fields=True):
    """Insertions at one speed; ``sites`` is how many of each depth, numbered on from those before, or their numbers."""

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
