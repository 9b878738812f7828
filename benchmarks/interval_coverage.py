# SPDX-License-Identifier: Apache-2.0
"""How often the 95 % intervals of ``nf.identify`` hold the truth, with an unknown zero of the force and noise of the
depth: simulated insertions of the paper's specimen, white or averaged noise of the force.

    python benchmarks/interval_coverage.py --runs 1000
"""

import argparse
from collections import Counter

import numpy as np

import needleforce as nf
from needleforce.recording import Card

NOISE_N, RATE_HZ, OFFSET_N = 4e-3, 500.0, 0.2
TRUTH = {"friction_per_length": 18.6, "cutting_force": 0.0776, "contact_depth": 0.0}
FROM_FIT = ("stiffness_coefficient", "puncture_depth", "puncture_indentation", "puncture_force")
CONDITIONS = [(length, depth_noise) for length in (1, 10) for depth_noise in (0.0, 5e-6)]
HEAD = ("filter", "depth noise", "runs", *TRUTH, *FROM_FIT)


def averaged(values: np.ndarray, length: int) -> np.ndarray:
    """Values (n,) behind an average over the ``length`` last ones."""
    padded = np.concatenate([np.full(length - 1, values[0]), values])
    return np.convolve(padded, np.full(length, 1.0 / length), "valid")


def recording(run: nf.Recording, length: int, depth_noise: float, seed: int) -> nf.Recording:
    """One recording with its own zero of the force."""
    random = np.random.default_rng(seed)
    force = run.force + random.uniform(-OFFSET_N, OFFSET_N) + random.normal(0.0, NOISE_N, len(run))
    depth = run.depth + (random.normal(0.0, depth_noise, len(run)) if depth_noise else 0.0)
    return nf.Recording(time=run.time, depth=depth, force=averaged(force, length), card=Card(filter_length=length))


def shares(runs: int, length: int, depth_noise: float, truth: dict[str, float], run: nf.Recording) -> Counter:
    """How often the interval of each parameter holds the truth."""
    inside: Counter = Counter()
    for seed in range(runs):
        found = nf.identify(recording(run, length, depth_noise, seed), model="paper").parameters
        for name, value in truth.items():
            inside[name] += name in found and found[name].low <= value <= found[name].high
    return inside


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--runs", type=int, default=1000)
    runs = parser.parse_args().runs
    motion = nf.Motion.insert(start=-4e-3, speed=3e-3, depth=11e-3, hold=0.5, withdraw=True)
    fine = nf.identify(nf.simulate(nf.preset("paper"), motion, rate=40_000.0), model="paper").parameters
    truth = TRUTH | {name: fine[name].value for name in FROM_FIT}
    run = nf.simulate(nf.preset("paper"), motion, rate=RATE_HZ)
    print(" | ".join(HEAD))
    for length, depth_noise in CONDITIONS:
        inside = shares(runs, length, depth_noise, truth, run)
        cells = (f"{100.0 * inside[name] / runs:.1f} %" for name in truth)
        print(" | ".join((str(length), f"{1e6 * depth_noise:g} µm", str(runs), *cells)), flush=True)


if __name__ == "__main__":
    main()
