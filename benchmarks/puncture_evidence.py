# SPDX-License-Identifier: Apache-2.0
"""False alarms and power of the detection of punctures, and its time.

    python benchmarks/puncture_evidence.py [--full]

Simulated recordings by closed formulas (tests/segmentation/strokes_by_formula.py). False alarms: recordings without a
puncture, with six kinds of noise, and the share in which a fall is called a puncture, with its 95 % bound. Power: the
share of drops that is found, over the drop in standard errors of the samples in 0.1 mm on either side of it, and in
millinewtons on a steep loading curve: there a drop must also exceed the growth of the force over the shortest window.
"""

import argparse
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np
from scipy.stats import beta

import needleforce as nf

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "segmentation"))
from strokes_by_formula import KINDS, rupture, without_puncture

NEAR = 0.1e-3  # [m] travel on either side of a drop
DROPS = (3.0, 5.0, 7.0, 10.0, 15.0, 30.0)  # in standard errors of the difference of the means over that travel
NOISES = (0.5e-3, 5e-3)  # [N]
RATES = (100.0, 1000.0)  # [Hz]
STEEP_DROPS = (2e-3, 5e-3, 10e-3, 15e-3, 20e-3, 30e-3, 40e-3)  # [N]
STEEP_PEAK, SPEED = 0.35, 3e-3  # [N] at 4 mm: 0.175 N/mm before the drop; [m/s]
FLAT_PEAK = 10.0  # in standard deviations of the noise


def false_alarms(count: int) -> str:
    """A table of the share of recordings with a false puncture, or a false outlier, by kind of noise."""
    total, alarms, spiked = Counter(), Counter(), Counter()
    for seed in range(count):
        kind, run = without_puncture(seed)
        events = nf.segment(run)
        for name in (kind, "all"):
            total[name] += 1
            alarms[name] += bool(events.punctures)
            spiked[name] += bool(len(events.outliers))
    lines = ["| noise | recordings | false puncture | at most (95 %) | false outlier |", "|---|---:|---:|---:|---:|"]
    for name in (*KINDS, "all"):
        bound = beta.ppf(0.95, alarms[name] + 1, total[name] - alarms[name])
        lines.append(f"| {name} | {total[name]} | {alarms[name]} | {100 * bound:.2f} % | {spiked[name]} |")
    return "\n".join(lines)


def power(count: int) -> str:
    """A table of the share of drops that is found, over their size in standard errors."""
    rows = []
    for rate in RATES:
        error = (2.0 * SPEED / (NEAR * rate)) ** 0.5
        rows.append(
            (f"{rate:g}", [found_share(count, rate, 1e-3, drop * error * 1e-3, FLAT_PEAK * 1e-3) for drop in DROPS])
        )
    return table("rate Hz", [f"{drop:g}" for drop in DROPS], rows)


def steep_power(count: int) -> str:
    """The same for drops [mN] on a steep loading curve."""
    rows = [
        (
            f"{rate:g} Hz, {1e3 * noise:g} mN",
            [found_share(count, rate, noise, drop, STEEP_PEAK) for drop in STEEP_DROPS],
        )
        for rate in RATES
        for noise in NOISES
    ]
    return table("rate, noise", [f"{1e3 * drop:g} mN" for drop in STEEP_DROPS], rows)


def table(first: str, head: list[str], rows: list[tuple[str, list[float]]]) -> str:
    """Shares as a table in per cent."""
    lines = [f"| {first} | " + " | ".join(head) + " |", "|---|" + "---:|" * len(head)]
    return "\n".join(
        lines + [f"| {name} |" + "".join(f" {100 * each:.0f} % |" for each in found) for name, found in rows]
    )


def found_share(count: int, rate: float, noise: float, drop: float, peak: float) -> float:
    """The share of recordings in which a drop [N] is found within 0.3 mm."""
    runs = (rupture(seed, rate=rate, noise=noise, drop=drop, peak=peak, speed=SPEED, rise=0.0) for seed in range(count))
    return float(np.mean([any(abs(each.depth - 4e-3) < 0.3e-3 for each in nf.segment(run).punctures) for run in runs]))


def processor_time() -> float:
    """Smallest processor time [s] of a segmentation of 30 000 samples."""
    run = nf.simulate(nf.preset("paper"), nf.Motion.insert(-4e-3, 1e-3, 10e-3, hold=2.0), 1000.0)
    arrays = run.time, run.depth, run.force + np.random.default_rng(1).normal(0.0, 3e-3, len(run))
    took = []
    for _ in range(20):
        start = time.process_time()
        nf.segment(arrays)
        took.append(time.process_time() - start)
    return min(took)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--full", action="store_true", help="2000 recordings instead of 300, 100 drops instead of 20")
    full = options.parse_args().full
    print("\nfalse alarms, recordings without a puncture\n\n" + false_alarms(2000 if full else 300), flush=True)
    print("\nshare of drops found, by their size in standard errors\n\n" + power(100 if full else 20), flush=True)
    print("\nshare of drops found on a steep loading curve\n\n" + steep_power(100 if full else 20), flush=True)
    print(f"\nsegmentation of 30 000 samples: {1e3 * processor_time():.1f} ms of processor time", flush=True)


if __name__ == "__main__":
    main()
