# SPDX-License-Identifier: Apache-2.0
"""The flags of a command: a parameter that is a dataclass stands for its fields, and ``ReadOptions`` for the flags by
which every command reads files."""

import inspect
from collections.abc import Callable, Iterable, Iterator
from dataclasses import MISSING, fields, is_dataclass
from functools import wraps
from typing import Annotated, Any

import typer

from ..errors import InputError
from ..recording.options import Flag, ReadOptions, flags
from .output import pairs


def takes_flags(*named: str, part: str | None = None) -> Callable[[Callable], Callable]:
    """A command whose dataclasses are given by flags, one a field.

    Of reading these are the flags that all commands have, then those that are ``named``; a flag of the command with the
    name of one takes its place, and is left to the command. ``part`` is the default of ``--part``.
    """
    table = flags()
    names = [name for name, flag in table.items() if not flag.named] + list(named)

    def decorated(command: Callable) -> Callable:
        parameters = list(inspect.signature(command).parameters.values())
        own = {each.name: each for each in _spread(parameters)}
        shown = _shown(own, {name: _parameter(name, table[name], part) for name in names})
        of_reading = [name for name in names if name not in own]

        @wraps(command)
        def run(**given: Any) -> None:
            if "reading" in own:
                values = {name: _value(table[name], given.pop(name)) for name in of_reading}
                given["reading"] = _checked(ReadOptions(**values))
            command(**_gathered(parameters, given))

        run.__signature__ = inspect.Signature(shown)
        run.__annotations__ = {each.name: each.annotation for each in shown}
        return run

    return decorated


def _spread(parameters: Iterable[inspect.Parameter]) -> Iterator[inspect.Parameter]:
    """The parameters, with the fields of a dataclass in its place."""
    for each in parameters:
        if _is_group(each):
            yield from _spread(_fields(each.annotation))
        else:
            yield each.replace(kind=inspect.Parameter.KEYWORD_ONLY)


def _gathered(parameters: Iterable[inspect.Parameter], given: dict[str, Any]) -> dict[str, Any]:
    """What was given, with each dataclass made from the values of its fields."""
    return {
        each.name: each.annotation(**_gathered(_fields(each.annotation), given))
        if _is_group(each)
        else given[each.name]
        for each in parameters
    }


def _is_group(parameter: inspect.Parameter) -> bool:
    return is_dataclass(parameter.annotation) and parameter.annotation is not ReadOptions


def _fields(of_class: type) -> Iterator[inspect.Parameter]:
    for each in fields(of_class):
        default = each.default if each.default_factory is MISSING else each.default_factory()
        default = inspect.Parameter.empty if default is MISSING else default
        yield inspect.Parameter(each.name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=each.type)


def _shown(own: dict[str, inspect.Parameter], of_reading: dict[str, inspect.Parameter]) -> list[inspect.Parameter]:
    """The flags in the order of the help: those of reading in the place of ``reading``."""
    if "reading" not in own:
        return list(own.values())
    shown: list[inspect.Parameter] = []
    for name, each in own.items():
        if name == "reading":
            shown += [own.get(flag, parameter) for flag, parameter in of_reading.items()]
        elif name not in of_reading:
            shown.append(each)
    return shown


def _parameter(name: str, flag: Flag, part: str | None) -> inspect.Parameter:
    kind, default = (list[str], []) if flag.kind is list else (flag.kind | None, part if name == "part" else None)
    annotation = Annotated[kind, typer.Option(flag.word, help=flag.help)]
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)


def _value(flag: Flag, given: Any) -> Any:
    """What was given, in SI."""
    if flag.kind is list:
        return pairs(given, flag.word.strip("-"))
    return given if given is None or flag.factor is None else flag.factor * given


def _checked(reading: ReadOptions) -> ReadOptions:
    """The options, which apply to every file: an error is wrong usage, not an unreadable file."""
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
    return reading
