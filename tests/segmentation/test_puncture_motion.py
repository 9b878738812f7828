# SPDX-License-Identifier: Apache-2.0
"""Punctures in recordings that nobody tuned for: pull-backs, rests and changes of speed right behind a rupture, an
oscillating cutting force, gradual ruptures, and any rate, quantum and length of a recording.

The force is simulated here: a loading by the square of the depth that ruptures, friction of the shaft as a row of
elastic elements that are stretched by at most 0.1 mm, and a cutting force where the needle is deeper than before."""

import functools

import numpy as np
import pytest

import needleforce as nf
from needleforce.recording.force_signal import outliers

AT, PEAK, CUT, FRICTION, STRETCH = 4e-3, 0.30, 0.08, 12.0, 0.1e-3  # [m], [N], [N], [N/m], [m]
NEAR = 0.15e-3  # [m]


def path(legs, rate, start=-3e-3):
    """Depth [m] through (goal [m], speed [m/s]); a goal of None is a rest of so many seconds."""
    parts, at = [np.full(int(0.1 * rate), start)], start
    for goal, value in legs:
        if goal is None:
            parts.append(np.full(max(int(value * rate), 1), at))
            continue
        n = max(int(abs(goal - at) / value * rate), 1)
        parts.append(at + (goal - at) * np.arange(1, n + 1) / n)
        at = goal
    return np.concatenate(parts)


def friction(depth, stretch=STRETCH, node=50e-6):
    """Force [N] of the elements between the surface and the tip, each dragged along beyond ``stretch``."""
    place = np.arange(0.0, max(depth.max(), node), node)
    u, out, deepest = np.zeros(len(place)), np.zeros(len(depth)), 0.0
    for k in range(1, len(depth)):
        inside = place < depth[k]
        u = np.clip(u + depth[k] - depth[k - 1], -stretch, stretch)
        u[(place >= deepest) & inside] = stretch
        u[~inside] = 0.0
        deepest, out[k] = max(deepest, depth[k]), FRICTION * node * (u[inside] / stretch).sum()
    return out


def tissue(depth, *, at=AT, peak=PEAK, travel=0.0, wave=0.0, wavelength=1e-3):
    """Force [N] of a tissue that ruptures ``at`` a depth, over ``travel``; the cutting force may oscillate."""
    top = np.maximum.accumulate(depth)
    broken = np.clip((top - at) / travel, 0.0, 1.0) if travel else (top > at).astype(float)
    loading = peak * (np.clip(depth, 0.0, None) / at) ** 2
    cutting = CUT * (1.0 + wave * np.sin(2.0 * np.pi * top / wavelength)) * (depth > top - 1e-9)
    return loading * (1.0 - broken) + broken * (cutting + friction(depth))


def recording(depth, force, rate, seed=0, noise=3e-3, quantum=0.0, depth_quantum=0.0):
    force = force + np.random.default_rng(seed).normal(0.0, noise, len(force))
    rounded = [q * np.round(x / q) if q else x for x, q in ((depth, depth_quantum), (force, quantum))]
    return nf.Recording(time=np.arange(len(depth)) / rate, depth=rounded[0], force=rounded[1])


@functools.cache
def along(legs, rate, **kind):
    """Depth and force without noise, which the seeds share."""
    depth = path(legs, rate)
    return depth, tissue(depth, **kind)


def punctures(legs, rate=1000.0, seed=0, noise=3e-3, quantum=0.0, depth_quantum=0.0, **kind):
    depth, force = along(tuple(legs), rate, **kind)
    events = nf.segment(recording(depth, force, rate, seed, noise, quantum, depth_quantum))
    return [each.depth for each in events.punctures]


OUT = (-3e-3, 3e-3)


@pytest.mark.parametrize("behind", [0.02e-3, 0.05e-3, 0.2e-3])
@pytest.mark.parametrize("back", [0.05e-3, 0.4e-3, 1.5e-3])
def test_a_pull_back_right_behind_a_rupture_does_not_hide_it(behind, back):
    turn = AT + behind
    for seed in range(4):
        found = punctures([(turn, 3e-3), (turn - back, 3e-3), (10e-3, 3e-3), OUT], seed=seed)
        assert found == [pytest.approx(AT, abs=NEAR)], seed


