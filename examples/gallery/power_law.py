# SPDX-License-Identifier: Apache-2.0
"""
The exponent of a contact
=========================

How fast the force of the dent grows is a property of tip and tissue: 1.5 under a sphere, 2 under a cone, other values
in organs. On doubly logarithmic axes the exponent is the slope; the fit finds it together with the place of the
surface.
"""

import matplotlib.pyplot as plt
import numpy as np

import needleforce as nf

random = np.random.default_rng(4)
law = nf.laws.PowerLaw(reference_force=0.2, exponent=1.6, reference_depth=3e-3)
model = nf.preset("paper").replace(stiffness=law)
run = nf.simulate(model, nf.Motion.insert(-4e-3, 3e-3, 8e-3), 200.0)
recording = nf.Recording(run.time, run.depth, run.velocity, run.force + random.normal(0.0, 2e-3, len(run)))
fit = nf.identify(recording, model="power_law")
found, loading = fit.parameters.exponent, (recording.depth > 2e-4) & (recording.time < 2.2)
depth = np.geomspace(2e-4, 3e-3, 100)
plt.loglog(1e3 * recording.depth[loading], np.maximum(recording.force[loading], 1e-4), ".", color="0.6", ms=3)
label = f"exponent {found.value:.3f} ({found.low:.3f} to {found.high:.3f})"
plt.loglog(1e3 * depth, [fit.model.stiffness.force(h) for h in depth], color="#c64f00", label=label)
plt.ylim(2e-3, 0.4)
plt.xticks([0.2, 0.5, 1, 2, 3], ["0.2", "0.5", "1", "2", "3"])
plt.minorticks_off()
plt.xlabel("indentation [mm]")
plt.ylabel("force [N]")
plt.legend()
plt.show()
