# SPDX-License-Identifier: Apache-2.0
"""What an ATI Net F/T sensor sends: raw data transfer (RDT), requests of 8 bytes and records of 36, big-endian, over
UDP, and its configuration in the XML page ``netftapi2.xml`` of its web server.

A datagram holds one record, or several in buffered streaming. ``sequence`` counts the records sent and ``sample`` the
sensor's own readings (``ft_sequence``), which are faster; both wrap at 2^32.
"""

import math
import struct
from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple
from xml.etree.ElementTree import Element
from xml.sax.saxutils import escape

from ..errors import InputError
from ..files import xml_root
from ..units import number_in, size

PORT = 49152
AXES = ("fx", "fy", "fz", "tx", "ty", "tz")
_HEADER = 0x1234
_REQUEST = struct.Struct(">HHI")
_RECORD = struct.Struct(">3I6i")
RECORD_SIZE = _RECORD.size
_SATURATED_BIT, _SERIAL_LINK_BIT = 17, 27
SUMMARY = 1 << 31  # set together with any other bit
SATURATED = 1 << _SATURATED_BIT  # a gauge is at the end of its range
LINK_FAILED = 1 << _SERIAL_LINK_BIT
# meaning of the status bits of this sensor family
_STATUS = {
    30: "processor or memory error",
    29: "digital board error",
    28: "analog board error",
    _SERIAL_LINK_BIT: "serial link error",
    26: "program memory error",
    25: "halted by its configuration",
    24: "settings not valid",
    23: "configuration does not fit the calibration",
    22: "network failure",
    21: "CAN failure",
    20: "RDT failure",
    _SATURATED_BIT: "saturated, or a fault of the converter",
    16: "a monitored condition was met",
    2: "temperature out of range",
}
_NO_FAULT = 1 << 16 | SUMMARY  # a monitored condition
PAGE = "netftapi2.xml"
MAX_PAGE_BYTES = 1 << 18
_COUNTS = (1e-3, 1e12)  # per unit of force or torque; those of the sensors are 1e6
_RATE_HZ = (1.0, 1e5)  # the sensors send 1 to 7000 records per second
_EXPECTED = f"{PAGE} is XML without a document type"
_PAGE_ADVICE = "Check the address, or save the page from the sensor's web server and name the file."


class Command(IntEnum):
    """Command of a request."""

    STOP = 0
    START = 2
    START_BUFFERED = 3
    BIAS = 0x42


class Packet(NamedTuple):
    """One record: two counters, a status of 32 bits, and six counts in the order of ``AXES``."""

    sequence: int
    sample: int
    status: int
    counts: tuple[int, ...]


def pack_request(command: Command, count: int = 0) -> bytes:
    """The 8 bytes of a request for ``count`` records, 0 for no end."""
    return _REQUEST.pack(_HEADER, command, count)


def unpack_request(data: bytes) -> tuple[Command, int]:
    """Command and count of a request. Raises InputError for an invalid request."""
    if len(data) != _REQUEST.size:
        raise InputError("request", f"{len(data)} bytes", f"{_REQUEST.size} are needed")
    header, command, count = _REQUEST.unpack(data)
    if header != _HEADER or command not in list(Command):
        raise InputError("request", data.hex(), f"not {_HEADER:#06x} followed by a known command")
    return Command(command), count


def pack_record(packet: Packet) -> bytes:
    """The 36 bytes of a record; counters are taken modulo 2^32."""
    return _RECORD.pack(packet.sequence & 0xFFFFFFFF, packet.sample & 0xFFFFFFFF, packet.status, *packet.counts)


def unpack_records(data: bytes) -> list[Packet]:
    """The records of one datagram. Raises InputError for a size of zero or that is not a multiple of 36."""
    if not data or len(data) % RECORD_SIZE:
        raise InputError("datagram", f"{len(data)} bytes", f"a multiple of {RECORD_SIZE} is needed")
    return [Packet(a, b, c, tuple(counts)) for a, b, c, *counts in _RECORD.iter_unpack(data)]


def is_fault(status: int) -> bool:
    """Whether a status means that the counts of its record are invalid."""
    return status & ~_NO_FAULT != 0


def status_words(status: int) -> str:
    """A status in words; unknown bits are given as a number."""
    words = [word for bit, word in _STATUS.items() if status >> bit & 1]
    rest = status & ~SUMMARY & ~sum(1 << bit for bit in _STATUS)
    if rest or (status and not words):
        words.append(f"bits {rest or status:#010x}")
    return ", ".join(words) or "healthy"


@dataclass(frozen=True)
class SensorConfiguration:
    """Configuration of a sensor."""

    counts_per_force: float  # [1/N]
    counts_per_torque: float  # [1/(N m)]
    rate: float  # [Hz] records per second
    serial: str = ""
    ratings: tuple[float, ...] = (0.0,) * 6  # [N, N m] rated range of each axis, 0 if unknown

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
        value = number_in(text or "")
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
        values = [number_in(text) for text in (root.findtext("cfgmr") or "").split(";")]
    except ValueError:
        return (0.0,) * 6
    known = len(values) == 6 and all(0.0 <= value < 1e9 for value in values)
    return tuple(value * unit for value, unit in zip(values, [force] * 3 + [torque] * 3)) if known else (0.0,) * 6
