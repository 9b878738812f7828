# SPDX-License-Identifier: Apache-2.0
"""A planar arm of three joints in MuJoCo inserts a needle into tissue: the needle's force as joint torques.

pip install "needleforce[mujoco]"
"""

import mujoco
import numpy as np
from planar_arm import XML, joints_for

import needleforce as nf
from needleforce.mujoco import attach, step

model = mujoco.MjModel.from_xml_string(XML)
data = mujoco.MjData(model)
motion = nf.Motion.insert(start=-10e-3, speed=10e-3, depth=20e-3, hold=0.5, withdraw=True)
data.qpos[:] = joints_for(-10e-3)
needle = attach(nf.preset("paper"), model, site="tip", surface_site="skin")

largest, depth = 0.0, 0.0
for time in np.arange(0.0, motion.duration, model.opt.timestep):
    data.ctrl[:] = joints_for(motion.at(np.array([time]))[0][0])
    step(model, data, needle)
    if needle.sample.force > largest:
        largest, depth = needle.sample.force, needle.sample.depth
        torques = data.qfrc_passive.copy()

print(f"largest force {largest:.4f} N at {1e3 * depth:.2f} mm")
print("torques at the shoulder, elbow and wrist:", *(f"{1e3 * torque:.1f}" for torque in torques), "mN m")
