# SPDX-License-Identifier: Apache-2.0
"""The options of ``read``, a row each: name, type and default, the words of its documentation, its flag and unit.

The keywords of ``nf.read``, ``nf.read_all`` and ``campaign`` with their documentation, the flags of every command that
reads files, the keys of mapping files and the command that ``inspect`` prints follow from these rows.
"""

import os
from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, field, fields
from functools import wraps
from inspect import Parameter, Signature, formatannotation, signature
from pathlib import Path
from textwrap import fill
from typing import Any, Concatenate, ParamSpec, TypeVar

_P, _O, _S, _T = ParamSpec("_P"), TypeVar("_O"), TypeVar("_S"), TypeVar("_T")


@dataclass(frozen=True, kw_only=True)
class Flag:
    """How a command line gives an option: ``--word``, its help, what follows it (``list`` for QUANTITY=TEXT that may be
    repeated), the factor to SI for a word with a unit, and whether only commands that name the option have it."""

    word: str
    help: str
    kind: type
    factor: float | None
    named: bool


def option(
    default: Any,
    about: str,
    word: str = "",
    help: str = "",
    *,
    kind: type = str,
    factor: float | None = None,
    named: bool = False,
) -> Any:
    """A row: the default, what it is in Python, with its unit, and its flag, if it has one."""
    flag = Flag(word=word, help=help, kind=float if factor else kind, factor=factor, named=named) if word else None
    return field(default=default, metadata={"about": about, "flag": flag})


@dataclass(frozen=True, kw_only=True)
class FileOptions:
    """The options of ``read`` that can be those of every file in a folder."""

    columns: Mapping[str, str | int] | None = option(
        None,
        "Quantity (time, depth, velocity, force, fx, fy, tx, ty, tz) -> header, or number of the column from 1. Common "
        "headers are recognised. One with ``*`` stands for several columns, each of a recording of its own. For MCAP "
        "and bags, the axis of the force and the topic or joint of the depth: "
        '``{"force": "/ft/wrench:-fz", "depth": "/joint_states:needle"}``.',
        "--column",
        "Column of a quantity, such as force=fz; may be repeated.",
        kind=list,
    )
    units: Mapping[str, str] | None = option(
        None,
        'Quantity -> unit, such as ``{"time": "us", "depth": "mm"}``; ``-N`` reverses the sign, ``0.0122N`` is the '
        "force of one count. Units are read from the file or recognised by plausibility; messages are in SI unless "
        "given here.",
        "--unit",
        "Unit of a quantity, such as time=us; may be repeated.",
        kind=list,
    )
    inwards: str | None = option(
        None,
        'Whether depth is ``"increasing"`` or ``"decreasing"`` during insertion; by default it is recognised (see '
        "``signs.signs_of``).",
        "--depth-inwards",
        "Whether depth is increasing or decreasing during insertion; default: as the data show it.",
    )
    part: str | int | None = option(
        None,
        'Which recording, of a file with several: its name, or its number from 1. ``"cycle 3"``, or '
        '``"NAME: cycle 3"``, is one cycle of a recording that repeats; a number is that of a cycle where the file has '
        "no other recordings.",
        "--part",
        "Which recording of a file with several: its name, its number from 1, names with *, all, or 'cycle *'.",
    )
    motion_part: str | int | None = option(
        None,
        "The table with depth or velocity, by its name or number, of a motion file with several; without ``motion`` a "
        "table of the same file, such as a group or sheet with another rate.",
        "--motion-part",
        "Table with the depth on its own clock, of this file or of the motion file: its name or number.",
    )
    rate: float | None = option(
        None,
        "Samples per second [Hz], of a file without time. A rate that the file states is used without, as an "
        "assumption.",
        "--rate-hz",
        "Samples a second of a file without time.",
        factor=1.0,
    )
    speed: float | None = option(
        None,
        "Constant speed [m/s], of a file without time or depth.",
        "--speed-mm-s",
        "Constant speed of a file without time or depth.",
        factor=1e-3,
    )
    step: float | None = option(
        None,
        "Travel between two samples [m], of a file without depth.",
        "--step-um",
        "Travel between two samples of a file without depth.",
        factor=1e-6,
    )
    stroke: float | None = option(
        None,
        "With ``speed``: the depth [m] at which the needle stops.",
        "--stroke-mm",
        "Depth at which the needle stops; with --speed-mm-s, of a file without depth.",
        factor=1e-3,
    )
    hold: float | None = option(
        None,
        "With ``stroke``: the time [s] after which the needle is drawn out at the same speed. Without, it remains "
        "there.",
        "--hold-s",
        "Time at that depth, after which the needle is drawn out at the same speed; default: it remains there.",
        factor=1.0,
    )
    motion_shift: float | None = option(
        None,
        "Added to the times of the motion [s], if its clock has another zero. Of a motion stated by ``speed``: the "
        "time at which the needle starts to move, by default the first sample.",
        "--motion-shift-s",
        "Added to the times of the motion; with --speed-mm-s, when the needle starts to move.",
        factor=1.0,
    )
    first_row: int | None = option(
        None,
        "Row, or line of a text, at which the numbers begin, where rows above it are no samples.",
        "--first-row",
        "Row of the file at which the samples begin, if rows above are none.",
        kind=int,
    )
    filter_length: int | None = option(
        None,
        "Samples in the average filter of the force; by default the value in the file's card, or 1.",
        "--filter-length",
        "Samples in the average filter of the force.",
        kind=int,
        named=True,
    )

    def of_every_file(self) -> dict[str, Any]:
        """Those that can be those of every file."""
        return {each.name: getattr(self, each.name) for each in fields(FileOptions)}


