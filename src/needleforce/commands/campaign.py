# SPDX-License-Identifier: Apache-2.0
"""``needleforce campaign``: identify a model for each condition in a folder of recordings."""

import re
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import msgspec
import typer

from ..recording.options import ReadOptions
from .files import NEEDLE_HELP
from .flags import takes_flags
from .output import (
    JSON_HELP,
    ReportFlags,
    anonymous,
    any_of,
    check_outputs,
    progress,
    say,
    show_log,
    table,
    write_file,
    write_json,
)

if TYPE_CHECKING:
    from ..campaign import Campaign, Condition

PATTERN_HELP = "Fields in the file names, such as {specimen}_{speed_mm_s}_{repeat}."
MAPPING_HELP = "CSV table with a column named file and one column for each field."
JOBS_HELP = "Number of processes; default: one for each processor."
SCHEDULER_HELP = "Address of a Dask scheduler that has the work done, or local."
STATE_HELP = "Folder that keeps what is done, so that the same command continues, or adds new files."
ONLY_FITTED = (
    "note: the values of a condition are those of the repeats used; the others, named above, were left out or not "
    "fitted. With --model cone_cylinder, for example, every file is fitted with that model."
)
LINKS_HELP = "Also read files of a folder that are links to what is not in it."
SHOWN = ("puncture_indentation", "puncture_force", "friction_per_length", "cutting_force")


class CampaignFlags(msgspec.Struct, frozen=True, kw_only=True):
    """The flags of ``campaign``."""

    pattern: Annotated[str | None, typer.Option(help=PATTERN_HELP)] = None
    labels: Annotated[Path | None, typer.Option("--mapping", help=MAPPING_HELP)] = None
    model: Annotated[str | None, typer.Option(help="Model for all conditions, as for identify.")] = None
    needle: Annotated[str | None, typer.Option(help=NEEDLE_HELP)] = None
    reading: ReadOptions
    follow_links: Annotated[bool, typer.Option("--follow-links", help=LINKS_HELP)] = False
    jobs: Annotated[int | None, typer.Option(help=JOBS_HELP)] = None
    scheduler: Annotated[str | None, typer.Option(help=SCHEDULER_HELP)] = None
    state: Annotated[Path | None, typer.Option(help=STATE_HELP)] = None
    table: Annotated[Path | None, typer.Option(help="Write all results as one table, .csv or .parquet.")] = None
    page: ReportFlags
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None


@takes_flags("filter_length")
def run(
    given: CampaignFlags,
    source: Annotated[
        list[str] | None,
        typer.Argument(help="Folders, globs or files; none to show what --state has so far.", show_default=False),
    ] = None,
) -> None:
    """Identify every condition of a campaign of recordings, with a result for every recording."""
    from ..campaign import campaign
    from ..campaign.campaign import campaign_files
    from ..campaign.result import check_table
    from ..preset_files import needle_of

    files = [file.path for file in campaign_files(source, given.follow_links)[0]] if source else []
    check_outputs([given.table, given.page.check(), given.json], [*files, given.labels, given.needle])
    if given.table is not None:
        check_table(given.table)
    body = needle_of(given.needle) if given.needle else None
    options = {"pattern": given.pattern, "mapping": given.labels, "model": given.model, "needle": body}
    options |= {"jobs": given.jobs, "scheduler": given.scheduler, "state": given.state}
    options["follow_links"] = given.follow_links
    reading = given.reading.of_every_file() | {"instrument": given.reading.mapping}
    show_log()
    try:
        done = campaign(source or None, **options, **reading, progress=progress)
    except KeyboardInterrupt:
        say(
            "stopped" if given.state is None else f"stopped; {given.state} has what is done, the same command continues"
        )
        raise typer.Exit(130) from None
    done = _nameless(done) if anonymous.wanted else done
    write_json(done.to_json() if given.json is not None else None, given.json)
    write_file("written", given.table, done.save_table)
    given.page.write(done.report)
    _show(done, quiet=given.json == "-")
    if not any(one.has_parameters for one in done.recordings):
        raise typer.Exit(1)


def _nameless(done: "Campaign") -> "Campaign":
    """The same with numbers for the names of files, and for values of fields that are no numbers, without times."""
    labels = {one.file: f"recording {number}" for number, one in enumerate(done.recordings, 1)}
    for name in dict.fromkeys(name for one in done.recordings for name in one.fields):
        values = dict.fromkeys(one.fields[name] for one in done.recordings if name in one.fields)
        texts = (each for each in values if not re.fullmatch(r"-?[\d.]{1,5}", each))
        labels |= {value: f"{name} {number}" for number, value in enumerate(texts, 1)}
    names = any_of(filter(None, labels))
    return _rewritten(done, lambda text: anonymous.stripped(names.sub(lambda name: labels[name[0]], text)))


def _rewritten(value: Any, hidden: Callable[[str], str]) -> Any:
    """A result of a campaign, or a part of it, with what is hidden in its texts."""
    if type(value) is str:
        return hidden(value)
    if isinstance(value, dict):
        return {key: _rewritten(each, hidden) for key, each in value.items()}
    if isinstance(value, tuple):
        return tuple(_rewritten(each, hidden) for each in value)
    if type(value).__name__ not in ("Campaign", "Condition", "RecordingResult", "Anomaly"):
        return value
    return replace(value, **{each.name: _rewritten(getattr(value, each.name), hidden) for each in fields(value)})


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
    if any(len(each.pooled) < len(each.recordings) for each in done.conditions):
        say(ONLY_FITTED)
    if not quiet and done.conditions:
        shown = [name for name in SHOWN if any(name in each.parameters for each in done.conditions)]
        columns = ["condition", "repeats used", "residual / peak", "R²", *(name.replace("_", " ") for name in shown)]
        table("conditions", columns, [_row(each, shown) for each in done.conditions])


def _row(condition: "Condition", shown: list[str]) -> list[str]:
    from ..campaign.result import quality_cells

    found = map(condition.parameters.get, shown)
    cells = ["-" if each is None else f"{each.doubt}{each.shown}" for each in found]
    used = f"{len(condition.pooled)}/{len(condition.recordings)}"
    return [condition.name, used, *quality_cells(condition.quality), *cells]
