# SPDX-License-Identifier: Apache-2.0
"""What is given for the members of a batch: a number for each, whole motions, and which members are meant."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError

_EACH = "Give a number for each member, or one for all."


def whole_number(quantity: str, value: Any, low: int, next_step: str = "") -> int:
    """The value if it is a whole number, no less than ``low``."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise InputError(quantity, repr(value)[:60], "not a whole number", next_step=next_step or f"Give {low}.")
    if value < low:
        raise InputError(quantity, value, f"below {low}", next_step=next_step or f"Give {low}.")
    return int(value)


def numbers(quantity: str, values: Any, next_step: str = _EACH) -> np.ndarray:
    """The values as real numbers, if rows of them are of one length."""
    try:
        found = np.asarray(values)
    except ValueError:
        raise InputError(quantity, "rows of different lengths", "no array", next_step=next_step) from None
    if found.dtype.kind not in "biuf":
        raise InputError(quantity, repr(values)[:60], "not real numbers", next_step=next_step)
    return np.ascontiguousarray(found, dtype=float) if found.ndim else found.astype(float)


def one_each(quantity: str, values: ArrayLike, n: int) -> np.ndarray:
    """An array (n,) of what is given for each member, or for all."""
    given = numbers(quantity, values)
    if given.ndim == 0:
        return np.full(n, given)
    if given.shape != (n,):
        raise InputError(f"the shape of {quantity}", given.shape, f"not ({n},), that of the batch", next_step=_EACH)
    return given


def motions(depths: ArrayLike, n: int) -> np.ndarray:
    """Depths (steps, n) of whole motions."""
    given = numbers("depths", depths, "Give (steps, n); let a shorter motion end with its last depth.")
    if given.ndim != 2 or given.shape[1] != n:
        raise InputError(
            "the shape of depths", given.shape, f"not (steps, {n})", next_step="Give a column for each member."
        )
    return given


def times(dt: ArrayLike, steps: int) -> np.ndarray:
    """The time of each step (steps,) from one for each, or one for all."""
    given = numbers("dt", dt, "Give a number for each step, or one for all.")
    if given.shape not in ((), (steps,)):
        raise InputError(
            "the shape of dt", given.shape, f"not ({steps},), one time for each step",
            next_step="Members with another dt are moved by step().",
        )  # fmt: skip
    return np.ascontiguousarray(np.broadcast_to(given, (steps,)))


def places(members: Sequence[int] | np.ndarray, n: int) -> np.ndarray:
    """Places of members from their numbers, or from a mask (n,)."""
    given = np.atleast_1d(np.asarray(members)) if np.ndim(members) < 2 else np.array("rows")
    if given.dtype == bool:
        if given.shape != (n,):
            raise InputError(
                "the length of members", given.size, f"not that of the batch, {n}", next_step="Give True or False each."
            )
        return np.flatnonzero(given)
    if given.size and given.dtype.kind not in "iu":
        raise InputError(
            "members", repr(members)[:60], "neither places nor a mask",
            next_step=f"Give whole numbers from 0 to {n - 1}, or a mask.",
        )  # fmt: skip
    for i in given[(given < 0) | (given >= n)] if given.size else ():
        raise InputError("member", int(i), f"not between 0 and {n - 1}", next_step="Count members from 0.")
    return np.ascontiguousarray(given, dtype=np.int64)
