# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from plain_insertion import text

from needleforce.errors import InputError
from needleforce.recording import Card, read, write_columns
from needleforce.recording.joining import derivative, integral

CLOCK = np.arange(0.0, 20.001, 1.0 / 60.0)  # of the motion
TIME = np.arange(0.5, 19.5, 1e-3)  # of the force


def speed(time):
    """[m/s]: 5 s at 0.6 mm/s², then constant, then back: piecewise linear with corners on the 60 Hz clock."""
    return np.interp(time, [0.0, 5.0, 10.0, 15.0, 20.0], [0.0, 3e-3, 3e-3, -3e-3, -3e-3])


def depth(time):
    """Its analytic integral [m], from -10 mm."""
    t = np.asarray(time)
    up = 3e-4 * t**2
    steady = 7.5e-3 + 3e-3 * (t - 5.0)
    turning = 22.5e-3 + 3e-3 * (t - 10.0) - 6e-4 * (t - 10.0) ** 2
    back = 22.5e-3 - 3e-3 * (t - 15.0)
    return -10e-3 + np.select([t < 5.0, t < 10.0, t < 15.0], [up, steady, turning], back)


FORCE = 40.0 * np.clip(depth(TIME), 0.0, None)


def two_files(tmp_path, **motion_options):
    write_columns({"time": CLOCK, "velocity": speed(CLOCK)}, tmp_path / "motion.csv", **motion_options)
    return write_columns(
        {"time": TIME, "force": FORCE}, tmp_path / "force.csv", motion="motion.csv"
    ), tmp_path / "motion.csv"


def test_depth_is_the_exact_integral_on_the_forces_clock(tmp_path):
    force, _ = two_files(tmp_path, start_depth=-10e-3)
    run = read(force)
    np.testing.assert_array_equal(run.time, TIME)
    np.testing.assert_allclose(run.depth, depth(TIME), atol=1e-15)
    np.testing.assert_allclose(run.velocity, speed(TIME), atol=1e-17)
    assert any("motion.csv" in sentence and "SHA-256" in sentence for sentence in run.card.assumptions)


def test_motion_and_start_given_by_the_caller(tmp_path, file):
    _, motion = two_files(tmp_path)
    force_file = file(text({"t_s": TIME, "fz_N": FORCE}), "alone.csv")
    np.testing.assert_allclose(read(force_file, motion=motion, start_depth=-10e-3).depth, depth(TIME), atol=1e-15)
    with pytest.raises(InputError, match=r"motion.csv: depth at the first sample is unknown"):
        read(force_file, motion=motion)


def test_a_motion_with_its_own_columns_and_units(file):
    force_file = file(text({"t_s": TIME, "fz_N": FORCE}), "alone.csv")
    motion = file(text({"tick": CLOCK * 1e3, "stage": depth(CLOCK) * 1e3}), "stage.csv")
    run = read(force_file, motion=motion, columns={"motion.time": "tick", "motion.depth": "stage"},
               units={"motion.time": "ms", "motion.depth": "mm"})  # fmt: skip
    np.testing.assert_allclose(run.depth, depth(TIME), atol=6e-4 * (1 / 60.0) ** 2 / 4)  # chord of a parabola


def test_force_outside_the_motion_is_left_out_with_a_note(tmp_path):
    force, motion = two_files(tmp_path, start_depth=-10e-3)
    late = CLOCK >= 1.0
    write_columns({"time": CLOCK[late], "velocity": speed(CLOCK[late])}, motion, start_depth=float(depth(1.0)))
    run = read(force)
    np.testing.assert_allclose(run.depth, depth(run.time), atol=1e-15)
    assert [note.count for note in run.notes if note.kind == "outside_motion"] == [500]


def test_clocks_that_do_not_overlap_are_refused(tmp_path):
    force, motion = two_files(tmp_path)
    write_columns({"time": CLOCK + 100.0, "velocity": speed(CLOCK)}, motion, start_depth=0.0)
    with pytest.raises(InputError, match=r"times of the motion is 100 to 120 s, the force runs from 0.5 to 19.499 s"):
        read(force)


def test_depth_from_a_velocity_in_the_same_file(file):
    rows = {"time_s": TIME, "velocity_mm_s": speed(TIME) * 1e3, "force_N": FORCE}
    run = read(file(text(rows)), start_depth=float(depth(0.5)))
    np.testing.assert_allclose(run.depth, depth(TIME), atol=1e-9)
    assert "depth is the integral of the velocity" in " ".join(run.card.assumptions)


def test_a_speed_gets_the_sign_of_the_change_of_depth(file):
    rows = {"time_s": TIME, "depth_m": depth(TIME), "speed_m_s": np.abs(speed(TIME)), "force_N": FORCE}
    run = read(file(text(rows)))
    turn = np.abs(TIME - 12.5) < 0.05  # the reversal within the window of 50 ms
    np.testing.assert_allclose(run.velocity[~turn], speed(TIME)[~turn], atol=1e-15)


@pytest.mark.parametrize("rate", [20.0, 100.0, 1000.0])
def test_derivative_of_a_parabola_is_exact_inside(rate):
    time = np.arange(0.0, 2.0, 1.0 / rate)
    velocity, window = derivative(time, 3e-3 * time**2)
    inside = (time > window) & (time < 1.9 - window)
    np.testing.assert_allclose(velocity[inside], 6e-3 * time[inside], rtol=1e-9)
    assert len(velocity) == len(time)


def test_derivative_of_two_samples():
    assert derivative(np.array([0.0, 2.0]), np.array([0.0, 1.0]))[0].tolist() == [0.5, 0.5]


def test_integral_at_its_own_samples_is_the_trapezium_rule():
    time, velocity = np.array([0.0, 1.0, 3.0]), np.array([0.0, 2.0, 4.0])
    assert integral(time, velocity, 1.0, time).tolist() == [1.0, 2.0, 8.0]


def test_the_card_of_a_stream(tmp_path):
    write_columns({"time": TIME, "force": FORCE}, tmp_path / "a.csv", Card(rig="virtual"), motion="b.csv")
    _, *lines = (tmp_path / "a.csv").read_text().splitlines()
    assert lines[:3] == ["# rig: virtual", "# motion: b.csv", "time_s,force_N"]


def test_a_motion_given_by_its_corners_has_their_speeds(tmp_path):
    corners, depths = [0.0, 2.0, 12.0, 15.0, 20.0], [0.0, 0.0, 20e-3, 20e-3, 10e-3]
    write_columns({"time": np.array(corners), "depth": np.array(depths)}, tmp_path / "motion.csv")
    write_columns({"time": TIME, "force": FORCE}, tmp_path / "force.csv")
    run = read(tmp_path / "force.csv", motion=tmp_path / "motion.csv")
    far = np.min(np.abs(run.time[:, None] - corners), axis=1) > 0.06
    exact = np.select([run.time < 2.0, run.time < 12.0, run.time < 15.0], [0.0, 2e-3, 0.0], -2e-3)
    np.testing.assert_allclose(run.velocity[far], exact[far], atol=1e-9)
