# SPDX-License-Identifier: Apache-2.0
"""Many needles that slide in the paper's tissue: InsertionBatch next to NumPy, Numba and Warp on the processor.

    python benchmarks/batch_peers.py [--seconds 0.5]

NumPy and Numba have the sliding alone: contact and puncture, refusals and the other numbers of a sample are left out.
All forces are compared before any time is taken. The shortest of seven turns counts; Warp only where it is installed.
"""

import argparse
import importlib.util
from functools import partial

import numpy as np
from insertion_batch import DT, shortest, sliding
from numba import njit
from rich.console import Console
from rich.table import Table

import needleforce as nf

MODEL = nf.preset("paper")
FRICTION, CUTTING = MODEL.friction, MODEL.cutting
SURFACE = FRICTION.dimple_ratio * MODEL.puncture.depth
STIFFNESS = FRICTION.per_length / FRICTION.presliding
PARTS = (SURFACE, FRICTION.per_length, STIFFNESS, CUTTING.force, 1.0 / CUTTING.unloading)


def in_numpy(motions: np.ndarray, before: float) -> np.ndarray:
    """One step of all members at a time."""
    surface, per_length, stiffness, full, per_travel = PARTS
    depth = np.full(motions.shape[1], before)
    traction, front, forces = np.full(depth.shape, per_length), depth.copy(), np.empty(motions.shape)
    for row, z in enumerate(motions):
        embedded = np.maximum(z - surface, 0.0)
        traction = np.clip(traction + stiffness * (z - depth), -per_length, per_length)
        front = np.maximum(front, z)
        forces[row] = traction * embedded + full * np.maximum(1.0 - (front - z) * per_travel, 0.0)
        depth = z
    return forces


@njit(fastmath=False)
def _in_numba(motions, before, surface, per_length, stiffness, full, per_travel):
    forces = np.empty(motions.shape)
    for i in range(motions.shape[1]):
        depth, traction, front = before, per_length, before
        for row in range(motions.shape[0]):
            z = motions[row, i]
            traction = min(max(traction + stiffness * (z - depth), -per_length), per_length)
            front = max(front, z)
            loaded = max(1.0 - (front - z) * per_travel, 0.0)
            forces[row, i] = traction * max(z - surface, 0.0) + full * loaded
            depth = z
    return forces


def in_numba(motions: np.ndarray, before: float) -> np.ndarray:
    return _in_numba(motions, before, *PARTS)


def in_batch(n: int):
    batch = sliding(MODEL, n)
    return lambda motions, before: batch.run(motions, DT)


def in_warp(n: int):
    """Steps that come one by one: each is a launch of a kernel."""
    import warp

    from needleforce.simulators.warp import Needles

    warp.config.quiet = True
    needles = Needles(MODEL, n)
    for depth in np.linspace(-1e-3, 12e-3, 30):
        needles.step(np.full(n, depth), 0.01)
    return lambda motions, before: np.array([needles.step(row, DT).numpy().copy() for row in motions])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--seconds", type=float, default=0.5, help="for each figure")
    seconds = parser.parse_args().seconds
    peers = {"InsertionBatch.run": in_batch, "Numba": lambda n: in_numba, "NumPy": lambda n: in_numpy}
    if importlib.util.find_spec("warp"):
        peers["Warp"] = in_warp
    table = Table("insertions", *peers, title="ns a step an insertion, force of whole motions")
    for n in (1, 10, 100, 1000, 10_000, 100_000, 1_000_000):
        steps = max(2, min(200_000 // n, 20_000))
        motions = 12e-3 + 2e-6 * (np.arange(steps)[:, None] % 2) * np.ones(n)
        works = {name: make(n) for name, make in peers.items()}
        expected = works["InsertionBatch.run"](motions, 12e-3)
        for name, work in works.items():
            np.testing.assert_allclose(work(motions, 12e-3)[1:], expected[1:], rtol=1e-9, err_msg=name)
        times = [shortest(partial(work, motions, 12e-3), seconds) for work in works.values()]
        table.add_row(f"{n:,}", *(f"{1e9 * each / motions.size:.1f}" for each in times))
    Console(width=100).print(table)


if __name__ == "__main__":
    main()
