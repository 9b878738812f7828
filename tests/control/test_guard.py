# SPDX-License-Identifier: Apache-2.0
"""The guard from Python: settings by name, limits of the force, and its record."""

import itertools
import math
import threading

import numpy as np
import pandas as pd
import pytest

import needleforce as nf
from needleforce import core, fe
from needleforce.control import BaseGuard, Guard

MS = 1e-3


@pytest.fixture
def insertion():
    return nf.Insertion(nf.preset("paper"))


def test_default_settings_do_not_change_the_force(insertion):
    bare, guard = nf.Insertion(nf.preset("paper")), Guard(insertion)
    for depth in np.linspace(-1e-3, 8e-3, 900):
        output = guard.step(depth, None, MS)
        assert output.force == bare.step(depth, None, MS).force
        assert not any(getattr(output, flag) for flag in core.interventions)
    assert insertion.pierced_layers == 1


def test_the_force_is_scaled_and_clamped(insertion):
    guard = Guard(insertion, force_scale=2.0, motion_scale=0.5, max_force=0.3, max_slew=1e3)
    output = guard.step(4e-3, None, MS)
    assert output.sample.depth == 2e-3
    # a cone: 2 / pi tan(angle) E h^2
    force = 2.0 / math.pi * math.tan(math.radians(15.0)) * 117546.06040021202 * 4e-6
    assert output.sample.force == pytest.approx(force, rel=1e-9)
    assert output.force == pytest.approx(2.0 * force, rel=1e-9) and not output.clamped
    output = guard.step(5.9e-3, None, MS)
    assert output.force == 0.3 and output.clamped


def test_the_watchdog_reduces_the_force_to_zero(insertion):
    guard = Guard(insertion, stale_after=2 * MS, fall_time=4 * MS)
    held = guard.step(3e-3, None, MS).force
    forces = [guard.miss(MS).force / held for _ in range(7)]
    assert forces == pytest.approx([1.0, 1.0, 0.75, 0.5, 0.25, 0.0, 0.0])


@pytest.mark.parametrize("bad", [(math.nan, None, MS), (1e-3, math.inf, MS), (1e-3, None, 0.0), (1e-3, None, -MS)])
def test_invalid_input_is_rejected_and_recorded_as_given(insertion, bad):
    guard = Guard(insertion)
    guard.step(1e-3, None, MS)
    output = guard.step(*bad)
    assert output.rejected and output.force == 0.0
    last = {name: column[-1] for name, column in guard.recorder().items()}
    assert last["rejected"] and last["number"] == 1
    given = [bad[0], math.nan if bad[1] is None else bad[1], bad[2]]
    np.testing.assert_equal([last["depth"], last["velocity"], last["dt"]], given)


def test_a_sampled_spring_generates_no_energy(insertion):
    """Motion in the elastic contact with a force delayed by one cycle: with a guard no energy is generated."""
    bare = nf.Insertion(nf.preset("paper"))
    guard = Guard(insertion, longest_cycle=MS, max_speed=0.2, initial_reserve=1e-6)
    time = np.arange(20001) * MS
    depth = 1.5e-3 - 1.5e-3 * np.cos(100.0 * time)
    travel = np.diff(depth)
    raw = np.array([bare.step(x, None, MS).force for x in depth[:-1]])
    kept = np.array([guard.step(x, None, MS).force for x in depth[:-1]])
    assert np.cumsum(raw * travel).min() < -1e-3
    assert np.cumsum(kept * travel).min() >= -1e-6
    assert np.sum(kept * travel) == pytest.approx(guard.recorder()["energy"][-1] + kept[-1] * travel[-1])


def test_errors_name_the_setting(insertion):
    with pytest.raises(nf.InputError, match=r"guard\.max_force is -1\.0, outside 0\.0 to 1000000\.0 N"):
        Guard(insertion, max_force=-1.0)
    with pytest.raises(nf.InputError, match="max_speed needs longest_cycle"):
        Guard(insertion, max_speed=0.5)
    with pytest.raises(nf.InputError, match="not all known"):
        Guard(insertion, clamp=1.0)
    with pytest.raises(nf.InputError, match="not an engine that a guard can step"):
        Guard(nf.preset("paper"))
    with pytest.raises(nf.InputError, match="lateral or angular limit is for a needle that bends"):
        Guard(insertion, max_moment=1.0)
    assert Guard(insertion, delay=2).settings == core.GuardSettings(delay=2.0)


def test_reset_restarts_the_insertion_and_keeps_the_record(insertion):
    guard = Guard(insertion)
    for depth in np.linspace(0.0, 5e-3, 500):
        guard.step(depth, None, MS)
    guard.reset()
    assert insertion.pierced_layers == 0 and len(guard.recorder()["depth"]) == 500


def test_the_record_has_the_last_cycles_and_can_be_saved(insertion, tmp_path):
    guard = Guard(insertion)
    depth = np.linspace(0.0, 5e-3, 5000)
    for x in depth:
        guard.step(x, 1e-3, MS)
    guard.miss(MS)
    record = guard.recorder()
    assert {len(column) for column in record.values()} == {4096}
    np.testing.assert_array_equal(record["number"], np.arange(905, 5001))
    np.testing.assert_array_equal(record["depth"], [*depth[905:], math.nan])
    np.testing.assert_array_equal(record["velocity"], [1e-3] * 4095 + [math.nan])
    assert set(record["phase"]) == {"deformation", "insertion"} and set(record["status"]) == {"ok"}
    guard.save_recorder(tmp_path / "record.csv")
    read = pd.read_csv(tmp_path / "record.csv")
    for name in ("force", "depth", "number", "phase", "stale"):
        np.testing.assert_array_equal(read[name], record[name])


