# SPDX-License-Identifier: Apache-2.0
"""``needleforce compare``: models side by side on the same recordings."""

import math
from pathlib import Path
from typing import Annotated

import typer

from .files import COLUMN_HELP, INWARDS_HELP, UNIT_HELP, good, read_all, screen_recordings
from .output import JSON_HELP, check_outputs, progress, say, table, write_json

NAME = "compare"
MODELS_HELP = (
    "Names of models, separated by commas: paper (quadratic), cone_cylinder, power_law, okamura or simone "
    "(second-order polynomial), maurin (exponential), and layered, layered_as_fitted, which take a minute or two each. "
    "all is every one of them."
)


def run(
    files: Annotated[list[Path], typer.Argument(help="Recordings: repeats of one condition.", show_default=False)],
    models: Annotated[str, typer.Option(help=MODELS_HELP)] = "paper,cone_cylinder,power_law,okamura,maurin",
    column: Annotated[list[str], typer.Option(help=COLUMN_HELP)] = [],  # noqa: B006
    unit: Annotated[list[str], typer.Option(help=UNIT_HELP)] = [],  # noqa: B006
    depth_inwards: Annotated[str, typer.Option(help=INWARDS_HELP)] = "increasing",
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None,
    report: Annotated[Path | None, typer.Option(help="Write table and figure as one HTML file.")] = None,
) -> None:
    """Fit several models to the same recordings: BIC of the loading curve, and repeats foretold from the others."""
    import dataclasses

    import needleforce as nf

    from ..report import write_comparison

    check_outputs([json, report], files)
    done = screen_recordings(read_all(files, column, unit, inwards=depth_inwards))
    for file, problem in done:
        if isinstance(problem, nf.InputError):
            say(str(problem) if str(file) in problem.place else f"{file}: {problem}")
    if not good(done):
        raise typer.Exit(1)
    rows = nf.compare(good(done), names_of(models), progress=progress)
    write_json([dataclasses.asdict(row) for row in rows], json)
    if report is not None:
        write_comparison(rows, report, files=[file for file, each in done if not isinstance(each, nf.InputError)])
        say(f"report: {report}")
    _show(rows, quiet=json == "-")
    if all(math.isnan(row.bic) and math.isnan(row.nrmse) for row in rows):
        raise typer.Exit(1)


def names_of(models: str) -> list[str]:
    """The models named; of ``all`` each loading curve once and the layered ones."""
    from ..identification.models import COMPARED, LAYERED

    return [*COMPARED, *LAYERED] if models.strip() == "all" else [name.strip() for name in models.split(",")]


def _show(rows, quiet: bool) -> None:
    from ..report.models_page import MODELS, floor_words, model_rows

    if quiet:
        return
    table("models, best first; ÷: over the floor, the mean of the other repeats", MODELS, model_rows(rows))
    say(floor_words(rows))
    for row in rows:
        for sentence in row.notes:
            say(f"{row.model}: {sentence}")
