# SPDX-License-Identifier: Apache-2.0
"""The cost of a step of one of many insertions, next to single ones, in one run.

    python benchmarks/insertion_batch.py [--seconds 0.5]

Each kind steps insertions that slide 12 mm deep, back and forth by 2 um; the shortest of seven turns counts.
"""

import argparse
import time

import numpy as np
from rich.console import Console
from rich.table import Table

import needleforce as nf

DT = 1e-3


def shortest(work, seconds: float, clock=time.process_time) -> float:
    """Shortest time of a call [s] in seven turns, in each of which the calls take a share of so many seconds; of the
    processor, which a busy machine does not lengthen by the time of others."""
    began = clock()
    work()
    calls = max(1, int(seconds / 7.0 / max(clock() - began, 1e-9)))
    times = []
    for _ in range(7):
        began = clock()
        for _ in range(calls):
            work()
        times.append((clock() - began) / calls)
    return min(times)


def sliding(model, n: int, *, own: bool = False) -> nf.InsertionBatch:
    """A batch 12 mm deep."""
    batch = nf.InsertionBatch([model] * n if own else model, None if own else n)
    batch.run(np.linspace(-1e-3, 12e-3, 30)[:, None].repeat(n, 1), 0.01)
    return batch


def in_layers(count: int):
    """The paper's tissue in layers of 2.5 mm."""
    paper, puncture = nf.preset("paper"), nf.laws.PunctureDepth(1e-3)
    parts = {"stiffness": paper.stiffness, "friction": paper.friction, "cutting": paper.cutting, "puncture": puncture}
    tops = [2.5e-3 * (k + 1) for k in range(count - 1)]
    return paper.replace(puncture=puncture, deeper=tuple(nf.Layer(top=top, **parts) for top in tops))


def first_cost(model, n: int, seconds: float) -> float:
    """Of a step from outside through touch and puncture, each member with a model of its own [ns]: what a tip's table
    takes does not come again."""
    batch, motion = nf.InsertionBatch([model] * n), np.linspace(-1e-3, 12e-3, 300)[:, None].repeat(n, 1)

    def work():
        batch.reset()
        batch.run(motion, 0.01)

    return 1e9 * shortest(work, seconds) / motion.size


def step_cost(batch: nf.InsertionBatch, seconds: float) -> float:
    """Of a member in a step that gives all its numbers [ns]."""
    places = [np.full(len(batch), 12e-3 + shift) for shift in (0.0, 2e-6)]
    dt = np.array([DT])

    def work():
        for depth in places:
            batch.step(depth, None, dt)

    return 1e9 * shortest(work, seconds) / (2 * len(batch))


def run_cost(batch: nf.InsertionBatch, seconds: float) -> float:
    """Of a member in a step of a whole motion, of which the force alone is given [ns]."""
    steps = max(2, 200_000 // len(batch))
    motions = 12e-3 + 2e-6 * (np.arange(steps)[:, None] % 2) * np.ones(len(batch))
    return 1e9 * shortest(lambda: batch.run(motions, DT), seconds) / motions.size


def costs(batch: nf.InsertionBatch, seconds: float) -> tuple[str, str]:
    """Both, as they are shown."""
    return f"{step_cost(batch, seconds):.1f}", f"{run_cost(batch, seconds):.1f}"


def single_cost(model, seconds: float) -> tuple[float, float]:
    """Of a single insertion, called from Python and over an array [ns]."""
    one, dt = nf.Insertion(model), np.full(100_000, DT)
    one.forces(np.linspace(-1e-3, 12e-3, 1000), np.full(1000, DT))
    places = 12e-3 + 2e-6 * (np.arange(len(dt)) % 2)
    called = shortest(lambda: one.step(12e-3, None, DT), seconds)
    return 1e9 * called, 1e9 * shortest(lambda: one.forces(places, dt), seconds) / len(dt)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seconds", type=float, default=0.5, help="for each figure")
    seconds = parser.parse_args().seconds
    table = Table("insertions", "all numbers, a step each", "force, whole motions", title="ns a step an insertion")
    model = nf.preset("paper")
    called, along = single_cost(model, seconds)
    table.add_row("1, nf.Insertion", f"{called:.0f}", f"{along:.1f}")
    for n in (1, 10, 100, 1000, 10_000, 100_000, 1_000_000):
        table.add_row(f"{n:,}", *costs(sliding(model, n), seconds))
    table.add_row("10,000, each its own model", *costs(sliding(model, 10_000, own=True), seconds))
    table.add_row(
        "1000 blunted_cone, each its own, from outside",
        "",
        f"{first_cost(nf.preset('blunted_cone'), 1000, seconds):.1f}",
    )
    for name, each in (
        ("two layers of the paper's", in_layers(2)),
        ("four layers of the paper's", in_layers(4)),
        ("relaxing", nf.preset("relaxing")),
        ("layered", nf.preset("layered")),
    ):
        called, along = single_cost(each, seconds)
        table.add_row(f"1, {name}", f"{called:.0f}", f"{along:.1f}")
        table.add_row(f"1000, {name}", *costs(sliding(each, 1000), seconds))
    Console(width=100).print(table)


if __name__ == "__main__":
    main()
