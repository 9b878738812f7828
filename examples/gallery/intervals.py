# SPDX-License-Identifier: Apache-2.0
"""
What an interval holds
======================

Forty recordings of one needle in one gel, each with noise of its own, each identified by itself. A 95 % interval of
the friction should, in the long run, hold the true value in nineteen of twenty. Those that miss it are orange.
"""

import matplotlib.pyplot as plt
import numpy as np

import needleforce as nf

model, random, held = nf.preset("paper"), np.random.default_rng(2), 0
clean = nf.simulate(model, nf.Motion.insert(-4e-3, 3e-3, 10e-3), 100.0)
for k in range(40):
    force = clean.force + random.normal(0.0, 8e-3, len(clean))
    noisy = nf.Recording(clean.time, clean.depth, clean.velocity, force)
    found = nf.identify(noisy, model="paper", needle=model.needle).parameters.friction_per_length
    holds = found.low <= model.friction.per_length <= found.high
    held += holds
    plt.plot([k, k], [found.low, found.high], color="#0072b2" if holds else "#c64f00", lw=2)
    plt.plot(k, found.value, "o", ms=4, color="#0072b2" if holds else "#c64f00")
plt.axhline(model.friction.per_length, color="0.4", lw=1, label=f"true: in {held} of 40 intervals")
plt.xlabel("recording")
plt.ylabel("friction per length [N/m]")
plt.legend()
plt.show()
