# SPDX-License-Identifier: Apache-2.0
"""Steering in tissues that no law of the package describes (tests/unseen_tissues.py): how far predictions are off from
one, two or four insertions, next to simple models, how many readings the 95 % intervals hold and how wide they are, how
often the advised predictor is within 5 % of the best on fresh insertions, and how many plans end within their radius.

    python benchmarks/steering_unseen.py [--tissues 7] [--first 0] [--training 1 2 4] [--plans 0] [--processes 2]
"""

import argparse
import multiprocessing
import re
import sys
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

import needleforce as nf
from needleforce.steering import BaseMotion, SteeringLimits, plan
from needleforce.steering.path_errors import POSITION_NOISE

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from unseen_tissues import FAMILIES, PUSH, ROW, STIFFNESS, Tissue, motion

NEEDLE = nf.Needle(1.27e-3, 0.0, 0.6, STIFFNESS * 64.0 / (np.pi * 1.27e-3**4))
INSERTIONS = (False, False, True, True, True, True, True, True)  # steered ones; the last four are predicted
TRAINING = {1: (2,), 2: (0, 2), 4: (0, 1, 2, 3)}
HELD = (4, 5, 6, 7)
SIMPLE = ("regression", "bicycle", "unicycle")
PREDICTORS = ("prediction", "mechanics", *SIMPLE)
LIMITS = SteeringLimits(max_lateral=6e-3, max_lateral_step=3e-3)


def size(error):
    """Root mean square lateral error [mm] of errors (n, 2) [m]."""
    return 1e3 * np.sqrt(np.mean(np.sum(error**2, axis=1)))


def advised(fit):
    """The predictor that a fit advises."""
    found = [re.search(r"by='(\w+)'", remark) for remark in fit.remarks()]
    return next((match.group(1) for match in found if match), "prediction")


def predicted(fit, held):
    """Median error of each predictor [mm], shares of the readings in the intervals, and mean half width [mm]."""
    sizes, inside, widths = {by: [] for by in PREDICTORS}, [], []
    for path in held:
        for by in PREDICTORS:
            sizes[by].append(size((fit.predict(path, by=by) - path.tip)[:, :2]))
        half = 1.96 * np.hypot(fit.uncertainty(path), POSITION_NOISE)
        inside.append(np.mean(np.abs(fit.predict(path) - path.tip)[:, :2] < half[:, None]))
        widths.append(1e3 * np.mean(half))
    medians = {by: float(np.median(values)) for by, values in sizes.items()}
    best = min(medians[by] for by in ("prediction", *SIMPLE))
    return medians | {
        "inside": float(np.mean(inside)),
        "width": float(np.mean(widths)),
        "advised": medians[advised(fit)] <= 1.05 * best,
        "simple": advised(fit) != "prediction",
    }


def executed(model, tissue, number):
    """Of a plan to a random target as it was, and of one made anew after each tip: distance of the tip from the target
    and from the end of the plan, which may say that the target is out of reach, and the 95 % radius there."""
    random = np.random.default_rng([99, *tissue.key, number])
    rows = int(random.integers(13, 21))
    depth = ROW * np.arange(rows)
    still = plan(model, (0.0, 0.0, depth[-1]), limits=LIMITS).problem
    goal = BaseMotion(still.depths, motion(random, True)[: len(still.depths)], np.zeros(len(still.depths)))
    target = np.append(still.predicted(goal)[0][-1, :2], depth[-1])
    current, found = plan(model, target, limits=LIMITS), []

    def inserted(moves, count):
        depths = PUSH * np.rint(moves.depth[:count] / PUSH)
        return tissue.inserted("now", depths, moves.lateral[:count], np.random.default_rng([7, *tissue.key, number]))

    for anew in (False, True):
        for row in range(1, len(current.motion)) if anew else ():
            current = current.replan(inserted(current.motion, row)[1])
        tip, _ = inserted(current.motion, len(current.motion))
        end = tip[-1] - tip[0]
        found += [1e3 * np.hypot(*(end - aim[:2])) for aim in (target, current.path[-1])] + [1e3 * current.tube()[-1]]
    return found


def one(job):
    family, seed, counts, plans = job
    tissue = Tissue(family, seed)
    paths = tissue.paths(INSERTIONS)
    fits = {count: nf.steering.identify([paths[k] for k in TRAINING[count]], NEEDLE) for count in counts}
    found = {count: predicted(fit, [paths[k] for k in HELD]) for count, fit in fits.items()}
    return family, found, [executed(fits[max(counts)].model, tissue, number) for number in range(plans)]


def show(found, console):
    heads = ("family", "insertions", *PREDICTORS, "inside, worst tissue", "half width", "advice right")
    table = Table(*heads, title="lateral error in mm, geometric mean of the tissues' medians")
    for count in sorted({count for _, each, _ in found for count in each}):
        for family in (*FAMILIES, "all"):
            rows = [each[count] for name, each, _ in found if family in (name, "all")]
            if not rows:
                continue
            sizes = (f"{np.exp(np.mean([np.log(row[by]) for row in rows])):.2f}" for by in PREDICTORS)
            inside = [row["inside"] for row in rows]
            width, right = np.mean([row["width"] for row in rows]), sum(row["advised"] for row in rows)
            shares = f"{np.mean(inside):.0%}, {min(inside):.0%}"
            table.add_row(family, str(count), *sizes, shares, f"{width:.2f}", f"{right} of {len(rows)}")
    console.print(table)
    plans = np.array([each for _, _, several in found for each in several])
    for name, k in (("as planned", 0), ("planned anew after each tip", 3)) if len(plans) else ():
        off, apart, radius = plans[:, k : k + 3].T
        line = f"{np.sum(apart < radius)} of {len(off)} within the 95 % radius, {np.median(radius):.2f} mm (median)"
        console.print(f"{name}: {np.median(off):.2f} / {np.quantile(off, 0.9):.2f} / {off.max():.2f} mm, {line}")


def main(options):
    console = Console(width=140)
    seeds = range(options.first, options.first + options.tissues)
    jobs = [(family, seed, options.training, options.plans) for seed in seeds for family in FAMILIES]
    with multiprocessing.Pool(options.processes) as pool:
        found = list(track(pool.imap_unordered(one, jobs), "tissues", total=len(jobs), console=console))
    show(found, console)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tissues", type=int, default=7, help="of each family")
    parser.add_argument("--first", type=int, default=0, help="seed of the first")
    parser.add_argument("--training", type=int, nargs="+", choices=TRAINING, default=list(TRAINING))
    parser.add_argument("--plans", type=int, default=0, help="targets in each tissue")
    parser.add_argument("--processes", type=int, default=2)
    main(parser.parse_args())
