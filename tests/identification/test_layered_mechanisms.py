# SPDX-License-Identifier: Apache-2.0
"""What a layered fit finds in simulated stacks: relaxation times, friction by direction, saturation or none, no
rise of the force at a rupture."""

from dataclasses import replace

import numpy as np
import pytest
from known_stacks import repeats as stacked
from known_stacks import stack

import needleforce as nf
from needleforce import core
from needleforce.identification.layered.binned_cycle import (
    COARSE,
    BinnedCycle,
    RecordedPuncture,
    binned_cycles,
    relaxation_times,
)
from needleforce.identification.layered.parameters import FRICTION_RATIO, MM, PER_LAYER, TOP, LayerRow
from needleforce.identification.layered.search import best, grow, made_passive
from needleforce.identification.layered.starts import punctures_of_layers
from needleforce.identification.one_layer.segmented_recording import segmented
from needleforce.models.model import Layer, Model

MOTION = nf.Motion.insert(start=-3e-3, speed=2e-3, depth=21e-3, hold=5.0)
RELAXATION = (0.32, 0.3, 0.12, 2.5)
RATIO = 2.6
MAX_RISE = 0.05  # [of the peak] beyond the contact going on, within 0.1 mm past a rupture


def layer_of(coefficient, saturation, puncture, per_length, stiffness, surface):
    """Laws of a layer with c [N/m^2], h_s [m] or None, and a rupture at an indentation [m]."""
    angle, modulus, laws = 0.25 * np.pi, 0.5 * np.pi * coefficient, core.laws
    none = saturation is None
    return {
        "stiffness": laws.Cone(modulus, angle) if none else laws.ConeCylinder(modulus, angle, 2 * saturation / np.pi),
        "puncture": laws.PunctureDepth(puncture),
        "friction": laws.DraggedTissueAsFitted(per_length, stiffness, 0.4e-3, surface, withdrawal_ratio=RATIO),
        "cutting": laws.NoCutting(),
        "relaxation": laws.PronyAtRest(*RELAXATION),
    }


def repeats(saturation=None, count=3):
    """Repeats of two layers behind white noise of 5 mN and a zero of the sensor; punctures scatter by 0.3 mm."""
    found = []
    for seed in range(count):
        random = np.random.default_rng(seed)
        first, second = np.array([7.8e-3, 7.9e-3]) + random.normal(0.0, 0.3e-3, 2)
        upper = layer_of(2.4e4, saturation, first, 72.0, 347.0, 1.9e-3)
        lower = layer_of(4.2e4, None, second, 46.0, 281.0, 0.0)
        run = nf.simulate(Model(**upper, deeper=(Layer(top=5.1e-3, **lower),)), MOTION, rate=100.0)
        force = run.force + random.normal(0.0, 5e-3, len(run)) + random.uniform(-0.05, 0.05)
        found.append(nf.Recording(time=run.time, depth=run.depth, velocity=run.velocity, force=force))
    return found


@pytest.fixture(scope="module")
def unsaturated():
    return nf.identify(repeats(), model="layered_as_fitted")


def test_no_saturation_is_identified_where_no_layer_saturates(unsaturated):
    """Springs of two layers add up below both ruptures; a search that ended with them exchanged found a saturation."""
    named = [each for name, each in unsaturated.parameters.items() if name.endswith("saturation_depth")]
    assert not any(each.identifiable for each in named), named
    assert unsaturated.settings.layers == 2 and unsaturated.quality.nrmse < 5e-3
    assert unsaturated.parameters["tissue_stiffness"].value == pytest.approx(347.0, rel=0.1)
    assert unsaturated.parameters["layer_2_tissue_stiffness"].value == pytest.approx(281.0, rel=0.1)


def test_a_saturation_is_found_where_there_is_one():
    found = nf.identify(repeats(saturation=3e-3), model="layered_as_fitted").parameters["saturation_depth"]
    assert found.identifiable and found.value == pytest.approx(3e-3, rel=0.1)


def test_friction_of_both_directions_is_found(unsaturated):
    ratio = unsaturated.parameters["withdrawal_ratio"]
    assert ratio.identifiable and ratio.value == pytest.approx(RATIO, rel=0.1)
    assert unsaturated.parameters["friction_per_length"].value == pytest.approx(72.0, rel=0.15)
    assert unsaturated.model.friction.withdrawal_ratio == ratio.value


