# SPDX-License-Identifier: Apache-2.0
"""Tables of bench tests as instruments and scripts write them: where the table begins, which column is which quantity,
and their units."""

import csv
import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from ...files import MAX_RESULT_BYTES, read_bytes
from ...units import find

MAX_LINES, MAX_CHARS, MAX_COLUMNS, MAX_MAGNITUDE = 200_000, 1 << 14, 100, 1e30
DELIMITERS = ("\t", ";", ",", " ")
_NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?|[+-]?(nan|inf|infinity)", re.IGNORECASE)
_UNIT_AT_END = re.compile(r"(.*?)\s*[\[(]\s*([^\])]*?)\s*[\])]|(.*?),\s*(\S+)|(.*?)\s+(?:/|in)\s+(\S+)")
_RATIOS = {"": 1.0, "1": 1.0, "-": 1.0, "mm/mm": 1.0, "m/m": 1.0, "in/in": 1.0, "%": 0.01, "percent": 0.01,
           "-1": -1.0, "-%": -0.01}  # fmt: skip
# other words of a header with one of these mean another quantity
_OTHER_QUANTITIES = {"rate", "speed", "energy", "time", "error", "sd", "std", "transverse", "lateral"}

# quantity -> dimension, and the words by which a header is recognised, a longer phrase first
QUANTITIES = {
    "stretch": ("ratio", ("stretch ratio", "extension ratio", "stretch", "lambda", "λ")),
    "true_strain": ("ratio", ("true strain", "logarithmic strain", "log strain", "hencky strain")),
    "strain": ("ratio", ("strain", "epsilon", "eps", "ε", "dehnung", "déformation")),
    "true_stress": ("stress", ("true stress", "cauchy stress")),
    "stress": ("stress", ("nominal stress", "engineering stress", "stress", "sigma", "σ", "spannung", "contrainte")),
    "tip_deflection": ("length", ("tip deflection",)),
    "deflection": ("length", ("deflection", "extension", "displacement", "crosshead", "travel", "durchbiegung", "weg")),
    "displacement": ("length", ("extension", "displacement", "elongation", "crosshead", "travel", "position", "weg")),
    "length": ("length", ("length", "länge")),
    "position": ("length", ("position",)),
    "force": ("force", ("force", "load", "fz", "f", "kraft")),
}


@dataclass(frozen=True, eq=False, kw_only=True)
class BenchTable:
    """The longest table of a file: headers, the units of their row or brackets, cells by row, and the line of the
    first row. ``has_header`` is False where the headers are the numbers of the columns."""

    file: str
    headers: list[str]
    units: list[str]
    cells: list[list[str]]
    first_line: int
    has_header: bool
    decimal: str
    notes: list[str] = field(default_factory=list)

    def values(self, index: int) -> np.ndarray:
        """Column ``index`` as (n,); InputError for a cell that is not a finite number, with its line."""
        column = np.array([_float(row[index], self.decimal) for row in self.cells])
        valid = np.abs(column) <= MAX_MAGNITUDE
        if not valid.all():
            row = int(np.argmin(valid))
            limit = f"it must be finite and at most {MAX_MAGNITUDE:g}"
            place = f"{self.file}: line {self.first_line + row}"
            step = "Correct or remove this row."
            raise InputError(f"column {self.headers[index]}", repr(self.cells[row][index][:40]), limit, place, step)
        return column


def read_table(path: str | Path) -> BenchTable:
    """Find the table of a text file: its delimiter, its decimal sign, what is above it, and a row of units.

    The longest block of rows of numbers with the same number of cells is the table; rows next to it that have a number
    and as many cells belong to it, so that a broken cell is reported and not left out.

    Raises
    ------
    InputError
        Without two rows of numbers, and for a file that no table is as large as.
    """
    name = Path(path).name
    lines = _decoded(read_bytes(path, "table of readings", MAX_RESULT_BYTES)).splitlines()
    if len(lines) > MAX_LINES or any(len(line) > MAX_CHARS for line in lines):
        limit = f"at most {MAX_LINES} lines of {MAX_CHARS} characters can be read"
        raise InputError("size of the table", f"{len(lines)} lines", limit, name, "Save only the bench test.")
    best = max((_block(lines, mark) for mark in DELIMITERS), key=lambda block: (block.several, block.length))
    if not best.length:
        limit = "rows of numbers are needed"
        raise InputError("No columns", limit=limit, place=name, next_step="Give a table as text, such as CSV.")
    start, stop = _whole_block(best)
    headers, units = _header(lines, best, start)
    columns = len(best.rows[start])
    if columns > MAX_COLUMNS:
        limit = f"at most {MAX_COLUMNS} can be read"
        raise InputError("number of columns", columns, limit, name, "Save fewer columns.")
    cells = [row for row in best.rows[start:stop] if row]
    notes = [f"{best.others} shorter tables in {name} are not used"] if best.others else []
    return BenchTable(
        file=name,
        headers=headers or [str(k + 1) for k in range(columns)],
        units=units or [""] * columns,
        cells=cells,
        first_line=start + 1,
        has_header=bool(headers),
        decimal=best.decimal,
        notes=notes,
    )


