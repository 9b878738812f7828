# SPDX-License-Identifier: Apache-2.0
"""
The shape of the tip
====================

The same gel of 20 kPa under six tips on one shaft of 1 mm. A flat punch starts with its whole face, a sphere with a
point; the sharper the cone, the deeper it goes for the same force. The force follows from the profile by Sneddon's
integrals, so a profile that was measured on a needle serves as well as a named one.
"""

import matplotlib.pyplot as plt
import numpy as np

import needleforce as nf

tips = {
    "flat": nf.tips.Flat(0.5e-3),
    "sphere": nf.tips.Sphere(0.5e-3),
    "cone of 60°": nf.tips.Cone(np.radians(60.0)),
    "cone of 30°": nf.tips.Cone(np.radians(30.0)),
    "blunted cone": nf.tips.BluntedCone(np.radians(30.0), 0.2e-3, 0.1e-3),
    "ogive": nf.tips.TangentOgive(0.5e-3, 1.5e-3),
}
depth = np.linspace(1e-6, 0.8e-3, 200)
for name, tip in tips.items():
    shank = None if name in ("flat", "sphere") else 0.5e-3  # where the tip passes into the shaft
    found = nf.contact(tip, depth=depth, reduced_modulus=20e3, shank_radius=shank)
    plt.plot(1e3 * depth, 1e3 * found.force, label=name)
plt.xlabel("indentation [mm]")
plt.ylabel("force [mN]")
plt.legend()
plt.show()
