# SPDX-License-Identifier: Apache-2.0
"""A needle in a layered solid with a stiff inclusion: from a labelled mesh to the force in a loop at 1 kHz.

python examples/solid.py    # writes solid.svg; needs the extra fe
"""

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt
import numpy as np

import needleforce as nf
from needleforce import fe

RADIUS, LENGTH = 0.35e-3, 40e-3

# a cup of 50 mm with skin on fat, and a stiff ring around the needle's line
mesh = fe.axisymmetric_block(25e-3, 50e-3, RADIUS, needle_depth=LENGTH, layers=[("skin", 2e-3), ("fat", 1.0)])
mesh = mesh.labelled("tumour", lambda p: np.hypot(p[:, 0] - 6e-3, p[:, 1] - 22e-3) < 4e-3)
materials = {"skin": fe.Elastic(80e3, 0.49), "fat": fe.Elastic(20e3, 0.49), "tumour": fe.Elastic(200e3, 0.49)}
held = {"bottom": "fixed", "sides": "fixed"}
tissue = fe.Tissue(mesh, materials, symmetry="axisymmetric", supports=held)

# all that the loop needs of it
path = fe.NeedlePath(LENGTH, 1e-3, RADIUS)
condensed = tissue.condense(path)
print(f"{tissue.unknowns} unknowns condensed to {len(condensed.compliance)} nodes")

model = nf.Model(
    nf.laws.Polynomial(linear=150.0, quadratic=0.0),
    nf.laws.PunctureForce(force=0.4),
    nf.laws.Coulomb(per_length=25.0),
    nf.laws.ConstantCutting(force=0.1),
)
solid, axial = fe.CondensedInsertion(condensed, model), nf.Insertion(model)
depth = np.concatenate([np.arange(-1e-3, 30e-3, 5e-6), np.arange(30e-3, 26e-3, -5e-6), np.arange(26e-3, 35e-3, 5e-6)])
forces = np.array([(solid.step(z, None, 1e-3).force, axial.step(z, None, 1e-3).force) for z in depth])
print(f"force at {1e3 * depth[-1]:.0f} mm: {forces[-1, 0]:.2f} N in the solid, {forces[-1, 1]:.2f} N by the axial law")
print(
    f"the tip is {1e3 * solid.tip:.1f} mm along its path; the surface is drawn in {1e3 * solid.displacement[0]:.1f} mm"
)

# the whole field at the end, from the forces at the nodes of the path
solution = tissue.solve(path.loads(tissue) @ solid.node_force)
moved = tissue.displacement(solution, mesh.points)

figure, (left, right) = plt.subplots(1, 2, figsize=(9.6, 4.4), width_ratios=(1.0, 1.3))
shown = left.tricontourf(1e3 * mesh.points[:, 0], 1e3 * mesh.points[:, 1], 1e3 * moved[:, 1], levels=12)
left.plot([1e3 * RADIUS] * 2, [0.0, 1e3 * solid.tip], "k", linewidth=2, label="shaft")
left.add_patch(plt.Circle((6.0, 22.0), 4.0, fill=False, color="w"))
left.axhline(2.0, color="w", linewidth=0.7)
left.set(
    xlabel="distance from the needle [mm]", ylabel="depth [mm]", xlim=(0.0, 25.0), ylim=(50.0, 0.0), aspect="equal"
)
figure.colorbar(shown, ax=left, label="tissue dragged inwards [mm]")
right.plot(1e3 * depth, forces[:, 0], label="solid")
right.plot(1e3 * depth, forces[:, 1], linewidth=1, label="axial law alone")
right.set(xlabel="depth [mm]", ylabel="force [N]")
right.legend()
figure.tight_layout()
figure.savefig("solid.svg")
print("wrote solid.svg")
