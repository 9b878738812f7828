# SPDX-License-Identifier: Apache-2.0
"""Zeros that are not zero, a sign that is opposite, a zero that moves in tissue, and LuGre friction: by formulas."""

import math

import numpy as np
import pytest

import needleforce as nf

COEFFICIENT = 2.0 / math.pi * 1.2e5 * math.tan(math.radians(15))


def insertion(rate, end=12e-3, seed=0):
    """Depth and force of the source paper's formulas, at 2 mm/s with noise of 1 mN; pierced at 5 mm."""
    depth = np.arange(-2e-3, end, 2e-3 / rate)
    force = np.where(depth < 5e-3, COEFFICIENT * np.maximum(depth, 0.0) ** 2, 0.1 + 40.0 * depth)
    return depth, force + 1e-3 * np.random.default_rng(seed).normal(size=len(depth))


def held(depth, force, rate, place, travel, **options):
    """An identifier that has seen the stream until this place, and whether its interval holds what comes."""
    online, i = nf.OnlineIdentifier(**options), int(np.searchsorted(depth, place))
    for f, z in zip(force[:i], depth[:i]):
        online.step(float(f), float(z), 1.0 / rate)
    ahead = online.ahead(travel)
    return online, ahead, bool((ahead.low <= np.interp(ahead.depth, depth, force)).all()) and bool(
        (np.interp(ahead.depth, depth, force) <= ahead.high).all()
    )


@pytest.mark.parametrize("zero", [-0.1, 0.05, 0.1])
def test_force_and_stiffness_are_above_the_zero_that_free_travel_showed(zero):
    depth, force = insertion(1000.0)
    _, ahead, good = held(depth, force + zero, 1000.0, -1e-3, 0.5e-3)
    assert good and ahead.high[-1] - ahead.low[-1] < 0.05
    online, _, good = held(depth, force + zero, 1000.0, 4e-3, 0.5e-3)
    assert good
    assert online.parameters.stiffness_coefficient.value == pytest.approx(COEFFICIENT, rel=0.05)


@pytest.mark.parametrize("place", [2e-3, 4e-3, 8e-3])
def test_tension_as_positive_is_stated_and_is_never_free_travel(place):
    depth, force = insertion(100.0)
    online, ahead, good = held(depth, -force, 100.0, place, 0.5e-3)
    assert online.status == "wrong_sign" and online.regime == "unknown" and good
    assert ahead.high[-1] - ahead.low[-1] > abs(ahead.force[-1])
    _, freely = insertion(100.0)
    assert held(depth, freely, 100.0, place, 0.5e-3)[0].status == "ok"


@pytest.mark.parametrize("rate", [100.0, 1000.0])
@pytest.mark.parametrize("step", [-0.4, -0.2, -0.1, 0.1, 0.25])
def test_a_zero_that_moves_while_sliding_is_never_in_a_narrow_wrong_interval(step, rate):
    depth, force = insertion(rate)
    moved = force + step * (depth > 8e-3)
    for after in (0.05e-3, 0.3e-3, 1e-3, 2e-3):
        assert held(depth, moved, rate, 8e-3 + after, 1e-3)[2], after
    widest = held(depth, moved, rate, 8.3e-3, 1e-3)[1]
    assert widest.high[-1] - widest.low[-1] > 2.0 * abs(step)
