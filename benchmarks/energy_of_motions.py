# SPDX-License-Identifier: Apache-2.0
"""Work of the hand along random closed motions of a needle that bends, and of one in a condensed solid: none comes back
without friction, and none is gained with it.

    python benchmarks/energy_of_motions.py [--times 10 | --full] [--first SEED]

Motions are in depth, lateral position, tilt and roll, over passive axial laws (presets and other parameters),
foundations, layers, guides, tips and noise of the depth: twice 1030 of them, or as many times as stated, with --full
100 times. A thousand take a minute of processor. The worst have their seed.
"""

import argparse
import math
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

import needleforce as nf
from needleforce import fe

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from closed_motions import Balance, along, bent, drawn, drawn_loop, drawn_motion, gain, run, work
from closed_motions_in_solid import drawn_depth, drawn_in_solid, refined, rigid

BAR, NOISE = 1e-6, 5e-6
STEPS = 100  # in a leg
FORMS = ("linear", "saturating", "hardening")


@dataclass(frozen=True)
class Kind:
    """Motions of a kind: how many of 1000, from a seed to words and a balance, and the share that is judged."""

    parts: int
    motion: Callable[[int], tuple[str, Balance]]
    share: Callable[[Balance], float] = lambda found: -found.share


def moved(noise=0.0, noisy_law=False, **options):
    def motion(seed):
        insertion, words, rng = drawn(seed, **options, noise=noise if noisy_law else 0.0)
        return words, bent(insertion, drawn_motion(rng, insertion, STEPS, noise))

    return motion


def looped(**options):
    def motion(seed):
        insertion, words, rng = drawn(seed, **options)
        return words, gain(insertion, *drawn_loop(rng, insertion, STEPS))

    return motion


def in_any_solid(seed):
    found, words = refined(seed, -BAR)
    return words, found


def in_solid(noise=0.0, known=0.0):
    def motion(seed):
        insertion, words, rng = drawn_in_solid(seed, known)
        return words, rigid(insertion, *drawn_depth(rng, insertion, noise), at_most=noise > 0.0)

    return motion


KINDS = {
    "no axial force, |work| of all": Kind(
        200, moved(friction=False, foundations=FORMS, tips=("none",)), lambda found: found.left
    ),
    "no axial force, at any instant": Kind(50, moved(friction=False, foundations=FORMS, tips=("none",))),
    "axial laws": Kind(200, moved(tips=("none",))),
    "axial laws, loops": Kind(200, looped(tips=("none",))),
    "bevel": Kind(50, moved(tips=("bevel",))),
    "bevel, loops": Kind(50, looped(tips=("bevel",))),
    "lateral force on the tip, loops": Kind(50, looped(tips=("tip force",))),
    "noise of 5 um": Kind(50, moved(NOISE)),
    "condensed solid": Kind(100, in_solid()),
    "condensed solid, all laws, also relaxing, steps as fine as needed": Kind(30, in_any_solid),
    "condensed solid, noise of 5 um": Kind(25, in_solid(NOISE)),
    "condensed solid, noise of 5 um that is stated": Kind(25, in_solid(NOISE, NOISE)),
}


def of_kind(kind, first, count):
    """Row of a table: motions, those beyond the bar, outside the range of the model, buckled, and the worst."""
    shares, outside, buckled = [], 0, 0
    for seed in range(first, first + count):
        words, found = kind.motion(seed)
        outside, buckled = outside + (not found.inside), buckled + found.buckled
        shares.append((kind.share(found), seed, words, found.inside))
    shares.sort(reverse=True)
    beyond = sum(share > BAR for share, *_ in shares)
    still = sum(share > BAR and inside for share, _, _, inside in shares)
    worst = "; ".join(f"{share:.1e} {seed} ({words})" for share, seed, words, _ in shares[:2] if share > BAR)
    return f"{count}", f"{beyond}", f"{still}", f"{outside}", f"{buckled}", f"{shares[0][0]:.1e}", worst


def rectangle(name, deep=15e-6, aside=6e-3):
    """Work of the hand in a turn, and what it turned over [J]: 30 mm deep, guide 24 mm above the surface."""
    insertion = nf.FlexibleInsertion(
        nf.preset(name) if name else None, nf.preset("paper").needle, lateral=50e3, guide_distance=24e-3, planar=True,
        max_speed=math.inf,
    )  # fmt: skip
    run(insertion, along([[-1e-3, *[0] * 5], [30e-3, *[0] * 5]], 3100))
    corners = np.zeros((5, 6))
    corners[:, 0] = 30e-3 + deep * np.array([0, 1, 1, 0, 0])
    corners[:, 1] = aside * np.array([0, 0, 1, 1, 0])
    loop = along(corners, 400)
    for _ in range(3):
        steps = work(insertion, loop, run(insertion, loop))
    return float(steps.sum()), float(np.abs(steps).sum())


