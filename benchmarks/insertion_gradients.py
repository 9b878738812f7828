# SPDX-License-Identifier: Apache-2.0
"""Insertions alone identified with derivatives of the engine and with differences: time, runs, squares.

    python benchmarks/insertion_gradients.py [--rounds 5]

Each insertion is identified in turn with derivatives, and with differences and the steps of before; times are of the
processor, the median over the pairs. The squares are those of every search, of each insertion. Prints the tables of
docs/evidence/gradients.md."""

import argparse
import statistics
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from unittest import mock

import numpy as np
import scipy.optimize

import needleforce as nf
from needleforce.identification.layered import insertion_problem
from needleforce.identification.layered.insertion_problem import InsertionProblem

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "identification"))
from recorded_data import RECORDINGS
from test_insertion_layers import SITUATIONS, walls

STALKS = RECORDINGS / "other-labs" / "stalk-puncture-instron"
RIG = RECORDINGS / "needle-insertion-rig"
SHOWN = "two walls", "skin, then fat, at 100 Hz", "three films", "four walls"
SAME = 1e-3  # of the squares
STEPS_BEFORE = 60  # of a search with differences; with derivatives it may take more
least_squares = scipy.optimize.least_squares


def by_differences(residual, start, slopes, **options):
    """The same search with differences."""
    return least_squares(residual, start, **options)


class Trial:
    """What one identification took: seconds in all and in the search, runs of the engine, squares of each search."""

    def __init__(self, recording: nf.Recording, exact: bool) -> None:
        self.runs, self.search, self.squares, originals = 0, 0.0, [], vars(InsertionProblem).copy()

        def solve(problem, *start):
            began = time.process_time()
            x = originals["solve"](problem, *start)
            self.search += time.process_time() - began
            self.squares.append(float(np.sum((originals["forces"](problem, x, problem.depth) - problem.force) ** 2)))
            return x

        def forces(problem, x, depth):
            self.runs += 1
            return originals["forces"](problem, x, depth)

        with ExitStack() as patches:
            for each in (solve, forces):
                patches.enter_context(mock.patch.object(InsertionProblem, each.__name__, each))
            if not exact:
                patches.enter_context(mock.patch.object(scipy.optimize, "least_squares", by_differences))
                patches.enter_context(mock.patch.object(insertion_problem, "MAX_STEPS", STEPS_BEFORE))
            began = time.process_time()
            nf.identify([recording], model="gradual_layers")
            self.seconds = time.process_time() - began


def pairs(recording: nf.Recording, rounds: int) -> list[tuple[Trial, Trial]]:
    """With derivatives and without, one after the other."""
    return [(Trial(recording, True), Trial(recording, False)) for _ in range(rounds)]


def line(name: str, found: list[tuple[Trial, Trial]]) -> str:
    """A row of the table of times."""
    whole = statistics.median(exact.seconds / before.seconds for exact, before in found)
    search = statistics.median(exact.search / before.search for exact, before in found)
    seconds, runs = statistics.median(before.seconds for _, before in found), [each.runs for each in found[0]]
    return f"| {name} | {whole:.2f} | {search:.2f} | {seconds:.2f} | {runs[0]} for {runs[1]} |"


def squares(name: str, found: list[tuple[Trial, Trial]]) -> str:
    """How the squares compare, over all searches."""
    ratio = np.array([x / y for a, b in found for x, y in zip(a.squares, b.squares)])
    more, less = int((ratio > 1 + SAME).sum()), int((ratio < 1 - SAME).sum())
    mean = np.exp(np.log(ratio).mean())
    return f"| {name} | {len(ratio)} | {len(ratio) - more - less} | {less} | {more} | {mean:.4f} |"


def inwards(path: Path) -> nf.Recording:
    """A recording of the rig up to its deepest point."""
    run = nf.read(path)
    deepest = int(np.argmax(run.depth)) + 1
    return nf.Recording(time=run.time[:deepest], depth=run.depth[:deepest], force=run.force[:deepest])


def main(rounds: int) -> None:
    """Prints both tables."""
    stalks = {path.stem: nf.read(path) for path in sorted(STALKS.glob("*.csv"))}
    tissue = (path for path in sorted(RIG.glob("*.csv")) if "__setup__" not in path.stem)
    rig = {path.stem: inwards(path) for path in tissue}
    own = {f"{name} {seed}": walls(seed, **each) for name, each in SITUATIONS.items() for seed in range(3)}
    print("| insertion | time | of the search | seconds before | runs |\n|---|---|---|---|---|")
    for name in SHOWN:
        print(line(name, pairs(own[f"{name} 0"], rounds)), flush=True)
    print("| insertions | searches | the same | less | more | mean |\n|---|---|---|---|---|---|")
    for name, runs in (("stalks", stalks), ("rig", rig), ("simulated", own)):
        found = [each for run in runs.values() for each in pairs(run, 1) if each[0].squares]  # others have no puncture
        print(line(f"all {len(found)} {name}", found), squares(name, found), sep="\n", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    main(parser.parse_args().rounds)
