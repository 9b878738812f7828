# SPDX-License-Identifier: Apache-2.0
"""
Relaxation in a hold
====================

Tissue under load relaxes while the needle stands still. Of the elastic force 30 % is lost with a time constant of
0.7 s and 20 % with one of 8 s; half of it stays, and a new push starts from there. Without relaxation all would stay.
"""

import matplotlib.pyplot as plt

import needleforce as nf

motion = nf.Motion(-1e-3, ((2.5e-3, 3e-3), (2.5e-3, 15.0), (3e-3, 1e-3), (3e-3, 15.0)))
relaxing = nf.laws.Prony(share_1=0.3, time_1=0.7, share_2=0.2, time_2=8.0)
for name, relaxation in (("relaxes", relaxing), ("does not", nf.laws.NoRelaxation())):
    run = nf.simulate(nf.preset("paper").replace(relaxation=relaxation), motion, 200.0)
    plt.plot(run.time, run.force, label=name)
plt.xlabel("time [s]")
plt.ylabel("force [N]")
plt.legend(title="contact")
plt.show()
