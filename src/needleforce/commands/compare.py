# SPDX-License-Identifier: Apache-2.0
"""``needleforce compare``: several models fitted to the same recordings."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..recording.options import ReadOptions
from .files import MACHINE_HELP, NEEDLE_HELP, read_all, readable, screen_recordings
from .flags import takes_flags
from .identify import MODEL_NAMES
from .output import JSON_HELP, ReportFlags, check_outputs, progress, say, table, write_json

if TYPE_CHECKING:
    from ..identification.compare import ModelRow

MODELS_HELP = (
    "Names of models, separated by commas; or all: each loading curve once, and the models of layers (some seconds "
    f"each for four recordings). {MODEL_NAMES}"
)


@takes_flags()
def run(
    files: Annotated[list[Path], typer.Argument(help="Recordings, repeats of one condition.", show_default=False)],
    models: Annotated[str, typer.Option(help=MODELS_HELP)] = "paper,cone_cylinder,power_law,okamura,maurin",
    *,
    needle: Annotated[str | None, typer.Option(help=NEEDLE_HELP)] = None,
    machine_stiffness_N_mm: Annotated[float | None, typer.Option("--machine-stiffness-N-mm", help=MACHINE_HELP)] = None,
    reading: ReadOptions,
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None,
    page: ReportFlags,
) -> None:
    """Fit several models to the same recordings and compare the BIC of the loading curve and the error of predicting
    held-out repeats."""
    import needleforce as nf

    check_outputs([json, page.check()], [*files, needle])
    done = screen_recordings(read_all(files, reading))
    for file, problem in done:
        if isinstance(problem, nf.InputError):
            say(str(problem) if str(file) in problem.place else f"{file}: {problem}")
    if not readable(done):
        raise typer.Exit(1)
    machine = None if machine_stiffness_N_mm is None else 1e3 * machine_stiffness_N_mm
    options = {"progress": progress, "needle": needle, "machine_stiffness": machine}
    rows = nf.compare(readable(done), names_of(models), **options)
    write_json(rows.to_json(), json)
    shown = [file for file, each in done if not isinstance(each, nf.InputError)]
    page.write(lambda path: rows.report(path, files=shown))
    _show(rows, quiet=json == "-")
    if all(math.isnan(row.bic) and math.isnan(row.nrmse) for row in rows):
        raise typer.Exit(1)


def names_of(models: str) -> list[str]:
    """The models in a comma-separated list; ``all`` means each loading curve once and the models of layers."""
    from ..identification.models import COMPARED, OF_LAYERS

    return [*COMPARED, *OF_LAYERS] if models.strip() == "all" else [name.strip() for name in models.split(",")]


def _show(rows: "Sequence[ModelRow]", quiet: bool) -> None:
    from ..display.quantities import DASH
    from ..identification.comparison import MODELS, floor_words, model_rows

    if quiet:
        return
    cells = model_rows(rows)
    known = [k for k in range(len(MODELS)) if any(row[k] not in ("", DASH) for row in cells)]
    heads, shown = [MODELS[k] for k in known], [[row[k] for k in known] for row in cells]
    table("models, best first; ÷: error relative to the mean of the other repeats", heads, shown)
    say(floor_words(rows))
    for row in rows:
        for sentence in row.notes:
            say(f"{row.model}: {sentence}")
