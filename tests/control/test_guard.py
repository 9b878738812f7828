# SPDX-License-Identifier: Apache-2.0
"""The guard from Python: settings by name, limits of the force, and its record."""

import math
import threading

import numpy as np
import pandas as pd
import pytest

import needleforce as nf
from needleforce import core
from needleforce.control import Guard

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
