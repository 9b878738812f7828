# SPDX-License-Identifier: Apache-2.0
"""Reading of the files of a command: its flags, which are those of the table of options, and its recordings. An
unreadable file is reported and left out, as is a recording with invalid values if others remain."""

import inspect
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import InputError
from ..recording.options import Flag, ReadOptions, flags
from .output import pairs, progress, say

if TYPE_CHECKING:
    from ..campaign import Anomaly
    from ..recording import Recording

PRESET_HELP = "Model: name of a preset, a preset file (TOML), or the JSON of a fit."
NEEDLE_HELP = "Needle: name of a preset, a preset or needle file (TOML), or the JSON of a fit."
MOTION_HELP = (
    "File with velocity or depth on its own clock; repeated once for each recording, those of second passes last."
)

ReadFiles = list[tuple[Path, "Recording | InputError"]]


def reads_files(*named: str, part: str | None = None) -> Callable[[Callable], Callable]:
    """A command with the flags of reading in place of its parameter ``reading``, which becomes their ``ReadOptions``.

    These are the flags that all commands have, then those that are ``named``; a parameter of the command with the name
    of one takes its place, and is left to the command. ``part`` is the default of ``--part``.
    """
    table = flags()
    names = [name for name, flag in table.items() if not flag.named] + list(named)

    def decorated(command: Callable) -> Callable:
        own = {each.name: each for each in inspect.signature(command).parameters.values()}
        taken = [name for name in names if name not in own]

        @wraps(command)
        def run(**given: Any) -> None:
            values = {name: _value(table[name], given.pop(name)) for name in taken}
            reading = ReadOptions(**values)
            _check(reading)
            command(**given, reading=reading)

        shown: list[inspect.Parameter] = []
        for name, each in own.items():
            if name == "reading":
                shown += [own.get(name) or _parameter(name, table[name], part) for name in names]
            elif name not in names:
                shown.append(each.replace(kind=inspect.Parameter.KEYWORD_ONLY))
        run.__signature__ = inspect.Signature(shown)
        run.__annotations__ = {each.name: each.annotation for each in shown}
        return run

    return decorated


def _parameter(name: str, flag: Flag, part: str | None) -> inspect.Parameter:
    kind, default = (list[str], []) if flag.kind is list else (flag.kind | None, part if name == "part" else None)
    annotation = Annotated[kind, typer.Option(flag.word, help=flag.help)]
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)


def _value(flag: Flag, given: Any) -> Any:
    """What was given, in SI."""
    if flag.kind is list:
        return pairs(given, flag.word.strip("-"))
    return given if given is None or flag.factor is None else flag.factor * given


def _check(reading: ReadOptions) -> None:
    """Check the options that apply to every file; an error is wrong usage, not an unreadable file."""
    from ..recording.quantities import QUANTITIES, dimension
    from ..units import parse

    known = {*QUANTITIES, *(f"motion.{quantity}" for quantity in ("time", "depth", "velocity"))}
    for word, given in (("--column", reading.columns), ("--unit", reading.units)):
        for quantity in given:
            if quantity not in known:
                raise InputError(f"quantity of {word}", repr(quantity), f"known are {', '.join(sorted(known))}")
    for quantity, unit in reading.units.items():
        parse(unit, dimension(quantity.removeprefix("motion.")), quantity)
    if reading.inwards not in (None, "increasing", "decreasing"):
        raise InputError("--depth-inwards", repr(reading.inwards), "known are increasing and decreasing")
    if reading.filter_length is not None and reading.filter_length < 1:
        raise InputError("--filter-length", reading.filter_length, "must be at least 1")


def read_all(files: Sequence[Path], reading: ReadOptions, motion: Sequence[Path] = ()) -> ReadFiles:
    """(file, Recording or InputError) for each file, in order; ``motion`` has one file for each, or none."""
    motions = list(motion) or [reading.motion] * len(files)
    if len(motions) != len(files):
        raise InputError("number of --motion files", len(motions), f"there are {len(files)} recordings",
                         next_step="Give one for each recording, in the same order.")  # fmt: skip
    done: ReadFiles = []
    for file, its_motion in progress(list(zip(files, motions)), "reading"):
        try:
            parts = _parts(file, reading)
        except InputError as error:
            done.append((file, error))
            continue
        done += [(file, _read(file, replace(reading, motion=its_motion, part=part))) for part in parts]
    return done


def _read(file: Path, reading: ReadOptions) -> "Recording | InputError":
    from ..recording.reader import read_file

    try:
        return read_file(file, reading)
    except InputError as error:
        return error


def _parts(file: Path, reading: ReadOptions) -> Sequence[str | int | None]:
    """The recordings of a file that were chosen: all, those whose names fit a pattern with ``*``, or one."""
    from ..recording.several import chosen_parts

    return [None] if reading.part is None else [part for part, _ in chosen_parts(file, reading)]


def readable(done: ReadFiles) -> list["Recording"]:
    """The recordings that could be read."""
    return [recording for _, recording in done if not isinstance(recording, InputError)]


def screen_recordings(done: ReadFiles) -> ReadFiles:
    """(file, Recording or InputError) for each file, with an InputError for each recording that is left out.

    Recordings with an invalid force (wrong sign, another unit, saturated up to the puncture) are left out if another
    file remains. Other anomalies are printed only: a different motion is not a fault for a model that follows it.
    """
    from ..campaign.checks import check_recordings
    from ..campaign.recording_result import INVALIDATING, Anomaly
    from ..campaign.repeat_checks import OWN_FIELD

    names = [_name(file, each) for file, each in done]
    named = [(name, each) for name, (_, each) in zip(names, done) if not isinstance(each, InputError)]
    invalid: dict[str, Anomaly] = {}
    for name, found in check_recordings(named).items():
        for anomaly in found:
            if anomaly.left_out and anomaly.kind in INVALIDATING:
                invalid.setdefault(name, anomaly)
            elif anomaly.kind != "no_puncture":  # reported by the status
                say(f"{name}: {anomaly.sentence.removesuffix(OWN_FIELD).rstrip()}")
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
