# SPDX-License-Identifier: Apache-2.0
"""Conditions that many inputs have to meet; each raises ``InputError`` with quantity, value, limit and next step.

Text, None and arrays are no numbers here, and NaN meets no condition.
"""

import math
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from .errors import InputError

Kind = TypeVar("Kind")


class Range(NamedTuple):
    """The numbers that a quantity can be, and the physics that ends them."""

    low: float
    high: float
    unit: str
    why: str


# what the numbers of needles, robots and tissue can be: beyond, a unit is wrong or a cell is damaged
PLACE = Range(-100.0, 100.0, "m", "no tracker sees farther")
TRAVEL = Range(-1.0, 1.0, "m", "no needle is longer")
LENGTH = Range(1e-7, 1.0, "m", "between a cell and the longest needle")
SLOPE = Range(-10.0, 10.0, "", "a tip at 84 degrees to its insertion does not enter")
ROLL = Range(-1e5, 1e5, "rad", "16 000 turns")
FORCE = Range(-1e3, 1e3, "N or N m", "no needle carries more")
MODULUS = Range(1e-2, 2e12, "Pa", "from a gel that hardly stands to diamond")
DENSITY = Range(1e-2, 1e6, "kg/m^3", "from a gas to forty times the densest metal")


def above_zero(quantity: str, value: float, unit: str = "", next_step: str = "") -> float:
    """The value if it is finite and above 0; the next step is to give it in its unit if none is stated."""
    if 0.0 < _number(value) < math.inf:
        return value
    raise _too_low(quantity, value, unit, "above 0", next_step)


def not_below_zero(quantity: str, value: float, unit: str = "", next_step: str = "") -> float:
    """The value if it is finite and not below 0; the next step is to give it in its unit if none is stated."""
    if 0.0 <= _number(value) < math.inf:
        return value
    raise _too_low(quantity, value, unit, "at least 0", next_step)


def within(quantity: str, value: float, low: float, high: float, unit: str = "", next_step: str = "") -> float:
    """The value if it is a number from ``low`` to ``high``."""
    if low <= _number(value) <= high:
        return value
    raise InputError(quantity, value, f"outside {low:g} to {high:g} {unit}".rstrip(), next_step=next_step)


def finite_number(quantity: str, value: float, next_step: str) -> float:
    """The value if it is a finite number."""
    if math.isfinite(_number(value)):
        return value
    raise InputError(quantity, repr(value)[:60], "not a finite number", next_step=next_step)


def in_range(
    quantity: str,
    values: ArrayLike,
    allowed: Range,
    next_step: str,
    shape: tuple[int, ...] | None = None,
    place: Callable[[int], str] | None = None,
) -> np.ndarray:
    """The values as an array if each is a number of the range and its shape, where one is stated, is this; ``place``
    states where a row is, which otherwise is named by its number."""
    array = _array(values)
    if shape is not None and array.shape != shape:
        raise InputError(quantity, f"shape {array.shape}", f"must be {shape}", next_step=next_step)
    right = (array >= allowed.low) & (array <= allowed.high)
    if np.all(right):
        return array
    at = tuple(int(k) for k in np.argwhere(~right)[0])
    unit, value = f" {allowed.unit}".rstrip(), float(array[at])
    limit = f"outside {allowed.low:g} to {allowed.high:g}{unit}: {allowed.why}"
    limit = limit if math.isfinite(value) else f"not finite, {limit}"
    row = f" in row {at[0] + 1}" if at and not place else ""
    where = place(at[0] if at else 0) if place else ""
    raise InputError(f"{quantity}{row}", f"{value:g}{unit}", limit, where, next_step)


def random_seed(value: int, quantity: str = "seed") -> int:
    """The value if random numbers can begin with it."""
    if isinstance(value, int | np.integer) and not isinstance(value, bool) and 0 <= value < 1 << 63:
        return value
    limit = "must be a whole number, at least 0 and below 2^63"
    raise InputError(quantity, repr(value)[:60], limit, next_step="Give 1.")


def one_of(quantity: str, value: object, names: Iterable[str]) -> None:
    """Refuse what is none of the names."""
    known = tuple(names)
    if not isinstance(value, str) or value not in known:
        raise InputError(quantity, repr(value), "unknown", next_step=f"Give one of {', '.join(known)}.")


def instance_of(quantity: str, value: Any, kind: type[Kind], next_step: str) -> Kind:
    """The value if it is of the class."""
    if isinstance(value, kind):
        return value
    raise InputError(quantity, type(value).__name__, f"not a {kind.__name__}", next_step=next_step)


def _number(value: object) -> float:
    """The value as a number; NaN if it is none."""
    try:
        return math.nan if isinstance(value, str | bytes) or np.ndim(value) else float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return math.nan


def _array(values: ArrayLike) -> np.ndarray:
    """The values as numbers; one NaN if they are none, or rows of different lengths."""
    try:
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        return np.array(np.nan)


def _too_low(quantity: str, value: float, unit: str, limit: str, next_step: str) -> InputError:
    limit = f"must be finite and {limit}" if _number(value) == math.inf else f"must be {limit}"
    step = next_step or (f"Give it in {unit}." if unit else "")
    return InputError(quantity, f"{value} {unit}".rstrip(), limit, next_step=step)
