# SPDX-License-Identifier: Apache-2.0
"""The live axis against closed forms: trapezoid, lag, backlash, stop, watchdog, stall, and states of its encoder."""

import numpy as np
import pytest

from needleforce import Motion
from needleforce.rig.live.axis import (
    BACKLASH_M,
    ENCODER_STEP_M,
    LIMITS,
    SERVO_LAG_S,
    START,
    Axis,
    Encoder,
    MotionProfile,
    towards,
)
from needleforce.wire.axis_lines import CONDITIONS, MAX_SILENCE_S

A = LIMITS.max_acceleration


def motions(axis, until, begin=0.0, active=True):
    """Time, motor and needle at 1 kHz."""
    rows = []
    for time in np.arange(round(begin * 1000), round(until * 1000) + 1) / 1000:
        if active:
            axis.client_active(time)
        axis.tick(time)
        rows.append((time, axis.motor, axis.needle))
    return np.array(rows).T


@pytest.mark.parametrize("target, speed", [(16e-3, 3e-3), (-4.5e-3, 1e-3), (-3.99e-3, 5e-3), (60e-3, 50e-3)])
def test_a_move_from_rest_is_the_trapezoid_of_a_motion(target, speed):
    motion = Motion(START, ((target, speed),))
    profile = MotionProfile(2.0, START, towards(START, 0.0, target, speed, A))
    times = np.linspace(-0.5, motion.duration + 0.5, 501)
    depth, velocity = np.array([profile.at(2.0 + time) for time in times]).T
    np.testing.assert_allclose(depth, motion.at(times)[0], atol=1e-12)
    np.testing.assert_allclose(velocity, motion.at(times)[1], atol=1e-12)
    assert profile.end == pytest.approx(2.0 + motion.duration) and profile.last == pytest.approx(target)


@pytest.mark.parametrize("velocity", [-20e-3, -1e-3, 1e-3, 5e-3, 20e-3])
@pytest.mark.parametrize("target", [-10e-3, 0.0, 0.1e-3, 10e-3])
@pytest.mark.parametrize("speed", [2e-3, 30e-3])
def test_a_move_during_a_motion_arrives_without_a_jump_and_within_its_acceleration(velocity, target, speed):
    profile = MotionProfile(0.0, 0.0, towards(0.0, velocity, target, speed, A))
    times = np.linspace(0.0, profile.end + 0.1, 20_001)
    depth, speeds = np.array([profile.at(time) for time in times]).T
    assert depth[-1] == pytest.approx(target, abs=1e-12) and speeds[-1] == 0.0
    assert speeds[0] == pytest.approx(velocity)
    assert np.abs(np.diff(speeds) / np.diff(times)).max() <= A * (1 + 1e-6)
    assert np.abs(speeds).max() <= max(abs(velocity), speed) + 1e-12
    # the depth is the integral of the speed: trapezoidal rule, exact but at the corners
    travelled = np.concatenate([[0.0], np.cumsum(0.5 * (speeds[1:] + speeds[:-1]) * np.diff(times))])
    np.testing.assert_allclose(depth, travelled, atol=8 * A * (times[1] - times[0]) ** 2)


def test_the_lag_of_the_servo_is_its_time_constant_times_the_speed():
    axis = Axis()
    axis.move(0.0, 16e-3, 3e-3)
    time, motor, _ = motions(axis, 4.0)
    # a ramp of the speed, v = A t, behind a first order: x = A (t^2 / 2 - T t + T^2 (1 - exp(-t / T)))
    ramp = time < 0.3
    t = time[ramp]
    exact = START + A * (0.5 * t**2 - SERVO_LAG_S * t + SERVO_LAG_S**2 * (1.0 - np.exp(-t / SERVO_LAG_S)))
    np.testing.assert_allclose(motor[ramp], exact, atol=A * 1e-6 / 8)  # straight between two ticks
    commanded = Motion(START, ((16e-3, 3e-3),)).at(time)[0]
    cruise = (time > 0.4) & (time < 4.0)
    np.testing.assert_allclose((commanded - motor)[cruise], SERVO_LAG_S * 3e-3, atol=1e-10)


def test_the_needle_follows_a_reversal_after_the_backlash():
    axis = Axis()
    axis.move(0.0, 2e-3, 5e-3)
    _, motor, needle = motions(axis, 3.0)
    np.testing.assert_array_equal(needle, motor)  # pushed in from the start
    deepest = motor.max()
    axis.move(3.0, -2e-3, 5e-3)
    _, motor, needle = motions(axis, 6.0, 3.001)
    reversed_by = deepest - motor
    np.testing.assert_allclose(needle, np.where(reversed_by < BACKLASH_M, deepest, motor + BACKLASH_M), atol=1e-12)
    assert reversed_by.max() > 100 * BACKLASH_M


def test_the_stopping_distance_is_v_squared_over_2a():
    axis = Axis()
    axis.move(0.0, 60e-3, 20e-3)
    motions(axis, 3.0)
    here = Motion(START, ((60e-3, 20e-3),)).at(3.0)[0]
    axis.stop(3.0)
    _, motor, _ = motions(axis, 3.2, 3.001)
    assert motor[-1] - here == pytest.approx((20e-3) ** 2 / (2 * LIMITS.stop_deceleration), rel=1e-6)
    assert axis.condition == "idle"


