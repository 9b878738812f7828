# SPDX-License-Identifier: Apache-2.0
"""A campaign of many files by one core, by two and by a Dask cluster of two; cost of a task; a model of more workers.

``python benchmarks/campaign_scale.py [FILES] [--write docs/evidence/scale.md]``: real recordings
(``NEEDLEFORCE_RECORDINGS``), each with noise of its own, and simulated ones, 5 % damaged; 2000 files unless a number is
given. Times are those of a clock: leave the computer idle.
"""

import argparse
import contextlib
import hashlib
import heapq
import json
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
REAL = 21  # one file in so many is of the rig, each once in 2000: it takes a hundred times as long as a simulated one
REPEATS = 5  # files of a simulated condition
NOISE_N = 1e-3
STOPPED = 0.4  # share of the conditions after which the campaign is killed


def recordings() -> list[Path]:
    """Those of the rig in which the needle moves."""
    found = []
    for path in sorted(RECORDINGS.glob("*.csv")):
        with contextlib.suppress(nf.InputError):
            nf.read(path)
            found.append(path)
    return found


def make(folder: Path, count: int) -> None:
    """The files, of which every 20th is cut off, empty, or made of bytes."""
    rng, real = np.random.default_rng(1), recordings()
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


def run(folder: Path, table: Path, *options: object, cores: int = 2) -> tuple[float, str]:
    """Seconds by the clock, and the largest memory [MB] of the program and of one of its workers."""
    began = time.perf_counter()
    command = [sys.executable, "-c", MEASURED, "campaign", folder, "--pattern", REAL_NAME, "--table", table, *options]
    environment = os.environ | {"CORES": str(cores)}
    done = subprocess.run([*map(str, command)], capture_output=True, text=True, env=environment)
    if done.returncode:
        raise SystemExit(done.stderr[-2000:])
    return time.perf_counter() - began, done.stderr.rpartition("memory ")[2].strip()


MEASURED = """
import os, resource, sys
os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:int(os.environ["CORES"])])
from needleforce.cli import main
try:
    main()
except SystemExit as left:
    if left.code:
        raise
finally:
    used = [resource.getrusage(of).ru_maxrss for of in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    print("memory", " and ".join(f"{each / 1024:.0f}" for each in used), file=sys.stderr)
"""


