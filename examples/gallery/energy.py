# SPDX-License-Identifier: Apache-2.0
"""
Where the work goes
===================

The work of an insertion and a withdrawal, by what took it: the dent that is lost at the puncture, the cut, and
friction in both directions. Over the depth, friction grows with its square and soon takes most; nothing is returned.
"""

import matplotlib.pyplot as plt
import numpy as np

import needleforce as nf

model = nf.preset("paper")
depth = np.linspace(4e-3, 20e-3, 30)
parts = ("stiffness", "cutting", "friction_in", "friction_out")
work = np.array([[1e3 * nf.cycle_work(model, z)[part] for part in parts] for z in depth])
plt.stackplot(1e3 * depth, work.T, labels=["dent", "cut", "friction in", "friction out"], alpha=0.8)
plt.xlabel("deepest point [mm]")
plt.ylabel("work [mJ]")
plt.legend(loc="upper left")
plt.show()
