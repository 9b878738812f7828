# SPDX-License-Identifier: Apache-2.0
import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import needleforce as nf
from needleforce import core

PAPER = nf.preset("paper")
CYCLE = nf.Motion.insert(start=-2e-3, speed=3e-3, depth=12e-3, hold=1.0, withdraw=True)


def test_the_sliding_force_is_the_papers_formula():
    depth = np.linspace(-1e-3, 20e-3, 1001)
    stiff = 2 / math.pi * 117546.06040021202 * math.tan(math.radians(15)) * depth**2
    inwards = np.select([depth < 0, depth <= 3.237e-3], [0 * depth, stiff], 18.6 * depth + 0.0776)
    np.testing.assert_allclose(PAPER.force(depth), inwards, rtol=1e-13, atol=1e-16)
    outwards = PAPER.force(depth, velocity=-np.ones_like(depth))
    np.testing.assert_allclose(outwards, -18.6 * np.maximum(depth, 0), rtol=1e-13)


def test_a_simulation_agrees_with_the_formula_while_sliding():
    recording = nf.simulate(PAPER, CYCLE)
    sliding = np.abs(recording.velocity) > 2.9e-3
    formula = PAPER.force(recording.depth, recording.velocity)
    np.testing.assert_allclose(recording.force[sliding], formula[sliding], rtol=1e-12, atol=1e-12)


def test_the_force_drops_at_the_puncture_only_and_reverses_with_the_friction():
    recording = nf.simulate(PAPER, CYCLE, rate=1e4)
    jumps = np.flatnonzero(np.abs(np.diff(recording.force)) > 0.02)
    assert len(jumps) == 1
    assert recording.depth[jumps[0]] == pytest.approx(3.237e-3, abs=1e-6)
    reversal = recording.force.max() - recording.force.min()
    assert reversal == pytest.approx(2 * 18.6 * 12e-3 + 0.0776, rel=5e-3)


@settings(deadline=None)
@given(st.floats(0, 1), st.floats(3.5e-3, 2e-2))
def test_cycle_work_is_the_work_of_the_simulated_force(ratio, deepest):
    model = PAPER.replace(
        friction=nf.laws.Coulomb(18.6, presliding=1e-7, dimple_ratio=ratio),
        cutting=nf.laws.ConstantCutting(0.0776, unloading=1e-7),
    )
    depth = np.concatenate([np.arange(-1e-3, deepest, 1e-6), np.arange(deepest, -1e-3, -1e-6)])
    force = nf.Insertion(model).run(depth, None, np.full(len(depth), 1e-3))["force"]
    terms = nf.cycle_work(model, deepest)
    assert min(terms.values()) >= 0
    assert np.trapezoid(force, depth) == pytest.approx(sum(terms.values()), rel=2e-3)


@settings(deadline=None, max_examples=200)
@given(
    st.floats(0, 1),
    st.floats(0, 100),
    st.floats(-8, -2.5),
    st.floats(-8, -2.5),
    st.floats(0, 0.3),
    st.floats(1e-3, 2e-2),
    st.sampled_from([nf.laws.Cone(1e5, 0.2), nf.laws.PowerLaw(0.2, 1.0, 3e-3), nf.laws.Polynomial(30.0, 1e4)]),
)
def test_cycle_work_is_that_of_the_loop_to_rounding(ratio, per_length, stretch, unloading, cut, below, contact):
    """Simpson's rule is exact between the depths at which a part of the force has a kink."""
    friction = nf.laws.Coulomb(per_length, presliding=10**stretch, dimple_ratio=ratio)
    cutting = nf.laws.ConstantCutting(cut, unloading=10**unloading)
    model = PAPER.replace(stiffness=contact, friction=friction, cutting=cutting)
    puncture, surface = model.puncture_depth, ratio * model.puncture_depth
    deepest = puncture + below + cutting.unloading
    kinks = np.r_[deepest - cutting.unloading, puncture, surface, 0.0]
    kinks = np.r_[kinks, _kinks_of_friction(model, deepest)]
    inner = np.unique(kinks[(kinks > 0.0) & (kinks < deepest)])
    down, up = np.r_[0.0, inner, deepest], np.r_[deepest, inner[::-1], 0.0]
    engine, work, last = nf.Insertion(model), 0.0, 0.0
    for start, end in [*itertools.pairwise(down), *itertools.pairwise(up)]:
        if start == puncture and end > start:  # the force falls there
            start = np.nextafter(start, 1.0)
            last = engine.step(start, None, 1.0).force
        middle, there = (engine.step(z, None, 1.0).force for z in (0.5 * (start + end), end))
        work += (end - start) * (last + 4.0 * middle + there) / 6.0
        last = there
    terms = nf.cycle_work(model, deepest, elastic_travel=True)
    assert work == pytest.approx(sum(terms.values()), rel=1e-11)


