# SPDX-License-Identifier: Apache-2.0
"""
What the tissue does around a needle
====================================

Skin on fat with a stiff inclusion, as a solid of finite elements. A needle at 30 mm rubs with 0.6 N along its shaft
and presses with 0.2 N at its tip; the colours are how far the tissue is dragged along. The inclusion
moves as one piece.
"""

import matplotlib.pyplot as plt
import numpy as np

from needleforce import fe

radius, length = 0.35e-3, 30e-3
mesh = fe.axisymmetric_block(25e-3, 50e-3, radius, needle_depth=length, layers=[("skin", 2e-3), ("fat", 1.0)])
mesh = mesh.labelled("inclusion", lambda p: np.hypot(p[:, 0] - 6e-3, p[:, 1] - 22e-3) < 4e-3)
materials = {"skin": fe.Elastic(80e3, 0.49), "fat": fe.Elastic(20e3, 0.49), "inclusion": fe.Elastic(200e3, 0.49)}
tissue = fe.Tissue(mesh, materials, symmetry="axisymmetric", supports={"bottom": "fixed", "sides": "fixed"})
path = fe.NeedlePath(length, 1e-3, radius)
nodes = path.loads(tissue)
forces = np.full(nodes.shape[1], 0.6 / nodes.shape[1])
forces[-1] += 0.2
moved = tissue.displacement(tissue.solve(nodes @ forces), mesh.points)
r, z = 1e3 * mesh.points.T
plt.figure(figsize=(4.6, 4.8))
shown = plt.tricontourf(r, z, 1e3 * moved[:, 1], levels=np.linspace(0.0, 1.0, 11), extend="both")
plt.plot([1e3 * radius] * 2, [0.0, 30.0], "k", lw=2)
plt.gca().add_patch(plt.Circle((6.0, 22.0), 4.0, fill=False, color="w"))
plt.gca().set(xlabel="distance from the needle [mm]", ylabel="depth [mm]", ylim=(50.0, 0.0), aspect="equal")
plt.grid(False)
plt.colorbar(shown, label="dragged along [mm]")
plt.show()
