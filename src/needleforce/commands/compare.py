# SPDX-License-Identifier: Apache-2.0
"""``needleforce compare``: models side by side on the same recordings."""

from pathlib import Path
from typing import Annotated

import typer

from .output import JSON_HELP, check_outputs, progress, say, table, write_json
from .reading import COLUMN_HELP, INWARDS_HELP, UNIT_HELP, good, read_all

NAME = "compare"
MODELS_HELP = (
    "Names of models, separated by commas: paper (quadratic), cone_cylinder, power_law, okamura or simone "
    "(second-order polynomial), maurin (exponential)."
)


def run(
    files: Annotated[list[Path], typer.Argument(help="Recordings: repeats of one condition.", show_default=False)],
    models: Annotated[str, typer.Option(help=MODELS_HELP)] = "paper,cone_cylinder,power_law,okamura,maurin",
    column: Annotated[list[str], typer.Option(help=COLUMN_HELP)] = [],  # noqa: B006
    unit: Annotated[list[str], typer.Option(help=UNIT_HELP)] = [],  # noqa: B006
    depth_inwards: Annotated[str, typer.Option(help=INWARDS_HELP)] = "increasing",
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None,
) -> None:
    """Fit several models to the same recordings: BIC of the loading curve, residuals, error on repeats left out."""
    import dataclasses

    import needleforce as nf

    check_outputs([json], files)
    done = read_all(files, column, unit, inwards=depth_inwards)
    for file, problem in done:
        if isinstance(problem, nf.InputError):
            say(f"{file}: {problem}")
    if not good(done):
        raise typer.Exit(1)
    rows = nf.compare(good(done), [name.strip() for name in models.split(",")], progress=progress)
    write_json([dataclasses.asdict(row) for row in rows], json)
    if json != "-":
        table("models, best BIC of the loading curve first", HEAD, [_shown(row, rows[0]) for row in rows])
        for row in rows:
            for sentence in row.notes:
                say(f"{row.model}: {sentence}")
    if all(row.bic != row.bic for row in rows):
        raise typer.Exit(1)


HEAD = [
    "model",
    "BIC",
    "more than best",
    "correlated",
    "won",
    "loading residual / peak",
    "cycle residual / peak",
    "left-out repeat / peak",
]


def _shown(row, best) -> list[str]:
    """One line: ``correlated`` is the difference where samples that are alike count as one."""
    lost = [f"{row.bic - best.bic:.1f}", f"{row.bic_correlated - best.bic_correlated:.1f}"]
    shares = [f"{share:.3f}" for share in (row.residual, row.nrmse, row.left_out)]
    return [row.model, f"{row.bic:.0f}", *lost, str(row.wins), *shares]
