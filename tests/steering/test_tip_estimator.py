# SPDX-License-Identifier: Apache-2.0
"""The tip in the loop: late and seldom readings, wrenches, and readings of another frame."""

import functools
import math

import numpy as np
import pytest

import needleforce as nf
from needleforce import core
from needleforce.rig import SteeringPhantom, steering_insertion, write_steering
from needleforce.steering import TipEstimator, WrenchSensor, identify, path_errors, read

STIFFNESS = 0.02
NEEDLE = nf.Needle(1.27e-3, 0.0, 0.3, STIFFNESS * 64.0 / (math.pi * 1.27e-3**4))
ASIDE = np.array([1e-3, 0.0, 0.0])
QUIET = {"tilt": 5e-3, "offset": 3e-4, "tip_noise": 1.5e-4, "slope_noise": 2e-3, "longest_delay": 10.0}


def flexible(modulus=2e4):
    layer = nf.LateralLayer(modulus=modulus, tip_force=0.2)
    return nf.FlexibleInsertion(None, NEEDLE, lateral=[layer], guide_distance=0.03, max_speed=math.inf, elements=20)


@pytest.fixture(scope="module")
def rig_model(tmp_path_factory):
    """A needle identified from six insertions of the rig."""
    rng, insertions = np.random.default_rng(1), []
    for number in range(6):
        insertion, base = steering_insertion(1, number), np.zeros(2)
        for row in range(19):
            if number >= 3 and row >= 2:
                base = np.clip(base + rng.normal(0.0, 1.2e-3, 2), -6e-3, 6e-3)
            insertion.advance(5e-3 * row, base)
        insertions.append(insertion)
    file = tmp_path_factory.mktemp("rig") / "paths.csv"
    write_steering(insertions, file)
    return identify(read(file), SteeringPhantom().needle).model


@pytest.fixture(scope="module")
def followed(rig_model):
    """Errors [m] and their squares over the expected ones along a steered insertion of the rig; each is made once."""
    return functools.cache(functools.partial(_followed, rig_model))


def _followed(model, number, *, every, delay, wrench=False):
    insertion, rng, base = steering_insertion(1, number), np.random.default_rng(number), np.zeros(2)
    insertion.advance(0.0, base)
    estimator = TipEstimator(model, entry=(*insertion.tip[:2], 0.0), **QUIET)
    estimator.step(0.0, base, dt=1.0)
    readings, errors, ratios = [], [], []
    for row in range(1, 19):
        if row >= 2:
            base = np.clip(base + rng.normal(0.0, 1.2e-3, 2), -6e-3, 6e-3)
        readings.append(insertion.advance(5e-3 * row, base))
        for share in np.linspace(0.0, 1.0, 6):
            estimator.step(5e-3 * (row - 1.0 + share), base, dt=0.2)
        if every and row % every == 0:
            tip, slope = readings[-1 - delay]
            assert estimator.read_tip(tip, age=1.2 * delay, slope=slope)
        if wrench:
            estimator.read_wrench(insertion.wrench)
        off = (estimator.estimate.tip - insertion.tip)[:2]
        if row >= 4:
            errors.append(np.hypot(*off))
            ratios.append(0.5 * off @ np.linalg.solve(estimator.estimate.covariance, off))
    return errors, ratios


def test_seldom_and_late_readings_hold_the_tip_within_its_stated_uncertainty(followed, many):
    alone, read_seldom, ratios = [], [], []
    for number in range(300, many(302, 306)):
        alone += followed(number, every=0, delay=0)[0]
        errors, each = followed(number, every=4, delay=1)
        read_seldom += errors
        ratios += each
    rms = [1e3 * np.sqrt(np.mean(np.square(each))) for each in (alone, read_seldom)]
    assert rms[1] < 0.6 * rms[0] and rms[1] < 0.4
    assert 0.2 < np.mean(ratios) < 2.5  # 1 if all is as assumed; the rig's tissue is uneven in its own way


def test_wrench_alone_is_no_harm(followed):
    errors = [
        followed(number, every=0, delay=0, wrench=wrench)[0] for number in range(300, 304) for wrench in (False, True)
    ]
    without, with_wrench = np.concatenate(errors[::2]), np.concatenate(errors[1::2])
    assert np.sqrt(np.mean(with_wrench**2)) < 1.15 * np.sqrt(np.mean(without**2))


