# SPDX-License-Identifier: Apache-2.0
"""
Which parameter matters
=======================

Four parameters of a model vary at once, over the ranges that specimens have. How much of the scatter of the force is
due to each? Sobol's indices, from 1536 simulated insertions, answer it: that of
the puncture force comes from the depth of the puncture and from the stiffness alone.
"""

import matplotlib.pyplot as plt

import needleforce as nf

question = {
    "study": {"method": "sensitivity", "samples": 256},
    "model": {"preset": "paper"},
    "factor": [
        {"name": "stiffness.reduced_modulus_kPa", "low": 90.0, "high": 150.0},
        {"name": "puncture.depth_mm", "low": 2.5, "high": 4.0},
        {"name": "friction.per_length_N_per_mm", "low": 0.012, "high": 0.025},
        {"name": "cutting.force_N", "low": 0.05, "high": 0.11},
    ],
    "output": [{"quantity": "puncture_force"}, {"quantity": "force_at_depth", "depth_mm": 10.0}],
    "motion": {"depth_mm": 12.0},
}
found = nf.study(question, jobs=1)
print(found)
found.plot()
plt.show()
