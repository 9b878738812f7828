# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from plain_insertion import insertion, text

from needleforce.recording import read
from needleforce.recording.force_signal import bias

TIME, DEPTH, FORCE = insertion(rate=1000.0, noise=5e-3)


@pytest.mark.parametrize("offset", [0.05, -0.05, 2.0])
def test_a_bias_is_removed_with_a_note(file, offset):
    path = file(text({"time_s": TIME, "depth_m": DEPTH, "force_N": FORCE + offset}))
    run = read(path)
    lead = 250  # samples within 2 % of 25 mm at 2 mm/s
    assert np.mean(FORCE + offset - run.force) == pytest.approx(offset, abs=4.0 * 5e-3 / lead**0.5)
    (note,) = [note for note in run.notes if note.kind == "baseline"]
    assert note.count == 1 and "is removed from the force" in note.message
    np.testing.assert_array_equal(read(path, baseline=False).force, FORCE + offset)


def test_the_force_of_a_zeroed_sensor_is_unchanged():
    removed = [bias(DEPTH, insertion(rate=1000.0, noise=5e-3, seed=seed)[2])[0] for seed in range(50)]
    assert removed == [0.0] * 50


def test_filtered_noise_rarely_counts_as_a_bias():
    """Fifty correlated samples count as about one: of 200 recordings without bias at most 1 in 20 is changed."""
    kernel, taken = np.full(50, 1 / 50), 0
    for seed in range(200):
        noise = np.convolve(np.random.default_rng(seed).normal(0.0, 0.03, len(TIME) + 49), kernel, "valid")
        taken += bias(DEPTH, FORCE + noise)[0] != 0.0
    assert taken <= 10


@pytest.mark.parametrize("start", [0.0, 2e-3, 10e-3])
def test_no_bias_is_removed_from_a_recording_that_starts_in_contact(start):
    _, depth, force = insertion(rate=1000.0, start=start, noise=2e-3)
    assert bias(depth, force)[0] == 0.0


def test_no_bias_is_removed_from_a_withdrawal_only():
    out = TIME > 12.4
    assert bias(DEPTH[out], FORCE[out])[0] == 0.0


def test_too_few_samples_before_motion_are_not_used():
    value, why = bias(DEPTH[::50], FORCE[::50] + 1.0)
    assert value == 0.0 and "20 are needed" in why


def test_removing_twice_is_removing_once():
    force = FORCE + 0.3
    force -= bias(DEPTH, force)[0]
    assert bias(DEPTH, force)[0] == 0.0


def test_a_curve_that_starts_in_contact_has_no_bias():
    """As nanoindenters record: contact is sample 1, and the force is small over the first 2 % of the depth."""
    rng = np.random.default_rng(5)
    depth = np.linspace(0.0, 1e-6, 6000)
    removed = [bias(depth, 90e-3 * (depth / 1e-6) ** 1.8 + 2e-6 * rng.standard_normal(6000))[0] for _ in range(50)]
    assert removed == [0.0] * 50


@pytest.mark.parametrize("rest_s", [0.0, 1.0, 20.0])
@pytest.mark.parametrize("noise", [0.005, 0.02])
def test_a_constant_bias_is_found_after_any_rest(rest_s, noise):
    """20 % of free travel, white noise: four standard errors miss few; allowed are 5 of 100."""
    rng = np.random.default_rng(7)
    depth = np.concatenate([np.zeros(int(100 * rest_s)), np.linspace(0.0, 1.0, 1000)])
    force = 0.2 + np.clip(depth - 0.2, 0.0, None) ** 1.5 / 0.8**1.5
    found = [bias(depth, force + noise * rng.standard_normal(len(depth)))[0] for _ in range(100)]
    assert found.count(0.0) <= 5 and np.median(found) == pytest.approx(0.2, abs=0.002)
