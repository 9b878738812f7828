# SPDX-License-Identifier: Apache-2.0
"""A table of a text file: its values, and, only where there is a fault, its lines one by one."""

import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import count
from pathlib import Path

import numpy as np

from ...files import open_regular
from ..columns import Column
from ..recording import Note
from .plain_numbers import PlainNumbers, RowFormat, plain_numbers
from .rows import is_missing, is_number
from .text_lines import MAX_LINE_CHARS, Encoding, ambiguous_sign, check_samples, long_line, search_fault, split_cells

_CHUNKED_BYTES = 1 << 28  # larger files are parsed in chunks, so that memory holds little more than the used columns


@dataclass(eq=False, kw_only=True)
class TextTable:
    """A table of text, with the interface of ``FileTable``.

    ``begin`` and ``end`` are the bytes of its rows, ``first_row`` is the line of the first; ``headers`` are numbers of
    columns where ``has_header`` is False.
    """

    path: Path
    encoding: Encoding
    delimiter: str
    decimal: str
    headers: list[str]
    units: list[str]
    has_header: bool = True
    comments: list[tuple[int, str]] = field(default_factory=list)
    preamble: Sequence[Sequence[str]] = ()
    title: list[str] = field(default_factory=list)
    name: str = ""
    first_row: int = 1
    begin: int = 0
    end: int | None = None
    notes: list[Note] = field(default_factory=list)
    text_columns: frozenset[int] = frozenset()
    clock_columns: frozenset[int] = frozenset()

    def __post_init__(self):
        """A column with times of a clock is in seconds."""
        self.units = ["s" if k in self.clock_columns else unit for k, unit in enumerate(self.units)]

    def cells(self, line: str) -> list[str]:
        """The cells of one line without comment and surrounding blanks."""
        return split_cells(line, self.delimiter)

    def is_value(self, cell: str, index: int) -> bool:
        """Whether a cell can be a value of a column: a time of a clock in columns of such times only."""
        return is_missing(cell) or (is_number(cell) and (":" not in cell or index in self.clock_columns))

    def place(self, row: int) -> str:
        """The place of a row of data: file and line."""
        number = next(number for at, (number, _) in enumerate(self.data_lines()) if at == row)
        return f"{self.path}, line {number}"

    def data_lines(self) -> Iterator[tuple[int, list[str]]]:
        """Each line of data as its number in the file, from 1, and its cells. Slow; used to locate a fault."""
        for number, _, line in self._lines(self.begin, self.first_row):
            if cells := self.cells(line):
                yield number, cells

    def all_lines(self) -> Iterator[tuple[int, int, str]]:
        """Each line of the file: number, first byte, text."""
        return self._lines(self.encoding.mark, 1, whole=True)

    def _lines(self, begin: int, first: int, whole: bool = False) -> Iterator[tuple[int, int, str]]:
        with open_regular(self.path) as binary:
            binary.seek(begin)
            text = io.TextIOWrapper(binary, encoding=self.encoding.name, errors=self.encoding.errors, newline="")
            for number in count(first):
                line = text.readline(MAX_LINE_CHARS + 1)
                if not line or (self.end is not None and begin >= self.end and not whole):
                    return
                if len(line) > MAX_LINE_CHARS:
                    raise long_line(self.path, number)
                yield number, begin, line
                begin += self._bytes_of(line)

    def _bytes_of(self, text: str) -> int:
        plain = text.isascii() and not self.encoding.name.startswith("utf-16")
        return len(text) if plain else len(text.encode(self.encoding.name, self.encoding.errors))

    @property
    def is_large(self) -> bool:
        """Whether the values are read in chunks, only when they are used."""
        return self.path.stat().st_size >= _CHUNKED_BYTES

    def first_cells(self) -> list[str]:
        """The cells of the first row."""
        return next((cells for _, cells in self.data_lines()), [])

    def texts(self, index: int) -> list[str]:
        """The cells of a column."""
        return [cells[index] if index < len(cells) else "" for _, cells in self.data_lines()]

    def from_row(self, number: int) -> "TextTable | None":
        """The table without the lines above the one with this number; None if it ends before."""
        for line, offset, text in self._lines(self.begin, self.first_row):
            if line >= number and self.cells(text):
                return replace(self, begin=offset, first_row=line)
        return None

    def fault(self, columns: Mapping[str, Column]) -> bool:
        """Whether the last line is truncated. Raises InputError for the first line with text or other cells."""
        return search_fault(self, columns)

    def parses(self) -> bool:
        """Whether every line to the end is a row of numbers; a large file is not parsed for this."""
        return self.is_large or self._plain is not None

    def numbers(self, columns: Mapping[str, Column]) -> tuple[dict[str, np.ndarray], str, bool]:
        """The columns' values, the file's SHA-256, and whether every row certainly has as many cells as the header.

        Rows of plain numbers are read fast. If there is anything else in the file, pandas reads only the used columns,
        and accepts comments. Raises InputError.
        """
        plain = None if self.is_large else self._plain
        if plain and all(column.index in plain for column in columns.values()):
            for column in columns.values():
                if column.index in plain.grouped:
                    raise ambiguous_sign(column, self.decimal, self.path)
            return {q: plain[column.index] for q, column in columns.items()}, plain.sha256, True
        from .mixed_text import mixed_columns  # late, as few files need it

        return mixed_columns(self, columns)

    @cached_property
    def _plain(self) -> PlainNumbers | None:
        """The columns of numbers of a file that has nothing else; None if a line is not a row of numbers."""
        if self.clock_columns:
            return None
        used = [k not in self.text_columns for k in range(len(self.headers))]
        rows = RowFormat(begin=self.begin, end=self.end, encoding=self.encoding.name, delimiter=self.delimiter,
                         decimal=self.decimal, used=used)  # fmt: skip
        found = plain_numbers(self.path, rows)
        if found is not None:
            check_samples(len(found), self.path)
        return found
