# SPDX-License-Identifier: Apache-2.0
"""``needleforce convert``: a recording of any supported format written as CSV, Parquet or MCAP."""

from pathlib import Path
from typing import Annotated

import typer

from ..errors import InputError
from ..recording.options import ReadOptions
from .files import read_all
from .flags import takes_flags
from .output import check_outputs, say

ENDINGS = (".csv", ".parquet", ".mcap")


@takes_flags("motion", "start_depth", "filter_length")
def run(
    file: Annotated[Path, typer.Argument(help="A file of any format, or the folder of a bag.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="The file to write: .csv, .parquet or .mcap.")],
    *,
    reading: ReadOptions,
) -> None:
    """Convert a recording to one file in SI units with its card; bias removed, force and motion on one clock."""
    import needleforce as nf

    check_outputs([output], [file, reading.motion])
    if output.suffix.lower() not in ENDINGS:
        limit = f"known endings are {', '.join(ENDINGS)}"
        raise InputError("--output", repr(str(output)), limit, next_step="Give a file name with one of them.")
    found = read_all([file], reading)
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
