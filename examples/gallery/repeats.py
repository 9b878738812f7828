# SPDX-License-Identifier: Apache-2.0
"""
Repeats that differ
===================

Five insertions into five places of a gel: stiffness, puncture and friction vary from place to place by a tenth, more
than any sensor's noise. The fit of all has the mean of the places, and the interval of that mean.
"""

import matplotlib.pyplot as plt
import numpy as np

import needleforce as nf

paper, random = nf.preset("paper"), np.random.default_rng(2)
places = []
for _ in range(5):
    one, two, three = random.normal(1.0, 0.1, 3)
    place = paper.replace(
        stiffness=nf.laws.Cone(one * 118e3, np.radians(15.0)),
        puncture=nf.laws.PunctureDepth(two * 3.2e-3),
        friction=nf.laws.Coulomb(three * 18.6),
    )
    run = nf.simulate(place, nf.Motion.insert(-3e-3, 3e-3, 10e-3), 100.0)
    noise = random.normal(0.0, 3e-3, len(run))
    places.append(nf.Recording(run.time, run.depth, run.velocity, run.force + noise))
fit = nf.identify(places, needle=paper.needle)
print(fit.parameters.friction_per_length)
fit.plot()
plt.show()
