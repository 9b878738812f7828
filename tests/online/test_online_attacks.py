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
    return (
        online,
        ahead,
        bool((ahead.low <= np.interp(ahead.depth, depth, force)).all())
        and bool((np.interp(ahead.depth, depth, force) <= ahead.high).all()),
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


def swaying(law, rate=500.0):
    """Depth and force through a puncture at 4 mm, swaying from 4 s on; integrated at 10 kHz."""
    time = np.arange(0.0, 9.0, 1e-4)
    sway = np.sin(np.pi * (time - 4.0)) + 0.2 * np.sin(3.4 * np.pi * (time - 4.0))
    depth = -2e-3 + 2e-3 * time + 1.5e-3 * sway * np.clip(time - 4.0, 0.0, 1.0)
    model = nf.Model(nf.laws.Cone(1.2e5, 0.26), nf.laws.PunctureDepth(4e-3), law, nf.laws.ConstantCutting(0.1))
    force = nf.Insertion(model).run(depth, np.gradient(depth, time), np.full(len(time), 1e-4))["force"]
    every = round(1e4 / rate)
    return depth[::every], force[::every] + 3e-3 * np.random.default_rng(0).normal(size=len(time[::every]))


def test_the_lugre_model_holds_what_comes_and_what_the_friction_is():
    depth, force = swaying(nf.laws.Lugre(2e5, 300.0, 500.0, 18.0, 25.0))
    online, held_here = nf.OnlineIdentifier(model="lugre"), []
    for i, (f, z) in enumerate(zip(force, depth)):
        online.step(float(f), float(z), 2e-3)
        if i < 3000 or i % 50:
            continue
        ahead = online.ahead(3e-4)
        way = np.sign(ahead.depth[-1] - ahead.depth[0])
        j = i + int(np.argmax(way * (depth[i:] - ahead.depth[-1]) >= 0.0))
        if j > i and (way * np.diff(depth[i : j + 1]) > 0.0).all():
            held_here.append(ahead.low[-1] <= force[j] <= ahead.high[-1])
    assert np.mean(held_here) > 0.85
    found = online.parameters
    assert found.bristle_stiffness.low < 2e5 < found.bristle_stiffness.high
    assert found.coulomb.low < 18.0 < found.coulomb.high
    assert online.copy().ahead(1e-3).to_json() == online.ahead(1e-3).to_json()
    with pytest.raises(nf.InputError, match="model"):
        nf.OnlineIdentifier(model="dahl")
