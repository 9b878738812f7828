# SPDX-License-Identifier: Apache-2.0
"""Several tables of a text file, one below the other, each between two rows of text; and rows below a table that are no
samples: a mean, a standard deviation, a peak, as testing machines write them."""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...files import open_regular
from ..quantities import by_name
from ..recording import Note
from .rows import MIN_ROWS, WHITESPACE, is_missing, is_number, number_of
from .text_rows import split_cells
from .text_values import TextValues

_MAX_TABLES = 2000
_MAX_STRETCHES = 20_000  # of numbers between rows of text
_SAMPLE_LINES = 200  # of a table, which show its columns
_TAIL_BYTES = 1 << 13  # at the end of a file, in which a summary is
_ABOVE_LINES = 8  # above a table, in which its headers are


def _is_text(line: str, table: TextValues, first_number: re.Pattern[str]) -> bool:
    """Whether a line has no number, and is neither blank nor a comment that names no columns."""
    if first_number.match(line) or not line.strip():
        return False
    if line.lstrip().startswith("#"):
        return _names_columns(split_cells(line.strip().lstrip("# "), table.delimiter), len(table.headers))
    cells = split_cells(line, table.delimiter)
    used = [cell for cell in cells if not is_missing(cell)]
    return bool(used) and not any(map(is_number, used))


def _names_columns(cells: Sequence[str], width: int) -> bool:
    """Whether the cells of a comment are headers: one for each column, two or more of quantities of a recording."""
    named = sum(by_name(cell) is not None for cell in cells)
    return len(cells) == width > 1 and named > 1 and not any(map(is_number, cells))


def all_tables(like: TextValues, table_in: Callable[[Sequence[str]], TextValues | None]) -> list[TextValues]:
    """Every table of a file, each between two rows of text.

    Parameters
    ----------
    like : TextValues
        The first or longest table, with the encoding, delimiter and what stands above.
    table_in : callable
        Lines of the file -> the table in them, None without one.

    Returns
    -------
    list of TextValues
        Those with at least 20 rows, or as many as the longest.

    Raises
    ------
    InputError
        More than any instrument writes.
    """
    parts: list[_Stretch] = []
    longest = 2
    for count, part in enumerate(_stretches(like), 1):
        longest = max(longest, part.rows)
        parts += [part] if part.rows >= min(MIN_ROWS, longest) else []
        if count > _MAX_STRETCHES:
            raise _too_many("number of rows of text between rows of numbers", count, _MAX_STRETCHES, like.path)
    parts = [part for part in parts if part.rows >= min(longest, MIN_ROWS)]
    if len(parts) > _MAX_TABLES:
        raise _too_many("number of tables", len(parts), _MAX_TABLES, like.path)
    found = [without_summary(table) for part in parts if (table := _table_of(part, like, table_in))]
    for k in range(1, len(found)):
        found[k] = _with_headers_of(found[k], found[k - 1])
    return found if len(found) < 2 else [replace(table, name=f"table {k}") for k, table in enumerate(found, 1)]


def _with_headers_of(table: TextValues, before: TextValues) -> TextValues:
    """A table without headers below one with as many columns has the headers of that one."""
    if table.has_header or not before.has_header or len(table.headers) != len(before.headers):
        return table
    note = Note("headers", "its headers and units are those of the table above it")
    return replace(table, headers=before.headers, units=before.units, has_header=True, notes=[*table.notes, note])


def _too_many(what: str, count: int, limit: int, path: Path) -> InputError:
    step = "Check that it is a recording, or split the file."
    return InputError(what, count, f"at most {limit} are read", str(path), step)


def _table_of(
    part: "_Stretch", like: TextValues, table_in: Callable[[Sequence[str]], TextValues | None]
) -> TextValues | None:
    """The table between two rows of text; None if its numbers are in no common columns."""
    table = table_in([*part.above, *part.lines])
    if table is None:
        return None
    inside = max(0, table.first_row - 1 - len(part.above))
    skipped = "".join(part.lines[:inside]).encode(like.encoding.name, like.encoding.errors)
    return replace(table, first_row=part.first_row + inside, begin=part.begin + len(skipped), end=part.end,
                   comments=like.comments, preamble=(*table.preamble, *like.preamble))  # fmt: skip


@dataclass
class _Stretch:
    """The lines between two rows of text: those above, the first of them, and how many have numbers; the first line's
    number and the bytes of both ends, None for the end of the file."""

    above: list[str]
    first_row: int
    begin: int
    end: int | None = None
    rows: int = 0
    lines: list[str] = field(default_factory=list)


