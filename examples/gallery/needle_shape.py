# SPDX-License-Identifier: Apache-2.0
"""
The shape of a needle that bends
================================

A thin needle with a bevel cuts to one side, and bends. Turned by half a turn at 40 mm it comes back in an S; when the
base is moved aside instead, the shaft presses on the gel and the tip goes the other way. On the right is the moment
that a sensor at the guide would show.
"""

import matplotlib.pyplot as plt
import numpy as np

import needleforce as nf

needle = nf.Needle(outer_diameter=0.7e-3, inner_diameter=0.0, length=0.2, young_modulus=50e9, poisson_ratio=0.3)
gel = [nf.LateralLayer(modulus=30e3, tip_force=0.12)]
depth = np.linspace(-1e-3, 0.1, 102)
motions = {
    "bevel as it was": {},
    "bevel turned at 40 mm": {"roll": np.pi * np.clip((depth - 0.04) / 2e-3, 0.0, 1.0)},
    "base moved aside": {"lateral": np.column_stack([-0.05 * np.maximum(depth, 0.0), 0.0 * depth])},
}
figure, (shape, moment) = plt.subplots(1, 2, figsize=(6.0, 3.6))
for name, motion in motions.items():
    insertion = nf.FlexibleInsertion(nf.preset("paper"), needle, lateral=gel, guide_distance=0.02, bevel_length=2.6e-3)
    rows = insertion.run(depth, dt=0.3, **motion)
    assert np.all(rows["status"] == 0)
    x, _, z = 1e3 * insertion.shape().T
    shape.plot(x, z, label=name)
    moment.plot(1e3 * depth, 1e3 * rows["wrench"][:, 4], label=name)
    print(f"{name}: tip {1e3 * rows['tip'][-1, 0]:+.2f} mm aside, axial force {rows['force'][-1]:.2f} N")
shape.axhline(0.0, color="gray", lw=0.8)
shape.set(xlabel="across [mm]", ylabel="along [mm]"), shape.invert_yaxis()
moment.set(xlabel="depth [mm]", ylabel="moment at the guide [N mm]")
figure.legend(*moment.get_legend_handles_labels(), loc="outside upper center", ncols=2)
plt.show()
