# SPDX-License-Identifier: Apache-2.0
"""The values of a text file as a table: the file is hashed and parsed fast, and searched line by line only for a fault;
rows and columns with missing values are left out."""

import hashlib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..files import MAX_SAMPLES, open_regular
from .columns import Column
from .file_table import FileTable
from .recording import Note
from .text_layout import WHITESPACE, Layout

_BLOCKS_PER_TASK = 4  # blocks hashed per task, because each change of thread costs time
_PARALLEL_BYTES = 5 << 20  # bytes: larger files are parsed faster with low_memory, which uses several cores
_CHUNKED_BYTES = 1 << 28  # larger files are parsed in chunks, so that memory holds little more than the used columns
_CHUNK_ROWS, _CHUNK_CELLS = 500_000, 8_000_000  # the fewer rows of the two
MAX_MISSING_SHARE = 0.01  # share of rows with a missing value that may be left out, with a note


class HashedFile:
    """A binary file for pandas, used as a context manager; its SHA-256 is computed in another thread."""

    def __init__(self, path: Path):
        self._path, self._digest, self._ended = path, hashlib.sha256(), False
        self._waiting: list[bytes] = []

    def __enter__(self):
        self._file = open_regular(self._path)
        self._executor = ThreadPoolExecutor(1)
        return self

    def __exit__(self, *_: object):
        self._file.close()
        self._executor.shutdown()

    def __iter__(self):
        return iter(lambda: self.read(1 << 18), b"")

    def read(self, size: int = -1) -> bytes:
        """The next bytes, empty at the end."""
        data = self._file.read(size)
        self._waiting += [data] if data else []
        if len(self._waiting) == _BLOCKS_PER_TASK or not data:
            self._executor.submit(self._update, self._waiting)
            self._waiting = []
        self._ended = not data
        return data

    def _update(self, blocks: list[bytes]) -> None:
        for block in blocks:
            self._digest.update(block)

    def sha256(self) -> str:
        """The digest of the complete file, once it is closed; a file that was not read to its end is read again."""
        if self._ended:
            return self._digest.hexdigest()
        with open_regular(self._path) as file:
            return hashlib.file_digest(file, "sha256").hexdigest()


def numbers(layout: Layout, columns: dict[str, Column]) -> tuple[dict[str, np.ndarray], str, bool]:
    """The columns' values, the file's SHA-256, and whether every row certainly has as many cells as the header.

    The fast attempt assumes that the file contains only numbers: pandas then uses several cores and rejects surplus
    cells. If it fails, the slow attempt reads only the used columns and accepts comments.
    """
    size = layout.path.stat().st_size
    fast = {"dtype": np.float64, "low_memory": size >= _PARALLEL_BYTES}
    rows = min(_CHUNK_ROWS, _CHUNK_CELLS // len(layout.headers))
    used = sorted(column.index for column in columns.values())
    slow = {"dtype": dict.fromkeys(used, np.float64), "usecols": used, "comment": "#", "chunksize": rows}
    if size < _CHUNKED_BYTES:
        try:
            return *_hashed(layout, columns, fast), True
        except InputError:
            raise
        except (ValueError, OverflowError):  # pandas' own parsing errors are ValueErrors too
            pass
    try:
        values, sha256 = _hashed(layout, columns, slow)
    except InputError:
        raise
    except (ValueError, OverflowError) as error:
        search_fault(layout, columns)
        raise InputError("table", "not readable", str(error), str(layout.path)) from error
    commas = layout.above + len(values["time"]) * (len(layout.headers) - 1)
    return values, sha256, _count_delimiters(layout) == commas


def _hashed(layout: Layout, columns: dict[str, Column], options: dict) -> tuple[dict[str, np.ndarray], str]:
    with HashedFile(layout.path) as file:
        values = _parsed(file, layout, columns, options)
    return values, file.sha256()


def _parsed(file: HashedFile, layout: Layout, columns: dict[str, Column], options: dict) -> dict[str, np.ndarray]:
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
        check_samples(len(frames), layout.path)
        return {
            q: _writable(frames[column.index].to_numpy(), all_used=len(columns) == frames.shape[1])
            for q, column in columns.items()
        }
    chunks, rows = [], 0
    for frame in frames:
        chunks.append({q: frame[column.index].to_numpy() for q, column in columns.items()})
        rows += len(frame)
        check_samples(rows, layout.path)
    return {quantity: np.concatenate([chunk.pop(quantity) for chunk in chunks]) for quantity in columns}


def check_samples(count: int, path: Path) -> None:
    """Raise InputError for more samples than a recording can have."""
    if count > MAX_SAMPLES:
        limit = f"at most {MAX_SAMPLES} are read: nine hours at 1 kHz"
        raise InputError("number of samples", f"over {MAX_SAMPLES}", limit, str(path), "Split the file.")


def _writable(values: np.ndarray, all_used: bool) -> np.ndarray:
    """A writable column of a frame: itself if all columns are used, otherwise a copy, so that the frame is freed."""
    if not all_used or not values.flags.c_contiguous or values.base is None:
        return values.copy()
    try:
        values.flags.writeable = True  # pandas makes its views read-only
    except ValueError:
        return values.copy()
    return values


def _count_delimiters(layout: Layout) -> int:
    """How often the delimiter occurs in the file: with usecols, pandas accepts surplus cells."""
    if layout.delimiter == WHITESPACE:
        return -1
    with open_regular(layout.path) as file:
        return sum(block.count(layout.delimiter.encode()) for block in iter(lambda: file.read(1 << 20), b""))


def search_fault(layout: Layout, columns: dict[str, Column]) -> bool:
    """Raise InputError for the first line with text or a wrong number of cells; return whether the last line is
    truncated."""
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
                    "Correct or remove the line.",
                )
    if pending and len(cells) > len(layout.headers):
        raise pending
    return pending is not None


