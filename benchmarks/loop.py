# SPDX-License-Identifier: Apache-2.0
"""The loop by programs in C++: the time of a step, and what no motion, tissue or clock may break; parts of run.py."""

import json
import subprocess
import tempfile
from pathlib import Path

from needleforce import core

ROOT = Path(__file__).resolve().parents[1]
GUARDED = ("bare", "classic", "guard")  # without a controller, with the classic energy controller, with Guard


def compiled(source: str, folder: str, *libraries: str) -> Path:
    """A benchmark in C++ as a program."""
    binary = Path(folder) / source
    path = ROOT / "benchmarks" / f"{source}.cpp"
    places = [f"-I{ROOT / place}" for place in ("include", "tests/cpp")]
    subprocess.run(["g++", "-std=c++20", "-O2", *places, str(path), *libraries, "-o", str(binary)], check=True)
    return binary


def printed(source: str, *arguments: int, libraries: tuple[str, ...] = ()) -> list | dict:
    """What a benchmark in C++ prints as JSON."""
    with tempfile.TemporaryDirectory() as folder:
        command = [compiled(source, folder, *libraries), *map(str, arguments)]
        return json.loads(subprocess.run(command, capture_output=True, check=True).stdout)


LABELS = {
    "step": "step, one layer",
    "bare": "bare closed form",
    "empty": "the empty loop, subtracted from all",
    "still": "additions as long as a step",
}


def shown(times: dict, keys=("p50", "p99", "p999", "max")) -> str:
    return ", ".join(f"{key} {times[key]:.{1 if times[key] < 1000 else 0}f}" for key in keys)


def step():
    """Work of a step compared with the bare closed form, each waiting for the result of the call before.

    The limit is on the work only: of every batch of 256 steps the shortest of 15 passes from the same state. Next
    to it are the times of all passes as measured by the clock, also for a chain of additions as long as a step: the
    tail that both have comes from the machine.
    """
    runs = [printed("step") for _ in range(2)]
    sizes = {name: runs[0].pop(name) for name in ("object_bytes", "memory_bytes")}
    rows = {name: min((run[name] for run in runs), key=lambda row: row["alone"]["p999"]) for name in runs[0]}
    alone = {name: row["alone"] for name, row in rows.items()}
    one, bare, four = (alone[name]["p999"] for name in ("step", "bare", "4 layers"))
    yield "step, one layer: work only (ns)", shown(alone["step"]), "p99.9 <= 50", one <= 50
    for name in ("bare", "empty"):
        yield f"{LABELS[name]}: work only (ns)", shown(alone[name]), "", True
    yield "step / bare closed form, p99.9 of the work", f"{one / bare:.1f}", "<= 10", one <= 10 * bare
    for name in ("step", "bare", "still", "4 layers"):
        yield f"{LABELS.get(name, name)}: all passes (ns)", shown(rows[name]["seen"]), "", True
    for name, times in alone.items():
        if name not in LABELS:
            bar = ("p99.9 <= 250", four <= 250) if name == "4 layers" else ("", True)
            yield f"{name}: work only (ns)", shown(times), *bar
    history = [alone[f"4 layers after 10^{power} steps"]["p50"] for power in (3, 7)]
    yield "after 10^7 steps / after 10^3, p50", f"{history[1] / history[0]:.2f}", "", True
    yield "8 layers / 1 layer, p50", f"{alone['8 layers']['p50'] / alone['1 layer']['p50']:.1f}", "", True
    yield (
        "size of an insertion, of its saved memory (bytes)",
        "{object_bytes}, {memory_bytes}".format(**sizes),
        "",
        True,
    )


def bending():
    """A step of a needle that bends, 40 elements, under the paper's axial force."""
    rows = printed("bending")
    for name, times in rows.items():
        linear = name.removesuffix(", coupled") in ("planar 80 mm", "space 80 mm")
        bar = (2.0 if name.startswith("planar") else 4.0) if linear else None if "80 mm" not in name else 10.0
        limit = f"{bar:.0f} µs" if bar else ""
        yield f"needle that bends, {name}", f"{times['median_us']:.2f} µs", limit, bar and times["median_us"] <= bar
    for each in ("planar", "space"):
        ratio = rows[f"{each} 80 mm, coupled"]["median_us"] / rows[f"{each} 80 mm"]["median_us"]
        yield f"coupled over not coupled, {each}", f"{ratio:.2f}", "", True
    flat = rows["planar 160 mm"]["median_us"] / rows["planar 40 mm"]["median_us"]
    yield "the same, 160 mm deep over 40 mm", f"{flat:.2f}", "1.1", flat <= 1.1


def watching():
    """A reading watched for events at 1 kHz: noisy insertions with a rupture, a hold and a withdrawal each."""
    times = printed("events")
    yield "EventDetector.step: work only (ns)", shown(times), "p99.9 <= 200", times["p999"] <= 200


def energy(steps: int = 100_000):
    """Energy that a random user gets out of tissues at 1 kHz with delay: bare, with the classic controller, guarded."""
    trials = printed("energy", steps)
    reserve = 1e3 * core.GuardSettings().initial_reserve
    for tissue in dict.fromkeys(trial["tissue"] for trial in trials):
        rows = [trial for trial in trials if trial["tissue"] == tissue]
        least = {who: min(row[who]["least_mJ"] for row in rows) for who in GUARDED if who in rows[0]}
        shown = ", ".join(f"{who} {value:.3g}" for who, value in least.items())
        kept = least["guard"] >= -reserve * (1 + 1e-9)
        yield f"least energy put in, {tissue} (mJ)", shown, f">= -{reserve:g}, the reserve", kept


def closed_paths(paths: int = 1_000_000):
    """Random models over the whole ranges of the tables on random closed paths: none returns energy."""
    for row in printed("closed_paths", paths, libraries=("-lgtest",)):
        text = f"{row['returned']} of {row['paths']}, least work / work turned over {row['least']:.2g}"
        yield f"closed paths that return energy, {row['law']}", text, "0", row["returned"] == 0


def guard_search(cycles: int = 300_000_000):
    """Search for clocks, measurements and motions that get more out of a guard than it promises."""
    for row in printed("guard_search", cycles):
        text = f"{row['broken']} sequences in {row['cycles']:.1e} cycles, worst {row['worst_mJ']:.2g} mJ"
        yield f"guard's promise broken, {row['kind']}", text, "0", row["broken"] == 0
