# SPDX-License-Identifier: Apache-2.0
"""A text whose lines name their values, as a microcontroller prints them: ``t=0ms;F=0.5N``, ``Force:0.5,Depth:1.2``."""

import hashlib
import io
import re
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ...errors import InputError, printable
from ...files import MAX_RECORDING_BYTES, MAX_SAMPLES, check_count, open_regular, unpacked_limit
from ...units import find
from ..quantities import UNIT_DIMENSIONS
from ..recording import Note
from ..stated import stating_lines
from ..table import Table
from .arrays import MAX_COLUMNS, check_size
from .clock_times import seconds_of
from .text_rows import MAX_LINE_CHARS, Encoding, long_line

# a name that begins with a letter, = or :, a number with a decimal comma only if a digit follows it, and a unit
_PAIR = re.compile(
    r"(?P<name>[^\W\d][^=:;,|\t]{0,60}?)[ ]?[=:][ ]{0,8}"
    r"(?P<number>[+-]?(?:\d{1,30}(?:[.,]\d{1,30}|\.)?|\.\d{1,30})(?:[eE][+-]?\d{1,3})?|nan)(?![\d:])"
    r"[ ]?(?P<unit>[^\s\d;,|=:+.-][^\s;,|=:]{0,12}(?![^\s;,|]))?",
    re.IGNORECASE,
)
_RECEIVED = re.compile(r"\s*(\d{1,2}:\d\d:\d\d(?:[.,]\d{1,9})?)\s*->\s*")  # the Arduino monitor's time of arrival
_SAMPLE_LINES = 200  # of the first lines, that show whether they consist of names and values
_ARRIVAL = "time of arrival"
_MAX_STATING = 256  # lines that may state a rate or a speed
_LEFT_OUT = 60  # characters of a line that are shown