def _wrong_count(layout: Layout, cells: list[str], place: str) -> InputError:
    advice = "With decimal commas, separate the columns by semicolons." if layout.delimiter == "," else ""
    return InputError(
        "number of cells",
        len(cells),
        f"the header has {len(layout.headers)}",
        place,
        f"Correct or remove the line. {advice}".strip(),
    )


@dataclass(kw_only=True)
class Table:
    """The used columns as (n,) float64 arrays in the file's units; ``rows`` are their row numbers in the file, None
    if no row was left out."""

    layout: Layout | FileTable
    columns: dict[str, Column]
    values: dict[str, np.ndarray]
    notes: list[Note] = field(default_factory=list)
    rows: np.ndarray | None = None
    sha256: str = ""

    def place(self, row: int) -> str:
        """The place of a row of ``values`` in the file."""
        return self.layout.place(row if self.rows is None else int(self.rows[row]))

    def keep(self, mask: np.ndarray) -> None:
        """Keep the rows where ``mask`` is True."""
        self.rows = np.flatnonzero(mask) if self.rows is None else self.rows[mask]
        self.values = {quantity: values[mask] for quantity, values in self.values.items()}


def load(layout: Layout | FileTable, columns: dict[str, Column]) -> tuple[Table, bool, bool]:
    """Read the columns: the table, whether no value is missing, and whether its last line is truncated.

    Raises InputError for text and for a wrong number of cells.
    """
    text = isinstance(layout, Layout)
    values, sha256, all_cells = numbers(layout, columns) if text else layout.numbers(columns)
    complete = all_cells and all(map(_finite, values.values()))
    cut_off = text and not complete and search_fault(layout, columns)
    return Table(layout=layout, columns=columns, values=values, sha256=sha256), complete, cut_off


def _finite(values: np.ndarray) -> bool:
    """Whether all of (n,) values are finite; a finite sum proves it faster than a test of each value."""
    with np.errstate(all="ignore"):
        return bool(np.isfinite(values.sum()) or np.isfinite(values).all())


def drop_incomplete(table: Table, required: tuple[str, ...], cut_off: bool) -> None:
    """Leave out rows with missing values, with a note, if they are at most 1 % or a truncated last line.

    A column that is not ``required`` and misses more values is left out itself. Raises InputError for infinite values
    and for a required column with more missing values.
    """
    for quantity, values in table.values.items():
        infinite = np.flatnonzero(np.isinf(values))
        if len(infinite):
            raise _not_finite(table, quantity, infinite, "infinite")
    for quantity in list(table.values):
        _drop_column_if_incomplete(table, quantity, quantity in required, cut_off)
    complete = ~np.any([np.isnan(values) for values in table.values.values()], axis=0)
    if cut_off and not complete[-1]:
        table.notes.append(Note("cut_off", "the last line is truncated and is left out"))
    lost = int(np.count_nonzero(~complete)) - (cut_off and not complete[-1])
    if lost:
        first = table.place(int(np.argmin(complete)))
        message = f"{lost} of {len(complete)} rows have a missing value and are left out; the first is {first}"
        table.notes.append(Note("missing", message, lost))
    if not complete.all():
        table.keep(complete)


def _drop_column_if_incomplete(table: Table, quantity: str, required: bool, cut_off: bool) -> None:
    """Raise InputError for a required column with too many missing values; leave out another one, with a note."""
    gaps = np.flatnonzero(np.isnan(table.values[quantity]))
    count = len(gaps) - bool(cut_off and len(gaps) and gaps[-1] == len(table.values[quantity]) - 1)
    if count <= MAX_MISSING_SHARE * len(table.values[quantity]):
        return
    if required:
        raise _not_finite(table, quantity, gaps, "missing or not a number")
    table.notes.append(Note("left_out", f"{quantity} has {count} missing values: the column is left out", count))
    del table.values[quantity]


def _not_finite(table: Table, quantity: str, rows: np.ndarray, what: str) -> InputError:
    total = len(table.values[quantity])
    advice = "Remove these lines, or record again."
    if 0.2 * total < len(rows) < total:
        advice = "If this column has a slower clock than the others, save it in its own file and give it with --motion."
    header = table.columns[quantity].header
    limit = f"{len(rows)} of {total} rows, at most 1 % may be missing" if what[0] == "m" else f"in {len(rows)} rows"
    return InputError(f"{quantity} (column {header!r})", what, limit, table.place(int(rows[0])), advice)
