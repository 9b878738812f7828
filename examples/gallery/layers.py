# SPDX-License-Identifier: Apache-2.0
"""
A stack of layers
=================

Skin on fat on muscle: each layer is dented, ruptures at its own load and then adds its friction, so that the force is
a saw on a slope. Where the tip is decides which layer cuts; where the shaft is decides which ones rub.
"""

import matplotlib.pyplot as plt

import needleforce as nf

laws = nf.laws
skin = nf.Model(laws.Cone(250e3, 0.26), laws.PunctureDepth(2e-3), laws.Coulomb(40.0), laws.ConstantCutting(0.15))
fat = nf.Layer(3e-3, laws.Cone(20e3, 0.26), laws.PunctureDepth(2e-3), laws.Coulomb(6.0), laws.ConstantCutting(0.03))
muscle = nf.Layer(9e-3, laws.Cone(90e3, 0.26), laws.PunctureDepth(3e-3), laws.Coulomb(15.0), laws.ConstantCutting(0.08))
run = nf.simulate(skin.replace(deeper=(fat, muscle)), nf.Motion.insert(-2e-3, 3e-3, 16e-3))
for top, end, name, colour in ((0, 3, "skin", "#e8c9b0"), (3, 9, "fat", "#f4e8b8"), (9, 16, "muscle", "#e3b3ae")):
    plt.axvspan(top, end, color=colour, alpha=0.5, lw=0)
    plt.text(top + 0.2, -0.27, name)
plt.plot(1e3 * run.depth, run.force, color="#222222")
plt.xlabel("depth [mm]")
plt.ylabel("force [N]")
plt.show()
