# SPDX-License-Identifier: Apache-2.0
"""
The paper's experiment on a virtual rig
=======================================

A rig with a stage, a sensor and two computers, simulated with its noise and its clocks: two insertions at one site,
the second through the hole of the first. What the second lacks is the force of cutting. The truth is known, so that a
procedure can be tried before a gel is poured.
"""

from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt

import needleforce as nf
from needleforce.rig import paper_experiment

folder = Path(mkdtemp())
paper_experiment(seed=1, speeds=[3e-3]).write(folder)
for number, name in ((1, "first: cuts"), (2, "second: same hole")):
    run = nf.read(sorted(folder.glob(f"*site1_pass{number}_force.csv"))[0])
    plt.plot(1e3 * run.depth, run.force, lw=1, label=name)
plt.xlabel("depth [mm]")
plt.ylabel("force [N]")
plt.legend()
plt.show()
