# SPDX-License-Identifier: Apache-2.0
"""``needleforce demo``: the paper reproduced."""

from pathlib import Path
from typing import Annotated

import typer

from .output import JSON_HELP, check_outputs, progress, say, table, write_json

NAME = "demo"


def run(
    out: Annotated[Path, typer.Option(help="Folder for the recordings, report.html and results.json.")] = Path("demo"),
    seed: Annotated[int, typer.Option(help="Same seed, same bytes.")] = 1,
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None,
) -> None:
    """Reproduce the paper: simulate its experiment, identify it by its procedure, and compare with its table."""
    from ..demonstration import demonstrate
    from ..report import write_report

    check_outputs([json])
    done = demonstrate(out, seed=seed, progress=progress)
    write_json(done.table, str(out / "results.json"))
    write_json(done.table, json)
    for _ in progress([None], "writing the report"):
        write_report(done.fit, out / "report.html", title="The paper's experiment, reproduced", table=_told(done.table))
    if json != "-":
        table(
            "the paper's experiment at 3 mm/s: five sites, two insertions each",
            ["quantity", "paper", "true", "identified, 95 % interval", "bias"],
            [_cells(row) for row in done.rows],
        )
    say(
        "true is the mean that the five simulated sites really had; the bias is the procedure's, "
        "not noise: the specimen has a"
    )
    say("saturating contact, a dimple, a spreading force and a filter that the paper's model does not know.")
    say(f"{out / 'report.html'}   {out / 'results.json'}   {out / 'recordings'}")


def _cells(row) -> list[str]:
    from ..display.quantities import quantity

    sd = row.paper_sd or float("nan")
    paper = quantity(row.paper, row.paper - sd, row.paper + sd, row.unit)
    if row.identified is None:
        return [row.quantity, str(paper), "not yet", "not yet", "not yet"]
    identified = quantity(row.identified, row.low, row.high, row.unit)
    bias = f"{100 * (row.identified / row.true - 1):+.1f} %".replace("-0.0 %", "0.0 %").replace("+0.0 %", "0.0 %")
    return [row.quantity, str(paper), str(quantity(row.true, None, None, row.unit)), str(identified), bias]


def _told(table: list[dict]) -> list[dict]:
    """The table for people: what is not there says that it is still to come."""
    open_ends = ("true", "identified")
    return [row | {key: "not yet" for key in open_ends if row["identified"] is None} for row in table]
