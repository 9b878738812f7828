# SPDX-License-Identifier: Apache-2.0
"""The options of ``read``, a row each: name, type, flag with its unit, and default; their words stand above the rows.

The keywords of ``nf.read``, ``nf.read_all`` and ``campaign`` with their documentation, the flags of every command that
reads files, the keys of mapping files and the command that ``inspect`` prints follow from these rows.
"""

import os
from collections.abc import Callable, Mapping
from dataclasses import Field, dataclass, fields
from functools import wraps
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import Annotated, Any, Concatenate, Literal, ParamSpec, Protocol, TypeVar, get_origin, overload

Keywords = ParamSpec("Keywords")
_Options = TypeVar("_Options")
_Source = TypeVar("_Source")
_Result = TypeVar("_Result")
_Read = TypeVar("_Read", covariant=True)
_Seen = TypeVar("_Seen", covariant=True)


class Reading(Protocol[Keywords, _Read, _Seen]):
    """What reads a file: the type of its result is another one with ``dry_run=True``."""

    @overload
    def __call__(self, path: str | os.PathLike, *, dry_run: Literal[True], **keywords: Any) -> _Seen: ...
    @overload
    def __call__(self, path: str | os.PathLike, *given: Keywords.args, **named: Keywords.kwargs) -> _Read: ...


@dataclass(frozen=True)
class Flag:
    """How a command line gives an option: ``--word``, its help, the type of what follows it (a list of QUANTITY=TEXT if
    it may be repeated), the factor to SI of the unit in its word, and whether only commands that name it have it."""

    word: str
    help: str
    kind: type = str
    factor: float | None = None
    named: bool = False


@dataclass(frozen=True, kw_only=True)
class FileOptions:
    """The options of ``read`` that can be those of every file in a folder.

    Parameters
    ----------
    columns : mapping, optional
        Quantity (time, depth, velocity, force, fx, fy, tx, ty, tz) -> header, or number of the column from 1. Common
        headers are recognised. One with ``*`` stands for several columns, each of a recording of its own. For MCAP
        and bags, the axis of the force and the topic or joint of the depth:
        ``{"force": "/ft/wrench:-fz", "depth": "/joint_states:needle"}``.
    units : mapping, optional
        Quantity -> unit, such as ``{"time": "us", "depth": "mm"}``; ``-N`` reverses the sign, ``0.0122N`` is the force
        of one count. Units are read from the file or recognised by plausibility; messages are in SI unless given here.
    inwards : {"increasing", "decreasing"}, optional
        Whether depth increases or decreases during insertion; by default it is recognised (see ``joining.signs_of``).
    part : str or int, optional
        Which recording, of a file with several: its name, or its number from 1. ``"cycle 3"``, or ``"NAME: cycle 3"``,
        is one cycle of a recording that repeats; a number is that of a cycle where the file has no other recordings.
    motion_part : str or int, optional
        The table with depth or velocity, by its name or number, of a motion file with several; without ``motion`` a
        table of the same file, such as a group or sheet with another rate.
    rate, speed, step : float, optional
        Of a file without time or depth: samples per second [Hz], constant speed [m/s], travel between two samples [m].
        A rate that the file states is used without, as an assumption.
    stroke, hold : float, optional
        With ``speed``: the depth [m] at which the needle stops, and the time [s] after which it is drawn out at the
        same speed. Without ``hold`` it remains there.
    motion_shift : float, optional
        Added to the times of the motion [s], if its clock has another zero. Of a motion stated by ``speed``: the time
        at which the needle starts to move, by default the first sample.
    segment : mapping, optional
        Column -> value, as text: only the rows in which each has its value, such as ``{"segment": "retract"}``.
    first_row : int, optional
        Row, or line of a text, at which the numbers begin, where rows above it are no samples.
    filter_length : int, optional
        Samples in the average filter of the force; by default the value in the file's card, or 1.
    decimate_to : float, optional
        Rate [Hz] to which the samples are reduced, of a log while it is read, so that it may have any length; see
        ``samples.Decimated`` for the filter.
    """

    columns: Annotated[
        Mapping[str, str | int] | None,
        Flag("--column", "Column of a quantity, such as force=fz; may be repeated.", list),
    ] = None
    units: Annotated[
        Mapping[str, str] | None, Flag("--unit", "Unit of a quantity, such as time=us; may be repeated.", list)
    ] = None
    inwards: Annotated[
        str | None,
        Flag(
            "--depth-inwards",
            "Whether depth is increasing or decreasing during insertion; default: as the data show it.",
        ),
    ] = None
    part: Annotated[
        str | int | None,
        Flag(
            "--part",
            "Which recording of a file with several: its name, its number from 1, names with *, all, or 'cycle *'.",
        ),
    ] = None
    motion_part: Annotated[
        str | int | None,
        Flag(
            "--motion-part",
            "Table with the depth on its own clock, of this file or of the motion file: its name or number.",
        ),
    ] = None
    rate: Annotated[float | None, Flag("--rate-hz", "Samples a second of a file without time.", float, 1.0)] = None
    speed: Annotated[
        float | None, Flag("--speed-mm-s", "Constant speed of a file without time or depth.", float, 1e-3)
    ] = None
    step: Annotated[
        float | None, Flag("--step-um", "Travel between two samples of a file without depth.", float, 1e-6)
    ] = None
    stroke: Annotated[
        float | None,
        Flag(
            "--stroke-mm", "Depth at which the needle stops; with --speed-mm-s, of a file without depth.", float, 1e-3
        ),
    ] = None
    hold: Annotated[
        float | None,
        Flag(
            "--hold-s",
            "Time at that depth, after which the needle is drawn out at the same speed; default: it remains there.",
            float,
            1.0,
        ),
    ] = None
    motion_shift: Annotated[
        float | None,
        Flag(
            "--motion-shift-s",
            "Added to the times of the motion; with --speed-mm-s, when the needle starts to move.",
            float,
            1.0,
        ),
    ] = None
    segment: Annotated[
        Mapping[str, str] | None,
        Flag("--segment", "Only the rows in which a column has a value, such as segment=0; may be repeated.", list),
    ] = None
    first_row: Annotated[
        int | None, Flag("--first-row", "Row of the file at which the samples begin, if rows above are none.", int)
    ] = None
    filter_length: Annotated[
        int | None, Flag("--filter-length", "Samples in the average filter of the force.", int, named=True)
    ] = None
    decimate_to: Annotated[
        float | None, Flag("--decimate-to-hz", "Lower rate to which the samples are reduced while read.", float, 1.0)
    ] = None

    def of_every_file(self) -> dict[str, Any]:
        """Those that can be those of every file, by name."""
        return {each.name: getattr(self, each.name) for each in fields(FileOptions)}


