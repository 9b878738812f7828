# SPDX-License-Identifier: Apache-2.0
"""Units at the edge: text such as ``mm/s`` and the exact factor to SI. Inside the package everything is SI."""

import unicodedata
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from .errors import InputError

# dimension -> symbol -> SI units in one of it, as exact decimal text; the SI unit itself comes first
_FACTORS = {
    "time": {"s": "1", "ms": "1/1000", "us": "1/1000000", "ns": "1/1000000000", "min": "60"},
    "length": {"m": "1", "mm": "1/1000", "um": "1/1000000", "nm": "1/1000000000", "cm": "1/100", "in": "0.0254"},
    "force": {"N": "1", "mN": "1/1000", "uN": "1/1000000", "nN": "1/1000000000", "kN": "1000",
              "gf": "0.00980665", "kgf": "9.80665", "lbf": "4.4482216152605"},
    "torque": {"N m": "1", "N mm": "1/1000", "mN m": "1/1000", "lbf in": "0.1129848290276167"},
    "velocity": {"m/s": "1", "mm/s": "1/1000", "um/s": "1/1000000", "cm/s": "1/100", "mm/min": "1/60000"},
}  # fmt: skip

# other spellings, after _plain()
_SPELLINGS = {
    "time": {"sec": "s", "secs": "s", "second": "s", "seconds": "s", "msec": "ms", "millisecond": "ms",
             "milliseconds": "ms", "usec": "us", "microseconds": "us", "nsec": "ns", "nanoseconds": "ns",
             "minute": "min", "minutes": "min"},
    "length": {"meter": "m", "meters": "m", "metre": "m", "metres": "m", "millimeter": "mm", "millimeters": "mm",
               "millimetre": "mm", "millimetres": "mm", "micron": "um", "microns": "um", "inch": "in"},
    "force": {"n": "N", "newton": "N", "newtons": "N", "mn": "mN"},
    "torque": {"nm": "N m", "nmm": "N mm", "mnm": "mN m", "lbfin": "lbf in"},
    "velocity": {"m/sec": "m/s", "mm/sec": "mm/s", "ms-1": "m/s", "mms-1": "mm/s"},
}  # fmt: skip


class Unit(NamedTuple):
    """One unit: its symbol, and how many SI units it holds, as ``numerator / denominator``."""

    symbol: str
    numerator: float
    denominator: float

    def to_si(self, values: np.ndarray) -> np.ndarray:
        """``values`` (n,) in SI. 1000 mm are exactly 1 m: a division by the whole number rounds once only."""
        values = values if self.numerator == 1.0 else values * self.numerator
        return values if self.denominator == 1.0 else values / self.denominator


@lru_cache
def find(text: str, dimension: str) -> Unit | None:
    """The unit of a dimension (time, length, force, torque, velocity) that ``text`` spells, or None.

    A leading minus turns the sign round: ``-N`` is what a sensor gives whose compression is negative.
    """
    sign = -1 if text.strip().startswith("-") else 1
    symbol = _symbol(text.strip().removeprefix("-"), dimension)
    if symbol is None:
        return None
    factor = sign * Fraction(_FACTORS[dimension][symbol])
    return Unit("-" * (sign < 0) + symbol, float(factor.numerator), float(factor.denominator))


def size(text: str, dimension: str) -> float | None:
    """How many SI units a unit holds, as a sensor's own files spell it (``lbf-in``), or None."""
    found = find(text.replace("-", ""), dimension)
    return None if found is None else float(found.to_si(1.0))


def parse(text: str, dimension: str, quantity: str, place: str = "") -> Unit:
    """As ``find``; raises InputError naming ``quantity`` and the known units where there is none."""
    found = find(text, dimension)
    if found is None:
        raise InputError(
            f"unit of {quantity}",
            repr(text),
            f"known are {', '.join(symbols(dimension))}",
            place,
            f"Give one of them, as --unit {quantity}={symbols(dimension)[0].replace(' ', '')}.",
        )
    return found


def symbols(dimension: str) -> tuple[str, ...]:
    """The known units of a dimension, the SI unit first."""
    return tuple(_FACTORS[dimension])


def _symbol(text: str, dimension: str) -> str | None:
    """The table's symbol; the case counts first (mN is no MN), then spellings in lower case."""
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
