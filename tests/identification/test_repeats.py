# SPDX-License-Identifier: Apache-2.0
"""Repeats of two needles or specimens, given as repeats of one condition."""

import numpy as np
import pytest

import needleforce as nf

MOTION = nf.Motion.insert(start=-3e-3, speed=3e-3, depth=9e-3, hold=0.5, withdraw=True)


def repeats(*factors, scatter=0.02):
    """Insertions into the paper's tissue, the force of each multiplied by a factor with a scatter of its own."""
    run, found = nf.simulate(nf.preset("paper"), MOTION, rate=500.0), []
    for seed, factor in enumerate(factors):
        random = np.random.default_rng(seed)
        force = factor * np.exp(random.normal(0.0, scatter)) * run.force + random.normal(0.0, 3e-3, len(run))
        found.append(nf.Recording(time=run.time, depth=run.depth, force=force))
    return found


def named(recordings, model=None):
    fit = nf.identify(recordings, model=model)
    return [each for each in fit.warnings if each.startswith("The repeats")]


def test_two_groups_of_repeats_are_named():
    (sentence,) = named(repeats(1.0, 1.0, 1.0, 1.6, 1.6, 1.6, scatter=0.01))
    assert "form two groups" in sentence and "recording 4, recording 5, recording 6 is" in sentence


def test_a_layered_fit_names_repeats_that_differ():
    assert named(repeats(1.0, 1.0, 1.8, scatter=0.01), "layered_as_fitted")


@pytest.mark.parametrize("factors", [(1.0, 2.0), (1.0, 1.0, 2.0), (1.0, 2.0, 2.0, 2.0)])
def test_repeats_that_differ_by_a_factor_are_named(factors):
    (sentence,) = named(repeats(*factors))
    assert "The repeats differ" in sentence and any(f"is {k} times" in sentence for k in ("1.9", "2", "2.1"))


def test_repeats_with_usual_scatter_are_not():
    assert not named(repeats(*[1.0] * 5, scatter=0.08))


def test_compare_names_them_too():
    table = nf.compare(repeats(1.0, 1.0, 2.0, 2.0, scatter=0.01), models=["paper", "power_law"])
    assert "The repeats form two groups" in str(table)
