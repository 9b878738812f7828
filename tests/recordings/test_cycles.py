# SPDX-License-Identifier: Apache-2.0
"""Cycles of a cyclic test: counted by a column, or seen in the motion; and what is no repetition."""

from itertools import pairwise

import numpy as np
import pytest
from plain_insertion import insertion, text

import needleforce as nf
from needleforce.campaign import campaign
from needleforce.errors import InputError
from needleforce.recording import Recording, read, read_all
from needleforce.recording.cycles import MIN_CYCLES, cycle_spans, noise_travel

RATE = 100.0
N = 12  # cycles
RNG = np.random.default_rng


def triangle(amplitude, n=100, hold=0, rest=0):
    """One stroke in and out with ``n`` samples each, a hold at its top and a rest below it."""
    up = amplitude * np.arange(n) / n
    return np.concatenate([np.zeros(rest), up, np.full(hold, amplitude), amplitude - up])


def elastic(depth, stiffness=300.0):
    return stiffness * np.clip(depth, 0.0, None)


def recording(depth, force=None, noise=0.0, force_noise=0.0):
    depth = depth + noise * RNG(1).normal(size=len(depth))
    force = elastic(depth) if force is None else force
    force = force + force_noise * RNG(2).normal(size=len(depth))
    return Recording(time=np.arange(len(depth)) / RATE, depth=depth, force=force)


EQUAL = np.concatenate([triangle(0.01)] * N)
WAVE = 1.0 - np.cos(2 * np.pi * np.arange(N * 200) / 200)
GROWING = np.concatenate([triangle(1e-3 * k) for k in range(1, N + 1)])
HELD = np.concatenate([triangle(0.01, hold=80, rest=40)] * N)
APPROACH = np.linspace(-0.02, 0.001, 700, endpoint=False)
REPEATED = {  # depth, first sample of every cycle
    "triangles": (EQUAL, np.arange(N) * 200),
    "a sine": (0.005 * WAVE, np.arange(N) * 200),
    "a growing amplitude": (GROWING, np.arange(N) * 200),
    "holds": (HELD, np.arange(N) * 320 + np.where(np.arange(N) > 0, 20, 0)),
    "a base line that creeps": (EQUAL + 0.004 * np.arange(len(EQUAL)) / len(EQUAL), np.arange(N) * 200),
    "an approach before and a withdrawal behind": (
        np.concatenate([APPROACH, 0.001 + 0.001 * WAVE, APPROACH[::-1]]), 700 + np.arange(N) * 200
    ),
    "a pull-back in each insertion": (
        np.concatenate([np.interp(np.arange(200), [0, 60, 90, 140, 200], [0, 8e-3, 4e-3, 10e-3, 0])] * N),
        np.arange(N) * 200,
    ),
    "vibration": (EQUAL + 2e-5 * np.sin(np.arange(len(EQUAL)) / 3.0), np.arange(N) * 200),
}  # fmt: skip


@pytest.mark.parametrize("noise", [0.0, 2e-6, 2e-5])
@pytest.mark.parametrize("name", REPEATED)
def test_every_cycle_is_found_where_it_begins(name, noise):
    """To within the samples during which the motion is not farther than the noise from its turning point."""
    depth, starts = REPEATED[name]
    run = recording(depth, noise=noise, force_noise=0.01)
    spans = cycle_spans(run)
    assert [each.name for each in spans] == [f"cycle {k}" for k in range(1, N + 1)]
    assert all(a.stop == b.first for a, b in pairwise(spans))
    shown = noise_travel(run.depth) + (4e-5 if name == "vibration" else 0.0)
    for span, start in zip(spans, starts):
        between = depth[min(span.first, start) : max(span.first, start) + 1]
        assert np.ptp(between) <= shown + 1e-12
        assert abs(span.first - start) <= 40


def test_cycles_in_the_motion_need_no_force():
    assert len(cycle_spans(recording(EQUAL, force=np.zeros(len(EQUAL)), force_noise=0.01))) == N


def test_a_last_cycle_that_is_cut_off_is_left_out():
    assert len(cycle_spans(recording(EQUAL[:-120]))) == N - 1


def test_the_cycles_of_a_motion_at_nanometres():
    assert len(cycle_spans(recording(1e-6 * EQUAL, force=1e-3 * elastic(EQUAL), noise=2e-12))) == N


