# SPDX-License-Identifier: Apache-2.0
"""Recordings of other laboratories: punctures by eye and by ``identify``, and the model's force at the first of them.

    python benchmarks/other_laboratories.py [--write docs/evidence/other_laboratories.md]

Stalks (force and extension of a universal testing machine) were read by eye before the detector ran on them; the sheet
of the microneedles has no depth, so that a steady travel is assumed."""

import argparse
import csv
import os
import sys
import warnings
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
import numpy as np
import pandas as pd

import needleforce as nf

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))
from recorded_data import RECORDINGS  # noqa: E402

READINGS = ROOT / "tests" / "segmentation" / "eye_readings_stalks.csv"
STEP, SPEED = 5e-6, 1e-3  # [m], [m/s] assumed for the microneedles
MET = 0.05  # of the measured force at the puncture
HEAD = """# Recordings of other laboratories

Made by `python benchmarks/other_laboratories.py --write docs/evidence/other_laboratories.md`. Nothing in the program
knows these files. *Eye* are depths [mm] with the forces [N] at and after the fall, read from plots before the detector
ran; *found* are those of `nf.segment`. *Model / measured* is the largest force of the identified model up to the first
puncture over the measured one, from `nf.identify` without a model named. A law that misses the measured force by more
than 5 % or its noise is no model: the recording is *declined*, with the reason.

The stalks are hollow, and a one-layer model describes the first wall: the residual over the complete cycle is
that of the second wall, which a warning names. The microneedles are arrays pressed into a film, without withdrawal and
mostly without free travel before contact: events and the force at the puncture are given, friction and cutting are not.

"""


@dataclass(frozen=True)
class Row:
    """One recording: punctures by eye and found [mm], the model and its force over the measured one; or why there is
    none."""

    name: str
    eye: str
    found: tuple[float, ...]
    model: str
    ratio: float
    residual: float

    @property
    def verdict(self) -> str:
        if not np.isfinite(self.ratio):
            return "declined"
        return "met" if abs(self.ratio - 1.0) <= MET else "not met"


def stalks(folder: Path) -> Iterator[tuple[str, str, nf.Recording]]:
    """Name, punctures by eye, and recording of each stalk."""
    with READINGS.open() as file:
        readings = {row["recording"]: row for row in csv.DictReader(line for line in file if line[0] != "#")}
    for path in sorted((folder / "stalk-puncture-instron").glob("*.csv")):
        time, depth, force = pd.read_csv(path).iloc[1:].astype(float).to_numpy().T
        seen = readings.get(path.stem, {}).get("punctures", "")
        yield path.stem, seen, nf.Recording(time=time, depth=1e-3 * depth, force=force)


def microneedles(folder: Path) -> Iterator[tuple[str, str, nf.Recording]]:
    """Name and recording of each microneedle; the third row of the sheet is a summary."""
    sheet = pd.read_excel(
        folder / "microneedle-penetration" / "microneedle-data-2.xlsx",
        header=None,
        sheet_name="RAW DATA",
        engine="openpyxl",
    )
    for column in sheet.columns[sheet.iloc[1].notna()]:
        force = pd.to_numeric(sheet.iloc[3:, column], errors="coerce").dropna().to_numpy(float)
        if len(force) >= 50:
            depth = STEP * np.arange(len(force))
            yield str(sheet.iloc[1, column]), "", nf.Recording(time=depth / SPEED, depth=depth, force=force)


def row_of(given: tuple[str, str, nf.Recording]) -> Row:
    """The row of one recording."""
    name, eye, recording = given
    warnings.simplefilter("ignore")
    fit = nf.identify(recording)
    one = fit.recordings[0]
    found = tuple(1e3 * each.depth for each in one.events.punctures)
    if fit.identified_model is None or not found or not len(one.residuals):
        return Row(name, eye, found, "none", np.nan, np.nan)
    first = one.events.punctures[0]
    last = int(np.searchsorted(recording.time, first.time)) + 1
    zero = fit.parameters["force_offset"].value if "force_offset" in fit.parameters else 0.0
    ratio = (float(one.predicted[:last].max()) - zero) / (float(recording.force[:last].max()) - zero)
    return Row(name, eye, found, fit.model.name.removeprefix("identified_"), ratio, fit.quality.nrmse)


def table(rows: list[Row]) -> Iterator[str]:
    """Markdown of the stalks, one line each."""
    yield "| recording | eye | found | model | model / measured | residual / peak |"
    yield "|---|---|---|---|---|---|"
    for row in rows:
        depths = ", ".join(f"{each:.2f}" for each in row.found)
        numbers = ("–", "–") if row.verdict == "declined" else (f"{row.ratio:.3f}", f"{100 * row.residual:.1f} %")
        yield f"| {row.name} | {row.eye} | {depths} | `{row.model}` | {' | '.join(numbers)} |"


def summary(title: str, rows: list[Row]) -> str:
    """One sentence on a group of recordings."""
    counts = {each: sum(row.verdict == each for row in rows) for each in ("met", "declined", "not met")}
    ratios = [row.ratio for row in rows if np.isfinite(row.ratio)]
    low, middle, high = np.percentile(ratios, [5, 50, 95])
    return (
        f"{title}: {len(rows)} recordings. The model is within 5 % of the measured force at the puncture in "
        f"{counts['met']}, declined in {counts['declined']}, not within in {counts['not met']}; model / measured "
        f"{middle:.3f} (5 to 95 %: {low:.3f} to {high:.3f})."
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", type=Path)
    given = parser.parse_args()
    folder = RECORDINGS / "other-labs"
    with ProcessPoolExecutor() as pool:
        rows = {
            "Stalks": list(pool.map(row_of, stalks(folder))),
            "Microneedles": list(pool.map(row_of, microneedles(folder))),
        }
    text = "\n".join((*(summary(title, each) + "\n" for title, each in rows.items()), *table(rows["Stalks"])))
    print(text)
    if given.write:
        given.write.write_text(HEAD + text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
