# SPDX-License-Identifier: Apache-2.0
"""Needles in several tissues at once in MuJoCo Warp: the force of the tissue as a passive callback, one world each.

python examples/needles_in_warp.py    # needs needleforce[warp] and mujoco-warp; runs on a processor, too
"""

import mujoco
import mujoco_warp
import numpy as np
import warp as wp

import needleforce as nf
from needleforce.simulators.warp import Needles, needle_force

XML = """<mujoco>
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody><body>
    <joint name="slide" type="slide" axis="0 0 -1"/>
    <geom type="capsule" fromto="0 0 0 0 0 0.1" size="0.001" mass="0.05" contype="0" conaffinity="0"/>
  </body></worldbody>
  <actuator><position joint="slide" kp="2000" kv="20"/></actuator>
</mujoco>"""
tissues = [nf.preset("paper"), nf.preset("physical"), nf.preset("layered")]
needles = Needles(tissues)
step = needle_force(wp.float64)


@wp.kernel
def push(
    parameters: wp.array2d(dtype=wp.float64),
    which: wp.array(dtype=int),
    memory: wp.array2d(dtype=wp.float64),
    qpos: wp.array2d(dtype=float),
    dt: wp.float64,
    force: wp.array(dtype=wp.float64),
    qfrc_passive: wp.array2d(dtype=float),
):
    """The joint's position is the depth: 0 is contact with the surface."""
    world = wp.tid()
    force[world] = step(parameters, which[world], memory, world, wp.float64(qpos[world, 0]), dt, wp.float64(1.0))
    qfrc_passive[world, 0] -= float(force[world])


def tissue(m, d):
    """Called once a step by Euler and implicitfast; Runge–Kutta calls it four times, and the tissue remembers each."""
    arrays = [needles.parameters, needles.which, needles.memory, d.qpos, model.opt.timestep, needles.force]
    wp.launch(push, dim=d.nworld, inputs=[*arrays, d.qfrc_passive])


model = mujoco.MjModel.from_xml_string(XML)
start = mujoco.MjData(model)
start.qpos[0] = -2e-3
m = mujoco_warp.put_model(model)
d = mujoco_warp.put_data(model, start, nworld=len(tissues))
m.callback.passive = tissue

for time in np.arange(0.0, 1.5, model.opt.timestep):
    d.ctrl.fill_(min(-2e-3 + 20e-3 * time, 20e-3))
    mujoco_warp.step(m, d)
for preset, depth, force in zip(tissues, d.qpos.numpy()[:, 0], needles.force.numpy()):
    print(f"{preset.name}: {1e3 * depth:.3f} mm deep, {force:.4f} N")