@pytest.mark.parametrize("back", [0.05e-3, 0.15e-3, 0.5e-3, 2e-3])
@pytest.mark.parametrize("noise", [0.3e-3, 5e-3])
@pytest.mark.parametrize("jitter", [0.0, 2e-6])
def test_friction_that_reverses_in_a_pull_back_is_no_puncture(back, noise, jitter):
    turns = (5e-3, 6.1e-3, 7.3e-3, 8.9e-3)
    legs = [leg for turn in turns for leg in ((turn, 3e-3), (turn - back, 2e-3))]
    depth, force = along((*legs, (10e-3, 3e-3), OUT), 1000.0)
    for seed in range(4):
        read = depth + np.random.default_rng(seed + 50).normal(0.0, jitter, len(depth))
        events = nf.segment(recording(read, force, 1000.0, seed, noise))
        assert [each.depth for each in events.punctures] == [pytest.approx(AT, abs=NEAR)], seed


def test_a_rupture_while_the_needle_slows_to_a_stop_is_found():
    """A force in proportion to the speed would fall gradually; this one falls at once."""
    speeds = np.concatenate([np.full(2000, 3e-3), np.linspace(3e-3, 0.2e-3, 800), np.full(1000, 0.2e-3)])
    depth = np.cumsum(speeds) / 1000.0
    at = float(depth[2500])
    depth = np.concatenate([depth - 3e-3, np.full(300, depth[-1] - 3e-3)])
    force = tissue(depth, at=at - 3e-3)
    for seed in range(4):
        run = recording(depth, force, 1000.0, seed)
        assert [each.depth for each in nf.segment(run).punctures] == [pytest.approx(at - 3e-3, abs=NEAR)]


def test_a_rest_that_relaxes_the_force_is_no_puncture():
    rate, depth = 500.0, path([(6e-3, 2e-3), (None, 2.0), (7e-3, 2e-3), (None, 2.0), (9e-3, 2e-3)], 500.0)
    moving = np.concatenate([[True], np.diff(depth) > 0.0])
    force = 30.0 * np.clip(depth, 0.0, None)
    for k in np.flatnonzero(~moving & (depth > 1e-3)):
        force[k:] -= 0.3e-3  # a loss that remains, of 0.3 N in each rest
    for seed in range(4):
        assert not nf.segment(recording(depth, force, rate, seed)).punctures


@pytest.mark.parametrize("wavelength", [0.2e-3, 0.5e-3, 1e-3])
@pytest.mark.parametrize("wave", [0.2, 0.6])
def test_an_oscillating_cutting_force_has_one_puncture(wavelength, wave):
    for seed in range(3):
        for slows in (False, True):
            end = [(11e-3, 0.5e-3)] if slows else [(11e-3, 3e-3)]
            found = punctures([(9e-3, 3e-3), *end, OUT], seed=seed, noise=1e-3, wave=wave, wavelength=wavelength)
            assert found == [pytest.approx(AT, abs=NEAR)], (seed, slows)


def test_a_rupture_within_an_oscillation_is_found():
    """A second layer ruptures amid the oscillating cutting force of the first."""
    depth = path([(14e-3, 3e-3), OUT], 1000.0)
    second = np.where(np.maximum.accumulate(depth) < 10e-3, 0.4 * (np.clip(depth - 7e-3, 0.0, None) / 3e-3) ** 2, 0.0)
    force = tissue(depth, wave=0.4, wavelength=0.7e-3) + second
    for seed in range(4):
        found = [each.depth for each in nf.segment(recording(depth, force, 1000.0, seed, 1e-3)).punctures]
        assert found == [pytest.approx(AT, abs=NEAR), pytest.approx(10e-3, abs=NEAR)], seed


def test_three_layers_of_equal_ruptures_are_no_oscillation():
    depth = path([(16e-3, 3e-3), OUT], 1000.0)
    force = tissue(depth)
    for top in (4e-3, 8e-3):
        force = force + np.where(
            (depth > top) & (np.maximum.accumulate(depth) < top + AT), PEAK * ((depth - top) / AT) ** 2, 0.0
        )
    found = [each.depth for each in nf.segment(recording(depth, force, 1000.0)).punctures]
    assert found == [pytest.approx(z, abs=NEAR) for z in (4e-3, 8e-3, 12e-3)]


