# SPDX-License-Identifier: Apache-2.0
"""
Friction that grows with the speed
==================================

Karnopp's law adds to dry friction a viscous part, with values of its own for both directions. The same insertion at
three speeds: the dent does not know the speed, the shaft does.
"""

import matplotlib.pyplot as plt

import needleforce as nf

friction = nf.laws.Karnopp(
    coulomb_in=15.0, coulomb_out=-12.0, viscous_in=150.0, viscous_out=80.0, static_in=18.0, static_out=-14.0,
    static_band=1e-4, presliding=2e-5,
)  # fmt: skip
model = nf.preset("paper").replace(friction=friction)
for speed in (1e-3, 20e-3, 60e-3):
    run = nf.simulate(model, nf.Motion.insert(-1e-3, speed, 12e-3, acceleration=20.0), min(1e6 * speed, 5000.0))
    plt.plot(1e3 * run.depth, run.force, label=f"{1e3 * speed:g} mm/s")
plt.axhline(0.0, color="0.6", lw=0.8)
plt.xlabel("depth [mm]")
plt.ylabel("force [N]")
plt.legend()
plt.show()
