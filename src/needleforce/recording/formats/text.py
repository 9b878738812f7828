# SPDX-License-Identifier: Apache-2.0
"""Tables of a text file, as instruments and scripts write them: encoding, delimiter, decimal sign, what stands above a
table, and several tables one below the other."""

import io
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

from ...errors import InputError
from ...files import check_count, open_regular
from ..stated import stating_lines
from ..table import Table
from .arrays import MAX_COLUMNS
from .rows import (
    MIN_ROWS,
    WHITESPACE,
    Block,
    bare,
    blocks,
    decimal_sign,
    has_key,
    is_missing,
    is_number,
    is_unit_row,
    number_of,
)
from .text_blocks import all_tables, without_summary
from .text_rows import MAX_LINE_CHARS, Encoding, long_line, split_cells
from .text_values import TextValues

_MAX_HEADER_CHARS = 256  # of one column
_HEAD_BYTES = (1 << 12, 1 << 16, 1 << 20)  # in which the first table begins: no more than needed
_HEAD_LINES = 20_000
_SAMPLE_LINES = 200  # of a later table, which show its columns
_NAMED_VALUE = re.compile(r"[^\W\d_][\w\])]{0,20} ?[=:] {0,8}[+-]?[.\d]")
_NO_NAMES = frozenset("vs versus of and the in at with for from to und von der die das et de la".split())
_STATING_LINES = 256  # above a table, that may state a rate, a speed or a unit
_DELIMITERS = ("\t", ";", ",", "|", WHITESPACE)
_ENCODINGS = ((b"\xff\xfe", "utf-16-le"), (b"\xfe\xff", "utf-16-be"), (b"\xef\xbb\xbf", "utf-8"))
_EXPORT = "Export the recording as CSV, or another table of text."


def tables(path: Path) -> list[Table]:
    """The tables of a text file, those with at least 20 rows or the longest.

    Raises InputError for a file that is not text or has no row of numbers.
    """
    for size in _HEAD_BYTES:
        encoding, lines, complete = _head(path, size)
        if any(_NAMED_VALUE.search(line) for line in lines[-2:]):
            from . import key_values

            if names := key_values.common_names(lines):
                return [key_values.table(path, encoding, names)]
        chosen = _delimited(lines)
        if complete or (chosen and _reaches_the_end(chosen.blocks, lines)):
            break
    if chosen is None:
        raise _no_table(path, lines)
    first = without_summary(_table(path, encoding, lines, chosen))
    if len(chosen.blocks) == 1 and first.parses():
        return [first.table()]
    found = all_tables(first, lambda above: _table_in(path, first.encoding, above))
    if len(found) > 1:
        return [each.table() for each in found]
    ends = [each.end for each in found if first.end is None and each.end is not None and each.end > first.begin]
    # a table that ends before it begins is another one
    return [(replace(first, end=ends[0]) if ends else first).table()]


def _longest(found: Sequence[Block]) -> Block:
    return max(found, key=lambda each: each.stop - each.first)


def _reaches_the_end(found: Sequence[Block], lines: Sequence[str]) -> bool:
    """Whether the longest table goes beyond the lines and has enough rows to be no setting or result."""
    block = _longest(found)
    return block.stop == len(lines) and block.stop - block.first >= MIN_ROWS


def _head(path: Path, size: int) -> tuple[Encoding, list[str], bool]:
    """The encoding of a file, its first complete lines, and whether these are all."""
    with open_regular(path) as file:
        try:
            start = file.read(size + 1)
        except OSError as error:
            step = "Check the disk or the network, or copy the file."
            raise InputError("file", "not readable", error.strerror or "", str(path), step) from None
    encoding = _encoding(start, path)
    complete = len(start) <= size
    text = start[encoding.mark :].decode(encoding.name, encoding.errors)
    lines = list(io.StringIO(text, newline=""))
    for number, line in enumerate(lines, 1):
        if len(line) > MAX_LINE_CHARS:
            raise long_line(path, number)
    if len(lines) > _HEAD_LINES:
        return encoding, lines[:_HEAD_LINES], False
    return encoding, lines if complete else lines[:-1], complete


def _encoding(start: bytes, path: Path) -> Encoding:
    """UTF-8 or UTF-16 with or without a mark, otherwise Latin-1. Raises InputError for a file that is no text."""
    for mark, name in _ENCODINGS:
        if start.startswith(mark):
            return Encoding(name=name, mark=len(mark))
    if b"\0" in start:
        high, low = start[0::2].count(0), start[1::2].count(0)
        if max(high, low) > 0.4 * len(start) and min(high, low) < 0.01 * len(start):
            return Encoding(name="utf-16-be" if high > low else "utf-16-le")
        raise InputError("file", "binary, of no known format", "a recording is needed", str(path), _EXPORT)
    return unmarked_encoding(start[: start.rfind(b"\n") + 1 or None])


