# SPDX-License-Identifier: Apache-2.0
"""``needleforce indentation``: the modulus of a specimen from an indentation curve, for one tip or several."""

import dataclasses
import math
from pathlib import Path
from typing import Annotated

import typer

from ..errors import InputError
from .files import COLUMN_HELP, INWARDS_HELP, UNIT_HELP, read_all
from .output import JSON_HELP, check_outputs, pairs, progress, say, table, write_json

NAME = "indentation"
SEGMENT_HELP = "Only the rows where a column has a value, as segment=0; else all up to the deepest."
SHAPES = {
    "cone": ("Cone", "half_angle"),
    "paraboloid": ("Paraboloid", "radius"),
    "sphere": ("Sphere", "radius"),
    "flat": ("Flat", "radius"),
    "blunted_cone": ("BluntedCone", "half_angle", "radius"),
    "truncated_cone": ("TruncatedCone", "half_angle", "radius"),
}
NUMBERS = {"half_angle": "--half-angle-deg", "radius": "--radius-um"}
TIP_HELP = f"{', '.join(SHAPES)}; repeat it to compare. With --half-angle-deg and --radius-um, as the shape needs."


def run(
    file: Annotated[Path, typer.Argument(help="A file with one approach.", show_default=False)],
    tip: Annotated[list[str], typer.Option(help=TIP_HELP)] = [],  # noqa: B006
    half_angle_deg: Annotated[float | None, typer.Option(help="Half angle of a cone.")] = None,
    radius_um: Annotated[float | None, typer.Option(help="Radius of a tip, of its cap or of its flat.")] = None,
    needle: Annotated[Path | None, typer.Option(help="TOML file with a needle: its tip on its shank.")] = None,
    poisson_ratio: Annotated[float | None, typer.Option(help="Of the specimen: gives its Young modulus too.")] = None,
    baseline: Annotated[str, typer.Option(help="Force without contact: none, constant or line.")] = "constant",
    column: Annotated[list[str], typer.Option(help=COLUMN_HELP)] = [],  # noqa: B006
    unit: Annotated[list[str], typer.Option(help=UNIT_HELP)] = [],  # noqa: B006
    depth_inwards: Annotated[str, typer.Option(help=INWARDS_HELP)] = "increasing",
    segment: Annotated[str | None, typer.Option(help=SEGMENT_HELP)] = None,
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None,
) -> None:
    """Fit modulus, contact depth and baseline to an indentation curve, for one tip or several."""
    from ..identification import compare_tips
    from ..identification.indentation import checked_options

    check_outputs([json], [file, needle])
    options = {"poisson_ratio": poisson_ratio, "baseline": baseline}
    checked_options(**options)
    wanted = pairs([segment], "segment") if segment else {}
    tips, shank = tips_of(tip, half_angle_deg, radius_um, needle)
    ((_, recording),) = read_all([file], column, unit, inwards=depth_inwards, baseline=False)
    try:
        depth, force = _approach(recording, file, wanted)
        rows = compare_tips(depth, force, tips, progress=progress, shank_radius=shank, **options)
    except InputError as error:
        say(str(error) if str(file) in error.place else f"{file}: {error}")
        raise typer.Exit(1) from None
    write_json({"file": str(file), "samples": len(depth), "tips": [_document(row) for row in rows]}, json)
    _show(rows, quiet=json == "-")
    if not any(row.fit.reduced_modulus.identifiable for row in rows):
        raise typer.Exit(1)


def _approach(recording, file: Path, wanted: dict[str, str]):
    """Depth and force of the rows asked for."""
    if isinstance(recording, InputError):
        raise recording
    for sentence in (*recording.card.assumptions, *(note.message for note in recording.notes)):
        say(f"note: {sentence}")
    if wanted:
        used = _rows(file, *next(iter(wanted.items())), len(recording))
    else:
        used = slice(int(recording.depth.argmax()) + 1)
        say(f"assumed: the approach ends at the deepest of {len(recording)} samples, number {used.stop}")
    return recording.depth[used], recording.force[used]


