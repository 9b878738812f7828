# SPDX-License-Identifier: Apache-2.0
"""
Steered to a target
===================

A needle of 1.3 mm bends in gel when its base is moved aside. Which motion brings its tip to a target 4 mm off its
axis and 80 mm deep? The plan moves the base in steps of 5 mm, within its limits, and predicts the tip with the region
in which it ends up in 19 of 20 insertions.
"""

import matplotlib.pyplot as plt

import needleforce as nf

needle = nf.Needle(outer_diameter=1.27e-3, inner_diameter=0.0, length=0.3, young_modulus=162e9, poisson_ratio=0.3)
gel = [nf.LateralLayer(modulus=15e3)]
flex = nf.FlexibleInsertion(nf.preset("paper"), needle, lateral=gel, guide_distance=0.02)
plan = nf.steering.plan(flex, (4e-3, 0.0, 80e-3))
print(plan.heading())
x, _, z = 1e3 * plan.path.T
figure, (path, base) = plt.subplots(2, 1, sharex=True, height_ratios=(2.0, 1.0))
path.fill_between(z, x - 1e3 * plan.tube(), x + 1e3 * plan.tube(), color="#c64f00", alpha=0.15, lw=0)
path.plot(z, x, color="#c64f00", label="path of the tip, with 95 %")
for k, shape in enumerate(plan.shapes):
    path.plot(1e3 * shape[:, 2], 1e3 * shape[:, 0], color="0.6", lw=1, zorder=0, label="" if k else "needle on its way")
path.plot(80.0, 4.0, "kx", label="target")
path.set(ylabel="across [mm]")
path.legend(loc="upper left")
base.step(1e3 * plan.motion.depth, 1e3 * plan.motion.lateral[:, 0], where="pre")
base.set(xlabel="depth [mm]", ylabel="base aside [mm]")
plt.show()