def killed(folder: Path, state: Path, *options: object, worker: bool = False) -> str:
    """Start a campaign that keeps its results, and kill it after a share of its conditions; or one of its workers, and
    wait for the end. What was killed."""
    command = [str(Path(sys.executable).with_name("needleforce")), "campaign", str(folder), "--pattern", REAL_NAME]
    tasks = state / "tasks.jsonl"
    with subprocess.Popen(
        [*command, "--state", str(state), *map(str, options)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    ) as on:
        line = next(line for line in on.stderr if "are identified" in line)
        wanted = STOPPED * int(line.split()[2])
        while on.poll() is None and done_of(tasks) < wanted:
            time.sleep(0.05)
        for target in workers_of(on.pid)[:1] if worker else [on.pid]:
            os.kill(target, signal.SIGKILL)
        on.communicate()
    return f"{'a worker' if worker else 'all'} killed at {wanted:.0f} conditions"


def workers_of(parent: int) -> list[int]:
    """The processes that a program started to do work."""
    found = []
    for place in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            is_child = int((place / "stat").read_text().rpartition(")")[2].split()[1]) == parent
            found += [int(place.name)] if is_child and "spawn_main" in (place / "cmdline").read_text() else []
    return found


def done_of(tasks: Path) -> int:
    """The number of conditions that are kept."""
    return tasks.read_text().count('"task": "condition"') if tasks.is_file() else 0


def cost_of_a_task() -> dict[str, float]:
    """Milliseconds of a task that does nothing, by each of the workers."""
    from needleforce.running import outcomes, started

    found = {}
    for name, where in {"processes": {"jobs": 2}, "Dask": {"jobs": 2, "scheduler": "local"}}.items():
        with started(**where) as workers:
            list(outcomes(workers, abs, range(100)))
            began = time.perf_counter()
            list(outcomes(workers, abs, range(1000)))
            found[name] = time.perf_counter() - began
    return found


def study_rates() -> list[str]:
    """Insertions a second of a study by several numbers of local processes and Dask workers."""
    cutting = {"name": "cutting.force_N", "low": 0.05, "high": 0.1}
    rows = []
    for count in (1, 2, 3, 4):
        cells = []
        for scheduler in (None, "local"):
            began = time.perf_counter()
            nf.study({"study": {"samples": 16384}, "factor": [cutting]}, jobs=count, scheduler=scheduler)
            cells.append(f"{16384 / (time.perf_counter() - began):.0f}")
        rows.append(f"| {count} | {' | '.join(cells)} |")
    return ["| workers | insertions/s by processes | by Dask |", "|---|---|---|", *rows]


def makespan(tasks: list[float], workers: int, cost: float, start: float) -> float:
    """Seconds of a discrete simulation: one scheduler sends the next task to the worker that is free first, and needs
    ``cost`` for each task; workers begin after ``start``."""
    free, sender = [start] * workers, start
    heapq.heapify(free)
    for seconds in tasks:
        sender = max(sender, heapq.heappop(free)) + cost
        heapq.heappush(free, sender + seconds)
    return max(free)


def modelled(lines: list[dict], cost: float, start: float) -> list[str]:
    """Time and efficiency of a campaign of 50 000 such files by many workers, from its measured tasks."""
    files = sum(len(each["files"]) for each in lines if each["task"] == "condition")
    conditions = sorted((each["seconds"] for each in lines if each["task"] == "condition"), reverse=True)
    reading = [each["seconds"] for each in lines if each["task"] == "file"]
    times = max(50_000 // files, 1)
    blocks = [sum(reading[k : k + 8]) for k in range(0, len(reading), 8)] * times
    work, rows = times * (sum(reading) + sum(conditions)), []
    for workers in (1, 2, 10, 100, 1000):
        took = makespan(blocks, workers, cost, start)
        took += makespan(sorted(conditions * times, reverse=True), workers, cost, 0.0)
        rows.append(f"| {workers} | {took:.0f} s | {100 * work / workers / took:.0f} % |")
    return [f"{times * files} files, {work / 3600:.1f} h of work, the longest task {conditions[0]:.1f} s.", "",
            "| workers | time | efficiency |", "|---|---|---|", *rows]  # fmt: skip


def campaigns(folder: Path, place: Path, count: int) -> tuple[list[str], list[dict]]:
    """A row of the page for each way, and the tasks that a state folder lists."""
    dask, table, state = ("--jobs", 2, "--scheduler", "local"), place / "table.csv", place / "state"
    digests, seconds = set(), {}
    rows = ["| campaign | time | files/s | MB of the program and of a worker |", "|---|---|---|---|"]

    def measured(name: str, *options: object, cores: int = 2) -> None:
        seconds[name], memory = run(folder, table, *options, cores=cores)
        digests.add(hashlib.sha256(table.read_bytes()).hexdigest())
        rows.append(f"| {name} | {seconds[name]:.1f} s | {count / seconds[name]:.1f} | {memory} |")
        print(rows[-1], flush=True)

    measured("one process, one core", "--jobs", 1, cores=1)
    measured("two processes, two cores", "--jobs", 2)
    measured("Dask, two workers", *dask)
    measured(f"{killed(folder, state)}, then continued", "--state", state)
    lines = [json.loads(line) for line in (state / "tasks.jsonl").read_text().splitlines()]
    measured("the same again, nothing changed", "--state", state)
    state = place / "state of Dask"
    measured(f"Dask, {killed(folder, state, *dask, worker=True)}, table of its results", "--state", state)
    gain = seconds["one process, one core"] / seconds["two processes, two cores"]
    sizes = {kind: [each["bytes"] for each in lines if each["task"] == kind] for kind in ("file", "condition")}
    wire = ", ".join(f"{np.mean(each):.0f} of a {kind}" for kind, each in sizes.items())
    rows += [
        "",
        f"Two processes over one: {gain:.2f}. Different tables: {len(digests) - 1}. Mean bytes that come back: {wire}.",
    ]
    return rows, lines


HEAD = """# Scale

Made by `python benchmarks/campaign_scale.py {count} --write docs/evidence/scale.md` on {cores} cores. Of the files one
in {real} is a recording of the rig, the others are simulated, 5 % of all are damaged.

"""


def main(count: int, write: Path | None) -> None:
    """Measures, prints, and writes the page."""
    place = Path(tempfile.mkdtemp())
    try:
        folder = place / "files"
        folder.mkdir()
        make(folder, count)
        rows, lines = campaigns(folder, place, count)
    finally:
        shutil.rmtree(place)
    costs = cost_of_a_task()
    began = time.perf_counter()
    subprocess.run([sys.executable, "-c", "import needleforce.campaign.campaign"], check=True)
    start = time.perf_counter() - began
    said = ", ".join(f"{value:.2f} ms by {name}" for name, value in costs.items())
    parts = {
        "A campaign": rows,
        "A study": study_rates(),
        "Cost": [f"A task that does nothing: {said}. A worker starts in {start:.1f} s."],
        "Modelled for more workers on Dask": modelled(lines, 1e-3 * costs["Dask"], start),
    }
    text = HEAD.format(count=count, cores=os.cpu_count(), real=REAL)
    text += "\n\n".join(f"## {title}\n\n" + "\n".join(each) for title, each in parts.items())
    print(text)
    if write is not None:
        write.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", type=int, nargs="?", default=2000, help="number of files")
    parser.add_argument("--write", type=Path, help="the page to write")
    given = parser.parse_args()
    main(given.files, given.write)
