# SPDX-License-Identifier: Apache-2.0
"""Friction under each form of the foundation: how often a nonlinear form is preferred on a linear one, how often the
intervals contain the truth, and which form is chosen. Prints the tables of docs/evidence/friction_forms.md.

    python benchmarks/friction_forms.py [--count 400] [--figure FILE.svg]

With ``--figure`` only the figure of docs/explanation/mechanics.md is drawn, and its table printed.
"""

import argparse
from pathlib import Path

import numpy as np

import needleforce as nf
from needleforce.identification.two_pass.second_pass import BIN_M, friction_forms, shape
from needleforce.mechanics.foundation import FORMS, bending_length, deflection_length

FRICTION, START, SPEED, RATE = 18.6, 3.3e-3, 3e-3, 1000.0
TRUTHS = {"cubic": 0.7, "hyperbolic": 1.5, "tanh": 1.5}
DEFLECTION = 12e-3  # [m]
NAMES = ("friction_per_length", "settlement_ratio", "deflection_length", "friction_bend")


def second_pass(form: str, deepest: float, noise: float, random: np.random.Generator) -> tuple:
    """Bin means of a second pass with an intercept of 10 mN, and the noise [N] of a sample at 1 kHz and 3 mm/s."""
    depth = np.arange(START, deepest, BIN_M)
    length = depth if form == "linear" else shape(form, TRUTHS[form], depth, np.array([DEFLECTION]))[0]
    error = noise / np.sqrt(BIN_M / SPEED * RATE)
    return depth, FRICTION * length + 0.01 + random.normal(0.0, error, len(depth)), np.ones((len(depth), 1))


def truth(form: str, deepest: float) -> dict[str, float]:
    """The parameters of a second pass."""
    depth = np.arange(START, deepest, BIN_M)
    bend = shape(form, TRUTHS[form], depth, np.array([DEFLECTION]))[0][-1] / depth[-1] - 1.0
    return dict(zip(NAMES, (FRICTION, TRUTHS[form], DEFLECTION, float(bend))))


def preferred(form: str, deepest: float, noise: float, count: int) -> dict[str, float]:
    """Share [%] of the second passes in which each form has the lowest BIC."""
    random = np.random.default_rng(1)
    best = [friction_forms(*second_pass(form, deepest, noise, random))[0].form for _ in range(count)]
    return {each: 100.0 * best.count(each) / count for each in FORMS}


def covered(form: str, deepest: float, noise: float, count: int) -> dict[str, tuple[float, float]]:
    """Share [%] of the intervals that contain the truth, and share in which the parameter is identifiable."""
    random, expected = np.random.default_rng(2), truth(form, deepest)
    found = [friction_forms(*second_pass(form, deepest, noise, random), forms=(form,))[0] for _ in range(count)]
    return {
        name: (
            100.0 * np.mean([each.low[name] <= value <= each.high[name] for each in found]),
            100.0 * np.mean([name in each.identifiable for each in found]),
        )
        for name, value in expected.items()
    }


def laws() -> dict[str, tuple]:
    """Label -> a law with the paper's friction, colour and line style."""
    needle, tissue = nf.Needle(outer_diameter=0.7e-3, length=80e-3, young_modulus=14.1e9), nf.Tissue(116e3, 0.5)
    modulus = nf.foundation_modulus(needle, tissue)
    # 0.126 N: the paper's cutting force on a bevel of 15 degrees with a friction coefficient of 0.3
    lateral = 0.0776 / np.tan(np.radians(15.0) + np.arctan(0.3))
    bent = deflection_length(needle, modulus, lateral), bending_length(needle, modulus)
    classes = nf.laws.CubicFoundation, nf.laws.HyperbolicFoundation, nf.laws.TanhFoundation
    found = {"linear": (nf.laws.Coulomb(FRICTION), "k", "-")}
    for law, (form, ratio), colour in zip(classes, TRUTHS.items(), ("C3", "C0", "C2")):
        found[f"{form}, r = {ratio}, L = 12 mm"] = law(FRICTION, ratio, DEFLECTION), colour, "-"
        found[f"{form}, r = {ratio}, L and b by mechanics"] = law(FRICTION, ratio, *bent), colour, "--"
    found["linear, one side loses contact at 12 mm"] = nf.laws.CubicFoundation(FRICTION, 0.0, DEFLECTION), "k", ":"
    return found


def draw(path: Path) -> None:
    """Friction over depth for the paper's needle and gel."""
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams |= {"svg.hashsalt": "needleforce", "svg.fonttype": "none", "font.size": 9}
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(9, 3.6), layout="constrained")
    depth = np.linspace(0.0, 35e-3, 351)
    print("| friction, mN, at a depth of |" + "".join(f" {mm} mm |" for mm in (3, 6, 12, 20, 30)))
    for label, (law, colour, line) in laws().items():
        axes.plot(1e3 * depth, [law.sliding(each) for each in depth], color=colour, linestyle=line, label=label)
        print(f"| {label} |" + "".join(f" {1e3 * law.sliding(1e-3 * mm):.0f} |" for mm in (3, 6, 12, 20, 30)))
    axes.axvline(12.0, color="0.7", linewidth=0.8)
    axes.text(12.3, 1.02, "12 mm: the paper's line ends", color="0.4")
    axes.set(xlim=(0, 35), ylim=(0, 1.1), xlabel="embedded length [mm]", ylabel="friction [N]")
    figure.legend(fontsize=8, frameon=False, loc="outside right upper")
    figure.savefig(path, metadata={"Date": None})


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=400)
    parser.add_argument("--figure", type=Path)
    arguments = parser.parse_args()
    if arguments.figure:
        return draw(arguments.figure)
    count = arguments.count
    print("| truth | depth, mm | noise, mN | bins |" + "".join(f" {form} |" for form in FORMS))
    for form in FORMS:
        for deepest, noise in ((12e-3, 20e-3), (30e-3, 20e-3)) if form != "linear" else ((12e-3, 5e-3), (30e-3, 5e-3)):
            shares = preferred(form, deepest, noise, count if form == "linear" else count // 4)
            bins = len(np.arange(START, deepest, BIN_M))
            row = "".join(f" {shares[each]:.1f} |" for each in FORMS)
            print(f"| {form} | {1e3 * deepest:.0f} | {1e3 * noise:.0f} | {bins} |{row}", flush=True)
    print("\n| truth | depth, mm | noise, mN |" + "".join(f" {name} |" for name in NAMES))
    for form in TRUTHS:
        for deepest, noise in ((12e-3, 5e-3), (30e-3, 5e-3), (30e-3, 50e-3)):
            shares = covered(form, deepest, noise, count)
            row = "".join(f" {inside:.1f} ({known:.0f}) |" for inside, known in shares.values())
            print(f"| {form} | {1e3 * deepest:.0f} | {1e3 * noise:.0f} |{row}", flush=True)


if __name__ == "__main__":
    main()
