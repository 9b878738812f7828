# SPDX-License-Identifier: Apache-2.0
"""MuJoCo models that the tests share: a 50 g needle on a slide joint, and at the end of an arm."""

import numpy as np

import needleforce as nf
from needleforce.mujoco import plugin_xml

MASS = 0.05  # kg
SENSOR = '<sensor><plugin name="tissue" plugin="needleforce.needle" instance="needle"/></sensor>'


def on_slide(plugin="", *, integrator="implicitfast", timestep=1e-3, servo="", gravity=0.0, mass=MASS):
    """Joint position 0 is the tip on the surface, + downwards into the tissue."""
    return f"""<mujoco><option timestep="{timestep}" integrator="{integrator}" gravity="0 0 -{gravity}"/>
    <extension>{plugin}</extension>
    <worldbody><body><joint name="slide" type="slide" axis="0 0 -1"/>
      <geom size="0.005" mass="{mass}" contype="0"/><site name="tip" euler="180 0 0"/></body></worldbody>
    <actuator>{servo}</actuator>{SENSOR if plugin else ""}</mujoco>"""


SERVO = '<position joint="slide" kp="2000" kv="10"/>'
MOTOR = '<motor joint="slide"/>'


def on_arm(plugin="", integrator="implicitfast"):
    """Two slides and a hinge; the tip 0.1 m above the floor, pointing down."""
    joints = "".join(f'<position joint="{name}" kp="3000" kv="60"/>' for name in ("x", "z"))
    return f"""<mujoco><option timestep="0.001" integrator="{integrator}" gravity="0 0 0"/>
    <extension>{plugin}</extension>
    <worldbody><site name="skin" pos="0 0 0"/>
      <body pos="0 0 0.25"><joint name="x" type="slide" axis="1 0 0"/><geom size="0.03" mass="0.5" contype="0"/>
        <body><joint name="z" type="slide" axis="0 0 1"/><geom size="0.03" mass="0.3" contype="0"/>
          <body><joint name="wrist" type="hinge" axis="0 1 0"/><geom size="0.02" mass="0.1" contype="0"/>
            <geom size="0.01" mass="0.05" pos="0 0 -0.1" contype="0"/>
            <site name="tip" pos="0 0 -0.15" euler="180 0 0"/></body></body></body></worldbody>
    <actuator>{joints}<position joint="wrist" kp="10" kv="0.1"/></actuator>{SENSOR if plugin else ""}</mujoco>"""


def stiff_models():
    """Models that a simulator finds hard: stiff presliding, stiff bristles."""
    paper, laws = nf.preset("paper"), nf.laws
    bristles = {"coulomb": 18.6, "static_friction": 25.0}
    return {
        "paper": paper,
        "coulomb": paper.replace(friction=laws.Coulomb(per_length=100.0, presliding=20e-6)),
        "lugre": paper.replace(friction=laws.Lugre(bristle_stiffness=1e6, **bristles)),
        "lugre_rigid": paper.replace(friction=laws.Lugre(bristle_stiffness=1e8, **bristles)),
    }


def loaded(mujoco, xml):
    model = mujoco.MjModel.from_xml_string(xml)
    return model, mujoco.MjData(model)


def with_plugin(nf_model, **place):
    return plugin_xml(nf_model, **(place or {"joint": "slide"}))


def inserted(time, speed=20e-3, start=-2e-3, depth=20e-3):
    return np.minimum(start + speed * time, depth)


def oblique():
    """The arm comes down 30 mm deep with its wrist at 0.2 rad, moves sideways and goes out."""
    time = np.arange(0.0, 3.0, 1e-3)[:, None]
    down = -np.clip(0.15 * time, 0.0, 0.13) + np.clip(0.15 * (time - 2.0), 0.0, 0.13)
    return np.hstack([np.tan(-0.2) * down + 2e-3 * (time > 1.4), down, np.full_like(time, 0.2)])
