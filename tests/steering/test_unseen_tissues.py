# SPDX-License-Identifier: Apache-2.0
"""Predictions and plans in tissues that no law of the package describes."""

import math

import numpy as np
import pytest
from unseen_tissues import STIFFNESS, Beam, Tissue

import needleforce as nf

NEEDLE = nf.Needle(1.27e-3, 0.0, 0.6, STIFFNESS * 64.0 / (math.pi * 1.27e-3**4))
TRAINING, HELD = (False, False, True, True), (True,) * 4


def lateral(predicted, path):
    return np.sqrt(np.mean(np.sum((predicted - path.tip)[:, :2] ** 2, axis=1)))


@pytest.mark.parametrize("family", ["stiffening", "unicycle"])
def test_readings_are_in_the_intervals_and_no_simple_model_is_better(family):
    paths = Tissue(family, 1).paths(TRAINING + HELD)
    fit = nf.steering.identify(paths[:4], NEEDLE)
    inside, sizes = [], {by: [] for by in ("prediction", "regression", "bicycle", "unicycle")}
    for path in paths[4:]:
        half = 1.96 * np.hypot(fit.uncertainty(path), 0.2e-3)
        inside.append(np.abs(fit.predict(path) - path.tip)[:, :2] < half[:, None])
        for by, found in sizes.items():
            found.append(lateral(fit.predict(path, by=by), path))
    assert np.mean(inside) >= 0.9
    assert np.median(sizes["prediction"]) <= 1.05 * min(np.median(found) for found in sizes.values())


def test_the_beam_of_the_tissues_is_that_of_a_foundation():
    beam = Beam("softening", np.random.default_rng(1))
    beam.scale, modulus, force = 1.0, 4e4, 0.1
    beam.turn = 1e6  # free to turn, far away: a long beam with a force at its end
    shape = beam._equilibrium(0.15, 0.0, np.zeros(151, complex), np.full(200, modulus), force)
    decay = (modulus / (4.0 * STIFFNESS)) ** 0.25
    assert abs(shape[0]) == pytest.approx(2.0 * force * decay / modulus, rel=0.03)  # Hetenyi 1946, end force