def _decoded(content: bytes) -> str:
    """Text in UTF-8, UTF-16 with its mark, or Latin-1."""
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-16", errors="replace")
    try:
        return content.removeprefix(b"\xef\xbb\xbf").decode("utf-8")
    except UnicodeDecodeError:
        return content.decode("latin-1")


@dataclass(frozen=True, eq=False, kw_only=True)
class _Block:
    """The cells of all lines for one delimiter, and the longest run of rows of numbers in them."""

    rows: list[list[str]]
    several: bool
    start: int
    length: int
    others: int
    decimal: str


def _block(lines: list[str], mark: str) -> _Block:
    rows = [_cells(line, mark) for line in lines]
    decimal = "," if mark != "," and _commas(rows) else "."
    runs, start, width = [], 0, 0
    for k, row in enumerate([*rows, []]):
        numeric = bool(row) and all(_is_number(cell, decimal) for cell in row)
        if width and (not numeric or len(row) != width):
            runs.append((k - start, start))
            width = 0
        if numeric and not width:
            start, width = k, len(row)
    length, start = max(runs, key=lambda run: (len(rows[run[1]]) > 1, run[0]), default=(0, 0))
    several = bool(length) and len(rows[start]) > 1
    others = sum(run[0] > 1 for run in runs) - (length > 1)
    return _Block(rows=rows, several=several, start=start, length=length, others=others, decimal=decimal)


def _commas(rows: list[list[str]]) -> bool:
    """Whether numbers have decimal commas, judged by the first rows."""
    cells = [cell for row in rows[:500] for cell in row if "," in cell]
    return bool(cells) and sum(_is_number(cell, ",") for cell in cells) > 0.5 * len(cells)


def _cells(line: str, mark: str) -> list[str]:
    """The cells of a line without surrounding blanks and quotes; none of an empty line, and of a comment."""
    text = line.strip("\r\n ")
    if not text or text.startswith("#"):
        return []
    if mark == " ":
        return [cell.strip('"') for cell in text.split()]
    if mark not in text:
        return [text.strip('"')]
    return [cell.strip() for cell in next(csv.reader([text], delimiter=mark), [])]


def _is_number(cell: str, decimal: str) -> bool:
    return _NUMBER.fullmatch(cell.replace(decimal, ".") if decimal == "," else cell) is not None


def _float(cell: str, decimal: str) -> float:
    return float(cell.replace(decimal, ".")) if _is_number(cell, decimal) else math.nan


def _whole_block(block: _Block) -> tuple[int, int]:
    """First and last row + 1 with the neighbours that have a number and as many cells."""
    rows, width = block.rows, len(block.rows[block.start])

    def belongs(k: int) -> bool:
        return 0 <= k < len(rows) and len(rows[k]) == width and any(_is_number(c, block.decimal) for c in rows[k])

    start, stop = block.start, block.start + block.length
    while belongs(start - 1):
        start -= 1
    while belongs(stop):
        stop += 1
    return start, stop


def _header(lines: list[str], block: _Block, start: int) -> tuple[list[str], list[str]]:
    """Names and units above the first row, empty without; the last comment is a header if it has as many cells."""
    width = len(block.rows[start])
    above = [row for row in block.rows[:start] if row][-2:]
    above = [row for row in above if len(row) == width]
    if not above:
        comments = [line.strip()[1:] for line in lines[:start] if line.strip().startswith("#")]
        above = [cells for mark in DELIMITERS for text in comments[-1:] if len(cells := _cells(text, mark)) == width][
            :1
        ]
    if not above:
        return [], []
    if len(above) == 2 and all(_is_unit(cell) for cell in above[1]):
        return above[0], [_bare(cell) for cell in above[1]]
    return above[-1], [_split(cell)[1] for cell in above[-1]]


def _bare(cell: str) -> str:
    return cell.strip(" []()")


def _is_unit(cell: str) -> bool:
    """Whether a cell of the row under the names is a unit: in brackets, or known."""
    text = _bare(cell)
    bracketed = cell[:1] in ("(", "[") and cell[-1:] in (")", "]")
    return bracketed or text in _RATIOS or any(find(text, each) for each in ("time", "length", "force", "stress"))


