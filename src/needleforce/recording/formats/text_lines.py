# SPDX-License-Identifier: Apache-2.0
"""Lines of a text file: their encoding, their cells, and the search for one that is no row of a table."""

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from ...errors import InputError
from ...files import MAX_SAMPLES
from ..columns import Column
from .rows import is_missing, is_number

WHITESPACE = r"\s+"
MAX_LINE_CHARS = 1 << 16
_BLANKS = re.compile(r"[+-]?\d{1,3}(?: \d{3})+")
_UNGROUPED = "Save the file without signs of thousands."
_COMMENT = re.compile(r"(?<![^\s,;\t])#(?!N/A|DIV|VALUE|NUM|REF|NULL|NAME)")


@dataclass(frozen=True)
class Encoding:
    """The encoding of a text file by Python's name, and the bytes of its mark."""

    name: str
    mark: int = 0

    @property
    def errors(self) -> str:
        """How undecodable bytes are kept, so that the text has as many bytes again."""
        return "surrogateescape" if self.name == "utf-8" else "replace"  # which has two bytes in UTF-16, too


class TextRows(Protocol):
    """How the rows of a table are written, and its lines; see ``TextTable``."""

    path: Path
    encoding: Encoding
    delimiter: str
    decimal: str
    headers: list[str]
    has_header: bool
    begin: int
    end: int | None
    clock_columns: frozenset[int]
    text_columns: frozenset[int]

    def data_lines(self) -> Iterator[tuple[int, list[str]]]:
        """Each line of data as its number in the file, from 1, and its cells."""
        ...

    def place(self, row: int) -> str:
        """The place of a row of data: file and line."""
        ...

    def texts(self, index: int) -> list[str]:
        """The cells of a column."""
        ...

    def is_value(self, cell: str, index: int) -> bool:
        """Whether a cell can be a value of a column."""
        ...


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


def check_samples(count: int, path: Path) -> None:
    """Raise InputError for more samples than a recording can have."""
    if count > MAX_SAMPLES:
        limit = f"at most {MAX_SAMPLES} are read: nine hours at 1 kHz"
        raise InputError("number of samples", f"over {MAX_SAMPLES}", limit, str(path), "Split the file.")


def ambiguous_sign(column: Column, decimal: str, path: Path) -> InputError:
    """The error for a column with ``999`` and ``1.000``, which may be a thousand."""
    limit = f"numbers such as 999 and 1{decimal}000 are in it, which may be one or one thousand"
    step = "Save the file without signs of thousands, or with as many decimals in every row."
    return InputError(f"{column.quantity} (column {column.header!r})", "ambiguous", limit, str(path), step)


def search_fault(table: TextRows, columns: Mapping[str, Column]) -> bool:
    """Raise InputError for the first line with text or a wrong number of cells; return whether the last line is
    truncated."""
    pending, cells = None, []
    for number, cells in table.data_lines():
        if pending:
            raise pending
        place = f"{table.path}, line {number}"
        if len(cells) != len(table.headers):
            pending = _wrong_count(table, cells, place)
        for column in columns.values():
            if column.index < len(cells) and not table.is_value(cells[column.index], column.index):
                value, limit = repr(cells[column.index][:40]), "a number is needed"
                step = _UNGROUPED if _BLANKS.match(cells[column.index]) else "Correct or remove the line."
                raise InputError(f"{column.quantity} (column {column.header!r})", value, limit, place, step)
    if pending and len(cells) > len(table.headers):
        raise pending
    return pending is not None


def _wrong_count(table: TextRows, cells: Sequence[str], place: str) -> InputError:
    advice = "With decimal commas, separate the columns by semicolons." if table.delimiter == "," else ""
    limit = f"the {'header' if table.has_header else 'first row'} has {len(table.headers)}"
    return InputError("number of cells", len(cells), limit, place, f"Correct or remove the line. {advice}".strip())
