# SPDX-License-Identifier: Apache-2.0
"""A needle in MuJoCo in a condensed solid: its force is that of the engine, and a hold is at rest."""

import numpy as np
import pytest
from needle_scenes import MASS, MOTOR, SERVO, inserted, loaded, on_slide

import needleforce as nf
from needleforce import core, fe
from needleforce.mujoco import attach, step

MODEL = nf.preset("paper")
APART = np.abs(np.subtract.outer(np.arange(41), np.arange(41)))
GEL = fe.CondensedTissue(1e-3, 5e-3 * np.exp(-0.25 * APART))  # gives way by 5 mm/N
BEVEL = core.Bevel(half_angle=0.3, friction_coefficient=0.2, face_share=0.5)


def course(mujoco, servo, control, seconds=2.0):
    """Depth [m] and force [N] at the end of each step."""
    m, d = loaded(mujoco, on_slide(servo=servo, gravity=9.81))
    needle, rows = attach(MODEL, m, joint="slide", tissue=GEL, bevel=BEVEL), []
    while d.time < seconds:
        d.ctrl[0] = control(d.time)
        step(m, d, needle)
        rows.append((needle.sample.depth, needle.sample.force, needle.sample.lateral))
    return np.array(rows).T


def test_the_force_is_that_of_the_engine_at_the_end_of_each_step(mujoco):
    depth, force, lateral = course(mujoco, SERVO, lambda t: 10e-3 * np.sin(3.0 * t))
    engine = fe.CondensedInsertion(GEL, MODEL, bevel=BEVEL)
    alone = [engine.step(each, None, 1e-3) for each in depth]
    np.testing.assert_allclose(force, [each.force for each in alone], atol=1e-9)
    np.testing.assert_allclose(lateral, [each.lateral for each in alone], atol=1e-9)
    assert force.max() > 0.2 and lateral.max() > 0.0 and force.min() < -0.05  # in, and out again


def test_a_needle_held_in_it_is_at_rest(mujoco):
    depth, force, _ = course(mujoco, SERVO, inserted, seconds=3.0)
    held = force[-500:]
    assert held.mean() > 0.2 and held.std() < 1e-4
    assert np.ptp(depth[-500:]) < 1e-7


def test_under_a_constant_load_the_solid_carries_it(mujoco):
    _, force, _ = course(mujoco, MOTOR, lambda t: 0.3 - MASS * 9.81, seconds=4.0)
    assert force[-500:].mean() == pytest.approx(0.3, abs=1e-3)