def _kinks_of_friction(model, deepest):
    """Depths at which the loop's own traction comes to its limit, by bisection along each stroke."""
    surface, found = model.friction.dimple_ratio * model.puncture_depth, []
    engine = nf.Insertion(model)
    engine.step(model.puncture_depth, None, 1.0)
    engine.step(np.nextafter(model.puncture_depth, 1.0), None, 1.0)
    for start, end in [(model.puncture_depth, deepest), (deepest, surface)]:
        slides, sticks = end, start
        for _ in range(60):
            middle = 0.5 * (slides + sticks)
            limit = np.sign(end - start) * model.friction.per_length * (middle - surface)
            reached = abs(engine.snapshot().step(middle, None, 1.0).friction - limit) <= 1e-12 * abs(limit)
            slides, sticks = (middle, sticks) if reached else (slides, middle)
        found.append(slides)
        engine.step(end, None, 1.0)
    return found


def test_without_a_velocity_a_step_uses_the_difference_of_depths():
    insertion = nf.Insertion(PAPER)
    insertion.step(0.0, None, 1e-3)
    sample = insertion.step(3e-6, None, 1e-3)
    assert sample.velocity == pytest.approx(3e-3)
    assert (sample.status, sample.phase) == (nf.Status.ok, nf.Phase.deformation)
    assert insertion.step(6e-6, -3e-3, 1e-3).status == nf.Status.outside_range


def test_a_snapshot_is_an_independent_copy():
    insertion = nf.Insertion(PAPER)
    insertion.run(np.linspace(0, 8e-3, 1000), None, np.full(1000, 1e-3))
    saved = insertion.snapshot()
    force = insertion.step(8.001e-3, None, 1e-3).force
    assert saved.step(8.001e-3, None, 1e-3).force == force
    insertion.reset()
    assert insertion.deepest_cut == 0.0


@pytest.mark.parametrize(
    "depth, velocity, dt", [(math.nan, 0.0, 1e-3), (8e-3, math.inf, 1e-3), (8e-3, 0.0, -1.0), (9.0, None, 1e-3)]
)
def test_invalid_steps_give_no_force(depth, velocity, dt):
    insertion = nf.Insertion(PAPER)
    insertion.run(np.linspace(0, 8e-3, 1000), None, np.full(1000, 1e-3))
    sample = insertion.step(depth, velocity, dt)
    assert sample.force == 0.0 and sample.status != nf.Status.ok


def test_arrays_of_unequal_length_are_refused_and_out_is_written():
    depth = np.linspace(0, 1e-2, 10)
    with pytest.raises(nf.InputError, match="length of velocity"):
        PAPER.force(depth, np.zeros(3))
    with pytest.raises(nf.InputError, match="length of dt"):
        nf.Insertion(PAPER).run(depth, None, np.zeros(3))
    out = np.zeros(10)
    assert PAPER.force(depth, out=out) is out and out[-1] > 0
    with pytest.raises(TypeError):
        PAPER.force(depth, out=np.zeros(10, dtype=np.float32))


def test_impossible_motions_and_rates_are_refused():
    with pytest.raises(nf.InputError, match="speed"):
        nf.Motion.insert(start=-1e-3, speed=0.0, depth=1e-2)
    with pytest.raises(nf.InputError, match="depth"):
        nf.Motion.insert(start=1e-3, speed=1e-3, depth=0.0)
    with pytest.raises(nf.InputError, match="rate"):
        nf.simulate(PAPER, CYCLE, rate=0.0)


