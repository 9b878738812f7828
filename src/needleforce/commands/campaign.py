# SPDX-License-Identifier: Apache-2.0
"""``needleforce campaign``: a folder of recordings in, a model for each condition out."""

from pathlib import Path
from typing import Annotated

import typer

from .files import COLUMN_HELP, INWARDS_HELP, UNIT_HELP, check_usage
from .output import JSON_HELP, check_outputs, pairs, progress, say, table, write_json

NAME = "campaign"
PATTERN_HELP = "What the names of the files say, as {specimen}_{speed_mm_s}_{repeat}."
MAPPING_HELP = "CSV table with a column file, and a column for each field."
SHOWN = ("puncture_indentation", "puncture_force", "friction_per_length", "cutting_force")


def run(
    source: Annotated[list[str], typer.Argument(help="Folders, globs or files.", show_default=False)],
    pattern: Annotated[str | None, typer.Option(help=PATTERN_HELP)] = None,
    mapping: Annotated[Path | None, typer.Option(help=MAPPING_HELP)] = None,
    model: Annotated[str | None, typer.Option(help="A model for all conditions, as in identify.")] = None,
    needle: Annotated[Path | None, typer.Option(help="TOML file with a section needle, such as a preset.")] = None,
    column: Annotated[list[str], typer.Option(help=COLUMN_HELP)] = [],  # noqa: B006
    unit: Annotated[list[str], typer.Option(help=UNIT_HELP)] = [],  # noqa: B006
    depth_inwards: Annotated[str, typer.Option(help=INWARDS_HELP)] = "increasing",
    filter_length: Annotated[int | None, typer.Option(help="Samples in the force's average filter.")] = None,
    table: Annotated[Path | None, typer.Option(help="Write one tidy table: .csv, or .parquet.")] = None,
    report: Annotated[Path | None, typer.Option(help="Write a report as one HTML file.")] = None,
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None,
) -> None:
    """Identify every condition of a campaign: hundreds of recordings, each accounted for."""
    from ..campaign import campaign
    from ..campaign.labels import find_files
    from ..campaign.result import check_table
    from ..preset_files.build import read_needle

    check_outputs([table, report, json], [*(file.path for file in find_files(source)), mapping, needle])
    if table is not None:
        check_table(table)
    reading = {"columns": pairs(column, "column"), "units": pairs(unit, "unit"), "inwards": depth_inwards}
    reading["filter_length"] = filter_length
    check_usage(reading)
    body = read_needle(needle) if needle else None
    options = {"pattern": pattern, "mapping": mapping, "model": model, "needle": body, "progress": progress}
    done = campaign(source, **options, **reading)
    _write(done, table, report, json)
    _show(done, quiet=json == "-")
    if not any(one.answers for one in done.recordings):
        raise typer.Exit(1)


def _write(done, table: Path | None, report: Path | None, json: str | None) -> None:
    if json is not None:
        write_json(done.to_json(), json)
    for path, write in ((table, done.save_table), (report, done.report)):
        if path is not None:
            write(path)
            say(f"written: {path}")


def _show(done, quiet: bool) -> None:
    for sentence in done.notes:
        say(f"note: {sentence}")
    for one in done.recordings:
        if one.why:
            say(f"{one.file}: {one.status}{', left out' if one.left_out else ''}: {one.why}")
    for condition in done.conditions:
        if condition.why:
            say(f"{condition.name}: no model: {condition.why}")
    if not quiet and done.conditions:
        shown = [name for name in SHOWN if any(name in each.parameters for each in done.conditions)]
        columns = ["condition", "repeats used", *(name.replace("_", " ") for name in shown)]
        table("conditions", columns, [_row(each, shown) for each in done.conditions])


def _row(condition, shown: list[str]) -> list[str]:
    from ..display.quantities import quantity

    values = [condition.parameters.get(name) for name in shown]
    told = ["-" if e is None else str(quantity(e.value, e.low, e.high, e.unit)) for e in values]
    return [condition.name, f"{len(condition.pooled)}/{len(condition.recordings)}", *told]
