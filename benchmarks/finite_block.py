# SPDX-License-Identifier: Apache-2.0
"""Sneddon's contact on blocks of finite depth: force over that on a half-space, and the dimple around the tip.

python benchmarks/finite_block.py [--figure docs/figures/finite_block.svg]
"""

import argparse

import numpy as np
from rich.console import Console
from rich.table import Table

import needleforce as nf
from needleforce import fe

RADIUS = 1e-3  # of the contact [m]
TIP = nf.tips.Cone(half_angle=np.radians(70.0))
DEPTHS = np.array([1.5, 2.0, 3.0, 5.0, 10.0, 20.0, 40.0])  # of the block, in contact radii
WIDE = 40.0  # radius of the block, in contact radii
CASES = {
    "ν 0.3, base that holds": (0.3, "fixed"),
    "ν 0.49, base that holds": (0.49, "fixed"),
    "ν 0.49, smooth base": (0.49, "sliding"),
}
SHOWN = (3.0, 10.0, 40.0)


def pressed(ratio, base, depth):
    """The cone on a block, its contact one radius wide."""
    material = fe.Elastic(10e3, ratio)
    mesh = fe.axisymmetric_block(WIDE * RADIUS, depth * RADIUS, RADIUS / 20.0)
    tissue = fe.Tissue(mesh, material, symmetry="axisymmetric", supports={"bottom": base})
    return fe.press(tissue, TIP, 0.5 * np.pi * RADIUS / np.tan(TIP.half_angle), 4.0 * RADIUS)


def ratios():
    """Force over that on a half-space for the same indentation, by case and depth."""
    found = {}
    for name, (ratio, base) in CASES.items():
        contacts = [pressed(ratio, base, depth) for depth in DEPTHS]
        indentation, modulus = contacts[0].depth[0], 10e3 / (1.0 - ratio**2)
        half_space = float(nf.contact(TIP, depth=indentation, reduced_modulus=modulus).force)
        found[name] = np.array([each.force[0] / half_space for each in contacts])
    return found


def dimple(radius, indentation):
    """Sneddon (1948): the surface around a cone, for radii from the contact's on [m]."""
    share = RADIUS / radius
    slope = indentation / (0.5 * np.pi * RADIUS)
    return slope * RADIUS * (np.arcsin(share) + np.sqrt(1.0 / share**2 - 1.0) - 1.0 / share)


def figure(found, path):
    """Force by depth of the block, and the surface around the tip."""
    import matplotlib

    matplotlib.use("svg")
    import matplotlib.pyplot as plt

    drawing, (left, right) = plt.subplots(1, 2, figsize=(9.6, 4.0))
    for name, values in found.items():
        left.plot(DEPTHS, values, "o-", markersize=3, label=name)
    left.axhline(1.0, color="k", linestyle="--", linewidth=1, label="half-space (Sneddon)")
    left.set(
        xscale="log", yscale="log", xlabel="depth of the block [contact radii]", ylabel="force over half-space [1]"
    )
    left.set_xticks(DEPTHS, [f"{each:g}" for each in DEPTHS])
    left.set_yticks([1, 1.5, 2, 3], ["1", "1.5", "2", "3"])
    left.minorticks_off()
    left.legend(fontsize=8)
    for depth in SHOWN:
        contact = pressed(0.49, "fixed", depth)
        right.plot(contact.radius / RADIUS, contact.dimple[0] / contact.depth[0], label=f"{depth:g} contact radii deep")
    radius = np.linspace(1.0, 4.0, 200)
    exact = dimple(radius * RADIUS, contact.depth[0]) / contact.depth[0]
    right.plot(radius, exact, "k--", linewidth=1, label="half-space (Sneddon)")
    right.axhline(0.0, color="0.7", linewidth=0.7)
    right.set(xlabel="distance from the axis [contact radii]", ylabel="surface pressed down [indentations]")
    right.invert_yaxis()
    right.legend(fontsize=8, title="ν 0.49, base that holds", title_fontsize=8)
    drawing.tight_layout()
    drawing.savefig(path, metadata={"Date": None})


def main(path):
    console = Console(width=110)
    with console.status("finite elements"):
        found = ratios()
    table = Table(
        "depth of the block [contact radii]", *(f"{each:g}" for each in DEPTHS), title="force over half-space"
    )
    for name, values in found.items():
        table.add_row(name, *(f"{value:.2f}" for value in values))
    console.print(table)
    if path:
        figure(found, path)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--figure", help="SVG or PNG to write")
    main(parser.parse_args().figure)
