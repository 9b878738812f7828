# SPDX-License-Identifier: Apache-2.0
"""``needleforce demo``: the paper's experiment reproduced in simulation."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .output import JSON_HELP, check_outputs, progress, say, table, write_json

if TYPE_CHECKING:
    from ..demonstration import TableRow

NAME = "demo"


def run(
    out: Annotated[Path, typer.Option(help="Folder for recordings, report.html and results.json.")] = Path("demo"),
    seed: Annotated[int, typer.Option(help="Seed of the random numbers.")] = 1,
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None,
) -> None:
    """Reproduce the paper: simulate its experiment, identify it by the paper's procedure, compare with its table."""
    from ..demonstration import demonstrate
    from ..identification.statistics.noise import INTERVAL

    check_outputs([json])
    done = demonstrate(out, seed=seed, progress=progress)
    write_json(done.table, str(out / "results.json"))
    write_json(done.table, json)
    for _ in progress([None], "writing the report"):
        title = "The paper's experiment, reproduced"
        done.fit.report(out / "report.html", title=title, table=_labelled(done.table))
    if json != "-":
        table(
            "the paper's experiment at 3 mm/s: five sites, two insertions each",
            ["quantity", "paper", "true", f"identified, {INTERVAL}", "bias"],
            [_cells(row) for row in done.rows],
        )
    say("true: mean over the five simulated sites. bias: systematic error of the paper's procedure, because the")
    say("specimen has a saturating contact, a dimple, a spreading force and a filter that the paper's model omits.")
    say(f"{out / 'report.html'}   {out / 'results.json'}   {out / 'recordings'}")


def _cells(row: "TableRow") -> list[str]:
    from ..display.quantities import quantity

    sd = row.paper_sd or float("nan")
    paper = quantity(row.paper, row.paper - sd, row.paper + sd, row.unit)
    if row.identified is None:
        return [row.quantity, str(paper), "not yet", "not yet", "not yet"]
    identified = quantity(row.identified, row.low, row.high, row.unit)
    bias = f"{100 * (row.identified / row.true - 1):+.1f} %".replace("-0.0 %", "0.0 %").replace("+0.0 %", "0.0 %")
    return [row.quantity, str(paper), str(quantity(row.true, None, None, row.unit)), str(identified), bias]


def _labelled(table: list[dict]) -> list[dict]:
    """The table for the report: values that are not available are shown as "not yet"."""
    return [row | {key: "not yet" for key in ("true", "identified") if row["identified"] is None} for row in table]
