# SPDX-License-Identifier: Apache-2.0
"""Rows below a table that are no samples: a mean, a standard deviation, a peak, as testing machines write them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...files import open_regular
from ..recording import Note
from .rows import MIN_ROWS, is_missing, is_number, number_of
from .text_rows import split_cells
from .text_values import TextValues

_TAIL_BYTES = 1 << 13  # at the end of a file, in which a summary is


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
