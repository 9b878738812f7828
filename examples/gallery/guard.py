# SPDX-License-Identifier: Apache-2.0
"""
A guard between model and device
================================

A haptic device renders twice the tissue's force. Between both stands a guard: no more than 0.5 N, no more energy than
the user put in. When the sensor fails, the force is held for 5 ms and falls to zero in 10 ms, instead of staying for
ever.
"""

import matplotlib.pyplot as plt
import numpy as np

import needleforce as nf
from needleforce.control import Guard

limits = {"max_force": 0.5, "stale_after": 5e-3, "fall_time": 10e-3, "longest_cycle": 1.5e-3}
guard = Guard(
    nf.Insertion(nf.preset("paper")), force_scale=2.0, max_speed=0.3, max_acceleration=20.0, delay=1, **limits
)
dt, cycles = 1e-3, 700
outputs = [guard.step(20e-6 * (cycle - 1), None, dt) for cycle in range(cycles)]  # 20 mm/s, measured a cycle late
outputs += [guard.miss(dt) for _ in range(40)]
time = dt * np.arange(len(outputs))
plain = nf.Insertion(nf.preset("paper")).run(20e-6 * np.arange(cycles), None, np.full(cycles, dt))["force"]
plt.plot(time[:cycles], 2.0 * plain, color="0.6", label="twice the tissue's force")
plt.plot(time, [output.force for output in outputs], color="#c64f00", label="rendered")
plt.axhline(0.5, color="0.4", lw=0.8, ls="--")
plt.axvline(dt * cycles, color="0.8", lw=0.8)
plt.annotate("sensor fails", (dt * cycles, 0.05), (-70, 0), textcoords="offset points")
plt.xlabel("time [s]")
plt.ylabel("force [N]")
plt.legend()
plt.show()
