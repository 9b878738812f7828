# SPDX-License-Identifier: Apache-2.0
"""The numbers of a text file: hashed, parsed fast, searched slowly only where something is wrong, and made a table
without the rows and columns that lack too much."""

import hashlib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..errors import InputError
from .columns import Column
from .parquet_table import Stored
from .recording import Note
from .text_layout import WHITESPACE, Layout

_AT_ONCE = 4  # blocks: each change of thread costs
_SEVERAL_CORES = 5 << 20  # bytes: from here on pandas can use several, but only in parts (low_memory)
_LARGE = 1 << 28  # bytes: from here on in parts, so that memory holds the used columns and little more
_ROWS_AT_ONCE = 500_000
LOST_AT_MOST = 0.01  # share of rows without a value that is left out, and told


class Hashed:
    """A binary file for pandas, to be used with ``with``; its SHA-256 is computed on another core."""

    def __init__(self, path: Path):
        self._path, self._digest, self._ended = path, hashlib.sha256(), False
        self._waiting: list[bytes] = []

    def __enter__(self):
        self._file = open(self._path, "rb", buffering=0)
        self._beside = ThreadPoolExecutor(1)
        return self

    def __exit__(self, *_):
        self._file.close()
        self._beside.shutdown()

    def __iter__(self):
        return iter(lambda: self.read(1 << 18), b"")

    def read(self, size: int = -1) -> bytes:
        """The next bytes, none at the end."""
        data = self._file.read(size)
        self._waiting += [data] if data else []
        if len(self._waiting) == _AT_ONCE or not data:
            self._beside.submit(self._update, self._waiting)
            self._waiting = []
        self._ended = not data
        return data

    def _update(self, blocks: list[bytes]) -> None:
        for block in blocks:
            self._digest.update(block)

    def sha256(self) -> str:
        """The digest of the whole file, after ``with``; what was not read yet is read now."""
        if self._ended:
            return self._digest.hexdigest()
        with open(self._path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()


def numbers(layout: Layout, columns: dict[str, Column]) -> tuple[dict[str, np.ndarray], str, bool]:
    """The columns' numbers, the file's SHA-256, and whether every row is sure to have as many cells as the header.

    Fast, if the whole file is numbers: pandas takes several cores when no column is left out and no comment is
    expected, and refuses surplus cells. Else with patience.
    """
    size = layout.path.stat().st_size
    fast = {"dtype": np.float64, "low_memory": size >= _SEVERAL_CORES}
    used = sorted(column.index for column in columns.values())
    slow = {"dtype": dict.fromkeys(used, np.float64), "usecols": used, "comment": "#", "chunksize": _ROWS_AT_ONCE}
    if size < _LARGE:
        try:
            return *_hashed(layout, columns, fast), True
        except ValueError:  # pandas' own parsing errors are ValueErrors too
            pass
    try:
        values, sha256 = _hashed(layout, columns, slow)
    except ValueError as error:
        search_fault(layout, columns)
        raise InputError("table", "not readable", str(error), str(layout.path)) from error
    commas = layout.above + len(values["time"]) * (len(layout.headers) - 1)
    return values, sha256, _count_delimiters(layout) == commas


def _hashed(layout: Layout, columns: dict[str, Column], options: dict) -> tuple[dict[str, np.ndarray], str]:
    with Hashed(layout.path) as file:
        values = _parsed(file, layout, columns, options)
    return values, file.sha256()


def _parsed(file: Hashed, layout: Layout, columns: dict[str, Column], options: dict) -> dict[str, np.ndarray]:
    import pandas  # late: importing needleforce stays fast

    frames = pandas.read_csv(
        file,
        sep=layout.delimiter,
        decimal=layout.decimal,
        compression=None,
        encoding_errors="replace",
        header=None if layout.header_commented else 0,
        skiprows=layout.skip - (not layout.header_commented),
        names=range(len(layout.headers)),
        index_col=False,
        **options,
    )
    if "chunksize" not in options:
        return {
            q: _own(frames[column.index].to_numpy(), whole=len(columns) == frames.shape[1])
            for q, column in columns.items()
        }
    chunks = [{q: frame[column.index].to_numpy() for q, column in columns.items()} for frame in frames]
    return {quantity: np.concatenate([chunk.pop(quantity) for chunk in chunks]) for quantity in columns}


def _own(values: np.ndarray, whole: bool) -> np.ndarray:
    """A frame's column to write to: itself if the ``whole`` frame is used and dropped, else a copy that frees it."""
    if not whole or not values.flags.c_contiguous or values.base is None:
        return values.copy()
    try:
        values.flags.writeable = True  # pandas marks its views as read-only
    except ValueError:
        return values.copy()
    return values


def _count_delimiters(layout: Layout) -> int:
    """How often the delimiter occurs in the file: with usecols, pandas lets surplus cells pass."""
    if layout.delimiter == WHITESPACE:
        return -1
    with open(layout.path, "rb") as file:
        return sum(block.count(layout.delimiter.encode()) for block in iter(lambda: file.read(1 << 20), b""))


def search_fault(layout: Layout, columns: dict[str, Column]) -> bool:
    """Raise InputError for the first line with text or a wrong number of cells; True if the last line is cut off."""
    pending = None
    for number, cells in layout.data_lines():
        if pending:
            raise pending
        place = f"{layout.path}, line {number}"
        if len(cells) != len(layout.headers):
            pending = _wrong_count(layout, cells, place)
        for column in columns.values():
            if column.index < len(cells) and not layout.is_number(cells[column.index]):
                raise InputError(
                    f"{column.quantity} (column {column.header!r})",
                    repr(cells[column.index][:40]),
                    "a number is needed",
                    place,
                    "Mend or remove the line.",
                )
    if pending and len(cells) > len(layout.headers):
        raise pending
    return pending is not None


def _wrong_count(layout: Layout, cells: list[str], place: str) -> InputError:
    advice = "Decimal commas need semicolons between the columns." if layout.delimiter == "," else ""
    return InputError(
        "number of cells",
        len(cells),
        f"the header has {len(layout.headers)}",
        place,
        f"Mend or remove the line. {advice}".strip(),
    )


@dataclass
class Table:
    """The used columns as (n,) float64 arrays in the file's units; ``rows`` are their rows in the file if some went."""

    layout: Layout | Stored
    columns: dict[str, Column]
    values: dict[str, np.ndarray]
    notes: list[Note] = field(default_factory=list)
    rows: np.ndarray | None = None
    sha256: str = ""

    def place(self, row: int) -> str:
        """Where a row of ``values`` stands in the file."""
        return self.layout.place(row if self.rows is None else int(self.rows[row]))

    def keep(self, mask: np.ndarray) -> None:
        """Leave out the rows where ``mask`` is False."""
        self.rows = np.flatnonzero(mask) if self.rows is None else self.rows[mask]
        self.values = {quantity: values[mask] for quantity, values in self.values.items()}


def load(layout: Layout | Stored, columns: dict[str, Column]) -> tuple[Table, bool, bool]:
    """Read the columns: the table, whether it has all its values, and whether its last line is cut off.

    Raises InputError for text and wrong numbers of cells.
    """
    text = isinstance(layout, Layout)
    values, sha256, sound = numbers(layout, columns) if text else layout.numbers(columns)
    complete = sound and all(map(_finite, values.values()))
    cut_off = text and not complete and search_fault(layout, columns)
    return Table(layout, columns, values, sha256=sha256), complete, cut_off


def _finite(values: np.ndarray) -> bool:
    """Whether all of (n,) values are: a finite sum says so faster than a look at each."""
    with np.errstate(all="ignore"):
        return bool(np.isfinite(values.sum()) or np.isfinite(values).all())


def drop_incomplete(table: Table, required: tuple[str, ...], cut_off: bool) -> None:
    """Leave out the rows that lack a ``required`` value, with a note, if they are below 1 % or a last line cut off.

    Another column that lacks more is left out itself. Raises InputError for infinite and too many missing values.
    """
    for quantity, values in table.values.items():
        infinite = np.flatnonzero(np.isinf(values))
        if len(infinite):
            raise _not_finite(table, quantity, infinite, "infinite")
    for quantity in list(table.values):
        _leave_out(table, quantity, quantity in required, cut_off)
    whole = ~np.any([np.isnan(values) for values in table.values.values()], axis=0)
    if cut_off and not whole[-1]:
        table.notes.append(Note("cut_off", "the last line is cut off: left out"))
    lost = int(np.count_nonzero(~whole)) - (cut_off and not whole[-1])
    if lost:
        first = table.place(int(np.argmin(whole)))
        what = f"{lost} of {len(whole)} rows lack a value: left out, the first is {first}"
        table.notes.append(Note("missing", what, lost))
    if not whole.all():
        table.keep(whole)


def _leave_out(table: Table, quantity: str, required: bool, cut_off: bool) -> None:
    """Refuse a required column with too many holes; leave out another one, and say so."""
    holes = np.flatnonzero(np.isnan(table.values[quantity]))
    count = len(holes) - bool(cut_off and len(holes) and holes[-1] == len(table.values[quantity]) - 1)
    if count <= LOST_AT_MOST * len(table.values[quantity]):
        return
    if required:
        raise _not_finite(table, quantity, holes, "missing or not a number")
    table.notes.append(Note("left_out", f"{quantity} lacks {count} values: the column is left out", count))
    del table.values[quantity]


def _not_finite(table: Table, quantity: str, rows: np.ndarray, what: str) -> InputError:
    total = len(table.values[quantity])
    advice = "Remove these lines, or record again."
    if 0.2 * total < len(rows) < total:
        advice = "If this column has a slower clock than the others, save it in its own file and join it with motion."
    header = table.columns[quantity].header
    limit = f"{len(rows)} of {total} rows, at most 1 % may be missing" if what[0] == "m" else f"in {len(rows)} rows"
    return InputError(f"{quantity} (column {header!r})", what, limit, table.place(int(rows[0])), advice)
