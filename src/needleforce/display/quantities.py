# SPDX-License-Identifier: Apache-2.0
"""Numbers for people: units of a sensible size, and no more digits than the interval supports."""

import math
from dataclasses import dataclass

MOST_DIGITS = 6  # significant digits shown at most, however narrow the interval
WITHOUT_INTERVAL = 4  # significant digits where no interval says how many are known
UNKNOWN = 2.0  # half widths a value: beyond, of limits by factors, two digits of each are shown
DASH = "–"

# SI unit -> (from which magnitude on, factor, shown unit), the largest first
_SCALES = {
    "m": ((0.0, 1e3, "mm"),),
    "m/s": ((0.0, 1e3, "mm/s"),),
    "Pa": ((1e9, 1e-9, "GPa"), (1e6, 1e-6, "MPa"), (1e3, 1e-3, "kPa"), (0.0, 1.0, "Pa")),
    "N/m": ((0.0, 1e-3, "N/mm"),),
    "N/m²": ((0.0, 1e-6, "N/mm²"),),
    "N m": ((0.0, 1e3, "N mm"),),
    "rad": ((0.0, 180.0 / math.pi, "°"),),
    "J": ((0.0, 1e3, "mJ"),),
    "1": ((0.0, 1.0, ""),),
}
_SPELLINGS = {"N/m^2": "N/m²", "N/m2": "N/m²", "N·m": "N m", "-": "1", "": "1"}


@dataclass(frozen=True)
class Quantity:
    """One number as text: ``value``, ``low``, ``high`` in ``unit``; ``low`` and ``high`` empty without an interval."""

    value: str
    low: str
    high: str
    half_width: str
    symmetric: bool
    unit: str

    @property
    def text(self) -> str:
        """The value and its unit."""
        return with_unit(self.value, self.unit)

    @property
    def interval(self) -> str:
        """``low to high``, or empty."""
        return f"{self.low} to {self.high}" if self.low or self.high else ""

    def __str__(self) -> str:
        if self.symmetric:
            return with_unit(f"{self.value} ± {self.half_width}", self.unit)
        return self.text + (f" ({self.interval})" if self.interval else "")


def quantity(value: float, low: float | None, high: float | None, unit: str, most: int = MOST_DIGITS) -> Quantity:
    """``value`` [SI ``unit``] with its interval, scaled for people and rounded to two digits of the half width.

    ``most`` significant digits are shown of the value, however narrow the interval.
    """
    factor, shown = scale(value, unit)
    value, low, high = (math.nan if x is None else float(x) * factor for x in (value, low, high))
    half = 0.5 * (high - low)
    places = decimals(value, half, most)
    if not (math.isfinite(low) or math.isfinite(high)):
        return Quantity(_trimmed(fixed(value, places)), "", "", "", False, shown)
    symmetric = math.isfinite(half) and half > 0.0 and abs(high + low - 2.0 * value) <= 0.1 * half
    if not symmetric and math.inf > half > UNKNOWN * abs(value):
        known = decimals(value, abs(value), 2)
        texts = (fixed(x, min(known, decimals(x, abs(x), 2))) for x in (value, low, high))
    else:
        texts = (fixed(x, places) for x in (value, low, high))
    return Quantity(*texts, _at_least(half, places), symmetric, shown)


def plain(value: float | None, unit: str, like: float | None = None) -> str:
    """One number without interval, with its unit; ``like`` [SI] sets the decimals, as a standard deviation does."""
    if value is None or not math.isfinite(value):
        return DASH
    factor, shown = scale(value, unit)
    half = abs(like) * factor if like is not None else math.nan
    text = fixed(value * factor, decimals(value * factor, half))
    return with_unit(text if like is not None else _trimmed(text), shown)


def scale(value: float | None, unit: str) -> tuple[float, str]:
    """Factor from SI to the unit shown, and that unit; a unit not known here stays as it is."""
    steps = _SCALES.get(_SPELLINGS.get(unit, unit), ((0.0, 1.0, unit),))
    size = abs(value) if value is not None and math.isfinite(value) else 0.0
    return next((factor, shown) for start, factor, shown in steps if size >= start)


def decimals(value: float, half_width: float, most: int = MOST_DIGITS) -> int:
    """Decimal places: two digits of the half width, else four of the value; below 0 rounds to tens, hundreds …."""
    size = math.floor(math.log10(abs(value))) if math.isfinite(value) and value != 0.0 else 0
    if not math.isfinite(half_width) or half_width <= 0.0:
        return WITHOUT_INTERVAL - 1 - size
    return min(1 - math.floor(math.log10(half_width)), most - 1 - size)


def fixed(value: float, places: int) -> str:
    """``value`` with that many decimals, a true minus sign, and a word for what is not a number."""
    if math.isnan(value):
        return DASH
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    text = f"{round(value, places):.{max(places, 0)}f}"
    return text.replace("-", "−") if float(text) != 0.0 else text.removeprefix("-")


def with_unit(text: str, unit: str) -> str:
    """Number and unit, kept on one line; a degree sign follows without a space."""
    return f"{text}{unit}" if unit in ("", "°") else f"{text}\N{NO-BREAK SPACE}{unit}"


def _trimmed(text: str) -> str:
    """Without the zeros at the end, which would claim digits that nobody gave."""
    return text.rstrip("0").rstrip(".") if "." in text else text


def _at_least(half: float, places: int) -> str:
    """The half width; where it is below the last place, that it is below."""
    smallest = 10.0**-places
    return fixed(half, places) if not 0.0 < half < 0.5 * smallest else f"<{fixed(smallest, places)}"


def counted(number: int, noun: str) -> str:
    """``1 recording``, ``2 recordings``."""
    return f"{number} {noun}" + ("" if number == 1 else "s")