@dataclass(frozen=True, kw_only=True)
class ReadOptions(FileOptions):
    """All options of ``read``: those of every file, and these.

    Parameters
    ----------
    mapping : str or os.PathLike, optional
        Options kept in a TOML file, by its name or path; those given here come first. Without one ``needleforce.toml``
        in the folder of the file applies, if there is one.
    motion : str or os.PathLike, optional
        A second file with depth or velocity on its own clock with the same zero. It is interpolated onto the force's
        clock; force samples outside its times are left out. Keys such as ``motion.time`` in ``columns`` and ``units``
        apply to this file.
    start_depth : float, optional
        Depth [m] at the first sample of a velocity, from which it is integrated; by default ``start_depth_m`` in the
        file's card.
    baseline : bool
        Remove the bias of the force: the one marked in a live recording, otherwise the mean of the free travel before
        contact if it is significant (see ``force_signal.bias``). Nothing is removed without free travel.
    test : {"insertion", "indentation"}
        An indentation needs no time, and what is usual for needles is not expected of it.
    dry_run : bool
        Look at the file only: what it is, what would be assumed, and what is missing.
    """

    mapping: Annotated[
        str | os.PathLike | None,
        Flag("--as", "Options kept for an instrument: a name such as instron, or a TOML file."),
    ] = None
    motion: Annotated[
        str | os.PathLike | None, Flag("--motion", "File with velocity or depth on its own clock.", Path, named=True)
    ] = None
    start_depth: Annotated[
        float | None,
        Flag("--start-depth-mm", "Depth at the first sample of a motion file with velocity.", float, 1e-3, named=True),
    ] = None
    baseline: bool = True
    test: str = "insertion"
    dry_run: bool = False


def flags() -> dict[str, Flag]:
    """The flag of each option that has one, by the option's name."""
    return {row.name: row.type.__metadata__[0] for row in fields(ReadOptions) if get_origin(row.type) is Annotated}


def plain_type(row: Field) -> Any:
    """The type of an option, without its flag."""
    return row.type.__origin__ if get_origin(row.type) is Annotated else row.type


def keywords_of(
    options: Callable[Keywords, _Options],
) -> Callable[[Callable[[_Source, _Options], _Result]], Callable[Concatenate[_Source, Keywords], _Result]]:
    """A function of a source and a value of ``options`` as one of the source and keywords, the fields of ``options``.

    Their documentation takes the place of that of the parameter ``options``.
    """

    def decorated(
        function: Callable[[_Source, _Options], _Result],
    ) -> Callable[Concatenate[_Source, Keywords], _Result]:
        own = signature(function)
        source = next(iter(own.parameters.values()))
        keywords = [
            Parameter(row.name, Parameter.KEYWORD_ONLY, default=row.default, annotation=plain_type(row))
            for row in fields(options)
        ]
        taken = Signature([source, *keywords], return_annotation=own.return_annotation)

        @wraps(function)
        def called(*given: Any, **named: Any) -> _Result:
            values = taken.bind(*given, **named).arguments
            return function(values.pop(source.name), options(**values))

        called.__signature__ = taken
        of_value = f"    options : {options.__name__}\n        The keywords.\n"
        called.__doc__ = (function.__doc__ or "").replace(of_value, _documentation(options))
        return called

    return decorated


def _documentation(options: type) -> str:
    """The parameters in the docstrings of a class and its bases, as they are indented there."""
    texts = [(each.__doc__ or "").partition("----------\n")[2] for each in reversed(options.__mro__)]
    return "".join(text.rstrip(" ") for text in texts)