def test_the_record_can_be_read_while_the_loop_runs(insertion):
    guard = Guard(insertion)
    loop = threading.Thread(target=lambda: [guard.step(1e-7 * i, None, MS) for i in range(20000)])
    loop.start()
    while loop.is_alive():
        record = guard.recorder()
        np.testing.assert_array_equal(record["depth"], 1e-7 * record["number"])
    loop.join()
    assert guard.recorder()["number"][-1] == 19999


def flexible(**kind):
    return nf.FlexibleInsertion(
        nf.preset("paper"), nf.preset("paper").needle, lateral=50e3, guide_distance=24e-3, max_speed=math.inf, **kind
    )


def solid():
    nodes = np.arange(40)
    return fe.CondensedTissue(1e-3, 1e-3 * np.exp(-0.3 * np.abs(nodes[:, None] - nodes)))


@pytest.mark.parametrize("kind", [{"planar": True}, {}, {"planar": True, "tissue": True}, {"tissue": True}])
def test_forces_of_a_base_are_those_of_its_wrench_and_are_limited(kind):
    kind = kind | ({"tissue": solid()} if "tissue" in kind else {})
    bare, guard = flexible(**kind), BaseGuard(flexible(**kind), max_lateral_force=1e-3)
    aside = 0.0 if "planar" in kind else -1e-6
    for i in range(300):
        place = {"lateral": (2e-6 * i, aside * i), "roll": 1e-3 * i, "dt": MS}
        sample, output = bare.step(1e-4 * i, **place), guard.step(1e-4 * i, **place)
        assert output.force == sample.force and output.sample.force == sample.force
        np.testing.assert_allclose(output.tilt_moment, [-sample.wrench[4], sample.wrench[3]], atol=1e-15)
        assert math.hypot(*output.lateral_force) <= 1e-3 * (1 + 1e-12)
    assert output.clamped
    direction = -sample.wrench[:2] / np.linalg.norm(sample.wrench[:2])
    np.testing.assert_allclose(output.lateral_force, 1e-3 * direction, rtol=1e-9, atol=1e-15)
    assert guard.miss(MS).lateral_force == [0.0, 0.0]
    guard.reset()
    assert len(guard.engine.path) == 0


def work(rows, forces, places):
    return sum(rows[force][:-1] * np.diff(rows[place]) for force, place in zip(forces, places))


def test_a_rectangle_of_depth_and_aside_returns_no_more_than_was_put_in():
    guard = BaseGuard(flexible(planar=True), longest_cycle=MS, max_speed=0.05, max_angular_speed=1.0)
    for depth in np.linspace(-1e-3, 30e-3, 700):
        guard.step(depth, dt=MS)
    corners = np.array([[0, 0], [15e-6, 0], [15e-6, 6e-3], [0, 6e-3], [0, 0]])
    loop = np.concatenate([np.linspace(a, b, 130, endpoint=False) for a, b in itertools.pairwise(corners)])
    for _ in range(5):
        for deeper, aside in loop:
            guard.step(30e-3 + deeper, (aside, 0.0), dt=MS)
    rows = guard.recorder()
    steps = work(rows, ("force", "lateral_force_x"), ("depth", "lateral_x"))
    assert len(steps) == 700 + 5 * 520 - 1
    assert np.cumsum(steps).min() >= -1e-5
    assert rows["energy"][-1] == pytest.approx(steps.sum(), rel=1e-9)


def test_invalid_base_is_rejected_and_recorded_as_given(tmp_path):
    guard = BaseGuard(flexible(), stale_after=10 * MS)
    held = guard.step(3e-3, dt=MS).force
    for bad in ({"lateral": (math.nan, 0.0)}, {"tilt": (0.0, math.inf)}, {"roll": math.nan}, {"dt": 0.0}):
        output = guard.step(3e-3, **{"dt": MS} | bad)
        assert output.rejected and output.force == held
    record = guard.recorder()
    np.testing.assert_equal(record["lateral_x"], [0.0, math.nan, 0.0, 0.0, 0.0])
    np.testing.assert_equal(record["tilt_y"], [0.0, 0.0, math.inf, 0.0, 0.0])
    assert list(record["rejected"]) == [False, True, True, True, True]
    guard.save_recorder(tmp_path / "record.csv")
    np.testing.assert_array_equal(pd.read_csv(tmp_path / "record.csv")["force"], record["force"])


def test_a_condensed_solid_is_guarded():
    engine, guard = (fe.CondensedInsertion(solid(), nf.preset("paper")) for _ in range(2))
    guard = Guard(guard, max_force=0.1)
    forces = [(engine.step(x, None, MS).force, guard.step(x, None, MS).force) for x in np.linspace(-1e-3, 15e-3, 900)]
    bare, kept = np.array(forces).T
    np.testing.assert_array_equal(kept, np.clip(bare, -0.1, 0.1))
    assert bare.max() > 0.1


def test_what_a_needle_that_bends_needs_is_said():
    with pytest.raises(nf.InputError, match="max_speed needs max_angular_speed"):
        BaseGuard(flexible(), max_speed=0.1, longest_cycle=MS)
    with pytest.raises(nf.InputError, match="guard can step along the depth"):
        Guard(flexible())
    with pytest.raises(nf.InputError, match="guard can step by its base"):
        BaseGuard(nf.Insertion(nf.preset("paper")))
