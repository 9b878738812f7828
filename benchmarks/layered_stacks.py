# SPDX-License-Identifier: Apache-2.0
"""Layered fits of random stacks with known values: residual over the noise, warnings, intervals that hold the truth.

    python benchmarks/layered_stacks.py [--count 60] [--seed 1000]

The generator of the stacks, in the engine's own law, is ``tests/identification/known_stacks.py``, with ranges wider
than those that the search was made with, too. Prints the table of docs/evidence/layered_stacks.md."""

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import needleforce as nf

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "identification"))
from known_stacks import judged, repeats, stack, wide

AT_NOISE = 1.2  # residual over the noise
WARNED = "times the noise"


def trial(layers: int, seeds: range, made_by: Callable = stack) -> list[tuple]:
    """For each stack: residual over the noise, whether it is warned of, the number of layers, of parameters that are
    identifiable and of those that do not hold the truth, and seconds of processor."""
    rows = []
    for seed in seeds:
        made = made_by(seed, layers)
        runs, ruptures = repeats(made, seed)
        began = time.process_time()
        fit = nf.identify(runs, model="layered")
        taken = time.process_time() - began
        residual, known = judged(fit, made.truth(ruptures))
        warned = any(WARNED in each for each in fit.warnings)
        wrong = [name for name, right in known.items() if not right]
        rows.append((residual, warned, fit.settings.layers, len(known), len(wrong), taken))
        if residual > AT_NOISE or wrong:
            print(f"  seed {seed}: {residual:.2f} x noise, warned {warned}, outside {', '.join(wrong)}", flush=True)
    return rows


def line(name: str, rows: list[tuple]) -> str:
    """A row of the table of the engine's own law."""
    residual, warned, found, known, wrong, seconds = (np.array(column) for column in zip(*rows))
    right = residual <= AT_NOISE
    shares = (
        f"{100 * right.mean():.0f} %", f"{np.median(residual):.2f}", f"{residual.max():.1f}",
        f"{(found == int(name[0])).sum()}",
        f"{(warned & ~right).sum()} of {(~right).sum()}", f"{(warned & right).sum()}",
        f"{wrong[~right].sum()} of {known[~right].sum()}", f"{wrong[right].sum()} of {known[right].sum()}",
        f"{seconds.mean():.1f} s",
    )  # fmt: skip
    return f"| {name} | {len(rows)} | " + " | ".join(shares) + " |"


def main(count: int, first: int) -> None:
    """Prints the table."""
    seeds = range(first, first + count)
    lines = [line(str(layers), trial(layers, seeds)) for layers in (2, 3)]
    lines.append(line("3, wide", trial(3, range(first + 8000, first + 8000 + count // 2), wide)))
    heads = ("layers", "stacks", "at ≤ 1.2 × noise", "median", "largest", "number of layers right",
             "above, warned", "below, warned", 
             "identifiable and outside, above", "the same, at the noise", "processor")  # fmt: skip
    print("\n".join(["| " + " | ".join(heads) + " |", "|---" * len(heads) + "|", *lines, ""]))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=60, help="stacks of each number of layers")
    parser.add_argument("--seed", type=int, default=1000, help="of the first stack")
    options = parser.parse_args()
    main(options.count, options.seed)
