# SPDX-License-Identifier: Apache-2.0
"""``needleforce demo``: the paper's experiment on the virtual rig, identified and compared with the paper's table."""

import os
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .flags import takes_flags
from .output import JSON_HELP, check_outputs, progress, say, table, write_json

if TYPE_CHECKING:
    from ..identification import Fit

SPEEDS = (3e-3, 1e-3)  # [m/s]; the table is for the first speed, as in the paper's Fig. 2


@dataclass(frozen=True, kw_only=True)
class TableRow:
    """One row of the table in SI; None where a value is not available."""

    quantity: str
    unit: str
    paper: float
    paper_sd: float | None
    true: float | None
    identified: float | None
    low: float | None
    high: float | None


@dataclass(frozen=True, eq=False)
class Demonstration:
    """The paper's table with the true and the identified values, the fit at 3 mm/s, which gives it, and the one at
    1 mm/s, which gives the oscillation of the cutting force."""

    rows: tuple[TableRow, ...]
    fit: "Fit"
    slow: "Fit"

    @property
    def table(self) -> list[dict]:
        """The rows as dictionaries."""
        return [asdict(row) for row in self.rows]


@takes_flags()
def run(
    out: Annotated[Path, typer.Option(help="Folder for recordings, report.html and results.json.")] = Path("demo"),
    seed: Annotated[int, typer.Option(help="Seed of the random numbers.")] = 1,
    json: Annotated[str | None, typer.Option(help=JSON_HELP)] = None,
) -> None:
    """Reproduce the paper: simulate its experiment, identify it by the paper's procedure, compare with its table."""
    from ..identification.statistics.noise import INTERVAL

    check_outputs([json])
    done = demonstrate(out, seed=seed, progress=progress)
    write_json(done.table, str(out / "results.json"))
    write_json(done.table, json)
    for _ in progress([None], "writing the report"):
        title = "The paper's experiment, reproduced"
        absent = {"true": "not yet", "identified": "not yet"}
        shown = [row | absent if row["identified"] is None else row for row in done.table]
        done.fit.report(out / "report.html", title=title, table=shown)
    if json != "-":
        table(
            "the paper's experiment at 3 mm/s: five sites, two insertions each",
            ["quantity", "paper", "true", f"identified, {INTERVAL}", "bias"],
            [_cells(row) for row in done.rows],
        )
    say("true: mean over the five simulated sites. bias: systematic error of the paper's procedure, because the")
    say("specimen has a saturating contact, a dimple, a spreading force and a filter that the paper's model omits.")
    say(f"{out / 'report.html'}   {out / 'results.json'}   {out / 'recordings'}")


def demonstrate(
    folder: str | os.PathLike,
    *,
    seed: int = 1,
    progress: Callable[[Any, str], Any] = lambda work, text: work,
    **experiment: Any,
) -> Demonstration:
    """Simulate the paper's campaign with options of ``paper_experiment``, write it to the subfolder ``recordings``,
    read the files back and identify them; the same seed gives the same files.

    The simulated specimen has effects that the identified model omits: contact that ends at the needle's radius, a
    dimple that remains in the first pass, a spreading force, friction that grows beyond 12 mm, stick–slip cutting, and
    the sensor's filter.
    """
    from ..rig import CUTTING_OSCILLATION, PAPER, paper_experiment

    recordings = Path(folder) / "recordings"
    campaign = paper_experiment(seed, speeds=SPEEDS, **experiment)
    campaign.write(recordings, progress)
    fit, slow = (_identified(campaign.at(speed), recordings, speed, progress) for speed in SPEEDS)
    truth, slow_truth = (campaign.at(speed).truth for speed in SPEEDS)
    rows = [
        _row(name, truth[name].unit, paper, truth[name].drawn, fit.parameters[name]) for name, paper in PAPER.items()
    ]
    scale = slow_truth["cutting_force"].drawn / PAPER["cutting_force"][0]  # the range of the law is that of the site
    for name, value in CUTTING_OSCILLATION.items():
        found = slow.parameters.get(name.removesuffix("_1mm_s"))
        rows.append(_row(name, "N", (value, None), scale * value, found))
    return Demonstration(tuple(rows), fit, slow)


def _identified(campaign: Any, folder: Path, speed: float, progress: Callable[[Any, str], Any]) -> "Fit":
    """Apply the paper's procedure to the files of one speed: its model, both passes, and, for the table, the two bench
    tests."""
    from ..identification import identify
    from ..preset_files import preset
    from ..recording import read

    runs = progress(campaign.runs, f"reading {1e3 * speed:g} mm/s")
    passes = [read(folder / f"{run.name}_force.csv") for run in runs]
    bench = {"bending": folder / "needle_bending.csv", "tension": folder / "tissue_tension.csv"}
    return identify(
        passes[::2],
        second_pass=passes[1::2],
        model="paper",
        needle=preset("paper").needle,
        **(bench if speed == SPEEDS[0] else {}),
        progress=progress,
    )


def _row(quantity: str, unit: str, paper: tuple[float, float | None], true: float, found: Any) -> TableRow:
    """A row of the paper's mean and standard deviation, the true value, and the estimate, if there is one."""
    value, low, high = (None, None, None) if found is None else (found.value, found.low, found.high)
    (mean, sd), identified = paper, {"identified": value, "low": low, "high": high}
    return TableRow(quantity=quantity, unit=unit, paper=mean, paper_sd=sd, true=true, **identified)


def _cells(row: TableRow) -> list[str]:
    from ..display.quantities import quantity

    sd = row.paper_sd or float("nan")
    paper = quantity(row.paper, row.paper - sd, row.paper + sd, row.unit)
    if row.identified is None:
        return [row.quantity, str(paper), "not yet", "not yet", "not yet"]
    identified = quantity(row.identified, row.low, row.high, row.unit)
    bias = f"{100 * (row.identified / row.true - 1):+.1f} %".replace("-0.0 %", "0.0 %").replace("+0.0 %", "0.0 %")
    return [row.quantity, str(paper), str(quantity(row.true, None, None, row.unit)), str(identified), bias]
