# SPDX-License-Identifier: Apache-2.0
"""Steering files, tip tables, motions and plans with numbers that no needle has: named, and refused or replaced."""

import math
import random
import time

import numpy as np
import pytest
from typer.testing import CliRunner

import needleforce as nf
from needleforce.cli import app
from needleforce.rig import SteeringPhantom, steering_insertion, write_steering
from needleforce.steering import BaseMotion, Box, NeedleShape, Sphere, SteeringLimits, TipPath, WrenchSensor
from needleforce.steering.tip_path_tables import spikes

FILE = """steering = "linear"
identified = ["modulus", "tip_force_x"]
covariance = [[0.01, 0.0], [0.0, 0.02]]

[needle]
outer_diameter_m = 0.00127
length_m = 0.3
young_modulus_Pa = 162e9

[values]
modulus = 20000.0
tip_force_x = 0.2
tip_force_y = 0.0
pivot_stiffness = 500.0
guide_distance = 0.03
rotational_compliance = 1.0
surface = 0.0

[[insertions]]
name = "one"
start = 0.0
base = [[0.0, 0.0], [0.001, 0.0], [0.001, 0.0]]
tip = [[0.0, 0.0, 0.0], [0.001, 0.0, 0.01], [0.002, 0.0, 0.02]]
roll = [0.0, 0.0, 0.0]
slope = [[0.0, 0.0], [0.05, 0.0], [0.05, 0.0]]
"""
ROW = '[[insertions]]\nname = "x"\nstart = 0.0\nbase = [[0.0, 0.0]]\ntip = [[0.0, 0.0, 0.0]]\nroll = [0.0]\n\n'
GOOD = TipPath("x", np.zeros((4, 2)), np.outer(np.arange(4), [0.0, 0.0, 5e-3]), None)


def loaded(folder, text):
    (folder / "gel.toml").write_text(text, encoding="utf-8")
    return nf.steering.load(folder / "gel.toml")


@pytest.mark.parametrize(
    "old, new, words",
    [
        ("start = 0.0", "start = nan", r"insertions\[0\], one: start of one is nan m, not finite"),
        ("start = 0.0", "start = 1e308", "start of one is .*outside -100 to 100 m"),
        ("[0.001, 0.0, 0.01]", "[1e28, 0.0, 0.01]", "tip in row 2 is 1e[+]28 m, outside -100 to 100 m"),
        ("[0.001, 0.0, 0.01]", "[5.0, 0.0, 0.01]", "tip of one from its first row in row 2 is 5 m, outside -1 to 1 m"),
        ("[0.001, 0.0, 0.01]", "[0.001, 0.0, -1e308]", "outside"),
        ("slope = [[0.0, 0.0]", "slope = [[1e308, 0.0]", "slope in row 1 is .*outside -10 to 10"),
        ("base = [[0.0, 0.0]", "base = [[1e308, 0.0]", "base in row 1"),
        ("base = [[0.0, 0.0], [0.001, 0.0]", "base = [[0.0, 0.0], [0.001]", "base"),
        ("roll = [0.0", "roll = [inf", "roll in row 1 is inf rad"),
        ("roll = [0.0, 0.0, 0.0]", "roll = []", "rows is 0"),
        ("tip = [[0.0, 0.0, 0.0], [0.001, 0.0, 0.01], [0.002, 0.0, 0.02]]", "tip = []", r"tip is shape \(0,\)"),
        ("base = [[0.0, 0.0], [0.001, 0.0], [0.001, 0.0]]", "base = []", r"base is shape \(0,\)"),
        (
            "guide_distance = 0.03",
            "guide_distance = -1e308",
            r"\$.values: guide_distance is -1e[+]308 m, outside",
        ),
        ("surface = 0.0", "surface = nan", "surface is nan m, not finite"),
        ("surface = 0.0", "surface = 0.0\nmagic = 1.0", "parameter is magic, unknown"),
        ('"tip_force_x"]', '"modulus"]', "named twice"),
        ("[[0.01, 0.0]", "[[1e300, 0.0]", "covariance in row 1"),
        ("length_m = 0.3", "length_m = 1e31", "length_m is 1e[+]31, outside"),
        ("[[insertions]]", ROW * 1000 + "[[insertions]]", r"number of insertions is 1001, at most 1000 can be read"),
    ],
)
def test_a_number_of_a_steering_file_that_no_needle_has_is_named(tmp_path, old, new, words):
    assert FILE.count(old) >= 1 and loaded(tmp_path, FILE).form == "linear"
    with pytest.raises(nf.InputError, match=words):
        loaded(tmp_path, FILE.replace(old, new, 1))


