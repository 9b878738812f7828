# SPDX-License-Identifier: Apache-2.0
"""Force and pose in one table, each with its own rows and times."""

import numpy as np
import pytest

from needleforce.errors import InputError
from needleforce.recording import read

HEADER = "Time (sec),Force X (N),Force Z (N),Pose Z (mm)"
CLOCK = np.arange(0.0, 12.0, 0.01)  # of the force
MOVED = np.arange(-0.0073, 12.1, 0.031)  # of the pose


def force_at(time):
    return 0.3 * time + 0.01 * np.abs(time - 5.0)  # the same rounding on every machine, for a scalar and an array


def depth_at(time):
    """[m]: a slope with corners at the pose's own times, so that interpolation is exact."""
    return np.interp(time, MOVED, -5e-3 + 3e-3 * MOVED - 1e-3 * np.cos(2.0 * MOVED))


def force_rows(clock=CLOCK):
    return [(t, f"{t!r},{-t!r},{float(force_at(t))!r},") for t in clock.tolist()]


def pose_rows(moved=MOVED):
    return [(t, f"{t!r},,,{float(1e3 * depth_at(t))!r}") for t in moved.tolist()]


def table(*streams, late=0.0, header=HEADER):
    """The rows of all streams by time; those of the second and later ones are logged ``late`` [s]."""
    rows = [(t + late * bool(k), line) for k, stream in enumerate(streams) for t, line in stream]
    return "\n".join([header, *(line for _, line in sorted(rows))]) + "\n"


def run(path, **options):
    return read(path, columns={"depth": "Pose Z (mm)"}, baseline=False, **options)


def kinds(recording):
    return {note.kind: note for note in recording.notes}


@pytest.mark.parametrize("late", [0.0, 0.009, 0.04])
def test_each_stream_keeps_its_values(file, late):
    got = run(file(table(force_rows(), pose_rows(), late=late)))
    assert got.time.tolist() == CLOCK.tolist()
    np.testing.assert_array_equal(got.force, force_at(CLOCK))
    np.testing.assert_array_equal(got.axes["fx"], -CLOCK)
    np.testing.assert_allclose(got.depth, depth_at(CLOCK), atol=1e-15)
    note = kinds(got)["interleaved"]
    assert f"force ({len(CLOCK)})" in note.message and f"motion ({len(MOVED)})" in note.message
    assert not {"outside_motion", "missing", "left_out"} & set(kinds(got))


def test_one_file_equals_two_files(file):
    got = run(file(table(force_rows(), pose_rows())))
    force_file = file(table(force_rows()).replace("Pose Z", "nothing"), "force.csv")
    pose_file = file(table(pose_rows()).replace("Force", "nothing"), "pose.csv")
    two = read(force_file, motion=pose_file, columns={"motion.depth": "Pose Z (mm)"}, baseline=False)
    for name in ("time", "depth", "velocity", "force"):
        np.testing.assert_array_equal(getattr(got, name), getattr(two, name))


def test_samples_outside_the_motion_are_noted(file):
    moved = MOVED[(MOVED > 1.0) & (MOVED < 11.0)]
    got = run(file(table(force_rows(), pose_rows(moved))))
    within = CLOCK[(CLOCK >= moved[0]) & (CLOCK <= moved[-1])]
    assert got.time.tolist() == within.tolist()
    assert kinds(got)["outside_motion"].count == len(CLOCK) - len(within)


def test_a_reversed_depth_is_corrected(file):
    got = run(file(table(force_rows(), pose_rows()).replace("Force Z (N)", "Force Z (-N)")), inwards="decreasing")
    np.testing.assert_allclose(got.depth, -depth_at(CLOCK), atol=1e-15)
    np.testing.assert_array_equal(got.force, -force_at(CLOCK))


def test_a_velocity_is_integrated_from_its_start(file):
    speeds = [(t, f"{t!r},,,{2.0 * t!r}") for t in MOVED.tolist()]
    path = file(table(force_rows(), speeds, header="time (s),fx (N),fz (N),velocity (mm/s)"))
    got = read(path, start_depth=-4e-3, baseline=False)
    np.testing.assert_allclose(got.depth, -4e-3 + 1e-3 * (CLOCK**2 - MOVED[0] ** 2), atol=1e-15)


def test_the_unit_of_time_of_both_streams_follows_from_the_motion(file):
    moved = MOVED.copy()
    moved[0] = 0.0
    text = table(force_rows(), pose_rows(moved)).splitlines()
    scaled = [f"{float(line.split(',', 1)[0]) * 1e6!r},{line.split(',', 1)[1]}" for line in text[1:]]
    got = run(file("\n".join([HEADER.replace(" (sec)", ""), *scaled]) + "\n"))
    np.testing.assert_allclose(got.time, CLOCK, rtol=1e-12)


