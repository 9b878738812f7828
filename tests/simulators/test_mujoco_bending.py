# SPDX-License-Identifier: Apache-2.0
"""A needle that bends on a site of MuJoCo: forces of its base, roll, a tilted world, and the example of an arm."""

import math

import numpy as np
import pytest
from test_mujoco_examples import said_by

import needleforce as nf

XML = """<mujoco>
  <option timestep="0.001" integrator="implicitfast" gravity="0 0 0"/>
  <worldbody>
    <body euler="{tilt} 0 0"><site name="skin"/>
      <body pos="0 0 0.12">
        <joint name="x" type="slide" axis="1 0 0" stiffness="{spring}" damping="5"/>
        <joint name="y" type="slide" axis="0 1 0" stiffness="{spring}" damping="5"/>
        <joint name="down" type="slide" axis="0 0 -1"/><joint name="roll" type="hinge" axis="0 0 -1"/>
        <geom size="0.01" mass="0.2"/><site name="hub" euler="180 0 0"/>
      </body>
    </body>
  </worldbody>
  <actuator><position joint="down" kp="5000" kv="60"/><position joint="roll" kp="20" kv="0.2"/></actuator>
</mujoco>"""
NEEDLE = nf.Needle(1.27e-3, 0.0, 0.12, 200e9, 0.3)


def flexible(**options):
    layer = nf.LateralLayer(modulus=2e4, tip_force=0.1)
    return nf.FlexibleInsertion(None, NEEDLE, lateral=[layer], pivot_stiffness=500.0, bevel_length=2e-3, **options)


def inserted(mujoco, roll=0.0, spring=300.0, tilt=0.0):
    """Needle, data and attachment after 50 mm at 25 mm/s and half a second of rest."""
    from needleforce.mujoco import attach_bending, step

    model = mujoco.MjModel.from_xml_string(XML.format(spring=spring, tilt=tilt))
    data, needle = mujoco.MjData(model), None
    needle = attach_bending(flexible(), model, site="hub", surface_site="skin")
    data.qpos[3] = roll
    for depth in np.concatenate([np.linspace(0.0, 0.05, 2000), np.full(500, 0.05)]):
        data.ctrl[:] = depth, roll
        step(model, data, needle)
    return needle, data


def test_the_spring_of_the_base_carries_the_lateral_force(mujoco):
    needle, data = inserted(mujoco)
    assert abs(data.qpos[0]) > 1e-5
    # the tissue pushes the base until its spring holds it
    assert 300.0 * data.qpos[0] == pytest.approx(needle.sample.wrench[0], rel=1e-3)
    assert abs(data.qpos[1]) < 1e-9


def test_a_turned_needle_bends_the_other_way_across(mujoco):
    ahead, _ = inserted(mujoco)
    aside, data = inserted(mujoco, roll=0.5 * math.pi)
    np.testing.assert_allclose(np.abs(aside.sample.tip[:2]), [0.0, ahead.sample.tip[0]], atol=1e-5)
    assert abs(300.0 * data.qpos[1]) == pytest.approx(abs(aside.sample.wrench[1]), rel=1e-3)


def test_a_tilted_world_changes_nothing(mujoco):
    flat, flat_data = inserted(mujoco)
    tilted, data = inserted(mujoco, tilt=35.0)
    np.testing.assert_allclose(tilted.sample.tip, flat.sample.tip, atol=1e-7)
    np.testing.assert_allclose(data.qpos, flat_data.qpos, atol=1e-7)
    line = tilted.shape(data)
    np.testing.assert_allclose(line[0], data.site_xpos[1], atol=1e-6)  # begins at the hub


def test_the_path_is_that_of_the_engine_alone(mujoco):
    needle, _ = inserted(mujoco, spring=2e4)
    alone = flexible()
    for depth in np.linspace(0.0, 0.05, 501):
        sample = alone.step(float(depth), dt=4e-3)
    np.testing.assert_allclose(needle.sample.tip, sample.tip, atol=3e-5)


def test_wrong_needles_and_names_are_refused(mujoco):
    from needleforce.mujoco import attach_bending, step

    model = mujoco.MjModel.from_xml_string(XML.format(spring=1.0, tilt=0.0))
    with pytest.raises(nf.InputError, match="hub"):
        attach_bending(flexible(guide_distance=0.02), model, site="hub", surface_site="skin")
    with pytest.raises(nf.InputError, match="space"):
        attach_bending(flexible(planar=True), model, site="hub", surface_site="skin")
    with pytest.raises(nf.InputError, match="moving body"):
        attach_bending(flexible(), model, site="hub", surface_site="hub")
    with pytest.raises(nf.InputError, match="not a name"):
        attach_bending(flexible(), model, site="hand", surface_site="skin")
    away = mujoco.MjModel.from_xml_string(
        XML.format(spring=1.0, tilt=0.0).replace('"hub" euler="180', '"hub" euler="90')
    )
    data, needle = mujoco.MjData(away), attach_bending(flexible(), away, site="hub", surface_site="skin")
    with pytest.raises(nf.InputError, match="60 degrees"):
        step(away, data, needle)


def test_the_arm_steers_to_its_target(root, tmp_path):
    target, tip, depth, force, lateral, slope, moment = said_by(root, tmp_path, "mujoco_steer")
    assert tip == pytest.approx(target, abs=0.1) and depth == pytest.approx(60.0, abs=0.5)
    # the paper's friction and cutting force, and what pushes a sloping needle across, most of it at the surface
    assert force == pytest.approx(18.6 * 1e-3 * depth + 0.0776 + abs(lateral * slope), abs=0.02)
    assert moment < 0.0