@pytest.mark.parametrize(
    "make, words",
    [
        (lambda: BaseMotion(np.array([0.0, 1e308]), np.zeros((2, 2)), np.zeros(2)), "depth of a base motion in row 2"),
        (lambda: BaseMotion(np.zeros(2), np.full((2, 2), 1e308), np.zeros(2)), "lateral of a base motion in row 1"),
        (lambda: BaseMotion(np.zeros(2), np.zeros((2, 2)), np.full(2, 1e308)), "roll of a base motion in row 1"),
        (lambda: SteeringLimits(max_lateral=math.inf), "max_lateral is inf m"),
        (lambda: Sphere((0.0, 0.0, 1e308), 1e-3), "center of a sphere"),
        (lambda: Sphere((0.0, 0.0, 0.1), 1e308), "radius of a sphere"),
        (lambda: Box((0.0, 0.0, 0.0), (1e308, 1.0, 1.0)), "high corner of a box"),
        (lambda: NeedleShape("x", 1e308, np.outer(np.arange(4), [0.0, 0.0, 1e307])), "points of shape x"),
        (lambda: WrenchSensor(position=(0.0, 0.0, 1e308)), "position of the sensor"),
        (lambda: nf.steering.Unicycle(1e308), "curvature is 1e[+]308 1/m"),
        (lambda: nf.steering.plan(loaded_needle(), (0.0, 0.0, 0.0)), "below the surface"),  # the base itself
        (lambda: nf.steering.plan(loaded_needle(), (1e308, 0.0, 0.05)), "target in row 1"),
        (lambda: nf.steering.plan(loaded_needle(), (0.0, 0.0, 0.05), step=5e-324), "400 steps"),
        (lambda: steering_insertion(-1, 0), "seed is -1"),
    ],
)
def test_numbers_of_motions_plans_and_shapes_have_ranges(make, words):
    with pytest.raises(nf.InputError, match=words):
        make()


def loaded_needle():
    layer = nf.LateralLayer(modulus=2e4, tip_force=0.2)
    return nf.FlexibleInsertion(None, nf.Needle(1.27e-3, 0.0, 0.2, 162e9), lateral=[layer], guide_distance=0.03)


def test_a_table_of_a_motion_names_the_line_of_the_cell(tmp_path):
    file = tmp_path / "motion.csv"
    file.write_text("depth_mm,base_x_mm,base_y_mm,roll_deg\n0,0,0,0\n5,1e308,0,0\n", encoding="utf-8")
    with pytest.raises(nf.InputError, match=r"line 3: base_x_mm is 1e\+305 m, outside -1 to 1 m"):
        BaseMotion.read(file)


def test_a_seed_below_0_is_no_traceback(tmp_path):
    done = CliRunner().invoke(app, ["steer", "simulate", "-o", str(tmp_path / "x.csv"), "--seed", "-1"])
    assert isinstance(done.exception, nf.InputError) and "--seed is -1" in str(done.exception)


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    """A table of one insertion of the rig, as lines of cells."""
    file = tmp_path_factory.mktemp("tips") / "tips.csv"
    insertion = steering_insertion(2, 0, SteeringPhantom())
    for depth in np.arange(0.0, 0.081, 5e-3):
        insertion.advance(float(depth), (1e-3 * (depth > 0.02), 0.0))
    write_steering([insertion], file)
    return [line.split(",") for line in file.read_text(encoding="utf-8").splitlines()]


