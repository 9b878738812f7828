# SPDX-License-Identifier: Apache-2.0
"""A lag between force and depth, and an average filter that is not declared, are found and reported with their size."""

import dataclasses

import numpy as np
import pytest
import strangers
from stranger_faults import plain

import needleforce as nf
from needleforce.identification.motion import DepthSignal
from needleforce.identification.one_layer.puncture_force import filter_of_the_fall
from needleforce.identification.statistics.noise import undeclared_filter
from needleforce.identification.timing import MAX_LAG_S, SIGNIFICANT, lag_search, lateness

NOISE = 4e-3


@pytest.fixture(scope="module")
def run():
    motion = nf.Motion.insert(start=-5e-3, speed=3e-3, depth=15e-3, hold=1.0, withdraw=True)
    return nf.simulate(nf.preset("paper"), motion, rate=1000.0)


def lagging(run, lag, seed):
    force = np.interp(run.time - lag, run.time, run.force) + np.random.default_rng(seed).normal(0.0, NOISE, len(run))
    return nf.Recording(time=run.time, depth=run.depth, force=force)


def reported_lag(recording):
    search = lag_search(recording, nf.segment(recording), DepthSignal(recording.depth))
    return search and search.significant


@pytest.mark.parametrize("lag", [0.05, -0.05, 0.1])
def test_a_lag_is_in_its_range(run, lag):
    for seed in range(8):
        found = reported_lag(lagging(run, lag, seed))
        assert found.low - 3.29 * found.error <= lag <= found.high + 3.29 * found.error


@pytest.mark.parametrize("preset", ["paper", "physical", "layered"])
def test_without_a_lag_none_is_reported(preset):
    motion = nf.Motion.insert(start=-5e-3, speed=2e-3, depth=15e-3, hold=1.0, withdraw=True)
    run = nf.simulate(nf.preset(preset), motion, rate=500.0)
    reported = 0
    for seed in range(40):
        reported += reported_lag(lagging(run, 0.0, seed)) is not None
    assert reported <= 2


def fast(speed, lag, seed, rate=1000.0):
    """Own insertion with limited acceleration that rests for most of the recording; friction reverses over 0.1 mm."""
    clock, braking = np.arange(0.0, 3.0, 1.0 / rate), round(0.05 * rate)
    moving = [(clock > start) & (clock < start + 20e-3 / speed) for start in (0.5, 2.0)]
    velocity = speed * np.convolve(np.subtract(*moving, dtype=float), np.full(braking, 1.0 / braking))[: len(clock)]
    depth = -5e-3 + np.cumsum(velocity) / rate
    stretch, stretched = 0.1e-3, np.zeros_like(depth)
    for k in range(1, len(depth)):
        stretched[k] = np.clip(stretched[k - 1] + depth[k] - depth[k - 1], -stretch, stretch)
    h = np.maximum(depth, 0.0)
    broken = np.maximum.accumulate(depth) > 4e-3
    force = np.where(
        broken, 18.6 * h * stretched / stretch + 0.08 * (stretched > 0.0) * (h > 0.0), 0.4 * (h / 4e-3) ** 2
    )
    force = np.interp(clock - lag, clock, force) + np.random.default_rng(seed).normal(0.0, NOISE, len(clock))
    return nf.Recording(time=clock, depth=depth, force=force)


@pytest.mark.parametrize("speed", [20e-3, 40e-3, 80e-3])
def test_a_fast_needle_that_rests_most_of_the_time_has_no_lag(speed):
    """The acceleration is no noise of the depth that a long average would have to remove."""
    assert [reported_lag(fast(speed, 0.0, seed)) for seed in range(6)] == [None] * 6
    for seed in range(3):
        found = reported_lag(fast(speed, 0.05, seed))
        assert found.low - 3.29 * found.error <= 0.05 <= found.high + 3.29 * found.error


def complete_search(recording):
    """Low, high and error [s] over both ways in which the force may follow; None for a lag not to be reported."""
    search = lag_search(recording, nf.segment(recording), DepthSignal(recording.depth))
    (first, first_half), (second, second_half) = (search.best(linearly=each) for each in (True, False))
    low, high, error = min(first, second), max(first, second), search.error(max(first_half, second_half))
    significant = -MAX_LAG_S < low and high < MAX_LAG_S and max(low, -high) > SIGNIFICANT * error
    middle = 0.5 * (low + high)
    return (low, high, error) if significant and not (middle < 0.0 and search.unloads_at_once(middle)) else None


