# SPDX-License-Identifier: Apache-2.0
"""The calibration file that ATI gives with a sensor for data acquisition cards: XML, with rows of the matrix as
text.

``FTSensor`` has the serial number, ``Calibration`` the units and the converter's range, each ``UserAxis`` a row of
the matrix at the sensor's face and the end of its range. Files before version 1.1 have no ``UserAxis``: there ``Axis``
holds the rows times ``scale``, about an origin that ``BasicTransform`` puts elsewhere. Files with both tell the
relation.
"""

from xml.etree import ElementTree

import numpy as np

from ...errors import InputError
from ...units import size
from ...wire.rdt import AXES
from .calibration import GAUGES, Calibration

_OLD = "the file has no UserAxis: the matrix is Axis / scale, its torques moved by BasicTransform"


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


_TRANSFORM = ("Dx", "Dy", "Dz", "Rx", "Ry", "Rz")


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
