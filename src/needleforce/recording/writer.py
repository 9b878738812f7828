# SPDX-License-Identifier: Apache-2.0
"""Recordings and their streams as files: exact, the same bytes for the same data, never half-written."""

import os
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..files import atomic_write
from ..units import symbols
from .card import card_lines
from .columns import QUANTITIES, dimension
from .parquet_table import CARD, pyarrow_for
from .recording import Card, Note, Recording

_ROWS_AT_ONCE = 10_000


def write(recording: Recording, path: str | os.PathLike) -> Path:
    """Write a recording in SI as Parquet (``.parquet``), MCAP (``.mcap``), else as CSV, with the unit in every header
    and the card as ``# key: value`` lines above.

    ``read`` gives the same arrays back, bit for bit, as long as no bias is left in the force to be removed; its
    card names the new file, and a note the ``source`` written here. Raises InputError for arrays of unequal
    length, values that are not finite, time that does not increase, unknown axes, and a folder that is not there.
    """
    match Path(path).suffix.lower():
        case ".parquet":
            return write_parquet(recording, path)
        case ".mcap":
            from .log import write_log

            return write_log(recording, path)
    columns = {name: getattr(recording, name) for name in ("time", "depth", "velocity", "force")}
    return write_columns(columns | recording.axes, path, recording.card, recording.notes)


def write_columns(
    columns: Mapping[str, np.ndarray],
    path: str | os.PathLike,
    card: Card | None = None,
    notes: Iterable[Note] = (),
    *,
    start_depth: float | None = None,
    motion: str = "",
) -> Path:
    """Write some quantities as CSV, such as time and force alone, or time and velocity of a motion on its own clock.

    ``columns`` maps a quantity to its (n,) values in SI. ``start_depth`` [m] is the depth at the first sample of a
    velocity; ``motion`` is the name of the file beside this one that holds its motion: ``read`` joins it.
    """
    target = Path(path)
    check_columns(columns, str(target))
    more = {"motion": motion, "start_depth_m": "" if start_depth is None else repr(float(start_depth))}
    header = ",".join(header_of(quantity) for quantity in columns)
    _write_whole(target, [*card_lines(card or Card(), tuple(notes), **more), header], [*columns.values()])
    return target


def write_parquet(recording: Recording, path: str | os.PathLike) -> Path:
    """Write a recording in SI, whole or not at all; the same data give the same bytes with the same pyarrow.

    Columns are float64, named as in the CSV file; the card's lines stand in the metadata. ``read`` gives the
    same arrays back, bit for bit, under the same conditions as a CSV file. Raises InputError as ``write`` does, and
    where pyarrow is not installed.
    """
    target, pyarrow = Path(path), pyarrow_for(path)
    columns = {name: getattr(recording, name) for name in ("time", "depth", "velocity", "force")} | recording.axes
    check_columns(columns, str(target))
    card = "\n".join(card_lines(recording.card, recording.notes)).encode("utf-8", "replace")
    table = pyarrow.table({header_of(name): np.asarray(values, float) for name, values in columns.items()})
    buffer = pyarrow.BufferOutputStream()
    pyarrow.parquet.write_table(
        table.replace_schema_metadata({CARD: card}),
        buffer,
        compression="zstd",
        use_dictionary=False,  # measured numbers hardly repeat
        write_page_checksum=True,
    )
    with atomic_write(target) as file:
        file.buffer.write(buffer.getvalue())
    return target


def header_of(quantity: str) -> str:
    """The header a quantity is written under, with its SI unit."""
    return f"{quantity}_{symbols(dimension(quantity))[0].replace('/', '_').replace(' ', '_')}"


def check_columns(columns: Mapping[str, np.ndarray], place: str) -> None:
    """Raises InputError for (n,) columns that no reader would take back."""
    for quantity, values in columns.items():
        if quantity not in QUANTITIES:
            raise InputError("axis", repr(quantity), f"known are {', '.join(QUANTITIES)}", place)
        if np.shape(values) != np.shape(columns["time"]) or np.ndim(values) != 1:
            raise InputError(f"shape of {quantity}", np.shape(values), f"time has {np.shape(columns['time'])}", place)
        if not np.isfinite(values).all():
            raise InputError(quantity, "not finite", f"at sample {int(np.argmin(np.isfinite(values)))}", place)
    if not (np.diff(columns["time"]) > 0.0).all():
        raise InputError("time", "not increasing", "each sample must be later than the one before", place)


def _write_whole(target: Path, head: list[str], columns: list[np.ndarray]) -> None:
    with atomic_write(target) as file:
        file.writelines(line + "\n" for line in head)
        for first in range(0, len(columns[0]), _ROWS_AT_ONCE):
            block = [np.asarray(each[first : first + _ROWS_AT_ONCE], float).tolist() for each in columns]
            file.writelines(",".join(map(repr, row)) + "\n" for row in zip(*block, strict=True))