@pytest.mark.parametrize("lag", [0.0, 0.003, -0.006, 0.05, -0.05])
def test_a_search_that_may_stop_early_reports_the_same_lags(run, lag):
    for seed in range(8):
        recording = lagging(run, lag, seed)
        early = reported_lag(recording)
        assert (early and (early.low, early.high, early.error)) == complete_search(recording)


def test_a_tip_that_unloads_at_once_is_no_lag(run):
    """Friction reverses over a stretch, a stiff tip over none: the force is ahead of friction, not of the depth."""
    start = int(np.argmax(np.gradient(run.depth) < 0.0))
    unloaded = np.where((np.arange(len(run)) >= start) & (run.depth > 0.0), 0.1, 0.0)
    force = np.where(unloaded > 0.0, run.force - unloaded, run.force)
    found = [lagging(dataclasses.replace(run, force=force), 0.0, seed) for seed in range(8)]
    assert sum(reported_lag(each) is not None for each in found) <= 2  # all 8 with one stretch for friction and tip


def test_a_recording_without_a_hold_has_no_lag_to_find():
    run = nf.simulate(nf.preset("paper"), nf.Motion.insert(start=-5e-3, speed=3e-3, depth=9e-3), rate=500.0)
    assert lag_search(run, nf.segment(run), DepthSignal(run.depth)) is None


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


def test_a_recording_that_ends_in_the_fall_shows_no_filter(run):
    """Its samples need not fill the last block of those that are averaged."""
    fast = np.linspace(run.time[0], run.time[-1], 40 * len(run))
    force = np.convolve(np.interp(fast, run.time, run.force), np.full(4000, 1.0 / 4000), "same")
    first = nf.segment(nf.Recording(time=fast, depth=np.interp(fast, run.time, run.depth), force=force)).punctures[0]
    for more in range(1, 2000, 150):
        kept = slice(0, first.end + more)
        cut = nf.Recording(time=fast[kept], depth=np.interp(fast[kept], run.time, run.depth), force=force[kept])
        filter_of_the_fall(cut, nf.segment(cut))


def late_stranger(seed, late, hold, layers=1):
    """An insertion of the trial of strangers whose depth is ``late`` [s], and its truth."""
    rng = np.random.default_rng([seed, 777])
    s = plain(rng)
    s |= {"n_layers": layers, "hold": hold, "lag": -late, "acceleration": 0.2, "noise": min(s["noise"], 5e-3)}
    s["depth_below"] = max(s["depth_below"], 2.0 * layers * s["indentation"])
    time, depth, force, truth = strangers.recorded(strangers.runs_of(s, rng), s, rng, (seed, "late", ()))
    return nf.Recording(time=time, depth=depth, force=force), truth


@pytest.mark.parametrize("late, hold", [(0.1, 1.0), (0.2, 0.0), (0.2, 1.0), (0.5, 0.0), (0.5, 1.0)])
def test_a_late_depth_is_one_cause_with_a_number(late, hold):
    recording, truth = late_stranger(3, late, hold)
    fit = nf.identify(recording)
    found = lateness(recording)
    assert -found.ends[1] <= late <= -found.ends[0]
    assert any(f"The depth is {-found.time:.3f} s" in warning for warning in fit.warnings)
    assert len(fit.recordings[0].events.punctures) == 1 and "layer" not in " ".join(fit.warnings).split("one layer")[0]
    low, high = truth.values["puncture_depth"]
    assert fit.parameters["puncture_depth"].low <= high and fit.parameters["puncture_depth"].high >= low


@pytest.mark.parametrize("layers", [1, 3])
def test_a_depth_that_is_not_late_is_not_taken_back(layers):
    for seed in range(6):
        assert lateness(late_stranger(seed, 0.0, [0.0, 0.3, 2.0][seed % 3], layers)[0]) is None


@pytest.mark.parametrize("deviation, held, seen", [(0.2, 1, False), (0.5, 10, False), (1.0, 1, True), (30.0, 10, True)])
def test_an_axis_across_that_freezes_is_named_and_a_coarse_or_slow_one_is_not(run, deviation, held, seen):
    """``deviation`` in steps of the sensor, whose mean drifts over two of them; every value logged ``held`` times."""
    draw, place, half = np.random.default_rng(11), np.arange(len(run)) // held * held, len(run) // 20 * 10
    fx = 1e-3 * np.round(np.linspace(0.0, 2.0, len(run)) + draw.normal(0.0, deviation, len(run)))[place]
    for values, expected in ((fx, False), (np.where(np.arange(len(run)) < half, fx, fx[half]), seen)):
        fit = nf.identify(dataclasses.replace(run, axes={"fx": values}), model="paper")
        named = [each for each in fit.warnings if "froze" in each]
        assert len(named) == expected and all(f"from {run.time[half]:.2f} s" in each for each in named)
