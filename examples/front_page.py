# SPDX-License-Identifier: Apache-2.0
"""The pictures of the README: an insertion with its events, a steered needle, two layers, and a solid.

python examples/front_page.py FOLDER    # writes front.svg, steering.svg, layers.svg and solid.svg
"""

import runpy
import sys
from pathlib import Path

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt
import numpy as np

import needleforce as nf

MEASURED, MODEL, MARK, folder = "#8a949e", "#c05000", "#20508c", Path(sys.argv[1])
plt.rcParams.update({"svg.hashsalt": "needleforce", "axes.spines.top": False, "axes.spines.right": False})
plt.rcParams["figure.constrained_layout.use"] = True


def save(figure: plt.Figure, name: str) -> None:
    """Writes a picture, the same bytes each time."""
    figure.savefig(folder / name, metadata={"Date": None}), print(f"wrote {folder / name}")


# an insertion, what was identified from it, and where contact and puncture are
recording = nf.read(Path(__file__).with_name("insertion.csv"))
fit = nf.identify(recording, needle="paper")
found, force = fit.parameters, fit.parameters.puncture_force.value
contact, puncture, slope = found.contact_depth, found.puncture_depth, found.friction_per_length
figure, axes = plt.subplots(figsize=(6.4, 3.6))
axes.plot(1e3 * recording.depth, recording.force, color=MEASURED, lw=2.6, label="measured")
axes.plot(1e3 * recording.depth, fit.predict(recording), color=MODEL, lw=1.2, label="identified")
axes.plot([1e3 * contact.value, 1e3 * puncture.value], [0.0, force], "o", color=MARK)
for text, at, place in (
    (f"contact at {1e3 * contact.value:.2f} mm", (1e3 * contact.value, 0.0), (-3.8, 0.13)),
    (f"puncture at {1e3 * puncture.value:.2f} mm, {force:.3f} N", (1e3 * puncture.value, force), (-3.8, 0.3)),
    (f"friction {slope.value:.1f} N/m\n({slope.low:.1f} to {slope.high:.1f})", (10.0, 0.27), (10.5, 0.08)),
    ("withdrawal", (9.0, -0.16), (10.5, -0.06)),
):
    axes.annotate(text, at, place, color=MARK, arrowprops={"arrowstyle": "-", "color": MARK, "lw": 0.8})
axes.set(xlabel="depth [mm]", ylabel="force [N]"), axes.legend(loc="lower left", frameon=False)
save(figure, "front.svg")

# a needle with a bevel, turned on its way
needle = nf.Needle(outer_diameter=0.7e-3, inner_diameter=0.0, length=0.2, young_modulus=50e9, poisson_ratio=0.3)
gel, depth = [nf.LateralLayer(modulus=30e3, tip_force=0.12)], np.linspace(-1e-3, 0.1, 102)
figure, axes = plt.subplots(figsize=(4.2, 3.0))
for name, turned_at in ("bevel not turned", np.inf), ("turned at 40 mm", 0.04), ("turned at 20 mm", 0.02):
    insertion = nf.FlexibleInsertion(nf.preset("paper"), needle, lateral=gel, guide_distance=0.02, bevel_length=2.6e-3)
    insertion.run(depth, dt=0.3, roll=np.pi * np.clip((depth - turned_at) / 2e-3, 0.0, 1.0))
    x, _, z = 1e3 * insertion.shape().T
    axes.plot(z, x, label=name)
axes.axvline(0.0, color=MEASURED, lw=0.8), axes.legend(loc="lower left", frameon=False)
axes.set(xlabel="along the insertion [mm]", ylabel="across [mm]"), save(figure, "steering.svg")

# two layers, a hold in which the tissue relaxes, and the withdrawal
run = nf.simulate(nf.preset("layered"), nf.Motion.insert(start=-2e-3, speed=3e-3, depth=25e-3, hold=3.0))
figure, axes = plt.subplots(figsize=(4.2, 3.0))
axes.plot(1e3 * run.depth, run.force, color=MODEL)
axes.axvline(1e3 * nf.preset("layered").deeper[0].top, color=MEASURED, ls="--", lw=0.8)
axes.set(xlabel="depth [mm]", ylabel="force [N]")
save(figure, "layers.svg")

# a needle in a solid, as the gallery draws it
runpy.run_path(str(Path(__file__).parent / "gallery" / "solid_field.py"))
plt.gcf().set_size_inches(4.2, 3.4), save(plt.gcf(), "solid.svg")
