# SPDX-License-Identifier: Apache-2.0
"""Condensed solids: offline times by size of the mesh, and the time of a step, which does not depend on it.

    python benchmarks/condensed.py [--full]

With --full also meshes of up to 10^5 elements, which take a minute, and one of hexahedra.
"""

import argparse
import json
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
from loop import compiled
from rich.console import Console
from rich.table import Table

import needleforce as nf
from needleforce import fe

LENGTH, RADIUS, NODES = 60e-3, 0.35e-3, 60
GEL = fe.Elastic(30e3, 0.49)
HELD = {"bottom": "fixed", "sides": "fixed"}
CELLS = {"0.9 mm": 0.9e-3, "0.35 mm": 0.35e-3, "0.12 mm": 0.12e-3}
FULL = {"0.06 mm": 0.06e-3, "0.027 mm": 0.027e-3}


def axisymmetric(cell):
    mesh = fe.axisymmetric_block(60e-3, 80e-3, cell, needle_depth=LENGTH, growth=0.12)
    return fe.Tissue(mesh, GEL, symmetry="axisymmetric", supports=HELD)


def solid():
    return fe.Tissue(fe.block((60e-3, 60e-3, 80e-3), 2e-3, needle_depth=LENGTH, growth=0.5), GEL, supports=HELD)


def timed(work):
    start = time.perf_counter()
    return work(), time.perf_counter() - start


def step_times(program, condensed, folder):
    """Percentiles of the time of a step [us]."""
    path = Path(folder) / "table.bin"
    numbers = np.concatenate([[len(condensed.compliance), condensed.spacing], condensed.compliance.ravel()])
    numbers.astype(float).tofile(path)
    return json.loads(subprocess.run([program, path], check=True, capture_output=True, text=True).stdout)


def bent_times(condensed):
    """Mean time of a step [us] of a needle that bends, in layers and in the solid, by whether it stays in a plane."""
    needle = nf.Needle(outer_diameter=1e-3, inner_diameter=0.0, length=0.2, young_modulus=200e9, poisson_ratio=0.3)
    lateral = [nf.LateralLayer(modulus=2e4, tip_force=0.05)]
    depth, found = np.arange(-1e-3, 55e-3, 5e-6), {}
    for planar in (True, False):
        for place, tissue in (("layers", None), ("a solid", condensed)):
            flexible = nf.FlexibleInsertion(
                nf.preset("paper"), needle, tissue=tissue, lateral=lateral, guide_distance=30e-3, planar=planar
            )
            passes = []
            for _ in range(5):
                flexible.reset()
                passes.append(timed(lambda each=flexible: each.run(depth, dt=1e-3))[1])
            found[f"{'plane' if planar else 'space'}, in {place}"] = 1e6 * min(passes) / len(depth)
    return found


def main(full):
    console = Console(width=140)
    heads = ("mesh", "elements", "unknowns", "assembled [s]", "factor [s]", "condensed [s]")
    table = Table(*heads, "step, median", "99 %", "99.9 %", "largest [us]", title=f"{NODES} nodes of the path")
    bodies = {name: lambda cell=cell: axisymmetric(cell) for name, cell in (CELLS | (FULL if full else {})).items()}
    if full:
        bodies["hexahedra, 2 mm, 30 nodes"] = solid
    with tempfile.TemporaryDirectory() as folder, console.status("meshes, factors, steps"):
        program = compiled("condensed", folder)
        for name, body in bodies.items():
            tissue, assembled = timed(body)
            _, factored = timed(lambda each=tissue: (each.stiffness, each.factor))
            plane = tissue.mesh.dimension == 2
            path = fe.NeedlePath(LENGTH, LENGTH / (NODES - 1 if plane else 29), RADIUS if plane else 2e-3)
            condensed, took = timed(lambda each=tissue, line=path: each.condense(line))
            if plane:
                inserted = condensed
            step = step_times(program, condensed, folder)
            times = (step[key] for key in ("median_us", "p99_us", "p999_us", "largest_us"))
            counts = (f"{len(tissue.mesh.cells)}", f"{tissue.unknowns}")
            offline = (f"{each:.2f}" for each in (assembled, factored, took))
            table.add_row(name, *counts, *offline, *(f"{each:.2f}" for each in times))
    console.print(table)
    bent = Table("a needle that bends", "step, mean [us]", title="40 elements, 1 kHz, 5 mm/s")
    radius = 0.5e-3
    for name, value in bent_times(fe.CondensedTissue(inserted.spacing, inserted.compliance, radius)).items():
        bent.add_row(name, f"{value:.2f}")
    console.print(bent)
    console.print(
        "Times of a step are of the work alone (the least of nine passes). On paper, on other machines: 2 ms a step "
        "(500 Hz, DiMaio and Salcudean), 20 ms (50 Hz, 1250 elements, Alterovitz), 10 ms a step of a SOFA scene."
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true")
    main(parser.parse_args().full)
