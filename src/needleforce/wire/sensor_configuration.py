# SPDX-License-Identifier: Apache-2.0
"""The configuration of a Net F/T sensor in the XML page ``netftapi2.xml`` of its web server."""

import math
from dataclasses import dataclass
from xml.etree.ElementTree import Element
from xml.sax.saxutils import escape

from ..errors import InputError
from ..files import xml_root
from ..units import size

PAGE = "netftapi2.xml"
MAX_PAGE_BYTES = 1 << 18
_COUNTS = (1e-3, 1e12)  # per unit of force or torque; those of the sensors are 1e6
_RATE_HZ = (1.0, 1e5)  # the sensors send 1 to 7000 records per second
_EXPECTED = f"{PAGE} is XML without a document type"
_PAGE_ADVICE = "Check the address, or save the page from the sensor's web server and name the file."


@dataclass(frozen=True)
class SensorConfiguration:
    """Configuration of a sensor.

    Attributes
    ----------
    counts_per_force : float
        [1/N]
    counts_per_torque : float
        [1/(N m)]
    rate : float
        Records per second [Hz].
    serial : str
        Serial number.
    ratings : tuple of float
        Rated range of each axis [N, N m], 0 if unknown.
    """

    counts_per_force: float
    counts_per_torque: float
    rate: float
    serial: str = ""
    ratings: tuple[float, ...] = (0.0,) * 6

    def wrench(self, counts: tuple[int, ...]) -> tuple[float, ...]:
        """Forces [N] and torques [N m] from six counts."""
        f, t = self.counts_per_force, self.counts_per_torque
        return (*(count / f for count in counts[:3]), *(count / t for count in counts[3:]))

    def xml(self) -> bytes:
        """The XML page with this configuration."""
        ratings = ";".join(f"{value:g}" for value in self.ratings)
        tags = {
            "runstat": "0x00000000", "scfgfu": "N", "scfgtu": "Nm", "cfgcpf": f"{self.counts_per_force:.12g}",
            "cfgcpt": f"{self.counts_per_torque:.12g}", "cfgcalsn": escape(self.serial), "cfgmr": ratings,
            "comrdtrate": f"{self.rate:.12g}",
        }  # fmt: skip
        body = "".join(f"<{tag}>{text}</{tag}>" for tag, text in tags.items())
        return f'<?xml version="1.0"?><netft>{body}</netft>'.encode()


def parse_configuration(page: bytes, place: str) -> SensorConfiguration:
    """Parse the page. Raises InputError, with the tag, if counts, units or a rate are missing or invalid."""
    root = _root(page, place)
    force, torque = _unit(root, "scfgfu", "force", place), _unit(root, "scfgtu", "torque", place)
    counts = (_number(root, "cfgcpf", place, *_COUNTS) / force, _number(root, "cfgcpt", place, *_COUNTS) / torque)
    serial = (root.findtext("cfgcalsn") or "").strip()[:80]
    rate, ratings = _number(root, "comrdtrate", place, *_RATE_HZ), _ratings(root, force, torque)
    return SensorConfiguration(*counts, rate, serial, ratings)


def _root(page: bytes, place: str) -> Element:
    try:
        if len(page) > MAX_PAGE_BYTES:
            raise ValueError
        return xml_root(page)
    except ValueError:
        raise InputError("sensor's configuration", "not readable", _EXPECTED, place, _PAGE_ADVICE) from None


def _number(root: Element, tag: str, place: str, low: float, high: float) -> float:
    text = root.findtext(tag)
    try:
        value = float(text or "")
    except ValueError:
        value = math.nan
    if not low <= value <= high:
        limit = f"a number from {low:g} to {high:g} is needed"
        raise InputError(f"<{tag}> of the sensor", repr((text or "")[:40]), limit, place, _PAGE_ADVICE)
    return value


def _unit(root: Element, tag: str, dimension: str, place: str) -> float:
    """The factor from a unit to SI."""
    text = (root.findtext(tag) or "").strip()
    unit = size(text, dimension)
    if unit is None:
        limit = f"not a known unit of {dimension}"
        raise InputError(f"<{tag}> of the sensor", repr(text[:40]), limit, place, _PAGE_ADVICE)
    return unit


def _ratings(root: Element, force: float, torque: float) -> tuple[float, ...]:
    try:
        values = [float(text) for text in (root.findtext("cfgmr") or "").split(";")]
    except ValueError:
        return (0.0,) * 6
    known = len(values) == 6 and all(0.0 <= value < 1e9 for value in values)
    return tuple(value * unit for value, unit in zip(values, [force] * 3 + [torque] * 3)) if known else (0.0,) * 6
