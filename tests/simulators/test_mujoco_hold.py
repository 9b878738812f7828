# SPDX-License-Identifier: Apache-2.0
"""A light needle held in stiff friction at 1 ms: where a tanh chatters, the engine is at rest."""

import numpy as np
import pytest
from needle_scenes import MASS, MOTOR, SERVO, inserted, loaded, oblique, on_arm, on_slide, stiff_models, with_plugin

import needleforce as nf

INTEGRATORS = ("Euler", "implicitfast", "RK4")
LOAD = 0.3  # N along the axis, above the 0.21 N of the puncture


def tissue_force(mujoco, xml, control, seconds=3.0):
    """The force [N] of the plugin in each step under ``control(time)``, and of RK4 in its last stage."""
    m, d = loaded(mujoco, xml)
    first, last = np.empty((2, round(seconds / m.opt.timestep)))
    for i in range(len(first)):
        d.ctrl[0] = control(d.time)
        mujoco.mj_step(m, d)
        first[i], last[i] = d.sensor("tissue").data[1], -d.qfrc_passive[0]
    return first, last


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("name", stiff_models())
def test_a_needle_held_by_a_servo_is_at_rest(mujoco, name, integrator):
    plugin = with_plugin(stiff_models()[name])
    xml = on_slide(plugin, integrator=integrator, servo=SERVO, gravity=9.81)
    for force in tissue_force(mujoco, xml, inserted):
        held = force[-1000:]
        assert held.mean() > 0.3  # in the tissue
        assert held.std() < 1e-6  # the bar is 1 mN


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("name", stiff_models())
def test_under_a_constant_load_the_tissue_holds_it_to_the_last_digit(mujoco, name, integrator):
    xml = on_slide(with_plugin(stiff_models()[name]), integrator=integrator, servo=MOTOR, gravity=9.81)
    # let go on the surface, it breaks in, overshoots, and its bristles swing back until they carry the load
    for force in tissue_force(mujoco, xml, lambda t: LOAD - MASS * 9.81):
        held = force[-1000:]
        assert held.mean() == pytest.approx(LOAD, abs=1e-6)
        assert held.std() < 1e-6


@pytest.mark.parametrize("name, least", [("paper", 0.1), ("coulomb", 0.2), ("lugre_rigid", 0.5)])
def test_the_engine_at_the_beginning_of_the_step_would_ring(mujoco, name, least):
    """The same load, and the same engine asked where MuJoCo asks: bristles that do not slip lose nothing."""
    m, d = loaded(mujoco, on_slide(servo=MOTOR, gravity=9.81))
    engine, force = nf.Insertion(stiff_models()[name]), []
    d.ctrl[0] = LOAD - MASS * 9.81
    while d.time < 3.0:
        force.append(engine.step(d.qpos[0], None, 1e-3).force)
        d.qfrc_applied[0] = -force[-1]
        mujoco.mj_step(m, d)
    assert np.std(force[-1000:]) > least


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("name", ["coulomb", "lugre_rigid"])
def test_an_arm_holds_its_needle_still(mujoco, name, integrator):
    """As light as the needle, but with the mass that its tip has through three joints, in the axis' direction."""
    plugin = with_plugin(stiff_models()[name], site="tip", surface_site="skin")
    m, d = loaded(mujoco, on_arm(plugin, integrator))
    force = []
    for control in [*oblique()[:1400], *np.repeat(oblique()[1399:1400], 1600, axis=0)]:
        d.ctrl[:] = control
        mujoco.mj_step(m, d)
        force.append(d.sensor("tissue").data[1])
    assert np.mean(force[-1000:]) > 0.3 and np.std(force[-1000:]) < 2e-6


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_the_same_case_chatters_with_a_tanh_of_the_velocity(mujoco, integrator):
    """0.8 N tanh(v / 3 mm/s): its slope of 267 N s/m is beyond 2 m / dt = 100. RK4 hides it in the stages of a step."""
    m, d = loaded(mujoco, on_slide(integrator=integrator, servo=SERVO, gravity=9.81))
    felt = []

    def friction(m, d):
        force = 0.8 * np.tanh(d.qvel[0] / 3e-3)
        d.qfrc_passive[0] -= force
        felt.append(force)

    mujoco.set_mjcb_passive(friction)
    while d.time < 3.0:
        d.ctrl[0] = inserted(d.time)
        mujoco.mj_step(m, d)
    mujoco.set_mjcb_passive(None)
    assert 0.57 < np.std(felt[-1000:]) < 0.8