def test_a_motion_arrives_and_never_exceeds_its_speed():
    motion = nf.Motion.insert(start=-5e-3, speed=3e-3, depth=20e-3, hold=2.0)
    time = np.linspace(0, motion.duration, 100001)
    depth, velocity = motion.at(time)
    assert depth[0] == -5e-3 and depth[-1] == pytest.approx(-5e-3, abs=1e-12)
    assert depth.max() == pytest.approx(20e-3, abs=1e-12) and np.abs(velocity).max() <= 3e-3 + 1e-12
    np.testing.assert_allclose(np.gradient(depth, time)[1:-1], velocity[1:-1], atol=2e-5)
    assert np.mean(np.abs(velocity) < 1e-9) == pytest.approx(2.0 / motion.duration, abs=1e-3)


def test_a_short_move_has_a_triangular_velocity_profile():
    motion = nf.Motion.insert(start=0.0, speed=1.0, depth=1e-3, withdraw=False)
    assert motion.at(np.linspace(0, motion.duration, 1000))[1].max() == pytest.approx(math.sqrt(1e-3 * 10e-3), rel=1e-2)


def test_nan_input_gives_nan_force():
    depth = np.array([1e-3, np.nan, 8e-3])
    for law in ("paper", "physical"):
        assert np.isnan(nf.preset(law).force(depth)).tolist() == [False, True, False]
        assert np.isnan(nf.preset(law).force(depth, -np.ones(3))).tolist() == [False, True, False]
        assert np.isnan(nf.preset(law).force(np.full(3, 8e-3), np.array([1.0, np.nan, -1.0]))).tolist() == [
            False,
            True,
            False,
        ]


def test_a_snapshot_can_be_restored():
    insertion = nf.Insertion(PAPER)
    insertion.run(np.linspace(0, 8e-3, 1000), None, np.full(1000, 1e-3))
    saved = insertion.snapshot()
    assert isinstance(saved, nf.Insertion)
    insertion.run(np.linspace(8e-3, 12e-3, 1000), None, np.full(1000, 1e-3))
    insertion.restore(saved)
    assert insertion.deepest_cut == pytest.approx(8e-3)


def test_a_memory_can_be_saved_as_bytes_and_restored():
    model = nf.preset("layered")
    insertion, twin = nf.Insertion(model), nf.Insertion(model)
    for k in range(3000):
        insertion.step(4e-6 * k, None, 1e-3)
    twin.restore(insertion.save())
    ahead = [insertion.step(12e-3 - 4e-6 * k, None, 1e-3).force for k in range(500)]
    assert ahead == [twin.step(12e-3 - 4e-6 * k, None, 1e-3).force for k in range(500)]


def test_altered_bytes_and_those_of_another_model_are_refused():
    insertion = nf.Insertion(nf.preset("paper"))
    saved = insertion.save()
    for bad in (saved[:-1], saved[:100] + b"?" + saved[101:], nf.Insertion(nf.preset("layered")).save(), b""):
        with pytest.raises(nf.InputError, match="not of this version and this model, or altered"):
            insertion.restore(bad)


def test_samples_have_events_and_the_lateral_force_of_a_bevel():
    bevel = core.Bevel(half_angle=math.radians(15), friction_coefficient=0.3, face_share=1.0)
    insertion = nf.Insertion(nf.preset("paper"), bevel=bevel)
    depths = 1e-5 * np.concatenate([np.arange(-50, 900), np.arange(900, -50, -1)])
    samples = [insertion.step(z, None, 1e-2) for z in depths]
    assert [(s.contact, s.punctured, s.exit) for s in samples if s.contact or s.punctured or s.exit] == [
        (True, False, False), (False, True, False), (False, False, True)]  # fmt: skip
    assert max(s.lateral for s in samples) == pytest.approx(0.126, abs=5e-4)  # Misra et al. 2010
    with pytest.raises(nf.InputError, match=r"bevel\.face_share"):
        core.Bevel(face_share=1.5)
