# SPDX-License-Identifier: Apache-2.0
"""
What more recordings do not narrow
==================================

Part of an interval comes from noise and from the scatter between places, and shrinks with repeats. The other part is
what the law gets wrong, and stays. Here the shaft's friction bends with the depth while a straight law is fitted:
with more repeats the interval approaches its systematic part, the thick bar, and not zero.
"""

import matplotlib.pyplot as plt
import numpy as np

import needleforce as nf

random, model = np.random.default_rng(5), nf.preset("hyperbolic_foundation")
places, counts = [], (2, 4, 8, 16)
for _ in range(max(counts)):
    slope = model.friction.per_length * random.normal(1.0, 0.15)
    place = model.replace(friction=model.friction.replace(per_length=slope))
    run = nf.simulate(place, nf.Motion.insert(-4e-3, 3e-3, 12e-3), 100.0)
    places.append(nf.Recording(run.time, run.depth, run.velocity, run.force + random.normal(0.0, 5e-3, len(run))))
for k, count in enumerate(counts):
    found = nf.identify(places[:count], model="paper").parameters.friction_per_length
    below, above = found.systematic
    plt.plot([k, k], [found.low, found.high], color="#0072b2", lw=1.5)
    plt.plot(
        [k, k], [found.value - below, found.value + above], color="#c64f00", lw=8, alpha=0.5, solid_capstyle="butt"
    )
    plt.plot(k, found.value, "ko", ms=4)
plt.xticks(range(len(counts)), counts)
plt.xlabel("repeats")
plt.ylabel("friction per length [N/m]")
plt.show()
