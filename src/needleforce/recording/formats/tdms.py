# SPDX-License-Identifier: Apache-2.0
"""TDMS by nptdms: each group is a table; channels of another length, rate or start than the others are tables of their
own."""

import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from ...files import check_count, open_regular
from ..stated import is_rate_name
from ..table import Table
from .arrays import Array, FileArrays, reading

_FORMAT = "TDMS (LabVIEW)"
_UNITS = ("unit_string", "NI_UnitDescription", "unit", "units", "Unit")
_TIMES = ("time", "zeit", "temps", "tiempo", "tempo")  # how the names of channels with times begin
_MAX_CHANNELS = 4096
_SAME_START = 0.99  # of a step: starts that differ by less are of the channels of one multiplexer
_MAX_TEXT_CHARS = 200  # of a property that is kept as a comment


def tables(path: Path) -> list[Table]:
    """The tables of a TDMS file: the channels of each group, scaled, with those of one length, rate and start together.

    Channels with the property ``wf_increment`` are sampled evenly: unless one of them is a time, the table begins with
    a column ``time`` in seconds. Raises InputError for a damaged file.
    """
    found = FileArrays(path=path, format=_FORMAT, header=lambda name, _: name)
    with _opened(path) as file:
        root = _comments(file.properties)
        groups = file.groups()
        check_count("channels", sum(len(group.channels()) for group in groups), _MAX_CHANNELS, path)
        for group in groups:
            _add_group(found, group, root)
    return found.finish()


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """The open file; the library sees a stream, so that it opens no index next to it."""
    from nptdms import TdmsFile
    from nptdms.log import log_manager

    level = log_manager.log_level
    log_manager.set_level(logging.CRITICAL)  # what it warns of ends in an error or in a shorter table
    try:
        with reading(path, _FORMAT), open_regular(path) as stream, TdmsFile.open(stream) as file:
            yield file
    finally:
        log_manager.set_level(level)


def _add_group(found: FileArrays, group: Any, root: list[tuple[str, str]]) -> None:
    """Add the channels of a group: one table for each length, rate and start."""
    comments = [*_comments(group.properties), *root]
    tables: list[list[Any]] = []
    for channel in group.channels():
        if channel.dtype.kind not in "iufMSO" or len(channel) < 2:
            found.leave_out(f"{group.name}/{channel.name} ({len(channel)} values)")
            continue
        _check_length(channel, found.path)
        together = next((each for each in tables if all(_are_joined(channel, other) for other in each)), None)
        if together is None:
            tables.append(together := [])
        together.append(channel)
    names = [_named(channels[0]) if len(tables) > 1 else "" for channels in tables]
    for channels, name in zip(tables, names):
        length, (step, start) = len(channels[0]), _step(channels[0])
        first = next((each for each in channels if _start(each) is not None), channels[0])
        begins = f" from {_start(first)}{f' + {start:g} s' if start else ''}" if _start(first) else ""
        arrays = [_array(found.path, each) for each in channels]
        sampling = _sampling(channels[0].properties)
        if step and not any(_is_time(each) for each in channels):
            arrays.insert(0, _even_steps(channels[0].properties, length, step, start))
            sampling += [("wf_start_time", _start(first))] if _start(first) else []
        found.add(f"{group.name}{name}{begins * (names.count(name) > 1)}", arrays, [*sampling, *comments])


def _named(channel: Any) -> str:
    """The end of the name of the table of a channel, in a group with several."""
    length, step = len(channel), _step(channel)[0]
    return f" ({length} rows{f' every {step:g} s' if step else ''})"


def _are_joined(one: Any, other: Any) -> bool:
    """Whether the values of two channels were taken together: as many, as often, and from the same time on."""
    (step, offset), (other_step, other_offset) = _step(one), _step(other)
    if (len(one), step) != (len(other), other_step):
        return False
    starts = [_start(each) for each in (one, other)]
    if None in starts or not step:
        return offset == other_offset
    apart = (np.datetime64(starts[0]) - np.datetime64(starts[1])) / np.timedelta64(1, "s") + offset - other_offset
    return bool(abs(apart) <= _SAME_START * step)


def _array(path: Path, channel: Any) -> Array:
    group, name = channel.group_name, channel.name

    def read(_: int) -> np.ndarray:
        with _opened(path) as file:
            values = file[group][name].read_data(scaled=True)
        return np.asarray(values)

    numeric = channel.dtype.kind in "iufM"
    unit = next((str(channel.properties[key]) for key in _UNITS if channel.properties.get(key)), "")
    seconds = "s" if channel.dtype.kind == "M" else unit
    return Array(name=name, rows=len(channel), read=read, units=[seconds], numeric=numeric)


def _step(channel: Any) -> tuple[float, float]:
    """The time between the values of a channel and that of the first [s], 0 for a channel without them."""
    step, start = channel.properties.get("wf_increment", 0.0), channel.properties.get("wf_start_offset", 0.0)
    numbers = [each for each in (step, start) if isinstance(each, int | float | np.number) and np.isfinite(each)]
    return (float(step), float(start)) if len(numbers) == 2 and step > 0.0 else (0.0, 0.0)


def _even_steps(properties: dict[str, Any], length: int, step: float, start: float) -> Array:
    """The column to which the increment belongs: the time, unless the properties name another quantity."""
    unit = str(properties.get("wf_xunit_string") or "s")
    name = "time" if unit == "s" else str(properties.get("wf_xname") or "x")
    return Array(name=name, rows=length, read=lambda _: start + step * np.arange(length), units=[unit])


def _sampling(properties: dict[str, Any]) -> list[tuple[str, str]]:
    """The properties of a channel that state the rate of its values."""
    unit = str(properties.get("wf_xunit_string") or "s")
    return [(name, text) for name, text in _comments(properties) if is_rate_name(name) and unit == "s"]


def _start(channel: Any) -> str | None:
    """When the first value of a waveform was taken, which two tables need for a common zero; None without it."""
    start = channel.properties.get("wf_start_time")
    if not isinstance(start, np.datetime64) or np.isnat(start):
        return None
    return str(start.astype("datetime64[us]"))


def _is_time(channel: Any) -> bool:
    return channel.dtype.kind == "M" or channel.name.strip().casefold().startswith(_TIMES)


def _check_length(channel: Any, path: Path) -> None:
    """Refuse a channel that is longer than the file, which has no compression, but for daqmx of at least one byte."""
    size = os.stat(path).st_size
    if len(channel) > size:
        limit, step = f"the file has {size} bytes", "Check that the file is complete, or export it again."
        raise InputError(f"length of the channel {channel.name!r}", len(channel), limit, str(path), step)


def _comments(properties: dict[str, Any]) -> list[tuple[str, str]]:
    """The properties of a group or of the file, but for empty and long ones."""
    texts = [(name, str(value)) for name, value in properties.items()]
    return [(name, text) for name, text in texts if 0 < len(text) <= _MAX_TEXT_CHARS]
