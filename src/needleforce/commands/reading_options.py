# SPDX-License-Identifier: Apache-2.0
"""The options by which every command reads a file: the same words, once."""

import inspect
from collections.abc import Callable
from functools import wraps
from typing import Annotated, Any

import typer

INWARDS_HELP = "Whether depth is increasing or decreasing during insertion; default: as the data show it."
PART_HELP = "Which recording of a file with several: its name, its number from 1, names with *, all, or 'cycle *'."
MOTION_PART_HELP = "Table with the depth on its own clock, of this file or of the motion file: its name or number."
SPEED_HELP = "Constant speed of a file without time or depth."
STEP_HELP = "Travel between two samples of a file without depth."
STROKE_HELP = "Depth at which the needle stops; with --speed-mm-s, of a file without depth."
HOLD_HELP = "Time at that depth, after which the needle is drawn out at the same speed; default: it remains there."
MOTION_SHIFT_HELP = "Added to the times of the motion; with --speed-mm-s, when the needle starts to move."
FIRST_ROW_HELP = "Row of the file at which the samples begin, if rows above are none."
INSTRUMENT_HELP = "Options kept for an instrument: a name such as instron, or a TOML file."
# parameter of the command -> its type and words, the option of ``nf.read``, and the factor to SI
_OPTIONS: dict[str, tuple[Any, str, float | None]] = {
    "depth_inwards": (Annotated[str | None, typer.Option(help=INWARDS_HELP)], "inwards", None),
    "part": (Annotated[str | None, typer.Option(help=PART_HELP)], "part", None),
    "motion_part": (Annotated[str | None, typer.Option(help=MOTION_PART_HELP)], "motion_part", None),
    "rate_hz": (Annotated[float | None, typer.Option(help="Samples a second of a file without time.")], "rate", 1.0),
    "speed_mm_s": (Annotated[float | None, typer.Option(help=SPEED_HELP)], "speed", 1e-3),
    "step_um": (Annotated[float | None, typer.Option(help=STEP_HELP)], "step", 1e-6),
    "stroke_mm": (Annotated[float | None, typer.Option(help=STROKE_HELP)], "stroke", 1e-3),
    "hold_s": (Annotated[float | None, typer.Option(help=HOLD_HELP)], "hold", 1.0),
    "motion_shift_s": (Annotated[float | None, typer.Option(help=MOTION_SHIFT_HELP)], "motion_shift", 1.0),
    "first_row": (Annotated[int | None, typer.Option(help=FIRST_ROW_HELP)], "first_row", None),
    "instrument": (Annotated[str | None, typer.Option("--as", help=INSTRUMENT_HELP)], "mapping", None),
}


def reads_files(*, part: str | None = None, one_of_several: bool = True) -> Callable[[Callable], Callable]:
    """A command with the options of reading in place of its parameter ``reading``, to which those given are passed as
    options of ``nf.read``.

    ``part`` is the default of ``--part``, which a command without ``one_of_several`` has not.
    """
    names = [name for name in _OPTIONS if name != "part" or one_of_several]
    added = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=part if name == "part" else None,
                          annotation=_OPTIONS[name][0])
        for name in names
    ]  # fmt: skip

    def decorated(command: Callable) -> Callable:
        @wraps(command)
        def run(**given: Any) -> None:
            reading = _of_read({name: given.pop(name) for name in names})
            command(**given, reading=reading)

        own = [
            each.replace(kind=inspect.Parameter.KEYWORD_ONLY) for each in inspect.signature(command).parameters.values()
        ]
        at = next(k for k, each in enumerate(own) if each.name == "reading")
        shown = [*own[:at], *added, *own[at + 1 :]]
        run.__signature__ = inspect.Signature(shown)
        run.__annotations__ = {each.name: each.annotation for each in shown}
        return run

    return decorated


def _of_read(given: dict[str, Any]) -> dict[str, Any]:
    """Those of the options that were given, under the names of ``nf.read`` and in SI."""
    found = {}
    for name, value in given.items():
        _, option, factor = _OPTIONS[name]
        if value is not None:
            found[option] = value if factor is None else factor * value
    return found
