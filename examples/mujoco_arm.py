# SPDX-License-Identifier: Apache-2.0
"""A planar arm of three joints in MuJoCo inserts a needle into tissue: the needle's force as joint torques.

pip install "needleforce[mujoco]"
"""

import mujoco
import numpy as np

import needleforce as nf
from needleforce.mujoco import attach, step

XML = """<mujoco>
  <option timestep="0.001" integrator="implicitfast"/>
  <default><joint type="hinge" axis="0 1 0" armature="0.01"/><geom type="capsule" size="0.02" contype="0"/></default>
  <worldbody>
    <site name="skin"/>
    <body pos="-0.25 0 0.25"><joint name="shoulder"/><geom fromto="0 0 0 0.2 0 0" mass="0.6"/>
      <body pos="0.2 0 0"><joint name="elbow"/><geom fromto="0 0 0 0.2 0 0" mass="0.4"/>
        <body pos="0.2 0 0"><joint name="wrist"/><geom fromto="0 0 0 0 0 -0.1" size="0.005" mass="0.05"/>
          <site name="tip" pos="0 0 -0.1" euler="180 0 0"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position joint="shoulder" kp="2000" kv="40"/><position joint="elbow" kp="2000" kv="40"/>
    <position joint="wrist" kp="2000" kv="40"/>
  </actuator>
</mujoco>"""
BASE, LINK, NEEDLE = np.array([-0.25, 0.25]), 0.2, 0.1


def joints_for(height: float) -> np.ndarray:
    """Joint angles for an upright needle with its tip at ``height`` [m] over the skin."""
    x, down = np.array([0.0, height + NEEDLE]) - BASE
    reach = np.hypot(x, down)
    bend = np.arccos(reach / (2.0 * LINK))
    first, second = -np.arctan2(down, x) - bend, 2.0 * bend
    return np.array([first, second, -first - second])


model = mujoco.MjModel.from_xml_string(XML)
data = mujoco.MjData(model)
motion = nf.Motion.insert(start=-10e-3, speed=10e-3, depth=20e-3, hold=0.5, withdraw=True)
data.qpos[:] = joints_for(10e-3)
needle = attach(nf.preset("paper"), model, site="tip", surface_site="skin")

largest, depth = 0.0, 0.0
for time in np.arange(0.0, motion.duration, model.opt.timestep):
    data.ctrl[:] = joints_for(-motion.at(np.array([time]))[0][0])
    step(model, data, needle)
    if needle.sample.force > largest:
        largest, depth = needle.sample.force, needle.sample.depth
        torques = data.qfrc_passive.copy()

print(f"largest force {largest:.4f} N at {1e3 * depth:.2f} mm")
print("torques at the shoulder, elbow and wrist:", *(f"{1e3 * torque:.1f}" for torque in torques), "mN m")
