# SPDX-License-Identifier: Apache-2.0
"""Conversion of units given as text, such as ``mm/s``, to SI. Inside the package every value is SI."""

import re
import unicodedata
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

from .errors import InputError

if TYPE_CHECKING:
    import numpy as np

# dimension -> symbol -> factor to SI as exact decimal text; the SI unit itself comes first
_FACTORS = {
    "time": {"s": "1", "ms": "1/1000", "us": "1/1000000", "ns": "1/1000000000", "min": "60", "h": "3600"},
    "length": {"m": "1", "mm": "1/1000", "um": "1/1000000", "nm": "1/1000000000", "cm": "1/100", "in": "0.0254",
               "mil": "0.0000254", "pm": "1/1000000000000", "ft": "0.3048"},
    "force": {"N": "1", "mN": "1/1000", "uN": "1/1000000", "nN": "1/1000000000", "pN": "1/1000000000000",
              "cN": "1/100", "daN": "10", "kN": "1000", "gf": "0.00980665", "mgf": "0.00000980665", "kgf": "9.80665",
              "lbf": "4.4482216152605", "ozf": "0.27801385095378125", "dyn": "0.00001"},
    "torque": {"N m": "1", "N cm": "1/100", "N mm": "1/1000", "mN m": "1/1000", "uN m": "1/1000000",
               "lbf in": "0.1129848290276167", "ozf in": "0.007061551814326", "gf cm": "0.0000980665",
               "kgf cm": "0.0980665"},
    "velocity": {"m/s": "1", "mm/s": "1/1000", "um/s": "1/1000000", "nm/s": "1/1000000000", "cm/s": "1/100",
                 "mm/min": "1/60000", "um/min": "1/60000000", "cm/min": "1/6000", "m/min": "1/60", "in/s": "0.0254",
                 "in/min": "127/300000"},
    "angle": {"rad": "1", "mrad": "1/1000", "deg": "0.017453292519943295", "rev": "6.283185307179586"},
    "stress": {"Pa": "1", "hPa": "100", "kPa": "1000", "MPa": "1000000", "GPa": "1000000000", "N/mm2": "1000000",
               "N/cm2": "10000", "N/m2": "1", "psi": "6894.757293168361", "ksi": "6894757.293168361", "bar": "100000",
               "mbar": "100", "kgf/cm2": "98066.5", "gf/cm2": "98.0665", "dyn/cm2": "0.1", "mmHg": "133.322387415"},
}  # fmt: skip
DIMENSIONS = tuple(_FACTORS)
_MAX_CHARS = 40  # of a unit with a factor
_MIN_STEP, _MAX_STEP = 1e-30, 1e30  # of one count in its unit

# other spellings, as normalised by _plain(); a mass stands for its weight, as balances and texture analysers print it
_SPELLINGS = {
    "time": {"sec": "s", "secs": "s", "second": "s", "seconds": "s", "sek": "s", "sekunden": "s", "seconde": "s",
             "secondes": "s", "secondi": "s", "segundos": "s", "msec": "ms", "millis": "ms", "millisecond": "ms",
             "milliseconds": "ms", "millisekunden": "ms", "usec": "us", "micros": "us", "microsecond": "us",
             "microseconds": "us", "nsec": "ns", "nanoseconds": "ns", "minute": "min", "minutes": "min",
             "minuten": "min", "hr": "h", "hour": "h", "hours": "h"},
    "length": {"meter": "m", "meters": "m", "metre": "m", "metres": "m", "millimeter": "mm", "millimeters": "mm",
               "millimetre": "mm", "millimetres": "mm", "micron": "um", "microns": "um", "micrometer": "um",
               "micrometers": "um", "micrometre": "um", "micrometres": "um", "mikrometer": "um",
               "nanometer": "nm", "nanometers": "nm", "nanometre": "nm", "nanometres": "nm", "centimeter": "cm",
               "centimeters": "cm", "centimetre": "cm", "centimetres": "cm", "inch": "in", "inches": "in",
               "thou": "mil", "feet": "ft"},
    "force": {"n": "N", "newton": "N", "newtons": "N", "mn": "mN", "millinewton": "mN", "millinewtons": "mN",
              "micronewton": "uN", "micronewtons": "uN", "g": "gf", "gF": "gf",
              "gram": "gf", "grams": "gf", "gramm": "gf",
              "gram-force": "gf", "gramforce": "gf", "pond": "gf", "mg": "mgf", "kg": "kgf", "kp": "kgf",
              "kilogram": "kgf", "kilograms": "kgf", "kilopond": "kgf", "lb": "lbf", "lbs": "lbf", "pound": "lbf",
              "pounds": "lbf", "oz": "ozf", "dyne": "dyn", "dynes": "dyn"},
    "torque": {"nm": "N m", "ncm": "N cm", "nmm": "N mm", "mnm": "mN m", "lbfin": "lbf in", "lbin": "lbf in",
               "ozin": "ozf in", "gcm": "gf cm", "kgcm": "kgf cm"},
    "velocity": {"m/sec": "m/s", "mm/sec": "mm/s", "ms-1": "m/s", "mms-1": "mm/s", "umps": "um/s", "mmps": "mm/s"},
    "angle": {"°": "deg", "degree": "deg", "degrees": "deg", "grad": "deg", "radian": "rad", "radians": "rad",
              "turn": "rev", "turns": "rev", "revolution": "rev", "revolutions": "rev"},
    "stress": {"pascal": "Pa", "kpa": "kPa", "mpa": "MPa", "gpa": "GPa", "n/mm2": "N/mm2", "n/m2": "N/m2",
               "kg/cm2": "kgf/cm2", "g/cm2": "gf/cm2"},
}  # fmt: skip
_FACTOR = re.compile(r"(?P<number>(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?)\s*[*x×·]?\s*(?P<unit>[^\d\s].*)")


