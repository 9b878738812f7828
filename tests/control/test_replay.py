# SPDX-License-Identifier: Apache-2.0
"""Real recordings replayed by the engine at 1 kHz, as in the benchmark."""

import dataclasses
import runpy

import numpy as np
import pytest

import needleforce as nf
from needleforce.identification.cross_validation import mean_of_others, measured_cycle
from needleforce.identification.one_layer.segmented_recording import segmented

# error over the repeatability floor, from the table in docs/evidence/cross_validation.md; its 90th percentile is 1.18
WORST = 1.27


@pytest.fixture(scope="module")
def replay(root):
    return runpy.run_path(str(root / "benchmarks" / "replay.py"))


@pytest.fixture(scope="module")
def files(recordings):
    return sorted((recordings / "needle-insertion-rig").glob("dev__control-needle__skin_2_0_2_*.csv"))


@pytest.fixture(scope="module")
def outcome(replay, files):
    assert len(files) == 5
    return replay["left_out"](files[:4], 0, models=("layered_as_fitted",), layers=2)


def test_a_model_of_other_repeats_predicts_the_held_out_one_in_the_loop(replay, files, outcome):
    read = [nf.read(f, columns={"force": "fz", "depth": "pz"}, units={"time": "us", "depth": "mm"}) for f in files[:4]]
    cycles = [measured_cycle(segmented(run)) for run in read]
    floor = cycles[0].errors(mean_of_others(cycles, 0))[0]
    for mode in ("prediction", "replay"):
        rms, _, _, relative, *_ = replay["numbers"](outcome, ("layered_as_fitted", mode))
        assert relative == pytest.approx(rms / np.abs(cycles[0].force).max(), rel=1e-12)
        assert relative < WORST * floor


def test_the_largest_change_of_force_in_a_millisecond_is_below_the_measured_one(outcome):
    rupture, out, elsewhere = outcome.traces["layered_as_fitted", "replay"].jumps(outcome.cycle)
    measured = outcome.measured.jumps(outcome.cycle)
    assert elsewhere < measured[2] and out < measured[1]
    # the measured force is sampled every 10 ms: a drop within one sample may be ten times as steep
    assert rupture < 10.0 * measured[0]


def test_jumps_are_assigned_to_rupture_withdrawal_and_elsewhere(replay, outcome):
    """Steps of 3, 2 and 1 N at a rupture, in withdrawal and elsewhere, at 1 ms; half as steep at 2 ms."""
    time = np.arange(0.0, 4.0, 1e-3)
    stroke = np.select([time < 2.0, time < 3.0], [0, 1], 2)
    force = 3.0 * (time >= 1.0) + 2.0 * (time >= 3.5) + 1.0 * (time >= 2.5)
    cycle = dataclasses.replace(outcome.cycle, time=time, force=force, depth=time, stroke=stroke)
    trace = replay["Trace"](time, force, np.array([1.0]))
    np.testing.assert_allclose(trace.jumps(cycle), [3.0, 2.0, 1.0], rtol=1e-9)
    twice = replay["Trace"](time[::2], force[::2], np.array([1.0]))
    np.testing.assert_allclose(twice.jumps(cycle), [1.5, 1.0, 0.5], rtol=1e-9)


def test_interpolated_motion_neither_overshoots_nor_moves_at_rest(replay):
    """A needle that stops abruptly: the engine at 1 kHz goes no deeper, and its force at rest is constant."""
    time = np.arange(0.0, 4.0, 1e-2)
    depth = np.minimum(-2e-3 + 3e-3 * time, 5e-3)
    recording = dataclasses.replace(
        nf.simulate(nf.preset("paper"), nf.Motion.insert(start=-1e-3, speed=3e-3, depth=2e-3), rate=100.0),
        time=time, depth=depth, force=np.zeros_like(time), velocity=np.zeros_like(time), axes={},
    )  # fmt: skip
    trace = replay["engine_force"](nf.preset("paper"), recording, 0.0)
    resting = trace.time > 2.35
    assert np.ptp(trace.force[resting]) == 0.0 and trace.force[resting][0] > 0.1
    # 18.6 N/m over 5 mm and 0.0776 N: the paper's closed form where the needle rests
    model = nf.preset("paper")
    wanted = model.friction.per_length * 5e-3 + model.cutting.force
    assert trace.force[-1] == pytest.approx(wanted, rel=1e-9)
    np.testing.assert_allclose(trace.ruptures, [(2e-3 + model.puncture_depth) / 3e-3], atol=2e-3)
