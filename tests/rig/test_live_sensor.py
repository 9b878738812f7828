# SPDX-License-Identifier: Apache-2.0
"""The live sensor: noise, counts, saturation, crosstalk, thermal drift, filter, zeroing."""

import numpy as np
import pytest

from needleforce.rig import Sensor
from needleforce.rig.live.sensor import COUNTS_PER_UNIT, CROSSTALK, MAX_BIAS_N, MAX_DRIFT_N, SixAxis
from needleforce.rig.sensor import COUNTS, RANGE

SATURATED = 0x80020000  # bits 17 and 31, as in docs/reference/rig.md
LIMIT, STEPS = np.array(list(RANGE.values())), np.array(list(COUNTS.values()))
LEVER = np.array([1, 1, 1, 0.01, 0.01, 0.01])
STILL = np.zeros(6)


def sensor(seed=1, length=1, noise=False):
    quiet = {} if noise else {"noise": 0.0, "torque_noise": 0.0}
    return SixAxis(np.random.Generator(np.random.PCG64(seed)), Sensor(length, **quiet))


def perfect(length=1):
    unit = sensor(length=length)
    unit.crosstalk, unit.bias, unit.drift = np.eye(6), STILL, STILL
    return unit


def read(unit, wrenches, time=0.0):
    """Readings (n, 6) [N, N m] and status (n,)."""
    readings = [unit.read(time, wrench) for wrench in wrenches]
    return np.array([each.counts for each in readings]) / COUNTS_PER_UNIT, np.array([each.status for each in readings])


def test_a_perfect_sensor_reads_integer_counts_of_its_calibration():
    true = np.linspace(-1.0, 1.0, 1001)[:, None] * 0.1 * LIMIT
    measured, status = read(perfect(), true)
    np.testing.assert_allclose(measured, np.rint(true * STEPS) / STEPS, atol=0.5 / COUNTS_PER_UNIT)
    assert not status.any()


@pytest.mark.parametrize("axis", range(6))
def test_saturation_is_reported_for_the_length_of_the_filter(axis):
    wrench = np.zeros((30, 6))
    wrench[10, axis] = -1.2 * LIMIT[axis]
    measured, status = read(perfect(length=5), wrench)
    assert measured.min() == pytest.approx(-LIMIT[axis] / 5, abs=1e-6)
    np.testing.assert_array_equal(status, np.where((np.arange(30) >= 10) & (np.arange(30) < 15), SATURATED, 0))


def test_a_step_is_spread_over_the_filter():
    wrench = np.repeat([0.0, 1.0], 50)[:, None] * np.array([0, 0, 1.0, 0, 0, 0])
    measured, _ = read(perfect(length=10), wrench)
    np.testing.assert_allclose(measured[:, 2], np.clip((np.arange(100) - 49) / 10, 0, 1), atol=1e-6)


def test_the_noise_is_one_count_and_rounding_averaged_by_the_filter():
    measured, _ = read(sensor(noise=True, length=10), np.zeros((20_000, 6)))
    expected = np.sqrt(1 + 1 / 12) / STEPS / np.sqrt(10)
    np.testing.assert_allclose(measured.std(axis=0), expected, rtol=0.08)  # 2000 independent ones, 5 standard errors
    off = (measured.mean(axis=0) - sensor().bias) * STEPS * np.sqrt(20_000)
    assert np.abs(off).max() < 4 * np.sqrt(1 + 1 / 12)


def test_crosstalk_is_one_percent_of_full_scale_between_different_axes():
    off = ~np.eye(6, dtype=bool)
    drawn = np.array([sensor(seed).crosstalk * LIMIT / LIMIT[:, None] for seed in range(100)])
    assert (np.diagonal(drawn, axis1=1, axis2=2) == 1.0).all()
    assert drawn[:, off].std() == pytest.approx(CROSSTALK, rel=4 / np.sqrt(2 * 3000))
    unit = sensor(3)
    base, pushed = (read(unit, [wrench])[0][0] for wrench in (STILL, np.array([0, 0, 2.0, 0, 0, 0])))
    np.testing.assert_allclose(pushed - base, 2.0 * unit.crosstalk[:, 2], atol=1.1 / STEPS.min())


def test_it_has_a_bias_and_drifts_by_millinewtons_per_minute():
    biases = np.array([sensor(seed).bias for seed in range(100)]) / LEVER
    assert 0.9 * MAX_BIAS_N < np.abs(biases).max() <= MAX_BIAS_N
    unit = sensor(2)
    shown = np.array([read(unit, [STILL] * 2, time)[0][1] for time in (0.0, 60.0, 600.0, 1e5)])
    share = 1.0 - np.exp([-0.0, -0.1, -1.0, -1e5 / 600])
    assert (np.abs(shown - unit.bias - share[:, None] * unit.drift) <= 0.5 / STEPS + 1e-6).all()
    assert (np.abs(unit.drift) <= MAX_DRIFT_N * LEVER).all() and MAX_DRIFT_N * 0.1 < 3e-3


def test_zeroing_subtracts_the_last_reading_and_keeps_the_range():
    unit = sensor(4)
    push = np.array([1.0, -2.0, 3.0, 0.01, 0.02, -0.03])
    before = read(unit, [push])[0][0]
    unit.zero()
    assert (read(unit, [push])[0][0] == 0.0).all()
    np.testing.assert_allclose(read(unit, [STILL])[0][0], read(sensor(4), [STILL])[0][0] - before, atol=1e-6)
    _, status = read(unit, [np.array([0, 0, 20.0, 0, 0, 0])])
    assert status[0] == SATURATED


def test_its_configuration_converts_counts_to_newtons():
    page = sensor().configuration
    assert page.wrench((1_000_000, 0, -500_000, 2_000, 0, 0)) == pytest.approx((1.0, 0.0, -0.5, 0.002, 0.0, 0.0))
    assert page.ratings == tuple(RANGE.values()) and page.rate == 1000.0


def test_the_seed_determines_the_sensor():
    first, again, other = (read(sensor(seed, 3, noise=True), np.zeros((50, 6)))[0] for seed in (1, 1, 2))
    assert (first == again).all() and (first != other).any()
