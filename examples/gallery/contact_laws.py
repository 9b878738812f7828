# SPDX-License-Identifier: Apache-2.0
"""
Contact laws side by side
=========================

Before the surface ruptures, the needle only dents it. How the force grows with that dent is the contact law: a cone
grows with the square of the depth, a cone that passes into a cylinder less from its radius on, and laws fitted to
measured organs have their own exponents. Each curve is the law with the values of a published preset.
"""

import matplotlib.pyplot as plt
import numpy as np

import needleforce as nf

depth = np.linspace(0.0, 4e-3, 200)
for name in ("paper", "physical", "power_law", "maurin", "okamura_liver"):
    law = nf.preset(name).stiffness
    plt.plot(1e3 * depth, [law.force(h) for h in depth], label=law.name.replace("_", " "))
plt.xlabel("indentation [mm]")
plt.ylabel("force [N]")
plt.legend(title="contact law")
plt.show()