def _stretches(table: TextValues) -> Iterator[_Stretch]:
    """Every stretch of a file between two rows of text."""
    above: list[str] = []
    part = None
    after = r"\s" if table.delimiter == WHITESPACE else re.escape(table.delimiter)
    first_number = re.compile(rf"\s*[+-]?\d+(\.\d*)?([eE][+-]?\d+)?\s*({after}|$)")  # fast to find
    for number, offset, line in table.all_lines():
        if _is_text(line, table, first_number):
            if part:
                part.end = offset
                yield part
            above = [*(above if part is None else []), line][-_ABOVE_LINES:]
            part = None
        elif part or (line.strip() and not line.lstrip().startswith("#")):
            part = part or _Stretch(above, number, offset)
            part.rows += bool(line.strip())
            part.lines += [line] if part.rows <= _SAMPLE_LINES else []
    if part:
        yield part


def without_summary(table: TextValues) -> TextValues:
    """The table without a summary at its end, and a note on what was left out.

    A row is of a summary if it has a text where the table has its first numbers, as in ``Mean,1.2,3.4``; or if it
    follows a blank row and has another text where the table has one in every row, as a specimen's name. Fewer than 20
    such rows, to the end of the file, are no samples. Rows of numbers alone after the only blank row are none either if
    a column that increases in every row before, as a time does, does not continue to increase.
    """
    lines = _tail(table)
    begin = min(_labelled(table, lines), _renamed(table, lines), _restarted(table, lines))
    left = [line.strip() for _, line in lines[begin:] if line.strip()]
    if not left:
        return table
    message = f"{len(left)} rows below the table are no samples and are left out; the first is {left[0][:60]!r}"
    return replace(table, end=lines[begin][0], notes=[*table.notes, Note("left_out", message, len(left))])


def _tail(table: TextValues) -> list[tuple[int, str]]:
    """The last complete lines, each with its first byte."""
    if table.encoding.name[:6] == "utf-16":
        return []
    with open_regular(table.path) as file:
        size = table.end if table.end is not None else file.seek(0, 2)
        begin = max(table.begin, size - _TAIL_BYTES)
        file.seek(begin)
        content = file.read(size - begin)
    found = []
    for line in content.splitlines(keepends=True):
        found.append((begin, line.decode(table.encoding.name, "replace")))
        begin += len(line)
    return found[found != [] and found[0][0] > table.begin :]


def _labelled(table: TextValues, lines: list[tuple[int, str]]) -> int:
    """The first of the last lines that are all blank or have a text in place of the first number; else their count."""
    first = min((k for k in range(len(table.headers)) if k not in table.text_columns), default=0)
    found, rows = len(lines), 0
    for k in range(len(lines) - 1, -1, -1):
        cells = split_cells(lines[k][1], table.delimiter)
        if not cells:
            continue
        numbers = any(map(is_number, cells))
        label = first < len(cells) and not is_missing(cells[first]) and not is_number(cells[first])
        rows += 1
        if not (label and numbers) or rows >= MIN_ROWS:
            break
        found = k
    return found if rows < MIN_ROWS else len(lines)


def _renamed(table: TextValues, lines: list[tuple[int, str]]) -> int:
    """The first row after the last blank one, if all from there on have other texts than the row before it."""
    if not table.text_columns:
        return len(lines)
    cells = [split_cells(line, table.delimiter) for _, line in lines]
    blank = max((k for k, row in enumerate(cells) if not row and any(cells[k + 1 :])), default=-1)
    after = [row for row in cells[blank + 1 :] if row]
    before = next((row for row in reversed(cells[: max(blank, 0)]) if row), [])
    if blank < 0 or not before or not 0 < len(after) < MIN_ROWS:
        return len(lines)
    names = [before[k] for k in table.text_columns if k < len(before)]
    others = all([row[k] for k in table.text_columns if k < len(row)] != names for row in after)
    return blank + 1 if others else len(lines)


def _restarted(table: TextValues, lines: list[tuple[int, str]]) -> int:
    """The first row after the last blank one, if there is no other, and no column increases beyond it that increased in
    every row before; else their count."""
    cells = [split_cells(line, table.delimiter) for _, line in lines]
    used = [k for k, row in enumerate(cells) if row]
    blank = [k for k, row in enumerate(cells) if not row and used and used[0] < k < used[-1]]
    if not blank or blank[-1] - blank[0] >= len(blank):  # in several places: the file has blank rows among its samples
        return len(lines)
    before = [_numbers(row, table) for row in cells[: blank[0]] if row]
    after = [_numbers(row, table) for row in cells[blank[-1] + 1 :] if row]
    if len(before) < MIN_ROWS or len(after) >= MIN_ROWS or None in before or None in after:
        return len(lines)
    rising = np.flatnonzero((np.diff(np.array(before), axis=0) > 0.0).all(axis=0))
    continues = np.array(after)[0, rising] > np.array(before)[-1, rising]
    return len(lines) if not len(rising) or continues.any() else blank[-1] + 1


def _numbers(row: Sequence[str], table: TextValues) -> list[float] | None:
    """The numbers of a row, NaN for a text; None for a row of another width."""
    if len(row) != len(table.headers):
        return None
    return [number_of(cell, table.decimal) for cell in row]
