# SPDX-License-Identifier: Apache-2.0
"""The motion of a recording that is in another table: a second file, or a table of the same file with its own clock."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from ..errors import InputError
from .card import Preamble
from .formats.detect import format_of, tables_of
from .options import ReadOptions
from .parts import Part, chosen_part, parts_of
from .roles import MOTION_PREFIX, of_main, of_motion
from .stream import Stream, read_stream
from .table import Table

OF_MOTION = "motion: "  # how the quantity of an error begins that is of the motion
OPTION = "--motion-part"
_MAX_LISTED = 8  # tables in a message
_WANTED = ("time", "depth", "velocity")
_STARTED = "wf_start_time"  # when the first value of a waveform was taken


@dataclass(frozen=True, kw_only=True)
class MotionSource:
    """Where the motion is: the file, with its tables if the force is in it, too, and the name or number of its table,
    None for a file with one; ``shift`` [s] is added to its times, None if it is not given."""

    path: Path
    tables: Sequence[Table] | None = None
    part: str | int | None = None
    shift: float | None = None

    def chosen(self, columns: Mapping[str, Any] | None) -> Part:
        """The table of the motion. Raises InputError if it is absent, or needed and not given."""
        tables = _tables_with_motion(self.path) if self.tables is None else self.tables
        return chosen_part(motion_parts(tables, columns), self.part, self.path, OPTION)

    def stream(self, columns: Mapping[str, Any] | None, units: Mapping[str, str] | None) -> tuple[Stream, Part]:
        """The motion in SI, and its table. Raises InputError as ``read``, with the options that apply to it."""
        part = self.chosen(columns)
        try:
            default = of_main(units)
            stream = read_stream(part.table, part.roles, _WANTED, of_motion(units), default_units=default)
        except InputError as error:
            raise _of_motion_options(error, part.name) from None
        stream.values["time"] = stream.values["time"] + (self.shift or 0.0)
        return stream, part

    def described(self, stream: Stream, part: Part) -> str:
        """How a sentence calls it."""
        table = f"the table {part.name!r} of " if part.name else ""
        return table + ("the file" if self.tables is not None else f"{stream.place} (SHA-256 {stream.sha256})")

    def start_offset(self, main: Table | None, motion: Table) -> float:
        """By how much later the first value of the motion was taken than that of the force [s]; 0 unless both tables
        are in one file and state when, and no shift is given."""
        if main is None or self.tables is None or self.shift is not None:
            return 0.0
        starts = [_started(table) for table in (main, motion)]
        return (starts[1] - starts[0]).total_seconds() if None not in starts else 0.0


def motion_source(
    path: Path, main: Part | None, tables: Sequence[Table], options: ReadOptions, card: Preamble | None = None
) -> MotionSource | None:
    """Where the motion of a recording of the file ``path`` is, None if it is in ``main``, the table of the force.

    As the options say, or the card; else in the only one of the ``tables`` of the file that has a motion, if both state
    when they begin. Raises InputError for a card with no name of a file.
    """
    motion, part, shift = options.motion, options.motion_part, options.motion_shift
    if motion is not None:
        return MotionSource(path=Path(motion), part=part, shift=shift)
    if part is not None:
        return MotionSource(path=path, tables=tables or None, part=part, shift=shift)
    name = card.text("motion") if card else ""
    if card is None or not name:
        other = None if options.speed or options.step else _with_known_start(main, tables, options.columns)
        return other and MotionSource(path=path, tables=tables, part=other.name, shift=shift)
    filename = Path(name).name
    if not filename or filename == ".." or "\0" in filename:
        raise card.refusal("motion", "the name of a file in the same folder is needed")
    return MotionSource(path=path.with_name(filename), shift=shift)


def _with_known_start(main: Part | None, tables: Sequence[Table], columns: Mapping[str, Any] | None) -> Part | None:
    """The only other table with a motion, if the one of the force has none and both state when they begin."""
    if main is None or _has_motion(main) or _has_length(main) or _started(main.table) is None:
        return None
    others = [each for each in motion_parts(tables, columns) if each.table.name != main.table.name]
    others = [each for each in others if _has_motion(each) or _has_length(each)]
    return others[0] if len(others) == 1 and _started(others[0].table) is not None else None


def _tables_with_motion(path: Path) -> Sequence[Table]:
    """The tables of a file. Raises InputError as ``read``, and for a log."""
    if format_of(path).log:
        limit = "a table of time and depth or velocity is needed, and this is a log of messages"
        raise InputError("motion", path.name, limit, str(path), "Export the positions as CSV, and give that file.")
    return tables_of(path)


def motion_parts(tables: Sequence[Table], columns: Mapping[str, Any] | None) -> list[Part]:
    """The tables of a file that have a depth or a velocity; all if none has. Raises InputError as ``read``."""
    return parts_of(tables, of_motion(columns), (_has_motion, _has_length))


def motion_advice(
    error: InputError, tables: Sequence[Table], used: Part, columns: Mapping[str, Any] | None
) -> InputError:
    """The error for a missing depth, with the option that joins another table of the file if one has it."""
    if not error.quantity.startswith("no column holds the") or "depth" not in error.quantity:
        return error
    others = [part for part in motion_parts(tables, columns) if part.name != used.name and _has_motion(part)]
    if not others:
        return error
    names = ", ".join(repr(part.name) for part in others[:_MAX_LISTED])
    limit = f"{error.limit}; {names} of the file {'has' if len(others) == 1 else 'have'} a depth or velocity"
    otherwise = error.next_step[:1].lower() + error.next_step[1:]
    step = f"Give {OPTION} {others[0].name!r} to put its motion on the clock of the force. Otherwise {otherwise}"
    return InputError(error.quantity, error.value, limit, error.place, step)


def _started(table: Table) -> datetime | None:
    text = next((text for _, text in table.comments if text.startswith(f"{_STARTED}: ")), "")
    try:
        return datetime.fromisoformat(text.removeprefix(f"{_STARTED}: "))
    except ValueError:
        return None


def _has_motion(part: Part) -> bool:
    """Whether a table has a depth or a velocity by its headers."""
    return bool(part.roles.found(_WANTED).keys() & {"depth", "velocity"})


def _has_length(part: Part) -> bool:
    """Whether a table has one column with a unit of length."""
    return bool(part.roles.by_unit(["depth"]))


def _of_motion_options(error: InputError, name: str) -> InputError:
    """The error with the names of options that apply to the motion."""
    step = error.next_step
    for option in ("--column ", "--unit "):
        step = step.replace(option, f"{option}{MOTION_PREFIX}")
    if error.quantity == "no column holds the time":
        step = step.removesuffix(".") + "; or save it with a column of time, or a rate such as fs."
    place = error.place if not name or name in error.place else f"{error.place}, {name}"
    return InputError(f"{OF_MOTION}{error.quantity}", error.value, error.limit, place, step)
