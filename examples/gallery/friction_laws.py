# SPDX-License-Identifier: Apache-2.0
"""
Friction along the shaft
========================

Once the needle is in, tissue rubs along its shaft: in, half-way back, in again, out. With Coulomb's law the force is
proportional to the embedded length. Where the tissue is a foundation that yields or stiffens, its pressure on the
shaft, and so the friction, bends with the depth. Below zero the needle is pulled out.
"""

import matplotlib.pyplot as plt

import needleforce as nf

motion = nf.Motion(0.0, ((16e-3, 3e-3), (8e-3, 3e-3), (16e-3, 3e-3), (0.0, 3e-3)))
for name in ("paper", "cubic_foundation", "hyperbolic_foundation", "tanh_foundation"):
    model = nf.preset(name).replace(cutting=nf.laws.NoCutting())
    run = nf.simulate(model, motion)
    plt.plot(1e3 * run.depth, run.force, label=model.friction.name.replace("_", " "))
plt.axhline(0.0, color="0.6", lw=0.8)
plt.xlabel("depth [mm]")
plt.ylabel("force [N]")
plt.legend(title="friction law")
plt.show()
