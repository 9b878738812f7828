# SPDX-License-Identifier: Apache-2.0
"""The check of an axis by its own depths: closed forms of motions that keep to the orders, and of some that do not."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from needleforce import InputError
from needleforce.acquisition.axis_check import AxisCheck, check_declared, stop_distance
from needleforce.wire.axis_lines import AxisRange, AxisState

LIMITS = AxisRange(-0.03, 0.07, 0.05, 0.01)
RATE = 60.0


class Motion:
    """States at ``RATE`` of a depth over time, each late by ``delay`` [s]."""

    def __init__(self, check, delay=lambda k: 0.0):
        self.check, self.delay, self.number, self.time = check, delay, 0, 100.0
        self.arrival = 0.0

    def run(self, depth, seconds, velocity=0.0, condition="moving"):
        """Report ``depth(t)`` from now for ``seconds``."""
        for k in range(1, round(seconds * RATE) + 1):
            self.number += 1
            self.arrival = max(self.arrival, self.time + k / RATE + self.delay(self.number))
            state = AxisState(self.number, self.time + k / RATE, depth(k / RATE), velocity, condition)
            self.check.add(state, self.arrival)
        self.time += seconds


def trapezoid(travel, speed, acceleration):
    """The depth over time of a profile with constant acceleration, and its duration."""
    ramp = speed / acceleration
    assert travel >= speed * ramp
    total = travel / speed + ramp

    def depth(t):
        if t < ramp:
            return 0.5 * acceleration * t**2
        if t < total - ramp:
            return speed * (t - 0.5 * ramp)
        return travel - 0.5 * acceleration * max(0.0, total - t) ** 2

    return depth, total


def at_rest(depth=-0.004, delay=lambda k: 0.0):
    check = AxisCheck(LIMITS)
    motion = Motion(check, delay)
    motion.run(lambda t: depth, 0.5, condition="idle")
    assert check.begin()
    return check, motion


@given(st.floats(1e-3, 0.02), st.lists(st.floats(0.0, 0.2), min_size=64, max_size=64), st.booleans())
def test_an_axis_that_keeps_to_its_orders_is_never_accused(speed, delays, stops):
    """A trapezoid at the declared acceleration, then rest; every state late by up to 0.2 s."""
    check, motion = at_rest(delay=lambda k: delays[k % len(delays)])
    depth, total = trapezoid(0.045, speed, LIMITS.max_acceleration)
    check.order_move(0.041, speed)
    if not stops:
        motion.run(lambda t: -0.004 + depth(t), total + 1.0)
        assert not check.fault and check.at_rest
        return
    half = 0.5 * total
    motion.run(lambda t: -0.004 + depth(t), half)
    check.order_stop(motion.time)
    brake, here = speed / LIMITS.max_acceleration, -0.004 + depth(half)
    motion.run(lambda t: here + speed * min(t, brake) - 0.5 * LIMITS.max_acceleration * min(t, brake) ** 2, brake + 1.0)
    report = check.stop_report()
    assert not check.fault and report.confirmed, report
    assert report.distance <= stop_distance(LIMITS, speed) + 0.2 * speed  # the depth known last may be 0.2 s old
    assert report.allowed == stop_distance(LIMITS, speed)  # what is printed before the run is what is judged


@pytest.mark.parametrize("factor", [1.5, 3.0, 10.0])
def test_an_axis_faster_than_ordered_is_a_fault_before_it_is_far(factor):
    check, motion = at_rest()
    check.order_move(0.06, 0.005)
    travelled = []
    motion.run(lambda t: travelled.append((check.fault, 0.005 * factor * t)) or -0.004 + 0.005 * factor * t, 1.0)
    far = next(travel for fault, travel in travelled if fault)
    assert "5 mm/s was ordered" in check.fault
    assert far <= (0.25e-3 + 1.05 * 0.005 * 0.25) * factor / (factor - 1.05) + 0.005 * factor * 2 / RATE


def test_the_wrong_way_is_a_fault_whatever_velocity_is_reported():
    check, motion = at_rest()
    check.order_move(0.016, 0.01)
    motion.run(lambda t: -0.004 - 0.01 * t, 1.0, velocity=0.01)
    assert "outside the commanded range" in check.fault
    check, motion = at_rest()
    check.order_move(0.016, 0.01)
    motion.run(lambda t: -0.004, 0.1, velocity=50.0)
    assert "check its units" in check.fault


def test_a_depth_outside_the_declared_range_is_a_fault_without_any_order():
    check, motion = at_rest(-0.02)
    motion.run(lambda t: -0.0311, 0.1)
    assert "declares" in check.fault


def test_leaving_the_target_after_arrival_is_a_fault():
    check, motion = at_rest()
    check.order_move(0.006, 0.01)
    motion.run(lambda t: -0.004 + 0.01 * min(t, 1.0), 1.2)
    assert not check.fault
    motion.run(lambda t: 0.006 - 0.01 * t, 0.2, condition="idle")
    assert "outside the commanded range 5.000 to 7.000 mm" in check.fault


@pytest.mark.parametrize("condition", ["idle", "moving", "stopping"])
def test_after_a_stop_no_word_counts_but_the_depth(condition):
    check, motion = at_rest()
    check.order_move(0.05, 0.01)
    motion.run(lambda t: -0.004 + 0.01 * t, 1.0)
    check.order_stop(motion.time)
    motion.run(lambda t: 0.006 + 0.01 * t, 2.0, condition=condition)
    report = check.stop_report()
    assert report.beyond and not report.at_rest and not report.confirmed
    assert report.speed == pytest.approx(0.01, rel=0.1) and report.depth == pytest.approx(0.026)
    assert "ordered to stop, did not; last seen at 26.000 mm" in str(report)


def test_a_stop_that_is_late_is_reported_as_late():
    check, motion = at_rest()
    check.order_move(0.05, 0.01)
    motion.run(lambda t: -0.004 + 0.01 * t, 1.0)
    check.order_stop(motion.time)
    motion.run(lambda t: 0.006 + 0.01 * min(t, 1.5), 3.0)
    report = check.stop_report()
    assert report.at_rest and report.beyond and "did not in time: at rest at 21.000 mm" in str(report)


def test_silence_after_a_stop_is_neither_rest_nor_motion():
    check, motion = at_rest()
    check.order_move(0.05, 0.01)
    motion.run(lambda t: -0.004 + 0.01 * t, 1.0)
    check.order_stop(motion.time)
    report = check.stop_report()
    assert not report.confirmed and not report.beyond and "not seen at rest; last seen at 6.000 mm" in str(report)


def test_a_slow_creep_is_not_rest():
    check, motion = at_rest()
    check.order_move(0.05, 0.01)
    motion.run(lambda t: -0.004 + 0.01 * t, 1.0)
    check.order_stop(motion.time)
    motion.run(lambda t: 0.006 + 1e-4 * t, check.stop_time + 0.3, condition="idle")
    assert check.stop_report().beyond and not check.at_rest


def test_noise_of_the_encoder_is_rest():
    check = AxisCheck(LIMITS)
    motion = Motion(check)
    noise = lambda t: 8e-6 * math.sin(1e3 * t)  # noqa: E731
    motion.run(noise, 0.5, condition="idle")
    assert check.begin()
    check.order_stop(motion.time)
    motion.run(noise, 0.5, condition="idle")
    assert check.stop_report().confirmed


def test_an_axis_that_moves_at_the_start_has_no_rest():
    check = AxisCheck(LIMITS)
    Motion(check).run(lambda t: 1e-3 * t, 1.0, condition="idle")
    assert not check.begin()


def test_a_repeated_state_is_no_sign_of_life_and_a_fallen_counter_is_a_restart():
    check, motion = at_rest()
    assert not check.add(check.state, motion.time + 1.0) and not check.fault
    assert check.add(check.state._replace(number=3), motion.time + 1.0)
    assert "fell from 30 to 3: it restarted" in check.fault


@pytest.mark.parametrize(
    "limits",
    [LIMITS._replace(max_acceleration=1e-9), LIMITS._replace(max_acceleration=1e5), LIMITS._replace(max_speed=50.0),
     LIMITS._replace(highest=70.0), LIMITS._replace(lowest=-30.0)],
)  # fmt: skip
def test_a_declared_range_that_no_needle_axis_has_is_refused(limits):
    check_declared(LIMITS)
    with pytest.raises(InputError, match="a needle axis declares"):
        check_declared(limits)


@pytest.mark.parametrize("speed", [2e-5, 1.9e-4, 1e-3])
def test_a_creep_before_the_first_order_is_not_rest(speed):
    check = AxisCheck(LIMITS)
    Motion(check).run(lambda t: round(speed * t / 0.5e-6) * 0.5e-6, 2.0, condition="idle")
    assert not check.begin()


@pytest.mark.parametrize("speed", [3e-5, 1e-4, 1e-3])
def test_a_slow_axis_that_ignores_a_stop_is_not_at_rest(speed):
    check, motion = at_rest()
    check.order_move(0.05, speed)
    motion.run(lambda t: -0.004 + speed * t, 4.0)
    check.order_stop(motion.time)
    here = -0.004 + speed * 4.0
    motion.run(lambda t: here + speed * t, check.stop_time + 1.0, condition="idle")
    report = check.stop_report()
    assert report.beyond and not report.at_rest


def test_an_axis_that_rests_and_then_moves_again_has_not_stopped():
    check, motion = at_rest()
    check.order_move(0.05, 0.01)
    motion.run(lambda t: -0.004 + 0.01 * t, 1.0)
    check.order_stop(motion.time)
    motion.run(lambda t: 0.006, 0.5)
    assert check.stop_report().confirmed
    motion.run(lambda t: 0.006 + 0.01 * t, 0.05)
    assert check.stop_report().beyond
    motion.run(lambda t: 0.0065, 1.0)
    assert not check.stop_report().confirmed


@pytest.mark.parametrize("rate, noise, speed", [(1000.0, 1e-6, 1e-3), (1000.0, 3e-6, 3e-3), (60.0, 3e-6, 5e-5)])
def test_noise_of_the_encoder_is_no_travel(rate, noise, speed, monkeypatch):
    """A minute of a correct axis with a noisy encoder, before and during a move."""
    random = np.random.default_rng(1)
    monkeypatch.setitem(globals(), "RATE", rate)
    check = AxisCheck(LIMITS)
    motion = Motion(check)
    motion.run(lambda t: random.normal(0.0, noise), 1.0, condition="idle")
    assert check.begin()
    motion.run(lambda t: random.normal(0.0, noise), 20.0, condition="idle")
    check.order_move(0.06, speed)
    motion.run(lambda t: min(speed * t, 0.06) + random.normal(0.0, noise), 15.0)
    assert not check.fault


@pytest.mark.parametrize("seed", range(20))
def test_a_stop_with_late_states_is_not_accused(seed):
    """States late by up to 0.2 s at random, and an axis that needs the whole 0.1 s before it brakes."""
    random = np.random.default_rng(seed)
    delays = random.uniform(0.0, 0.2, 4096)
    check, motion = at_rest(delay=lambda k: delays[k % 4096])
    speed, limits = 0.02, LIMITS
    ramp, _ = trapezoid(0.06, speed, limits.max_acceleration)
    check.order_move(0.058, speed)
    motion.run(lambda t: -0.004 + ramp(t), 2.5)
    check.order_stop(motion.time)
    here, brake = -0.004 + ramp(2.5), speed / limits.max_acceleration

    def stopping(t):
        late = max(0.0, min(t - 0.1, brake))
        return here + speed * (min(t, 0.1) + late) - 0.5 * limits.max_acceleration * late**2

    motion.run(stopping, 4.0)
    assert check.stop_report().confirmed and not check.fault
