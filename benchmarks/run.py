# SPDX-License-Identifier: Apache-2.0
"""Performance limits as ratios, each measured in one run on one machine: ``make bench``. Prints each measured value
with its limit."""

import argparse
import importlib.util
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

sys.path.insert(0, str(Path(__file__).parent))
from loop import bending, closed_paths, energy, guard_search, step, watching

import needleforce as nf
from needleforce.identification.models import COMPARED, OF_LAYERS

ROOT = Path(__file__).resolve().parents[1]
PAPER = nf.preset("paper")


def best(work, repeats: int = 7) -> float:
    """Shortest time of several runs [s], the least disturbed by other programs."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def paired(first, second, repeats: int = 15) -> float:
    """Ratio of the shortest times of two functions that are run in turn."""
    times = np.array([[best(first, 1), best(second, 1)] for _ in range(repeats)])
    return float(times[:, 0].min() / times[:, 1].min())


def mujoco():
    """A MuJoCo step without and with the needle's force, if MuJoCo is installed."""
    script = ROOT / "benchmarks" / "mujoco_step.py"
    if not importlib.util.find_spec("mujoco"):
        yield "MuJoCo step", "MuJoCo is not installed", "", None
        return
    found = json.loads(subprocess.run([sys.executable, script], capture_output=True, check=True).stdout)
    yield (
        "MuJoCo step without, with the needle's force (us)",
        "{bare_us:.2f}, {plugin_us:.2f}".format(**found),
        "",
        True,
    )
    yield "with / without", f"{found['ratio']:.2f}", "", True