def test_conditions_follow_in_the_expected_order():
    axis, conditions = Axis(), []
    for time in np.arange(0, 4000) / 1000:
        axis.client_active(time)
        if time == 0.5:
            axis.move(time, 5e-3, 3e-3)
        if time == 2.0:
            axis.stop(time)
        axis.tick(time)
        if [axis.condition] != conditions[-1:]:
            conditions.append(axis.condition)
    assert conditions == ["idle", "moving", "stopping", "idle"] and set(conditions) <= set(CONDITIONS)


def test_it_stops_after_the_silence_timeout_of_its_client_and_not_before():
    axis = Axis()
    axis.client_active(0.0)
    axis.move(0.0, 60e-3, 3e-3)
    time, motor, _ = motions(axis, MAX_SILENCE_S + 1.0, active=False)
    connected = Axis()
    connected.move(0.0, 60e-3, 3e-3)
    free = motions(connected, MAX_SILENCE_S + 1.0)[1]
    np.testing.assert_array_equal(motor[time <= MAX_SILENCE_S], free[time <= MAX_SILENCE_S])
    # the lag of the servo and the stopping distance
    assert motor[-1] == pytest.approx(Motion(START, ((60e-3, 3e-3),)).at(MAX_SILENCE_S)[0] + 9e-6 / 2, abs=1e-8)
    assert axis.condition == "idle"


def test_it_stops_when_its_client_disconnects():
    axis = Axis()
    axis.client_active(0.0)
    axis.move(0.0, 60e-3, 3e-3)
    motions(axis, 0.4)
    axis.client_lost(0.4)
    motions(axis, 0.5, 0.401, active=False)
    assert axis.condition == "idle" and axis.motor < START + 3e-3 * 0.4


@pytest.mark.parametrize(
    "depth, speed, reason",
    [(0.08, 1e-3, "depth"), (-0.04, 1e-3, "depth"), (0.0, 0.0, "speed"), (0.0, -1e-3, "speed"), (0.0, 0.06, "speed")],
)
def test_impossible_moves_are_refused_with_the_reason(depth, speed, reason):
    axis = Axis()
    answer = axis.move(0.0, depth, speed)
    assert not answer.accepted and answer.reason.startswith(reason)
    assert (motions(axis, 0.1)[1] == START).all()


def test_a_stalled_axis_does_not_move_reports_it_and_refuses_moves():
    axis = Axis(stall_at=1.0)
    axis.move(0.0, 16e-3, 3e-3)
    time, motor, _ = motions(axis, 2.0)
    assert np.ptp(motor[time >= 1.0]) == pytest.approx(0.0, abs=3.1e-6)  # at most the travel of one tick
    assert axis.condition == "stalled" and axis.speed == 0.0
    answer = axis.move(2.0, 0.0, 1e-3)
    assert not answer.accepted and "stalled" in answer.reason


@pytest.mark.parametrize("drift, offset", [(0.0, 0.0), (500e-6, 1000.0), (-0.01, -3.0)])
def test_states_are_sent_at_60_hz_of_the_axis_clock(drift, offset):
    axis = Axis()
    encoder = Encoder(axis, np.random.Generator(np.random.PCG64(1)), drift, offset)
    axis.move(0.0, 16e-3, 3e-3)
    states, arrived = [], []
    for time in np.arange(0, 8001) / 1000:
        axis.client_active(time)
        axis.tick(time)
        new = encoder.states()
        states += new
        arrived += [time] * len(new)
    own = np.array([state.time for state in states])
    assert [state.number for state in states] == list(range(len(states)))
    assert len(states) == int(8.0 * 60.0 * (1 + drift)) + 1
    np.testing.assert_allclose(own, offset + np.arange(len(states)) / 60.0, atol=1e-9)
    late = np.array(arrived) - (own - offset) / (1 + drift)
    assert late.min() >= -1e-9 and late.max() < 1e-3  # a state is sent at the next tick
    # the encoder measures the motor, in its steps
    motion = Motion(START, ((16e-3, 3e-3),))
    rig_time = np.arange(len(states)) / 60.0 / (1 + drift)
    depth, velocity = (np.array([getattr(state, name) for state in states]) for name in ("depth", "velocity"))
    cruise = (rig_time > 0.5) & (rig_time < 6.0)
    lag = SERVO_LAG_S * 3e-3
    assert np.abs(depth - motion.at(rig_time)[0] + lag)[cruise].max() <= ENCODER_STEP_M / 2 + 1e-9
    np.testing.assert_allclose(depth / ENCODER_STEP_M, np.rint(depth / ENCODER_STEP_M), atol=1e-6)
    assert velocity[cruise].mean() == pytest.approx(3e-3, abs=4 * 21e-6 / np.sqrt(cruise.sum()))
    # noise of 20 um/s and rounding to 10
    assert velocity[cruise].std() == pytest.approx(np.hypot(20e-6, 10e-6 / np.sqrt(12)), rel=0.2)
