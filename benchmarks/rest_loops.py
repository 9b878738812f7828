# SPDX-License-Identifier: Apache-2.0
"""Random devices with random elements that stick and slip in their loops: what is proved to rest never cycles, and how
far the proof is from the stiffness at which loops do. ``python benchmarks/rest_loops.py [loops]``"""

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from needleforce.control.device_loop import Device, growth, linear_limit
from needleforce.control.rest_proof import Loop

HERE = Path(__file__).parent
LOOPS_A_DEVICE = 25
ELEMENTS = 4
RANGE = 5.0  # stiffness over the proved one, from its inverse on
STILL = 1e-4  # range of the force over the sum of the limits
DECAYS = 30.0  # time constants of the slowest decay after which a loop at rest is still: exp(-30)
MAX_CYCLES = 1_000_000  # of a simulated loop; slower decays are counted apart
WINDOWS = 30  # at least, each of two periods
CYCLING = 0.999  # range of the force in the last window over that of the window before


def random_device(rng: np.random.Generator) -> Device:
    def between(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    return Device(
        mass=between(0.01, 2.0),
        damping=between(0.02, 20.0),
        stiffness=0.0 if rng.random() < 0.3 else between(1.0, 2000.0),
        rate=float(rng.choice([250, 500, 1000, 2000, 4000, 10_000])),
        lag=0.0 if rng.random() < 0.3 else between(1e-4, 5e-3),
        delay=int(rng.integers(0, 4)),
        controller_damping=0.0 if rng.random() < 0.7 else between(0.02, 5.0),
    )


def random_elements(stiffness: float, rng: np.random.Generator) -> tuple[np.ndarray, ...]:
    """Stiffness, lower and upper limit of the elements, of friction, or of cutting, which only pushes."""
    shares = rng.dirichlet(np.ones(ELEMENTS)) * (rng.random(ELEMENTS) < 0.7)
    shares[0] += 1e-3
    high = np.exp(rng.uniform(np.log(0.01), 0.0, ELEMENTS)) * (shares > 0)
    low = np.where(rng.random(ELEMENTS) < 0.3, 0.0, -high)
    return shares / shares.sum() * stiffness, low, high


def random_loop(device: Device, stiffness: float, rng: np.random.Generator) -> tuple[list[float], bool]:
    """One loop as the C++ program reads it, and whether it is run for as long as its decay needs."""
    change, push = np.zeros((3, 3)), np.zeros(3)
    order = len(device.step[0])
    change[:order, :order], push[:order] = device.step[0], device.step[1][:, 0]
    elements, low, high = random_elements(stiffness, rng)
    force = rng.uniform(low, high)
    start = [rng.normal(0, 2) * high.sum() / stiffness, rng.normal(0, 0.1), force.sum() if order == 3 else 0.0]
    # all stuck, one alone stuck, none
    modes = [growth(device, each) for each in (stiffness, *elements[elements > 0.0])]
    slowest = max(
        *modes, growth(device, 0.0) if device.stiffness else np.exp(-device.damping / device.mass / device.rate)
    )
    needed = DECAYS / (1.0 - slowest) if slowest < 1.0 else 0.0
    softest = np.sqrt(device.mass / (device.stiffness or stiffness))
    window = np.clip(np.ceil(4.0 * np.pi * softest * device.rate), 200, MAX_CYCLES / WINDOWS)
    cycles = np.clip(needed, WINDOWS * window, MAX_CYCLES)
    size = STILL * high.sum()
    numbers = [device.delay, device.controller_damping * device.rate, *elements, *low, *high, *start, *force]
    return [*change.ravel(), *push, *numbers, size, window, cycles], needed <= MAX_CYCLES


def measure(count: int, seed: int = 7) -> dict[str, np.ndarray]:
    """Draws devices and loops, and simulates them: columns, one row for each loop."""
    rng, loops, about, refused = np.random.default_rng(seed), [], [], 0
    began = reported = time.monotonic()
    while len(loops) < count:
        device = random_device(rng)
        proved, _ = Loop.of(device).max_stiffness()
        if proved == 0.0:  # too much damping of the controller: the device alone oscillates
            refused += 1
            continue
        limit = linear_limit(device) / proved
        for ratio in np.exp(rng.uniform(-np.log(RANGE), np.log(RANGE), LOOPS_A_DEVICE)):
            loop, long_enough = random_loop(device, ratio * proved, rng)
            loops.append(loop)
            about.append((ratio, limit, long_enough))
        if time.monotonic() - reported > 4.0:
            reported = time.monotonic()
            print(f"{len(loops)} loops drawn, {reported - began:.0f} s", file=sys.stderr)
    before, after = simulated(np.array(loops))
    ratio, limit, long_enough = np.array(about).T
    still = after <= np.array(loops)[:, -3]
    return {
        "ratio": ratio,
        "limit": limit,
        "still": still,
        "cycles": ~still & np.where(ratio <= 1.0, long_enough > 0, after > CYCLING * before),
        "slow": ~still & (ratio <= 1.0) & (long_enough == 0),
        "decays": after < before,
        "refused": np.array(refused),
    }


def simulated(loops: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Range of the force [N] in the last two windows of each loop."""
    answers, began = [], time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        binary = Path(folder) / "rest_loops"
        subprocess.run(["g++", "-std=c++20", "-O2", HERE / "rest_loops.cpp", "-o", binary], check=True)
        for part in np.array_split(loops, max(1, len(loops) // 2000)):
            done = subprocess.run([binary], input=part.tobytes(), capture_output=True, check=True)
            answers.append(np.frombuffer(done.stdout).reshape(-1, 3))
            print(f"{sum(map(len, answers))} loops simulated, {time.monotonic() - began:.0f} s", file=sys.stderr)
    before, after, _ = np.concatenate(answers).T
    return before, after


def rows(found: dict[str, np.ndarray]) -> list[tuple[str, str, str, bool | None]]:
    """Quantity, measured, limit and whether it is met."""
    ratio, limit, cycles, slow = (found[name] for name in ("ratio", "limit", "cycles", "slow"))
    proved, beyond = ratio <= 1.0, ratio > limit
    still, between = ~proved & ~cycles, ~proved & ~beyond
    gaps = np.percentile(limit, [50, 99, 100])
    earliest = ratio[cycles].min() if cycles.any() else np.nan
    decaying = bool(found["decays"][slow].all())
    return [
        ("random loops; devices refused", f"{len(ratio)}; {int(found['refused'])}", "", None),
        ("proved to rest", f"{proved.sum()}", "", None),
        ("  of these, cycling", f"{(proved & cycles).sum()}", "0", not (proved & cycles).any()),
        ("  of these, decaying too slowly to be followed", f"{slow.sum()}", "", None),
        ("  and these decay", "all" if decaying else "not all in the last window", "", None),
        ("not proved: cycling", f"{(~proved & cycles).sum()}", "", None),
        ("not proved, no cycle from this state", f"{still.sum()} ({100 * still.mean():.2f} %)", "", None),
        ("  of these beyond the linear limit", f"{(still & beyond).sum()}", "", None),
        ("between proof and linear limit: undecided", f"{between.sum()} ({100 * between.mean():.3f} %)", "", None),
        ("smallest cycling stiffness / proved", f"{earliest:.4f}", ">= 1", bool(earliest >= 1.0)),
        ("linear limit / proved: median, 99 %, largest", ", ".join(f"{gap:.4f}" for gap in gaps), "", None),
    ]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("loops", type=int, nargs="?", default=100_000)
    table = Table("quantity", "measured", "limit", "", title="rest of random loops", title_justify="left")
    for what, measured, bar, met in rows(measure(parser.parse_args().loops)):
        table.add_row(what, measured, bar, "" if met is None else "met" if met else "NOT MET")
    Console(width=110).print(table)
