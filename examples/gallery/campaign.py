# SPDX-License-Identifier: Apache-2.0
"""
A campaign at a glance
======================

A folder of recordings in three gels, four repeats each, identified with one call. The names of the files state what
belongs together. Grey are the single recordings, orange is their mean with its 95 % interval.
"""

from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt
import numpy as np

import needleforce as nf
from needleforce.campaign import campaign

folder, random = Path(mkdtemp()), np.random.default_rng(2)
for gel, friction in (("gel A", 12.0), ("gel B", 18.0), ("gel C", 27.0)):
    for repeat in range(4):
        law = nf.laws.Coulomb(friction * random.normal(1.0, 0.05))
        run = nf.simulate(nf.preset("paper").replace(friction=law), nf.Motion.insert(-4e-3, 3e-3, 10e-3), 100.0)
        force = run.force + random.normal(0.0, 3e-3, len(run))
        nf.write(nf.Recording(run.time, run.depth, run.velocity, force), folder / f"{gel}_{repeat}.csv")
done = campaign(folder, pattern="{gel}_{repeat}", jobs=1)
for k, condition in enumerate(done.conditions):
    values = [one.parameters["friction_per_length"].value for one in condition.recordings]
    plt.plot(np.full(len(values), k - 0.1), values, "o", color="0.6", ms=4)
    found = condition.parameters["friction_per_length"]
    plt.plot([k + 0.1] * 3, [found.low, found.value, found.high], "o-", color="#c64f00", markevery=[1])
plt.xticks(range(len(done.conditions)), [each.fields["gel"] for each in done.conditions])
plt.ylabel("friction per length [N/m]")
plt.show()
