# SPDX-License-Identifier: Apache-2.0
"""
A solid in a control loop
=========================

The solid of finite elements is condensed to a table along the needle's path, which a control loop steps in a few
microseconds. In the solid the tissue goes along before the shaft slips at a reversal, as in recordings; the same laws
without the solid reverse at once.
"""

import matplotlib.pyplot as plt
import numpy as np

import needleforce as nf
from needleforce import fe

mesh = fe.axisymmetric_block(25e-3, 50e-3, 0.35e-3, needle_depth=30e-3, layers=[("gel", 1.0)])
held = {"bottom": "fixed", "sides": "fixed"}
tissue = fe.Tissue(mesh, {"gel": fe.Elastic(20e3, 0.49)}, symmetry="axisymmetric", supports=held)
condensed = tissue.condense(fe.NeedlePath(30e-3, 1e-3, 0.35e-3))
laws = nf.laws
model = nf.Model(laws.Polynomial(150.0, 0.0), laws.PunctureForce(0.4), laws.Coulomb(25.0), laws.ConstantCutting(0.1))
depth = np.concatenate(
    [np.arange(a, b, np.copysign(2e-5, b - a)) for a, b in ((-1e-3, 0.025), (0.025, 0.018), (0.018, 0.028))]
)
for name, engine in (("in the solid", fe.CondensedInsertion(condensed, model)), ("laws alone", nf.Insertion(model))):
    force = [engine.step(z, None, 1e-3).force for z in depth]
    plt.plot(1e3 * depth, force, label=name)
plt.xlabel("depth [mm]")
plt.ylabel("force [N]")
plt.legend()
plt.show()
