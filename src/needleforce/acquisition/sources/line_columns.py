# SPDX-License-Identifier: Apache-2.0
"""Which column of the lines of a program holds what: a header as ``read`` knows them, or six gauge voltages."""

import math
import re
from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ...recording.columns import choose, dimension, split
from ...units import parse
from ...wire.rdt import AXES
from .calibration import GAUGES, Calibration

_QUANTITY = {"fz": "force"}  # the axial force has the name of a recording
_WANTED = ("time", "depth", "velocity", "force", "fx", "fy", "tx", "ty", "tz")
_GAUGE = re.compile(r"(?:v|g|(?:strain )?gau?ge)[ _]?(\d)(?:[ _]*[\[(]?v[\])]?)?", re.IGNORECASE)
_OTHERS = ("time", "depth", "velocity", "sequence")
_ENDS = {"time": (0.0, 4e9), "sequence": (0.0, 2.0**32 - 1.0), "depth": (-1e3, 1e3), "velocity": (-1e3, 1e3)}  # SI
_LARGEST = 1e9  # of a force, torque or voltage in any unit
_SEQUENCE = ("sequence", "seq", "rdt_sequence")
_EXAMPLE = "Write a first line such as time_s,fx_N,fy_N,fz_N,tx_Nm,ty_Nm,tz_Nm."


@dataclass(frozen=True, eq=False)
class LineColumns:
    """Where the values stand in a line of ``count`` cells parted by ``delimiter``, None for blanks.

    ``used`` are the indices of what is read: first the ``forces`` cells that make the wrench, by ``matrix`` (6, forces)
    [SI] or by a calibration, then ``others`` (of time, depth, velocity, sequence), each with its SI units in one.
    """

    delimiter: bytes | None
    count: int
    used: list[int]
    forces: int
    matrix: np.ndarray | None
    others: dict[str, float]

    def numbers(self, line: bytes) -> list[float] | None:
        """The used cells of a line; None for a line of another length, or that holds what is no finite number, or what
        a recording cannot hold, as a time before 0 or beyond 4e9 s.
        """
        cells = line.split(self.delimiter)
        if len(cells) != self.count or b"_" in line:
            return None
        try:
            found = [float(cells[k]) for k in self.used]
        except ValueError:
            return None
        return found if math.isfinite(sum(map(abs, found))) and self._possible(found) else None

    def _possible(self, found: list[float]) -> bool:
        """Whether a recording can hold the cells."""
        if max(map(abs, found[: self.forces])) > _LARGEST:
            return False
        others = zip(self.others.items(), found[self.forces :])
        return all(_ENDS[name][0] <= scale * value <= _ENDS[name][1] for (name, scale), value in others)


def columns_of(header: bytes, calibration: Calibration | None, place: str) -> LineColumns:
    """The columns that a header names. Raises InputError for one without a force or voltages, or without units."""
    text = header.decode("utf-8-sig", "replace").strip()
    delimiter = next((mark for mark in "\t;," if mark in text), None)
    headers = [cell.strip().strip('"') for cell in (text.split(delimiter) if text else [])]
    gauges = _gauges(headers, place)
    rest = ["" if index in gauges else cell for index, cell in enumerate(headers)]
    chosen = choose(rest, _WANTED, {}, place)
    scale = {quantity: _scale(column, place) for quantity, column in chosen.items()}
    index = {quantity: column.index for quantity, column in chosen.items()}
    index |= dict([("sequence", k) for k, cell in enumerate(headers) if cell.casefold() in _SEQUENCE][:1])
    force, matrix = _force(gauges, index, scale, calibration, headers, place)
    if "velocity" in index and "depth" not in index:
        raise InputError(
            "column of the depth", "missing", "a velocity alone is no place", place, "Write depth_mm, too."
        )
    others = {quantity: scale.get(quantity, 1.0) for quantity in _OTHERS if quantity in index}
    used = [*force, *(index[quantity] for quantity in others)]
    return LineColumns(delimiter and delimiter.encode(), len(headers), used, len(force), matrix, others)


def _gauges(headers: list[str], place: str) -> list[int]:
    """Where the six voltages stand, in order; nothing where there are none."""
    found = {int(match[1]): k for k, cell in enumerate(headers) if (match := _GAUGE.fullmatch(cell))}
    if not found:
        return []
    first = min(found)
    if sorted(found) != list(range(first, first + GAUGES)) or first > 1:
        names = ", ".join(headers[k] for k in found.values())
        raise InputError(
            "gauge voltages", names, f"{GAUGES} are needed, from 0 or 1", place, "Write v0,v1,v2,v3,v4,v5."
        )
    return [found[number] for number in sorted(found)]


def _scale(column, place: str) -> float:
    if column.unit is None:
        advice = f"Write it into the header, as {split(column.header)[0]}_{_USUAL[dimension(column.quantity)]}."
        raise InputError(f"unit of column {column.header!r}", "missing", "a stream is not guessed at", place, advice)
    return float(parse(column.unit, dimension(column.quantity), column.quantity, place).to_si(1.0))


_USUAL = {"time": "s", "length": "mm", "velocity": "mm_s", "force": "N", "torque": "Nm"}


def _force(gauges, index, scale, calibration, headers, place) -> tuple[list[int], np.ndarray | None]:
    """The indices of what makes the wrench, and the matrix where no calibration does."""
    if bool(gauges) != bool(calibration):
        why = "voltages need a calibration" if gauges else "a calibration needs six voltages, v0 to v5"
        raise InputError("calibration", "none" if gauges else "given", why, place, "Use --calibration FILE with them.")
    if gauges:
        return gauges, None
    axes = [(k, _QUANTITY.get(axis, axis)) for k, axis in enumerate(AXES) if _QUANTITY.get(axis, axis) in index]
    if "force" not in index:
        named = ", ".join(map(repr, headers))
        raise InputError("column of the axial force", "missing", f"the header is {named}", place, _EXAMPLE)
    matrix = np.zeros((len(AXES), len(axes)))
    for n, (k, quantity) in enumerate(axes):
        matrix[k, n] = scale[quantity]
    return [index[quantity] for _, quantity in axes], matrix
