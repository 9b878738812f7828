# SPDX-License-Identifier: Apache-2.0
"""Arrays of a file as tables: vectors of one length belong together, with the matrices that have as many rows."""

import errno
import math
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ...errors import InputError, printable
from ...files import MAX_SAMPLES, check_count, digest
from ..quantities import split
from ..recording import Note
from ..table import Table

MAX_COLUMNS = 1024  # of a table: a recorder of all channels of a laboratory writes some hundred
MAX_SIGNALS = 64  # columns of a matrix: one with more is an image or a map
MAX_TABLES = 4096  # of a file: cycles of a cyclic test, curves of a map
_MAX_COMMENTS = 256  # single values and texts that are kept with a table
_MAX_NAME_CHARS = 200
_MESSAGE_CHARS = 160  # of a library's message that are printed
_NOTED = 8  # names in a note
_EXPORT_AGAIN = "Check that the file is complete, or export it again."


@dataclass(frozen=True, kw_only=True)
class Array:
    """A vector (n,) or a matrix (n, k) of a file before its values are read.

    Parameters
    ----------
    name : str
        Its name within its level.
    rows, columns : int
        Its shape; 1 column for a vector.
    read : callable
        Index of a column -> its values (n,).
    headers, units : list of str
        One for each column, if the file states them.
    numeric : bool
        Whether it holds numbers; other columns are kept next to them, and refused when they are read.
    vector : bool
        Whether it belongs to the other vectors of its length; a matrix becomes a table of its own if there are none.
    """

    name: str
    rows: int
    columns: int = 1
    read: Callable[[int], np.ndarray]
    headers: list[str] = field(default_factory=list)
    units: list[str] = field(default_factory=list)
    numeric: bool = True
    vector: bool = True


def vector(name: str, values: np.ndarray, unit: str = "") -> Array:
    """A vector (n,) of numbers that is in memory."""
    return Array(name=name, rows=len(values), read=lambda _: values, units=[unit])


@dataclass(kw_only=True)
class FileArrays:
    """Collects the tables of one file.

    Parameters
    ----------
    path : Path
        The file.
    format : str
        The name of its format in messages.
    header : callable
        Name of a matrix and index of a column -> the header of the column.
    separator : str
        Between the names of the levels.
    step : str
        What to do with a file without a table.
    """

    path: Path
    format: str
    header: Callable[[str, int], str]
    separator: str = "."
    step: str = "Save vectors of one length, one for each quantity, as plain numbers."
    tables: list[Table] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)
    sha256: str = ""

    def __post_init__(self) -> None:
        self.sha256 = self.sha256 or digest(self.path)

    def add(self, level: str, arrays: Iterable[Array], comments: Iterable[tuple[str, object]] = ()) -> None:
        """Add the arrays of one level of the file, such as a group: one table for each length.

        A matrix joins the vectors that are as long as it; without any it is a table of its own. ``comments`` are the
        single values and texts of the level.
        """
        arrays = list(arrays)
        lines = [f"{name}: {value}" for name, value in comments][:_MAX_COMMENTS]
        lengths = dict.fromkeys(each.rows for each in arrays if each.vector)
        matrices = [each for each in arrays if not each.vector and each.rows not in lengths]
        for length in lengths:
            joined = [each for each in arrays if each.rows == length and each not in matrices]
            rows = f"({length} rows)" if len(lengths) > 1 or not level else ""
            self._table(f"{level} {rows}".strip(), joined, lines)
        for each in matrices:
            self._table(f"{level.rstrip(self.separator)}{self.separator if level else ''}{each.name}", [each], lines)

    def leave_out(self, what: str) -> None:
        """Remember what is no table; ``finish`` names it."""
        self.left_out.append(clean(what))

    def finish(self) -> list[Table]:
        """The tables. Raises InputError, with what was left out, if there is none."""
        shown = ", ".join(self.left_out[:_NOTED]) + (" ..." if len(self.left_out) > _NOTED else "")
        if not self.tables:
            limit = f"a table of numbers is needed{f'; it has {shown}' if shown else ''}"
            raise InputError("file", f"{self.format} without a table", limit, str(self.path), self.step)
        if len(self.tables) == 1:
            self.tables = [replace(self.tables[0], name="")]
        if shown:
            note = Note("left_out", f"no columns of numbers and left out: {shown}", len(self.left_out))
            for each in self.tables:
                each.notes.append(note)
        return self.tables

    def _table(self, name: str, arrays: list[Array], lines: list[str]) -> None:
        if not any(each.numeric for each in arrays):
            for each in arrays:
                self.leave_out(f"{each.name} (no numbers)")
            return
        readers, headers, units = [], [], []
        for each in arrays:
            for index in range(each.columns):
                given = each.headers[index] if index < len(each.headers) else ""
                own = each.name if each.columns == 1 and each.vector and each.name else self.header(each.name, index)
                headers.append(clean(given or own))
                units.append(clean(each.units[index]) if index < len(each.units) else "")
                readers.append((each, index))
        check_count("columns", len(headers), MAX_COLUMNS, self.path)
        check_count("samples", arrays[0].rows, MAX_SAMPLES, self.path)
        check_count("tables", len(self.tables) + 1, MAX_TABLES, self.path)

        def read_column(index: int) -> np.ndarray:
            array, column = readers[index]
            with reading(self.path, self.format):
                return numbers(array.read(column), headers[index], self.path)

        self.tables.append(
            Table(
                path=self.path,
                headers=headers,
                units=units,
                read_column=read_column,
                name=clean(name),
                comments=[(0, clean(line)) for line in lines],
                sha256=self.sha256,
            )
        )


