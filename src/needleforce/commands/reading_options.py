# SPDX-License-Identifier: Apache-2.0
"""The flags by which every command reads files: those of the table of options, once."""

import inspect
from collections.abc import Callable
from functools import wraps
from typing import Annotated, Any

import typer

from ..errors import InputError
from ..recording.options import Flag, ReadOptions, flags
from .output import pairs


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
