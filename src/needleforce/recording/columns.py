# SPDX-License-Identifier: Apache-2.0
"""Recognition of quantities and units from the headers of a file's columns."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..units import find

# quantity: its dimension, and the header names that are recognised, as normalised by _plain()
QUANTITIES = {
    "time": ("time", "time t timestamp time_stamp elapsed elapsed_time"),
    "depth": ("length", "depth insertion_depth needle_depth pz p_z pos_z position_z position pos displacement travel"),
    "velocity": ("velocity", "velocity vel vz v_z velocity_z insertion_velocity speed insertion_speed"),
    "force": ("force", "force fz f_z force_z axial_force force_axial needle_force insertion_force load"),
    "fx": ("force", "fx f_x force_x"),
    "fy": ("force", "fy f_y force_y"),
    "tx": ("torque", "tx t_x torque_x mx m_x moment_x"),
    "ty": ("torque", "ty t_y torque_y my m_y moment_y"),
    "tz": ("torque", "tz t_z torque_z mz m_z moment_z"),
    "stiffness": ("force", "stiffness"),
    "friction": ("force", "friction"),
    "cutting": ("force", "cutting"),
}
AXES = tuple(QUANTITIES)[4:]
_NAMES = {name: quantity for quantity, (_, names) in QUANTITIES.items() for name in names.split()}
_IN_BRACKETS = re.compile(r"(.*?)\s*[\[(]\s*([^\])]+?)\s*[\])]\s*")
_AFTER_SLASH = re.compile(r"(.*?)\s+(?:/|in)\s+(\S+)\s*")


@dataclass(frozen=True)
class Column:
    """One used column: its quantity, header, index in the row, and the unit in its header, if any."""

    quantity: str
    header: str
    index: int
    unit: str | None


def dimension(quantity: str) -> str:
    """The dimension of a quantity: time, length, velocity, force or torque."""
    return QUANTITIES[quantity][0]


def choose(headers: list[str], wanted: tuple[str, ...], given: Mapping[str, str], place: str) -> dict[str, Column]:
    """Find the columns of the ``wanted`` quantities.

    Parameters
    ----------
    headers : list of str
        The headers of the file.
    wanted : tuple of str
        Quantities to find, keys of ``QUANTITIES``.
    given : mapping
        Quantity -> header chosen by the user; the other quantities are recognised by their headers.
    place : str
        The file, for messages.

    Returns
    -------
    dict
        Quantity -> Column for the quantities found.

    Raises
    ------
    InputError
        A given header is absent, two columns match one quantity, or a used header occurs twice.
    """
    for quantity in given:
        check_known(quantity)
    taken = {q: _named(headers, header, q, place) for q, header in given.items() if q in wanted}
    named = {index for found in taken.values() for index in found}
    for index, header in enumerate(headers):
        quantity = _NAMES.get(_plain(split(header)[0]))
        if quantity in wanted and quantity not in given and index not in named:
            taken.setdefault(quantity, []).append(index)
    return {quantity: _single(headers, quantity, found, place) for quantity, found in taken.items()}


def split(header: str) -> tuple[str, str | None]:
    """Split a header into name and unit: ``Force [N]``, ``time_us``, ``Weg (mm)``, ``F / N``."""
    plain = " ".join(header.split())  # runs of blanks would take the expressions a time with their cube
    bracketed = _IN_BRACKETS.fullmatch(plain) or _AFTER_SLASH.fullmatch(plain)
    if bracketed:
        return bracketed[1], bracketed[2]
    parts = header.split("_")
    for cut in range(1, len(parts)):
        name, suffix = "_".join(parts[:cut]), "_".join(parts[cut:])
        quantity = _NAMES.get(_plain(name))
        dimensions = [dimension(quantity)] if quantity else ["time", "length", "velocity", "force", "torque"]
        if any(find(suffix, each) for each in dimensions):
            return name, suffix
    return header, None


def missing(quantity: str, headers: list[str], place: str, instead: str = "") -> InputError:
    """The error for a quantity without a column; ``instead`` names another way to give it."""
    return InputError(
        f"no column holds the {quantity}",
        "",
        f"the columns are {', '.join(map(repr, headers))}",
        place,
        f"Choose one with --column {quantity}=NAME{instead}.",
    )


def check_known(quantity: str) -> None:
    """Raise InputError for a name that is not a quantity of a recording."""
    if quantity not in QUANTITIES:
        raise InputError("quantity", repr(quantity), f"known are {', '.join(QUANTITIES)}")


def _named(headers: list[str], wanted: str, quantity: str, place: str) -> list[int]:
    """The indices of the header that the user chose: as written, or its name without the unit."""
    exact = [i for i, header in enumerate(headers) if header == wanted.strip()]
    found = exact or [i for i, header in enumerate(headers) if _plain(split(header)[0]) == _plain(wanted)]
    if not found:
        raise InputError(
            f"column for the {quantity}",
            repr(wanted),
            f"the columns are {', '.join(map(repr, headers))}",
            place,
            f"Give one of them with --column {quantity}=NAME.",
        )
    return found


def _single(headers: list[str], quantity: str, found: list[int], place: str) -> Column:
    names = [headers[index] for index in found]
    if len(names) > 1 and len(set(names)) == 1:
        raise InputError(
            f"column {names[0]!r}",
            f"present {len(names)} times",
            "each used header must be unique",
            place,
            f"Rename one of them: it is read as the {quantity}.",
        )
    if len(names) > 1:
        raise InputError(
            f"column of the {quantity}",
            "ambiguous",
            f"{' and '.join(map(repr, names))} match",
            place,
            f"Choose one, for example with --column {quantity}={names[0]}.",
        )
    return Column(quantity, names[0], found[0], split(names[0])[1])


def _plain(name: str) -> str:
    return re.sub(r"[\W_]+", "_", name.casefold()).strip("_")


@dataclass(frozen=True, eq=False)
class NamedColumns:
    """Columns in memory, as ``Layout`` is of a text file: headers are recognised, or asked for, in the same way."""

    columns: Mapping[str, Any]
    path: Path = Path("DataFrame")
    comments: tuple[tuple[int, str], ...] = ()

    @property
    def headers(self) -> list[str]:
        """The names of the columns."""
        return [str(name) for name in self.columns]

    def place(self, row: int) -> str:
        """Where a row is: from 0, as in the DataFrame."""
        return f"{self.path}, row {row}"

    def numbers(self, columns: Mapping[str, Column]) -> tuple[dict[str, np.ndarray], str, bool]:
        """The columns as (n,) float64, no hash, and that every row has all its cells.

        Raises InputError for a column that holds no numbers or has another length than the first.
        """
        found = {quantity: self._numbers(column) for quantity, column in columns.items()}
        lengths = {len(values) for values in found.values()}
        if len(lengths) > 1:
            raise InputError("length of the columns", sorted(lengths), "one equal length is needed", str(self.path))
        return found, "", True

    def _numbers(self, column: Column) -> np.ndarray:
        values = list(self.columns.values())[column.index] if isinstance(self.columns, dict) else self._of_frame(column)
        try:
            found = np.array(values, dtype=float)
        except (TypeError, ValueError):
            kind = str(getattr(values, "dtype", type(values).__name__))
            limit, step = "a column of numbers is needed", "Convert the column."
            raise InputError(
                f"{column.quantity} (column {column.header!r})", f"of type {kind}", limit, str(self.path), step
            ) from None
        if found.ndim != 1:
            raise InputError(f"shape of {column.header!r}", found.shape, "one value a row is needed", str(self.path))
        return found

    def _of_frame(self, column: Column) -> Any:
        return self.columns.iloc[:, column.index]