def read(folder, lines):
    (folder / "tips.csv").write_text("\n".join(",".join(line) for line in lines) + "\n", encoding="utf-8")
    return nf.steering.read(folder / "tips.csv")[0]


@pytest.mark.parametrize("column", [2, 3, 4])
@pytest.mark.parametrize("size", [50.0, 1e5, -1e5, 1e31])
@pytest.mark.parametrize("row", [1, 7, 12, -1])
def test_a_spike_in_one_row_is_named_and_what_lies_between_is_taken(tmp_path, table, row, size, column):
    clean = read(tmp_path, table)
    assert not clean.doubts
    lines = [list(line) for line in table]
    lines[row][column] = repr(float(lines[row][column]) + size)
    path = read(tmp_path, lines)
    (doubt,) = path.doubts
    assert f"in row {row if row > 0 else len(clean)} the tip is a spike" in doubt
    assert np.abs(path.tip - clean.tip).max() < 6e-3  # at an end that of the next row, 5 mm away


def test_several_rows_out_of_range_are_no_spikes_and_the_line_is_named(tmp_path, table):
    lines = [list(line) for line in table]
    for row in (5, 6, 7):
        lines[row][2] = "1e31"
    with pytest.raises(nf.InputError, match=r"line 6: tip_x of insertion 0 is 1e\+28 m, outside -100 to 100 m"):
        read(tmp_path, lines)


@pytest.mark.parametrize("of, read_any", [("tip_x_mm,tip_y_mm,tip_z_mm,trial", nf.steering.read),
                                         ("x_mm,y_mm,z_mm,depth_mm", nf.steering.read_shapes)])  # fmt: skip
def test_a_table_whose_every_row_is_another_insertion_is_refused_at_once(tmp_path, of, read_any):
    rows = "".join(f"0,0,{k % 7},{1e-3 * k}\n" for k in range(60_000))
    (tmp_path / "many.csv").write_text(f"{of}\n{rows}", encoding="utf-8")
    begun = time.process_time()
    with pytest.raises(nf.InputError, match="number of insertions is 60000, at most 1000 can be read"):
        read_any(tmp_path / "many.csv")
    assert time.process_time() - begun < 3.0


@pytest.mark.parametrize("column, cell", [(5, "1e308"), (7, "1e308"), (9, "1e308"), (1, "-1e308"), (2, "inf")])
def test_a_cell_out_of_range_is_named_with_its_line(tmp_path, table, column, cell):
    lines = [list(line) for line in table]
    lines[4][column] = cell
    with pytest.raises(nf.InputError, match="line 5"):
        read(tmp_path, lines)


def test_clean_paths_with_noise_and_steps_have_no_spikes(recordings):
    for seed in range(300):
        rng = np.random.default_rng(seed)
        depth = np.linspace(0.0, 0.1, int(rng.integers(8, 200)))
        curve = 3.0 * depth**2 + 0.02 * np.maximum(depth - 0.05, 0.0)
        tip = np.column_stack([curve, -0.5 * curve, depth]) + rng.normal(0.0, rng.uniform(0.0, 5e-4), (len(depth), 3))
        assert not len(spikes(tip)), seed
    real = nf.steering.read(recordings / "needle-steering" / "stepwise_insertions.csv")
    assert not any("spike" in doubt for path in real for doubt in path.doubts)


def test_a_few_hundred_damaged_files_are_read_or_refused(tmp_path, table, root, monkeypatch):
    monkeypatch.syspath_prepend(root / "benchmarks")
    import damaged_steering_files as study

    tips = "\n".join(",".join(line) for line in table)
    contents = {"needle.toml": FILE, "tips.csv": tips, "motion.csv": study.MOTION, "shapes.csv": study.SHAPE}
    for number in range(25):
        for name, text in contents.items():
            content = study.damaged(text, random.Random(number))
            assert study.trial(name, content, tmp_path, False)[0] in ("read", "refused"), (name, number)
