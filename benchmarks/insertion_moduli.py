# SPDX-License-Identifier: Apache-2.0
"""Moduli from whole insertions: of simulated ones with other spacings, steps and cells than the fit, and of real ones.

python benchmarks/insertion_moduli.py [--recordings FOLDER]
"""

import argparse
import os
import time
from dataclasses import replace
from itertools import cycle, pairwise, product
from pathlib import Path

import numpy as np

import needleforce as nf
from needleforce import fe

RADIUS, LENGTH, DEEP = 0.35e-3, 15e-3, 22e-3
MODULI = (5e3, 8e3, 30e3, 116e3)
LAWS = ((2.0, 0.03), (5.0, 0.1), (20.0, 0.1), (60.0, 0.1), (5.0, 0.5), (20.0, 0.5))  # friction [N/m], cutting [N]
MADE = ((0.25, 0.6e-3, 10e-6), (0.35, 0.75e-3, 4e-6))  # cells [needle radii], spacing [m], step [m]
STOPS = (-2e-3, 9e-3, 7e-3, 13e-3, -3e-3)
NOISE = 3e-3  # [N]
# of the rig: the fourth repeat of each condition
REPEATS = "*__*_*_*_*_4_20*.csv"


def cup(cell, young):
    mesh = fe.axisymmetric_block(40 * RADIUS, DEEP, cell * RADIUS, needle_depth=LENGTH)
    held = {"bottom": "fixed", "sides": "fixed"}
    return fe.Tissue(mesh, fe.Elastic(young, 0.49), symmetry="axisymmetric", supports=held)


def inserted(solid, friction, cutting, step, *, rest=0.0, slower=1.0, presliding=1e-9, seed=0, **relaxation):
    """Time, depth and force with noise, a zero and an offset; the tip breaks through at 0.1 N. The needle rests at each
    stop [s], and every other way is so many times slower."""
    ways = [np.arange(a, b, np.copysign(step, b - a)) for a, b in pairwise(STOPS)]
    held = [np.full(round(rest / 2e-3), b) for b in STOPS[1:]]
    depth = np.concatenate([part for pair in zip(ways, held) for part in pair])
    steps = [(len(way), step / 5e-3 * slower ** (k % 2)) for k, way in enumerate(ways)]
    dt = np.concatenate([np.append(np.full(*each), np.full(len(held[0]), 2e-3)) for each in steps])
    law = nf.laws.Coulomb(per_length=friction, presliding=presliding, dimple_ratio=0.0)
    contact, cut = nf.laws.Polynomial(linear=200.0, quadratic=0.0), nf.laws.ConstantCutting(cutting, 1e-6)
    model = nf.Model(contact, nf.laws.PunctureForce(force=0.1), law, cut, **relaxation)
    force = fe.CondensedInsertion(solid, model).run(depth, dt)["force"]
    random = np.random.default_rng(seed)
    depth = depth + 4e-3 + random.normal(0.0, 1e-6, len(depth))
    return np.cumsum(dt) - dt[0], depth, force + 0.05 + random.normal(0.0, NOISE, len(depth))


def fitted(tissue, path, recording):
    """The fit or why not, and processor time [s]."""
    start = time.process_time()
    try:
        found = fe.fit_insertion(tissue, path, recording)
    except nf.InputError as refused:
        found = refused
    return found, time.process_time() - start


def simulated():
    path, specimen = fe.NeedlePath(LENGTH, 1e-3, RADIUS), cup(0.5, 60e3)
    solids = {cell: cup(cell, 30e3).condense(fe.NeedlePath(LENGTH, spacing, RADIUS)) for cell, spacing, _ in MADE}
    print("| modulus, friction, cutting | spacing | modulus found | friction found | residual / noise | in intervals |")
    print("|---|---|---|---|---|---|")
    hits, spent = [], []
    for (young, (friction, cutting)), (cell, spacing, step) in zip(product(MODULI, LAWS), cycle(MADE)):
        solid = replace(solids[cell], compliance=30e3 / young * solids[cell].compliance)
        found, seconds = fitted(specimen, path, inserted(solid, friction, cutting, step))
        row = f"| {1e-3 * young:g} kPa, {friction:g} N/m, {cutting:g} N | {1e3 * spacing:g} mm"
        if isinstance(found, nf.InputError):
            print(f"{row} | refused: {found.quantity} is {found.value} | | | |")
            continue
        estimates = [*found.estimates][:3]
        held = [each.low <= true <= each.high for each, true in zip(estimates, (young, friction, cutting))]
        hits.append(held)
        spent.append(seconds)
        named = " named" if any("times the noise" in text for text in getattr(found, "warnings", ())) else ""
        shown = " | ".join(str(each.shown) if each.identifiable else "not identifiable" for each in estimates[:2])
        ratio = f"{found.rmse / found.noise:.2g}{named}"
        print(f"{row} | {shown} | {ratio} | {', '.join('yes' if each else 'no' for each in held)} |", flush=True)
    names = "modulus", "friction", "cutting force"
    shares = ", ".join(f"{name} {sum(held)} of {len(hits)}" for name, held in zip(names, zip(*hits)))
    print(f"\nIn their intervals: {shares}. {np.median(spent):.2g} s of processor a fit.\n")


