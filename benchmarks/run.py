# SPDX-License-Identifier: Apache-2.0
"""The bars as ratios, each measured in one run on one machine: ``make bench``. Prints what was measured beside the
bar."""

import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

import needleforce as nf

ROOT = Path(__file__).resolve().parents[1]
PAPER = nf.preset("paper")


def best(work, repeats: int = 7) -> float:
    """Shortest time of several runs [s]: what the machine can do when nothing else runs."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def paired(first, second, repeats: int = 15) -> float:
    """Ratio of the shortest times of two works that take turns."""
    times = np.array([[best(first, 1), best(second, 1)] for _ in range(repeats)])
    return float(times[:, 0].min() / times[:, 1].min())


def step():
    """Work of a step beside the bare closed form."""
    with tempfile.TemporaryDirectory() as folder:
        binary = Path(folder) / "step"
        compile_ = [
            "g++",
            "-std=c++20",
            "-O2",
            f"-I{ROOT / 'include'}",
            str(ROOT / "benchmarks" / "step.cpp"),
            "-o",
            str(binary),
        ]
        subprocess.run(compile_, check=True)
        runs = [json.loads(subprocess.run([binary], capture_output=True, check=True).stdout) for _ in range(9)]
    # the quietest run of each: what else the machine does at the time is in the tail of either
    work, bare = (min((run[body] for run in runs), key=lambda times: times["p999"]) for body in ("step", "bare"))
    shown = ", ".join(f"{key} {work[key]:.1f}" for key in ("p50", "p99", "p999", "max"))
    yield "step, one layer (ns a step)", shown, "p99.9 <= 50", work["p999"] <= 50
    yield (
        "step / bare closed form, p99.9",
        f"{work['p999'] / bare['p999']:.1f}",
        "<= 10",
        work["p999"] <= 10 * bare["p999"],
    )
    for name in (body for body in runs[0] if body not in ("bare", "step", "state_bytes")):
        times = min((run[name] for run in runs), key=lambda times: times["p999"])
        bounded = name.startswith("4 layers, bristles")
        shown = ", ".join(f"{key} {times[key]:.1f}" for key in ("p50", "p99", "p999"))
        bar = ("p99.9 <= 250", times["p999"] <= 250) if bounded else ("", True)
        yield f"step, {name} (ns)", shown, *bar
    yield "state of an insertion (bytes)", str(runs[0]["state_bytes"]), "", True


def evaluation(n: int = 10**7):
    """The model over an array, beside NumPy and Numba."""
    depth = np.linspace(0.0, 12e-3, n)
    velocity = np.where(np.arange(n) < n // 2, 3e-3, -3e-3)
    out = np.empty(n)
    c, p, f, k = PAPER.stiffness.force(1.0), PAPER.puncture_depth, PAPER.friction.per_length, PAPER.cutting.force

    def select():
        cases = [depth <= 0, velocity < 0, depth <= p]
        return np.select(cases, [0.0, -f * depth, c * depth * depth], f * depth + k)

    ours = best(lambda: PAPER.force(depth, velocity, out))
    yield "10^7 samples (ns a sample)", f"{1e9 * ours / n:.2f}", "", True
    ratio = best(select, 3) / ours
    yield "NumPy select / ours", f"{ratio:.0f}", ">= 10", ratio >= 10
    try:
        import numba
    except ImportError:
        yield "ours / Numba", "Numba is not installed", "<= 1.2", None
        return

    def loop(depth, velocity, out):
        for i in numba.prange(depth.size):
            z = depth[i]
            if z <= 0:
                out[i] = 0.0
            elif velocity[i] < 0:
                out[i] = -f * z
            elif z <= p:
                out[i] = c * z * z
            else:
                out[i] = f * z + k

    for what, parallel, part in (("both cores", True, slice(0, n)), ("one core, 10^6 samples", False, slice(0, 10**6))):
        theirs = numba.njit(parallel=parallel)(loop)
        arrays = depth[part], velocity[part], out[part]
        theirs(*arrays)
        ratio = paired(lambda arrays=arrays: PAPER.force(*arrays), lambda arrays=arrays, run=theirs: run(*arrays))
        yield f"ours / Numba, {what}", f"{ratio:.2f}", "<= 1.2", ratio <= 1.2


def tips(n: int = 100_000):
    """Tip profiles by quadrature, beside SciPy's with the same substitution."""
    from scipy.integrate import quad

    shank = 0.35e-3
    radius = np.linspace(1e-3, 0.9, n) * shank
    ogive = nf.tips.TangentOgive(shank, 1.3e-3)
    broken = nf.tips.Profile([0, 0.2 * shank, shank], [0, 0.2 * shank, 3 * shank])

    def theirs(tip, a, at):
        points = [np.arcsin(at / a)] if 0 < at < a else None
        options = {"points": points, "epsabs": 0, "epsrel": 1e-12}
        depth = quad(lambda t: a * tip.slope(a * np.sin(t)), 0, np.pi / 2, **options)[0]
        return depth, quad(lambda t: 2 * a**2 * np.sin(t) ** 2 * tip.slope(a * np.sin(t)), 0, np.pi / 2, **options)[0]

    for what, tip, at in (("ogive", ogive, 0.0), ("one slope break", broken, 0.2 * shank)):
        few = radius[:: n // 50]
        slow = best(lambda tip=tip, at=at, few=few: [theirs(tip, a, at) for a in few], 3) / len(few)
        ours = best(lambda tip=tip: nf.contact(tip, contact_radius=radius, reduced_modulus=1.0)) / n
        found = nf.contact(tip, contact_radius=few, reduced_modulus=1.0)
        wanted = np.array([theirs(tip, a, at) for a in few])
        error = np.abs(np.column_stack([found.depth, found.force]) / wanted - 1).max()
        shown = f"{1e9 * ours:.0f} ns, SciPy {1e6 * slow:.0f} us, apart {error:.0e}"
        yield f"tip by radius, {what} (a point)", shown, "<= 300 ns, 1e-12", ours <= 300e-9 and error <= 1e-12
    depth = nf.contact(ogive, contact_radius=radius, reduced_modulus=1.0).depth
    ours = best(lambda: nf.contact(ogive, depth=depth, reduced_modulus=1.0), 3) / n
    yield "tip by depth, ogive (ns a point)", f"{1e9 * ours:.0f}", "", True
    law = nf.laws.TipContact(1e5, shank, ogive)
    model = PAPER.replace(stiffness=law, puncture=nf.laws.PunctureDepth(0.5))
    ours = best(lambda: model.force(depth)) / n
    yield "tip in the loop's table, ogive (ns a point)", f"{1e9 * ours:.1f}", "", True
    yield "its preparation, ogive (ms)", f"{1e3 * best(lambda: law.force(1e-3)):.2f}", "", True


def reading():
    """60 s at 1 kHz from CSV, beside pandas on the same file."""
    import pandas as pd

    recording = nf.simulate(PAPER, nf.Motion.insert(start=-5e-3, speed=1e-3, depth=20e-3, hold=9.8))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.csv"
        nf.write(recording, path)
        ratio = paired(lambda: nf.read(path), lambda: pd.read_csv(path, comment="#"), 40)
        whole = paired(lambda: nf.segment(recording), lambda: nf.read(path))
    yield f"reading {len(recording)} rows / pandas", f"{ratio:.2f}", "<= 1.2", ratio <= 1.2
    yield "segmenting them / reading them", f"{whole:.2f}", "", True


def starting():
    """Import and help. Absolute, as the bar is: printed and not asserted anywhere."""
    bare = best(lambda: subprocess.run([sys.executable, "-c", "pass"], check=True), 5)
    for what, code, bar in (
        ("import needleforce", "import needleforce as nf; nf.preset, nf.Insertion", 0.3),
        ("--help", "import sys; sys.argv = ['needleforce', '--help']; from needleforce.cli import main; main()", 0.5),
    ):
        took = best(lambda code=code: subprocess.run([sys.executable, "-c", code], check=True, capture_output=True), 5)
        yield f"{what} (s)", f"{took:.2f} (Python alone {bare:.2f})", f"<= {bar}", took <= bar


def real():
    """The one-layer model on real recordings made by others, each fitted by itself."""
    sys.path.insert(0, str(ROOT / "tests"))
    from conftest import RECORDINGS  # the one place that says where they are

    folder = RECORDINGS / "needle-insertion-rig"
    errors, times, outcomes = [], [], {}
    for path in sorted(folder.glob("*.csv")):
        try:
            recording = nf.read(path)
        except nf.InputError:
            outcomes["unreadable"] = outcomes.get("unreadable", 0) + 1
            continue
        start = time.perf_counter()
        fit = nf.identify(recording)
        times.append(time.perf_counter() - start)
        status = str(fit.recordings[0].status)
        outcomes[status] = outcomes.get(status, 0) + 1
        errors += [fit.quality.nrmse] if fit.quality else []
    if not errors:
        yield "real recordings", "none at hand", "", None
        return
    shown = ", ".join(f"{100 * np.percentile(errors, p):.0f} %" for p in (10, 50, 90))
    yield "real: residual / peak, 10-50-90 %", shown, "", True
    yield "real: outcomes", ", ".join(f"{count} {status}" for status, count in outcomes.items()), "", True
    yield "real: identify, median (ms)", f"{1e3 * np.median(times):.0f}", "", True


def many_samples(n: int = 10_000_000):
    """Ten million samples through the whole identification, in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "long.csv"
        motion = nf.Motion.insert(start=-5e-3, speed=3e-3, depth=15e-3, hold=n / 1e5 - 13.9)
        nf.write(nf.simulate(PAPER, motion, rate=1e5), path)
        code = "import sys; from needleforce.cli import main; main()"
        command = [
            "/usr/bin/env",
            sys.executable,
            "-c",
            code,
            "identify",
            str(path),
            "--json",
            str(Path(folder) / "o.json"),
        ]
        took = best(lambda: subprocess.run(command, check=True, capture_output=True), 1)
        peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    yield "10^7 samples, identify (s)", f"{took:.0f}", "", True
    yield "10^7 samples, peak memory (MB)", f"{peak:.0f}", "", True


def demo():
    """The demo after set-up."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-c", "from needleforce.cli import main; main()", "demo", "--out", folder]
        took = best(lambda: subprocess.run(command, check=True, capture_output=True), 1)
    yield "make demo after set-up (s)", f"{took:.1f}", "<= 30", took <= 30


def main(full: bool) -> None:
    """Runs every part and prints one table; those of the fit, of real events and of the loading curves follow."""
    console = Console(width=110)
    table = Table("what", "measured", "bar", "", title="needleforce, bars", title_justify="left")
    for part in (step, evaluation, tips, reading, starting, demo, real, *((many_samples,) if full else ())):
        with console.status(part.__doc__.splitlines()[0]):
            for what, measured, bar, met in part():
                table.add_row(what, measured, bar, "" if not bar or met is None else "met" if met else "NOT MET")
    console.print(table)
    for name in ("fit.py", "fit_peers.py", "fit_length.py", "uncertainty.py", "unseen.py"):
        subprocess.run([sys.executable, ROOT / "benchmarks" / name, *(["--full"] if full else [])], check=True)
    subprocess.run([sys.executable, ROOT / "benchmarks" / "events_by_eye.py"], check=True)
    figure = ROOT / "build" / "loading_curves.svg"
    subprocess.run([sys.executable, ROOT / "benchmarks" / "loading_curves.py", "--figure", figure], check=True)


if __name__ == "__main__":
    main("--full" in sys.argv[1:])
