# SPDX-License-Identifier: Apache-2.0
"""The numbers of a file: parsed fast, and searched slowly only when something is wrong."""

from dataclasses import dataclass, field

import numpy as np

from ..errors import InputError
from .columns import Column
from .layout import WHITESPACE, Layout
from .recording import Note

_SEVERAL_CORES = 5 << 20  # bytes: from here on pandas can use several, but only in parts (low_memory)
_LARGE = 1 << 28  # bytes: from here on in parts, so that memory holds the used columns and little more
_ROWS_AT_ONCE = 500_000
_LOST_AT_MOST = 0.01  # share of rows without a value that is left out, and told


@dataclass
class Table:
    """The used columns as (n,) float64 arrays in the file's units; ``rows`` are their rows in the file if some went."""

    layout: Layout
    columns: dict[str, Column]
    values: dict[str, np.ndarray]
    notes: list[Note] = field(default_factory=list)
    rows: np.ndarray | None = None

    def place(self, row: int) -> str:
        """Where a row of ``values`` stands: file and line."""
        wanted = row if self.rows is None else int(self.rows[row])
        number = next(number for at, (number, _) in enumerate(self.layout.data_lines()) if at == wanted)
        return f"{self.layout.path}, line {number}"

    def keep(self, mask: np.ndarray) -> None:
        """Leave out the rows where ``mask`` is False."""
        self.rows = np.flatnonzero(mask) if self.rows is None else self.rows[mask]
        self.values = {quantity: values[mask] for quantity, values in self.values.items()}


def parse(layout: Layout, columns: dict[str, Column], required: tuple[str, ...]) -> Table:
    """Read the columns. Raises InputError for text, wrong numbers of cells, infinite and too many missing values.

    Rows that lack a ``required`` value are left out, with a note, if they are below 1 % or a last line cut off;
    another column that lacks more is left out itself.
    """
    values, sound = _numbers(layout, columns)
    table = Table(layout, columns, values)
    if not sound or not all(np.isfinite(each).all() for each in values.values()):
        _drop_incomplete(table, required, cut_off=_search_fault(layout, columns))
    return table


def _numbers(layout: Layout, columns: dict[str, Column]) -> tuple[dict[str, np.ndarray], bool]:
    """The columns' numbers, and whether every row is sure to have as many cells as the header.

    Fast, if the whole file is numbers: pandas takes several cores when no column is left out and no comment is
    expected, and refuses surplus cells. Else with patience.
    """
    size = layout.path.stat().st_size
    fast = {"dtype": np.float64, "low_memory": size >= _SEVERAL_CORES}
    used = sorted(column.index for column in columns.values())
    slow = {"dtype": dict.fromkeys(used, np.float64), "usecols": used, "comment": "#", "chunksize": _ROWS_AT_ONCE}
    if size < _LARGE:
        try:
            return _parsed(layout, columns, fast), True
        except ValueError:  # pandas' own parsing errors are ValueErrors too
            pass
    try:
        values = _parsed(layout, columns, slow)
    except ValueError as error:
        _search_fault(layout, columns)
        raise InputError("table", "not readable", str(error), str(layout.path)) from error
    return values, _count_delimiters(layout) == layout.above + len(values["time"]) * (len(layout.headers) - 1)


def _parsed(layout: Layout, columns: dict[str, Column], options: dict) -> dict[str, np.ndarray]:
    import pandas  # late: importing needleforce stays fast

    frames = pandas.read_csv(
        layout.path,
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
    frames = frames if "chunksize" in options else [frames]
    chunks = [{q: frame[column.index].to_numpy() for q, column in columns.items()} for frame in frames]
    return {quantity: np.concatenate([chunk.pop(quantity) for chunk in chunks]) for quantity in columns}


def _count_delimiters(layout: Layout) -> int:
    """How often the delimiter occurs in the file: with usecols, pandas lets surplus cells pass."""
    if layout.delimiter == WHITESPACE:
        return -1
    with open(layout.path, "rb") as file:
        return sum(block.count(layout.delimiter.encode()) for block in iter(lambda: file.read(1 << 20), b""))


def _search_fault(layout: Layout, columns: dict[str, Column]) -> bool:
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


def _drop_incomplete(table: Table, required: tuple[str, ...], cut_off: bool) -> None:
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
    if count <= _LOST_AT_MOST * len(table.values[quantity]):
        return
    if required:
        raise _not_finite(table, quantity, holes, "missing or not a number")
    table.notes.append(Note("left_out", f"{quantity} lacks {count} values: the column is left out", count))
    del table.values[quantity]


def _not_finite(table: Table, quantity: str, rows: np.ndarray, what: str) -> InputError:
    total = len(table.values[quantity])
    advice = "Remove these lines, or record again."
    if len(rows) > 0.2 * total:
        advice = "If two streams are interleaved in this file, save each in its own file and join them with motion."
    header = table.columns[quantity].header
    limit = f"{len(rows)} of {total} rows, at most 1 % may be missing" if what[0] == "m" else f"in {len(rows)} rows"
    return InputError(f"{quantity} (column {header!r})", what, limit, table.place(int(rows[0])), advice)
