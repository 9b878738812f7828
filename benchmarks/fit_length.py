# SPDX-License-Identifier: Apache-2.0
"""The cost of the complete fit: time and peak memory by length, and recordings per second in a campaign.

    python benchmarks/fit_length.py [--full] [--write FILE]

Lengths from 1e3 to 1e6 samples of both strokes, with ``--full`` to 1e7. The slope of log cost over log length is 1
if cost is proportional to length. Memory is the growth of the peak memory during the fit, in a separate process that
has already read the samples.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from fit import progress, simulate

import needleforce as nf
from needleforce.identification.one_layer.cycle_fit import fit_cycle

NOISE = 5e-3
MEMORY = """
import re, sys
import numpy as np
from needleforce.identification.one_layer.cycle_fit import fit_cycle
fit_cycle(*np.load(sys.argv[1]))
arrays = np.load(sys.argv[2])
# not ru_maxrss, which a process inherits from its parent
peak = lambda: int(re.search(r"VmHWM:\\s+(\\d+) kB", open("/proc/self/status").read())[1])
before = peak()
fit_cycle(*arrays)
print(peak() - before)
"""


def seconds_of(arrays, repeats: int) -> float:
    """Shortest time of a fit [s], the least disturbed by other programs."""
    taken = []
    for _ in range(repeats):
        began = time.perf_counter()
        fit_cycle(*arrays)
        taken.append(time.perf_counter() - began)
    return min(taken)


def memory_of(arrays, small, folder: Path) -> float:
    """Growth of the process's peak memory [bytes] during the fit, without the libraries' memory of a first fit."""
    paths = folder / "small.npy", folder / "arrays.npy"
    for path, each in zip(paths, (small, arrays)):
        np.save(path, np.array(each))
    done = subprocess.run([sys.executable, "-c", MEMORY, *paths], check=True, capture_output=True, text=True)
    return 1024.0 * float(done.stdout)


def lengths(full: bool) -> list[tuple[int, float, float]]:
    """Samples, seconds and bytes of each length."""
    counts, found = [10**k for k in range(3, 8 if full else 7)], []
    small, _ = simulate(0, NOISE, samples=500)
    with tempfile.TemporaryDirectory() as folder:
        for k, count in enumerate(counts):
            arrays, _ = simulate(1, NOISE, samples=count // 2)
            repeats = int(np.clip(3e6 / count, 9, 300))
            found.append((count, seconds_of(arrays, repeats), memory_of(arrays, small, Path(folder))))
            progress("length", k + 1, len(counts))
    return found


def slope(found: list[tuple], least: int) -> float:
    """Slope of log seconds over log samples, from ``least`` samples on."""
    samples, seconds = (np.log([row[k] for row in found if row[0] >= least]) for k in (0, 1))
    return float(np.polyfit(samples, seconds, 1)[0])


def campaign(count: int) -> tuple[float, float]:
    """Recordings per second: only the fit of 30 000 samples each, and ``identify`` of the same motion at 1 kHz."""
    arrays = [simulate(seed, NOISE)[0] for seed in range(count)]
    motion = nf.Motion.insert(start=-5e-3, speed=1e-3, depth=9.5e-3, hold=1.0)
    run = nf.simulate(nf.preset("paper"), motion)
    noise = np.random.default_rng(0).normal(0.0, NOISE, (count, len(run)))
    runs = [nf.Recording(run.time, run.depth, run.velocity, run.force + each) for each in noise]
    fits = count / sum(seconds_of(each, 1) for each in arrays)
    began = time.perf_counter()
    nf.identify(runs, model="paper")
    return fits, count / (time.perf_counter() - began)


def markdown(found: list[tuple]) -> str:
    lines = [
        "| samples | ms per fit | ns per sample | peak memory MB | bytes per sample |",
        "|---:|---:|---:|---:|---:|",
    ]
    for count, seconds, memory in found:
        parts = f"{1e3 * seconds:.3g}", f"{1e9 * seconds / count:.1f}", f"{memory / 1e6:.1f}", f"{memory / count:.0f}"
        lines.append(f"| {count} | " + " | ".join(parts) + " |")
    return "\n".join(lines)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--full", action="store_true", help="to 1e7 samples, and 300 recordings of a campaign")
    options.add_argument("--write", type=Path, help="a file for the table")
    arguments = options.parse_args()
    found = lengths(arguments.full)
    fits, complete = campaign(300 if arguments.full else 50)
    lines = [
        markdown(found),
        "",
        f"slope of log cost over log length: {slope(found, 0):.2f}, from 1e5 samples on: {slope(found, 100_000):.2f}  ",
        f"recordings per second, 30 000 samples each: {fits:.0f} by the fit only, with intervals; "
        f"{1e-3 * 30_000:.0f} s at 1 kHz through `identify`: {complete:.1f}",
    ]
    print("\n" + "\n".join(lines), flush=True)
    if arguments.write:
        arguments.write.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
