# SPDX-License-Identifier: Apache-2.0
"""Six gauge voltages of a force/torque sensor as a wrench, with a calibration from TOML, CSV, or the XML file that
comes with a sensor."""

import csv
import os
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import msgspec
import numpy as np

from ...errors import InputError
from ...units import size
from ...wire.rdt import AXES, SATURATED

_LONGEST = 1 << 20  # bytes
_NEXT = "See docs/protocols.md for the three layouts."
GAUGES = 6
FULL_SCALE = 10.0  # [V] on either side, what converters for these sensors span
_WORST_CONDITION = 1e8  # of the matrix, its rows to scale; the sensors' own are below 100
_OLD = "the file has no UserAxis: the matrix is Axis / scale, its torques moved by BasicTransform"
_TRANSFORM = ("Dx", "Dy", "Dz", "Rx", "Ry", "Rz")


class CalibrationFile(msgspec.Struct, forbid_unknown_fields=True):
    """A calibration in TOML: rows of the matrix in ``force_unit`` and ``torque_unit`` for a volt."""

    force_unit: str
    torque_unit: str
    matrix: tuple[tuple[float, ...], ...]
    bias_V: tuple[float, ...] = (0.0,) * GAUGES
    full_scale_V: float = FULL_SCALE
    ratings: tuple[float, ...] = (0.0,) * GAUGES
    serial: str = ""


@dataclass(frozen=True, eq=False)
class Calibration:
    """``matrix`` (6, 6) [N/V, N m/V] from gauges to fx fy fz tx ty tz, ``bias`` (6,) [V] of the unloaded sensor,
    ``full_scale`` [V] of the converter, serial number, ``ratings``: the ends of the six ranges [N, N m], 0 where
    unknown, and ``said``, what had to be assumed of the file.

    Raises InputError for a matrix that is singular, not finite or of another shape.
    """

    matrix: np.ndarray
    bias: np.ndarray
    full_scale: float = FULL_SCALE
    serial: str = ""
    ratings: tuple[float, ...] = (0.0,) * GAUGES
    said: tuple[str, ...] = ()

    def __post_init__(self):
        _check(self.matrix, (GAUGES, GAUGES), "calibration matrix")
        _check(self.bias, (GAUGES,), "bias voltages")
        _check(np.asarray(self.ratings), (GAUGES,), "ratings")
        if not 0.0 < self.full_scale <= 1e3:
            raise InputError("full scale of the converter", self.full_scale, "outside 0 to 1000 V")
        rows = np.abs(self.matrix).max(axis=1, keepdims=True)
        if not rows.all() or not np.linalg.cond(self.matrix / rows) < _WORST_CONDITION:
            advice = "Compare it with the sensor's own sheet: two rows or columns may be the same."
            raise InputError("calibration matrix", "singular", "six axes need six gauges", next_step=advice)

    def wrench(self, volts) -> np.ndarray:
        """Forces and torques (n, 6) [N, N m] of voltages (n, 6) [V]."""
        return (np.asarray(volts, dtype=float) - self.bias) @ self.matrix.T

    def status(self, volts) -> np.ndarray:
        """(n,) status words of voltages (n, 6) [V]: saturated where a gauge is at the end of the converter's range."""
        return np.where(np.abs(volts).max(axis=1) >= self.full_scale, SATURATED, 0)


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


def _unit_factor(text: str, dimension: str) -> float:
    unit = size(text, dimension)
    if unit is None:
        raise InputError(f"unit of {dimension}", repr(text), "not known", next_step="Write N, lbf, Nmm or the like.")
    return unit


def _of_toml(text: bytes) -> Calibration:
    file = msgspec.toml.decode(text, type=CalibrationFile)
    if len({len(row) for row in file.matrix}) > 1:
        raise InputError("calibration matrix", "ragged", "six rows of six numbers are needed", "$.matrix")
    unit = np.array([_unit_factor(file.force_unit, "force")] * 3 + [_unit_factor(file.torque_unit, "torque")] * 3)
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
    unit = [_unit_factor(found[axis][0], "force" if axis.startswith("f") else "torque") for axis in AXES]
    return Calibration(np.array(unit)[:, None] * np.array([found[axis][1] for axis in AXES]), np.array(bias))


