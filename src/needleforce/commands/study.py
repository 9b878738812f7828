# SPDX-License-Identifier: Apache-2.0
"""``needleforce study``: simulated insertions that answer a question, stated in a file."""

from pathlib import Path
from typing import Annotated

import msgspec
import typer

from .flags import takes_flags
from .output import JSON_HELP, ReportFlags, check_outputs, progress, say, show, write_json


class StudyFlags(msgspec.Struct, frozen=True, kw_only=True):
    """The flags of ``study``."""

    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Folder for the result; a stopped study continues there.")
    ] = None
    jobs: Annotated[int | None, typer.Option(help="Processes; the default is one for each core.")] = None
    scheduler: Annotated[
        str | None, typer.Option(help="Address of a Dask scheduler, or local; needs the extra cluster.")
    ] = None
    yes: Annotated[bool, typer.Option("--yes", help="Run a study of more than an hour or 10 GB.")] = False
    page: ReportFlags
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None


@takes_flags()
def run(
    file: Annotated[Path, typer.Argument(help="Study file (.toml).", show_default=False)],
    given: StudyFlags,
) -> None:
    """Simulate the insertions of a question and say what its outputs depend on."""
    from ..studies import study

    check_outputs([given.page.check(), given.json], [file])
    result = study(file, jobs=given.jobs, scheduler=given.scheduler, out=given.out, yes=given.yes, progress=progress)
    write_json(result.to_json(), given.json)
    given.page.write(result.report)
    if given.out is not None:
        say(f"written: {given.out}")
    if given.json != "-":
        show(str(result))
    if result.is_empty:
        raise typer.Exit(1)
