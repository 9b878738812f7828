# SPDX-License-Identifier: Apache-2.0
"""Values as text: units of a readable size, and no more digits than the interval supports."""

import math
from dataclasses import dataclass

MAX_DIGITS = 6  # significant digits, however narrow the interval
DIGITS_WITHOUT_INTERVAL = 4  # significant digits of a value without interval
WIDE_INTERVAL = 2.0  # half width over value: above this, an asymmetric interval is shown with two digits each
DASH = "–"

# SI unit -> (from which magnitude on, factor, shown unit), the largest first
_SCALES = {
    "m": ((1e-6, 1e3, "mm"), (1e-15, 1e9, "nm"), (0.0, 1e3, "mm")),
    "N": ((1e-4, 1.0, "N"), (1e-7, 1e6, "µN"), (1e-16, 1e9, "nN"), (0.0, 1.0, "N")),
    "m/s": ((0.0, 1e3, "mm/s"),),
    "Pa": ((1e9, 1e-9, "GPa"), (1e6, 1e-6, "MPa"), (1e3, 1e-3, "kPa"), (0.0, 1.0, "Pa")),
    "N/m": ((0.0, 1e-3, "N/mm"),),
    "N/m²": ((0.0, 1e-6, "N/mm²"),),
    "N m": ((0.0, 1e3, "N mm"),),
    "N m²": ((0.0, 1.0, "N m²"),),
    "rad": ((0.0, 180.0 / math.pi, "°"),),
    "J": ((0.0, 1e3, "mJ"),),
    "1": ((0.0, 1.0, ""),),
}
_SPELLINGS = {"N/m^2": "N/m²", "N/m2": "N/m²", "N·m": "N m", "N m^2": "N m²", "-": "1", "": "1"}


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A value and its interval as text, in the unit shown, which is empty for a ratio; limits and half width are empty
    without an interval."""

    value: str
    low: str
    high: str
    half_width: str
    symmetric: bool  # whether the value is the middle of the interval, within a twentieth of the half width
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


def quantity(value: float, low: float | None, high: float | None, unit: str, max_digits: int = MAX_DIGITS) -> Quantity:
    """Scale a value in an SI unit, ``"1"`` for a ratio, to a readable unit and round it to two digits of its interval's
    half width, to ``max_digits`` significant ones however narrow it is. Limits are None or NaN without an interval."""
    sizes = [abs(x) for x in (value, low, high) if x is not None and math.isfinite(x)]
    factor, shown = scale(max(sizes, default=value), unit)
    value, low, high = (math.nan if x is None else float(x) * factor for x in (value, low, high))
    half = 0.5 * (high - low)
    places = decimals(value, half, max_digits)
    if not (math.isfinite(low) or math.isfinite(high)):
        text = _trimmed(fixed(value, places))
        return Quantity(value=text, low="", high="", half_width="", symmetric=False, unit=shown)
    symmetric = math.isfinite(half) and half > 0.0 and abs(high + low - 2.0 * value) <= 0.1 * half
    if not symmetric and math.inf > half > WIDE_INTERVAL * abs(value):
        known = decimals(value, abs(value), 2)
        texts = (fixed(x, min(known, decimals(x, abs(x), 2))) for x in (value, low, high))
    else:
        texts = (fixed(x, places) for x in (value, low, high))
    text, low_text, high_text = texts
    return Quantity(
        value=text, low=low_text, high=high_text, half_width=_at_least(half, places), symmetric=symmetric, unit=shown
    )


def plain(value: float | None, unit: str, like: float | None = None) -> str:
    """A value without interval, with its unit; None and NaN give a dash.

    ``like`` is a size in the SI unit, such as a standard deviation, whose second digit is the last one shown.
    """
    if value is None or not math.isfinite(value):
        return DASH
    factor, shown = scale(value, unit)
    half = abs(like) * factor if like is not None else math.nan
    text = fixed(value * factor, decimals(value * factor, half))
    return with_unit(text if like is not None else _trimmed(text), shown)


def scale(value: float | None, unit: str) -> tuple[float, str]:
    """Factor from the SI unit to the unit shown, and that unit, selected by the magnitude of ``value`` in the SI unit.

    A unit that is not in the table is returned unchanged, with factor 1.
    """
    steps = _SCALES.get(_SPELLINGS.get(unit, unit), ((0.0, 1.0, unit),))
    size = abs(value) if value is not None and math.isfinite(value) else 0.0
    return next((factor, shown) for start, factor, shown in steps if size >= start)


# SI unit -> (from which span on, factor, shown unit), the largest first
_SPANS = {
    "m": ((1e-4, 1e3, "mm"), (1e-7, 1e6, "µm"), (1e-15, 1e9, "nm"), (0.0, 1e3, "mm")),
    "N": ((0.1, 1.0, "N"), (1e-4, 1e3, "mN"), (1e-7, 1e6, "µN"), (1e-16, 1e9, "nN"), (0.0, 1.0, "N")),
}


def span_scale(low: float, high: float, unit: str) -> tuple[float, str]:
    """The factor from the SI unit, ``"m"`` or ``"N"``, to the one in which a range is shown, and that unit."""
    return next((factor, shown) for start, factor, shown in _SPANS[unit] if high - low >= start)


def spanned(low: float, high: float, unit: str) -> str:
    """A range as text, in a unit of a readable size: ``0.00 to 20.00 mm``, ``-0.47 to 31.40 µm``."""
    factor, shown = span_scale(low, high, unit)
    places = max(0, 3 - math.floor(math.log10((high - low) * factor))) if high > low else DIGITS_WITHOUT_INTERVAL
    return f"{low * factor + 0.0:.{places}f} to {high * factor + 0.0:.{places}f} {shown}"


def decimals(value: float, half_width: float, max_digits: int = MAX_DIGITS) -> int:
    """Decimal places: two digits of the half width, or four digits of the value without one (NaN or 0).

    Value and half width are in the unit shown; a negative number rounds to tens, hundreds and so on.
    """
    size = math.floor(math.log10(abs(value))) if math.isfinite(value) and value != 0.0 else 0
    if not math.isfinite(half_width) or half_width <= 0.0:
        return DIGITS_WITHOUT_INTERVAL - 1 - size
    return min(1 - math.floor(math.log10(half_width)), max_digits - 1 - size)


def fixed(value: float, places: int) -> str:
    """A value with that many decimals and a typographic minus sign; NaN is a dash, infinity its sign.

    A negative number of decimals rounds to tens, hundreds and so on.
    """
    if math.isnan(value):
        return DASH
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    text = f"{round(value, places):.{max(places, 0)}f}"
    return text.replace("-", "−") if float(text) != 0.0 else text.removeprefix("-")


def with_unit(text: str, unit: str) -> str:
    """A number and its unit with a no-break space; a degree sign follows without one. An empty unit adds nothing."""
    return f"{text}{unit}" if unit in ("", "°") else f"{text}\N{NO-BREAK SPACE}{unit}"


def _trimmed(text: str) -> str:
    """The text without trailing zeros, which would suggest digits that are not known."""
    return text.rstrip("0").rstrip(".") if "." in text else text


def _at_least(half: float, places: int) -> str:
    """The half width; below half of the last decimal place, ``<`` and that place."""
    smallest = 10.0**-places
    return fixed(half, places) if not 0.0 < half < 0.5 * smallest else f"<{fixed(smallest, places)}"


def percent(share: float) -> str:
    """A share [1] as per cent with two significant digits, without an exponent, such as ``"3.4 %"`` for 0.034."""
    return f"{float(f'{100.0 * share:.2g}'):.15g} %"


def counted(number: int, noun: str) -> str:
    """A count with its noun, such as ``1 recording`` or ``2 recordings``; the plural adds an s."""
    return f"{number} {noun}" + ("" if number == 1 else "s")
