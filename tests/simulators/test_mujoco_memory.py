# SPDX-License-Identifier: Apache-2.0
"""The tissue's memory moves once a step, and goes with MuJoCo's data."""

import numpy as np
import pytest
from needle_scenes import SERVO, inserted, loaded, on_slide, with_plugin

import needleforce as nf


@pytest.fixture(params=["Euler", "implicitfast", "RK4"])
def scene(request, mujoco):
    return loaded(mujoco, on_slide(with_plugin(nf.preset("paper")), servo=SERVO, integrator=request.param))


def course(mujoco, m, d, times, between=None):
    """Depth and tissue force at each step; ``between`` is called before each of them."""
    rows = []
    for time in times:
        if between:
            between()
        d.ctrl[0] = inserted(time, speed=40e-3)
        mujoco.mj_step(m, d)
        rows.append([d.qpos[0], d.qvel[0], *d.sensor("tissue").data])
    return np.array(rows)


BEFORE, AFTER = np.arange(0.0, 0.2, 1e-3), np.arange(0.2, 0.6, 1e-3)


def test_evaluating_the_forces_again_moves_nothing(mujoco, scene):
    m, d = scene
    other = mujoco.MjData(m)

    def evaluate():
        mujoco.mj_forward(m, d)
        mujoco.mj_inverse(m, d)
        d.qpos[0] += 1e-3  # deeper: would puncture, if it counted
        mujoco.mj_forward(m, d)
        d.qpos[0] -= 1e-3

    plain = course(mujoco, m, other, BEFORE)
    again = course(mujoco, m, d, BEFORE, evaluate)
    np.testing.assert_allclose(again, plain, rtol=0, atol=1e-14)


@pytest.mark.parametrize("scene", ["Euler", "implicitfast"], indirect=True)  # MuJoCo has none of RK4
def test_finite_differences_move_nothing(mujoco, scene):
    m, d = scene
    a, b = np.zeros((2, 2)), np.zeros((2, 1))
    plain = course(mujoco, m, mujoco.MjData(m), BEFORE)
    again = course(mujoco, m, d, BEFORE, lambda: mujoco.mjd_transitionFD(m, d, 1e-7, True, a, b, None, None))
    np.testing.assert_array_equal(again, plain)


def test_the_transition_feels_the_bristles(mujoco):
    """Held in the tissue, friction is a spring of 18.6 N/m / 20 um over 20 mm: d(velocity) over d(position) has its
    stiffness, K / m dt / (1 + K dt^2 / m), beside the servo's."""
    m, d = loaded(mujoco, on_slide(with_plugin(nf.preset("paper")), servo=SERVO, integrator="Euler"))
    course(mujoco, m, d, np.arange(0.0, 1.5, 1e-3))
    a, b = np.zeros((2, 2)), np.zeros((2, 1))
    mujoco.mjd_transitionFD(m, d, 1e-8, True, a, b, None, None)
    depth = d.sensor("tissue").data[0]
    stiffness = 18.6 / 20e-6 * depth + 0.0776 / 20e-6 + 18.6 * (d.sensor("tissue").data[3] / (18.6 * depth))
    softened = stiffness / (1.0 + stiffness * 1e-6 / 0.05)
    assert a[1, 0] == pytest.approx(-(softened + 2000.0) * 1e-3 / 0.05, rel=2e-3)


def test_copies_go_on_alike(mujoco, scene):
    m, d = scene
    course(mujoco, m, d, BEFORE)
    copy = mujoco.MjData(m)
    mujoco.mj_copyData(copy, m, d)
    np.testing.assert_array_equal(course(mujoco, m, copy, AFTER), course(mujoco, m, d, AFTER))


def test_a_state_restored_goes_on_alike(mujoco, scene):
    m, d = scene
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    course(mujoco, m, d, BEFORE)
    state = np.empty(mujoco.mj_stateSize(m, kind))
    mujoco.mj_getState(m, d, state, kind)
    first = course(mujoco, m, d, AFTER)
    assert first[:, 0].max() > 10e-3  # punctured since
    mujoco.mj_setState(m, d, state, kind)
    np.testing.assert_array_equal(course(mujoco, m, d, AFTER), first)
    fresh = mujoco.MjData(m)
    mujoco.mj_setState(m, fresh, state, kind)
    np.testing.assert_array_equal(course(mujoco, m, fresh, AFTER), first)


def test_reset_makes_the_tissue_whole(mujoco, scene):
    m, d = scene
    first = course(mujoco, m, d, AFTER)
    mujoco.mj_resetData(m, d)
    np.testing.assert_array_equal(course(mujoco, m, d, AFTER), first)


@pytest.mark.parametrize("altered", ["of another tissue", "zeros", "one bit"])
def test_a_state_that_is_not_its_own_is_whole_tissue(mujoco, altered):
    m, d = loaded(mujoco, on_slide(with_plugin(nf.preset("paper")), servo=SERVO))
    plain = course(mujoco, m, mujoco.MjData(m), BEFORE)
    other, there = loaded(mujoco, on_slide(with_plugin(nf.preset("maurin")), servo=SERVO))
    course(mujoco, other, there, AFTER)
    course(mujoco, m, d, AFTER)
    assert d.qpos[0] > 10e-3  # punctured: what is refused must not be felt
    if altered == "one bit":
        d.plugin_state[100] += 1e-12
    else:
        d.plugin_state[:] = there.plugin_state if altered == "of another tissue" else 0.0
    d.qpos[0] = d.qvel[0] = d.time = 0.0
    np.testing.assert_allclose(course(mujoco, m, d, BEFORE), plain, atol=1e-8)


def test_nan_and_teleports_push_nothing(mujoco, scene):
    m, d = scene
    course(mujoco, m, d, AFTER)
    for where in (np.nan, 0.5, np.inf):
        d.qpos[0] = where
        mujoco.mj_forward(m, d)
        assert d.qfrc_passive[0] == 0.0 and d.sensor("tissue").data[7] in (1.0, 3.0)


def test_threads_go_on_alike(mujoco, scene):
    from mujoco import rollout

    m, d = scene
    course(mujoco, m, d, BEFORE)
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    state = np.empty((4, mujoco.mj_stateSize(m, kind)))
    for row in state:
        mujoco.mj_getState(m, d, row, kind)
    control = np.repeat(inserted(AFTER, speed=40e-3)[None, :, None], 4, axis=0)
    data = [mujoco.MjData(m) for _ in range(2)]
    _, felt = rollout.rollout(m, data, state, control)
    alone = course(mujoco, m, d, AFTER)[:, 2:]
    for thread in felt:
        np.testing.assert_allclose(thread, alone, rtol=0, atol=1e-9)
