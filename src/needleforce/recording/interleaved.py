# SPDX-License-Identifier: Apache-2.0
"""Two streams in one table: rows of force and rows of motion, each with its own time and the other's cells empty."""

import numpy as np

from ..errors import InputError
from .recording import Note
from .table import LOST_AT_MOST, Table

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
