# SPDX-License-Identifier: Apache-2.0
"""``needleforce convert``: a recording of any supported format written as CSV, Parquet or MCAP."""

from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import InputError
from .files import (
    COLUMN_HELP,
    FILTER_HELP,
    START_DEPTH_HELP,
    UNIT_HELP,
    read_all,
)
from .output import check_outputs, say
from .reading_options import reads_files

NAME = "convert"
ENDINGS = (".csv", ".parquet", ".mcap")


@reads_files()
def run(
    file: Annotated[Path, typer.Argument(help="A file of any format, or the folder of a bag.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="The file to write: .csv, .parquet or .mcap.")],
    column: Annotated[list[str], typer.Option(help=COLUMN_HELP)] = [],  # noqa: B006
    unit: Annotated[list[str], typer.Option(help=UNIT_HELP)] = [],  # noqa: B006
    *,
    reading: dict[str, Any],
    motion: Annotated[Path | None, typer.Option(help="File with velocity or depth on its own clock.")] = None,
    start_depth_mm: Annotated[float | None, typer.Option(help=START_DEPTH_HELP)] = None,
    filter_length: Annotated[int | None, typer.Option(help=FILTER_HELP)] = None,
) -> None:
    """Convert a recording to one file in SI units with its card; bias removed, force and motion on one clock."""
    import needleforce as nf

    check_outputs([output], [file, motion])
    if output.suffix.lower() not in ENDINGS:
        raise InputError(
            "--output",
            repr(str(output)),
            f"known endings are {', '.join(ENDINGS)}",
            next_step="Give a file name with one of them.",
        )
    start = None if start_depth_mm is None else 1e-3 * start_depth_mm
    options = reading | {"filter_length": filter_length, "start_depth": start}
    found = read_all([file], column, unit, [motion] if motion else [], **options)
    if len(found) > 1:
        raise InputError(
            "number of recordings", len(found), "one is written to a file", next_step="Choose one with --part."
        )
    ((_, recording),) = found
    if isinstance(recording, InputError):
        say(f"needleforce: {recording}")
        raise typer.Exit(1)
    nf.write(recording, output)
    for sentence in recording.card.assumptions:
        say(f"assumed: {sentence}")
    for note in recording.notes:
        say(f"note: {note.message}")
    say(f"{output}: {len(recording)} samples")
