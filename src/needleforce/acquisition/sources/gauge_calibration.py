# SPDX-License-Identifier: Apache-2.0
"""The wrench from the six gauge voltages of a force/torque sensor, with a calibration from TOML, CSV or the sensor
maker's XML file."""

import csv
import math
import os
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from ...files import decode_toml, read_bytes, xml_root
from ...recording.formats.rows import number_of
from ...units import size
from ...wire.net_ft import AXES, SATURATED

_NEXT_STEP = "See docs/reference/protocols.md for the three layouts."
GAUGES = 6
FULL_SCALE = 10.0  # [V] of either sign: the usual range of converters for these sensors
_MAX_CONDITION_NUMBER = 1e8  # of the matrix with scaled rows; that of the sensors is below 100
_WITHOUT_USER_AXIS = "the file has no UserAxis: the matrix is Axis / scale, its torques moved by BasicTransform"
_TRANSFORM = ("Dx", "Dy", "Dz", "Rx", "Ry", "Rz")


class CalibrationFile(msgspec.Struct, forbid_unknown_fields=True):
    """A calibration in TOML: rows of the matrix in ``force_unit`` and ``torque_unit`` per volt."""

    force_unit: str
    torque_unit: str
    matrix: tuple[tuple[float, ...], ...]
    bias_V: tuple[float, ...] = (0.0,) * GAUGES
    full_scale_V: float = FULL_SCALE
    ratings: tuple[float, ...] = (0.0,) * GAUGES
    serial: str = ""


@dataclass(frozen=True, eq=False)
class Calibration:
    """Calibration of six gauges.

    Parameters
    ----------
    matrix : ndarray, shape (6, 6)
        From gauge voltages to fx fy fz tx ty tz [N/V, N m/V].
    bias : ndarray, shape (6,)
        Voltages of the unloaded sensor [V].
    full_scale : float
        Largest voltage of the converter [V], above 0 and at most 1000.
    serial : str
        Serial number of the sensor.
    ratings : tuple of float
        Rated range of each axis [N, N m], 0 if unknown.
    notes : tuple of str
        What was assumed about the file.

    Raises
    ------
    InputError
        If the matrix is singular, not finite or of another shape.
    """

    matrix: np.ndarray
    bias: np.ndarray
    full_scale: float = FULL_SCALE
    serial: str = ""
    ratings: tuple[float, ...] = (0.0,) * GAUGES
    notes: tuple[str, ...] = ()

    def __post_init__(self):
        _check(self.matrix, (GAUGES, GAUGES), "calibration matrix")
        _check(self.bias, (GAUGES,), "bias voltages")
        _check(np.asarray(self.ratings), (GAUGES,), "ratings")
        if not 0.0 < self.full_scale <= 1e3:
            raise _fault("full scale of the converter", f"{self.full_scale} V", "outside 0 to 1000 V")
        rows = np.abs(self.matrix).max(axis=1, keepdims=True)
        if not rows.all() or not np.linalg.cond(self.matrix / rows) < _MAX_CONDITION_NUMBER:
            advice = "Compare it with the sensor's calibration sheet: two rows or columns may be equal."
            raise InputError("calibration matrix", "singular", "six axes need six gauges", next_step=advice)

    def wrench(self, volts: ArrayLike) -> np.ndarray:
        """Forces and torques (n, 6) [N, N m] from voltages (n, 6) [V]."""
        return (np.asarray(volts, dtype=float) - self.bias) @ self.matrix.T

    def status(self, volts: ArrayLike) -> np.ndarray:
        """Status (n,) of voltages (n, 6) [V]: saturated if a gauge is at the end of the converter's range."""
        return np.where(np.abs(volts).max(axis=1) >= self.full_scale, SATURATED, 0)


