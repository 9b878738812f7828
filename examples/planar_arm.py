# SPDX-License-Identifier: Apache-2.0
"""A planar arm of three joints that holds a needle upright over the skin, for the examples with MuJoCo."""

import numpy as np

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
    <position joint="shoulder" kp="20000" kv="200"/><position joint="elbow" kp="20000" kv="200"/>
    <position joint="wrist" kp="20000" kv="200"/>
  </actuator>
</mujoco>"""
BASE, LINK, NEEDLE = np.array([-0.25, 0.25]), 0.2, 0.1  # [m]


def joints_for(depth: float) -> np.ndarray:
    """Joint angles for an upright needle with its tip at ``depth`` [m] below the skin."""
    x, down = np.array([0.0, NEEDLE - depth]) - BASE
    bend = np.arccos(np.hypot(x, down) / (2.0 * LINK))
    first, second = -np.arctan2(down, x) - bend, 2.0 * bend
    return np.array([first, second, -first - second])
