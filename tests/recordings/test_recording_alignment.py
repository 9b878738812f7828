# SPDX-License-Identifier: Apache-2.0
"""Alignment from arrival times: compared with a linear program, and coverage for simulated delays."""

import numpy as np
import pytest
from scipy.optimize import linprog

from needleforce.errors import InputError
from needleforce.recording.alignment import LiveAlignment, align


def sleeping(random, count, step):
    """A sender that wakes every 10 to 60 ms and then sends what it has, each with an exponential delay."""
    wakes = np.cumsum(random.uniform(0.01, 0.06, int(count * step / 0.01) + 10))
    sent = np.arange(count) * step
    return wakes[np.searchsorted(wakes, sent)] - sent + random.exponential(1e-4, count)


def busy(random, count, step):
    """A reader that is blocked for up to 60 ms, about once in 200 ms, and fast otherwise."""
    delays = random.exponential(5e-5, count)
    for at in np.flatnonzero(random.random(count) < step / 0.2):
        held = int(random.uniform(0.0, 0.06) / step) + 1
        delays[at : at + held] += np.arange(held, 0, -1)[: len(delays[at:])] * step
    return delays


def spells(random, count, step):
    """A computer that is busy half of the time, for seconds: each delay is 2 ms longer."""
    at, delays = 0, random.exponential(1e-4, count)
    while at < count:
        quiet, loaded = (random.exponential(0.5, 2) / step).astype(int) + 1
        delays[at + quiet : at + quiet + loaded] += 2e-3
        at += quiet + loaded
    return delays


# delays [s] above the shortest, which is zero for all
DELAYS = {
    "exponential": lambda random, count, step: random.exponential(1e-3, count),
    "gamma 1/2": lambda random, count, step: random.gamma(0.5, 1e-3, count),
    "gamma 2": lambda random, count, step: random.gamma(2.0, 1e-3, count),
    "gamma 3": lambda random, count, step: random.gamma(3.0, 1e-3, count),
    "uniform": lambda random, count, step: random.uniform(0.0, 5e-3, count),
    "heavy tail": lambda random, count, step: 1e-3 * random.pareto(1.1, count),
    "lognormal": lambda random, count, step: random.lognormal(np.log(1e-3), 1.0, count),
    "sleeping sender": sleeping,
    "busy reader": busy,
    "busy spells": spells,
}


def recorded(random, delays, seconds, rate, drift):
    device = 3.0 + np.arange(int(seconds * rate)) / rate
    truth = 1e4 + (1.0 + drift) * device
    return device, truth, truth + DELAYS[delays](random, len(device), 1.0 / rate)


@pytest.mark.parametrize("seconds, rate, drift", [(5, 100, 2e-4), (5, 1000, -2e-4), (60, 200, 2e-4)])
@pytest.mark.parametrize("delays", DELAYS)
def test_the_clock_is_within_its_uncertainty(delays, seconds, rate, drift):
    """At both ends, in at least 95 of 100 recordings; a true 95 % gives fewer than 88 in 3 of 1000 cases."""
    random, within = np.random.default_rng(7), 0
    for _ in range(100):
        device, truth, arrival = recorded(random, delays, seconds, rate, drift)
        found = align(device, arrival)
        within += np.abs(found.host(device) - truth)[[0, -1]].max() <= found.uncertainty
    assert within >= 88


@pytest.mark.parametrize("delays", DELAYS)
def test_the_uncertainty_is_not_much_larger_than_needed(delays):
    """It is below the delays themselves: a complete recording contains more information than its middle sample."""
    device, _, arrival = recorded(np.random.default_rng(3), delays, 20, 1000, 1e-4)
    late = arrival - arrival[0] - 1.0001 * (device - device[0])
    assert align(device, arrival).uncertainty < max(np.median(late - late.min()), 1.5e-4)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("delays", ["exponential", "gamma 3", "heavy tail"])
def test_the_line_is_that_of_the_linear_programme(delays, seed):
    """Below all points, with the smallest sum of distances: scipy's linprog over slope and offset."""
    device, truth, arrival = recorded(np.random.default_rng(seed), delays, 2, 60, 3e-4)
    x, y = device - 3.0, arrival - truth
    solved = linprog([-x.sum(), -len(x)], np.column_stack([x, np.ones_like(x)]), y * 1e3, bounds=(None, None))
    line = align(device, arrival).host(device) - truth
    assert line * 1e3 == pytest.approx(solved.x[1] + solved.x[0] * x, abs=1e-6)
    assert (line <= y + 1e-11).all()


