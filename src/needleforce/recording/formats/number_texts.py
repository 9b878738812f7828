# SPDX-License-Identifier: Apache-2.0
"""Numbers as texts: signs of thousands, exponents of Fortran, and the decimal sign of each column, as all of its cells
show it."""

import re
from collections.abc import Mapping, Sequence

import numpy as np

from .rows import NOT_FINITE, NUMBER_WITH, SIGNS, is_missing, number_of

_WHOLE_OR_THREE = re.compile(r"[+-]?(?:\d{1,3}|[1-9]\d{0,2}[.,]\d{3})")


class UnclearSign(ValueError):
    """A column whose sign may be decimal or one of thousands; ``index`` is the column."""

    def __init__(self, index: int):
        super().__init__(index)
        self.index = index


class NoNumber(ValueError):
    """A cell that is no number as the other cells of its column are; ``index`` is the column, ``row`` the row."""

    def __init__(self, index: int, row: int):
        super().__init__(index, row)
        self.index, self.row = index, row


def numbers_of(columns: Mapping[int, Sequence[str]], decimal: str) -> dict[int, np.ndarray]:
    """The numbers of columns of texts, NaN where there is none.

    Parameters
    ----------
    columns : mapping
        Index of a column -> its (n,) cells.
    decimal : str
        The decimal sign of the table, for errors.

    Returns
    -------
    dict
        Index -> (n,) numbers. The decimal sign of a column is the one with which all of its cells are numbers. If both
        are possible it is that of the other columns, if the cells then show which sign is one of thousands.

    Raises
    ------
    UnclearSign
        Cells such as ``1,000`` alone, or ``999`` and ``1.000``, in which the sign may be one of thousands.
    NoNumber
        A cell is no number, or has another decimal sign than the others.
    """
    cells = {k: [each.strip() for each in texts] for k, texts in columns.items()}
    fitting = {k: [sign for sign in SIGNS if _first_other(texts, sign) is None] for k, texts in cells.items()}
    known = {found[0] for found in fitting.values() if len(found) == 1}
    return {k: _column(k, texts, fitting[k], known, decimal) for k, texts in cells.items()}


def _column(index: int, texts: Sequence[str], fitting: Sequence[str], known: set[str], decimal: str) -> np.ndarray:
    if not fitting:
        rows = [_first_other(texts, sign) for sign in SIGNS]
        raise NoNumber(index, rows[SIGNS.index(decimal)])
    if len(fitting) == 1:
        return _values(texts, fitting[0])
    one, other = (_values(texts, sign) for sign in fitting)
    if np.array_equal(one, other, equal_nan=True):
        return one
    sign = next(iter(known)) if len(known) == 1 else ""
    used = [text for text in texts if not is_missing(text)]
    with_known = any(sign in text for text in used)
    # another sign than that of the other columns is one of thousands if smaller numbers lack it
    plain = with_known or not all(any(each in text for each in SIGNS) for text in used)
    if not sign or not plain or (with_known and may_be_grouped(texts)):
        raise UnclearSign(index)
    return one if sign == fitting[0] else other


def may_be_grouped(cells: Sequence[str]) -> bool:
    """Whether cells are whole numbers below 1000 and numbers with a sign before three digits, and nothing else."""
    used = [cell for cell in cells if not is_missing(cell)]
    signs = [any(sign in cell for sign in SIGNS) for cell in used]
    return any(signs) and not all(signs) and all(map(_WHOLE_OR_THREE.fullmatch, used))


def _first_other(texts: Sequence[str], decimal: str) -> int | None:
    """The row of the first cell that is no number with this decimal sign, None without one."""
    of_number = NUMBER_WITH[decimal].fullmatch
    rows = (k for k, text in enumerate(texts) if not of_number(text))
    return next((k for k in rows if not is_missing(texts[k]) and not NOT_FINITE.fullmatch(texts[k])), None)


def _values(texts: Sequence[str], decimal: str) -> np.ndarray:
    return np.array([number_of(text, decimal) for text in texts])
