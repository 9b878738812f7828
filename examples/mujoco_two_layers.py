# SPDX-License-Identifier: Apache-2.0
"""An arm in MuJoCo inserts a needle through two layers and stops after the second puncture, which it finds in the
noisy force of its sensor. two_layers.cpp is the same loop in C++.

pip install "needleforce[mujoco]"
"""

import mujoco
import numpy as np
from planar_arm import XML, joints_for

import needleforce as nf
from needleforce.mujoco import attach, step

SPEED, NOISE = 5e-3, 5e-3  # [m/s], of the sensor [N]


def layer(top: float, modulus: float, puncture: float) -> dict:
    """A layer that is punctured after an indentation, and then cut and rubbed."""
    laws = nf.laws.Cone(modulus, 0.2618), nf.laws.PunctureDepth(puncture), nf.laws.Coulomb(30.0)
    return dict(zip(("stiffness", "puncture", "friction"), laws), cutting=nf.laws.ConstantCutting(0.2), top=top)


skin = layer(0.0, 1e6, 3e-3)
skin.pop("top")
model = mujoco.MjModel.from_xml_string(XML)
data = mujoco.MjData(model)
data.qpos[:] = joints_for(-5e-3)
tissue = nf.Model(**skin, deeper=(nf.Layer(**layer(8e-3, 2e6, 2.5e-3)),))
needle = attach(tissue, model, site="tip", surface_site="skin")
watch, random, commanded, found = nf.EventDetector(), np.random.default_rng(1), -5e-3, []
for _ in range(5000):
    if len(found) < 2:
        commanded = min(commanded + SPEED * model.opt.timestep, 20e-3)
    data.ctrl[:] = joints_for(commanded)
    step(model, data, needle)
    force = needle.sample.force + NOISE * random.standard_normal()
    event = watch.step(force, needle.sample.depth, model.opt.timestep)
    if event and event.kind == "puncture" and event.probability > 0.5:
        found.append(event)
        print(f"puncture {len(found)} at {1e3 * event.depth:.2f} mm, found after {1e3 * event.delay:.0f} ms")
print(f"at rest {1e3 * (needle.sample.depth - found[1].depth):.3f} mm past the second")
