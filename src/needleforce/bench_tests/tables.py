# SPDX-License-Identifier: Apache-2.0
"""Tables of bench tests as instruments and scripts write them: where the table begins, which column is which quantity,
and their units."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..files import check_count
from ..recording.formats.detect import tables_of
from ..recording.formats.rows import is_unit
from ..recording.quantities import split
from ..recording.roles import Vocabulary, assign_columns, columns_of
from ..recording.samples import MAX_MISSING_SHARE
from ..recording.table import Table
from ..units import find

MAX_COLUMNS, MAX_MAGNITUDE = 100, 1e30
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
    """The longest table of a file: headers, the unit that the file states for each column, and the number of rows to
    the last one with a value. ``has_header`` is False where the headers are the numbers of the columns."""

    file: str
    headers: list[str]
    units: list[str]
    table: Table
    rows: int
    has_header: bool
    notes: list[str] = field(default_factory=list)

    def values(self, index: int) -> np.ndarray:
        """Column ``index`` as (n,), NaN where a cell is empty; InputError for one that is no number, with its place."""
        header = self.headers[index]
        try:
            values = self.table.numbers(index)
            if not np.isfinite(values).all():
                self.table.is_cut_off([index])
        except InputError as error:
            raise InputError(f"column {header}", error.value, error.limit, error.place, error.next_step) from None
        values = values[: self.rows]
        valid = (np.abs(values) <= MAX_MAGNITUDE) | np.isnan(values)
        if not valid.all():
            row = int(np.argmin(valid))
            limit, step = f"it must be finite and at most {MAX_MAGNITUDE:g}", "Correct or remove this row."
            raise InputError(f"column {header}", f"{values[row]:g}", limit, self.table.place(row), step)
        return values


def read_table(path: str | Path) -> BenchTable:
    """The longest table of a file of any format.

    Raises
    ------
    InputError
        Without two rows of numbers, and for a file that no table is as large as.
    """
    name, found = Path(path).name, tables_of(Path(path))
    table = max(found, key=_rows)
    check_count("columns", len(table.headers), MAX_COLUMNS, name)
    apart = table.units or [""] * len(table.headers)
    units = [unit or _split(header)[1] for unit, header in zip(apart, table.headers, strict=True)]
    notes = [f"{len(found) - 1} shorter tables in {name} are not used"] if len(found) > 1 else []
    return BenchTable(file=name, headers=table.headers, units=units, table=table, rows=_rows(table),
                      has_header=table.has_header, notes=notes)  # fmt: skip


def _rows(table: Table) -> int:
    """The rows of a table to the last one in which a column has a value."""
    rows = 0
    for k in range(len(table.headers[:MAX_COLUMNS])):
        values = table.readable(k)
        present = np.flatnonzero(~np.isnan(values))
        rows = max(rows, int(present[-1]) + 1 if len(present) else 0)
    return rows


def _split(header: str) -> tuple[str, str]:
    """Name and unit of a header, of which only a unit of a bench test is one."""
    name, unit = split(header.strip(), is_unit)
    return (name, unit) if unit and is_unit(unit) else (header, "")


def column_of(table: BenchTable, quantity: str, given: Mapping[str, str]) -> int | None:
    """The index of the column of a quantity: the one given by name or number, or recognised; None without one.

    Raises InputError for a given column that does not exist, and for two that match equally.
    """
    if quantity not in given and not table.has_header:
        return None
    roles = assign_columns(table.table, given, _VOCABULARIES[quantity])
    absent = next((q for q in ([quantity] if quantity in given else given) if q not in roles.matches), None)
    if absent:
        step = f"Give --column {absent}=NAME, or its number from 1 to {len(table.headers)}."
        raise InputError(
            f"column of {absent}", repr(given[absent]), columns_of(table.table, _names_quantity), table.file, step
        )
    found = roles.matches.get(quantity, ())
    if len(found) > 1:
        shown = " and ".join(repr(table.headers[k]) for k in found)
        step = f"Choose one, such as --column {quantity}={found[0] + 1}."
        raise InputError(f"column {quantity}", "ambiguous", f"{shown} match", table.file, step)
    return found[0] if found else None


def _recognise(quantity: str, phrase: str, exact: bool, header: str) -> str | None:
    """The quantity, if the phrase is a header, or is in one, that names no other quantity."""
    own = [word for word in re.split(r"[\W_]+", _split(header)[0].casefold()) if word]
    return quantity if _matches(own, phrase.split(), exact) and not _longer_phrase(own, quantity) else None


def _matches(own: list[str], words: list[str], exact: bool) -> bool:
    if exact:
        return own == words
    inside = any(own[k : k + len(words)] == words for k in range(len(own) - len(words) + 1))
    return inside and len("".join(words)) > 1 and not _OTHER_QUANTITIES & set(own)


def _longer_phrase(own: list[str], quantity: str) -> bool:
    """Whether a header names a true stress or strain, or the tip's deflection, when another is looked for."""
    special = {"true_stress", "true_strain", "tip_deflection"} - {quantity}
    return any(_matches(own, phrase.split(), False) for name in special for phrase in QUANTITIES[name][1])


_VOCABULARIES = {
    quantity: Vocabulary(
        dimensions={name: "" if of == "ratio" else of for name, (of, _) in QUANTITIES.items()},
        recognised={
            f"{phrase}, {exact}": partial(_recognise, quantity, phrase, exact)
            for phrase in phrases
            for exact in (True, False)
        },
    )
    for quantity, (_, phrases) in QUANTITIES.items()
}


def _names_quantity(header: str) -> bool:
    """Whether a header, or a unit apart from it, is one of a bench test."""
    known = (each for vocabulary in _VOCABULARIES.values() for each in vocabulary.recognised.values())
    return bool(_split(header)[1]) or is_unit(header) or any(each(header) for each in known)


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


def readings(table: BenchTable, columns: Mapping[str, int], units: Mapping[str, str]) -> dict[str, np.ndarray]:
    """Columns in SI without the rows in which one has no value, with a note if these are at most 1 %, as in a
    recording. Raises InputError for more."""
    found = {quantity: in_si(table, quantity, index, units) for quantity, index in columns.items()}
    complete = ~np.any([np.isnan(values) for values in found.values()], axis=0)
    lost, row = int(np.count_nonzero(~complete)), int(np.argmin(complete))
    if not lost:
        return found
    of_all, first = f"{lost} of {len(complete)} rows", table.table.place(row)
    if lost > MAX_MISSING_SHARE * len(complete):
        header = next(table.headers[columns[q]] for q, values in found.items() if np.isnan(values[row]))
        limit = f"it must be finite and at most {MAX_MAGNITUDE:g}; {of_all} have no value, and at most 1 % may"
        raise InputError(f"column {header}", "nan", limit, first, "Correct or remove this row.")
    table.notes.append(f"{of_all} have a missing value and are left out; the first is {first}")
    return {quantity: values[complete] for quantity, values in found.items()}


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


def missing(table: BenchTable, quantity: str, alternatives: str = "") -> InputError:
    """The error for a quantity without a column."""
    step = f"Give --column {quantity}=1, or another number, for each column that is used."
    if table.has_header:
        step = f"Name it {quantity}{alternatives}, or give --column {quantity}=NAME."
    return InputError(f"column {quantity}", "missing", columns_of(table.table, _names_quantity), table.file, step)
