# SPDX-License-Identifier: Apache-2.0
"""Several tables of a text file, one below the other: each between two rows of text."""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from ...errors import InputError
from ..quantities import by_name
from ..recording import Note
from .rows import MIN_ROWS, WHITESPACE, is_missing, is_number
from .summary_rows import without_summary
from .text_rows import split_cells
from .text_values import TextValues

_MAX_TABLES = 2000
_MAX_STRETCHES = 20_000  # of numbers between rows of text
_SAMPLE_LINES = 200  # of a table, which show its columns
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
