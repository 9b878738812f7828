# SPDX-License-Identifier: Apache-2.0
"""A campaign of many files by one process, by two and by a Dask cluster of two: the same table, how long, how large.

``python benchmarks/campaign_scale.py [FILES]``: real recordings (``NEEDLEFORCE_RECORDINGS``), each several times with
noise of its own, and simulated ones, 5 % damaged; 2000 files unless a number is given. Times are those of a clock:
leave the computer idle.
"""

import hashlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import needleforce as nf

RECORDINGS = Path(os.environ.get("NEEDLEFORCE_RECORDINGS", "shared/data")) / "needle-insertion-rig"
REAL_NAME = "{specimen}_{speed_mm_s}_{angle_deg}_{needle}_{repeat}_{date}"
DAMAGED = 20  # one file in so many
REAL = 10  # one file in so many is of the rig: they take a hundred times as long as simulated ones
REPEATS = 5  # files of a simulated condition
NOISE_N = 1e-3
STOPPED = 0.4  # share of the conditions after which the campaign is killed


def make(folder: Path, count: int) -> None:
    """The files, of which every 20th is cut off, empty, or made of bytes."""
    rng, real = np.random.default_rng(1), sorted(RECORDINGS.glob("*.csv")) if RECORDINGS.is_dir() else []
    for k in range(count):
        if real and k % REAL == 0:
            source = real[(k // REAL) % len(real)]
            head, _, tail = source.name.partition("_")
            path = folder / f"{head}-{k // REAL // len(real)}_{tail}"
            one = nf.read(source)
        else:
            group = k // REPEATS
            path = folder / f"gel{group}_{1 + group % 3}_0_1_{k % REPEATS}_2026-11-26.csv"
            motion = nf.Motion.insert(-4e-3, (1 + group % 3) * 1e-3, 12e-3, 1.0, True)
            one = nf.simulate(nf.preset("paper"), motion, 100.0)
        force = one.force * rng.normal(1.0, 0.02) + rng.normal(0.0, NOISE_N, len(one))
        nf.write(nf.Recording(one.time, one.depth, one.velocity, force), path)
        if k % DAMAGED == DAMAGED - 1:
            content = path.read_bytes()
            path.write_bytes((content[: len(content) // 3 * 2], b"", rng.bytes(5000))[k // DAMAGED % 3])


def run(folder: Path, table: Path, *options: object) -> tuple[float, float]:
    """Seconds by the clock, and the largest memory of a process of it [MB], also of its workers."""
    began = time.perf_counter()
    command = [sys.executable, "-c", MEASURED, "campaign", folder, "--pattern", REAL_NAME, "--table", table, *options]
    done = subprocess.run([*map(str, command)], capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(done.stderr[-2000:])
    return time.perf_counter() - began, float(done.stderr.rpartition("memory ")[2])


MEASURED = """
import resource, sys
from needleforce.cli import main
try:
    main()
except SystemExit as left:
    if left.code:
        raise
finally:
    used = [resource.getrusage(of).ru_maxrss for of in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    print("memory", max(used) / 1024, file=sys.stderr)
"""


def killed(folder: Path, state: Path) -> int:
    """Start a campaign, kill it after a share of its conditions, and return how many are kept."""
    command = [str(Path(sys.executable).with_name("needleforce")), "campaign", str(folder), "--pattern", REAL_NAME]
    tasks = state / "tasks.jsonl"
    with subprocess.Popen([*command, "--state", str(state)], stderr=subprocess.PIPE, text=True) as started:
        wanted = STOPPED * int(started.stderr.readline().split()[2])
        while started.poll() is None and done_of(tasks) < wanted:
            time.sleep(0.05)
        started.send_signal(signal.SIGKILL)
    return done_of(tasks)


def done_of(tasks: Path) -> int:
    """The number of conditions that are kept."""
    return tasks.read_text().count('"task": "condition"') if tasks.is_file() else 0


def cost_of_a_task() -> dict[str, float]:
    """Milliseconds of a task that does nothing, by each of the workers."""
    from needleforce.running import outcomes, started

    found = {}
    for name, where in {"two processes": {"jobs": 2}, "Dask": {"jobs": 2, "scheduler": "local"}}.items():
        with started(**where) as workers:
            list(outcomes(workers, abs, range(100)))
            began = time.perf_counter()
            list(outcomes(workers, abs, range(1000)))
            found[name] = time.perf_counter() - began
    return found


def main() -> None:
    """Prints a row for each way: seconds, files a second, largest memory, and the digest of the table."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 2000
    place = Path(tempfile.mkdtemp())
    try:
        folder, state = place / "files", place / "state"
        folder.mkdir()
        make(folder, count)
        ways = {
            "one process": ("--jobs", 1),
            "two processes": ("--jobs", 2),
            "Dask, two workers": ("--jobs", 2, "--scheduler", "local"),
        }
        seconds, digests = {}, set()
        for name, options in ways.items():
            seconds[name], memory = run(folder, place / "table.csv", *options)
            digests.add(hashlib.sha256((place / "table.csv").read_bytes()).hexdigest()[:16])
            print(
                f"{name:20s} {seconds[name]:8.1f} s {count / seconds[name]:8.2f} files/s {memory:6.0f} MB", flush=True
            )
        kept = killed(folder, state)
        for name in (f"killed at {kept}, continued", "again, nothing changed"):
            took, _ = run(folder, place / "table.csv", "--state", state)
            digests.add(hashlib.sha256((place / "table.csv").read_bytes()).hexdigest()[:16])
            print(f"{name:26s} {took:8.1f} s")
        print(f"throughput of two over one: {seconds['one process'] / seconds['two processes']:.2f}")
        print(f"different tables: {len(digests) - 1}")
        print("cost of a task:", ", ".join(f"{name} {value:.2f} ms" for name, value in cost_of_a_task().items()))
    finally:
        shutil.rmtree(place)


if __name__ == "__main__":
    main()
