# SPDX-License-Identifier: Apache-2.0
"""A 50 g needle on a slide joint in MuJoCo: a servo inserts, holds and withdraws it; the force is plotted.

python examples/mujoco_slide.py    # writes mujoco_slide.svg; needs the extra mujoco
"""

import matplotlib.pyplot as plt
import mujoco
import numpy as np

import needleforce as nf
from needleforce.mujoco import attach, step

XML = """<mujoco>
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody><body>
    <joint name="slide" type="slide" axis="0 0 -1"/>
    <geom type="capsule" fromto="0 0 0 0 0 0.1" size="0.001" mass="0.05" contype="0" conaffinity="0"/>
  </body></worldbody>
  <actuator><position joint="slide" kp="2000" kv="20"/></actuator>
</mujoco>"""

motion = nf.Motion.insert(start=-2e-3, speed=10e-3, depth=20e-3, hold=1.5, withdraw=True)
model = mujoco.MjModel.from_xml_string(XML)
data = mujoco.MjData(model)
data.qpos[0] = -2e-3
needle = attach(nf.preset("paper"), model, joint="slide")

time = np.arange(0.0, motion.duration, model.opt.timestep)
commanded, _ = motion.at(time)
depth, force = np.empty((2, len(time)))
for i in range(len(time)):
    data.ctrl[0] = commanded[i]
    depth[i] = data.qpos[0]
    step(model, data, needle)  # replaces mujoco.mj_step
    force[i] = needle.sample.force

at_hold = force[(time > 3.2) & (time < 3.6)]
print(f"largest push {force.max():.4f} N, largest pull {-force.min():.4f} N")
print(f"hold: {at_hold.mean():.4f} N, {1e3 * at_hold.std():.6f} mN rms")

figure, (over_time, over_depth) = plt.subplots(1, 2, figsize=(7, 3), sharey=True, layout="constrained")
over_time.plot(time[::5], force[::5])
over_time.set(xlabel="time [s]", ylabel="force of the tissue [N]")
over_depth.plot(1e3 * depth[::5], force[::5])
over_depth.set(xlabel="depth of the tip [mm]")
plt.savefig("mujoco_slide.svg")
print("wrote mujoco_slide.svg")
