# SPDX-License-Identifier: Apache-2.0
"""One file as quantities in SI on one clock: layout, columns, numbers, order and units settled, in this order."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from .clocks import put_in_order
from .columns import Column, choose, dimension, missing
from .layout import Layout
from .recording import Note
from .scales import settle
from .table import Table, parse


@dataclass
class Stream:
    """Quantity -> (n,) values in SI, what was assumed and what was found; ``place`` is the file."""

    place: str
    sha256: str
    values: dict[str, np.ndarray]
    said: list[str]
    notes: list[Note]


def read_stream(
    layout: Layout,
    wanted: tuple[str, ...],
    columns: Mapping[str, str],
    units: Mapping[str, str],
    units_else: Mapping[str, str] | None = None,
) -> Stream:
    """Read the ``wanted`` quantities of one file. Of these time, force, and depth or velocity must be there.

    ``columns`` and ``units`` are those given; ``units_else`` counts where a header states none. Raises InputError.
    """
    place = str(layout.path)
    chosen = choose(layout.headers, wanted, columns, place)
    notes = _leave_out_torques(chosen, units)
    required = _required(chosen, wanted, layout)
    table = parse(layout, chosen, required)
    table.notes += notes
    put_in_order(table)
    if "depth" in table.values and np.ptp(table.values["depth"]) == 0.0:
        raise constant_depth(f"depth (column {chosen['depth'].header!r})", table.values["depth"][0], place)
    bare = [quantity for quantity, column in chosen.items() if column.unit is None]
    settled, said = settle(table, {q: u for q, u in (units_else or {}).items() if q in bare} | dict(units))
    values = {quantity: unit.to_si(table.values[quantity]) for quantity, unit in settled.items()}
    _check_finer_than_clock(values["time"], table)
    return Stream(place, table.sha256, values, said, table.notes)


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


def _required(chosen: dict[str, Column], wanted: tuple[str, ...], layout: Layout) -> tuple[str, ...]:
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