def _split(header: str) -> tuple[str, str]:
    """Name and unit of a header: ``Force [N]``, ``Fz, gf``, ``stress / kPa``, ``stress_kPa``."""
    found = _UNIT_AT_END.fullmatch(header.strip())
    if found:
        name, unit = [part for part in found.groups() if part is not None]
        if _is_unit(unit):
            return name, unit
    head, _, tail = header.rpartition("_")
    known = head and (tail == "%" or any(find(tail, each) for each in ("time", "length", "force", "stress")))
    return (head, tail) if known else (header, "")


def _words(header: str) -> list[str]:
    return [word for word in re.split(r"[\W_]+", header.casefold()) if word]


def column_of(table: BenchTable, quantity: str, given: Mapping[str, str]) -> int | None:
    """The index of the column of a quantity: the one given by name or number, or recognised; None without one.

    Raises InputError for a given column that does not exist, and for two that match equally.
    """
    if quantity in given:
        return _given_column(table, quantity, given[quantity])
    if not table.has_header:
        return None
    taken = {_given_column(table, other, name) for other, name in given.items()}
    names = [_words(_split(header)[0]) for header in table.headers]
    for phrase in QUANTITIES[quantity][1]:
        words = phrase.split()
        for exact in (True, False):
            found = [k for k, own in enumerate(names) if k not in taken and _matches(own, words, exact)]
            found = [k for k in found if not _longer_phrase(names[k], quantity)]
            if len(found) > 1:
                shown = " and ".join(repr(table.headers[k]) for k in found)
                step = f"Choose one, such as --column {quantity}={found[0] + 1}."
                raise InputError(f"column {quantity}", "ambiguous", f"{shown} match", table.file, step)
            if found:
                return found[0]
    return None


def _matches(own: list[str], words: list[str], exact: bool) -> bool:
    if exact:
        return own == words
    inside = any(own[k : k + len(words)] == words for k in range(len(own) - len(words) + 1))
    return inside and len("".join(words)) > 1 and not _OTHER_QUANTITIES & set(own)


def _longer_phrase(own: list[str], quantity: str) -> bool:
    """Whether a header names a true stress or strain, or the tip's deflection, when another is looked for."""
    special = {"true_stress", "true_strain", "tip_deflection"} - {quantity}
    return any(_matches(own, phrase.split(), False) for name in special for phrase in QUANTITIES[name][1])


def _given_column(table: BenchTable, quantity: str, name: str) -> int:
    if name in table.headers:
        return table.headers.index(name)
    plain = [_words(_split(header)[0]) for header in table.headers]
    if table.has_header and plain.count(_words(name)) == 1:
        return plain.index(_words(name))
    if name.isdecimal() and 1 <= int(name) <= len(table.headers):
        return int(name) - 1
    limit = f"the columns are {', '.join(table.headers)}"
    step = f"Give --column {quantity}=NAME, or its number from 1 to {len(table.headers)}."
    raise InputError(f"column of {quantity}", repr(name), limit, table.file, step)


def in_si(table: BenchTable, quantity: str, index: int, units: Mapping[str, str]) -> np.ndarray:
    """A column in SI, by the unit given or that of its header. Raises InputError without a unit."""
    dimension, header = QUANTITIES[quantity][0], table.headers[index]
    text = units.get(quantity, table.units[index])
    factor = _factor(text, dimension)
    if factor is None:
        example = {"stress": "kPa", "force": "N", "length": "mm", "ratio": "%"}[dimension]
        problem = f"unit {text!r} of column {header}" if text else f"unit of column {header}"
        step = f"Name it {quantity}_ followed by its unit, or give " * table.has_header or "Give "
        step += f"--unit {quantity}={example}."
        raise InputError(problem, "unknown" if text else "missing", place=table.file, next_step=step)
    return table.values(index) * factor


def _factor(text: str, dimension: str) -> float | None:
    if dimension == "ratio":
        return _RATIOS.get(text.strip().casefold())
    found = find(text, dimension)
    return None if found is None else found.numerator / found.denominator


def check_names(columns: Iterable[str], units: Iterable[str], known: Iterable[str]) -> None:
    """Raise InputError for an option that names another quantity."""
    for option, names in (("column", columns), ("unit", units)):
        for name in names:
            if name not in known:
                raise InputError(f"quantity of --{option}", repr(name), f"known are {', '.join(known)}")


def missing(table: BenchTable, quantity: str, alternatives: Any = "") -> InputError:
    """The error for a quantity without a column; a table without header shows its first row."""
    if table.has_header:
        limit = f"the columns are {', '.join(table.headers)}"
        step = f"Name it {quantity}{alternatives}, or give --column {quantity}=NAME."
    else:
        limit = f"the file has no header; its first row is {', '.join(table.cells[0])}"
        step = f"Give --column {quantity}=1, or another number, for each column that is used."
    return InputError(f"column {quantity}", "missing", limit, table.file, step)
