# SPDX-License-Identifier: Apache-2.0
"""
A modulus from a strip of gel
=============================

A strip that is pulled gives the modulus of the tissue without a needle. Seven laws are fitted to the same curve and
weighed by how well they describe it; the initial slope is Young's modulus, and its interval has the choice of the law.
"""

import matplotlib.pyplot as plt
import numpy as np

from needleforce.bench_tests import StressCurve, fit_stress, nominal_stress

random, stretch = np.random.default_rng(6), np.linspace(1.0, 1.4, 60)
stress = nominal_stress("yeoh", stretch, [19e3, 1500.0, 200.0], "uniaxial")
curve = StressCurve(stretch, stress + random.normal(0.0, 150.0, len(stretch)))
fit = fit_stress(curve)
print(fit)
fit.plot()
plt.show()
