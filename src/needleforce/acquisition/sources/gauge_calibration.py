# SPDX-License-Identifier: Apache-2.0
"""A gauge calibration from a file: TOML, CSV, or the XML that comes with a sensor."""

import csv
import os
from pathlib import Path

import msgspec
import numpy as np

from ...errors import InputError
from ...units import size
from ...wire.rdt import AXES
from .calibration import FULL_SCALE, GAUGES, Calibration
from .calibration_xml import calibration_of_xml

_LONGEST = 1 << 20  # bytes
_NEXT = "See docs/protocols.md for the three layouts."


class CalibrationFile(msgspec.Struct, forbid_unknown_fields=True):
    """A calibration in TOML: rows of the matrix in ``force_unit`` and ``torque_unit`` for a volt."""

    force_unit: str
    torque_unit: str
    matrix: tuple[tuple[float, ...], ...]
    bias_V: tuple[float, ...] = (0.0,) * GAUGES
    full_scale_V: float = FULL_SCALE
    ratings: tuple[float, ...] = (0.0,) * GAUGES
    serial: str = ""


def read_calibration(path: str | os.PathLike) -> Calibration:
    """The calibration in a ``.toml`` file, in a ``.csv`` table, or in a sensor maker's ``.cal`` or ``.xml`` file.

    Raises InputError, with the place in the file, for what makes no six axes of six gauges.
    """
    path = Path(path)
    kinds = {".toml": _of_toml, ".csv": _of_csv, ".cal": calibration_of_xml, ".xml": calibration_of_xml}
    if path.suffix.lower() not in kinds:
        known = ", ".join(kinds)
        raise InputError("calibration file", repr(path.name), f"known endings are {known}", next_step=_NEXT)
    try:
        if path.stat().st_size > _LONGEST:
            raise InputError("calibration file", f"{path.stat().st_size} bytes", f"at most {_LONGEST}")
        return kinds[path.suffix.lower()](path.read_bytes())
    except InputError as error:
        raise error.at(str(path)) from None
    except (OSError, ValueError) as error:
        said = getattr(error, "strerror", None) or str(error)
        raise InputError("calibration file", "not read", said, str(path), _NEXT) from None


def _unit(text: str, dimension: str) -> float:
    unit = size(text, dimension)
    if unit is None:
        raise InputError(f"unit of {dimension}", repr(text), "not known", next_step="Write N, lbf, Nmm or the like.")
    return unit


def _of_toml(text: bytes) -> Calibration:
    file = msgspec.toml.decode(text, type=CalibrationFile)
    if len({len(row) for row in file.matrix}) > 1:
        raise InputError("calibration matrix", "ragged", "six rows of six numbers are needed", "$.matrix")
    unit = np.array([_unit(file.force_unit, "force")] * 3 + [_unit(file.torque_unit, "torque")] * 3)
    matrix = np.array(file.matrix, dtype=float)
    if matrix.shape != (GAUGES, GAUGES) or len(file.ratings) != GAUGES:
        raise InputError("calibration matrix", f"of shape {matrix.shape}", "six rows of six numbers, six ratings")
    ratings = tuple(float(rating) for rating in unit * np.array(file.ratings))
    bias = np.array(file.bias_V, dtype=float)
    return Calibration(unit[:, None] * matrix, bias, file.full_scale_V, file.serial, ratings)


def _of_csv(text: bytes) -> Calibration:
    """``axis,unit,g0,…,g5``, a row for each axis and, if there is one, the row ``bias`` in V."""
    rows = [[cell.strip() for cell in row] for row in csv.reader(text.decode("utf-8-sig").splitlines()) if any(row)]
    if not rows or [cell.casefold() for cell in rows[0][:2]] != ["axis", "unit"]:
        raise InputError("header", "missing", "axis,unit,g0,g1,g2,g3,g4,g5 is needed", next_step=_NEXT)
    found: dict[str, tuple[str, list[float]]] = {}
    for row in rows[1:]:
        axis, unit, numbers = row[0], "".join(row[1:2]), row[2:]
        if axis.casefold() in found or axis.casefold() not in (*AXES, "bias") or len(numbers) != GAUGES:
            raise InputError("row", repr(axis), f"{', '.join(AXES)} once each, with six numbers", next_step=_NEXT)
        found[axis.casefold()] = unit, [float(number) for number in numbers]
    bias_unit, bias = found.pop("bias", ("V", [0.0] * GAUGES))
    if bias_unit != "V" or len(found) != GAUGES:
        missing = ", ".join(axis for axis in AXES if axis not in found) or f"unit of the bias {bias_unit!r}, not V"
        raise InputError("rows", "incomplete", missing, next_step=_NEXT)
    unit = [_unit(found[axis][0], "force" if axis.startswith("f") else "torque") for axis in AXES]
    return Calibration(np.array(unit)[:, None] * np.array([found[axis][1] for axis in AXES]), np.array(bias))
