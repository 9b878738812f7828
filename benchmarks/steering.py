# SPDX-License-Identifier: Apache-2.0
"""Tip paths that were held out: trained on the open-loop insertions of a tissue and at most two steered ones, the other
steered ones are predicted from the motion of their base and their entry: by mechanics, by simple models, by both.

    python benchmarks/steering.py [FILE] [--model yielding] [--full] [--keep FOLDER]

Whole gels are left out of what is common to all: the simple model that joins the mechanics, and the width of the
intervals, are those that the other gels show. Without --full, three choices of steered training insertions a tissue.
Identified needles are kept in a folder, if one is given, and read from there again.
"""

import argparse
import dataclasses
import hashlib
import itertools
import math
import re
import sys
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

import needleforce as nf
from needleforce.steering import path_prediction
from needleforce.steering.path_prediction import PathPredictor

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


def size(error):
    """Root mean square lateral error [mm] of errors (n, 2) [m]."""
    return 1e3 * math.sqrt(np.mean(np.sum(error**2, axis=1)))


def gel(tissue):
    """The gel of a tissue, with and without skin."""
    return tissue.split("_")[0]


def entry(path):
    """Position and slope at the entry, from the rows before the base moves, of the mean position and direction."""
    rows = min(path.entry_rows, 2)
    slope = path.slope[:rows].mean(axis=0)
    return path.tip[:rows, :2].mean(axis=0) - slope * path.depth[:rows].mean(), slope


def curve(training):
    """Curvature (2,) that fits the training insertions, against the slope at their entry."""
    rows, sides = [], []
    for path in training:
        start, slope = entry(path)
        rows.append(0.5 * path.depth**2)
        sides.append(path.tip[:, :2] - start - np.outer(path.depth, slope))
    return np.linalg.lstsq(np.concatenate(rows)[:, None], np.vstack(sides), rcond=None)[0][0]


def unicycle(training, path):
    """Tip across by the exact kinematics, with the curvature that fits the training insertions."""
    curvature = curve(training)
    car, (start, slope) = nf.steering.Unicycle(np.hypot(*curvature)), entry(path)
    roll, tilt = math.atan2(*curvature[::-1]), tuple(np.arctan(slope))
    tips = [car.step(float(s), tuple(start), roll=roll, tilt=tilt).tip for s in (0.0, *path.depth)]
    return np.array(tips[1:])[:, :2]


@dataclasses.dataclass
class HeldOut:
    """One insertion as it was predicted: errors by predictor (n, 2) [m], and what its prediction was made with."""

    path: nf.steering.TipPath
    errors: dict
    predictor: PathPredictor

    @classmethod
    def predicted(cls, predictor, training, path):
        tips = {by: predictor.tip(path, by)[:, :2] for by in (*SIMPLE, "mechanics")}
        tips["unicycle, exact kinematics"] = unicycle(training, path)
        tips[JOINED] = predictor.tip(path)[:, :2]
        return cls(path, {by: tip - path.tip[:, :2] for by, tip in tips.items()}, predictor)

    def ratio(self, by):
        """Mean square of the errors over the expected one, before it is scaled."""
        sd = self.predictor.uncertainty(self.path, weight=1.0) / self.predictor.error_scale(1.0)
        return np.mean(self.errors[by] ** 2 / (sd**2 + path_prediction.POSITION_NOISE**2)[:, None])

    def covered(self, by):
        """Share of the readings in the 95 % interval, with 0.2 mm of noise of a reading."""
        sd = self.predictor.uncertainty(self.path, weight=1.0 if by == "mechanics" else None)
        sd = np.hypot(sd, path_prediction.POSITION_NOISE)
        return np.mean(np.abs(self.errors[by]) < 1.96 * sd[:, None])


JOINED = "mechanics and regression"
COMBINED = ("mechanics", JOINED)
SIMPLE = ("unicycle", "bicycle", "regression")


def identified(training, folder, model="yielding", prior=None, name=""):
    """What predicts other insertions, from a folder if it is there."""
    key = "|".join([model, name, *(path.name for path in training)])
    file = folder and folder / f"{hashlib.sha256(key.encode()).hexdigest()[:16]}.toml"
    if file and file.exists():
        return nf.steering.load(file)
    fit = nf.steering.identify(training, NEEDLE, model=model, prior=prior)
    if file:
        fit.save(file)
    return fit.model


def held_out(unsteered, steered, options, console):
    """Held-out insertions of a tissue over choices of the steered training insertions."""
    choices = list(itertools.combinations(steered, 2 if len(steered) > 2 else 1))
    found = []
    for chosen in choices if options.full else choices[:: max(1, len(choices) // 3)][:3]:
        training = [*unsteered, *chosen]
        with console.status(f"{', '.join(path.name for path in chosen)} and {len(unsteered)} unsteered"):
            predictor = identified(training, options.keep, options.model).predictor
            found += [HeldOut.predicted(predictor, training, path) for path in steered if path not in chosen]
    return found


def judged(tissue, found):
    """Name of a predictor -> (errors, coverage or None) of a tissue; what the other gels alone decide is marked."""
    others = [each for name, group in found.items() if gel(name) != gel(tissue) for each in group]
    sizes = {by: [size(each.errors[by]) for each in found[tissue]] for by in found[tissue][0].errors}
    chosen = min(COMBINED, key=lambda by: np.mean([size(each.errors[by]) for each in others]))
    path_prediction.GELS = len({gel(name) for name in found if gel(name) != gel(tissue)})
    rows, best = {}, min(np.median(sizes[by]) for by in SIMPLE)
    for by, values in sizes.items():
        coverage = None
        if by in COMBINED:
            path_prediction.GELS_RATIO = np.mean([each.ratio(by) for each in others])
            coverage = [each.covered(by) for each in found[tissue]]
        rows[by + " *" * (by == chosen)] = (values, coverage, np.median(values) / best)
    return rows


def main(options):
    console = Console(width=120)
    heads = ("n", "rms, median / 90 % / worst", "of the best simple one", "in the 95 % interval, worst insertion")
    table = Table("tissue", "predictor", *heads)
    groups = tissues(nf.steering.read(options.file))
    found = {name: held_out(*group, options, console) for name, group in groups.items() if len(group[1]) > 1}
    for gels in sorted({gel(name) for name in found}):
        ratios = [each.ratio(JOINED) for name in found if gel(name) == gels for each in found[name]]
        console.print(f"{gels}: mean square of the errors over the expected one {np.mean(ratios):.2f}")
    for tissue in found:
        for by, (sizes, coverage, share) in judged(tissue, found).items():
            figures = f"{np.median(sizes):.2f} / {np.quantile(sizes, 0.9):.2f} / {max(sizes):.2f}"
            inside = "" if coverage is None else f"{np.mean(coverage):.0%}, {min(coverage):.0%}"
            table.add_row(tissue, by, str(len(sizes)), figures, f"{share:.2f}", inside)
    table.title = (
        "held-out tips, lateral error in mm; * best in the other gels, which also give the width of the intervals"
    )
    console.print(table)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", nargs="?", default=RECORDINGS / "needle-steering" / "stepwise_insertions.csv")
    parser.add_argument("--model", default="yielding")
    parser.add_argument("--full", action="store_true")
    parser.add_argument("--keep", type=Path)
    main(parser.parse_args())