def evaluation(n: int = 10**7):
    """The model over an array, compared with NumPy and Numba."""
    depth = np.linspace(0.0, 12e-3, n)
    velocity = np.where(np.arange(n) < n // 2, 3e-3, -3e-3)
    out = np.empty(n)
    c, p, f, k = PAPER.stiffness.force(1.0), PAPER.puncture_depth, PAPER.friction.per_length, PAPER.cutting.force

    def select():
        cases = [depth <= 0, velocity < 0, depth <= p]
        return np.select(cases, [0.0, -f * depth, c * depth * depth], f * depth + k)

    ours = best(lambda: PAPER.force(depth, velocity, out))
    yield "10^7 samples (ns per sample)", f"{1e9 * ours / n:.2f}", "", True
    ratio = best(select, 3) / ours
    yield "NumPy select / needleforce", f"{ratio:.0f}", ">= 10", ratio >= 10
    try:
        import numba
    except ImportError:
        yield "needleforce / Numba", "Numba is not installed", "<= 1.2", None
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
        yield f"needleforce / Numba, {what}", f"{ratio:.2f}", "<= 1", ratio <= 1.0


def tips(n: int = 100_000):
    """Tip profiles by quadrature, compared with SciPy's with the same substitution."""
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
        expected = np.array([theirs(tip, a, at) for a in few])
        error = np.abs(np.column_stack([found.depth, found.force]) / expected - 1).max()
        shown = f"{1e9 * ours:.0f} ns, SciPy {1e6 * slow:.0f} us, difference {error:.0e}"
        yield f"tip by radius, {what} (per point)", shown, "<= 300 ns, 1e-12", ours <= 300e-9 and error <= 1e-12
    depth = nf.contact(ogive, contact_radius=radius, reduced_modulus=1.0).depth
    ours = best(lambda: nf.contact(ogive, depth=depth, reduced_modulus=1.0), 3) / n
    yield "tip by depth, ogive (ns per point)", f"{1e9 * ours:.0f}", "", True
    law = nf.laws.TipContact(1e5, shank, ogive)
    model = PAPER.replace(stiffness=law, puncture=nf.laws.PunctureDepth(0.5))
    ours = best(lambda: model.force(depth)) / n
    yield "tip in the loop's table, ogive (ns per point)", f"{1e9 * ours:.1f}", "", True
    yield "its preparation, ogive (ms)", f"{1e3 * best(lambda: law.force(1e-3)):.2f}", "", True


def reading():
    """60 s at 1 kHz from CSV, compared with pandas on the same file."""
    import pandas as pd

    recording = nf.simulate(PAPER, nf.Motion.insert(start=-5e-3, speed=1e-3, depth=20e-3, hold=9.8))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.csv"
        nf.write(recording, path)
        ratio = paired(lambda: nf.read(path), lambda: pd.read_csv(path, comment="#"), 40)
        segmenting = paired(lambda: nf.segment(recording), lambda: nf.read(path))
    yield f"reading {len(recording)} rows / pandas", f"{ratio:.2f}", "<= 1", ratio <= 1.0
    yield "segmenting them / reading them", f"{segmenting:.2f}", "", True


def noisy_arrays(preset: str, rate: float, seed: int, **motion: float) -> tuple:
    """Time, depth and force of a simulated insertion with hold and withdrawal, with noise of 5 mN."""
    run = nf.simulate(nf.preset(preset), nf.Motion.insert(start=-5e-3, hold=1.0, withdraw=True, **motion), rate=rate)
    return run.time, run.depth, run.force + np.random.default_rng(seed).normal(0.0, 5e-3, len(run))


def processor_time(work) -> float:
    """Processor time of a function [s]."""
    start = time.process_time()
    work()
    return time.process_time() - start


def identifying():
    """The complete public call, of arrays the least of 30 runs, and of four repeats with layers, with every model and
    by default. Absolute limits, and the ratio to segmenting the 30 000 samples in the same run."""
    clean, coarse = (noisy_arrays("paper", rate, 0, speed=1e-3, depth=9.5e-3) for rate in (1000.0, 2_000 / 30.0))
    time_s, depth, force = noisy_arrays("paper", 2000.0, 0, speed=1e-3, depth=9.5e-3)
    filtered = time_s, depth, np.convolve(force, np.full(40, 1.0 / 40.0), "same")
    least = lambda work, count: min(processor_time(work) for _ in range(count))  # noqa: E731
    unit = least(lambda: nf.segment(clean), 30)
    for arrays, what, model, bar in (
        (clean, "default model", None, 5.0),
        (clean, "model paper", "paper", 5.0),
        (coarse, "default model", None, None),
        (filtered, "filtered, default model", None, 20.0),
    ):
        took = least(lambda arrays=arrays, model=model: nf.identify(arrays, model=model), 30)
        limit, met = ("", True) if bar is None else (f"<= {bar:g}", 1e3 * took <= bar)
        name = f"identify, {len(arrays[0])} samples as arrays, {what} (ms of processor time)"
        yield name, f"{1e3 * took:.1f}, {took / unit:.1f} x segmenting", limit, met
    repeats = [noisy_arrays("layered", 200.0, seed, speed=2e-3, depth=15e-3) for seed in range(4)]
    every = (*COMPARED, *OF_LAYERS)
    works = [
        ("identify, four layered repeats", 1.0, lambda: nf.identify(repeats, model="layered")),
        ("compare all models on four repeats", 10.0, lambda: nf.compare(repeats, models=every)),
    ]
    files = sorted((recordings_folder() / "needle-insertion-rig").glob("dev__control-needle__3mm-artery_2_0_2_*.csv"))
    if files:
        read = [nf.read(path) for path in files[:4]]
        works.append(("identify by default, four real repeats", 2.0, lambda: nf.identify(read)))
    for what, bar, work in works:
        took = processor_time(work)
        shown = f"{took:.2f}, {took / unit:.0f} x segmenting"
        yield f"{what} (s of processor time)", shown, f"<= {bar:g}", took <= bar


def recordings_folder() -> Path:
    """The recordings made by others."""
    sys.path.insert(0, str(ROOT / "tests"))
    from recorded_data import RECORDINGS

    return RECORDINGS


def starting():
    """Time of import and help. An absolute limit: printed and not asserted anywhere."""
    bare = best(lambda: subprocess.run([sys.executable, "-c", "pass"], check=True), 5)
    for what, code, bar in (
        ("import needleforce", "import needleforce as nf; nf.preset, nf.Insertion", 0.3),
        ("--help", "import sys; sys.argv = ['needleforce', '--help']; from needleforce.cli import main; main()", 0.5),
    ):
        took = best(lambda code=code: subprocess.run([sys.executable, "-c", code], check=True, capture_output=True), 5)
        yield f"{what} (s)", f"{took:.2f} (only Python {bare:.2f})", f"<= {bar}", took <= bar


def real():
    """The one-layer model on real recordings made by others, each fitted by itself."""
    folder = recordings_folder() / "needle-insertion-rig"
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
        yield "real recordings", "not found", "", None
        return
    shown = ", ".join(f"{100 * np.percentile(errors, p):.0f} %" for p in (10, 50, 90))
    yield "real: residual / peak, percentiles 10, 50, 90", shown, "", True
    yield "real: outcomes", ", ".join(f"{count} {status}" for status, count in outcomes.items()), "", True
    yield "real: identify, median (ms)", f"{1e3 * np.median(times):.0f}", "", True


def many_samples(n: int = 10_000_000):
    """Ten million samples through the complete identification, in a separate process."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "long.csv"
        motion = nf.Motion.insert(start=-5e-3, speed=3e-3, depth=15e-3, hold=n / 1e5 - 13.9)
        nf.write(nf.simulate(PAPER, motion, rate=1e5), path)
        code = "import sys; from needleforce.cli import main; main()"
        command = ["/usr/bin/env", sys.executable, "-c", code, "identify", path, "--json", Path(folder) / "o.json"]
        took = best(lambda: subprocess.run(command, check=True, capture_output=True), 1)
        peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    yield "10^7 samples, identify (s)", f"{took:.0f}", "", True
    yield "10^7 samples, peak memory (MB)", f"{peak:.0f}", "", True


def demo():
    """Time of the demo after set-up."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-c", "from needleforce.cli import main; main()", "demo", "--out", folder]
        took = best(lambda: subprocess.run(command, check=True, capture_output=True), 1)
    yield "make demo after set-up (s)", f"{took:.1f}", "<= 30", took <= 30


