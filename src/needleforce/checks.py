# SPDX-License-Identifier: Apache-2.0
"""Conditions that many inputs have to meet; each raises ``InputError`` with quantity, value, limit and next step.

Text, None and arrays are no numbers here, and NaN meets no condition.
"""

import math
from collections.abc import Iterable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from .errors import InputError

Kind = TypeVar("Kind")


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


def finite_array(quantity: str, values: ArrayLike, next_step: str, shape: tuple[int, ...] | None = None) -> np.ndarray:
    """The values as an array if all of them are finite and its shape, where one is stated, is this."""
    array = _array(values)
    if shape is not None and array.shape != shape:
        raise InputError(quantity, f"shape {array.shape}", f"must be {shape}", next_step=next_step)
    if np.all(np.isfinite(array)):
        return array
    raise InputError(quantity, "not finite", "must be numbers", next_step=next_step)


def three_numbers(quantity: str, values: ArrayLike, next_step: str = "Give x, y, z in m.") -> np.ndarray:
    """The values as an array if they are three finite numbers."""
    array = _array(values)
    if array.shape == (3,) and np.all(np.isfinite(array)):
        return array
    raise InputError(quantity, repr(values), "must be three finite numbers", next_step=next_step)


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
