# SPDX-License-Identifier: Apache-2.0
"""``needleforce tension``, ``bending`` and ``penetration``: moduli of tissue and needle, and the figures of penetration
tests, from bench tests."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec
import typer

from ..errors import InputError
from .files import NEEDLE_HELP
from .flags import takes_flags
from .output import JSON_HELP, ReportFlags, check_outputs, pairs, progress, say, show, table, write_file, write_json

if TYPE_CHECKING:
    from ..bench_tests import BendingFit, StressFit

COLUMN_HELP = "Column of a quantity by name, or by its number from 1, such as stress=1; may be repeated."
UNIT_HELP = "Unit of a quantity, such as stress=kPa; a leading minus reverses the sign; may be repeated."
MODE_HELP = "Loading: uniaxial, equibiaxial or planar (pure shear). A curve does not show it; default: uniaxial."
LAW_HELP = (
    "linear, neo_hookean, mooney_rivlin, yeoh, ogden_1, ogden_2, ogden_3, or ogden for one to three terms; may be "
    "repeated. Default: all, chosen by misfit."
)


class TensionFlags(msgspec.Struct, frozen=True, kw_only=True):
    """The flags of ``tension``."""

    mode: Annotated[list[str], typer.Option(help=MODE_HELP + " Once for all files, or once for each.")] = []
    law: Annotated[list[str], typer.Option(help=LAW_HELP)] = []
    min_stretch: Annotated[float, typer.Option(help="Readings at a smaller stretch are not used.")] = 0.0
    max_stretch: Annotated[float, typer.Option(help="Readings at a larger stretch are not used.")] = float("inf")
    fit_zero: Annotated[
        bool | None, typer.Option(help="Whether the zero of the stress is unknown; default: of a column of force only.")
    ] = None
    area_mm2: Annotated[float | None, typer.Option(help="Undeformed cross section, for a column of force.")] = None
    gauge_length_mm: Annotated[
        float | None, typer.Option(help="Undeformed length, for a column of length or displacement.")
    ] = None
    column: Annotated[list[str], typer.Option(help=COLUMN_HELP)] = []
    unit: Annotated[list[str], typer.Option(help=UNIT_HELP)] = []
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None
    figure: Annotated[Path | None, typer.Option(help="Write a figure: .svg, .png or .pdf.")] = None
    page: ReportFlags


@takes_flags()
def tension(
    files: Annotated[list[Path], typer.Argument(help="Stress-stretch curves of one material.", show_default=False)],
    given: TensionFlags,
) -> None:
    """Young modulus of a tissue from tension or compression tests, with the law that fits best."""
    from ..bench_tests import fit_stress, laws
    from ..bench_tests.reading import ZERO_FITTED, read_stress

    check_outputs([given.json, given.figure, given.page.check()], files)
    _check_figure(given.figure)
    laws.laws_named(given.law or None)
    modes = _modes(given.mode, len(files))
    for name, value in (("--area-mm2", given.area_mm2), ("--gauge-length-mm", given.gauge_length_mm)):
        if value is not None and not 0.0 < value < float("inf"):
            raise InputError(name, value, "must be above 0")
    options = {
        "columns": pairs(given.column, "column"),
        "units": pairs(given.unit, "unit"),
        "area": None if given.area_mm2 is None else given.area_mm2 / 1e6,
        "gauge_length": None if given.gauge_length_mm is None else given.gauge_length_mm / 1e3,
    }
    try:
        read = [read_stress(file, mode=each, **options) for file, each in zip(files, modes)]
        curves, names = [curve for curve, _ in read], laws.laws_named(given.law or None)
        zero = any(ZERO_FITTED in sentences for _, sentences in read) if given.fit_zero is None else given.fit_zero
        fit = fit_stress(curves, law=names, min_stretch=given.min_stretch, max_stretch=given.max_stretch, fit_zero=zero,
                         progress=progress)  # fmt: skip
    except InputError as error:
        say(str(error) if any(file.name in error.place for file in files) else f"{files[0]}: {error}")
        raise typer.Exit(1) from None
    assumptions = tuple(dict.fromkeys(sentence for _, sentences in read for sentence in sentences))
    write_json(stress_document(fit, [str(file) for file in files], assumptions, not given.mode), given.json)
    write_file("figure", given.figure, fit.save_figure)
    about = {"assumptions": assumptions, "mode_assumed": not given.mode}
    given.page.write(lambda path: fit.report(path, **about))
    _show_stress(fit, assumptions, mode_assumed=not given.mode, quiet=given.json == "-")
    if not fit.young_modulus.identifiable:
        raise typer.Exit(1)


def _modes(mode: list[str], count: int) -> list[str | None]:
    """The loading mode of each file; None where it is assumed. Raises InputError for an unknown mode or number."""
    from ..bench_tests.laws import mode_number

    for each in mode:
        mode_number(each)
    if len(mode) not in (0, 1, count):
        limit = f"there are {count} files"
        raise InputError("number of --mode", len(mode), limit, next_step="Give one for all files, or one for each.")
    return list(mode) * count if len(mode) == 1 else list(mode) or [None] * count


def _check_figure(figure: Path | None) -> None:
    if figure is not None and figure.suffix.lower() not in (".svg", ".png", ".pdf"):
        raise InputError(
            "--figure", figure.name, "known endings are .svg, .png and .pdf", next_step="Give one of them."
        )


def stress_document(fit: "StressFit", files: list[str], assumptions: tuple[str, ...], mode_assumed: bool) -> dict:
    """The fit as a document for JSON."""
    own = {"files": files, "mode_assumed": mode_assumed, "assumptions": list(assumptions)}
    return own | fit.document()


def _show_stress(fit: "StressFit", assumptions: tuple[str, ...], mode_assumed: bool, quiet: bool) -> None:
    for sentence in assumptions:
        say(f"assumed: {sentence}")
    if not quiet:
        from ..bench_tests.stress_result import LAW_HEAD, law_rows

        table("laws, best first", list(LAW_HEAD), [list(row) for row in law_rows(fit)])
        show(fit.headline(mode_assumed))
    for sentence in fit.notes:
        say(f"warning: {sentence}")


@takes_flags()
def bending(
    file: Annotated[Path, typer.Argument(help="Readings of a bending test.", show_default=False)],
    needle: Annotated[str | None, typer.Option(help=NEEDLE_HELP + " Its section and length are used.")] = None,
    span_mm: Annotated[
        float | None, typer.Option(help="Distance of the supports of a three-point test; without it, a cantilever.")
    ] = None,
    clamp_compliance: Annotated[
        float | None, typer.Option(help="Rotation of the clamp per moment [rad/(N m)]; default: fitted if it shows.")
    ] = None,
    column: Annotated[list[str], typer.Option(help="Column of a quantity, such as force=2; may be repeated.")] = [],  # noqa: B006
    unit: Annotated[list[str], typer.Option(help="Unit of a quantity, such as deflection=mm; may be repeated.")] = [],  # noqa: B006
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None,
) -> None:
    """Young modulus of a needle from a cantilever test or three-point bending, large deflections included."""
    from ..bench_tests.reading import read_bending
    from ..preset_files import needle_of

    check_outputs([json], [file, needle])
    if span_mm is None and needle is None:
        limit = "a cantilever needs the needle's section and length"
        raise InputError("--needle", "missing", limit, next_step="Give it, or --span-mm for a three-point test.")
    if span_mm is not None and not 0.0 < span_mm < float("inf"):
        raise InputError("--span-mm", span_mm, "must be above 0")
    body = needle_of(needle) if needle else None
    options = {"columns": pairs(column, "column"), "units": pairs(unit, "unit")}
    try:
        readings, assumptions = read_bending(file, three_point=span_mm is not None, **options)
        fit = _bending_fit(readings, body, span_mm, clamp_compliance)
    except InputError as error:
        say(str(error) if file.name in error.place else f"{file}: {error}")
        raise typer.Exit(1) from None
    for sentence in assumptions:
        say(f"assumed: {sentence}")
    write_json({"file": str(file), **fit.document()}, json)
    _show_bending(fit, quiet=json == "-")


def _bending_fit(readings: dict, body: object, span_mm: float | None, compliance: float | None) -> "BendingFit":
    from ..bench_tests import needle_modulus, three_point_modulus

    if span_mm is None:
        columns = (readings[name] for name in ("force", "position", "tip_deflection"))
        return needle_modulus(*columns, body, clamp_compliance=compliance)
    moment = None if body is None else body.second_moment
    return three_point_modulus(readings["force"], readings["deflection"], span_mm / 1e3, moment)


def _show_bending(fit: "BendingFit", quiet: bool) -> None:
    if not quiet:
        table("bending", *fit.cells())
    for sentence in fit.notes:
        say(f"warning: {sentence}")