PARTS = (
    step,
    bending,
    watching,
    mujoco,
    energy,
    closed_paths,
    guard_search,
    evaluation,
    tips,
    reading,
    identifying,
    starting,
    demo,
    real,
)
SCRIPTS = (
    "fit",
    "fit_peers",
    "fit_length",
    "uncertainty",
    "cross_validation",
    "replay",
    "events_by_eye",
    "online_events",
    "online_identification",
    "puncture_evidence",
    "loading_curves",
    "rest_loops",
    "rest",
)
"""Benchmarks in separate files, each with its own table."""


def extra(name: str, full: bool) -> list[str]:
    """Command-line arguments of a script."""
    if name == "loading_curves":
        return ["--figure", str(ROOT / "build" / "loading_curves.svg")]
    return ["--full"] if full and name not in ("events_by_eye", "online_identification", "rest_loops", "rest") else []


def main(full: bool, only: list[str]) -> None:
    """Runs every part, or only the named ones, and prints one table; the tables of the scripts follow."""
    console = Console(width=110)
    table = Table("quantity", "measured", "limit", "", title="needleforce, benchmarks", title_justify="left")
    for part in (*PARTS, *((many_samples,) if full or "many_samples" in only else ())):
        if only and part.__name__ not in only:
            continue
        with console.status(part.__doc__.splitlines()[0]):
            for what, measured, limit, met in part():
                table.add_row(what, measured, limit, "" if not limit or met is None else "met" if met else "NOT MET")
    if table.row_count:
        console.print(table)
    for name in SCRIPTS:
        if not only or name in only:
            subprocess.run([sys.executable, ROOT / "benchmarks" / f"{name}.py", *extra(name, full)], check=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true", help="all recordings; takes much longer")
    names = [part.__name__ for part in (*PARTS, many_samples)] + list(SCRIPTS)
    parser.add_argument("--only", nargs="+", choices=names, default=[], metavar="PART", help=", ".join(names))
    options = parser.parse_args()
    main(options.full, options.only)