def unmarked_encoding(text: bytes) -> Encoding:
    """UTF-8 where the text is that, otherwise Latin-1."""
    try:
        text.decode("utf-8")
    except UnicodeDecodeError:
        return Encoding(name="latin-1")
    return Encoding(name="utf-8")


def _no_table(path: Path, lines: Sequence[str]) -> InputError:
    """The error for a file without rows of numbers."""
    if not any(line.strip() and not line.lstrip().startswith("#") for line in lines):
        return InputError("file", "empty", "rows of numbers are needed", str(path), _EXPORT)
    rows = [line for line in lines if any(is_number(word) for word in re.split(r"[\s,;|]+", line))]
    if len(rows) == 1:
        step = "Check that the recording is complete."
        return InputError("number of samples", 1, "at least 2 are needed", str(path), step)
    if rows:
        return InputError("table", "missing", "there are numbers, but not in common columns", str(path), _EXPORT)
    joined = next((number for number, line in enumerate(lines, 1) if any(each.isdigit() for each in line)), None)
    if joined:  # not quoted, as the file may be a private one
        limit = "cells that are plain numbers are needed, those with digits are joined with text"
        return InputError("table", "missing", limit, f"{path}, line {joined}", _EXPORT)
    step = "Record again, or check that the export was complete."
    return InputError("number of samples", 0, "the file ends after its header", str(path), step)


@dataclass(frozen=True, kw_only=True)
class _Layout:
    """How lines are separated into cells, the cells of each, and the tables in them."""

    delimiter: str
    decimal: str
    rows: list[list[str]]
    blocks: list[Block]

    @property
    def longest(self) -> Block:
        return _longest(self.blocks)

    def is_sure(self) -> bool:
        """Whether most lines are one table of several columns, all of numbers."""
        block = self.longest
        plain = block.numeric > 1 and not block.text_columns and not block.short_header
        return plain and 2 * (block.stop - block.first) >= len(self.rows)


def _delimited(lines: Sequence[str]) -> _Layout | None:
    """Delimiter, decimal sign and tables: of the delimiters that make columns of numbers of most lines, the first with
    several and no other columns, then the first with several."""
    found: list[_Layout] = []
    for delimiter in _DELIMITERS:
        if delimiter != WHITESPACE and not any(delimiter in line for line in lines):
            continue
        rows = [split_cells(line, delimiter) for line in lines]
        if each := blocks(rows):
            decimal = "." if delimiter == "," else decimal_sign(cell for row in rows[:500] for cell in row)
            each = [_without_stray(block) for block in each]
            found.append(_Layout(delimiter=delimiter, decimal=decimal, rows=rows, blocks=each))
            if found[-1].is_sure():
                break
    rows = max((each.longest.stop - each.longest.first for each in found), default=0)

    def fitness(each: _Layout) -> tuple[bool, ...]:
        block = each.longest
        large = block.stop - block.first >= 0.5 * rows
        return large, block.numeric > 1, not block.short_header, not block.text_columns

    return max(found, key=fitness, default=None)  # the first of equals


def _without_stray(block: Block) -> Block:
    """The table without the columns beyond an empty one that have no header: they need not be in every row."""
    width = block.width - block.stray
    return replace(block, width=width, headers=block.headers[:width], units=block.units[:width])


def _table(path: Path, encoding: Encoding, lines: Sequence[str], layout: _Layout) -> TextValues:
    """The longest table in ``lines``, to the end of the file."""
    block, delimiter = layout.longest, layout.delimiter
    # which column has no name cannot be known, but for numbers of rows
    headers = _with_row_numbers(block, lines, layout) if block.short_header else block.headers
    headers = headers or _commented_headers(lines[: block.first], delimiter, block.width)
    units = [] if block.short_header else block.units
    units = units or _commented_units(lines[: block.first], delimiter, block.width)
    if not headers and block.first:
        from .named_columns import named_columns  # late, as few files need it

        rows = layout.rows[block.first : min(block.stop, block.first + _SAMPLE_LINES)]
        rises = _rises([number_of(row[0], layout.decimal) for row in rows if row])
        headers, named_units = named_columns(lines[: block.first], delimiter, block.width, first_rises=rises)
        units = named_units or units
    headers = headers or _other_headers(lines[: block.first], block.width)
    _check_columns(headers, block.width, path)
    above = "".join(lines[: block.first])
    sample = layout.rows[block.first : min(block.stop, block.first + _SAMPLE_LINES)]
    return TextValues(
        path=path,
        encoding=encoding,
        delimiter=delimiter,
        decimal=layout.decimal,
        headers=headers or [str(k + 1) for k in range(block.width)],
        units=units,
        has_header=bool(headers),
        comments=_comments(lines[: block.first]),
        preamble=(stating_lines(lines[max(0, block.first - _STATING_LINES) : block.first]),),
        first_row=block.first + 1,
        begin=encoding.mark + len(above.encode(encoding.name, encoding.errors)),
        text_columns=block.text_columns,
        clock_columns=_clocks(sample),
    )