def test_a_constant_part_of_the_delay_is_an_offset():
    device, _, arrival = recorded(np.random.default_rng(2), "exponential", 10, 500, 0.0)
    shift = align(device, arrival + 5e-3).host(device) - align(device, arrival).host(device)
    assert shift == pytest.approx(5e-3, abs=1e-9)


def test_exact_arrivals_give_the_clock_to_rounding():
    device = np.arange(1000) / 7000.0
    found = align(device, 1.7e9 + 0.9998 * device)
    assert np.abs(found.host(device) - (1.7e9 + 0.9998 * device)).max() <= found.uncertainty < 1e-6


@pytest.mark.parametrize("count", [1, 2, 19])
def test_few_samples_determine_no_rate(count):
    device, arrival = np.arange(count) * 0.01, 5.0 + np.arange(count) * 0.01 + 0.002
    arrival[-1] -= 0.001
    found = align(device, arrival)
    assert (found.rate, found.uncertainty, found.samples) == (1.0, np.inf, count)
    assert found.offset == pytest.approx(5.001, abs=1e-12)


def test_equal_stamps_determine_no_rate():
    found = align(np.full(50, 2.0), np.linspace(3.0, 3.1, 50))
    assert (found.rate, found.offset, found.uncertainty) == (1.0, 1.0, np.inf)


def test_a_gap_is_harmless():
    device, truth, arrival = recorded(np.random.default_rng(8), "gamma 2", 30, 500, 2e-4)
    left = (device < 6.0) | (device > 28.0)
    found = align(device[left], arrival[left])
    assert np.abs(found.host(device) - truth).max() <= found.uncertainty


def test_a_clock_set_during_the_recording_enlarges_the_uncertainty():
    device, truth, arrival = recorded(np.random.default_rng(8), "exponential", 10, 500, 0.0)
    moved = np.where(device > 8.0, 0.5, 0.0)
    found = align(device, arrival + moved)
    assert found.uncertainty > np.abs(found.host(device) - truth - moved).max() > 0.05


def test_a_restart_is_refused_with_its_sample():
    device = np.array([0.0, 0.1, 0.2, 0.0, 0.1])
    with pytest.raises(InputError, match=r"sample 3: device time is 0 after 0\.2"):
        align(device, np.arange(5.0))


@pytest.mark.parametrize(
    "device, arrival",
    [([], []), ([0.0, 1.0], [0.0]), ([0.0, np.nan], [0.0, 1.0]), ([0.0, 1.0], [0.0, np.inf])],
)
def test_invalid_clocks_are_refused(device, arrival):
    with pytest.raises(InputError):
        align(device, arrival)


@pytest.mark.parametrize("drift", [-3e-4, 3e-4])
@pytest.mark.parametrize("delays", ["exponential", "sleeping sender", "busy reader"])
def test_live_stamps_are_causal_and_close_to_the_clock(delays, drift):
    device, truth, arrival = recorded(np.random.default_rng(4), delays, 40, 250, drift)
    arrival = np.maximum.accumulate(arrival)
    live = LiveAlignment()
    stamps = np.array([live.update(*pair) for pair in zip(device, arrival)])
    assert (np.diff(stamps) >= 0.0).all() and (stamps <= arrival).all()
    settled = device > device[0] + 15.0
    assert np.abs(stamps - truth)[settled].max() < 2e-3
    assert (
        np.abs(stamps - truth)[device > device[0] + 1.0].max() < 15e-3
    )  # minimum delays of a sleeping sender, 3 ms of drift


def test_live_stamps_use_nothing_from_the_future():
    device, _, arrival = recorded(np.random.default_rng(4), "gamma 2", 20, 100, 1e-4)
    arrival = np.maximum.accumulate(arrival)
    whole, part = LiveAlignment(), LiveAlignment()
    first = [whole.update(*pair) for pair in zip(device, arrival)][:1500]
    assert first == [part.update(*pair) for pair in zip(device[:1500], arrival[:1500])]


def test_a_restart_of_the_device_is_followed_live():
    live, device = LiveAlignment(), np.arange(3000) / 100.0
    stamps = [live.update(*pair) for pair in zip(device, 50.0 + device)]
    again = [live.update(*pair) for pair in zip(device, 90.0 + device)]
    assert stamps == pytest.approx(50.0 + device, abs=1e-9)
    assert again == pytest.approx(90.0 + device, abs=1e-9)
