# SPDX-License-Identifier: Apache-2.0
"""What the stiffness of dragged tissue is made of: depth, block, Poisson ratio and base by finite elements, next to the
values that the layered law finds in recordings of others.

    python benchmarks/shaft_stiffness.py [--figure docs/figures/shaft_stiffness.svg]
"""

import argparse
import os
import runpy
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

import needleforce as nf
from needleforce import fe

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from closed_forms import bonded_shaft_stiffness

RADIUS, YOUNG = 0.35e-3, 10e3
SHOWN = 15e-3  # embedded length in the lines of equal modulus [m]
LENGTHS = np.array([5e-3, 10e-3, 15e-3, 20e-3, 25e-3, 30e-3])
CASES = {
    "half-space, ν 0.49": {},
    "half-space, ν 0.3": {"ratio": 0.3},
    "radius 50 mm, 50 mm deep, on a base": {"block_radius": 50e-3, "block_depth": 50e-3},
    "radius 20 mm, 35 mm deep, on a base": {"block_radius": 20e-3, "block_depth": 35e-3},
    "the same in a cup": {"block_radius": 20e-3, "block_depth": 35e-3, "sides": "fixed"},
    "the same on a smooth base, in a cup": {
        "block_radius": 20e-3, "block_depth": 35e-3, "base": "sliding", "sides": "fixed",
    },
}  # fmt: skip


def computed():
    """Stiffness [N/m] by length for each case, at 10 kPa."""
    found = {}
    for name, options in CASES.items():
        geometry = {key: value for key, value in options.items() if key != "ratio"}
        material = fe.Elastic(YOUNG, options.get("ratio", 0.49))
        found[name] = fe.shaft_stiffness(LENGTHS, RADIUS, material, **geometry)
    return found


def identified(job):
    """Stiffness of each layer [N/m] that the layered law finds in one condition, and its range of depth [m]."""
    name, files = job
    recordings = [nf.read(path, columns={"force": "fz", "depth": "pz", "time": "time"},
                          units={"time": "us", "depth": "mm", "force": "N"}) for path in files]  # fmt: skip
    try:
        fit = nf.identify(recordings, model="layered_as_fitted")
    except nf.InputError as error:
        return name, [], 0.0, str(error)
    stiffness = [layer.friction.stiffness for layer in fit.model.layers if hasattr(layer.friction, "stiffness")]
    deepest = max(float(np.max(recording.depth) - np.min(recording.depth)) for recording in recordings)
    return name, stiffness, deepest, ""


def figure(found, measured, path):
    """Stiffness over embedded length by case, and what recordings give, with lines of equal modulus."""
    import matplotlib

    matplotlib.use("svg")
    import matplotlib.pyplot as plt

    drawing, (left, right) = plt.subplots(1, 2, figsize=(9.6, 4.2), width_ratios=(1.2, 1.0))
    for name, values in found.items():
        left.plot(1e3 * LENGTHS, values, marker="o", markersize=3, label=name)
    exact = bonded_shaft_stiffness(fe.Elastic(YOUNG, 0.49), RADIUS, LENGTHS)
    left.plot(1e3 * LENGTHS, exact, "k--", linewidth=1, label="Randolph and Wroth, half-space")
    left.set(xlabel="embedded length [mm]", ylabel="stiffness of a shaft that sticks [N/m]", ylim=(0.0, None))
    left.set_title(f"{2e3 * RADIUS:.1f} mm shaft, tissue of {YOUNG / 1e3:.0f} kPa", fontsize=10)
    left.legend(fontsize=7)
    for number, layers in enumerate(measured, 1):
        right.plot([number] * len(layers), layers, "o-", color="C0", linewidth=0.7, markersize=4)
        right.plot(number, layers[-1], "o", color="C3", markersize=4)
    at = found["half-space, ν 0.49"][LENGTHS == SHOWN][0] / YOUNG
    for modulus in (5e3, 10e3, 20e3, 50e3, 100e3):
        right.axhline(at * modulus, color="0.6", linewidth=0.7)
        right.text(len(measured) + 0.8, at * modulus, f"{modulus / 1e3:.0f} kPa", fontsize=7, va="center")
    right.set(yscale="log", xlabel="condition", ylabel="identified in a layer, the last in red [N/m]")
    right.set_title(f"Recordings of others; lines: modulus at {1e3 * SHOWN:.0f} mm", fontsize=10)
    drawing.tight_layout()
    drawing.savefig(path, metadata={"Date": None})


def main(path):
    console = Console(width=130)
    with console.status("finite elements"):
        found = computed()
    table = Table(
        "", *(f"{1e3 * length:.0f} mm" for length in LENGTHS), title="stiffness [N/m] at 10 kPa by embedded length"
    )
    for name, values in found.items():
        table.add_row(name, *(f"{value:.0f}" for value in values))
    exact = bonded_shaft_stiffness(fe.Elastic(YOUNG, 0.49), RADIUS, LENGTHS)
    table.add_row("Randolph and Wroth", *(f"{value:.0f}" for value in exact))
    console.print(table)
    root = Path(__file__).resolve().parents[1]
    recordings = runpy.run_path(str(root / "tests" / "recorded_data.py"))["RECORDINGS"]
    jobs = runpy.run_path(str(root / "benchmarks" / "cross_validation.py"))["conditions"](
        recordings / "needle-insertion-rig"
    )
    table = Table(
        "condition", "identified [N/m]", "modulus that explains the last layer [kPa]", title="recordings of others"
    )
    measured = []
    with console.status("identifying"), ProcessPoolExecutor(os.cpu_count()) as pool:
        for name, stiffness, deepest, reason in pool.map(identified, jobs.items()):
            measured += [stiffness] if stiffness else []
            explained = fe.modulus_of_shaft_stiffness(stiffness[-1], 0.6 * deepest, RADIUS) if stiffness else np.nan
            table.add_row(name, ", ".join(f"{value:.0f}" for value in stiffness) or reason, f"{explained / 1e3:.1f}")
    console.print(table if jobs else "No recordings: set NEEDLEFORCE_RECORDINGS.")
    if path:
        figure(found, measured, path)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--figure", help="SVG to write")
    main(parser.parse_args().figure)
