# SPDX-License-Identifier: Apache-2.0
"""Largest error of the table of ``tip_contact`` over tips of all sizes; ``--write``: into docs/evidence/tips.md."""

import argparse
import math
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import needleforce as nf

PAGE = Path(__file__).resolve().parents[1] / "docs" / "evidence" / "tips.md"
SHANKS = (50e-6, 0.35e-3, 1.5e-3)  # radius [m]
ANGLES = np.radians([3, 15, 60])  # half angle
SHARES = (1e-3, 0.02, 20 / 350, 0.2, 0.5, 0.9, 0.99)  # of the shank's radius
TABLE = re.compile(r"<!-- tips: .*? -->\n.*?<!-- end -->", re.DOTALL)


def shapes(shank: float) -> Iterator[tuple[str, object]]:
    """Tips for a shank of a radius [m], with the row that they belong to."""
    tips = nf.tips
    for angle in ANGLES:
        yield "cone, paraboloid, flat, bevel", tips.Cone(angle)
        yield "cone, paraboloid, flat, bevel", tips.LancetBevel(angle, tips.equivalences[0])
        for share in SHARES:
            yield "truncated cone", tips.TruncatedCone(angle, share * shank)
            yield "blunted cone", tips.BluntedCone(angle, share * shank, 0.0)
            yield "blunted cone", tips.BluntedCone(angle, share * shank, 0.5 * share * shank)
    yield "cone, paraboloid, flat, bevel", tips.Paraboloid(shank)
    yield "cone, paraboloid, flat, bevel", tips.Flat(shank)
    for size in (1.0, 1.01, 1.1, 1.3, 1.5, 2.0, 4.0):
        yield "sphere, ogive", tips.Sphere(size * shank)
        for length in (1.0, 2.0, 3.0, 8.0):
            yield "sphere, ogive", tips.TangentOgive(size * shank, length * size * shank)
    for power in np.geomspace(1.1, 12.0, 25):
        yield "powers 1.1 to 30", tips.PowerProfile(power, shank, 3.0 * shank)
    rng = np.random.default_rng(1)
    for knots in (7, 32):
        for _ in range(10):
            radius = np.r_[0.0, np.sort(rng.uniform(0.02, 0.98, knots - 2)), 1.0] * shank
            slope = np.sort(rng.uniform(0.0, 5.0, knots - 1))
            yield (
                f"convex profile of {knots} knots",
                tips.Profile(radius, np.r_[0.0, np.cumsum(slope * np.diff(radius))]),
            )


def errors(tip, shank: float, n: int = 600) -> tuple[float, float, float]:
    """Largest error as a share of the force at saturation; relative error from 1e-2 and 1e-4 of that depth on."""
    flat = isinstance(tip, nf.tips.Flat)  # all of it touches at once
    end = shank if flat else float(nf.contact(tip, contact_radius=(1 - 1e-9) * shank, reduced_modulus=1.0).depth)
    depth = np.unique(np.r_[np.geomspace(1e-5, 1.0, n), np.linspace(0.0, 1.0, n)[1:]]) * end
    force = nf.contact(tip, depth=depth, reduced_modulus=1.0, shank_radius=shank).force
    law = nf.laws.TipContact(1.0, shank, tip)
    miss = np.abs(np.array([law.force(float(h)) for h in depth]) - force)
    relative = np.divide(miss, force, out=np.zeros_like(miss), where=force > 0)
    return (miss.max() / force.max(), *(relative[depth > share * depth.max()].max() for share in (1e-2, 1e-4)))


def rows() -> dict[str, list[float]]:
    """The largest errors of each row."""
    found: dict[str, list[float]] = {}
    for shank in SHANKS:
        for name, tip in shapes(shank):
            here = errors(tip, shank)
            found[name] = [max(pair) for pair in zip(here, found.get(name, (0.0, 0.0, 0.0)), strict=True)]
    return found


def rounded_up(x: float) -> str:
    """The next of 1, 2 and 5 times a power of ten."""
    exponent = math.floor(math.log10(x))
    return f"{next(step for step in (1, 2, 5, 10) if x <= step * 10.0**exponent) * 10.0**exponent:.0e}"


def table(found: dict[str, list[float]]) -> str:
    """The rows as a table of the page."""
    head = (
        "| tip | error / force at saturation | relative error, h > 1e-2 | relative error, h > 1e-4 |\n|---|---|---|---|"
    )
    lines = [f"| {name} | " + " | ".join(map(rounded_up, values)) + " |" for name, values in found.items()]
    return "\n".join([head, *lines])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help="put the table into the page")
    options = parser.parse_args()
    text = table(rows())
    print(text)
    if options.write:
        block = f"<!-- tips: python benchmarks/tip_table.py --write -->\n{text}\n<!-- end -->"
        PAGE.write_text(TABLE.sub(lambda _: block, PAGE.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
