# SPDX-License-Identifier: Apache-2.0
"""The force sensor: counts, saturation, and the step response of its moving-average filter."""

import numpy as np
import pytest

from needleforce import InputError
from needleforce.rig import Sensor
from needleforce.rig.sensor import RANGE


def stream():
    return np.random.Generator(np.random.PCG64(3))


def quiet(length):
    return Sensor(filter_length=length, noise=0.0, torque_noise=0.0, bias=0.0)


def test_a_reading_is_an_integer_number_of_counts():
    true = np.linspace(-0.3, 0.3, 1001)
    read = quiet(1).record({"force": true, "tx": 1e-3 * true}, stream())
    np.testing.assert_allclose(read["force"] * 320, np.rint(true * 320), atol=1e-12)
    np.testing.assert_allclose(read["tx"] * 64_000, np.rint(1e-3 * true * 64_000), atol=1e-12)
    assert np.abs(read["force"] - true).max() <= 0.5 / 320 + 1e-12


def test_it_saturates_at_the_ends_of_its_range():
    true = {axis: np.array([-10.0, 0.0, 10.0]) * end for axis, end in RANGE.items()}
    for axis, read in quiet(1).record(true, stream()).items():
        np.testing.assert_allclose(read, [-RANGE[axis], 0.0, RANGE[axis]])


@pytest.mark.parametrize("length", [1, 2, 10, 50])
def test_a_step_is_spread_over_the_filter_and_a_ramp_delayed_by_half_of_it(length):
    sensor = quiet(length)
    step = sensor.record({"force": np.repeat([0.0, 1.0], 100)}, stream())["force"]
    expected = np.clip((np.arange(200) - 99) / length, 0.0, 1.0)
    np.testing.assert_allclose(step, expected, atol=1e-12)
    ramp = np.arange(200) / 320.0  # one count per sample: not changed by rounding
    read = sensor.record({"force": ramp}, stream())["force"]
    np.testing.assert_allclose(read[length:], ramp[length:] - 0.5 * (length - 1) / 320.0, atol=1e-12)


def test_the_recorded_noise_is_a_third_of_a_count_and_as_correlated_as_an_average():
    read = Sensor(bias=0.0).record({"force": np.zeros(200_000)}, stream())["force"]
    # noise of one count and rounding of 1/sqrt(12) counts, over the root of ten samples
    assert read.std() == pytest.approx(np.sqrt(1.0 + 1.0 / 12.0) / 320 / np.sqrt(10.0), rel=0.03)
    centred = read - read.mean()
    lag = np.array([np.mean(centred[: -k or None] * centred[k:]) for k in range(12)]) / read.var()
    np.testing.assert_allclose(lag, np.clip(1.0 - np.arange(12) / 10.0, 0.0, 1.0), atol=0.03)


def test_a_bias_is_one_constant_for_a_run_and_axis():
    sensor = Sensor(noise=0.0, torque_noise=0.0, bias=0.1)
    read = sensor.record({"force": np.zeros(50)}, stream())
    assert all(np.ptp(values) == 0.0 for values in read.values())
    assert read["force"][0] != read["fx"][0]


@pytest.mark.parametrize("bad", [{"filter_length": 0}, {"filter_length": 2.5}, {"noise": -1.0}, {"bias": np.nan}])
def test_impossible_settings_are_refused(bad):
    with pytest.raises(InputError, match=f"sensor.{next(iter(bad))}"):
        Sensor(**bad)