def with_vibration(amplitude, frequency=2.0):
    depth = np.interp(np.arange(6000), [0, 1000, 1500, 4500, 5000, 6000], [0, 0, 0.02, 0.02, 0, 0])
    return depth + amplitude * np.sin(2 * np.pi * frequency * np.arange(6000) / RATE)


TISSUE = np.interp(np.arange(900), [0, 200, 250, 350, 400, 600, 900], 1e-3 * np.array([0, 10, 8, 14, 11, 20, 0]))
STEPS = np.interp(np.arange(13), [0, 12], [0, 0.024])[np.arange(1200) // 100 + (np.arange(1200) % 100 > 90)]
SINGLE = {
    "an insertion": insertion(rate=RATE)[1],
    "pull-backs": TISSUE,
    "pull-backs after every step": np.cumsum(np.tile(np.repeat([1e-4, -1e-4], [50, 30]), 8)),
    "steps with pauses": np.concatenate([STEPS, STEPS[::-1]]),
    "vibration of 5 um": with_vibration(5e-6),
    "vibration of 50 um": with_vibration(5e-5),
    "vibration of 0.5 mm": with_vibration(5e-4),
}


@pytest.mark.parametrize("noise", [0.0, 2e-6, 2e-5])
@pytest.mark.parametrize("name", SINGLE)
@pytest.mark.parametrize("tissue", [True, False])
def test_one_insertion_has_no_cycles(name, noise, tissue):
    depth = SINGLE[name]
    force = elastic(depth) if tissue else np.zeros(len(depth))
    assert cycle_spans(recording(depth, force, noise, force_noise=0.01)) == ()


def test_a_depth_at_rest_has_no_cycles():
    """White noise, a drift, a step of the last digit, and a random walk, of 100 recordings each: none."""
    for seed in range(100):
        white, time = RNG(seed).normal(size=(2, 3000)), np.arange(3000) / RATE
        walk = 1e-6 * np.cumsum(RNG(seed + 1000).normal(size=3000))
        digits = 1e-5 * np.round(0.3 * white[0])
        for depth in (1e-6 * white[0] + 1e-8 * time, walk, walk + 3e-6 * white[0], digits):
            assert cycle_spans(recording(depth, force=0.005 * white[1])) == ()


def test_a_second_pass_is_listed_and_is_no_repetition(file):
    depth = np.concatenate([triangle(0.02, hold=50, rest=50)] * 2 + [np.zeros(50)])
    path = table(file, depth)
    assert len(cycle_spans(read(path))) == 2 < MIN_CYCLES
    assert "cycles" not in [note.kind for note in read(path).notes]
    assert read(path, part="cycle 2").depth[-1] == 0.0
    assert len(read(path, part=1)) == len(depth)
    with pytest.raises(InputError, match="part is '2'"):
        read(path, part=2)


def table(file, depth, name="run.csv", **more):
    columns = {"time_s": np.arange(len(depth)) / RATE, "depth_mm": 1e3 * depth, "force_N": elastic(depth)} | more
    return file(text(columns), name) if name != "run.csv" else file(text(columns))


def test_a_recording_with_cycles_is_read_whole_and_by_cycles(file):
    path = table(file, EQUAL)
    whole = read(path)
    assert len(whole) == len(EQUAL) and whole.card.part == ""
    assert [n.count for n in whole.notes if n.kind == "cycles"] == [N]
    third = read(path, part="cycle 3")
    np.testing.assert_array_equal(third.force, whole.force[400:600])
    np.testing.assert_array_equal(third.time, whole.time[400:600])
    assert third.card.part == "cycle 3" and third.name.endswith("run.csv: cycle 3")
    np.testing.assert_array_equal(read(path, part=3).depth, third.depth)
    assert len(read_all(path)) == 1 and len(read_all(path)[0]) == len(EQUAL)
    every = read_all(path, part="cycle *")
    assert [run.card.part for run in every] == [f"cycle {k}" for k in range(1, N + 1)]
    np.testing.assert_array_equal(np.concatenate([run.depth for run in every]), whole.depth)
    assert [run.card.part for run in read_all(path, part="cycle 1*")] == [f"cycle {k}" for k in (1, 10, 11, 12)]
    with pytest.raises(InputError, match=r"'cycle 13', the recording has 'cycle 1', .*'cycle 12'.*Give one"):
        read(path, part="cycle 13")
    with pytest.raises(InputError, match=r"Leave it out to read the whole"):
        read(table(file, TISSUE), part="cycle 1")


def test_a_look_lists_the_cycles(file):
    path = table(file, EQUAL)
    found = read(path, dry_run=True)
    assert [each.name for each in found.cycles] == [f"cycle {k}" for k in range(1, N + 1)]
    assert "cycle 12" in str(found) and found.problem == ""
    one = read(path, part="cycle 3", dry_run=True)
    assert len(one.recording) == 200 and "--part 'cycle 3'" in one.command
    assert len(one.cycles) == N


@pytest.mark.parametrize(
    ("header", "first"), [("Cycle", 1), ("Total Cycles", 0), ("Zyklus Nr.", 1), ("cycle_count", 5), ("Loop", 1)]
)
def test_a_column_counts_the_cycles(file, header, first):
    """Also where the counter changes at another depth than that of the lows."""
    count = first + (np.arange(len(EQUAL)) + 150) // 200
    path = table(file, EQUAL, **{header: count})
    assert len(read(path)) == len(EQUAL)
    runs = read_all(path, part="cycle *")
    assert [run.card.part for run in runs] == [f"cycle {k}" for k in range(first, first + N + 1)]
    assert [len(run) for run in runs] == [50, *[200] * (N - 1), 150]
    np.testing.assert_allclose(read(path, part=f"cycle {first + 2}").time, np.arange(250, 450) / RATE, rtol=1e-12)


def test_rows_that_are_left_out_do_not_move_counted_cycles(file):
    count = 1 + np.arange(len(EQUAL)) // 200
    lines = table(file, EQUAL, Cycle=count).read_text().splitlines()
    lines[11] = lines[11].split(",")[0] + ",,," + lines[11].rsplit(",", 1)[1]
    runs = read_all(file("\n".join(lines)), part="cycle *")
    assert [len(run) for run in runs] == [199, *[200] * (N - 1)]


def test_cycles_whose_time_starts_again_are_recordings(file):
    count = 1 + np.arange(len(EQUAL)) // 200
    path = table(file, EQUAL, Cycle=count, time_s=(np.arange(len(EQUAL)) % 200) / RATE)
    runs = read_all(path)
    assert [run.card.part for run in runs] == [f"Cycle {k}" for k in range(1, N + 1)]
    assert read(path, part="cycle 3").time[0] == 0.0


def test_cycles_of_one_of_several_recordings(file):
    lines = table(file, EQUAL).read_text().splitlines()
    rows = [f"{name},{line}" for name in ("A", "B") for line in lines[1:]]
    path = file("\n".join([f"well,{lines[0]}", *rows]))
    assert read(path, part="B: cycle 3").card.part == "B: cycle 3"
    assert len(read_all(path, part="cycle *")) == 2 * N
    assert len(read_all(path, part="B: cycle *")) == N
    (note,) = [note for note in read(path, part="B").notes if note.kind == "cycles"]
    assert "--part 'B: cycle 12'" in note.message


def test_a_campaign_takes_the_cycles(file, tmp_path):
    path = table(file, np.concatenate([triangle(0.02, n=400, rest=100)] * 4))
    whole = campaign(str(path))
    assert [one.file for one in whole.recordings] == [path.name]
    each = campaign(str(path), part="cycle *")
    assert [one.file for one in each.recordings] == [f"{path.name}: cycle {k}" for k in range(1, 5)]
    assert len(each.conditions) == 1


def test_cycles_of_a_log(tmp_path):
    pytest.importorskip("mcap")
    path = tmp_path / "run.mcap"
    nf.write(recording(EQUAL), path)
    assert [run.card.part for run in read_all(path, part="cycle *")] == [f"cycle {k}" for k in range(1, N + 1)]
    assert len(read(path, part="cycle 3")) == 200


def test_a_recording_that_was_written_has_one_note(file, tmp_path):
    nf.write(read(table(file, EQUAL)), tmp_path / "again.csv")
    again = read(tmp_path / "again.csv")
    assert [note.count for note in again.notes if note.kind == "cycles"] == [N]
    assert "cycles" not in [note.kind for note in read(tmp_path / "again.csv", part="cycle 2").notes]