def aside(needle, modulus):
    """Tip's way back [m], force and wrench of a needle 30 mm deep whose base moves 6 mm aside, with the force that the
    stretched tissue has against the insertion, K y^2 / 2 at the surface."""
    insertion = nf.FlexibleInsertion(
        nf.preset("paper"), needle, lateral=modulus, guide_distance=24e-3, planar=True, max_speed=math.inf
    )
    run(insertion, along([[-1e-3, *[0] * 5], [30e-3, *[0] * 5]], 3100))
    rows = run(insertion, along([[30e-3, *[0] * 5], [30e-3, 6e-3, *[0] * 4]], 600))
    x, _, z = insertion.shape().T
    stretched = 0.5 * modulus * float(np.interp(0.0, z, x)) ** 2
    return 30e-3 - rows["tip"][-1, 2], rows["force"][-1], rows["wrench"][-1], stretched


def soft_contact():
    """Work and what was turned over [J] of a cone whose contact law is softer than the solid and its cutting harder."""
    held = {"bottom": "fixed", "sides": "fixed"}
    mesh = fe.axisymmetric_block(50e-3, 60e-3, 0.35e-3, needle_depth=40e-3)
    tissue = fe.Tissue(mesh, fe.Elastic(116e3, 0.49), symmetry="axisymmetric", supports=held)
    laws = nf.laws
    model = nf.Model(
        laws.Cone(reduced_modulus=117.5e3, half_angle=math.radians(15.0)), laws.PunctureDepth(depth=0.4e-3),
        laws.Coulomb(per_length=18.6), laws.ConstantCutting(force=0.0776),
    )  # fmt: skip
    insertion = fe.CondensedInsertion(tissue.condense(fe.NeedlePath(40e-3, 1e-3, 0.35e-3)), model)
    depth = along([[-0.1e-3, *[0] * 5], [0.42e-3, *[0] * 5], [-1.5e-3, *[0] * 5]], 1000).depth
    return rigid(insertion, depth, np.full(len(depth), 1e-3))


def known(console):
    """The motions that were found to return energy, and what a needle feels whose base moves aside."""
    table = Table("rectangle of 15 um in depth and 6 mm across", "work [uJ]", "turned over [uJ]")
    for name in ("paper", "lugre", "layered", "layered_yielding"):
        table.add_row(name, *(f"{1e6 * each:.1f}" for each in rectangle(name)))
    table.add_row("no axial force, 3 mm in depth", *(f"{1e6 * each:.2f}" for each in rectangle(None, deep=-3e-3)))
    contact = soft_contact()
    table.add_row(
        "condensed solid, cutting above its contact", f"{1e6 * contact.end:.1f}", f"{1e6 * contact.turned:.1f}"
    )
    console.print(table)
    thick = nf.Needle(1.27e-3, 0.0, 0.6, 161.7235e9)
    table = Table("base 6 mm aside", "tip back [mm]", "force [N]", "wrench x, z [N]", "stretched tissue [N]")
    for words, needle, modulus in (
        ("0.7 mm, 50 kPa", nf.preset("paper").needle, 50e3),
        ("18G, 50 kPa", thick, 50e3),
        ("18G, 100 kPa", thick, 100e3),
    ):
        back, force, wrench, stretched = aside(needle, modulus)
        table.add_row(
            words, f"{1e3 * back:.3f}", f"{force:.4f}", f"{wrench[0]:.3f}, {wrench[2]:.4f}", f"{stretched:.3f}"
        )
    console.print(table)


def main(times, first):
    console = Console(width=190)
    known(console)
    heads = (
        "motions",
        "n",
        "beyond 1e-6",
        "of these inside",
        "outside range",
        "buckled",
        "worst",
        "seeds of the worst",
    )
    table, start = Table(*heads), time.process_time()
    with console.status("motions"):
        for name, kind in KINDS.items():
            table.add_row(name, *of_kind(kind, first, kind.parts * times))
    console.print(table)
    console.print(f"{time.process_time() - start:.0f} s of processor, {STEPS} steps in a leg")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--times", type=int, default=2, help="how many times 1030 motions")
    parser.add_argument("--full", dest="times", action="store_const", const=100)
    parser.add_argument("--first", type=int, default=0, help="seed of the first of each kind")
    arguments = parser.parse_args()
    main(arguments.times, arguments.first)