def test_a_tip_in_another_frame_is_rejected_and_counted(rig_model):
    insertion = steering_insertion(1, 400)
    estimator = TipEstimator(rig_model, **QUIET)
    for row in range(10):
        tip, _ = insertion.advance(5e-3 * row, (2e-4 * row**2, 0.0))
        estimator.step(5e-3 * row, (2e-4 * row**2, 0.0), dt=1.0)
    before = estimator.estimate.tip
    mirrored = tip * [-1.0, 1.0, 1.0] - 8.0 * ASIDE
    assert not estimator.read_tip(mirrored) and not estimator.read_tip(mirrored) and estimator.rejected == 2
    np.testing.assert_array_equal(estimator.estimate.tip, before)
    assert estimator.read_tip(tip) and estimator.rejected == 0


def test_a_given_needle_is_estimated_by_its_pose_alone():
    estimator = TipEstimator(flexible(), entry=(1e-3, 0.0, 0.0))
    flex = flexible()
    for depth in np.arange(0.0, 0.05, 1e-3):
        estimate, sample = estimator.step(depth, dt=0.1), flex.step(depth, dt=0.1)
    np.testing.assert_allclose(estimate.tip - ASIDE, np.asarray(sample.tip), atol=1e-12)
    assert estimator.read_tip(estimate.tip + ASIDE)
    moved = estimator.estimate
    assert 0.8e-3 < moved.tip[0] - estimate.tip[0] < 1e-3 and moved.sd < 0.3 * estimate.sd
    shape = estimator.shape()
    np.testing.assert_allclose(shape[-1, :2], moved.tip[:2], atol=1e-6)
    np.testing.assert_allclose(shape[0, :2], [1e-3, 0.0], atol=1e-9)
    assert estimate.force == 0.0 and estimate.status == "ok"
    np.testing.assert_array_equal(estimate.wrench, np.asarray(sample.wrench))


def test_reset_and_refused_steps():
    estimator = TipEstimator(flexible())
    first = [estimator.step(depth, dt=0.1).tip for depth in (0.0, 0.01, 0.02)][-1]
    assert estimator.step(math.nan, dt=0.1).status == "not_finite"
    assert estimator.step(0.02, dt=-1.0).status != "ok"
    np.testing.assert_array_equal(estimator.estimate.tip, first)
    estimator.read_tip(first + ASIDE)
    estimator.reset()
    np.testing.assert_array_equal([estimator.step(depth, dt=0.1).tip for depth in (0.0, 0.01, 0.02)][-1], first)


def test_errors_of_the_path_are_the_same_in_the_fit_and_in_the_loop():
    loop, sensor = core.PathUncertainty(), WrenchSensor()
    fit = (
        path_errors.POSITION_NOISE, path_errors.SLOPE_NOISE, path_errors.OFFSET_SPREAD, path_errors.TILT_SPREAD,
        path_errors.UNEVENNESS, path_errors.COMMON_SLOPE, path_errors.COMMON_LENGTH,
    )  # fmt: skip
    assert fit == (
        loop.tip_noise, loop.slope_noise, loop.offset, loop.tilt, loop.unevenness, loop.common_slope,
        loop.common_length,
    )  # fmt: skip
    assert (sensor.force_noise, sensor.moment_noise) == (loop.force_noise, loop.moment_noise)


def test_bad_settings_are_named():
    with pytest.raises(nf.InputError, match="modes"):
        TipEstimator(flexible(), modes=7)
    with pytest.raises(nf.InputError, match="entry"):
        TipEstimator(flexible(), entry=(0.0, 1.0))
    with pytest.raises(nf.InputError, match="tip_noise"):
        TipEstimator(flexible(), tip_noise=-1.0)
    with pytest.raises(nf.InputError, match="steering model"):
        TipEstimator(nf.preset("paper"))
    estimator = TipEstimator(flexible())
    for wrong in (1.0, np.zeros(2)):
        with pytest.raises(nf.InputError, match="tip"):
            estimator.read_tip(wrong)
    with pytest.raises(nf.InputError, match="wrench"):
        estimator.read_wrench(np.zeros(5))