def read_calibration(path: str | os.PathLike) -> Calibration:
    """Read a calibration from a ``.toml`` file, a ``.csv`` table, or a sensor maker's ``.cal`` or ``.xml`` file.

    Parameters
    ----------
    path : str or path
        The file.

    Returns
    -------
    Calibration

    Raises
    ------
    InputError
        With the place in the file, if it does not contain six axes of six gauges.
    """
    path = Path(path)
    kinds = {".toml": _of_toml, ".csv": _of_csv, ".cal": calibration_of_xml, ".xml": calibration_of_xml}
    if path.suffix.lower() not in kinds:
        known = ", ".join(kinds)
        raise _fault("calibration file", repr(path.name), f"known endings are {known}")
    text = read_bytes(path, "calibration file")
    try:
        return kinds[path.suffix.lower()](text)
    except InputError as error:
        raise error.at(str(path)) from None
    except (ValueError, csv.Error) as error:
        raise InputError("calibration file", "not read", str(error), str(path), _NEXT_STEP) from None


def _fault(quantity: str, value: object, limit: str, place: str = "") -> InputError:
    """The error for a file that is in none of the layouts."""
    return InputError(quantity, value, limit, place, _NEXT_STEP)


def _unit_factor(text: str, dimension: str) -> float:
    unit = size(text, dimension)
    if unit is None:
        raise InputError(f"unit of {dimension}", repr(text), "unknown", next_step="Write a unit such as N, lbf or Nmm.")
    return unit


def _of_toml(text: bytes) -> Calibration:
    file = decode_toml(text, "calibration file", CalibrationFile, _NEXT_STEP)
    if len({len(row) for row in file.matrix}) > 1:
        raise _fault("calibration matrix", "ragged", "six rows of six numbers are needed", "$.matrix")
    unit = np.array([_unit_factor(file.force_unit, "force")] * 3 + [_unit_factor(file.torque_unit, "torque")] * 3)
    matrix = np.array(file.matrix, dtype=float)
    if matrix.shape != (GAUGES, GAUGES) or len(file.ratings) != GAUGES:
        limit = "six rows of six numbers, six ratings"
        raise InputError("calibration matrix", f"of shape {matrix.shape}", limit, next_step=_NEXT_STEP)
    ratings = tuple(float(rating) for rating in unit * np.array(file.ratings))
    bias = np.array(file.bias_V, dtype=float)
    return Calibration(unit[:, None] * matrix, bias, file.full_scale_V, file.serial, ratings)


def _of_csv(text: bytes) -> Calibration:
    """A table ``axis,unit,g0,…,g5`` with a row for each axis and, optionally, a row ``bias`` in V."""
    rows = [[cell.strip() for cell in row] for row in csv.reader(text.decode("utf-8-sig").splitlines()) if any(row)]
    if not rows or [cell.casefold() for cell in rows[0][:2]] != ["axis", "unit"]:
        raise _fault("header", "missing", "axis,unit,g0,g1,g2,g3,g4,g5 is needed")
    found: dict[str, tuple[str, list[float]]] = {}
    for row in rows[1:]:
        axis, unit, numbers = row[0], "".join(row[1:2]), row[2:]
        if axis.casefold() in found or axis.casefold() not in (*AXES, "bias") or len(numbers) != GAUGES:
            raise _fault("row", repr(axis), f"{', '.join(AXES)} once each, with six numbers")
        found[axis.casefold()] = unit, [_number(number, axis) for number in numbers]
    bias_unit, bias = found.pop("bias", ("V", [0.0] * GAUGES))
    if bias_unit != "V" or len(found) != GAUGES:
        missing = (
            ", ".join(axis for axis in AXES if axis not in found)
            or f"V as the unit of the bias, which is {bias_unit!r}"
        )
        raise _fault("rows", "incomplete", f"missing: {missing}")
    unit = [_unit_factor(found[axis][0], "force" if axis.startswith("f") else "torque") for axis in AXES]
    return Calibration(np.array(unit)[:, None] * np.array([found[axis][1] for axis in AXES]), np.array(bias))


def _check(values: np.ndarray, shape: tuple[int, ...], quantity: str) -> None:
    if values.shape != shape:
        raise _fault(quantity, f"of shape {values.shape}", f"{shape} is needed")
    if not np.isfinite(values).all():
        raise _fault(quantity, "not finite", "numbers are needed")


