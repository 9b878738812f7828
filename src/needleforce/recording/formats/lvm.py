# SPDX-License-Identifier: Apache-2.0
"""Tables of a LabVIEW measurement file (lvm): segments with a heading each, units of every channel, and a time that may
be stated by its step alone."""

import hashlib
import re
from bisect import bisect
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import islice
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...files import check_count, read_bytes
from ..table import Table
from .arrays import MAX_TABLES
from .rows import number_of
from .text import unmarked_encoding
from .text_rows import Encoding
from .text_values import TextValues

_END = "***End_of_Header***"
_MAX_BYTES = 1 << 28


def tables(path: Path) -> list[Table]:
    """A table for every segment. Raises InputError for a file without one."""
    content = read_bytes(path, "LabVIEW measurement file", _MAX_BYTES)
    encoding = unmarked_encoding(content)
    stated = re.search(rb"^Separator([\t,;])", content, re.MULTILINE)  # the sign itself, and its name after it
    separator = stated[1].decode() if stated else "\t"
    view = _View(content=content, encoding=encoding, separator=separator)
    ends = view.places(_END)
    check_count("segments", len(ends) - 1, MAX_TABLES, path)
    head = view.facts(0, ends[0]) if ends else {}
    decimal = head.get("Decimal_Separator", ["."])[0] or "."
    if decimal not in (".", ","):
        limit, step = "a point or a comma is needed", "Correct it in the heading of the file."
        raise InputError("Decimal_Separator", repr(decimal[:40]), limit, str(path), step)
    sha256 = hashlib.sha256(content).hexdigest()
    x_columns = head.get("X_Columns", ["One"])[0].casefold()
    form = _Form(path=path, encoding=encoding, separator=separator, decimal=decimal, x_columns=x_columns, sha256=sha256)
    found = [_table(form, part) for part in _segments(view, ends)]
    if not found:
        limit, step = "a heading and rows of numbers are needed", "Check that the recording is complete."
        raise InputError("LabVIEW measurement file", "without a segment", limit, str(path), step)
    return found if len(found) == 1 else [replace(table, name=f"segment {k}") for k, table in enumerate(found, 1)]


@dataclass(frozen=True, kw_only=True)
class _View:
    """The content, of which only headings and the first row of each segment are taken apart."""

    content: bytes
    encoding: Encoding
    separator: str

    def places(self, word: str) -> list[int]:
        """The first bytes of the lines whose first cell is ``word``."""
        start = (
            rb"(?<![^\r\n])"
            + re.escape(word.encode())
            + rb"(?=[ \r\n]|"
            + re.escape(self.separator.encode())
            + rb"|\Z)"
        )
        return [found.start() for found in re.finditer(start, self.content)]

    def after(self, place: int) -> int:
        """The first byte of the line after the one at ``place``."""
        found = re.compile(rb"\r\n|\r|\n").search(self.content, place)
        return found.end() if found else len(self.content)

    def cells(self, place: int) -> list[str]:
        """The cells of the line at ``place``."""
        line = self.content[place : self.after(place)].decode(self.encoding.name, self.encoding.errors)
        return [cell.strip() for cell in line.rstrip("\r\n").split(self.separator)]

    def rows(self, begin: int, end: int) -> Iterator[tuple[int, list[str]]]:
        """The lines between two bytes that are not blank: first byte and cells."""
        while begin < end:
            if any(cells := self.cells(begin)):
                yield begin, cells
            begin = self.after(begin)

    def facts(self, begin: int, end: int) -> dict[str, list[str]]:
        """The entries of a heading: name -> cells."""
        return {cells[0]: cells[1:] or [""] for _, cells in self.rows(begin, end) if cells[0]}


@dataclass(frozen=True, kw_only=True)
class _Segment:
    """The heading of a segment, the names of its channels, the number, first byte and cells of its first row, and the
    byte after its last."""

    facts: Mapping[str, list[str]]
    names: list[str]
    number: int
    begin: int
    cells: list[str]
    end: int


def _segments(view: _View, ends: Sequence[int]) -> Iterator[_Segment]:
    """Every segment: what is between the end of its heading and the next heading."""
    starts = ends[1:] if len(ends) > 1 else ends
    channels = view.places("Channels")
    number, counted, before = 1, 0, ends[0] if len(ends) > 1 else 0
    for at, stop in zip(starts, [*starts[1:], len(view.content)]):
        k = bisect(channels, at)
        heading = channels[k - 1] if k and channels[k - 1] > before else view.after(before)
        end = channels[k] if k < len(channels) and channels[k] < stop else stop
        rows = list(islice(view.rows(view.after(at), end), 2))
        if len(rows) == 2:
            begin, cells = rows[1]
            number, counted = number + len(re.findall(rb"\r\n|\r|\n", view.content[counted:begin])), begin
            facts, names = view.facts(heading, at), rows[0][1]
            yield _Segment(facts=facts, names=names, number=number, begin=begin, cells=cells, end=end)
        before = at


@dataclass(frozen=True, kw_only=True)
class _Form:
    """What all segments have in common; ``x_columns`` is ``no``, ``one`` or ``multi``."""

    path: Path
    encoding: Encoding
    separator: str
    decimal: str
    x_columns: str
    sha256: str


def _table(form: _Form, part: _Segment) -> Table:
    names = part.names[:-1] if part.names[-1:] == ["Comment"] else part.names
    cells = [*part.names, *[""] * len(part.cells)][: len(part.cells)]  # the comment is often absent
    text = TextValues(
        path=form.path, encoding=form.encoding, delimiter=form.separator, decimal=form.decimal, headers=cells,
        units=[""] * len(cells), first_row=part.number, begin=part.begin, end=part.end,
        text_columns=frozenset(range(len(names), len(cells))),
    )  # fmt: skip

    @cache
    def values(index: int) -> np.ndarray:
        return text.numbers([index])[0][0]

    def read_column(index: int) -> np.ndarray:
        if index > 0 or form.x_columns != "no":
            return values(index).copy()
        texts = (part.facts.get(name, [""])[0].strip().replace(form.decimal, ".") for name in ("X0", "Delta_X"))
        first, step = (number_of(text, ".") for text in texts)
        return first + step * np.arange(len(values(len(names) - 1)))

    headers, units = _columns(names, part.facts, form.x_columns == "multi")
    return Table(path=form.path, headers=headers, units=units, read_column=read_column, sha256=form.sha256,
                     row_name="line", first_row=part.number)  # fmt: skip


def _columns(names: Sequence[str], facts: Mapping[str, list[str]], multi: bool) -> tuple[list[str], list[str]]:
    """Headers and units: the first column is X, or every second one if each channel has its own."""
    x_name, labels = facts.get("X_Dimension", ["Time"])[0] or "Time", facts.get("Y_Unit_Label", [])
    headers, units = [], []
    for k, name in enumerate(names):
        if k == 0 or (multi and k % 2 == 0):
            headers.append(x_name)
            units.append("s" if x_name == "Time" else "")
        else:
            channel = k // 2 if multi else k - 1
            headers.append(name)
            units.append(labels[channel] if channel < len(labels) else "")
    return headers, units
