# SPDX-License-Identifier: Apache-2.0
"""A protocol from its file, checked as far as the file alone can tell."""

import hashlib
import math
import os
from itertools import count
from pathlib import Path

from ..errors import InputError
from ..preset_files import BOM
from ..preset_files.units_in_keys import to_si
from .checks import check
from .protocol import Protocol, Series

FOLDER = Path(__file__).parent / "protocols"
_LONGEST = 1 << 20  # bytes
_MILLI = "1/1000"
_MOST_SITES = 9999


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

    from .schema import ProtocolFile

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
