# SPDX-License-Identifier: Apache-2.0
"""What a prior over tissues is worth: one unsteered and one steered insertion of a tissue that was in no choice, with
the wide priors, and with a prior of all other tissues: of other gels, or of other generated tissues.

    python benchmarks/steering_priors.py [--seeds 20 21] [--judged 12] [--keep FOLDER] [--only gels | generated]

Held-out lateral errors, next to the best simple predictor, and the share of the readings in the 95 % intervals.
"""

import argparse
import re
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from steering import RECORDINGS, SIMPLE, gel, identified, size, tissues
from unseen_tissues import FAMILIES, Tissue

import needleforce as nf
from needleforce.steering.path_errors import POSITION_NOISE

PREDICTORS = ("prediction", "mechanics", *SIMPLE)


def gels():
    """Tissue -> (all insertions, pairs of training and held-out insertions, its kind)."""
    groups = tissues(nf.steering.read(RECORDINGS / "needle-steering" / "stepwise_insertions.csv"))
    found = {}
    for name, (unsteered, steered) in groups.items():
        long = [path for path in steered if len(path) > 10]
        pairs = [([still, one], [path for path in long if path is not one]) for still, one in zip(unsteered, long)]
        own = [path for path in unsteered if re.match(f"{name}_openloop", path.name)]
        if len(long) > 1:
            found[name] = ([*own, *steered], pairs, gel(name))
    return found


def generated(seeds):
    found = {}
    for name, seed in ((name, seed) for seed in seeds for name in FAMILIES):
        tissue = Tissue(name, seed)
        paths = [
            nf.steering.TipPath(f"{name} {seed} {path.name}", path.base, path.tip, path.slope)
            for path in tissue.paths((False, False) + (True,) * 6)
        ]
        found[f"{name} {seed}"] = (paths[:4], [([paths[0], paths[2]], paths[4:])], f"{name} {seed}")
    return found


def predicted(predictor, held):
    """Of each held-out insertion: error of each predictor [mm], share in the interval, mean half width [mm]."""
    rows = []
    for path in held:
        tips = {by: predictor.tip(path, by) for by in PREDICTORS}
        half = 1.96 * np.hypot(predictor.uncertainty(path), POSITION_NOISE)
        inside = np.mean(np.abs(tips["prediction"] - path.tip)[:, :2] < half[:, None])
        rows.append([*(size((tip - path.tip)[:, :2]) for tip in tips.values()), inside, 1e3 * np.mean(half)])
    return rows


def row(name, prior, rows):
    """Cells of a table."""
    sizes, (inside, half) = np.array(rows)[:, :-2].T, np.array(rows)[:, -2:].T
    spread = f"{np.median(sizes[0]):.2f} / {np.quantile(sizes[0], 0.9):.2f} / {sizes[0].max():.2f}"
    best = min(np.median(each) for each in sizes[2:])
    medians = (f"{np.median(sizes[1]):.2f}", f"{best:.2f}", f"{np.median(sizes[0]) / best:.2f}")
    widths = (f"{inside.mean():.0%}, {inside.min():.0%}", f"{half.mean():.2f}")
    return name, prior, str(len(rows)), spread, *medians, *widths


def main(options):
    console = Console(width=150)
    heads = ("prediction, median / 90 % / worst", "mechanics", "best simple", "ratio", "inside, worst", "half width")
    table = Table("tissue", "prior", "n", *heads, title="held-out tips from two insertions, lateral error in mm")
    groups = {"gels": gels(), "generated": generated(options.seeds)}
    for kind in options.only:
        pooled, models = {}, {name: identified(paths, options.keep) for name, (paths, _, _) in groups[kind].items()}
        for name, (_, pairs, own) in list(groups[kind].items())[: options.judged]:
            others = [models[each] for each, (_, _, other) in groups[kind].items() if other != own]
            priors = {"wide": None, "of others": nf.steering.prior(others)}
            for prior, learnt in priors.items():
                rows = []
                for training, held in pairs:
                    model = identified(training, options.keep, prior=learnt, name=f"{prior} {name}")
                    rows += predicted(model.predictor, held)
                pooled.setdefault(prior, []).extend(rows)
                table.add_row(*row(name, prior, rows))
                console.print(*row(name, prior, rows))
        for prior, rows in pooled.items():
            table.add_row(*row(f"all {kind}", prior, rows))
    console.print(table)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, nargs="+", default=[20, 21])
    parser.add_argument("--judged", type=int, default=None, help="tissues that are predicted; all are learnt from")
    parser.add_argument("--only", nargs="+", choices=("gels", "generated"), default=["gels", "generated"])
    parser.add_argument("--keep", type=Path)
    main(parser.parse_args())
