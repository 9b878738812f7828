# SPDX-License-Identifier: Apache-2.0
"""The flags of a command: a parameter that is a ``Struct`` stands for its fields, and ``ReadOptions`` for the flags by
which every command reads files; and what the shell completes after them."""

import glob
import inspect
import os
import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from functools import wraps
from typing import Annotated, Any

import msgspec
import typer
from typer.models import ArgumentInfo

from ..errors import InputError
from ..recording.options import Flag, ReadOptions, flags
from .output import anonymous, pairs, typed

ANONYMOUS_HELP = "Number the recordings, and leave names, texts of their cards, times and hosts out of all outputs."
_ANONYMOUS = Annotated[bool, typer.Option("--anonymous", help=ANONYMOUS_HELP)]


def takes_flags(*named: str, part: str | None = None) -> Callable[[Callable], Callable]:
    """A command whose structs are given by flags, one a field.

    Of reading these are the flags that all commands have, then those that are ``named``; a later flag of the command
    with the name of one takes its place, and is left to the command. ``part`` is the default of ``--part``.
    """
    table = flags()
    names = [name for name, flag in table.items() if not flag.named] + list(named)
    of_reading = {name: _parameter(name, table[name], part) for name in names}

    def decorated(command: Callable) -> Callable:
        parameters = list(inspect.signature(command).parameters.values())
        shown = {each.name: each for each in _spread(parameters, of_reading.values())}
        if _gives_away(shown):
            shown["anonymous"] = inspect.Parameter("anonymous", inspect.Parameter.KEYWORD_ONLY, default=False,
                                                   annotation=_ANONYMOUS)  # fmt: skip
        for name in COMPLETIONS.keys() & shown.keys():
            shown[name].annotation.__metadata__[0].autocompletion = COMPLETIONS[name]

        @wraps(command)
        def run(**given: Any) -> None:
            typed.check_numbers(given)
            anonymous.begin(given.pop("anonymous", False))
            read = {name: _value(table[name], given[name]) for name in names if shown.get(name) is of_reading[name]}
            command(**_gathered(parameters, given, read))

        run.__signature__ = inspect.Signature(list(shown.values()))
        run.__annotations__ = {name: each.annotation for name, each in shown.items()}
        return run

    return decorated


def _spread(parameters: Iterable[inspect.Parameter], of_reading: Iterable[inspect.Parameter]) -> Iterator:
    """The parameters, with the fields of a struct in its place."""
    for each in parameters:
        if each.annotation is ReadOptions:
            yield from of_reading
        elif _is_group(each):
            yield from _spread(_fields(each.annotation), of_reading)
        else:
            yield each.replace(kind=inspect.Parameter.KEYWORD_ONLY)


def _gathered(parameters: Iterable[inspect.Parameter], given: dict[str, Any], read: dict[str, Any]) -> dict[str, Any]:
    """The value of each parameter: what was given, or a struct made from it."""
    values = {}
    for each in parameters:
        if each.annotation is ReadOptions:
            values[each.name] = _checked(ReadOptions(**read))
        elif _is_group(each):
            values[each.name] = each.annotation(**_gathered(_fields(each.annotation), given, read))
        else:
            values[each.name] = given[each.name]
    return values


def _fields(of_class: type[msgspec.Struct]) -> Iterator[inspect.Parameter]:
    for each in msgspec.structs.fields(of_class):
        default = each.default if each.default_factory is msgspec.NODEFAULT else each.default_factory()
        default = inspect.Parameter.empty if default is msgspec.NODEFAULT else default
        yield inspect.Parameter(each.name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=each.type)


def _gives_away(shown: dict[str, inspect.Parameter]) -> bool:
    """Whether what a command writes has something of the files that are its arguments."""
    takes = any(isinstance(part, ArgumentInfo) for each in shown.values() for part in each.annotation.__metadata__)
    return takes and not {"json", "report", "output"}.isdisjoint(shown)


def _is_group(parameter: inspect.Parameter) -> bool:
    return isinstance(parameter.annotation, type) and issubclass(parameter.annotation, msgspec.Struct)


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


def _presets(incomplete: str) -> list[str]:
    """Presets, and files that may hold a needle or a model."""
    from ..preset_files import presets

    return _named(presets(), incomplete, ".toml", ".json")


def _mappings(incomplete: str) -> list[str]:
    """Names of options that are kept, and files that may hold some."""
    from ..recording.mappings import mapping_names

    with suppress(InputError):
        return _named(mapping_names(), incomplete, ".toml")
    return []


def _named(names: Iterable[str], incomplete: str, *endings: str) -> list[str]:
    files = [path + "/" if os.path.isdir(path) else path for path in glob.glob(f"{glob.escape(incomplete)}*")]
    return [name for name in names if name.startswith(incomplete)] + [e for e in files if e.endswith(("/", *endings))]


def _models(incomplete: str) -> list[str]:
    """Names of models, the last of several with commas."""
    from ..identification.models import IDENTIFIED

    before, comma, last = incomplete.rpartition(",")
    return [f"{before}{comma}{name}" for name in IDENTIFIED if name.startswith(last)]


def _columns(incomplete: str) -> list[tuple[str, str]]:
    """Quantities with a column of the file that was typed: its header, or its number where a shell would cut it."""
    from ..recording.reader import read_file

    files = [word for word in typed.arguments if os.path.isfile(word)]
    with suppress(InputError, OSError):
        found = enumerate(read_file(files[0], ReadOptions(dry_run=True)).columns if files else (), 1)
        named = [(each.header if re.fullmatch(r"[\w./-]+", each.header) else str(k), each.header) for k, each in found]
        pairs = [(f"{q}={name}", header) for q in ("time", "depth", "velocity", "force") for name, header in named]
        return [pair for pair in pairs if pair[0].startswith(incomplete)]
    return []


COMPLETIONS = {"preset": _presets, "axial": _presets, "needle": _presets, "model": _models, "models": _models,
               "mapping": _mappings, "columns": _columns}  # fmt: skip
"""What the shell completes after the option of a parameter."""
