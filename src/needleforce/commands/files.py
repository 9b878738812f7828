# SPDX-License-Identifier: Apache-2.0
"""Reading of the files of a command: an unreadable file is reported and left out, as is a recording with invalid values
if others remain. On a terminal the user is asked for columns and units that a file does not state."""

import re
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from ..errors import InputError
from ..recording.options import ReadOptions
from .output import anonymous, progress, say, table

if TYPE_CHECKING:
    from ..campaign import Anomaly
    from ..recording import Recording
    from ..recording.look import ColumnLook
    from ..recording.reader import RecordingFile

PRESET_HELP = "Model: name of a preset, a preset file (TOML), or the JSON of a fit."
NEEDLE_HELP = "Needle: name of a preset, a preset or needle file (TOML), or the JSON of a fit."
MACHINE_HELP = (
    "Stiffness [N/mm] of sensor, holder and drive in series with the needle: the depth is then that of the tip."
)
MOTION_HELP = (
    "File with velocity or depth on its own clock; repeated once for each recording, those of second passes last."
)

ReadFiles = list[tuple[Path, "Recording | InputError"]]


def read_all(
    files: Sequence[Path], reading: ReadOptions, motion: Sequence[Path] = (), what: str = "recording"
) -> ReadFiles:
    """(file, Recording or InputError) for each file, in order; ``motion`` has one file for each, or none. With
    ``--anonymous`` the files are numbered, as ``what`` they are."""
    done = _read_each(files, reading, motion)
    return _nameless(done, what) if anonymous.wanted else done


def _read_each(files: Sequence[Path], reading: ReadOptions, motion: Sequence[Path]) -> ReadFiles:
    from ..recording.reader import open_file

    motions = list(motion) or [reading.motion] * len(files)
    if len(motions) != len(files):
        raise InputError("number of --motion files", len(motions), f"there are {len(files)} recordings",
                         next_step="Give one for each recording, in the same order.")  # fmt: skip
    done: ReadFiles = []
    for file, its_motion in progress(list(zip(files, motions)), "reading"):
        try:
            opened = open_file(file, replace(reading, motion=its_motion))
            parts = [None] if reading.part is None else [part for part, _ in opened.chosen()]
        except InputError as error:
            done.append((file, error))
            continue
        done += [(file, _read(opened, part)) for part in parts]
    return done


def _read(opened: "RecordingFile", part: str | int | None) -> "Recording | InputError":
    try:
        return opened.read(part)[0]
    except InputError as error:
        return error


def read_or_ask(
    files: Sequence[Path], reading: ReadOptions, motion: Sequence[Path] = ()
) -> tuple[ReadFiles, ReadOptions]:
    """As ``read_all``, with the options that were used. On a terminal, for standard input and output, the user is asked
    for the columns and units that a file lacks; elsewhere its error stands."""
    done = _read_each(files, reading, motion)
    lacking = [(file, each) for file, each in done if isinstance(each, InputError) and _OPTION.search(each.next_step)]
    if anonymous.wanted or not lacking or not (sys.stdin.isatty() and sys.stdout.isatty()):
        return _nameless(done) if anonymous.wanted else done, reading
    from ..recording.look import option_words

    chosen = _ask(*lacking[0], reading)
    if chosen is None:
        return done, reading
    say(f"The same without questions: {' '.join(option_words(replace(ReadOptions(), **chosen)))}")
    reading = replace(reading, **chosen)
    return read_all(files, reading, motion), reading


