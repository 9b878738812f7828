# SPDX-License-Identifier: Apache-2.0
"""Conversion of units given as text, such as ``mm/s``, to SI. Inside the package every value is SI."""

import unicodedata
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from .errors import InputError

# dimension -> symbol -> factor to SI as exact decimal text; the SI unit itself comes first
_FACTORS = {
    "time": {"s": "1", "ms": "1/1000", "us": "1/1000000", "ns": "1/1000000000", "min": "60"},
    "length": {"m": "1", "mm": "1/1000", "um": "1/1000000", "nm": "1/1000000000", "cm": "1/100", "in": "0.0254"},
    "force": {"N": "1", "mN": "1/1000", "uN": "1/1000000", "nN": "1/1000000000", "kN": "1000",
              "gf": "0.00980665", "kgf": "9.80665", "lbf": "4.4482216152605"},
    "torque": {"N m": "1", "N mm": "1/1000", "mN m": "1/1000", "lbf in": "0.1129848290276167"},
    "velocity": {"m/s": "1", "mm/s": "1/1000", "um/s": "1/1000000", "cm/s": "1/100", "mm/min": "1/60000"},
    "stress": {"Pa": "1", "kPa": "1000", "MPa": "1000000", "GPa": "1000000000", "N/mm2": "1000000", "N/m2": "1",
               "psi": "6894.757293168361"},
}  # fmt: skip

# other spellings, as normalised by _plain()
_SPELLINGS = {
    "time": {"sec": "s", "secs": "s", "second": "s", "seconds": "s", "msec": "ms", "millisecond": "ms",
             "milliseconds": "ms", "usec": "us", "microseconds": "us", "nsec": "ns", "nanoseconds": "ns",
             "minute": "min", "minutes": "min"},
    "length": {"meter": "m", "meters": "m", "metre": "m", "metres": "m", "millimeter": "mm", "millimeters": "mm",
               "millimetre": "mm", "millimetres": "mm", "micron": "um", "microns": "um", "inch": "in"},
    "force": {"n": "N", "newton": "N", "newtons": "N", "mn": "mN"},
    "torque": {"nm": "N m", "nmm": "N mm", "mnm": "mN m", "lbfin": "lbf in"},
    "velocity": {"m/sec": "m/s", "mm/sec": "mm/s", "ms-1": "m/s", "mms-1": "mm/s"},
    "stress": {"pascal": "Pa", "kpa": "kPa", "gpa": "GPa", "n/mm2": "N/mm2", "n/m2": "N/m2"},
}  # fmt: skip


class Unit(NamedTuple):
    """One unit: its symbol and its factor to SI, ``numerator / denominator``."""

    symbol: str
    numerator: float
    denominator: float

    def to_si(self, values: np.ndarray) -> np.ndarray:
        """Convert ``values`` (n,) to SI. 1000 mm give exactly 1 m: a division by an integer rounds only once."""
        values = values if self.numerator == 1.0 else values * self.numerator
        return values if self.denominator == 1.0 else values / self.denominator


@lru_cache
def find(text: str, dimension: str) -> Unit | None:
    """Find the unit that a text names.

    Parameters
    ----------
    text : str
        A unit such as ``mm``. A leading minus reverses the sign: ``-N`` for a sensor whose compression is negative.
    dimension : str
        ``time``, ``length``, ``force``, ``torque``, ``velocity`` or ``stress``.

    Returns
    -------
    Unit or None
        None for a text that is not a unit of this dimension.
    """
    sign = -1 if text.strip().startswith("-") else 1
    symbol = _symbol(text.strip().removeprefix("-"), dimension)
    if symbol is None:
        return None
    factor = sign * Fraction(_FACTORS[dimension][symbol])
    return Unit("-" * (sign < 0) + symbol, float(factor.numerator), float(factor.denominator))


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
        raise InputError(
            f"unit of {quantity}",
            repr(text),
            f"known are {', '.join(symbols(dimension))}",
            place,
            f"Give one of them, for example --unit {quantity}={symbols(dimension)[0].replace(' ', '')}.",
        )
    return found


def symbols(dimension: str) -> tuple[str, ...]:
    """The known units of a dimension, the SI unit first."""
    return tuple(_FACTORS[dimension])


def _symbol(text: str, dimension: str) -> str | None:
    """The symbol in the table: an exact match first, because mN differs from MN, then spellings in lower case."""
    exact = {_plain(symbol): symbol for symbol in _FACTORS[dimension]}
    plain = _plain(text)
    spelled = _SPELLINGS[dimension]
    return exact.get(plain) or spelled.get(plain) or (spelled.get(plain.lower()) if len(plain) > 2 else None)


def _plain(text: str) -> str:
    """One spelling for N·m, N*m, N_m and N m; for µs and us; for mm_s and mm/s."""
    text = unicodedata.normalize("NFKC", text).replace("μ", "u").replace("^", "").strip()
    head, _, tail = text.rpartition("_")
    if head and tail in ("s", "min", "sec"):
        text = f"{head}/{tail}"
    return "".join(character for character in text if character not in " ·⋅*._")
