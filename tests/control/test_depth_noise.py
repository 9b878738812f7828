# SPDX-License-Identifier: Apache-2.0
"""The size of the noise of a depth, from free travel, and a hold that keeps its force with it."""

import numpy as np
import pytest

import needleforce as nf
from needleforce.control import depth_noise
from needleforce.errors import InputError

RATE = 1000.0


def travel(seconds: float, speed: float, deviation: float, count: float = 0.0) -> np.ndarray:
    time = np.arange(round(seconds * RATE)) / RATE
    depth = -5e-3 + speed * time + deviation * np.random.default_rng(3).standard_normal(time.size)
    return count * np.round(depth / count) if count else depth


@pytest.mark.parametrize("speed", [0.0, 2e-3])
def test_the_range_holds_for_an_hour(speed):
    half = depth_noise(travel(2.0, speed, 5e-6))
    noise = 5e-6 * np.random.default_rng(8).standard_normal(3_600_000)
    assert np.abs(noise).max() < half < 1.3 * np.abs(noise).max()


def test_an_encoder_adds_half_a_count():
    # 10 um counts at constant speed: uniform error, 10 um / sqrt(12), of which normal noise would need 5.9
    half = depth_noise(travel(2.0, 2e-3, 0.0, 10e-6))
    assert half == pytest.approx(5.9 * 10e-6 / np.sqrt(12.0) + 5e-6, rel=0.03)
    assert depth_noise(np.full(200, 1e-3)) == 0.0


def test_a_hold_keeps_its_force_with_the_noise_of_its_free_travel():
    half = depth_noise(travel(2.5, 2e-3, 5e-6))
    rng = np.random.default_rng(9)
    stroke = np.arange(-1e-3, 12e-3, 2e-6)
    path = np.concatenate([stroke, np.full(20_000, 12e-3)]) + 5e-6 * rng.standard_normal(stroke.size + 20_000)
    step = np.full(path.size, 1e-3)
    kept = nf.Insertion(nf.preset("paper"), depth_noise=half).run(path, None, step)["force"][-1]
    assert kept == pytest.approx(18.6 * 12e-3 + 0.0776, abs=18.6 * 2.0 * half)
    assert nf.Insertion(nf.preset("paper")).run(path, None, step)["force"][-1] < 0.5 * kept


def test_a_needle_that_bends_keeps_its_force():
    noise = 5e-6 * np.random.default_rng(9).standard_normal(30_000)
    path = np.concatenate([np.arange(-1e-3, 12e-3, 5e-6), np.full(27_400, 12e-3)]) + noise
    needle = nf.Needle(outer_diameter=0.7e-3, inner_diameter=0.0, length=0.1, young_modulus=200e9, poisson_ratio=0.3)
    forces = [
        nf.FlexibleInsertion(
            nf.preset("paper"), needle, lateral=20e3, guide_distance=20e-3, planar=True, depth_noise=half
        ).run(path, dt=1e-3)["force"][-1]
        for half in (30e-6, 0.0)
    ]
    assert forces[0] == pytest.approx(18.6 * 12e-3 + 0.0776, abs=18.6 * 60e-6)
    assert forces[1] < 0.5 * forces[0]


@pytest.mark.parametrize(
    ("depth", "options"),
    [
        (np.zeros(50), {}),
        (np.full(200, np.nan), {}),
        (np.zeros(200), {"samples": 0}),
        (np.zeros(200), {"probability": 0.9}),
    ],
)
def test_what_cannot_be_answered_is_refused(depth, options):
    with pytest.raises(InputError):
        depth_noise(depth, **options)
