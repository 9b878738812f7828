# SPDX-License-Identifier: Apache-2.0
"""A free needle shot into tissue: energy, and the way an independent integration gives."""

import numpy as np
import pytest
from needle_scenes import MASS, loaded, on_slide, stiff_models, with_plugin
from scipy.integrate import solve_ivp

import needleforce as nf

PER_DEPTH_2 = 2.0 / np.pi * 117546.06 * np.tan(np.deg2rad(15.0))  # N/m^2, a cone: F = 2/pi E_r tan(alpha) h^2
PUNCTURE, FRICTION, CUTTING = 3.237e-3, 18.6, 0.0776  # the paper's
ELASTIC_TRAVEL = 20e-6  # of its friction and cutting [m]


def shot(mujoco, model, speed, integrator="Euler", timestep=1e-3, seconds=0.6):
    """Depth and velocity before each step, and the force in it."""
    m, d = loaded(mujoco, on_slide(with_plugin(model), integrator=integrator, timestep=timestep))
    d.qpos[0], d.qvel[0] = -1e-3, speed
    rows = np.empty((round(seconds / timestep), 3))
    for row in rows:
        row[:2] = d.qpos[0], d.qvel[0]
        mujoco.mj_step(m, d)
        row[2] = d.sensor("tissue").data[1]
    return rows.T


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast"])
def test_a_bounce_never_gains_energy_and_loses_little(mujoco, integrator):
    """Below the puncture the tissue is a spring of energy F h / 3: with it the needle's energy is kept, but for what an
    implicit step takes, less with a shorter one."""
    lost = []
    for timestep in (1e-3, 1e-4):
        depth, speed, _ = shot(mujoco, nf.preset("paper"), 0.08, integrator, timestep)
        assert 2e-3 < depth.max() < PUNCTURE and speed[-1] < 0.0 and depth[-1] < 0.0
        energy = 0.5 * MASS * speed**2 + PER_DEPTH_2 * np.maximum(depth, 0.0) ** 3 / 3.0
        rounding = 1e-6 * np.abs(np.diff(depth)).max()  # force and motion agree to 1e-6 N
        assert np.diff(energy).max() <= rounding
        lost.append(1.0 - energy[-1] / energy[0])
    assert lost[1] < 0.15 * lost[0] < 0.02


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast", "RK4", "discrete"])
@pytest.mark.parametrize("speed", [0.15, 0.5])
@pytest.mark.parametrize("name", stiff_models())
def test_after_a_puncture_the_needle_stops_and_gets_back_no_more_than_bristles_hold(mujoco, name, speed, integrator):
    model = stiff_models()[name]
    depth, velocity, force = shot(mujoco, model, speed, integrator)
    kinetic = 0.5 * MASS * velocity**2
    turn = int(np.argmax(velocity <= 0.0))
    assert depth[turn] > PUNCTURE and turn > 0
    assert np.diff(kinetic[:turn]).max() <= 1e-9  # inwards the tissue only takes
    # an elastic-slip element that carries F over the travel s holds F s / 2
    assert kinetic[turn:].max() <= 0.5 * force[:turn].max() * 2.0 * ELASTIC_TRAVEL
    assert kinetic[-1] < 1e-12


def independently(speed):
    """Where the paper's law alone stops the needle: depth [m] and time [s] from the surface on."""

    def motion(_, state):
        depth, velocity = state
        force = PER_DEPTH_2 * max(depth, 0.0) ** 2 if depth <= PUNCTURE else CUTTING + FRICTION * depth
        return [velocity, -force / MASS]

    stops = lambda _, state: state[1]  # noqa: E731
    stops.terminal = True
    run = solve_ivp(motion, (0.0, 2.0), [-1e-3, speed], events=stops, rtol=1e-9, atol=1e-12, max_step=1e-4)
    return run.y[0, -1], run.t[-1], run


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast", "RK4"])
def test_the_way_is_that_of_an_independent_integration(mujoco, integrator):
    speed = 0.3
    depth, time, run = independently(speed)
    assert depth > 2.0 * PUNCTURE
    errors = []
    for timestep in (1e-3, 2e-4, 4e-5):
        way, _, _ = shot(mujoco, nf.preset("paper"), speed, integrator, timestep, seconds=time)
        there = np.interp(np.arange(len(way)) * timestep, run.t, run.y[0])
        errors.append(np.abs(way - there).max())
    # a step of first order: the puncture is known to speed * dt, 0.3 mm at 1 ms
    assert errors[0] < speed * 1e-3
    assert errors[1] < 0.4 * errors[0] and errors[2] < 0.4 * errors[1]
    assert errors[2] < 20e-6
