# SPDX-License-Identifier: Apache-2.0
"""The paper's experiment on the virtual rig, identified by the paper's procedure, beside the paper's table."""

from dataclasses import asdict, dataclass
from pathlib import Path

from .identification import Fit, identify
from .preset_files import preset
from .recording import read
from .rig import CUTTING_OSCILLATION, PAPER, paper_experiment

SPEEDS = (3e-3, 1e-3)  # [m/s]; the table is that of the first, as the paper's Fig. 2


@dataclass(frozen=True)
class TableRow:
    """One line of the table, SI; None where there is no such number (yet)."""

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
    """The table, the fit at 3 mm/s behind it, and the fit at 1 mm/s."""

    rows: tuple[TableRow, ...]
    fit: Fit
    slow: Fit

    @property
    def table(self) -> list[dict]:
        """The table as plain values."""
        return [asdict(row) for row in self.rows]


def demonstrate(folder, *, seed: int = 1, progress=None, **experiment) -> Demonstration:
    """Simulates the campaign, writes it into ``folder``/recordings, reads the files back and identifies them.

    The specimen has what the identified model does not know: contact that stops at the needle's radius, a dimple that
    stays on the first pass, a spreading force, friction that grows beyond 12 mm, cutting that sticks and slips, the
    filter. ``experiment`` goes to ``paper_experiment``; ``progress(iterable, text)`` wraps the work.
    """
    progress = progress or (lambda work, text: work)
    recordings = Path(folder) / "recordings"
    campaign = paper_experiment(seed, speeds=SPEEDS, **experiment)
    campaign.write(recordings, progress)
    fits = [_identified(campaign.at(speed), recordings, speed, progress) for speed in SPEEDS]
    rows = _rows(campaign.at(SPEEDS[0]).truth, fits[0]) + _cutting_oscillation(campaign.at(SPEEDS[1]).truth, fits[1])
    return Demonstration(rows, *fits)


def _identified(campaign, folder: Path, speed: float, progress) -> Fit:
    """The paper's procedure on the files of one speed: its model, both passes, and the two bench tests."""
    runs = progress(campaign.runs, f"reading {1e3 * speed:g} mm/s")
    passes = [read(folder / f"{run.name}_force.csv") for run in runs]
    return identify(
        passes[::2],
        second_pass=passes[1::2],
        model="paper",
        needle=preset("paper").needle,
        bending=folder / "needle_bending.csv",
        tension=folder / "tissue_tension.csv",
        progress=progress,
    )


def _rows(truth: dict, fit: Fit) -> tuple[TableRow, ...]:
    rows = []
    for quantity, (mean, sd) in PAPER.items():
        true, found = truth[quantity], fit.parameters[quantity]
        rows.append(TableRow(quantity, true.unit, mean, sd, true.drawn, found.value, found.low, found.high))
    return tuple(rows)


def _cutting_oscillation(truth: dict, fit: Fit) -> tuple[TableRow, ...]:
    """The range of the cutting force at 1 mm/s; the truth is the law's, to the scale of the sites' cutting force."""
    scale, rows = truth["cutting_force"].drawn / PAPER["cutting_force"][0], []
    for quantity, value in CUTTING_OSCILLATION.items():
        found = fit.parameters.get(quantity.removesuffix("_1mm_s"))
        identified = (None, None, None) if found is None else (found.value, found.low, found.high)
        rows.append(TableRow(quantity, "N", value, None, scale * value, *identified))
    return tuple(rows)
