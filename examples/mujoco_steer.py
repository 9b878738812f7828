# SPDX-License-Identifier: Apache-2.0
"""A planar arm in MuJoCo steers a needle that bends to a target off its straight path.

python examples/mujoco_steer.py    # writes mujoco_steer.svg; needs the extra mujoco
"""

import matplotlib.pyplot as plt
import mujoco
import numpy as np

import needleforce as nf
from needleforce.mujoco import attach_bending, step

XML = """<mujoco>
  <option timestep="0.001" integrator="implicitfast" gravity="0 0 0"/>
  <default><joint type="hinge" axis="0 1 0" armature="0.01"/><geom type="capsule" size="0.02" contype="0"/>
    <default class="a"><position kp="4000" kv="80"/></default></default>
  <worldbody>
    <site name="skin"/>
    <body pos="-0.25 0 0.25"><joint name="shoulder"/><geom fromto="0 0 0 0.2 0 0" mass="0.6"/>
      <body pos="0.2 0 0"><joint name="elbow"/><geom fromto="0 0 0 0.2 0 0" mass="0.4"/>
        <body pos="0.2 0 0"><joint name="wrist"/><geom fromto="0 0 0 0 0 -0.03" size="0.01" mass="0.1"/>
          <site name="hub" euler="180 0 0"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position joint="shoulder" class="a"/><position joint="elbow" class="a"/><position joint="wrist" class="a"/>
  </actuator>
</mujoco>"""
BASE, LINK, NEEDLE, SPEED = np.array([-0.25, 0.25]), 0.2, 0.12, 10e-3  # [m] and [m/s]


def joints_for(depth: float, aside: float) -> np.ndarray:
    """Joint angles for an upright needle at a depth, moved aside [m]."""
    x, down = np.array([aside, NEEDLE - depth]) - BASE
    bend = np.arccos(np.hypot(x, down) / (2.0 * LINK))
    first = -np.arctan2(down, x) - bend
    return np.array([first, 2.0 * bend, -first - 2.0 * bend])


gel = [nf.LateralLayer(modulus=20e3, tip_force=0.1)]
needle = nf.Needle(outer_diameter=1.27e-3, inner_diameter=0.0, length=NEEDLE, young_modulus=200e9, poisson_ratio=0.3)
insertion = nf.FlexibleInsertion(
    nf.preset("paper"), needle, lateral=gel, pivot_stiffness=500.0, bevel_length=2e-3, max_speed=10.0
)
plan = nf.steering.plan(insertion, (-2e-3, 0.0, 0.06))

model = mujoco.MjModel.from_xml_string(XML)
data = mujoco.MjData(model)
data.qpos[:] = joints_for(-2e-3, 0.0)
attached = attach_bending(insertion, model, site="hub", surface_site="skin")
depth, aside = -2e-3, 0.0
for target_depth, (target_aside, _) in zip(plan.motion.depth, plan.motion.lateral):
    for end in ((depth, target_aside), (target_depth, target_aside)):  # across at rest, then along
        steps = round(max(abs(end[0] - depth), abs(end[1] - aside)) / SPEED / model.opt.timestep)
        for share in np.linspace(0.0, 1.0, max(2, steps)):
            data.ctrl[:] = joints_for(depth + share * (end[0] - depth), aside + share * (end[1] - aside))
            step(model, data, attached)
        depth, aside = end

tip, wrench, line = map(np.asarray, (attached.sample.tip, attached.sample.wrench, attached.shape(data)))
print(f"target {1e3 * plan.target[0]:.2f} mm, tip {1e3 * tip[0]:.2f} mm aside at {1e3 * tip[2]:.2f} mm")
slope = np.gradient(line[:, 0], line[:, 2])[np.argmin(np.abs(line[:, 2]))]
print(f"axial force {attached.sample.force:.3f} N, lateral force at the hub {wrench[0]:.3f} N")
print(f"slope at the surface {slope:.4f}, moment at the hub {1e3 * wrench[4]:.1f} mN m")
plt.plot(1e3 * line[:, 0], -1e3 * line[:, 2]), plt.plot(1e3 * plan.target[0], 60.0, "x"), plt.axhline(0.0, color="gray")
plt.gca().set(xlabel="aside [mm]", ylabel="depth [mm]"), plt.gca().invert_yaxis()
plt.savefig("mujoco_steer.svg"), print("wrote mujoco_steer.svg")