def hold_cycle(level, short, long, times):
    """A cycle whose hold decays from 2 N as given, with bins that still move at its beginning and end."""
    since = np.concatenate([[0.01, 0.03], 5.0 * np.linspace(0.05, 1.0, 24) ** 2 + 0.05, [5.1]])
    force = level + short * np.exp(-since / times[0]) + long * np.exp(-since / times[1])
    depth = np.full(len(since), 0.02)
    depth[:2] -= (40e-6, 10e-6)
    depth[-1] -= 30e-6
    force[:2] -= 0.1
    force[-1] -= 0.2
    return BinnedCycle(
        depth=depth, force=force, dt=np.diff(since, prepend=0.0), count=np.ones(len(since)), contact=0.0,
        stroke=np.ones(len(since), np.int64), punctures=(), speed=2e-3, rest=5.0, scale=2.0,
    )  # fmt: skip


@pytest.mark.parametrize("times", [(0.2, 1.5), (0.33, 3.0), (0.6, 4.0)])
def test_the_times_are_those_of_the_decay_at_rest(times):
    cycles = (hold_cycle(1.0, 0.5, 0.5, times), hold_cycle(0.4, 0.3, 0.2, times))
    assert relaxation_times(cycles) == pytest.approx(times, rel=0.05)


@pytest.mark.parametrize(
    "shown, expected",
    [
        (((7.0, 12.0), (7.4,), (6.9, 12.4)), ((7.0, 12.0), (7.4, 12.2), (6.9, 12.4))),  # one repeat lacks a rupture
        (((7.0, 7.8), (7.1, 7.9), (6.9, 7.7)), ((7.0, 7.8), (7.1, 7.9), (6.9, 7.7))),  # near, but two in each repeat
        (((7.0, 12.0), (8.1, 13.2), (7.6, 12.6)), ((7.0, 12.0), (8.1, 13.2), (7.6, 12.6))),  # a wide scatter
    ],
)
def test_ruptures_of_different_repeats_are_one_where_they_are_near(shown, expected):
    cycles = tuple(
        replace(
            hold_cycle(1.0, 0.5, 0.5, (0.3, 3.0)),
            punctures=tuple(RecordedPuncture(MM * depth, MM * (depth + 0.3), 0.2) for depth in own),
        )
        for own in shown
    )
    (found,) = punctures_of_layers(cycles, 2)
    np.testing.assert_allclose(found, expected)


@pytest.mark.parametrize("place, move", [(FRICTION_RATIO, -1.5), (TOP, 2.0)])
def test_the_search_leaves_a_shallow_minimum(place, move):
    """With the friction or the top of the lower layer elsewhere a descent, with its scans, ends above the noise."""
    runs, _ = stacked(stack(1001, 2), 1001)
    pairs = [(each.recording, each.events) for each in map(segmented, runs)]
    fitted = grow(binned_cycles(pairs, COARSE["as_fitted"]), 2)
    found = list(made_passive(fitted, 2, cycles=binned_cycles(pairs, COARSE["passive"])))[-1]
    x = found.x.copy()
    x[PER_LAYER + place] += move
    assert found.problem.settled(x, 100)[1] > 2.0 * found.cost
    assert best(found.problem, [x]).cost < 1.01 * found.cost


def largest_rise(solved):
    """Largest force [of the peak] of a layer 0.1 mm past its rupture over that of its contact without the rupture."""
    problem, cycles, step = solved.problem, solved.problem.cycles, 2e-6
    deepest, peak = (max(getattr(each, name) for each in cycles) for name in ("deepest", "peak"))
    punctures = problem.unknowns.punctures(solved.x).mean(axis=0)
    depth = np.arange(-5e-3, deepest, step)
    dt, found = np.full(len(depth), step / 2e-3), []
    for row in problem.unknowns.rows(solved.x[None], punctures[None])[0]:
        at, whole = LayerRow(*row).puncture_depth, row.copy()
        whole[LayerRow._fields.index("puncture_depth")] = deepest + MM
        if at < deepest - 0.2e-3:
            ruptured, unbroken = core.layer_forces(np.array([row, whole]), problem.form, depth, dt)
            later = int(np.searchsorted(depth, at + 0.1e-3))
            found.append((ruptured[later] - unbroken[later]) / peak)
    return max(found, default=0.0)


def grown(runs):
    pairs = [(each.recording, each.events) for each in map(segmented, runs)]
    return grow(binned_cycles(pairs, COARSE["as_fitted"]), 2)


def test_no_layer_rises_at_its_rupture_in_simulated_stacks():
    for saturation in (None, 3e-3):
        assert max(map(largest_rise, grown(repeats(saturation)))) < MAX_RISE


@pytest.mark.parametrize("condition", ["skin_2_0_2", "muscle_2_0_2", "skin-on-muscle_3_0_3"])
def test_no_layer_rises_at_its_rupture_in_real_recordings(condition, recordings):
    files = sorted((recordings / "needle-insertion-rig").glob(f"dev__control-needle__{condition}_*.csv"))
    runs = [nf.read(each, columns={"force": "fz", "depth": "pz", "time": "time"}) for each in files]
    assert len(runs) >= 3 and max(map(largest_rise, grown(runs))) < MAX_RISE