SERIES = {"share_1": 0.4, "time_1": 1.0}, {"share_1": 0.3, "time_1": 0.3, "share_2": 0.2, "time_2": 3.0}
MOTIONS = {"rests of 5 s": {"rest": 5.0}, "two speeds, 1:10": {"slower": 10.0}, "one speed": {}}


def relaxing():
    """Tissue that relaxes, and a spring of 200 um between shaft and tissue: what is found, with its interval."""
    path, specimen = fe.NeedlePath(LENGTH, 1e-3, RADIUS), cup(0.5, 60e3)
    cell, spacing, step = MADE[0]
    solid = cup(cell, 30e3).condense(fe.NeedlePath(LENGTH, spacing, RADIUS))
    print("| modulus, friction | motion | true | modulus found | also found | residual / noise | in intervals |")
    print("|---|---|---|---|---|---|---|")
    hits, spent = [], []
    made = [*product(SERIES, MOTIONS.items()), ({}, ("rests of 5 s", {"rest": 5.0}))]
    made.append(({"presliding": 200e-6}, ("one speed", {"presliding": 200e-6})))
    for (young, friction), (true, (words, motion)) in product(((8e3, 5.0), (30e3, 20.0), (116e3, 20.0)), made):
        there = replace(solid, compliance=30e3 / young * solid.compliance)
        law = {"relaxation": nf.laws.Prony(**true)} if "share_1" in true else {}
        found, seconds = fitted(specimen, path, inserted(there, friction, 0.1, step, **motion, **law))
        row = f"| {1e-3 * young:g} kPa, {friction:g} N/m | {words} | {', '.join(f'{v:g}' for v in true.values())}"
        if isinstance(found, nf.InputError):
            print(f"{row} | refused: {found.quantity} is {found.value} | | | |")
            continue
        modulus, *others = found.estimates
        shown = {each.name.removeprefix("relaxation_"): each for each in others if each.identifiable}
        values = [(modulus, young), *((shown[name], value) for name, value in true.items() if name in shown)]
        held = [each.low <= value <= each.high for each, value in values]
        hits += held
        spent.append(seconds)
        also = ", ".join(f"{name} {shown[name].shown}" for name in shown if name in (*SERIES[1], "presliding"))
        warned = " named" if any("times the noise" in text for text in found.warnings) else ""
        print(
            f"{row} | {modulus.shown} | {also} | {found.rmse / found.noise:.2g}{warned} | {sum(held)} of {len(held)} |"
        )
    print(
        f"\nIn their intervals: {sum(hits)} of {len(hits)}. {np.median(spent):.2g} s of processor a fit.\n", flush=True
    )


def real(folder):
    """In a gel of 80 mm and 50 mm deep, with a needle of 1.2 mm: neither is known."""
    mesh = fe.axisymmetric_block(40e-3, 50e-3, 0.3e-3, needle_depth=27e-3)
    tissue = fe.Tissue(mesh, fe.Elastic(60e3, 0.49), symmetry="axisymmetric")
    path = fe.NeedlePath(26e-3, 1e-3, 0.6e-3)
    print("| recording | modulus, or why it is refused | share and time that relax | residual / noise |")
    print("|---|---|---|---|")
    for file in sorted(folder.glob(REPEATS)):
        if any(word in file.name for word in ("setup", "anomaly", "archive")):
            continue
        found, _ = fitted(tissue, path, nf.read(file))
        name = file.name.split("needle__")[-1].rsplit("_", 1)[0].removesuffix("_2024-06-19")
        if isinstance(found, nf.InputError):
            print(f"| {name} | refused: {found.quantity} is {found.value} | | |", flush=True)
            continue
        relaxes = [each for name, each in found.parameters.items() if name.startswith("relaxation")]
        shown = ", ".join(f"{each.shown}" for each in relaxes if each.identifiable) or "not identifiable"
        warned = " named" if any("times the noise" in text for text in getattr(found, "warnings", ())) else ""
        print(
            f"| {name} | {next(iter(found.estimates)).shown} | {shown} | {found.rmse / found.noise:.3g}{warned} |",
            flush=True,
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--recordings", default=os.environ.get("NEEDLEFORCE_RECORDINGS", "../shared/data"))
    parser.add_argument("--only", choices=("simulated", "relaxing", "real"))
    options = parser.parse_args()
    folder = Path(options.recordings) / "needle-insertion-rig"
    if options.only in (None, "simulated"):
        simulated()
    if options.only in (None, "relaxing"):
        relaxing()
    if options.only in (None, "real") and folder.is_dir():
        real(folder)


if __name__ == "__main__":
    main()
