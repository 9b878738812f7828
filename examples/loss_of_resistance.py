# SPDX-License-Identifier: Apache-2.0
"""The loss of resistance behind a ligament, as an anaesthetist feels it at the epidural space: skin, fat, a stiff
ligament, then hardly a force. A signal from 1 to 0 for a sound or a hand, and a stop. The forces are made up."""

import numpy as np

import needleforce as nf


def layer(top: float, modulus: float, puncture: float, friction: float, cutting: float) -> nf.Layer:
    """A layer [m, Pa, m, N/m, N]."""
    return nf.Layer(
        top=top,
        stiffness=nf.laws.Cone(modulus, 0.2618),
        puncture=nf.laws.PunctureDepth(puncture),
        friction=nf.laws.Coulomb(friction),
        cutting=nf.laws.ConstantCutting(cutting),
    )


skin = layer(0.0, 1.5e6, 4e-3, friction=40.0, cutting=0.8)
fat = layer(6e-3, 2e4, 1e-3, friction=15.0, cutting=0.1)
ligament = layer(30e-3, 4e6, 3e-3, friction=120.0, cutting=5.0)
space = layer(36e-3, 1e4, 0.1e-3, friction=0.0, cutting=0.0)
model = nf.Model(**{name: getattr(skin, name) for name in ("stiffness", "puncture", "friction", "cutting")},
                 deeper=(fat, ligament, space))  # fmt: skip

insertion, watch, random = nf.Insertion(model), nf.EventDetector(), np.random.default_rng(1)
dt, depth, speed, in_ligament = 1e-3, -3e-3, 4e-3, False
for _ in range(12_000):
    force = insertion.step(depth, None, dt).force + 10e-3 * random.standard_normal()
    event = watch.step(force, depth, dt)
    if event and event.kind == "puncture":
        print(f"puncture at {1e3 * event.depth:.2f} mm, found after {1e3 * event.delay:.0f} ms")
    in_ligament |= force > 6.0  # [N]: behind the skin there is fat, whose loss of resistance is a false one
    tone = 200.0 + 600.0 * watch.resistance  # [Hz] of a sound that drops
    if in_ligament and watch.resistance < 0.6:
        break
    depth += speed * dt
print(f"{force:.2f} N, resistance {watch.resistance:.2f}, {tone:.0f} Hz: stopped at {1e3 * depth:.2f} mm")
