# SPDX-License-Identifier: Apache-2.0
"""A needle through two layers; the lower one is stiffer and must be punctured as well. Twin of layers.cpp."""

import needleforce as nf

paper = nf.preset("paper")
lower = nf.Layer(
    top=6e-3,
    stiffness=nf.laws.Cone(3e5, 0.2618),
    puncture=nf.laws.PunctureDepth(1e-3),
    friction=nf.laws.Coulomb(30.0),
    cutting=nf.laws.ConstantCutting(0.12),
)
model = paper.replace(deeper=(lower,), relaxation=nf.laws.Prony(share_1=0.3, time_1=0.7))
insertion = nf.Insertion(model)
dt, speed, deepest = 1e-3, 3e-3, 10e-3
stroke, hold = round(deepest / speed / dt), 5000
for cycle in range(2 * stroke + hold + 1):
    travelled = min(cycle, stroke) - max(0, cycle - stroke - hold)
    sample = insertion.step(speed * dt * travelled, None, dt)
    if sample.punctured:
        print(f"layer {insertion.pierced_layers} ruptures at {1e3 * sample.depth:.3f} mm")
    if cycle in (stroke, stroke + hold):
        print(f"{'before' if cycle == stroke else 'after'} the hold {sample.force:.4f} N")
print(f"after withdrawal {sample.force:.4f} N")
