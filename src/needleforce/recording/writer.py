# SPDX-License-Identifier: Apache-2.0
"""Recordings and their streams written to files: exactly, with the same bytes for the same data, and atomically."""

import os
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..files import atomic_write
from ..units import symbols
from .card import card_lines
from .formats.parquet import CARD, pyarrow_for
from .quantities import QUANTITIES, dimension
from .recording import Card, Note, Recording

_BLOCK_ROWS = 10_000


def write(recording: Recording, path: str | os.PathLike) -> Path:
    """Write a recording in SI as Parquet (``.parquet``), MCAP (``.mcap``), or otherwise CSV.

    A CSV file has the unit in every header and the card as ``# key: value`` lines above the table. ``read`` returns the
    same arrays, bit for bit, unless it removes a bias from the force; its card names the new file, and a note the
    ``source`` of this card.

    Parameters
    ----------
    recording : Recording
        The recording.
    path : str or os.PathLike
        The file; its ending selects the format.

    Returns
    -------
    pathlib.Path
        The file written.

    Raises
    ------
    InputError
        Arrays of unequal length, values that are not finite, a time that does not increase, an unknown axis, or a
        folder that does not exist.
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
    """Write selected quantities as CSV, such as only time and force, or time and velocity of a separate motion file.

    Parameters
    ----------
    columns : mapping
        Quantity -> (n,) array in SI; ``time`` is required.
    path : str or os.PathLike
        The file.
    card : Card, optional
        The provenance.
    notes : iterable of Note
        Notes that the file stores.
    start_depth : float, optional
        Depth [m] at the first sample of a velocity.
    motion : str
        Name of the file in the same folder that contains the motion; ``read`` joins it.

    Returns
    -------
    pathlib.Path
        The file written.

    Raises
    ------
    InputError
        As ``write``.
    """
    target = Path(path)
    check_columns(columns, str(target))
    extra = {"motion": motion, "start_depth_m": "" if start_depth is None else repr(float(start_depth))}
    header = ",".join(header_of(quantity) for quantity in columns)
    _write_csv(target, [*card_lines(card or Card(), tuple(notes), **extra), header], [*columns.values()])
    return target


def write_parquet(recording: Recording, path: str | os.PathLike) -> Path:
    """Write a recording in SI as Parquet, atomically; the same data give the same bytes with the same pyarrow.

    Columns are float64, named as in the CSV file; the card's lines are in the metadata. ``read`` returns the same
    arrays under the same conditions as for a CSV file. Raises InputError as ``write``, and if pyarrow is not installed.
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
        use_dictionary=False,  # measured values rarely repeat
        write_page_checksum=True,
    )
    with atomic_write(target) as file:
        file.buffer.write(buffer.getvalue())
    return target


def header_of(quantity: str) -> str:
    """The header of a quantity in a written file, with its SI unit."""
    return f"{quantity}_{symbols(dimension(quantity))[0].replace('/', '_').replace(' ', '_')}"


def check_columns(columns: Mapping[str, np.ndarray], place: str) -> None:
    """Raise InputError for columns that ``read`` would not accept: all must be (n,), finite and sorted by time."""
    for quantity, values in columns.items():
        if quantity not in QUANTITIES:
            raise InputError("axis", repr(quantity), f"known are {', '.join(QUANTITIES)}", place)
        if np.shape(values) != np.shape(columns["time"]) or np.ndim(values) != 1:
            raise InputError(f"shape of {quantity}", np.shape(values), f"time has {np.shape(columns['time'])}", place)
        if not np.isfinite(values).all():
            raise InputError(quantity, "not finite", f"at sample {int(np.argmin(np.isfinite(values)))}", place)
    if not (np.diff(columns["time"]) > 0.0).all():
        raise InputError("time", "not increasing", "each sample must be later than the one before", place)


def _write_csv(target: Path, head: list[str], columns: list[np.ndarray]) -> None:
    with atomic_write(target) as file:
        file.writelines(line + "\n" for line in head)
        for first in range(0, len(columns[0]), _BLOCK_ROWS):
            block = [np.asarray(each[first : first + _BLOCK_ROWS], float).tolist() for each in columns]
            file.writelines(",".join(map(repr, row)) + "\n" for row in zip(*block, strict=True))
