# SPDX-License-Identifier: Apache-2.0
"""Tables of tip paths: frames, units, orientation, lost sensors, and what is refused."""

import csv
import math

import numpy as np
import pytest

import needleforce as nf
from needleforce.steering import read

HEADER = ["trial", "tip_x_mm", "tip_y_mm", "tip_z_mm", "base_x_mm", "base_z_mm"]


def written(folder, rows, header=HEADER):
    path = folder / "paths.csv"
    lines = [",".join(header), *(",".join(str(cell) for cell in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def straight(n=6, **changes):
    """Rows of an insertion along -y whose base moves from the third row on."""
    return [["one", 1.0 + 0.1 * i, -5.0 * i, 2.0, 0.5 * max(i - 2, 0), 0.0] for i in range(n)]


def test_insertion_axis_is_the_one_without_a_base(tmp_path):
    (path,) = read(written(tmp_path, straight()))
    assert path.name == "one" and len(path) == 6 and path.steered
    assert path.entry_rows == 2  # the base moves from the fourth on, but the third is deeper than the entry of 6 mm
    np.testing.assert_allclose(path.tip[:, 2], 5e-3 * np.arange(6))
    np.testing.assert_allclose(path.tip[:, 0], 1e-3 * (1.0 + 0.1 * np.arange(6)))
    np.testing.assert_allclose(path.base[-1], [1.5e-3, 0.0])
    assert path.slope is None and "-y" in path.note


@pytest.mark.parametrize("unit, size", [("m", 1e-3), ("um", 1e3), ("cm", 0.1)])
def test_units_are_those_of_the_headers(tmp_path, unit, size):
    header = [name.replace("_mm", f"_{unit}") for name in HEADER]
    rows = [[row[0], *(cell * size for cell in row[1:])] for row in straight()]
    (path,) = read(written(tmp_path, rows, header))
    np.testing.assert_allclose(path.tip[-1], [1.5e-3, 2e-3, 25e-3])


def test_orientation_gives_the_slope_of_the_axis_along_the_needle(tmp_path):
    # the sensor's z axis along -y, turned by 0.1 rad towards +x: a rotation about z after one about x
    half = 0.25 * math.pi
    about_x, about_z = (math.cos(half), math.sin(half)), (math.cos(0.05), math.sin(0.05))
    w, x, y, z = about_z[0] * about_x[0], about_z[0] * about_x[1], about_z[1] * about_x[1], about_z[1] * about_x[0]
    rows = [[*row, w, x, y, z] for row in straight()]
    (path,) = read(written(tmp_path, rows, [*HEADER, "tip_qw", "tip_qx", "tip_qy", "tip_qz"]))
    np.testing.assert_allclose(path.slope, np.tile([math.tan(0.1), 0.0], (6, 1)), atol=1e-12)


def test_depth_counts_from_what_the_table_states(tmp_path):
    rows = [[*row, 10.0 + 5.0 * i] for i, row in enumerate(straight())]
    (path,) = read(written(tmp_path, rows, [*HEADER, "step_depth_mm"]))
    np.testing.assert_allclose(path.depth, 1e-3 * (10.0 + 5.0 * np.arange(6)))


def test_frozen_tips_while_the_base_moves_are_left_out(tmp_path):
    rows = straight(10)
    for i in range(6, 10):
        rows[i][1:4] = rows[5][1:4]
    (path,) = read(written(tmp_path, rows))
    assert len(path) == 5 and "the last 5 rows are left out" in path.note
    still = [[*row[:4], 0.0, 0.0] for row in rows]
    assert len(read(written(tmp_path, still))[0]) == 10  # a needle at rest is no lost sensor


@pytest.mark.parametrize(
    "change, words",
    [
        (lambda rows: rows[2].__setitem__(1, "nan"), "line 4"),
        (lambda rows: rows[2].__setitem__(1, ""), "not a number"),
        (lambda rows: [row.__setitem__(2, 0.0) for row in rows], "does not advance"),
    ],
)
def test_bad_values_are_named(tmp_path, change, words):
    rows = straight()
    change(rows)
    with pytest.raises(nf.InputError, match=words):
        read(written(tmp_path, rows))


def test_bad_tables_are_named(tmp_path):
    with pytest.raises(nf.InputError, match="tip_x_mm"):
        read(written(tmp_path, [[1, 2]], ["time", "force"]))
    with pytest.raises(nf.InputError, match="number of samples is 0"):
        read(written(tmp_path, []))
    with pytest.raises(nf.InputError, match="parsec"):
        read(written(tmp_path, straight(), [name.replace("_mm", "_parsec") for name in HEADER]))
    with pytest.raises(nf.InputError):
        read(tmp_path / "missing.csv")


def test_headers_of_other_programs_are_recognised(tmp_path):
    header = ["Run", "Tip x [mm]", "Tip y [mm]", "Tip z [mm]", "Guide X (mm)", "Guide Z (mm)", "Roll [deg]"]
    (path,) = read(written(tmp_path, [[*row, 90.0 * i] for i, row in enumerate(straight())], header))
    np.testing.assert_allclose(path.roll, 0.5 * math.pi * np.arange(6))
    assert path.name == "one"


def test_a_table_without_a_base_or_units(tmp_path):
    header = [name.removesuffix("_mm") for name in HEADER[:4]]
    file = written(tmp_path, [row[:4] for row in straight()], header)
    with pytest.raises(nf.InputError, match="unit='mm'"):
        read(file)
    (path,) = read(file, unit="mm")
    assert not path.steered and not path.base.any()
    np.testing.assert_allclose(path.tip[:, 2], 5e-3 * np.arange(6))


def test_real_table_agrees_with_the_csv_module(recordings):
    file = recordings / "needle-steering" / "stepwise_insertions.csv"
    paths = {path.name: path for path in read(file)}
    assert len(paths) == 22 and sum(path.steered for path in paths.values()) == 12
    assert len(paths["phantomA_closedloop_03"]) == 7  # tracking was lost
    with open(file, encoding="utf-8", newline="") as text:
        rows = [row for row in csv.DictReader(text) if row["file"] == "phantomB_openloop_02"]
    path = paths["phantomB_openloop_02"]
    for name, values in (("tip_x_mm", path.tip[:, 0]), ("tip_z_mm", path.tip[:, 1]), ("tip_y_mm", -path.tip[:, 2])):
        np.testing.assert_allclose([1e-3 * float(row[name]) for row in rows], values, rtol=1e-12)


def test_tip_paths_of_other_shapes_or_without_numbers_are_named():
    good = {"base": np.zeros((4, 2)), "tip": np.zeros((4, 3)), "slope": None}
    with pytest.raises(nf.InputError, match="tip of x"):
        nf.steering.TipPath("x", **(good | {"tip": np.zeros((3, 3))}))
    with pytest.raises(nf.InputError, match="roll of x"):
        nf.steering.TipPath("x", **good, roll=np.zeros(3))
    with pytest.raises(nf.InputError, match="not finite"):
        nf.steering.TipPath("x", **(good | {"base": np.full((4, 2), math.nan)}))


@pytest.mark.parametrize(
    ("axis", "sign", "turns"), [("z", 1, 1), ("z", -1, -1), ("y", 1, -1), ("y", -1, 1), ("x", 1, 1), ("x", -1, -1)]
)
def test_roll_is_right_handed_about_the_direction_of_the_insertion(tmp_path, axis, sign, turns):
    # a bevel that points along the first axis across, and is turned by 90 degrees about where the needle goes
    across = [name for name in "xyz" if name != axis]
    first, along = np.eye(3)["xyz".index(across[0])], sign * np.eye(3)["xyz".index(axis)]
    turned = np.cross(along, first)  # a rotation by 90 degrees
    assert turned["xyz".index(across[1])] == turns
    names = [f"tip_{name}_mm" for name in "xyz"] + [f"base_{name}_mm" for name in across] + ["roll_deg"]
    rows = [[*(sign * 5.0 * k * (name == axis) for name in "xyz"), 0.0, 0.0, 90.0] for k in range(5)]
    file = tmp_path / "rolled.csv"
    file.write_text("\n".join([",".join(names), *(",".join(map(str, row)) for row in rows)]), encoding="utf-8")
    np.testing.assert_allclose(read(file)[0].roll, turns * np.pi / 2.0)


def test_slopes_as_angles_are_slopes_and_a_roll_needs_a_unit(tmp_path):
    header = [*HEADER[:4], "tip_slope_x_deg", "tip_slope_z_deg"]
    rows = [[*row[:4], 45.0, 0.0] for row in straight()]
    (path,) = read(written(tmp_path, rows, header))
    np.testing.assert_allclose(path.slope[:, 0], 1.0, rtol=1e-12)
    with pytest.raises(nf.InputError, match="roll_deg"):
        read(written(tmp_path, [[*row, 90.0] for row in straight()], [*HEADER, "roll"]))


def test_quaternions_are_normalised_and_must_be_rotations(tmp_path):
    header = [*HEADER[:4], "tip_qw", "tip_qx", "tip_qy", "tip_qz"]
    half = 0.5 * math.radians(10.0)
    turned = np.array([math.cos(half), 0.0, 0.0, math.sin(half)])
    (path,) = read(written(tmp_path, [[*row[:4], *(1.04 * turned)] for row in straight()], header))
    np.testing.assert_allclose(path.slope[:, 0], math.tan(math.radians(10.0)), rtol=1e-9)
    with pytest.raises(nf.InputError, match="norm of tip_qw to tip_qz is 0"):
        read(written(tmp_path, [[*row[:4], 0.0, 0.0, 0.0, 0.0] for row in straight()], header))
