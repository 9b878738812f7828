# SPDX-License-Identifier: Apache-2.0
"""Parameters while the needle moves, against closed forms, and what is expected ahead."""

import math

import numpy as np
import pytest

import needleforce as nf

ALPHA = math.radians(15)


def paper_force(depth, modulus=1.2e5, puncture=5e-3, friction=40.0, cutting=0.1):
    """The source paper's model on the way in, by its formulas."""
    h = np.maximum(depth, 0.0)
    contact = 2.0 / np.pi * modulus * np.tan(ALPHA) * h**2
    return np.where(h < puncture, contact, np.where(h > 0, cutting + friction * h, 0.0))


def inwards(start=-2e-3, end=20e-3, speed=2e-3, rate=1000.0):
    time = np.arange(0.0, (end - start) / speed, 1.0 / rate)
    return start + speed * time, 1.0 / rate


def watched(online, force, depth, dt):
    events = [online.step(float(f), float(z), dt) for f, z in zip(force, depth, strict=True)]
    return [each for each in events if each is not None]


@pytest.mark.parametrize("prior", [None, "paper"])
def test_the_papers_parameters_are_recovered_from_its_own_force(prior):
    depth, dt = inwards()
    noise = 1e-3 * np.random.default_rng(0).normal(size=len(depth))
    online = nf.OnlineIdentifier(prior=None if prior is None else nf.preset(prior))
    events = watched(online, paper_force(depth) + noise, depth, dt)
    assert [each.kind for each in events] == ["contact", "puncture", "sliding"]
    found, coefficient = online.parameters, 2.0 / np.pi * 1.2e5 * np.tan(ALPHA)
    stiffness = found.stiffness_coefficient if prior is None else found.reduced_modulus
    assert stiffness.value == pytest.approx(coefficient if prior is None else 1.2e5, rel=0.05)
    assert found.puncture_depth.value == pytest.approx(5e-3, abs=0.1e-3)
    if prior is not None:
        assert found.friction_per_length.low < 40.0 < found.friction_per_length.high
        assert found.cutting_force.low < 0.1 < found.cutting_force.high
    ahead = online.ahead(2e-3)
    expected = paper_force(np.array([depth[-1] + 2e-3]))[0]
    assert ahead.low[-1] < expected < ahead.high[-1]
    assert ahead.status == "ok"
    assert ahead.regime == "sliding"


def test_bad_samples_are_stated_and_nothing_is_confident():
    online = nf.OnlineIdentifier()
    assert online.step(math.nan, 0.0, 0.01) is None
    assert online.status == "not_finite"
    assert online.step(0.0, 0.0, -1.0) is None
    assert online.status == "bad_time"
    with pytest.raises(nf.InputError, match="distance"):
        online.ahead(-1.0)
    with pytest.raises(nf.InputError, match="prior"):
        nf.OnlineIdentifier(prior=3)