def _comments(lines: Sequence[str]) -> list[tuple[int, str]]:
    marked = ((number, line.lstrip().rstrip("\r\n")) for number, line in enumerate(lines, 1))
    return [(number, text[1:].removeprefix(" ")) for number, text in marked if text.startswith("#")]


def _rises(values: Sequence[float]) -> bool:
    """Whether every value is larger than the one before, as times are."""
    return all(one < other for one, other in pairwise(values))


def _with_row_numbers(block: Block, lines: Sequence[str], layout: _Layout) -> list[str]:
    """Headers of which that of the numbers of the rows is absent, as R writes them; none of another table."""
    first = [row[0] for row in layout.rows[block.first : block.stop] if row][:_SAMPLE_LINES]
    numbered = first in ([str(k + start) for k in range(len(first))] for start in (0, 1))
    apart = layout.delimiter == WHITESPACE or lines[block.first].lstrip().startswith('"')  # no number cut in two
    return ["row", *block.short_header] if block.short_header and numbered and apart else []


def _commented_headers(lines: Sequence[str], delimiter: str, width: int) -> list[str]:
    """Headers as NumPy writes them: the last comment, or the one above it if that has units, with a cell a column."""
    comments = [list(split_cells(text, delimiter)) for _, text in _comments(lines)]
    if len(comments) > 1 and is_unit_row(comments[-1]) and len(comments[-2]) == width:
        comments.pop()
    cells = comments[-1] if comments else []
    names = not any(is_number(cell) or cell.endswith((":", "=")) or cell.casefold() in _NO_NAMES for cell in cells)
    return cells if len(cells) == width and width > 1 and names else []


def _commented_units(lines: Sequence[str], delimiter: str, width: int) -> list[str]:
    """The units of a row that begins with ``#`` because the first column is a number of readings; else none."""
    last = next((line.strip() for line in reversed(lines) if line.strip()), "")
    cells = [cell.strip() for cell in last.split(None if delimiter == WHITESPACE else delimiter)]
    if last.startswith("#") and len(cells) == width and is_unit_row(cells):
        return ["" if cell == "#" else bare(cell) for cell in cells]
    return [""] * width


def _other_headers(lines: Sequence[str], width: int) -> list[str]:
    """Headers that another delimiter separates than the numbers, in the last line above."""
    last = next((line for line in reversed(lines) if line.strip()), "")
    for split in (*(lambda text, mark=mark: split_cells(text, mark) for mark in _DELIMITERS),
                  lambda text: re.split(r"\s{2,}|\t", text.strip().lstrip("# "))):  # fmt: skip
        cells = list(split(last))
        if len(cells) == width > 1 and not any(is_number(c) or is_missing(c) for c in cells) and not has_key(cells):
            return cells
    return []


def _check_columns(headers: Sequence[str], width: int, path: Path) -> None:
    """Raise InputError for more or longer headers than any table has."""
    check_count("columns", width, MAX_COLUMNS, path)
    longest = max(headers, key=len, default="")
    if len(longest) > _MAX_HEADER_CHARS:
        limit, step = f"at most {_MAX_HEADER_CHARS} characters", "Rename the column."
        raise InputError("header", f"one of {len(longest)} characters", limit, str(path), step)


def _clocks(rows: Sequence[Sequence[str]]) -> frozenset[int]:
    """The columns with times of a clock."""
    return frozenset(k for row in rows for k, cell in enumerate(row) if ":" in cell and is_number(cell))


def _table_in(path: Path, encoding: Encoding, lines: Sequence[str]) -> TextValues | None:
    """The table in some lines of a file; None if its numbers are in no common columns."""
    chosen = _delimited(lines)
    return None if chosen is None else _table(path, encoding, lines, chosen)