def test_rows_with_both_quantities_belong_to_both_streams(file):
    shared = MOVED[::10]
    both = [(t, f"{t!r},{-t!r},{float(force_at(t))!r},{float(1e3 * depth_at(t))!r}") for t in shared.tolist()]
    got = run(file(table(force_rows(), both, pose_rows(np.setdiff1d(MOVED, shared)))))
    time = np.union1d(CLOCK, shared)
    assert got.time.tolist() == time.tolist()
    np.testing.assert_allclose(got.depth, depth_at(time), atol=1e-15)


def test_a_few_rows_with_neither_are_left_out_and_more_are_refused(file):
    def third(count):
        return [(t, f"{t!r},,,") for t in np.linspace(2.0, 9.0, count).tolist()]

    got = run(file(table(force_rows(), third(5), pose_rows())))
    assert kinds(got)["missing"].count == 5 and len(got) == len(CLOCK)
    with pytest.raises(InputError, match=r"line \d+: rows with neither force nor motion is 400, of 1991 rows"):
        run(file(table(force_rows(), third(400), pose_rows())))


@pytest.mark.parametrize("streams", [(force_rows(),), (pose_rows(),)], ids=["no pose", "no force"])
def test_an_empty_stream_is_missing(file, streams):
    with pytest.raises(InputError, match=r"is missing or not a number, \d+ of \d+ rows"):
        run(file(table(*streams)))


def test_streams_that_do_not_overlap_are_refused(file):
    with pytest.raises(InputError, match=r"times of the motion is .* the force runs from 0 to"):
        run(file(table(force_rows(CLOCK[CLOCK < 1.0]), pose_rows(MOVED[MOVED > 2.0]))))


def test_a_decreasing_time_within_a_stream_is_refused_with_its_line(file):
    lines = table(force_rows(), pose_rows()).splitlines()
    own = [k for k, line in enumerate(lines) if line.endswith(",") and k]
    lines[own[50]], lines[own[51]] = lines[own[51]], lines[own[50]]
    with pytest.raises(InputError, match=rf"line {own[51] + 1}: time is 0.5 after 0.51"):
        run(file("\n".join(lines) + "\n"))


def test_missing_values_in_a_slower_column_are_not_a_second_stream(file):
    depths = [repr(float(1e3 * depth_at(t))) if k % 3 == 0 else "" for k, t in enumerate(CLOCK.tolist())]
    lines = [f"{t!r},0,{float(force_at(t))!r},{depth}" for t, depth in zip(CLOCK.tolist(), depths)]
    with pytest.raises(InputError, match=r"800 of 1200 rows.*slower clock"):
        run(file("\n".join([HEADER, *lines]) + "\n"))


def test_random_missing_values_are_not_a_second_stream(file):
    draw = np.random.default_rng(5)
    complete = [(repr(t), repr(float(force_at(t))), repr(float(1e3 * depth_at(t)))) for t in CLOCK.tolist()]
    incomplete = [(t, *(cell if draw.random() > 0.1 else "" for cell in cells)) for t, *cells in complete]
    lines = [f"{t},0,{force},{depth}" for t, force, depth in incomplete]
    with pytest.raises(InputError, match="missing or not a number"):
        run(file("\n".join([HEADER, *lines]) + "\n"))


def test_a_truncated_last_line_is_left_out(file):
    got = run(file(table(force_rows(), pose_rows()) + "12.0999,0"))
    assert len(got) == len(CLOCK) and kinds(got)["cut_off"].count == 1


def test_parquet_may_be_interleaved_too(tmp_path):
    pyarrow, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    time = np.concatenate([CLOCK, MOVED])
    order = np.argsort(time, kind="stable")
    force = np.concatenate([force_at(CLOCK), np.full(len(MOVED), np.nan)])
    depth = np.concatenate([np.full(len(CLOCK), np.nan), depth_at(MOVED)])
    columns = {"time_s": time[order], "force_N": force[order], "depth_m": depth[order]}
    parquet.write_table(pyarrow.table(columns), tmp_path / "log.parquet")
    got = read(tmp_path / "log.parquet", baseline=False)
    assert got.time.tolist() == CLOCK.tolist() and (got.force == force_at(CLOCK)).all()


def test_a_real_log_of_wrenches_and_poses(recordings):
    path = recordings / "asynchronous-wrench-log" / "1_wrenches_poses.csv"
    with pytest.raises(InputError, match="no column holds the depth"):
        read(path)
    got = read(path, columns={"depth": "Forktip Pose Z (m)"}, baseline=False)
    rows = np.genfromtxt(path, delimiter=",", skip_header=1)
    wrench, pose = rows[~np.isnan(rows[:, 3])], rows[~np.isnan(rows[:, 9])]
    assert (len(wrench), len(pose)) == (1026, 1134)
    wrench = wrench[(wrench[:, 0] >= pose[0, 0]) & (wrench[:, 0] <= pose[-1, 0])]
    np.testing.assert_array_equal(got.time, wrench[:, 0])
    np.testing.assert_array_equal(got.force, wrench[:, 3])
    np.testing.assert_allclose(got.depth, np.interp(wrench[:, 0], pose[:, 0], pose[:, 9]), atol=1e-12)
    assert kinds(got)["outside_motion"].count == 1026 - len(wrench)
