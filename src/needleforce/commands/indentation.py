# SPDX-License-Identifier: Apache-2.0
"""``needleforce indentation``: the modulus of a specimen from an indentation curve, for one or several tips."""

import dataclasses
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec
import typer

from ..errors import InputError
from ..recording.options import ReadOptions
from .files import NEEDLE_HELP, read_all
from .flags import takes_flags
from .output import JSON_HELP, check_outputs, progress, say, table, write_json

if TYPE_CHECKING:
    from ..identification.estimates import Estimate
    from ..identification.indentation_tips import TipFit
    from ..identification.indentation_unloading import UnloadingFit
    from ..recording import Recording

CONTACT_HELP = "Depth of the surface, of a curve that begins in contact; default: it is fitted."
BASELINE_HELP = "Force before contact: none, constant, line, or auto: a line where the readings there have a slope."
BETA_HELP = "Factor of the slope of the unloading: 1 for a round tip, 1.034 for a Berkovich pyramid."
SHAPES = {
    "cone": ("Cone", "half_angle"),
    "paraboloid": ("Paraboloid", "radius"),
    "sphere": ("Sphere", "radius"),
    "flat": ("Flat", "radius"),
    "blunted_cone": ("BluntedCone", "half_angle", "radius"),
    "truncated_cone": ("TruncatedCone", "half_angle", "radius"),
}
DIMENSION_OPTIONS = {"half_angle": "--half-angle-deg", "radius": "--radius-um"}
TIP_HELP = f"{', '.join(SHAPES)}; may be repeated. Needs --half-angle-deg or --radius-um, depending on the shape."


class IndentationFlags(msgspec.Struct, frozen=True, kw_only=True):
    """The flags of ``indentation``."""

    tip: Annotated[list[str], typer.Option(help=TIP_HELP)] = []
    half_angle_deg: Annotated[float | None, typer.Option(help="Half angle of a cone.")] = None
    radius_um: Annotated[float | None, typer.Option(help="Radius of the tip, of its cap, or of its flat end.")] = None
    needle: Annotated[str | None, typer.Option(help=f"{NEEDLE_HELP} Its tip and shank are used.")] = None
    poisson_ratio: Annotated[float | None, typer.Option(help="Of the specimen, to compute its Young modulus.")] = None
    baseline: Annotated[str, typer.Option(help=BASELINE_HELP)] = "auto"
    contact_depth_um: Annotated[float | None, typer.Option(help=CONTACT_HELP)] = None
    beta: Annotated[float, typer.Option(help=BETA_HELP)] = 1.0
    reading: ReadOptions
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None


@takes_flags()
def run(
    file: Annotated[Path, typer.Argument(help="File with one indentation.", show_default=False)],
    given: IndentationFlags,
) -> None:
    """Fit modulus, contact depth and baseline to an indentation curve, for one or several tips."""
    from ..identification import compare_tips
    from ..identification.indentation import checked_options
    from ..identification.indentation_unloading import judged_by_unloading

    check_outputs([given.json], [file, given.needle])
    options = {"poisson_ratio": given.poisson_ratio, "baseline": given.baseline}
    checked_options(**options)
    surface = {} if given.contact_depth_um is None else {"contact_depth": 1e-6 * given.contact_depth_um}
    tips, shank = tips_of(given.tip, given.half_angle_deg, given.radius_um, given.needle)
    documents, found = [], False
    recordings = read_all([file], dataclasses.replace(given.reading, baseline=False, test="indentation"))
    for name, recording in recordings:
        try:
            used = _approach(recording, whole=bool(given.reading.segment))
            depth, force = recording.depth[used], recording.force[used]
            rows = compare_tips(depth, force, tips, progress=progress, shank_radius=shank, **surface, **options)
            complete, stop = _complete(file, recording, given) if given.reading.segment else (recording, used.stop)
            unloadings = [_unloading(complete, stop, row, given) for row in rows]
            rows = [
                row._replace(fit=judged_by_unloading(row.fit, each)) if each else row
                for row, each in zip(rows, unloadings, strict=True)
            ]
        except InputError as error:
            say(str(error) if str(name) in error.place else f"{name}: {error}")
            continue
        part = recording.card.part
        documents.append({"file": str(name), **({"part": part} if part else {}), "samples": len(depth),
                          "tips": list(map(_document, rows, unloadings))})  # fmt: skip
        _show(rows, unloadings, part if len(recordings) > 1 else "", quiet=given.json == "-")
        found |= any(row.fit.reduced_modulus.identifiable for row in rows)
        found |= any(each.parameters["reduced_modulus"].identifiable for each in unloadings if each)
    if documents:
        write_json(documents[0] if len(recordings) == 1 else {"recordings": documents}, given.json)
    if not found:
        raise typer.Exit(1)


def _approach(recording: "Recording | InputError", *, whole: bool) -> slice:
    """The samples up to the deepest one, or of the ``whole`` recording: of a segment that was chosen."""
    from ..segmentation.strokes import deepest_sample

    if isinstance(recording, InputError):
        raise recording
    for sentence in (*recording.card.assumptions, *(note.message for note in recording.notes)):
        say(f"note: {sentence}")
    used = slice(len(recording) if whole else deepest_sample(recording.depth, recording.force) + 1)
    if not whole:
        say(f"assumed: the indentation ends at the deepest of {len(recording)} samples, number {used.stop}")
    return used