def _check(values: np.ndarray, shape: tuple[int, ...], quantity: str) -> None:
    if values.shape != shape:
        raise InputError(quantity, f"of shape {values.shape}", f"{shape} is needed")
    if not np.isfinite(values).all():
        raise InputError(quantity, "not finite", "numbers are needed")


def calibration_of_xml(text: bytes) -> Calibration:
    """The calibration in such a file. Raises InputError for another file, and for one with a turned origin."""
    root = _root(text)
    about = root.find("Calibration")
    if root.tag != "FTSensor" or about is None:
        raise InputError("calibration file", f"<{root.tag}>", "<FTSensor> with a <Calibration> is needed")
    unit = np.array([_unit(about, "ForceUnits", "force")] * 3 + [_unit(about, "TorqueUnits", "torque")] * 3)
    old = about.find("UserAxis") is None
    matrix, ratings = _of_axes(about, unit) if old else _rows(about, "UserAxis", unit)
    said = (_OLD,) if old else ()
    return Calibration(matrix, np.zeros(GAUGES), _full_scale(about), root.get("Serial", "")[:80], ratings, said)


def _root(text: bytes) -> ElementTree.Element:
    try:
        if b"<!DOCTYPE" in text or b"<!ENTITY" in text:  # no entity grows
            raise ElementTree.ParseError
        return ElementTree.fromstring(text)
    except (ElementTree.ParseError, LookupError):
        raise InputError("calibration file", "not readable", "XML is expected") from None


def _rows(about, tag: str, unit: np.ndarray) -> tuple[np.ndarray, tuple[float, ...]]:
    """The matrix [SI/V] and the ends of the ranges [SI], by the rows' names."""
    rows = {row.get("Name", "").casefold(): row for row in about.findall(tag)}
    if set(rows) != set(AXES) or len(about.findall(tag)) != GAUGES:
        raise InputError(f"<{tag}>", ", ".join(rows) or "missing", "one each of Fx Fy Fz Tx Ty Tz is needed")
    numbers = [[_number(text, tag) for text in rows[axis].get("values", "").split()] for axis in AXES]
    if {len(row) for row in numbers} != {GAUGES}:
        raise InputError(f"values of <{tag}>", "not six", "six gauges are needed")
    ratings = [_number(rows[axis].get("max", "0"), tag) for axis in AXES]
    return unit[:, None] * np.array(numbers), tuple(float(each) for each in unit * np.array(ratings))


def _of_axes(about, unit: np.ndarray) -> tuple[np.ndarray, tuple[float, ...]]:
    matrix, ratings = _rows(about, "Axis", unit)
    scales = {row.get("Name", "").casefold(): _number(row.get("scale", ""), "Axis") for row in about.findall("Axis")}
    if not all(scales.values()):
        raise InputError("scale of <Axis>", 0, "a number other than 0 is needed")
    matrix /= np.array([scales[axis] for axis in AXES])[:, None]
    moved, length = about.find("BasicTransform"), _unit(about, "DistUnits", "length")
    place = [0.0 if moved is None else _number(moved.get(key, "0"), "BasicTransform") for key in _TRANSFORM]
    if any(place[3:]):
        advice = "Ask the maker for a file with UserAxis, or write the matrix as TOML."
        raise InputError("<BasicTransform>", "turned", "only a shift can be undone", next_step=advice)
    matrix[3:] -= np.cross(length * np.array(place[:3]), matrix[:3], axis=0)
    return matrix, ratings


def _full_scale(about) -> float:
    """Half of ``OutputRange`` [V] where the output has both signs."""
    span = _number(about.get("OutputRange", "20"), "Calibration")
    return span / 2.0 if about.get("OutputBipolar", "True").casefold() == "true" else span


def _unit(about, key: str, dimension: str) -> float:
    text = about.get(key, "")
    unit = size(text, dimension)
    if unit is None:
        raise InputError(key, repr(text[:40]), f"no known unit of {dimension}")
    return unit


def _number(text: str, tag: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(f"<{tag}>", repr(text[:40]), "a number is needed") from None
