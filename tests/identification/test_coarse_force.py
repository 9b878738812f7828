# SPDX-License-Identifier: Apache-2.0
"""A force given in coarse steps: what rounding hides is in the intervals, and a step is no saturated sensor."""

import numpy as np
import pytest

import needleforce as nf

MOTION = nf.Motion.insert(start=-4e-3, speed=3e-3, depth=15e-3, hold=1.5, withdraw=True)
RUN = nf.simulate(nf.preset("paper"), MOTION, rate=500.0)
LAYER = nf.preset("paper").layers[0]
SEEDS = 12


def rounded(step, noise, seed, most=np.inf):
    """The paper's insertion in steps [N], with the zero at another place in a step for each seed; no code is above
    ``most`` [N]."""
    zero = 3e-3 * seed
    force = RUN.force + np.random.default_rng(seed).normal(0.0, noise, len(RUN)) + zero
    codes = np.minimum(np.round(force / step), np.floor((most + zero) / step))
    return nf.Recording(time=RUN.time, depth=RUN.depth, force=codes * step - zero)


@pytest.mark.parametrize(("step", "noise"), [(5e-3, 0.5e-3), (20e-3, 4e-3)])
def test_intervals_hold_what_rounding_hides(step, noise, many):
    angle, modulus = LAYER.stiffness.half_angle, LAYER.stiffness.reduced_modulus
    truth = {
        "contact_depth": 0.0,
        "puncture_depth": LAYER.puncture.depth,
        "puncture_force": 2.0 / np.pi * modulus * np.tan(angle) * LAYER.puncture.depth**2,
        "friction_per_length": LAYER.friction.per_length,
        "cutting_force": LAYER.cutting.force,
    }
    held, count = dict.fromkeys(truth, 0), many(6, SEEDS)
    for seed in range(count):
        parameters = nf.identify(rounded(step, noise, seed)).parameters
        for name, value in truth.items():
            held[name] += parameters[name].low <= value <= parameters[name].high
    assert min(held.values()) >= 0.6 * count, held  # contact and puncture force: 4 and 5 of 12 without


@pytest.mark.parametrize("step", [5e-3, 20e-3])
def test_a_step_at_rest_is_no_saturation(step, many):
    for seed in range(many(4, SEEDS)):
        notes = [" ".join(nf.segment(rounded(step, 0.5e-3, seed, most)).notes) for most in (np.inf, 0.28)]
        assert "saturated" not in notes[0]
        assert "saturated" in notes[1]


@pytest.mark.parametrize("held", ["depth quantum of 0.1 mm", "depth at 20 Hz"])
def test_a_depth_in_coarse_steps_is_fitted_and_its_steps_are_in_the_interval(held, many):
    inside, count = 0, many(4, SEEDS)
    for seed in range(count):
        random = np.random.default_rng(seed)
        depth = RUN.depth + 0.1e-3 * random.uniform()
        depth = np.round(depth / 0.1e-3) * 0.1e-3 if "quantum" in held else np.repeat(depth[::25], 25)[: len(RUN)]
        force = RUN.force + random.normal(0.0, 2e-3, len(RUN))
        at = nf.identify(nf.Recording(time=RUN.time, depth=depth, force=force)).parameters["puncture_depth"]
        inside += at.low - 0.1e-3 <= LAYER.puncture.depth <= at.high + 0.1e-3
    assert inside >= count - 1
