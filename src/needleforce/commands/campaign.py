# SPDX-License-Identifier: Apache-2.0
"""``needleforce campaign``: identify a model for each condition in a folder of recordings."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec
import typer

from ..recording.options import ReadOptions
from .files import NEEDLE_HELP
from .flags import takes_flags
from .output import JSON_HELP, REPORT_HELP, check_outputs, progress, say, table, write_file, write_json

if TYPE_CHECKING:
    from ..campaign import Campaign, Condition

NAME = "campaign"
PATTERN_HELP = "Fields in the file names, such as {specimen}_{speed_mm_s}_{repeat}."
MAPPING_HELP = "CSV table with a column named file and one column for each field."
SHOWN = ("puncture_indentation", "puncture_force", "friction_per_length", "cutting_force")


class CampaignFlags(msgspec.Struct, frozen=True, kw_only=True):
    """The flags of ``campaign``."""

    pattern: Annotated[str | None, typer.Option(help=PATTERN_HELP)] = None
    labels: Annotated[Path | None, typer.Option("--mapping", help=MAPPING_HELP)] = None
    model: Annotated[str | None, typer.Option(help="Model for all conditions, as for identify.")] = None
    needle: Annotated[str | None, typer.Option(help=NEEDLE_HELP)] = None
    reading: ReadOptions
    table: Annotated[Path | None, typer.Option(help="Write all results as one table, .csv or .parquet.")] = None
    report: Annotated[Path | None, typer.Option(help=REPORT_HELP)] = None
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None


@takes_flags("filter_length")
def run(
    source: Annotated[list[str], typer.Argument(help="Folders, globs or files.", show_default=False)],
    given: CampaignFlags,
) -> None:
    """Identify every condition of a campaign of recordings, with a result for every recording."""
    from ..campaign import campaign
    from ..campaign.folder_files import find_files
    from ..campaign.result import check_table
    from ..preset_files import needle_of

    files = [file.path for file in find_files(source)]
    check_outputs([given.table, given.report, given.json], [*files, given.labels, given.needle])
    if given.table is not None:
        check_table(given.table)
    body = needle_of(given.needle) if given.needle else None
    options = {"pattern": given.pattern, "mapping": given.labels, "model": given.model, "needle": body}
    reading = given.reading.of_every_file() | {"instrument": given.reading.mapping}
    done = campaign(source, **options, **reading, progress=progress)
    if given.json is not None:
        write_json(done.to_json(), given.json)
    write_file("written", given.table, done.save_table)
    write_file("written", given.report, done.report)
    _show(done, quiet=given.json == "-")
    if not any(one.has_parameters for one in done.recordings):
        raise typer.Exit(1)


def _show(done: "Campaign", quiet: bool) -> None:
    for sentence in done.all_notes:
        say(f"note: {sentence}")
    for one in done.recordings:
        if one.why:
            say(f"{one.file}: {one.status}{', left out' if one.left_out else ''}: {one.why}")
    for condition in done.conditions:
        if condition.why and not any(each.why and each.why in condition.why for each in condition.recordings):
            say(f"{condition.name}: no model: {condition.why}")
        elif condition.why:
            say(f"{condition.name}: no model, as its recordings have none")
    if not quiet and done.conditions:
        shown = [name for name in SHOWN if any(name in each.parameters for each in done.conditions)]
        columns = ["condition", "repeats used", "residual / peak", "R²", *(name.replace("_", " ") for name in shown)]
        table("conditions", columns, [_row(each, shown) for each in done.conditions])


def _row(condition: "Condition", shown: list[str]) -> list[str]:
    from ..campaign.result import quality_cells
    from ..display.quantities import quantity

    cells = []
    for name in shown:
        found = condition.parameters.get(name)
        text = "-" if found is None else str(quantity(found.value, found.low, found.high, found.unit))
        cells.append(text if found is None or found.identifiable else f"not identified ({text})")
    used = f"{len(condition.pooled)}/{len(condition.recordings)}"
    return [condition.name, used, *quality_cells(condition.quality), *cells]