@pytest.mark.parametrize("travel", [0.3e-3, 0.8e-3, 1.2e-3])
@pytest.mark.parametrize("noise", [0.3e-3, 3e-3])
def test_the_puncture_of_a_gradual_rupture_is_its_peak(travel, noise):
    """With little noise and much: near the greatest force, and hardly below it."""
    depth = path([(10e-3, 3e-3), OUT], 1000.0)
    force = tissue(depth, travel=travel)
    top = int(np.argmax(np.where(depth < AT + travel, force, 0.0)))
    for seed in range(3):
        (found,) = nf.segment(recording(depth, force, 1000.0, seed, noise)).punctures
        assert found.depth == pytest.approx(depth[top], abs=0.15e-3)
        assert found.force == pytest.approx(force[top], abs=max(0.01 * force[top], 1.5 * noise))


@pytest.mark.parametrize("rate", [100.0, 300.0])
@pytest.mark.parametrize("deep", [6e-3, 7e-3])
def test_what_a_rupture_does_to_a_short_smooth_stroke_is_no_texture(deep, rate):
    """A fall of 27 of 160 mN over 0.8 mm is far above 0.5 mN of noise; 17 of 24 were taken for texture."""
    legs = ((deep, 1.5e-3), OUT)
    found = [punctures(legs, rate=rate, seed=seed, noise=0.5e-3, travel=0.8e-3, peak=0.16) for seed in range(6)]
    assert sum(len(each) == 1 for each in found) >= 5


def test_the_peak_of_a_plateau_is_at_its_edge():
    """A saturated sensor, or correlated noise: the highest sample before the fall is not its start."""
    depth = path([(10e-3, 3e-3), OUT], 1000.0)
    force = np.minimum(tissue(depth), 0.25)
    run = recording(depth, force, 1000.0, noise=0.0)
    assert [each.depth for each in nf.segment(run).punctures] == [pytest.approx(AT, abs=0.02e-3)]


def test_the_end_of_a_steep_rise_is_no_outlier():
    """Ten samples from contact to rupture: the highest is far from all its neighbours, and in line with the rise."""
    rate, speed = 100.0, 20e-3
    for seed in range(10):
        depth = path([(12e-3, speed), (-3e-3, speed)], rate)
        run = recording(depth, tissue(depth), rate, seed, noise=2e-3)
        assert not len(outliers(run.force))
        assert [each.depth for each in nf.segment(run).punctures] == [pytest.approx(AT, abs=speed / rate)], seed


def test_a_touch_before_the_insertion_leaves_the_puncture():
    """The needle touches, comes out, and punctures in the next stroke."""
    found = punctures([(1.5e-3, 3e-3), (-1.5e-3, 3e-3), (10e-3, 3e-3), OUT])
    assert found == [pytest.approx(AT, abs=NEAR)]


@pytest.mark.parametrize(
    ("rate", "quantum", "depth_quantum"),
    [
        (50.0, 0.0, 0.0),
        pytest.param(10_000.0, 0.0, 0.0, marks=pytest.mark.long),
        (1000.0, 0.1, 0.0),
        (1000.0, 0.0, 0.1e-3),
        (100.0, 0.1, 0.1e-3),
    ],
)
def test_any_rate_and_quantum(rate, quantum, depth_quantum):
    """A rupture of about 0.2 N of 0.3 N, and then a stroke that does not rupture."""
    for seed in range(4):
        coarse = {"rate": rate, "seed": seed, "quantum": quantum, "depth_quantum": depth_quantum}
        found = punctures([(10e-3, 3e-3), OUT], **coarse)
        assert found == [pytest.approx(AT, abs=NEAR + depth_quantum)], seed
        assert not punctures([(3.5e-3, 3e-3), OUT], **coarse), seed


def test_a_recording_of_a_hundred_samples():
    """13 mm in 50 samples, and back."""
    rate, speed = 10.0, 2.6e-3
    for seed in range(10):
        found = punctures([(10e-3, speed), (-3e-3, speed)], rate=rate, seed=seed)
        assert found == [pytest.approx(AT, abs=2.0 * speed / rate)], seed
        assert not punctures([(3.5e-3, speed / 2), (-3e-3, speed / 2)], rate=rate, seed=seed), seed
