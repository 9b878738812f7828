# SPDX-License-Identifier: Apache-2.0
"""What a six-axis sensor reads: levers, frames, weight, and the way back."""

import math

import numpy as np
import pytest

import needleforce as nf
from needleforce.steering import WrenchSensor


def test_a_lever_adds_the_moment_of_the_force():
    sensor = WrenchSensor(position=(0.0, 0.0, -0.05))
    # 1 N along x at the base is 50 N mm about y of a sensor 50 mm behind it
    np.testing.assert_allclose(sensor.readings([1.0, 0.0, 0.0, 0.0, 0.0, 0.0]), [1.0, 0.0, 0.0, 0.0, 0.05, 0.0])
    np.testing.assert_allclose(sensor.readings([0.0, 1.0, 0.0, 0.0, 0.0, 0.0]), [0.0, 1.0, 0.0, -0.05, 0.0, 0.0])
    # an axis beside the needle's turns its axial force into a moment
    aside = WrenchSensor(position=(0.01, 0.0, 0.0))
    np.testing.assert_allclose(aside.readings([0.0, 0.0, -2.0, 0.0, 0.0, 0.0])[3:], [0.0, -0.02, 0.0], atol=1e-15)


def test_a_sensor_that_rolls_sees_a_force_turn_backwards():
    sensor = WrenchSensor(rolls=True)
    turned = sensor.readings([1.0, 0.0, 0.0, 0.0, 0.1, 0.0], roll=0.5 * math.pi)
    np.testing.assert_allclose(turned, [0.0, -1.0, 0.0, 0.1, 0.0, 0.0], atol=1e-12)
    still = WrenchSensor().readings([1.0, 0.0, 0.0, 0.0, 0.1, 0.0], roll=0.5 * math.pi)
    np.testing.assert_allclose(still, [1.0, 0.0, 0.0, 0.0, 0.1, 0.0])


def test_weight_is_read_where_the_sensor_turned_from_its_zero():
    held = {"weight": (0.5, 0.0, 0.0), "center": (0.0, 0.0, 0.02)}
    assert not WrenchSensor(**held, rolls=True).readings(np.zeros(6)).any()
    # turned by half a turn the weight points the other way: twice its reading, and of its moment
    reading = WrenchSensor(**held, rolls=True).readings(np.zeros(6), roll=math.pi)
    np.testing.assert_allclose(reading, [-1.0, 0.0, 0.0, 0.0, -0.02, 0.0], atol=1e-12)
    np.testing.assert_allclose(WrenchSensor(**held, zeroed=False).readings(np.zeros(6))[:3], [0.5, 0.0, 0.0])


@pytest.mark.parametrize("rolls", [False, True])
def test_the_wrench_is_found_again_from_any_reading(rolls):
    rng = np.random.default_rng(2)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    sensor = WrenchSensor(
        position=(0.01, -0.02, -0.08), axes=axes, reports_load=False, rolls=rolls, weight=(0.3, -0.2, 1.0),
        center=(0.0, 0.01, -0.03),
    )  # fmt: skip
    wrench, roll = rng.normal(size=(20, 6)), rng.uniform(-7.0, 7.0, 20)
    np.testing.assert_allclose(sensor.wrench(sensor.readings(wrench, roll), roll), wrench, atol=1e-12)


def test_bad_sensors_are_named():
    with pytest.raises(nf.InputError, match="axes"):
        WrenchSensor(axes=np.ones((3, 3)))
    with pytest.raises(nf.InputError, match="position"):
        WrenchSensor(position=(0.0, math.nan, 0.0))
    with pytest.raises(nf.InputError, match="force_noise"):
        WrenchSensor(force_noise=0.0)
