# SPDX-License-Identifier: Apache-2.0
"""A contact that yields after the puncture: the engine against an independent layer, and the shipped preset."""

import itertools

import numpy as np
import pytest
from reference_rupture import YieldingLayer

import needleforce as nf

PUNCTURE, COEFFICIENT = 8e-3, 2e4


def engine(grip, spring, delta, z_r, q):
    return nf.Model(
        nf.laws.PowerLaw(reference_force=COEFFICIENT, exponent=2.0, reference_depth=1.0),
        nf.laws.PunctureDepth(PUNCTURE),
        nf.laws.YieldingTissue(grip, spring, delta, z_r, brittleness=q),
        nf.laws.NoCutting(),
    )


def legs(random, n=12):
    """Depths [m] of random legs about the puncture, in steps of a micrometre or more, and back out."""
    ends = [-1e-3, *PUNCTURE + random.uniform(-4e-3, 3e-3, n) * random.uniform(0.0, 1.0, n), -30e-3]
    return np.concatenate([np.linspace(a, b, 400)[1:] for a, b in itertools.pairwise(ends)])


@pytest.mark.parametrize("q", [0.0, 0.7, 5.0])
@pytest.mark.parametrize("grip, spring, z_r", [(140.0, 220.0, 1e-3), (20.0, 220.0, -2e-3), (25.0, 30.0, -20e-3)])
def test_the_engine_is_the_layer_of_the_specification(grip, spring, z_r, q):
    for seed in range(3):
        depth = legs(np.random.default_rng(seed))
        model, layer = (
            engine(grip, spring, 0.4e-3, z_r, q),
            YieldingLayer(COEFFICIENT, PUNCTURE, grip, spring, 0.4e-3, z_r, q),
        )
        found = nf.Insertion(model, max_speed=np.inf).run(depth, None, np.full(len(depth), 1e-3))["force"]
        np.testing.assert_allclose(found, [layer.step(z) for z in depth], atol=1e-12 * COEFFICIENT * PUNCTURE**2)


GRIP, CUTTING, DELTA = 30.0, 0.25, 0.6e-3


def with_fibres(exponent, grip=GRIP):
    """A cone's contact that ruptures gradually, with short presliding and unloading."""
    return nf.Model(
        nf.laws.PowerLaw(reference_force=COEFFICIENT, exponent=2.0, reference_depth=1.0),
        nf.laws.PunctureDepth(PUNCTURE),
        nf.laws.YieldingCoulomb(grip, 1e-7, DELTA, exponent),
        nf.laws.ConstantCutting(CUTTING, 1e-7),
    )


def by_formula(exponent, depth, deepest, grip=GRIP):
    """The force of that model at a depth behind the deepest one, or at it.

    The contact's energy is that of its work, F h / 3, less half of the cut's force over the indentation; if the share w
    that it keeps has more, it recedes faster than the tip.
    """
    peak = COEFFICIENT * PUNCTURE**2
    intact = np.exp(-((np.maximum(deepest - PUNCTURE, 0.0) / DELTA) ** exponent))
    share = 1.0 - (grip * PUNCTURE + CUTTING) / peak
    recession = max(1.0, share * peak / 3.0 / (peak / 3.0 - 0.5 * CUTTING))
    indentation = np.maximum(deepest - recession * (deepest - depth), 0.0)
    contact = share * intact * COEFFICIENT * indentation**2
    cut = np.where(depth < deepest, -grip * depth, grip * depth + CUTTING)
    return np.where(deepest > PUNCTURE, cut + contact, COEFFICIENT * depth**2)


@pytest.mark.parametrize("grip", [0.0, GRIP])
@pytest.mark.parametrize("exponent", [1.0, 2.0, 3.5])
def test_the_contact_of_yielding_coulomb_is_lost_as_its_fibres_break(exponent, grip):
    depth = np.linspace(0.0, 12e-3, 4001)
    back = np.linspace(9e-3, PUNCTURE, 4001)  # above, the cut that has begun there unloads
    engine = nf.Insertion(with_fibres(exponent, grip), max_speed=np.inf)
    force = engine.run(depth, None, np.full(len(depth), 1e-3))["force"]
    np.testing.assert_allclose(force, by_formula(exponent, depth, depth, grip), atol=1e-12)
    engine.reset()
    engine.run(depth[depth <= 9e-3], None, np.full((depth <= 9e-3).sum(), 1e-3))
    force = engine.run(back, None, np.full(len(back), 1e-3))["force"]
    np.testing.assert_allclose(force[1:], by_formula(exponent, back, 9e-3, grip)[1:], atol=1e-12)


def test_yielding_coulomb_is_continuous_and_the_same_in_few_steps():
    model = with_fibres(2.0)
    few, many = (nf.Insertion(model, max_speed=np.inf) for _ in range(2))
    depth = np.array([0.0, 4e-3, 7.9e-3, 8.3e-3, 9.1e-3])
    coarse = few.run(depth, None, np.full(len(depth), 1.0))["force"]
    fine = np.linspace(0.0, 9.1e-3, 91001)
    force = many.run(fine, None, np.full(len(fine), 1e-3))["force"]
    np.testing.assert_allclose(coarse, np.interp(depth, fine, force), atol=1e-9)
    steepest = 2.0 * COEFFICIENT * PUNCTURE**2 / DELTA  # twice the peak over the length of the rupture
    assert np.abs(np.diff(force)).max() < 1e-7 * steepest


def largest_fall(name, speed):
    """The largest change [N] of the force of a preset's first layer in a millisecond at a speed [m/s], and the peak."""
    model = nf.preset(name).replace(deeper=())
    depth = np.arange(7.9e-3, 12e-3, speed * 1e-3)
    depth = np.concatenate([np.arange(-1e-3, 7.9e-3, 2e-5), depth])
    force = nf.Insertion(model).run(depth, None, np.full(len(depth), 1e-3))["force"]
    return np.abs(np.diff(force)).max(), force.max()


@pytest.mark.parametrize("speed", [1e-3, 3e-3, 30e-3, 0.3])
def test_the_preset_gives_way_no_faster_than_its_rupture_time(speed):
    fall, peak = largest_fall("layered_yielding", speed)
    assert fall < (1.0 - np.exp(-1.0 / 3.0)) * peak + 0.22e3 * speed * 1e-3
    abrupt, _ = largest_fall("layered", speed)
    if speed <= 3e-3:
        assert fall < 0.1 * abrupt