def common_names(lines: Sequence[str]) -> tuple[str, ...]:
    """The names of more than half of the last of the lines, if these consist of names and values; else none."""
    used = [line for line in lines[-_SAMPLE_LINES:] if line.strip()]
    if len(used) < 2 or not any(_PAIR.search(line) for line in (used[len(used) // 2], used[-1])):
        return ()
    names: dict[tuple[str, ...], int] = {}
    for line in used:
        found = tuple(name for name, _, _ in _pairs(line))
        names[found] = names.get(found, 0) + 1
    return next((found for found, count in names.items() if found and 2 * count > len(used)), ())


def table(path: Path, encoding: Encoding, names: Sequence[str]) -> Table:
    """The table: a column for each name, a row for each line with one of the names that are in more than half of the
    lines; other lines are left out, with a note. Raises InputError for a unit that changes to one of another kind."""
    rows = _Rows(path, frozenset(names))
    with open_regular(path, "file", MAX_RECORDING_BYTES) as file:
        sha256 = hashlib.file_digest(file, "sha256").hexdigest()
        file.seek(encoding.mark)
        for number, line in enumerate(_lines(file, encoding, path), 1):
            rows.add(line, number)
    return rows.table(sha256)


def _lines(file: BinaryIO, encoding: Encoding, path: Path) -> Iterator[str]:
    with io.TextIOWrapper(file, encoding=encoding.name, errors="replace", newline=None) as text:
        for number, line in enumerate(iter(lambda: text.readline(MAX_LINE_CHARS + 1), ""), 1):
            if len(line) > MAX_LINE_CHARS:
                raise long_line(path, number)
            yield line


def _pairs(line: str) -> Iterator[tuple[str, str, str]]:
    """Name, number and unit of each value in a line; none if it has other text than these, or a name twice."""
    received = _RECEIVED.match(line)
    at = received.end() if received else 0
    found, names = [], set()
    for pair in _PAIR.finditer(line, at):
        if line[at : pair.start()].strip(" \t,;|{}[]()\"'<>#$*") or pair["name"] in names:
            return
        names.add(pair["name"])
        found.append((pair["name"].strip(" \"'"), pair["number"], pair["unit"] or ""))
        at = pair.end()
    if _has_both_signs(found):
        return  # one of them is a sign of thousands
    found = [(name, number.replace(",", "."), unit) for name, number, unit in found]
    if not line[at:].strip(" \t\r\n,;|{}[]()\"'<>#$*"):
        yield from found


def _has_both_signs(pairs: Sequence[tuple[str, str, str]]) -> bool:
    """Whether numbers of one line have points, and others commas."""
    return all(any(sign in number for _, number, _ in pairs) for sign in ".,")


@dataclass(kw_only=True)
class _Column:
    """The values of a name so far, the unit of the first, and how often there is one."""

    values: array = field(default_factory=lambda: array("d"))
    unit: str = ""
    count: int = 0


class _Rows:
    """The lines as rows of columns of 8 bytes a value, NaN where a line lacks a name."""

    def __init__(self, path: Path, names: frozenset[str]):
        self._path, self._names, self._count = path, names, 0
        self._limit = unpacked_limit(path.stat().st_size)
        self._columns: dict[str, _Column] = {}
        self._arrivals: list[str] = []
        self._others: list[tuple[int, str]] = []
        self._n_others = 0
        self._stating: list[str] = []

    def add(self, line: str, number: int) -> None:
        """Add a line."""
        pairs = list(_pairs(line))
        if not self._names & {name for name, _, _ in pairs}:
            self._check_signs(line, number)
            self._other(line, number)
            return
        for name, text, unit in pairs:
            column = self._columns.setdefault(name, _Column(unit=unit))
            check_count("columns", len(self._columns), MAX_COLUMNS, self._path)
            column.values.extend([np.nan] * (self._count - len(column.values)))
            column.values.append(float(text) * self._factor(name, column, unit, number))
            column.count += 1
        received = _RECEIVED.match(line)
        self._arrivals += [received[1]] if received and len(self._arrivals) == self._count else []
        self._count += 1
        check_count("samples", self._count, MAX_SAMPLES, self._path)
        if self._count % 1024 == 0:
            check_size(8 * self._count * len(self._columns), self._limit, self._path)

    def _factor(self, name: str, column: _Column, unit: str, number: int) -> float:
        """From the unit of a value to that of the first value of its column."""
        if unit == column.unit:
            return 1.0
        for dimension in UNIT_DIMENSIONS:
            first, own = find(column.unit, dimension), find(unit, dimension)
            if first and own:
                return float(own.to_si(1.0)) / float(first.to_si(1.0))
        limit = f"it was {column.unit!r} before" if column.unit else "there was none before"
        place = f"{self._path}, line {number}"
        raise InputError(f"unit of {name}", repr(unit), limit, place, "Correct or remove the line.")

    def _check_signs(self, line: str, number: int) -> None:
        """Raise InputError for a line of these names whose numbers have a decimal sign and one of thousands."""
        pairs = [(pair["name"].strip(" \"'"), pair["number"], "") for pair in _PAIR.finditer(line)]
        if self._names <= {name for name, _, _ in pairs} and _has_both_signs(pairs):
            text = printable(line.strip()[:_LEFT_OUT])
            limit = "its numbers have points and commas, of which one may be a sign of thousands"
            step = "Save the values without signs of thousands."
            raise InputError("line", repr(text), limit, f"{self._path}, line {number}", step)

    def _other(self, line: str, number: int) -> None:
        self._n_others += bool(line.strip())
        if len(self._stating) < _MAX_STATING:
            received = _RECEIVED.match(line)
            self._stating += stating_lines([line[received.end() :] if received else line])
        if line.strip() and not self._others:
            self._others.append((number, printable(line.strip()[:_LEFT_OUT])))

    def table(self, sha256: str) -> Table:
        """The table. Raises InputError without rows."""
        if self._count < 2:
            step = "Check that the recording is complete."
            raise InputError("number of samples", self._count, "at least 2 are needed", str(self._path), step)
        headers = list(self._columns)
        units = [self._columns[name].unit for name in headers]
        columns = [self._filled(self._columns[name]) for name in headers]
        if len(self._arrivals) == self._count:
            headers, units = [*headers, _ARRIVAL], [*units, "s"]
            columns.append(seconds_of(np.array(self._arrivals, object), str(self._path)))
        return Table(path=self._path, headers=headers, units=units, read_column=lambda k: columns[k].copy(),
                         sha256=sha256, notes=self._notes(), preamble=(self._stating,))  # fmt: skip

    def _filled(self, column: _Column) -> np.ndarray:
        found = np.full(self._count, np.nan)
        found[: len(column.values)] = column.values
        return found

    def _notes(self) -> list[Note]:
        if not self._others:
            return []
        number, text = self._others[0]
        what = f"{self._n_others} lines have no values with names and are left out"
        message = f"{what}; the first is line {number}, {text!r}"
        return [Note("left_out", message, self._n_others)]
