# SPDX-License-Identifier: Apache-2.0
"""Tables of a LabVIEW measurement file (lvm): segments with a heading each, units of every channel, and a time that may
be stated by its step alone."""

import hashlib
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...files import read_bytes
from ..columns import Column
from ..file_table import FileTable
from .text_lines import Encoding
from .text_table import TextTable

_END = "***End_of_Header***"
_MAX_BYTES = 1 << 28


@dataclass(frozen=True)
class _Line:
    """A line: its number, its first byte, and its cells."""

    number: int
    begin: int
    cells: list[str]


def tables(path: Path) -> list[FileTable]:
    """A table for every segment. Raises InputError for a file without one."""
    content = read_bytes(path, "LabVIEW measurement file", _MAX_BYTES)
    encoding = _encoding(content)
    stated = re.search(rb"^Separator([\t,;])", content, re.MULTILINE)  # the sign itself, and its name after it
    separator = stated[1].decode() if stated else "\t"
    lines = list(_lines(content, encoding, separator))
    head = _facts(lines[: _ends(lines)[0]] if _ends(lines) else [])
    decimal = head.get("Decimal_Separator", ["."])[0] or "."
    sha256 = hashlib.sha256(content).hexdigest()
    x_columns = head.get("X_Columns", ["One"])[0].casefold()
    form = _Form(path=path, encoding=encoding, separator=separator, decimal=decimal, x_columns=x_columns, sha256=sha256)
    found = [_table(form, part) for part in _segments(lines, len(content))]
    if not found:
        limit, step = "a heading and rows of numbers are needed", "Check that the recording is complete."
        raise InputError("LabVIEW measurement file", "without a segment", limit, str(path), step)
    return found if len(found) == 1 else [replace(table, name=f"segment {k}") for k, table in enumerate(found, 1)]


def _encoding(content: bytes) -> Encoding:
    try:
        content.decode("utf-8")
    except UnicodeDecodeError:
        return Encoding(name="latin-1")
    return Encoding(name="utf-8")


def _lines(content: bytes, encoding: Encoding, separator: str) -> Iterator[_Line]:
    begin = 0
    for number, line in enumerate(content.splitlines(keepends=True), 1):
        text = line.decode(encoding.name, encoding.errors).rstrip("\r\n")
        yield _Line(number, begin, [cell.strip() for cell in text.split(separator)])
        begin += len(line)


def _ends(lines: Sequence[_Line]) -> list[int]:
    return [k for k, line in enumerate(lines) if line.cells[0] == _END]


def _facts(lines: Sequence[_Line]) -> dict[str, list[str]]:
    """The entries of a heading: name -> cells."""
    return {line.cells[0]: line.cells[1:] for line in lines if line.cells[0]}


@dataclass(frozen=True)
class _Segment:
    """The heading of a segment, the line of the channels' names, its first row, and the byte after its last."""

    facts: Mapping[str, list[str]]
    names: list[str]
    first: _Line
    end: int


def _segments(lines: Sequence[_Line], size: int) -> Iterator[_Segment]:
    """Every segment: what is between the end of its heading and the next heading."""
    ends = _ends(lines)
    starts = ends[1:] if len(ends) > 1 else ends
    for k, at in enumerate(starts):
        heading = lines[ends[0] + 1 : at] if k == 0 else lines[starts[k - 1] + 1 : at]
        begin = max((i for i, line in enumerate(heading) if line.cells[0] == "Channels"), default=0)
        stop = starts[k + 1] if k + 1 < len(starts) else len(lines)
        rows = [line for line in lines[at + 1 : stop] if any(line.cells)]
        channels = next((i for i, line in enumerate(rows) if line.cells[0] == "Channels"), None)
        end = size if channels is None else rows[channels].begin
        rows = rows[:channels]
        if len(rows) > 1:
            yield _Segment(_facts(heading[begin:]), rows[0].cells, rows[1], end)


@dataclass(frozen=True, kw_only=True)
class _Form:
    """What all segments have in common; ``x_columns`` is ``no``, ``one`` or ``multi``."""

    path: Path
    encoding: Encoding
    separator: str
    decimal: str
    x_columns: str
    sha256: str


def _table(form: _Form, part: _Segment) -> FileTable:
    names = part.names[:-1] if part.names[-1:] == ["Comment"] else part.names
    cells = [*part.names, *[""] * len(part.first.cells)][: len(part.first.cells)]  # the comment is often absent
    text = TextTable(
        path=form.path, encoding=form.encoding, delimiter=form.separator, decimal=form.decimal, headers=cells,
        units=[""] * len(cells), first_row=part.first.number, begin=part.first.begin, end=part.end,
        text_columns=frozenset(range(len(names), len(cells))),
    )  # fmt: skip

    @cache
    def values(index: int) -> np.ndarray:
        return text.numbers({"force": Column("force", names[index], index, None)})[0]["force"]

    def read_column(index: int) -> np.ndarray:
        if index > 0 or form.x_columns != "no":
            return values(index).copy()
        first, step = (_number(part.facts.get(name, [""])[0], form.decimal) for name in ("X0", "Delta_X"))
        return first + step * np.arange(len(values(len(names) - 1)))

    headers, units = _columns(names, part.facts, form.x_columns == "multi")
    return FileTable(path=form.path, headers=headers, units=units, read_column=read_column, sha256=form.sha256,
                     row_name="line", first_row=part.first.number)  # fmt: skip


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


def _number(text: str, decimal: str) -> float:
    try:
        return float(text.replace(decimal, "."))
    except ValueError:
        return float("nan")
