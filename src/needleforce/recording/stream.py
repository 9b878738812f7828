# SPDX-License-Identifier: Apache-2.0
"""One file as quantities in SI on one clock: layout, columns, numbers, order and units settled, in this order; two
interleaved streams taken apart."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError
from .columns import Column, choose, dimension, missing
from .parquet_table import Stored
from .recording import Note
from .table import LOST_AT_MOST, Table, drop_incomplete, load
from .text_layout import Layout
from .timestamps import put_in_order
from .unit_guess import settle

_MOTION = ("depth", "velocity")
_SHARED = 0.5  # of the smaller stream's rows: more rows with both are one stream with holes


def take_motion(table: Table, cut_off: bool) -> Table | None:
    """Part a table of two streams: the motion's rows come back, the force's stay. None, and unchanged, if it is one.

    Two streams are two rows of each alone or more, and no more rows with both than half of the smaller stream's. A row
    with both, where two stamps coincide, counts in each. Raises InputError where over 1 % of the rows have neither.
    """
    moving = [quantity for quantity in _MOTION if quantity in table.values]
    if not moving or "force" not in table.values:
        return None
    force = _present(table, ["force"], cut_off)
    motion = _present(table, moving, cut_off)
    both = np.count_nonzero(force & motion)
    counts = int(np.count_nonzero(force)), int(np.count_nonzero(motion))
    if min(counts) - both < 2 or both > _SHARED * min(counts):
        return None
    _check_third(table, force | motion, cut_off)
    told = f"rows of force ({counts[0]}) and of motion ({counts[1]}) alternate in this file, each with its own times: "
    notes = [Note("interleaved", told + "depth is interpolated onto the force's", counts[1])]
    notes += [Note("cut_off", "the last line is cut off: left out")] if cut_off else []
    other = _part(table, ["time", *moving], motion)
    own = _part(table, [quantity for quantity in table.values if quantity not in moving], force)
    table.columns, table.values, table.rows = own.columns, own.values, own.rows
    table.notes += notes
    return other


def _present(table: Table, quantities: list[str], cut_off: bool) -> np.ndarray:
    found = ~np.all([np.isnan(table.values[quantity]) for quantity in quantities], axis=0)
    found[len(found) - cut_off :] = False
    return found


def _check_third(table: Table, known: np.ndarray, cut_off: bool) -> None:
    rows = np.flatnonzero(~known[: len(known) - cut_off])
    if len(rows) > LOST_AT_MOST * len(known):
        raise InputError(
            "rows with neither force nor motion",
            len(rows),
            f"of {len(known)} rows, at most 1 % may have neither; the others are of two streams",
            table.place(int(rows[0])),
            "Remove the rows of a third stream, or save each stream in its own file and join them with motion.",
        )
    if len(rows):
        what = f"{len(rows)} rows have neither force nor motion: left out, the first is {table.place(int(rows[0]))}"
        table.notes.append(Note("missing", what, len(rows)))


def _part(table: Table, quantities: list[str], mask: np.ndarray) -> Table:
    columns = {quantity: table.columns[quantity] for quantity in quantities}
    part = Table(table.layout, columns, {q: table.values[q] for q in quantities}, sha256=table.sha256)
    part.keep(mask)
    return part


@dataclass
class Stream:
    """Quantity -> (n,) values in SI, what was assumed and what was found; ``place`` is the file.

    ``motion`` is a second stream of the same file, with times of its own: depth or velocity are there, not here.
    """

    place: str
    sha256: str
    values: dict[str, np.ndarray]
    said: list[str]
    notes: list[Note]
    motion: "Stream | None" = None


def read_stream(
    layout: Layout | Stored,
    wanted: tuple[str, ...],
    columns: Mapping[str, str],
    units: Mapping[str, str],
    units_else: Mapping[str, str] | None = None,
) -> Stream:
    """Read the ``wanted`` quantities of one file. Of these time, force, and depth or velocity must be there.

    ``columns`` and ``units`` are those given; ``units_else`` counts where a header states none. Raises InputError.
    """
    chosen = choose(layout.headers, wanted, columns, str(layout.path))
    notes = _leave_out_torques(chosen, units)
    required = _required(chosen, wanted, layout)
    table, complete, cut_off = load(layout, chosen)
    table.notes += notes
    other = None if complete else take_motion(table, cut_off)
    bare = [quantity for quantity, column in chosen.items() if column.unit is None]
    units = {q: u for q, u in (units_else or {}).items() if q in bare} | dict(units)
    if other is None:
        if not complete:
            drop_incomplete(table, required, cut_off)
        return _settled(table, units)[0]
    drop_incomplete(other, ("time", required[-1]), cut_off=False)
    motion, time_unit = _settled(other, units)
    drop_incomplete(table, ("time", "force"), cut_off=False)
    return replace(_settled(table, units | {"time": time_unit})[0], motion=motion)


def _settled(table: Table, units: Mapping[str, str]) -> tuple[Stream, str]:
    """Order, units and SI of a table without holes; and the unit of its time."""
    put_in_order(table)
    place = str(table.layout.path)
    if "depth" in table.values and np.ptp(table.values["depth"]) == 0.0:
        header = table.columns["depth"].header
        raise constant_depth(f"depth (column {header!r})", table.values["depth"][0], place)
    settled, said = settle(table, units)
    values = {quantity: unit.to_si(table.values[quantity]) for quantity, unit in settled.items()}
    _check_finer_than_clock(values["time"], table)
    return Stream(place, table.sha256, values, said, table.notes), settled["time"].symbol


def _leave_out_torques(chosen: dict[str, Column], units: Mapping[str, str]) -> list[Note]:
    """Drop the torques whose unit nobody states: unlike a force's, it cannot be guessed from the size."""
    bare = [q for q, column in chosen.items() if dimension(q) == "torque" and q not in units and column.unit is None]
    for quantity in bare:
        del chosen[quantity]
    if not bare:
        return []
    return [
        Note(
            "left_out",
            f"no unit is given for {', '.join(bare)}: left out; to keep them give --unit {bare[0]}=Nmm or the like",
            len(bare),
        )
    ]


def constant_depth(quantity: str, value: float, place: str) -> InputError:
    """The error for a needle that does not move."""
    return InputError(
        quantity,
        f"constant at {value:g}",
        "the needle must move",
        place,
        "Check which column holds the depth, and name it with --column depth=NAME.",
    )


def _required(chosen: dict[str, Column], wanted: tuple[str, ...], layout: Layout | Stored) -> tuple[str, ...]:
    moving = "depth" if "depth" in chosen or "velocity" not in chosen else "velocity"
    required = tuple(q for q in ("time", "force", moving) if q in wanted)
    for quantity in required:
        if quantity not in chosen:
            instead = ", or its own file with --motion FILE" if "force" in wanted and quantity == "depth" else ""
            raise missing(quantity, layout.headers, str(layout.path), instead)
    return required


def _check_finer_than_clock(time: np.ndarray, table: Table) -> None:
    """Two stamps must stay two in seconds: a division can make neighbours of 1e15 µs equal."""
    if not (np.diff(time) > 0.0).all():
        raise InputError(
            "time",
            "too coarse",
            "its steps vanish in 64 bits",
            str(table.layout.path),
            "Subtract the time of the first sample before saving.",
        )