def calibration_of_xml(text: bytes) -> Calibration:
    """The calibration in a sensor maker's XML file. Raises InputError for another file or a rotated origin."""
    root = _root(text)
    about = root.find("Calibration")
    if root.tag != "FTSensor" or about is None:
        raise _fault("calibration file", f"<{root.tag}>", "<FTSensor> with a <Calibration> is needed")
    unit = np.array([_unit(about, "ForceUnits", "force")] * 3 + [_unit(about, "TorqueUnits", "torque")] * 3)
    has_user_axis = about.find("UserAxis") is not None
    matrix, ratings = _rows(about, "UserAxis", unit) if has_user_axis else _of_axes(about, unit)
    return Calibration(
        matrix=matrix,
        bias=np.zeros(GAUGES),
        full_scale=_full_scale(about),
        serial=root.get("Serial", "")[:80],
        ratings=ratings,
        notes=() if has_user_axis else (_WITHOUT_USER_AXIS,),
    )


def _root(text: bytes) -> Element:
    try:
        return xml_root(text)
    except ValueError as error:
        raise _fault("calibration file", "not readable", f"XML is expected: {error}") from None


def _rows(about: Element, tag: str, unit: np.ndarray) -> tuple[np.ndarray, tuple[float, ...]]:
    """The matrix [SI/V] and the rated ranges [SI], by the names of the rows."""
    rows = {row.get("Name", "").casefold(): row for row in about.findall(tag)}
    if set(rows) != set(AXES) or len(about.findall(tag)) != GAUGES:
        raise _fault(f"<{tag}>", ", ".join(rows) or "missing", "one each of Fx Fy Fz Tx Ty Tz is needed")
    numbers = [[_number(text, tag) for text in rows[axis].get("values", "").split()] for axis in AXES]
    if {len(row) for row in numbers} != {GAUGES}:
        raise _fault(f"values of <{tag}>", "not six", "six gauges are needed")
    ratings = [_number(rows[axis].get("max", "0"), tag) for axis in AXES]
    return unit[:, None] * np.array(numbers), tuple(float(each) for each in unit * np.array(ratings))


def _of_axes(about: Element, unit: np.ndarray) -> tuple[np.ndarray, tuple[float, ...]]:
    matrix, ratings = _rows(about, "Axis", unit)
    scales = {row.get("Name", "").casefold(): _number(row.get("scale", ""), "Axis") for row in about.findall("Axis")}
    if not all(scales.values()):
        raise _fault("scale of <Axis>", 0, "a number other than 0 is needed")
    matrix /= np.array([scales[axis] for axis in AXES])[:, None]
    transform, length = about.find("BasicTransform"), _unit(about, "DistUnits", "length")
    shift = [0.0 if transform is None else _number(transform.get(key, "0"), "BasicTransform") for key in _TRANSFORM]
    if any(shift[3:]):
        advice = "Ask the maker for a file with UserAxis, or write the matrix as TOML."
        raise InputError("<BasicTransform>", "a rotation", "only a translation can be undone", next_step=advice)
    matrix[3:] -= np.cross(length * np.array(shift[:3]), matrix[:3], axis=0)
    return matrix, ratings


def _full_scale(about: Element) -> float:
    """The full scale [V]: half of ``OutputRange`` if the output is bipolar."""
    span = _number(about.get("OutputRange", "20"), "Calibration")
    return span / 2.0 if about.get("OutputBipolar", "True").casefold() == "true" else span


def _unit(about: Element, key: str, dimension: str) -> float:
    text = about.get(key, "")
    unit = size(text, dimension)
    if unit is None:
        raise _fault(key, repr(text[:40]), f"not a known unit of {dimension}")
    return unit


def _number(text: str, tag: str) -> float:
    if math.isnan(number := number_of(text.strip(), ".")):
        raise _fault(f"<{tag}>", repr(text[:40]), "a number is needed")
    return number
