# SPDX-License-Identifier: Apache-2.0
"""Intervals hold more than noise where a recording shows it: a lag, a filter, unequal strokes, the choice of a law."""

import functools

import numpy as np
import pytest

import needleforce as nf
from needleforce.identification.statistics.noise import slow_noise

SPEED, RATE, NOISE = 3e-3, 500.0, 4e-3
FRICTION, CUTTING, CONTACT, PUNCTURE = 25.0, 0.08, 1.0e-3, 5.0e-3


def cone(h):
    return 0.5 * (h / 4e-3) ** 2


def cycle(seed, *, loading=cone, grip=0.0, noise=NOISE, lag=0.0, average=1):
    """Own one-layer cycle: loading up to the puncture, friction and cutting after it, 0.6 s of rest, withdrawal. The
    surface may hold the shaft with a constant force ``grip`` [N] whenever it slides out."""
    legs = [np.arange(-4e-3, 14e-3, SPEED / RATE), np.full(int(0.6 * RATE), 14e-3)]
    legs.append(np.arange(14e-3, -4e-3, -SPEED / RATE))
    depth, inside = np.concatenate(legs), len(legs[0])
    h = np.maximum(depth - CONTACT, 0.0)
    force = np.where(depth < PUNCTURE, loading(h), FRICTION * h + CUTTING)
    slid = np.clip((14e-3 - depth) / 0.1e-3, 0.0, 1.0)  # friction reverses over 0.1 mm
    out = np.where(h > 0.0, FRICTION * h * (1.0 - 2.0 * slid) + CUTTING * (1.0 - slid) - grip * slid, 0.0)
    force[inside:] = out[inside:]
    time, random = np.arange(len(depth)) / RATE, np.random.default_rng(seed)
    force = np.interp(time - lag, time, force) + random.normal(0.0, noise, len(depth))
    force = np.convolve(
        np.concatenate([np.full(average - 1, force[0]), force]), np.full(average, 1.0 / average), "valid"
    )
    return nf.Recording(time=time, depth=depth, force=force)


@functools.cache
def fitted(seed, **options):
    """The default fit of a cycle, which several tests look at."""
    return nf.identify(cycle(seed, **options))


@pytest.fixture(scope="module")
def seeds(many):
    return range(many(4, 12))


@pytest.fixture(scope="module")
def held(seeds):
    """``held(name, value, ...)``: share of the recordings whose interval holds the value."""

    def share(name, value, **options):
        found = [fitted(seed, **options).parameters[name] for seed in seeds]
        return np.mean([each.low <= value <= each.high for each in found])

    return share


@pytest.mark.parametrize("lag", [0.04, -0.04])
def test_depths_hold_the_truth_behind_a_lag(held, lag):
    assert held("contact_depth", CONTACT, lag=lag) >= 0.9
    assert held("puncture_depth", PUNCTURE, lag=lag) >= 0.9


def test_depths_hold_the_truth_behind_an_undeclared_filter_that_is_found(seeds):
    fits = [fitted(seed, average=20) for seed in seeds]
    found = [fit for fit in fits if any("behind an average filter" in note for note in fit.recordings[0].notes)]
    assert len(found) >= len(seeds) // 2  # the others have too few free samples to show it, and are not held
    for fit in found:
        for name, value in (("contact_depth", CONTACT), ("puncture_depth", PUNCTURE)):
            assert fit.parameters[name].low <= value <= fit.parameters[name].high


def test_friction_holds_the_truth_where_the_surface_grips_the_shaft(held):
    assert held("friction_per_length", FRICTION, grip=0.1) >= 0.9
    notes = fitted(0, grip=0.1).recordings[0].notes
    assert any("Insertion and withdrawal disagree on where" in note and "surface may hold" in note for note in notes)


def test_strokes_that_agree_are_not_said_to_disagree(seeds):
    notes = [fitted(seed).recordings[0].notes for seed in seeds]
    assert sum(any("disagree" in note for note in found) for found in notes) <= 2


@pytest.mark.parametrize(("share", "least"), [(0.15, 0.6), (0.3, 0.8), (0.5, 0.8)])
def test_the_contact_carries_the_choice_of_the_law(held, share, least):
    """The less a polynomial differs from a cone, the less of its weight is left."""

    def polynomial(h):
        return 0.5 * (share * h / 4e-3 + (1.0 - share) * (h / 4e-3) ** 2)

    assert held("contact_depth", CONTACT, loading=polynomial, noise=15e-3) >= least


def test_a_law_given_by_name_is_not_a_choice():
    found = nf.identify(cycle(0), model="paper").parameters.contact_depth
    chosen = fitted(0).parameters.contact_depth
    assert found.high - found.low < chosen.high - chosen.low


def test_slow_noise_is_that_of_white_noise_but_for_one_in_twenty():
    line, found = np.column_stack([np.ones(3000), np.arange(3000.0)]), []
    for seed in range(400):
        white = np.random.default_rng(seed).standard_normal(3000)
        found.append(slow_noise(white - white.mean(), line, 1.0))
    assert 0.02 <= np.mean([each > 1.0 for each in found]) <= 0.09


def test_slow_noise_finds_a_misfit_below_the_noise_of_a_sample():
    place = np.arange(3000.0)
    line, wave = np.column_stack([np.ones(3000), place]), 0.15 * np.sin(2.0 * np.pi * place / 1000.0)
    for seed in range(10):
        assert slow_noise(np.random.default_rng(seed).standard_normal(3000) + wave, line, 1.0) > 3.0
