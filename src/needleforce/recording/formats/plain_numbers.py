# SPDX-License-Identifier: Apache-2.0
"""Rows of plain numbers in a file of text, as most recordings are: parsed by the core and hashed, in two
threads."""

import hashlib
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import reduce
from operator import or_
from pathlib import Path

import numpy as np

from ... import core
from ...files import open_regular
from .rows import MISSING, WHITESPACE

_WHOLE_AND_GROUPED = 3  # looks of a column: whole numbers below 1000, and such with a sign before three digits
NO_VALUE = sorted({word for each in MISSING for word in (each, each.upper(), each.capitalize())} - {""})
_THREADED_BYTES = 1 << 17  # below which a second thread costs more than it saves
_SHARE_OF_SECOND = 4  # it parses a quarter, because it computes the digest first, which takes half as long as parsing


@dataclass(frozen=True, eq=False)
class PlainNumbers:
    """The columns of numbers of a table, in parts of consecutive rows, and the SHA-256 of the file; ``grouped`` are
    those in which a sign may be one of thousands: ``999`` and ``1.000``."""

    parts: tuple[np.ndarray, ...]
    columns: dict[int, int]
    sha256: str
    grouped: frozenset[int]

    def __len__(self) -> int:
        """The number of rows."""
        return sum(part.shape[1] for part in self.parts)

    def __contains__(self, index: int) -> bool:
        """Whether a column of the table is one of numbers."""
        return index in self.columns

    def __getitem__(self, index: int) -> np.ndarray:
        """A column of the table, (n,), as a copy."""
        return np.concatenate([part[self.columns[index]] for part in self.parts])


@dataclass(frozen=True, kw_only=True)
class RowFormat:
    """How the rows of a file are written; ``begin`` and ``end`` are their bytes, ``used`` whether each column has
    numbers."""

    begin: int
    end: int | None
    encoding: str
    delimiter: str
    decimal: str
    used: Sequence[bool]


def plain_numbers(path: Path, rows: RowFormat) -> PlainNumbers | None:
    """Read every row of numbers, exact to the last bit; None if a line is anything else, or has surplus cells.

    Words for no value are NaN, and so are the cells that several of the last rows lack. A row that lacks cells in the
    middle, or the last one alone, is not read: its values may belong to other columns, or be truncated.
    """
    with open_regular(path) as file:
        data = file.read()
    text, begin, end = _utf8(data, rows)
    cut = text.rfind(b"\n", begin, begin + (end - begin) // _SHARE_OF_SECOND) + 1
    if len(data) < _THREADED_BYTES or cut <= begin:
        parts, sha256 = [_parsed(text, begin, end, rows)], _digest(data)
    else:
        with ThreadPoolExecutor(1) as second:
            digest, first = second.submit(_digest, data), second.submit(_parsed, text, begin, cut, rows)
            parts = [_parsed(text, cut, end, rows)]
            parts, sha256 = [first.result(), *parts], digest.result()
    columns = {int(index): k for k, index in enumerate(np.flatnonzero(rows.used))}
    if any(part is None for part in parts):
        return None
    values, short, looks = zip(*parts)
    if sum(short) == 1 or (sum(short) and rows.delimiter == WHITESPACE) or (len(parts) > 1 and short[0]):
        return None
    seen = [reduce(or_, each) for each in zip(*looks)]
    grouped = frozenset(k for k, each in enumerate(seen) if each == _WHOLE_AND_GROUPED)
    return PlainNumbers(values, columns, sha256, grouped)


def _utf8(data: bytes, rows: RowFormat) -> tuple[bytes, int, int]:
    """The text of the rows, and its first and last byte."""
    end = len(data) if rows.end is None else rows.end
    if not rows.encoding.startswith("utf-16"):
        return data, rows.begin, end
    text = data[rows.begin : end].decode(rows.encoding, "replace").encode()
    return text, 0, len(text)


def _parsed(text: bytes, begin: int, end: int, rows: RowFormat) -> tuple[np.ndarray, int, bytes] | None:
    delimiter = "" if rows.delimiter == WHITESPACE else rows.delimiter
    return core.number_rows(text, begin, end, delimiter, rows.decimal, used=rows.used, words=NO_VALUE)


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
