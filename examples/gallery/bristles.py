# SPDX-License-Identifier: Apache-2.0
"""
Bristles before the shaft slips
===============================

LuGre's friction is that of bristles which bend before they slip. In strokes of a few micrometres the needle moves on
them as on a spring, with a thin loop: little work is lost. In long strokes they slip, and the force levels off.
"""

import matplotlib.pyplot as plt
import numpy as np

import needleforce as nf

model = nf.preset("lugre").replace(cutting=nf.laws.NoCutting())
dt = 1e-3
for amplitude in (5e-6, 20e-6, 80e-6):
    insertion = nf.Insertion(model)
    way = np.arange(-1e-3, 10e-3, 3e-6)
    insertion.run(way, None, np.full(len(way), dt))  # in first, at 3 mm/s
    depth = 10e-3 - amplitude * (1.0 - np.cos(2.0 * np.pi * np.arange(0.0, 3.0, dt)))
    force = insertion.run(depth, None, np.full(len(depth), dt))["force"]
    last = slice(-1000, None)
    plt.plot(1e6 * (depth[last] - 10e-3), force[last], label=f"{2e6 * amplitude:.0f} µm")
plt.xlabel("depth less 10 mm [µm]")
plt.ylabel("force [N]")
plt.legend(title="stroke")
plt.show()
