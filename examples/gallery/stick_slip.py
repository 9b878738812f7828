# SPDX-License-Identifier: Apache-2.0
"""
Stick and slip of the cut
=========================

A slow needle loads the tissue in front of its tip until it tears a little further, again and again: a saw tooth on
the slope of the friction. At ten times the speed the tear cannot come to rest any more, and the cut runs smoothly.
"""

import matplotlib.pyplot as plt

import needleforce as nf

model = nf.preset("stick_slip")
figure, axes = plt.subplots(1, 2, sharey=True)
for panel, speed in zip(axes, (0.5e-3, 5e-3)):
    run = nf.simulate(model, nf.Motion.insert(0.0, speed, 12e-3, withdraw=False, acceleration=1.0))
    panel.plot(1e3 * run.depth, run.force, lw=1)
    panel.set(xlabel="depth [mm]", title=f"{1e3 * speed:g} mm/s")
axes[0].set_ylabel("force [N]")
plt.show()