@dataclass(frozen=True, kw_only=True)
class ReadOptions(FileOptions):
    """All options of ``read``."""

    mapping: str | os.PathLike | None = option(
        None,
        "Options kept in a TOML file, by its name or path; those given here come first. Without one "
        "``needleforce.toml`` in the folder of the file applies, if there is one.",
        "--as",
        "Options kept for an instrument: a name such as instron, or a TOML file.",
    )
    motion: str | os.PathLike | None = option(
        None,
        "A second file with depth or velocity on its own clock with the same zero. It is interpolated onto the force's "
        "clock; force samples outside its times are left out. Keys such as ``motion.time`` in ``columns`` and "
        "``units`` apply to this file.",
        "--motion",
        "File with velocity or depth on its own clock.",
        kind=Path,
        named=True,
    )
    start_depth: float | None = option(
        None,
        "Depth [m] at the first sample of a velocity, from which it is integrated; by default ``start_depth_m`` in the "
        "file's card.",
        "--start-depth-mm",
        "Depth at the first sample of a motion file with velocity.",
        factor=1e-3,
        named=True,
    )
    baseline: bool = option(
        True,
        "Remove the bias of the force: the one marked in a live recording, otherwise the mean of the free travel "
        "before contact if it is significant (see ``force_signal.bias``). Nothing is removed without free travel.",
    )
    test: str = option(
        "insertion",
        '``"insertion"`` or ``"indentation"``. An indentation needs no time, and what is usual for needles is not '
        "expected of it.",
    )
    dry_run: bool = option(False, "Look at the file only: what it is, what would be assumed, and what is missing.")


def flags(options: type[FileOptions] = ReadOptions) -> dict[str, Flag]:
    """The flag of each option that has one, by its name."""
    return {each.name: flag for each in fields(options) if (flag := each.metadata["flag"]) is not None}


def keywords_of(options: Callable[_P, _O]) -> Callable[[Callable[[_S, _O], _T]], Callable[Concatenate[_S, _P], _T]]:
    """A function of a source and a value of ``options`` as one of the source and keywords, the fields of ``options``.

    Their documentation takes the place of that of the parameter ``options``.
    """

    def decorated(function: Callable[[_S, _O], _T]) -> Callable[Concatenate[_S, _P], _T]:
        own = signature(function)
        source = next(iter(own.parameters.values()))
        taken = Signature([source, *map(_keyword, fields(options))], return_annotation=own.return_annotation)

        @wraps(function)
        def called(*given: Any, **named: Any) -> _T:
            values = taken.bind(*given, **named).arguments
            return function(values.pop(source.name), options(**values))

        called.__signature__ = taken
        of_value = f"options : {options.__name__}\n        The keywords."
        called.__doc__ = (function.__doc__ or "").replace(of_value, _documentation(options))
        return called

    return decorated


def _keyword(row: Any) -> Parameter:
    default = Parameter.empty if row.default is MISSING else row.default
    return Parameter(row.name, Parameter.KEYWORD_ONLY, default=default, annotation=row.type)


def _documentation(options: Any) -> str:
    """The rows in numpydoc form, as they are indented in a docstring."""
    entries = []
    for row in fields(options):
        kind = formatannotation(row.type).replace("collections.abc.", "").replace(" | None", ", optional")
        about = fill(row.metadata["about"], 120, initial_indent=8 * " ", subsequent_indent=8 * " ")
        entries.append(f"{row.name} : {kind.replace(' | ', ' or ')}\n{about}")
    return "\n    ".join(entries)
