# SPDX-License-Identifier: Apache-2.0
"""The motion of a recording that is in another table: a second file, or a table of the same file with its own clock."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from ..errors import InputError
from .formats.detect import format_of, tables_of
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
    """Where the motion is: the file, and the name or number of its table, None for a file with one; ``same_file`` if
    the force is in it, too; ``shift`` [s] is added to its times, None if it is not given."""

    path: Path
    part: str | int | None = None
    same_file: bool = False
    shift: float | None = None

    def chosen(self, columns: Mapping[str, Any] | None) -> Part:
        """The table of the motion. Raises InputError if it is absent, or needed and not given."""
        return chosen_part(motion_parts(self.path, columns), self.part, self.path, OPTION)

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
        return f"{table}{'the file' if self.same_file else f'{stream.place} (SHA-256 {stream.sha256})'}"

    def start_offset(self, main: Table | None, motion: Table) -> float:
        """By how much later the first value of the motion was taken than that of the force [s]; 0 unless both tables
        are in one file and state when, and no shift is given."""
        return _start_offset(main, motion) if main and self.same_file and self.shift is None else 0.0


def motion_parts(path: Path, columns: Mapping[str, Any] | None) -> list[Part]:
    """The tables of a file that have a depth or a velocity; all if none has. Raises InputError as ``read``."""
    if format_of(path).log:
        limit = "a table of time and depth or velocity is needed, and this is a log of messages"
        raise InputError("motion", path.name, limit, str(path), "Export the positions as CSV, and give that file.")
    return parts_of(tables_of(path), of_motion(columns), (_has_motion, _has_length))


def motion_advice(error: InputError, path: Path, used: Part, columns: Mapping[str, Any] | None) -> InputError:
    """The error for a missing depth, with the option that joins another table of the file if one has it."""
    if not error.quantity.startswith("no column holds the") or "depth" not in error.quantity:
        return error
    others = [part for part in motion_parts(path, columns) if part.name != used.name and _has_motion(part)]
    if not others:
        return error
    names = ", ".join(repr(part.name) for part in others[:_MAX_LISTED])
    limit = f"{error.limit}; {names} of the file {'has' if len(others) == 1 else 'have'} a depth or velocity"
    otherwise = error.next_step[:1].lower() + error.next_step[1:]
    step = f"Give {OPTION} {others[0].name!r} to put its motion on the clock of the force. Otherwise {otherwise}"
    return InputError(error.quantity, error.value, limit, error.place, step)


def _start_offset(main: Table, motion: Table) -> float:
    starts = [_started(table) for table in (main, motion)]
    return (starts[1] - starts[0]).total_seconds() if None not in starts else 0.0


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
