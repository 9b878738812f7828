# SPDX-License-Identifier: Apache-2.0
"""The numbers of a file: parsed fast, and searched slowly only when something is wrong."""

import numpy as np

from ..errors import InputError
from .columns import Column
from .hashed import Hashed
from .text_layout import WHITESPACE, Layout

_SEVERAL_CORES = 5 << 20  # bytes: from here on pandas can use several, but only in parts (low_memory)
_LARGE = 1 << 28  # bytes: from here on in parts, so that memory holds the used columns and little more
_ROWS_AT_ONCE = 500_000


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