def _ask(file: Path, problem: InputError, reading: ReadOptions) -> dict[str, Any] | None:
    """Columns, units and rate that the user chooses from the columns of a file; None if these cannot be shown."""
    from ..recording.reader import read_file

    look = read_file(file, replace(reading, dry_run=True))
    say(f"{problem.place}: {problem.quantity}")
    columns, units, count = dict(reading.columns or {}), dict(reading.units or {}), len(look.columns)
    if not count:
        return None
    for title, headers, rows in look.tables():
        if title == "columns":
            table(title, headers, rows)
    likely = dict(re.findall(r"--column '?(\w+)=(\d+)", problem.next_step))
    for quantity, usual in (("time", "s"), ("depth", "mm"), ("force", "N")):
        known = next((k for k, each in enumerate(look.columns, 1) if each.quantity == quantity), None)
        none = " (0 if there is none)" if quantity == "time" else ""
        number = _number(f"Column of the {quantity}{none}", known or likely.get(quantity), 0 if none else 1, count)
        if number:
            columns[quantity], units[quantity] = number, _unit(quantity, look.columns[number - 1], usual)
    rate = None if "time" in columns else _number("Samples a second", None, 1, 10**6)
    if not typer.confirm("Is the force positive while the needle goes in?", default=True):
        units["force"] = f"-{units['force'].lstrip('-')}"
    return {"columns": {q: str(each) for q, each in columns.items()}, "units": units} | ({"rate": rate} if rate else {})


def _number(question: str, default: Any, low: int, high: int) -> int:
    """A whole number from ``low`` to ``high``; the question is asked until it is answered with one."""
    while not low <= (answer := typer.prompt(question, default=default and int(default), type=int)) <= high:
        say(f"{low} to {high}, please")
    return answer


def _unit(quantity: str, column: "ColumnLook", usual: str) -> str:
    """The unit of a column; the question is asked until the answer is a unit."""
    from ..recording.quantities import dimension
    from ..units import parse

    while True:
        answer = typer.prompt(f"Unit of the {quantity}", default=column.unit or usual)
        try:
            parse(answer, dimension(quantity), quantity)
        except InputError as error:
            say(f"{error.quantity} is {error.value}, {error.limit}")
        else:
            return answer


_OPTION = re.compile(r"--(column|unit) (?!motion\.)")  # of an error that the choice of columns answers


def _nameless(done: ReadFiles, what: str = "recording") -> ReadFiles:
    """The same, numbered, without names of files, texts of their cards, times and hosts in what is written of them."""
    from ..recording.recording import Card

    found: ReadFiles = []
    for k, (_, each) in enumerate(done, 1):
        label, stripped = f"{what} {k}", anonymous.stripped
        if isinstance(each, InputError):
            parts = (each.quantity, stripped(str(each.value)), stripped(each.limit), label, stripped(each.next_step))
            found.append((Path(label), InputError(*parts)))
            continue
        texts = {"assumptions": tuple(map(stripped, each.card.assumptions)), "filter_length": each.card.filter_length}
        notes = [replace(note, message=stripped(note.message)) for note in each.notes if note.kind != "origin"]
        card = Card(source=label, sha256=each.card.sha256, **texts)
        found.append((Path(label), replace(each, card=card, notes=tuple(notes))))
    return found


def readable(done: ReadFiles) -> list["Recording"]:
    """The recordings that could be read."""
    return [recording for _, recording in done if not isinstance(recording, InputError)]


def screen_recordings(done: ReadFiles) -> ReadFiles:
    """(file, Recording or InputError) for each file, with an InputError for each recording that is left out.

    Recordings with an invalid force (wrong sign, another unit, saturated up to the puncture) are left out if another
    file remains. Other anomalies are printed only: a different motion is not a fault for a model that follows it.
    """
    from ..campaign.checks import invalid_recordings

    names = [_name(file, each) for file, each in done]
    named = [(name, each) for name, (_, each) in zip(names, done) if not isinstance(each, InputError)]
    invalid, remarks = invalid_recordings(named)
    for sentence in remarks:
        say(sentence)
    if len(invalid) == len(named):
        return done
    return [
        (file, _left_out(name, invalid[name]) if name in invalid else each) for name, (file, each) in zip(names, done)
    ]


def _name(file: Path, found: "Recording | InputError") -> str:
    """The name of a file, and of the recording in it if it has several."""
    part = "" if isinstance(found, InputError) else found.card.part
    return f"{file}: {part}" if part else str(file)


def _left_out(file: str, anomaly: "Anomaly") -> InputError:
    sentence = anomaly.sentence.removesuffix(".")
    return InputError("recording", "left out of the fit", sentence[0].lower() + sentence[1:], file)