def _rows(file: Path, name: str, value: str, count: int):
    """Where the column ``name`` has ``value``; InputError names the columns seen."""
    import pandas as pd

    frame = pd.read_csv(file, sep=None, engine="python", comment="#", skipinitialspace=True, dtype=str)
    if name not in frame:
        raise InputError("--segment", repr(name), f"the columns are {', '.join(map(str, frame.columns))}")
    if len(frame) != count:
        raise InputError("rows with all values", count, f"the file has {len(frame)}", next_step="Mend the others.")
    used = (frame[name].str.strip() == value).to_numpy()
    if not used.any():
        raise InputError(f"column {name!r}", f"never {value}", f"it has {', '.join(frame[name].unique()[:8])}")
    return used


def _document(row) -> dict:
    fit = row.fit
    return {
        "tip": repr(fit.tip),
        "parameters": [dataclasses.asdict(estimate) for estimate in fit.parameters.values()],
        "residual_rms_N": fit.residual_rms,
        "bic": fit.bic,
        "more_than_best": row.more_than_best,
        "more_than_best_noise": row.noise,
        "distinguishable": row.distinguishable,
        "notes": list(fit.notes),
    }


def _show(rows, quiet: bool) -> None:
    for row in rows:
        for note in row.fit.notes:
            say(f"{row.fit.tip!r}: {note}")
        if quiet:
            continue
        shown = [
            [
                e.name,
                f"{e.value:.6g}",
                f"{e.low:.6g} to {e.high:.6g}",
                e.unit,
                "yes" if e.identifiable else "no",
                e.source,
            ]
            for e in row.fit.parameters.values()
        ]
        more = f", BIC {row.more_than_best:.1f} more than the best" if len(rows) > 1 else ""
        apart = "" if row.distinguishable or not more else ", not told apart from it"
        title = f"{row.fit.tip!r}, residual {row.fit.residual_rms:.3g} N" + (more + apart) * (row is not rows[0])
        table(title, ["quantity", "value", "95 % interval", "unit", "identifiable", "how"], shown)


def tips_of(
    shapes: list[str], half_angle_deg: float | None, radius_um: float | None, needle: Path | None
) -> tuple[list, float | None]:
    """The tips asked for, and the radius [m] of their shank, None without one. Raises InputError for wrong usage."""
    from ..core import tips
    from ..preset_files.build import read_needle

    if bool(shapes) == (needle is not None):
        raise InputError("tip", next_step="Give --tip, or --needle with a file that has one.")
    given = {
        "half_angle": None if half_angle_deg is None else math.radians(half_angle_deg),
        "radius": None if radius_um is None else radius_um / 1e6,
    }
    _known(shapes, given)
    if needle is not None:
        body = read_needle(needle)
        if body.tip is None:
            raise InputError("needle.tip", "missing", place=needle.name, next_step="Add a section [needle.tip].")
        return [body.tip], body.radius
    return [getattr(tips, SHAPES[shape][0])(*_numbers(shape, given)) for shape in shapes], None


def _known(shapes: list[str], given: dict[str, float | None]) -> None:
    """InputError for a shape that is not known, and for a number that no shape takes."""
    for shape in shapes:
        if shape not in SHAPES:
            raise InputError("--tip", repr(shape), f"known are {', '.join(SHAPES)}", next_step="Others: --needle.")
    for name, value in given.items():
        if value is not None and not any(name in SHAPES[shape] for shape in shapes):
            raise InputError(NUMBERS[name], "given", "no tip asked for has such a number", next_step="Leave it out.")


def _numbers(shape: str, given: dict[str, float | None]) -> list[float]:
    for name in SHAPES[shape][1:]:
        if given[name] is None:
            raise InputError(f"{name} of the {shape}", "missing", next_step=f"Give {NUMBERS[name]}.")
    return [given[name] for name in SHAPES[shape][1:]]