def _complete(file: Path, segment: "Recording", given: IndentationFlags) -> "tuple[Recording, int]":
    """The recording that continues after a segment of it, and the number of its samples up to the end of the segment;
    the segment itself where the file has no such recording."""
    reading = dataclasses.replace(given.reading, segment=None, baseline=False, test="indentation")
    for _, each in read_all([file], reading):
        if not isinstance(each, InputError):
            same = (each.depth == segment.depth[-1]) & (each.force == segment.force[-1])
            if same.any():
                return each, int(same.nonzero()[0][-1]) + 1
    return segment, len(segment)


def _unloading(recording: "Recording", stop: int, row: "TipFit", given: IndentationFlags) -> "UnloadingFit | None":
    """The fit of the unloading from the last sample before ``stop`` on; None without one, or where it shows no
    modulus."""
    from ..identification import fit_unloading

    back = slice(stop - 1, stop + int(recording.depth[stop - 1 :].argmin()))
    depth, force, contact = recording.depth[back], recording.force[back], row.fit.contact_depth.value
    if len(depth) < 2:
        return None
    slope, level = (0.0 if each is None else each.value for each in (row.fit.baseline_slope, row.fit.baseline))
    options = {"contact_depth": contact, "poisson_ratio": given.poisson_ratio, "shape_factor": given.beta}
    try:
        return fit_unloading(depth, force - level - slope * (depth - contact), row.fit.tip, **options)
    except InputError as error:
        say(f"no modulus of the unloading: {error}")
        return None


def _document(row: "TipFit", unloading: "UnloadingFit | None") -> dict:
    choice = {"more_than_best": row.more_than_best, "more_than_best_noise": row.noise}
    after = {} if unloading is None else {"unloading": unloading.document()}
    return row.fit.document() | choice | {"distinguishable": row.distinguishable} | after


def _show(rows: "Sequence[TipFit]", unloadings: "Sequence[UnloadingFit | None]", part: str, *, quiet: bool) -> None:
    from ..display.tables import in_words
    from ..identification.statistics.noise import INTERVAL

    head = ["quantity", f"value, {INTERVAL}", "identifiable", "how"]
    for row, unloading in zip(rows, unloadings, strict=True):
        tip = in_words(row.fit.tip)
        for note in row.fit.notes:
            say(f"{tip}: {note}")
        if quiet:
            continue
        more = f", BIC {row.more_than_best:.1f} more than the best" if len(rows) > 1 else ""
        apart = "" if row.distinguishable or not more else ", not distinguishable from it"
        title = f"{f'{part}: ' if part else ''}{tip}, residual {row.fit.residual_rms:.3g} N"
        table(title + (more + apart) * (row is not rows[0]), head, _cells(row.fit.parameters))
        if unloading is not None:
            table(f"{tip}, unloading", head, _cells(unloading.parameters))


def _cells(parameters: "dict[str, Estimate]") -> list[list[str]]:
    return [[e.name, str(e.shown), e.known, e.source] for e in parameters.values()]


def tips_of(
    shapes: list[str], half_angle_deg: float | None, radius_um: float | None, needle: str | None
) -> tuple[list, float | None]:
    """The selected tips and the radius [m] of their shank, None without one. Raises InputError for wrong usage."""
    from ..core import tips
    from ..preset_files import needle_of

    if bool(shapes) == (needle is not None):
        limit = "exactly one of the two is needed"
        advice = "Give --tip, or --needle with a file that contains a tip."
        raise InputError("--tip and --needle", "", limit, next_step=advice)
    given = {
        "half_angle": None if half_angle_deg is None else math.radians(half_angle_deg),
        "radius": None if radius_um is None else radius_um / 1e6,
    }
    _check_tips(shapes, given)
    if needle is not None:
        body = needle_of(needle)
        if body.tip is None:
            raise InputError("needle.tip", "missing", place=needle.name, next_step="Add a section [needle.tip].")
        return [body.tip], body.radius
    return [getattr(tips, SHAPES[shape][0])(*_dimensions(shape, given)) for shape in shapes], None


def _check_tips(shapes: list[str], given: dict[str, float | None]) -> None:
    """Raise InputError for an unknown shape, and for a dimension that no selected shape has."""
    for shape in shapes:
        if shape not in SHAPES:
            advice = "Give one of them, or another tip in a file with --needle."
            raise InputError("--tip", repr(shape), f"known are {', '.join(SHAPES)}", next_step=advice)
    for name, value in given.items():
        if value is not None and not any(name in SHAPES[shape] for shape in shapes):
            raise InputError(
                DIMENSION_OPTIONS[name], "given", "no selected tip has this dimension", next_step="Leave it out."
            )


def _dimensions(shape: str, given: dict[str, float | None]) -> list[float]:
    for name in SHAPES[shape][1:]:
        if given[name] is None:
            raise InputError(f"{name} of the {shape}", "missing", next_step=f"Give {DIMENSION_OPTIONS[name]}.")
    return [given[name] for name in SHAPES[shape][1:]]
