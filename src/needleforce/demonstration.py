# SPDX-License-Identifier: Apache-2.0
"""The paper's experiment on the virtual rig, identified by the paper's procedure and compared with its table."""

import os
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from .identification import Fit, identify
from .preset_files import preset
from .recording import read
from .rig import CUTTING_OSCILLATION, PAPER, paper_experiment

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
    """The result of ``demonstrate``.

    Parameters
    ----------
    rows : tuple of TableRow
        The paper's table with the true and the identified values.
    fit : Fit
        The fit at 3 mm/s, which gives the table.
    slow : Fit
        The fit at 1 mm/s, which gives the oscillation of the cutting force.
    """

    rows: tuple[TableRow, ...]
    fit: Fit
    slow: Fit

    @property
    def table(self) -> list[dict]:
        """The rows as dictionaries."""
        return [asdict(row) for row in self.rows]


def demonstrate(
    folder: str | os.PathLike,
    *,
    seed: int = 1,
    progress: Callable[[Any, str], Any] | None = None,
    **experiment: Any,
) -> Demonstration:
    """Simulate the paper's campaign, write it to files, read the files back and identify them.

    The simulated specimen has effects that the identified model omits: contact that ends at the needle's radius, a
    dimple that remains in the first pass, a spreading force, friction that grows beyond 12 mm, stick–slip cutting, and
    the sensor's filter.

    Parameters
    ----------
    folder : str or os.PathLike
        The recordings are written to its subfolder ``recordings``.
    seed : int
        Seed of the random numbers; the same seed gives the same files.
    progress : callable, optional
        ``progress(iterable, text)`` wraps the work, for a progress bar.
    **experiment
        Options of ``paper_experiment``.

    Returns
    -------
    Demonstration
        The table and the two fits.
    """
    progress = progress or (lambda work, text: work)
    recordings = Path(folder) / "recordings"
    campaign = paper_experiment(seed, speeds=SPEEDS, **experiment)
    campaign.write(recordings, progress)
    fits = [_identified(campaign.at(speed), recordings, speed, progress) for speed in SPEEDS]
    rows = _rows(campaign.at(SPEEDS[0]).truth, fits[0]) + _cutting_oscillation(campaign.at(SPEEDS[1]).truth, fits[1])
    return Demonstration(rows, *fits)


def _identified(campaign: Any, folder: Path, speed: float, progress: Callable[[Any, str], Any]) -> Fit:
    """Apply the paper's procedure to the files of one speed: its model, both passes, and the two bench tests."""
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
        rows.append(
            TableRow(
                quantity=quantity,
                unit=true.unit,
                paper=mean,
                paper_sd=sd,
                true=true.drawn,
                identified=found.value,
                low=found.low,
                high=found.high,
            )
        )
    return tuple(rows)


def _cutting_oscillation(truth: dict, fit: Fit) -> tuple[TableRow, ...]:
    """The range of the cutting force at 1 mm/s; the true range is the law's, scaled by the sites' cutting force."""
    scale, rows = truth["cutting_force"].drawn / PAPER["cutting_force"][0], []
    for quantity, value in CUTTING_OSCILLATION.items():
        found = fit.parameters.get(quantity.removesuffix("_1mm_s"))
        identified = (None, None, None) if found is None else (found.value, found.low, found.high)
        rows.append(
            TableRow(
                quantity=quantity,
                unit="N",
                paper=value,
                paper_sd=None,
                true=scale * value,
                identified=identified[0],
                low=identified[1],
                high=identified[2],
            )
        )
    return tuple(rows)
