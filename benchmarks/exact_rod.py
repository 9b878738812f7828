# SPDX-License-Identifier: Apache-2.0
"""Truth for a needle whose base moves aside: an inextensible rod of any slope on a tissue that has an energy.

    python benchmarks/exact_rod.py [--write]

Nothing of needleforce is used. The tissue holds the energy of w(u) = K u^2 / 2 over its depth, u being the offset of
the needle from the path that its tip cut. Its derivative is a force normal to the needle, w'(u) along its length, and
w(u) on the tip, against the insertion: tissue that the tip leaves relaxes. Along the tangent act a friction per length
and, on the tip, the cutting force. With --write the values are stored for the tests, each with its error: the
difference to a tenth of the tolerance and half the travel of a step. Energy per length of the needle instead of per
depth would change forces by 1.3 % at most, and the tip by 0.14 % of the base's motion.
"""

import argparse
import itertools
import json
import math
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.integrate import solve_bvp

VALUES = Path(__file__).resolve().parents[1] / "tests" / "mechanics" / "exact_rod.json"
NEEDLES = {"0.7 mm": (0.7e-3, 14.1e9), "18G": (1.27e-3, 161.7235e9)}  # diameter [m], Young's modulus [Pa]
STEEPEST = 0.25  # slope up to which values are stored
CUT = 30e-3  # depth of the straight path [m]
FRICTION, CUTTING = 18.6, 0.0776  # N/m, N
FED = 2e-3  # beyond it with friction, so that the needle slides and cuts [m]
KINK = 0.1e-3  # over which a path begins anew where the tip was pulled aside [m]


@dataclass(frozen=True, kw_only=True)
class Case:
    """A needle in a straight path, its base then moved aside and tilted, and fed on where there is friction."""

    needle: str
    modulus: float
    free: float  # from the base to the surface [m]
    hub: bool  # whether the base is the hub, which travels along, or a guide that stays
    aside: float
    tilt: float  # slope of the base
    friction: bool

    @property
    def stiffness(self):
        diameter, young = NEEDLES[self.needle]
        return young * math.pi * diameter**4 / 64.0

    @property
    def fed(self):
        return FED if self.friction else 0.0

    @property
    def length(self):
        """Of the needle from the base to the tip; a hub that travels along comes nearer to the surface."""
        return self.free + CUT + (0.0 if self.hub else self.fed)

    @property
    def base(self):
        return -self.free + (self.fed if self.hub else 0.0)


class CutPath:
    """Lateral place of the cut path over depth: 0 down to ``CUT``, then, within ``KINK``, where the tip was, and on to
    where it is."""

    def __init__(self):
        self.depth, self.place = [], []

    def offset(self, x, z, tip):
        if not self.depth:
            return x
        depth = np.array([*self.depth, tip[1]])
        fresh = np.polyfit(1e3 * (depth - CUT), [*self.place, tip[0]], min(len(self.depth), 3))
        within = np.clip((z - CUT) / KINK, 0.0, 1.0)
        return x - within**2 * (3.0 - 2.0 * within) * np.polyval(fresh, 1e3 * (z - CUT))


def equilibrium(case, path, length, base, first, tolerance):
    """Planar rod (x, z, angle, moment, force in x, force in z of what is beyond) over the free and the embedded part,
    each over 0 to 1, with the free length as unknown."""
    friction, cutting = (FRICTION, CUTTING) if case.friction else (0.0, 0.0)

    def bent(y):
        _, _, angle, moment, fx, fz = y
        return [
            np.sin(angle), np.cos(angle), moment / case.stiffness, fz * np.sin(angle) - fx * np.cos(angle),
        ]  # fmt: skip

    def slopes(_, y, unknown):
        free, tissue = y[:6], y[6:]
        push = case.modulus * path.offset(tissue[0], tissue[1], unknown[1:])
        sine, cosine = np.sin(tissue[2]), np.cos(tissue[2])
        above = np.vstack([*bent(free), np.zeros_like(push), np.zeros_like(push)])
        below = np.vstack([*bent(tissue), push * cosine + friction * sine, -push * sine + friction * cosine])
        return np.vstack([unknown[0] * above, (length - unknown[0]) * below])

    def ends(at_base, at_end, unknown):
        tip, tissue = at_end[6:], at_base[6:]
        relaxing = 0.5 * case.modulus * path.offset(tip[0], tip[1], unknown[1:]) ** 2
        sine, cosine = math.sin(tip[2]), math.cos(tip[2])
        held = [at_base[0] - case.aside, at_base[1] - base, at_base[2] - math.atan(case.tilt)]
        loose = [tip[3], tip[4] + cutting * sine, tip[5] + cutting * cosine + relaxing]
        return np.array([*held, *loose, *(at_end[:6] - tissue), tissue[1], tip[0] - unknown[1], tip[1] - unknown[2]])

    found = solve_bvp(slopes, ends, first.x, first.y, first.p, tol=tolerance, max_nodes=20_000)
    if not found.success:
        raise RuntimeError(f"{case}: {found.message}")
    return found


