# SPDX-License-Identifier: Apache-2.0
"""
What a filter does to a puncture
================================

Amplifiers filter. A low-pass of 5 Hz makes a rounded corner of a puncture at 10 mm/s, lower and later than it was,
and the friction's reversal a slope. Who knows the corner frequency can state it when reading; a fit then allows for
it.
"""

import matplotlib.pyplot as plt
from scipy.signal import butter, lfilter

import needleforce as nf

run = nf.simulate(nf.preset("paper"), nf.Motion.insert(-4e-3, 10e-3, 12e-3, acceleration=0.5), 1000.0)
figure, (whole, near) = plt.subplots(1, 2)
for corner, colour in ((None, "#222222"), (20.0, "#0072b2"), (5.0, "#c64f00")):
    force = run.force if corner is None else lfilter(*butter(2, corner, fs=1000.0), run.force)
    for axes in (whole, near):
        axes.plot(1e3 * run.depth, force, color=colour, lw=1.2, label=f"{corner:g} Hz" if corner else "no filter")
near.set(xlim=(2.5, 5.5), ylim=(0.1, 0.24), xlabel="depth [mm]", title="at the puncture")
whole.set(xlabel="depth [mm]", ylabel="force [N]")
whole.legend()
plt.show()
