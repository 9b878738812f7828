# SPDX-License-Identifier: Apache-2.0
"""A lag between force and depth, and an average filter that is not declared, are found and reported with their size."""

import dataclasses

import numpy as np
import pytest

import needleforce as nf
from needleforce.identification.motion import DepthSignal
from needleforce.identification.timing import lag_of, significant_lag, undeclared_filter

NOISE = 4e-3


@pytest.fixture(scope="module")
def run():
    motion = nf.Motion.insert(start=-5e-3, speed=3e-3, depth=15e-3, hold=1.0, withdraw=True)
    return nf.simulate(nf.preset("paper"), motion, rate=1000.0)


def lagging(run, lag, seed):
    force = np.interp(run.time - lag, run.time, run.force) + np.random.default_rng(seed).normal(0.0, NOISE, len(run))
    return nf.Recording(time=run.time, depth=run.depth, force=force)


@pytest.mark.parametrize("lag", [0.05, -0.05, 0.1])
def test_a_lag_is_in_its_range(run, lag):
    for seed in range(8):
        recording = lagging(run, lag, seed)
        found = lag_of(recording, nf.segment(recording))
        assert found.significant
        assert found.low - 3.29 * found.error <= lag <= found.high + 3.29 * found.error


@pytest.mark.parametrize("preset", ["paper", "physical", "layered"])
def test_without_a_lag_none_is_reported(preset):
    motion = nf.Motion.insert(start=-5e-3, speed=2e-3, depth=15e-3, hold=1.0, withdraw=True)
    run = nf.simulate(nf.preset(preset), motion, rate=500.0)
    reported = 0
    for seed in range(40):
        recording = lagging(run, 0.0, seed)
        reported += lag_of(recording, nf.segment(recording)).significant
    assert reported <= 2


@pytest.mark.parametrize("lag", [0.0, 0.003, 0.05, -0.05])
def test_a_search_that_may_stop_early_reports_the_same_lags(run, lag):
    for seed in range(8):
        recording = lagging(run, lag, seed)
        events = nf.segment(recording)
        complete, early = lag_of(recording, events), significant_lag(recording, events, DepthSignal(recording.depth))
        assert early == (complete if complete is not None and complete.significant else None)


def test_a_tip_that_unloads_at_once_is_no_lag(run):
    """Friction reverses over a stretch, a stiff tip over none: the force is ahead of friction, not of the depth."""
    start = int(np.argmax(np.gradient(run.depth) < 0.0))
    unloaded = np.where((np.arange(len(run)) >= start) & (run.depth > 0.0), 0.1, 0.0)
    force = np.where(unloaded > 0.0, run.force - unloaded, run.force)
    found = [lagging(dataclasses.replace(run, force=force), 0.0, seed) for seed in range(8)]
    lags = [significant_lag(each, nf.segment(each), DepthSignal(each.depth)) for each in found]
    assert sum(lag is not None for lag in lags) <= 2  # all 8 with one stretch for friction and tip


def test_a_recording_without_a_hold_has_no_lag_to_find():
    run = nf.simulate(nf.preset("paper"), nf.Motion.insert(start=-5e-3, speed=3e-3, depth=9e-3), rate=500.0)
    assert lag_of(run, nf.segment(run)) is None


@pytest.mark.parametrize("length", [4, 10, 25])
def test_an_average_filter_is_found_from_the_noise(length):
    found = []
    for seed in range(30):
        white = np.random.default_rng(seed).standard_normal(3000 + length)
        found.append(undeclared_filter(np.convolve(white, np.full(length, 1.0 / length), "valid"), 1))
    seen = [each for each in found if each]
    assert len(seen) >= 24 and np.median(seen) == pytest.approx(length, rel=0.15)
    white = np.random.default_rng(1).standard_normal(3000 + length)
    assert not undeclared_filter(np.convolve(white, np.full(length, 1.0 / length), "valid"), length)


def test_white_and_autoregressive_noise_are_no_filter():
    found = 0
    for seed in range(200):
        white = np.random.default_rng(seed).standard_normal(2000)
        found += undeclared_filter(white, 1) > 0
    assert found <= 2
    ar1 = np.random.default_rng(5).standard_normal(3000)
    for k in range(1, len(ar1)):
        ar1[k] += 0.9 * ar1[k - 1]
    assert not undeclared_filter(ar1, 1)


def test_identify_reports_both_with_their_size(run):
    fit = nf.identify(lagging(run, 0.05, 0), model="paper")
    assert any("behind the depth" in note for note in fit.recordings[0].notes)
    assert any("not of the same instant" in warning for warning in fit.warnings)
