# SPDX-License-Identifier: Apache-2.0
"""The phantom step by step against the direct simulation of the same phantom."""

import numpy as np
import pytest

import needleforce as nf
from needleforce.rig import Sensor, SpeedClock, paper_experiment
from needleforce.rig.live.simulated import ModelTissue, PhantomTissue, phantom_site
from needleforce.rig.run import path_of_run, perform

DEPTH, SHORT, DT = 16e-3, 0.3e-3, 1e-3


def stepped(tissue, depths, axis="force"):
    return np.array([tissue.step(float(depth), DT)[axis] for depth in depths])


def stroke(depth, speed=3e-3):
    motion = path_of_run(-4e-3, speed, depth, 1.0)
    return motion.at(np.arange(int(motion.duration / DT) + 1) * DT)[0]


@pytest.fixture(scope="module")
def sites():
    return paper_experiment(5, sites=3, speeds=(3e-3,), depth=6e-3).sites


@pytest.mark.parametrize("number", [3])
@pytest.mark.parametrize("speed", [1e-3, 3e-3])
def test_two_passes_are_those_of_the_experiment_of_the_same_seed(sites, number, speed):
    site, tissue = sites[number - 1], PhantomTissue(phantom_site(5, number))
    first, second = stroke(DEPTH, speed), stroke(DEPTH - SHORT, speed)
    direct = site.specimen.force(first - site.surface)
    second_force = site.specimen.force(second - site.surface, hole=DEPTH - site.surface)
    np.testing.assert_allclose(stepped(tissue, first), direct, atol=1e-9)
    np.testing.assert_allclose(stepped(tissue, second), second_force, atol=1e-9)
    # a third pass equals the second
    np.testing.assert_allclose(stepped(tissue, second), second_force, atol=1e-9)
    assert (
        tissue.refused == 0 and np.abs(direct[: len(second_force)] - second_force).max() > 0.1
    )  # the puncture peak is missing in a hole


def test_the_wrench_is_that_of_a_run_recorded_without_noise(sites):
    quiet = Sensor(1, noise=0.0, torque_noise=0.0, bias=0.0)
    motion = path_of_run(-4e-3, 3e-3, DEPTH, 1.0)
    run = perform(sites[0], motion, quiet, SpeedClock(), np.random.Generator(np.random.PCG64(0)))
    depths = motion.at(run.time)[0]
    for axis in ("force", "fx", "ty"):
        rounding = 0.5 / (320 if axis != "ty" else 64_000)
        np.testing.assert_allclose(
            stepped(PhantomTissue(phantom_site(5, 1)), depths, axis), run.axes[axis], atol=rounding + 1e-9
        )


def test_a_site_does_not_depend_on_sites_visited_before():
    first, after = (
        PhantomTissue(phantom_site(5, 2)),
        [PhantomTissue(phantom_site(5, number)) for number in (7, 1, 2)][-1],
    )
    assert (stepped(first, stroke(DEPTH)) == stepped(after, stroke(DEPTH))).all()


def test_a_needle_that_did_not_pierce_leaves_no_hole(sites):
    tissue, site = PhantomTissue(phantom_site(5, 1)), sites[0]
    stepped(tissue, stroke(2e-3))
    np.testing.assert_allclose(
        stepped(tissue, stroke(DEPTH)), site.specimen.force(stroke(DEPTH) - site.surface), atol=1e-9
    )


def test_going_back_and_forth_inside_returns_no_energy():
    tissue = PhantomTissue(phantom_site(5, 1))
    stepped(tissue, stroke(DEPTH)[: len(stroke(DEPTH)) // 2])
    oscillating = DEPTH - 2e-3 * (1 - np.cos(np.linspace(0, 6 * np.pi, 4000)))
    force = stepped(tissue, oscillating)
    assert np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(oscillating)) > 0.0


@pytest.mark.parametrize("preset", ["paper", "physical"])
def test_any_model_is_tissue_as_simulated(preset):
    model = nf.preset(preset)
    motion = nf.Motion.insert(-2e-3, 3e-3, 10e-3, 0.5)
    run = nf.simulate(model, motion)
    # the simulation passes the velocity, the rig uses the difference of depths
    np.testing.assert_allclose(stepped(ModelTissue(model), run.depth), run.force, atol=1e-3)
