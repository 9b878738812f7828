# SPDX-License-Identifier: Apache-2.0
"""``needleforce compare``: models side by side on the same recordings."""

from pathlib import Path
from typing import Annotated

import typer

from .output import JSON_HELP, check_outputs, progress, say, table, write_json
from .reading import COLUMN_HELP, INWARDS_HELP, UNIT_HELP, good, read_all

NAME = "compare"


def run(
    files: Annotated[list[Path], typer.Argument(help="Recordings: repeats of one condition.", show_default=False)],
    models: Annotated[str, typer.Option(help="Names of models, separated by commas.")] = "paper,cone_cylinder",
    column: Annotated[list[str], typer.Option(help=COLUMN_HELP)] = [],  # noqa: B006
    unit: Annotated[list[str], typer.Option(help=UNIT_HELP)] = [],  # noqa: B006
    depth_inwards: Annotated[str, typer.Option(help=INWARDS_HELP)] = "increasing",
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None,
) -> None:
    """Fit several models to the same recordings: BIC, residual, and error on repeats that were left out."""
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
        table(
            "models, best BIC first",
            ["model", "BIC", "residual / peak", "left-out repeat / peak"],
            [[row.model, f"{row.bic:.0f}", f"{row.nrmse:.3f}", f"{row.left_out:.3f}"] for row in rows],
        )
    if all(row.bic != row.bic for row in rows):
        raise typer.Exit(1)
