# SPDX-License-Identifier: Apache-2.0
"""The rows of a table of text: encoding, cells of a line, and, only where there is a fault, its lines one by one."""

import csv
import io
import re
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import count
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...files import open_regular
from ..recording import Note
from .rows import WHITESPACE, is_missing, is_number

MAX_LINE_CHARS = 1 << 16
_BLANKS = re.compile(r"[+-]?\d{1,3}(?: \d{3})+")
_UNGROUPED = "Save the file without signs of thousands."
_COMMENT = re.compile(r"(?<![^\s,;\t])#(?!N/A|DIV|VALUE|NUM|REF|NULL|NAME)")
_CHUNKED_BYTES = 1 << 28  # larger files are parsed in chunks, so that memory holds little more than the used columns


@dataclass(frozen=True)
class Encoding:
    """The encoding of a text file by Python's name, and the bytes of its mark."""

    name: str
    mark: int = 0

    @property
    def errors(self) -> str:
        """How undecodable bytes are kept, so that the text has as many bytes again."""
        return "surrogateescape" if self.name == "utf-8" else "replace"  # which has two bytes in UTF-16, too


@dataclass(eq=False, kw_only=True)
class TextRows(ABC):
    """The rows of a table of text, and what stands above them; ``TextValues`` reads their values.

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
        """The cells of one line without comment and surrounding blanks, up to an empty one beyond the last column."""
        cells, width = split_cells(line, self.delimiter), len(self.headers)
        return cells[:width] if len(cells) > width and not cells[width] else cells

    def is_value(self, cell: str, index: int) -> bool:
        """Whether a cell can be a value of a column: a time of a clock in columns of such times only."""
        return is_missing(cell) or (is_number(cell) and (":" not in cell or index in self.clock_columns))

    def place(self, row: int) -> str:
        """The place of a row of data: file and line."""
        number = next(number for at, (number, _) in enumerate(self.data_lines()) if at == row)
        return f"{self.path}, line {number}"

    def data_lines(self) -> Iterator[tuple[int, list[str]]]:
        """Each line of data as its number in the file, from 1, and its cells. Slow; used to locate a fault."""
        for number, _, line in self.lines():
            if cells := self.cells(line):
                yield number, cells

    def lines(self) -> Iterator[tuple[int, int, str]]:
        """Each line of data: number in the file, first byte, text."""
        return self._lines(self.begin, self.first_row)

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
    def used(self) -> list[bool]:
        """Whether each column has numbers."""
        return [k not in self.text_columns for k in range(len(self.headers))]

    @property
    def is_large(self) -> bool:
        """Whether the values are read in chunks, only when they are used."""
        return self.path.stat().st_size >= _CHUNKED_BYTES

    def texts(self, index: int) -> list[str]:
        """The cells of a column."""
        return [cells[index] if index < len(cells) else "" for _, cells in self.data_lines()]

    def stated(self, name: str) -> list[str]:
        """What the last comment above each row that begins with a name and a colon states, such as ``# segment: 2``."""
        found, text = [], ""
        for _, begin, line in self.all_lines():
            if self.end is not None and begin >= self.end:
                break
            if line.lstrip().startswith("#"):
                key, colon, value = line.lstrip("# \t").partition(":")
                text = value.strip() if colon and key.strip() == name else text
            elif begin >= self.begin and self.cells(line):
                found.append(text)
        return found

    def from_row(self, number: int) -> "TextRows | None":
        """The rows without the lines above the one with this number; None if it ends before."""
        for line, offset, text in self.lines():
            if line >= number and self.cells(text):
                return replace(self, begin=offset, first_row=line)
        return None

    def fault(self, columns: Sequence[int]) -> bool:
        """Whether the last line is truncated. Raises InputError for the first line with a text in one of the columns,
        or with other cells."""
        pending, cells = None, []
        for number, cells in self.data_lines():
            if pending:
                raise pending
            place = f"{self.path}, line {number}"
            if len(cells) != len(self.headers):
                pending = _wrong_count(self, cells, place)
            for column in columns:
                if column < len(cells) and not self.is_value(cells[column], column):
                    value, limit = repr(cells[column][:40]), "a number is needed"
                    step = _UNGROUPED if _BLANKS.match(cells[column]) else "Correct or remove the line."
                    raise InputError(f"column {self.headers[column]!r}", value, limit, place, step)
        if pending and len(cells) > len(self.headers):
            raise pending
        return pending is not None

    @abstractmethod
    def numbers(self, columns: Sequence[int]) -> tuple[list[np.ndarray], bool]:
        """The values of columns, and whether every row certainly has as many cells as the header."""

    @abstractmethod
    def digest(self) -> str:
        """SHA-256 of the file."""


def split_cells(line: str, delimiter: str) -> list[str]:
    """The cells of a line without surrounding blanks and quotes; none of a blank line and of a comment."""
    text = line.strip("\r\n\x1a\0 ")
    if "#" in text:
        text = _without_comment(text, delimiter)
    if not text:
        return []
    if delimiter == WHITESPACE:
        return [cell.strip('"') for cell in re.split(r"\s+(?![\[(])", text.strip())]
    if '"' not in text:
        return [cell.strip() for cell in text.split(delimiter)]
    return [cell.strip() for cell in next(csv.reader([text], delimiter=delimiter, skipinitialspace=True), [])]


def _without_comment(text: str, delimiter: str) -> str:
    """A line without what follows ``#``, unless that begins a spreadsheet's ``#N/A`` or follows a text in a word or a
    cell, as in ``Load #1 [kN]``."""
    for found in _COMMENT.finditer(text):
        before = text[: found.start()].rstrip()
        cell = (before.split() if delimiter == WHITESPACE else before.split(delimiter))[-1:]
        name = cell[0].strip(' "') if cell else ""
        numbered = delimiter != WHITESPACE or text[found.end() : found.end() + 1].isdigit()
        if not (name and numbered) or is_number(name) or is_missing(name):
            return before
    return text


def long_line(path: Path, number: int) -> InputError:
    """The error for a line that is too long to be of a table."""
    limit = f"at most {MAX_LINE_CHARS} can be read"
    place, step = f"{path}, line {number}", "Correct or remove the line."
    return InputError("characters in the line", f"over {MAX_LINE_CHARS}", limit, place, step)


def ambiguous_sign(header: str, decimal: str, path: Path) -> InputError:
    """The error for a column with ``999`` and ``1.000``, which may be a thousand."""
    limit = f"numbers such as 999 and 1{decimal}000 are in it, which may be one or one thousand"
    step = "Save the file without signs of thousands, or with as many decimals in every row."
    return InputError(f"column {header!r}", "ambiguous", limit, str(path), step)


def _wrong_count(rows: TextRows, cells: Sequence[str], place: str) -> InputError:
    advice = "With decimal commas, separate the columns by semicolons." if rows.delimiter == "," else ""
    limit = f"the {'header' if rows.has_header else 'first row'} has {len(rows.headers)}"
    return InputError("number of cells", len(cells), limit, place, f"Correct or remove the line. {advice}".strip())
