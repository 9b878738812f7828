# SPDX-License-Identifier: Apache-2.0
"""Tip paths that were held out: trained on the open-loop insertions of a tissue and at most two steered ones, the other
steered ones are predicted from the motion of their base and their entry. Next to a unicycle, a bicycle and a curve.

    python benchmarks/steering.py [FILE] [--model yielding]
"""

import argparse
import itertools
import math
import re
import sys
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

import needleforce as nf

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from recorded_data import RECORDINGS

# outer diameter and E I of an 18 gauge needle; tip paths alone give ratios to E I
NEEDLE = nf.Needle(1.27e-3, 0.0, 0.6, 0.0206518 * 64.0 / (math.pi * 1.27e-3**4))


def tissues(paths):
    """Tissue -> (unsteered, steered) insertions, by the name in front of the kind. A tissue without unsteered ones
    takes those of the tissue with the same beginning."""
    groups = {}
    for path in paths:
        tissue = re.sub(r"_(open|closed)loop.*", "", path.name)
        groups.setdefault(tissue, ([], []))["closedloop" in path.name].append(path)
    for tissue, (unsteered, _) in groups.items():
        if not unsteered:
            unsteered += next((g[0] for name, g in groups.items() if g[0] and tissue.startswith(name)), [])
    return groups


def error(predicted, path):
    """Root mean square, largest and last lateral error [mm]."""
    distance = 1e3 * np.linalg.norm(predicted[:, :2] - path.tip[:, :2], axis=1)
    return math.sqrt(np.mean(distance**2)), distance.max(), distance[-1]


def covered(fit, path):
    """Share of the readings in the 95 % interval of the prediction, with 0.2 mm of noise of a reading."""
    off = np.abs(fit.predict(path) - path.tip)[:, :2]
    return np.mean(off < 1.96 * np.hypot(fit.uncertainty(path), 0.2e-3)[:, None])


def entry(path):
    """Position and slope at the entry, from the rows before the base moves, of the mean position and direction."""
    rows = min(path.entry_rows, 2)
    slope = path.slope[:rows].mean(axis=0)
    return path.tip[:rows, :2].mean(axis=0) - slope * path.depth[:rows].mean(), slope


def curve(training):
    """Entry angle and curvature (2, 2) that fit the training insertions, against the slope at their entry."""
    rows, sides = [], []
    for path in training:
        start, slope = entry(path)
        s = path.depth
        rows.append(np.column_stack([s, 0.5 * s**2]))
        sides.append(path.tip[:, :2] - start - np.outer(s, slope))
    return np.linalg.lstsq(np.vstack(rows), np.vstack(sides), rcond=None)[0]


def predicted_curve(coefficients, path):
    start, slope = entry(path)
    s = path.depth
    return start + np.outer(s, slope) + np.column_stack([s, 0.5 * s**2]) @ coefficients


def kinematic(training, path, model):
    """Unicycle or bicycle with the curvature that fits the training insertions; the second wheel of the bicycle leaves
    its entry angle free, too."""
    coefficients = curve(training)
    if model == "unicycle":
        coefficients = coefficients * [[0.0], [1.0]]
    curvature = np.hypot(*coefficients[1])
    roll = math.atan2(coefficients[1, 1], coefficients[1, 0])
    start, slope = entry(path)
    car = nf.steering.Unicycle(curvature)
    tilt = np.arctan(slope + coefficients[0])
    tips = [car.step(float(s), tuple(start), roll=roll, tilt=tuple(tilt)).tip for s in (0.0, *path.depth)]
    return np.array(tips[1:])


def held_out(unsteered, steered, model, console):
    """Name of a predictor -> rows of errors over all choices of the steered training insertions."""
    rows, inside = {}, []
    count = 2 if len(steered) > 2 else 1
    for chosen in itertools.combinations(steered, count):
        training = [*unsteered, *chosen]
        with console.status(f"{', '.join(path.name for path in chosen)} and {len(unsteered)} unsteered"):
            fit = nf.steering.identify(training, NEEDLE, model=model)
        for path in steered:
            if path in chosen:
                continue
            inside.append(covered(fit, path))
            for name, predicted in (
                (f"mechanics, {model}", fit.predict(path)),
                ("unicycle", kinematic(training, path, "unicycle")),
                ("bicycle", kinematic(training, path, "bicycle")),
                ("entry angle and curvature", predicted_curve(curve(training), path)),
            ):
                rows.setdefault(name, []).append(error(predicted, path))
    return rows, np.mean(inside)


def main(file, model):
    console = Console(width=110)
    table = Table(
        "tissue",
        "predictor",
        "n",
        "rms, median / worst",
        "largest",
        "last row",
        title="held-out tips, lateral error in mm",
    )
    for tissue, (unsteered, steered) in tissues(nf.steering.read(file)).items():
        predictors, inside = held_out(unsteered, steered, model, console)
        console.print(f"{tissue}: {100.0 * inside:.0f} % of the readings in the 95 % interval")
        for name, rows in predictors.items():
            values = np.array(rows)
            cells = [f"{np.median(v):.2f} / {v.max():.2f}" for v in values.T]
            table.add_row(tissue, name, str(len(values)), *cells)
    console.print(table)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", nargs="?", default=RECORDINGS / "needle-steering" / "stepwise_insertions.csv")
    parser.add_argument("--model", default="yielding")
    options = parser.parse_args()
    main(options.file, options.model)