@contextmanager
def reading(path: Path, what: str, step: str = _EXPORT_AGAIN) -> Iterator[None]:
    """Convert any exception of a format's library into an InputError, and show none of its warnings."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except (InputError, MemoryError):
        raise
    except Exception as error:  # their exceptions have no common base class
        if isinstance(error, OSError) and error.errno == errno.ENOMEM:  # of a file that is mapped
            raise MemoryError from error
        why = " ".join(f"{type(error).__name__}: {error}".split())[:_MESSAGE_CHARS]
        raise InputError("file", f"not readable as {what}", why, str(path), step) from error


def numbers(values: np.ndarray, header: str, path: Path) -> np.ndarray:
    """Values (n,) as float64; time stamps and durations in seconds. Raises InputError for what is no number."""
    kind = values.dtype.kind
    if kind in "mM":
        seconds = values.astype(f"{kind}8[ns]").astype(np.int64) / 1e9
        return np.where(np.isnat(values), np.nan, seconds)
    if kind not in "iuf":
        limit = "a column of numbers is needed"
        value = f"of type {str(values.dtype)[:_MESSAGE_CHARS]}"
        raise InputError(f"column {header!r}", value, limit, str(path), "Choose another column, or convert it.")
    with np.errstate(all="ignore"):
        return np.array(values, dtype=float)


def seconds_header(name: str, dtype: np.dtype) -> str:
    """The header of a column; time stamps and durations contain their unit and are read in seconds."""
    return f"{split(name)[0]} [s]" if dtype.kind in "mM" else ""


def orientation(shape: tuple[int, ...]) -> tuple[int, int, bool] | None:
    """Rows, columns, and whether the rows of the array are the columns of the table, because there are fewer of them.

    None for a shape that is no table: less than two values in each column, more than two dimensions above 1, or more
    than ``MAX_SIGNALS`` columns.
    """
    sides = [size for size in shape if size != 1] if len(shape) > 2 else list(shape)
    if len(sides) > 2 or not sides:
        return None
    rows, columns = max(sides), min(sides) if len(sides) == 2 else 1
    if rows < 2 or not 1 <= columns <= MAX_SIGNALS:
        return None
    return rows, columns, len(sides) == 2 and sides[0] < sides[1]


def check_size(size: int, limit: int, path: Path) -> None:
    """Raise InputError for bytes beyond those to which a file may unpack."""
    if size > limit:
        limits = f"at most {limit >> 20} MiB for a file of this size"
        raise InputError("unpacked size", f"{size >> 20} MiB", limits, str(path), "Check that it is a recording.")


def size_of(shape: Iterable[int], itemsize: int) -> int:
    """Bytes of an array."""
    return math.prod(shape) * max(itemsize, 1)


def clean(text: str) -> str:
    """A text of a file on one line, without control characters, of a length that can be shown."""
    return " ".join(printable(text[: 4 * _MAX_NAME_CHARS]).split())[:_MAX_NAME_CHARS]
