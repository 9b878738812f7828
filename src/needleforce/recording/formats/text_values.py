# SPDX-License-Identifier: Apache-2.0
"""The values of a table of text: rows of plain numbers, as most recordings have, are parsed by the core and hashed, in
two threads; others are read by pandas."""

import hashlib
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property, reduce
from operator import or_

import numpy as np

from ... import core
from ...files import MAX_SAMPLES, check_count, digest, open_regular
from ..table import Table
from .rows import NO_VALUE, WHITESPACE
from .text_rows import TextRows, ambiguous_sign

_WHOLE_AND_GROUPED = 3  # looks of a column: whole numbers below 1000, and such with a sign before three digits
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


@dataclass(eq=False, kw_only=True)
class TextValues(TextRows):
    """The rows of a table of text, with their values."""

    def table(self) -> Table:
        """The table of these rows."""
        return Table(path=self.path, lines=self, headers=self.headers, units=self.units, name=self.name,
                     comments=self.comments, preamble=self.preamble, decimal=self.decimal, notes=self.notes,
                     first_row=self.first_row, has_header=self.has_header, text_columns=self.text_columns)  # fmt: skip

    def parses(self) -> bool:
        """Whether every line to the end is a row of numbers; a large file is not parsed for this."""
        return self.is_large or self._plain is not None

    def numbers(self, columns: Sequence[int]) -> tuple[list[np.ndarray], bool]:
        """The values of columns, and whether every row certainly has as many cells as the header.

        Rows of plain numbers are read fast. If there is anything else in the file, pandas reads only the used columns,
        and accepts comments. Raises InputError.
        """
        plain = None if self.is_large else self._plain
        if plain and all(column in plain for column in columns):
            for column in columns:
                if column in plain.grouped:
                    raise ambiguous_sign(self.headers[column], self.decimal, self.path)
            return [plain[column] for column in columns], True
        from .mixed_text import mixed_columns  # late, as few files need it

        return mixed_columns(self, columns)

    def digest(self) -> str:
        """SHA-256 of the file."""
        plain = None if self.is_large else self._plain
        return plain.sha256 if plain else digest(self.path)

    @cached_property
    def _plain(self) -> PlainNumbers | None:
        """The columns of numbers of a file that has nothing else; None if a line is not a row of numbers."""
        found = None if self.clock_columns else plain_numbers(self)
        if found is not None:
            check_count("samples", len(found), MAX_SAMPLES, self.path)
        return found


def plain_numbers(rows: TextRows) -> PlainNumbers | None:
    """Read every row of numbers, exact to the last bit; None if a line is anything else, or has surplus cells.

    Words for no value are NaN, and so are the cells that several of the last rows lack. A row that lacks cells in the
    middle, or the last one alone, is not read: its values may belong to other columns, or be truncated.
    """
    with open_regular(rows.path) as file:
        data = file.read()
    text, begin, end = _utf8(data, rows)
    cut = text.rfind(b"\n", begin, begin + (end - begin) // _SHARE_OF_SECOND) + 1
    if len(data) < _THREADED_BYTES or cut <= begin:
        parts, sha256 = [_parsed(text, begin, end, rows)], _sha256(data)
    else:
        with ThreadPoolExecutor(1) as second:
            hashed, first = second.submit(_sha256, data), second.submit(_parsed, text, begin, cut, rows)
            parts = [_parsed(text, cut, end, rows)]
            parts, sha256 = [first.result(), *parts], hashed.result()
    columns = {int(index): k for k, index in enumerate(np.flatnonzero(rows.used))}
    if any(part is None for part in parts):
        return None
    values, short, looks = zip(*parts)
    if sum(short) == 1 or (sum(short) and rows.delimiter == WHITESPACE) or (len(parts) > 1 and short[0]):
        return None
    seen = [reduce(or_, each) for each in zip(*looks)]
    grouped = frozenset(k for k, each in enumerate(seen) if each == _WHOLE_AND_GROUPED)
    return PlainNumbers(values, columns, sha256, grouped)


def _utf8(data: bytes, rows: TextRows) -> tuple[bytes, int, int]:
    """The text of the rows, and its first and last byte."""
    end = len(data) if rows.end is None else rows.end
    if not rows.encoding.name.startswith("utf-16"):
        return data, rows.begin, end
    text = data[rows.begin : end].decode(rows.encoding.name, "replace").encode()
    return text, 0, len(text)


def _parsed(text: bytes, begin: int, end: int, rows: TextRows) -> tuple[np.ndarray, int, bytes] | None:
    delimiter = "" if rows.delimiter == WHITESPACE else rows.delimiter
    return core.number_rows(text, begin, end, delimiter, rows.decimal, used=rows.used, words=NO_VALUE)


def _sha256(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
