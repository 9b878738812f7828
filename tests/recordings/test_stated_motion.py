# SPDX-License-Identifier: Apache-2.0
"""A motion that is stated by speed, stroke and hold, and one whose clock has another zero; expected values by hand."""

import numpy as np
import pytest
from plain_insertion import text
from typer.testing import CliRunner

import needleforce as nf
from needleforce.cli import app

TIME = np.arange(9000) / 1000.0
START, SPEED, STROKE, HOLD = 1.35, 10e-3, 20e-3, 3.0
CORNERS = np.array([0.0, START, START + 2.0, START + 5.0, START + 7.0, 9.0])  # [s]
DEPTH = np.interp(TIME, CORNERS, [0.0, 0.0, STROKE, STROKE, 0.0, 0.0])
FORCE = 50.0 * np.clip(DEPTH - 5e-3, 0.0, None)
STATED = {"speed": SPEED, "stroke": STROKE, "hold": HOLD, "motion_shift": START}


@pytest.fixture
def force_file(file):
    return file(text({"time_s": TIME, "force_N": FORCE}))


def test_in_hold_and_out(force_file):
    run = nf.read(force_file, **STATED)
    np.testing.assert_allclose(run.depth, DEPTH, atol=1e-12)
    (sentence,) = [each for each in run.card.assumptions if each.startswith("depth")]
    assert sentence == (
        "depth increases at 10 mm/s from 1.35 s on, up to 20 mm, and after 3 s decreases at the same speed, as given"
    )


def test_without_a_hold_the_needle_remains_at_its_depth(force_file):
    run = nf.read(force_file, speed=SPEED, stroke=STROKE, motion_shift=START)
    np.testing.assert_allclose(run.depth, np.maximum.accumulate(DEPTH), atol=1e-12)


def test_without_a_shift_the_needle_starts_with_the_first_sample(force_file):
    run = nf.read(force_file, speed=SPEED, stroke=STROKE, hold=0.0)
    np.testing.assert_allclose(run.depth, np.interp(TIME, [0.0, 2.0, 4.0], [0.0, STROKE, 0.0]), atol=1e-12)


def test_a_stroke_that_is_not_reached_is_stated(force_file):
    run = nf.read(force_file, speed=1e-3, stroke=STROKE)
    assert any("up to 20 mm, which is not reached" in each for each in run.card.assumptions)
    assert run.depth[-1] == pytest.approx(8.999e-3)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"stroke": 1e-2}, "--speed-mm-s"),
        ({"hold": 1.0}, "--stroke-mm"),
        ({"speed": 1e-3, "stroke": -1e-2}, "above 0 m"),
        ({"speed": 1e-3, "stroke": 1e-2, "hold": -1.0}, "at least 0 s"),
        ({"speed": 1e-3, "stroke": 1e-2, "hold": float("nan")}, "at least 0 s"),
        ({"speed": 1e-3, "stroke": 1e-2, "step": 1e-6}, "--rate-hz"),
    ],
)
def test_what_cannot_be_a_motion_is_refused(force_file, given, words):
    with pytest.raises(nf.InputError, match=words):
        nf.read(force_file, **given)


def test_what_a_file_has_itself_is_not_replaced(file):
    path = file(text({"time_s": TIME, "depth_m": DEPTH, "force_N": FORCE}))
    run = nf.read(path, speed=SPEED, stroke=0.01, hold=1.0, motion_shift=1.0)
    np.testing.assert_allclose(run.depth, DEPTH, atol=1e-12)
    (note,) = [each for each in run.notes if each.kind == "unused"]
    assert all(name in note.message for name in ("speed", "stroke", "hold", "motion shift"))


def test_the_zero_of_another_clock(force_file, file):
    motion = file(text({"t_s": 1.6e9 + CORNERS - START, "z_m": np.interp(CORNERS, TIME, DEPTH)}), "stage.csv")
    with pytest.raises(nf.InputError, match=r"--motion-shift-s -1599999998\.650"):
        nf.read(force_file, motion=motion)
    run = nf.read(force_file, motion=motion, motion_shift=START - 1.6e9)
    np.testing.assert_allclose(run.depth, DEPTH[: len(run)], atol=1e-8)  # 1.6e9 s resolve 0.2 µs
    assert any("-1599999998.65 s are added to its times, as given" in each for each in run.card.assumptions)


def test_the_command_that_inspect_shows_reads_the_same(force_file, tmp_path):
    words = ["--speed-mm-s", "10", "--stroke-mm", "20", "--hold-s", "3", "--motion-shift-s", "1.35"]
    shown = CliRunner().invoke(app, ["inspect", str(force_file), *words, "--save", str(tmp_path / "needleforce.toml")])
    assert shown.exit_code == 0 and nf.read(force_file, dry_run=True, **STATED).command.endswith(" ".join(words))
    np.testing.assert_allclose(nf.read(force_file).depth, DEPTH, atol=1e-12)  # by the options kept in the folder


@pytest.mark.parametrize("start", [50.0, -50.0])
def test_a_motion_outside_the_times_of_the_file_is_refused(force_file, start):
    with pytest.raises(nf.InputError, match=r"0 to 8.999 s, in which the needle does not move.*--motion-shift-s"):
        nf.read(force_file, speed=SPEED, stroke=STROKE, hold=HOLD, motion_shift=start)


def test_a_speed_without_sign_is_stated(file):
    speed = np.abs(np.gradient(DEPTH, TIME))
    force = np.where(TIME > START + 5.0, -0.3, FORCE)
    run = nf.read(file(text({"time_s": TIME, "speed_mm_s": 1e3 * speed, "force_N": force})), start_depth=0.0)
    assert any("never negative, but the force has both signs" in each for each in run.card.assumptions)