@dataclass
class Guess:
    x: np.ndarray
    y: np.ndarray
    p: np.ndarray


def straight(case, length, base):
    x = np.linspace(0.0, 1.0, 81)
    zero = np.zeros_like(x)
    above = [zero, base * (1.0 - x), zero, zero, zero, zero]
    below = [zero, (length + base) * x, zero, zero, zero, zero]
    return Guess(x, np.vstack(above + below), np.array([-base, 0.0, length + base]))


def solved(case, tolerance=1e-6, step=2e-4):
    """The rod at the end of the motion, approached in parts."""
    path, length, base = CutPath(), case.length, case.base
    at = straight(case, length - (0.0 if case.hub else case.fed), base - (case.fed if case.hub else 0.0))
    for share in (0.25, 0.5, 0.75, 1.0):
        part = replace(case, aside=share * case.aside, tilt=share * case.tilt)
        at = equilibrium(part, path, case.free + CUT, -case.free, at, tolerance)
    for fed in np.arange(1, round(case.fed / step) + 1) * step:
        long, high = (case.free + CUT, fed - case.free) if case.hub else (case.free + CUT + fed, -case.free)
        first = Guess(at.x, at.y, at.p + np.array([0.0, 0.0, step]))
        before, at = at, equilibrium(case, path, long, high, first, tolerance)
        depth = at.p[2]
        if depth >= CUT:
            if not path.depth:
                share = (CUT - before.p[2]) / (depth - before.p[2])
                path.depth.append(CUT)
                path.place.append(before.p[1] + share * (at.p[1] - before.p[1]))
                at = equilibrium(case, path, long, high, at, tolerance)
            path.depth.append(at.p[2])
            path.place.append(at.p[1])
    return at


def values(case, **accuracy):
    """Of the rod at the end: force and moment of the tissue at the base in the tissue's axes, tip, and the force along
    the axis that feeds it, in front of the guide or at the hub."""
    rod = solved(case, **accuracy)
    base, tip = rod.y[:6, 0], rod.y[6:, -1]
    angle, moment, fx, fz = base[2:]
    along = -(fx * math.sin(angle) + fz * math.cos(angle))
    # in the guide the needle is straight: what bends at its exit is fed by the energy of its bending
    fed = -fz if case.hub else along - moment**2 / (2.0 * case.stiffness)
    steepest = float(np.abs(np.tan(np.concatenate([rod.y[2], rod.y[8]]))).max())
    surface = float(rod.y[6, 0])
    return {
        "force_x": fx, "force_z": fz, "moment": moment, "along": along, "fed": fed, "tip_x": tip[0], "tip_z": tip[1],
        "slope": steepest, "surface_x": surface,
    }  # fmt: skip


def rounded(numbers, digits):
    return {key: float(f"{value:.{digits}g}") for key, value in numbers.items()}


HELD = ((24e-3, False), (40e-3, False), (50e-3, True))  # free length, whether at the hub
MOVED = ((2e-3, 0.0), (4e-3, 0.0), (6e-3, 0.0), (3e-3, 0.05), (3e-3, -0.05))  # aside, tilt


def cases():
    grid = itertools.product(NEEDLES, (10e3, 50e3, 100e3), HELD, MOVED, (False, True))
    for needle, modulus, (free, hub), (aside, tilt), friction in grid:
        yield Case(needle=needle, modulus=modulus, free=free, hub=hub, aside=aside, tilt=tilt, friction=friction)


def main(write):
    console, rows = Console(width=150), []
    table = Table("case", "slope", "force x [N]", "force z [N]", "fed [N]", "moment [N mm]", "tip [mm]", "error")
    for case in cases():
        coarse = values(case)
        if coarse["slope"] > STEEPEST:
            continue
        fine = values(case, tolerance=1e-7, step=1e-4)
        errors = {key: abs(fine[key] - coarse[key]) for key in fine}
        rows.append(
            asdict(case) | {"stiffness": case.stiffness, "value": rounded(fine, 9), "error": rounded(errors, 2)}
        )
        worst = max(errors[key] / max(abs(fine["force_x"]), abs(fine["force_z"])) for key in ("force_x", "fed"))
        words = f"{case.needle} {case.modulus / 1e3:g} kPa {1e3 * case.free:g} mm {'hub' if case.hub else 'guide'} "
        words += f"{1e3 * case.aside:g} mm {case.tilt:g} {'friction' if case.friction else ''}"
        forces = (f"{fine[key]:.4g}" for key in ("slope", "force_x", "force_z", "fed"))
        tip = f"{1e3 * fine['tip_x']:.4f}, {1e3 * fine['tip_z']:.4f}"
        table.add_row(words, *forces, f"{1e3 * fine['moment']:.4g}", tip, f"{worst:.1e}")
    console.print(table)
    if write:
        lines = ",\n".join(json.dumps(row) for row in rows)
        VALUES.write_text(f"[\n{lines}\n]\n", encoding="utf-8")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true")
    main(parser.parse_args().write)
