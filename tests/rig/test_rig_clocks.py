# SPDX-License-Identifier: Apache-2.0
"""Velocity on its own clock, and the depth as its integral."""

import numpy as np
import pytest

from needleforce import InputError
from needleforce.recording.joining import integral
from needleforce.rig import SpeedClock
from needleforce.rig.run import path_of_run


def stream(seed=5):
    return np.random.Generator(np.random.PCG64(seed))


@pytest.mark.parametrize("speed", [1e-3, 3e-3])
@pytest.mark.parametrize("seed", range(5))
def test_the_integral_of_the_velocity_returns_to_the_commanded_depth(speed, seed):
    motion = path_of_run(-4e-3, speed, 16e-3, 1.0)
    clock = SpeedClock()
    stamps, velocity = clock.record(motion, stream(seed))
    true = motion.at(stamps)[0]
    depth = integral(stamps, velocity, motion.start, stamps)
    # noise and rounding give a random walk of n steps; jitter of the stamps adds jitter times speed
    sd = np.hypot(clock.noise, clock.resolution / np.sqrt(12.0)) / clock.rate
    allowed = 4.0 * (sd * np.sqrt(len(stamps)) + 2.0 * clock.jitter * speed)
    assert np.abs(depth - true).max() < allowed < 0.1e-3


def test_an_ideal_clock_gives_the_motion():
    motion = path_of_run(-4e-3, 3e-3, 16e-3, 1.0)
    stamps, velocity = SpeedClock(jitter=0.0, noise=0.0, resolution=0.0).record(motion, stream())
    np.testing.assert_allclose(velocity, motion.at(stamps)[1], atol=1e-8)
    depth = integral(stamps, velocity, motion.start, stamps)
    corner = 10e-3 / 60.0**2 / 8.0  # a corner of the trapezoid between two samples costs at most a dt^2 / 8
    assert np.abs(depth - motion.at(stamps)[0]).max() < 8 * corner + 1e-7


def test_it_has_its_own_rate_and_phase():
    motion = path_of_run(-4e-3, 3e-3, 16e-3, 0.0)
    first, second = (SpeedClock(jitter=0.0).record(motion, stream(seed))[0] for seed in (1, 2))
    np.testing.assert_allclose(np.diff(first), 1.0 / 60.0, atol=2e-6)
    assert 0.0 <= first[0] < 1.0 / 60.0 and abs(first[0] - second[0]) > 1e-4
    assert motion.duration - first[-1] <= 1.0 / 60.0


def test_time_increases_for_any_jitter():
    stamps, _ = SpeedClock(jitter=1.0).record(path_of_run(-4e-3, 3e-3, 16e-3, 0.0), stream())
    assert (np.diff(stamps) > 0.0).all()


def test_velocity_is_quantised():
    _, velocity = SpeedClock(resolution=0.05e-3).record(path_of_run(-4e-3, 3e-3, 16e-3, 0.0), stream())
    np.testing.assert_allclose(velocity / 0.05e-3, np.rint(velocity / 0.05e-3), atol=1e-4)


def test_impossible_settings_are_refused():
    with pytest.raises(InputError, match=r"clock\.rate"):
        SpeedClock(rate=0.0)
    with pytest.raises(InputError, match=r"clock\.noise"):
        SpeedClock(noise=-1.0)