class Unit(NamedTuple):
    """One unit: its symbol and its factor to SI, ``numerator / denominator``."""

    symbol: str
    numerator: float
    denominator: float

    def to_si(self, values: "np.ndarray") -> "np.ndarray":
        """Convert ``values`` (n,) to SI. 1000 mm give exactly 1 m: a division by an integer rounds only once."""
        values = values if self.numerator == 1.0 else values * self.numerator
        return values if self.denominator == 1.0 else values / self.denominator


@lru_cache
def number_in(text: str) -> float:
    """The number that a text is, which has no underscores: Python alone reads 1_0 as one. Raises ValueError."""
    return float(text.replace("_", "?"))


def find(text: str, dimension: str) -> Unit | None:
    """Find the unit that a text names.

    Parameters
    ----------
    text : str
        A unit such as ``mm``. A leading minus reverses the sign: ``-N`` for a sensor whose compression is negative. A
        number before it is a step or the factor of counts: ``0.0122N``.
    dimension : str
        One of ``DIMENSIONS``.

    Returns
    -------
    Unit or None
        None for a text that is not a unit of this dimension.
    """
    text = text.strip().replace("\u2212", "-")
    sign = -1 if text.startswith("-") else 1
    text = text.removeprefix("-").removeprefix("+").strip()
    symbol, step = _symbol(text, dimension), "1"
    scaled = _FACTOR.fullmatch(text) if symbol is None and len(text) < _MAX_CHARS else None
    if scaled and _MIN_STEP <= float(scaled["number"]) <= _MAX_STEP:
        symbol, step = _symbol(scaled["unit"], dimension), scaled["number"]
    if symbol is None:
        return None
    factor = sign * Fraction(_FACTORS[dimension][symbol]) * Fraction(step)
    shown = "-" * (sign < 0) + (symbol if step == "1" else f"{step} {symbol}")
    return Unit(shown, float(factor.numerator), float(factor.denominator))


def size(text: str, dimension: str) -> float | None:
    """The factor to SI of a unit in the spelling of sensor files (``lbf-in``), or None if it is unknown."""
    found = find(text.replace("-", ""), dimension)
    return None if found is None else float(found.to_si(1.0))


def parse(text: str, dimension: str, quantity: str, place: str = "") -> Unit:
    """Find the unit that a text names, or raise InputError.

    Parameters
    ----------
    text, dimension : str
        As for ``find``.
    quantity : str
        The quantity that the message names.
    place : str
        The place that the message names, such as a file.

    Returns
    -------
    Unit
        The unit.

    Raises
    ------
    InputError
        The text is not a unit of this dimension; the message lists the known units.
    """
    found = find(text, dimension)
    if found is None:
        example = symbols(dimension)[0].replace(" ", "")
        step = f"Give one of them, for example --unit {quantity}={example}, or what one of another unit or one count is"
        step += f", as a number before {example}."
        if other := next((each for each in DIMENSIONS if find(text, each)), ""):
            step = f"{text} is a unit of {other}: choose the column of the {quantity}, or give the right unit."
        limit = f"known are {', '.join(symbols(dimension))}"
        raise InputError(f"unit of {quantity}", repr(text), limit, place, step)
    return found


def symbols(dimension: str) -> tuple[str, ...]:
    """The known units of a dimension, the SI unit first."""
    return tuple(_FACTORS[dimension])


def _symbol(text: str, dimension: str) -> str | None:
    """The symbol in the table: an exact match first, because mN differs from MN, then spellings in lower case."""
    exact = {_plain(symbol): symbol for symbol in _FACTORS[dimension]}
    plain = _plain(text)
    spelled = _SPELLINGS[dimension]
    lower = plain.lower() if len(plain) > 2 else ""  # two letters may differ in case alone: mN and MN
    return exact.get(plain) or spelled.get(plain) or spelled.get(lower) or exact.get(lower)


def _plain(text: str) -> str:
    """One spelling for N·m, N*m, N_m and N m; for µs and us; for mm_s and mm/s."""
    text = unicodedata.normalize("NFKC", text).replace("μ", "u").replace("^", "").strip()
    head, _, tail = text.rpartition("_")
    if head and tail in ("s", "min", "sec"):
        text = f"{head}/{tail}"
    return "".join(character for character in text if character not in " ·⋅*._")
