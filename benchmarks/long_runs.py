# SPDX-License-Identifier: Apache-2.0
"""A recording of hours at 7 kHz in compressed time: written in parts, read by part, reduced, and identified.

The rig does not wait: every reading of its clock is written at once. Each step is a process of its own, of which the
processor time and the largest memory are printed, with the bytes on the disk. ``--hours 10`` takes an hour and 12 GB.
"""

import argparse
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import needleforce as nf
from needleforce.recording.log import LogWriter

RATE, STATES, FLUSH = 7000, 7, 1750  # Hz; readings for each state of the axis, and for each flush of the recorder
NOISE_N, COUNT_N, DRIFT, DELAY_NS, JITTER_NS = 0.01, 1e-6, 20e-6, 200_000, 50_000.0
CYCLE = nf.Motion.insert(-5e-3, 3e-3, 20e-3, 2.0, True)
TRUTH, REDUCED_HZ = "paper", 100.0


def write(path: Path, hours: float) -> int:
    """Write so many hours of cycles; the number of readings."""
    cycle = nf.simulate(nf.preset(TRUTH), CYCLE, RATE)
    card, parts = {"axial": "fz", "needle": "simulated"}, {"part_time": min(600.0, 1200.0 * hours)}
    chance, log, number = np.random.default_rng(1), LogWriter(path, card, **parts), 0
    depth, velocity = cycle.depth.tolist(), cycle.velocity.tolist()
    log.mark(0, "bias", wrench=[0.0] * 6, noise=[NOISE_N] * 6, samples=3500)
    while number < hours * 3600 * RATE:
        noise = chance.normal(0.0, NOISE_N, (len(cycle), 3))
        wrenches = np.round((noise + cycle.force[:, None] * (0, 0, 1)) / COUNT_N) * COUNT_N
        delays = (DELAY_NS + chance.exponential(JITTER_NS, len(cycle))).astype(int).tolist()
        for force, delay, here, speed in zip(wrenches.tolist(), delays, depth, velocity):
            host = number * 1_000_000_000 // RATE
            device = round(host * (1.0 + DRIFT))
            log.wrench(number, host + delay, device, host, (*force, 0.0, 0.0, 0.0))
            if not number % STATES:
                log.state(number // STATES, host + delay, host, host, here, speed)
            number += 1
            if not number % FLUSH:
                log.flush()
    log.close({"ended": "done"})
    return number


def read_part(path: Path) -> int:
    """Read one part of the recording; the number of samples."""
    return len(nf.read(path, part="part0001"))


def reduce(path: Path) -> int:
    """Reduce the whole recording, as ``convert`` does; the number of samples."""
    recording = nf.read(path, decimate_to=REDUCED_HZ)
    nf.write(recording, path.with_suffix(".parquet"))
    return len(recording)


def identify(path: Path) -> str:
    """Identify the last cycle of the reduced recording, next to the same from undisturbed samples."""
    long = path.with_suffix(".parquet")
    spans = nf.read(long, dry_run=True).cycles
    whole = nf.simulate(nf.preset(TRUTH), CYCLE, RATE)
    found = nf.identify([nf.read(long, part=spans[-1].name)]), nf.identify([whole])
    shown = [f"{fit.parameters[name]}" for name in ("puncture_force", "cutting_force") for fit in found]
    return f"{len(spans)} cycles; puncture and cutting force of the last, and at full rate: {', '.join(shown)}"


STEPS = {"read a part": read_part, "reduce": reduce, "identify": identify}


def step(name: str, path: Path, hours: float) -> None:
    """One step, with what it took."""
    done = write(path, hours) if name == "write" else STEPS[name](path)
    used = resource.getrusage(resource.RUSAGE_SELF)
    seconds, memory = used.ru_utime + used.ru_stime, used.ru_maxrss / 1024
    files = [each.stat().st_size for each in path.parent.glob("*.mcap")]
    print(f"{name}: {done}; {seconds:.0f} s of processor, {memory:.0f} MB at most; {len(files)} parts, "
          f"{sum(files) / 1e9:.3f} GB", flush=True)  # fmt: skip


def main() -> None:
    """Run the steps one after the other, each in a process of its own."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--hours", type=float, default=0.05)
    options.add_argument("--folder", type=Path)
    options.add_argument("--step", nargs=2)
    given = options.parse_args()
    if given.step:
        step(given.step[0], Path(given.step[1]), given.hours)
        return
    with tempfile.TemporaryDirectory(dir=given.folder) as folder:
        path = Path(folder) / "day.mcap"
        for name in ("write", *STEPS):
            command = [sys.executable, __file__, "--hours", str(given.hours), "--step", name, str(path)]
            subprocess.run(command, check=True)


if __name__ == "__main__":
    main()
