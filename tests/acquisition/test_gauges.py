# SPDX-License-Identifier: Apache-2.0
"""The wrench from gauge voltages, against a calculation by hand and a published calibration."""

import numpy as np
import pytest

import needleforce as nf
from needleforce.acquisition.sources.gauge_calibration import Calibration, read_calibration

# the calibration of the Nano17 FT8577 of 2014, as its owner published the file: rows with their scales, and the same
# rows at the sensor's face, in N and N mm for a volt
AXIS = """-0.06744 -0.06253 0.34834 37.34247 1.90538 -37.39899 25 11.3650042049178
0.55821 -45.57953 -0.51071 22.00831 -0.39426 21.28868 25 11.3650042049178
22.07572 0.66524 22.64229 0.15088 21.81132 -0.64550 35 5.89341666193018
0.25495 0.07335 38.61586 0.30585 -38.71584 1.08341 250 1.82292883446332
-43.12768 -1.34402 23.17737 0.13073 21.67933 -0.58572 250 1.82292883446332
0.23141 -23.28809 -0.53681 -22.47927 1.56779 -22.44391 250 1.57420173377595"""
USER_AXIS = """-0.00593 -0.00550 0.03065 3.28574 0.16765 -3.29072
0.04912 -4.01052 -0.04494 1.93650 -0.03469 1.87318
3.74583 0.11288 3.84196 0.02560 3.70096 -0.10953
0.43927 -24.40787 20.90948 11.97267 -21.44973 12.01322
-23.62228 -0.70375 12.52751 -19.95816 10.87057 19.73889
0.14700 -14.79358 -0.34100 -14.27979 0.99593 -14.25733"""
SI = np.array([1.0, 1.0, 1.0, 1e-3, 1e-3, 1e-3])
MATRIX = np.array([line.split() for line in USER_AXIS.splitlines()], float)
NAMES = ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz")


def xml(user: bool = True, units: str = "N-mm", rotation: str = "0", names=NAMES) -> str:
    rows = [line.split() for line in AXIS.splitlines()]
    axes = [f'<Axis Name="{n}" values=" {" ".join(r[:6])} " max="{r[6]}" scale="{r[7]}"/>' for n, r in zip(names, rows)]
    faces = [f'<UserAxis Name="{n}" values="{line}" max="25"/>' for n, line in zip(names, USER_AXIS.splitlines())]
    return (
        '<?xml version="1.0" encoding="utf-8"?><!-- a note --><FTSensor Serial="FT8577" NumGages="6">'
        f'<Calibration ForceUnits="N" TorqueUnits="{units}" DistUnits="mm" OutputRange="20" OutputBipolar="True">'
        f'{"".join(axes)}<BasicTransform Dx="0" Dy="0" Dz="6.096" Rx="{rotation}" Ry="0" Rz="0"/>'
        f"{''.join(faces) if user else ''}</Calibration></FTSensor>"
    )


TOML = f"""serial = "FT8577"
force_unit = "N"
torque_unit = "Nmm"
bias_V = [0.1, 0, 0, 0, 0, -0.2]
full_scale_V = 5
ratings = [25, 25, 35, 250, 250, 250]
matrix = {MATRIX.tolist()}
"""
CSV = "axis,unit,g0,g1,g2,g3,g4,g5\n" + "".join(
    f"{name},{unit},{','.join(line.split())}\n"
    for name, unit, line in zip(NAMES[::-1], ("Nmm",) * 3 + ("N",) * 3, USER_AXIS.splitlines()[::-1])
)


def read(tmp_path, text: str, name: str) -> Calibration:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return read_calibration(path)


def test_a_wrench_is_the_matrix_times_the_voltages_minus_the_bias(tmp_path):
    calibration = read(tmp_path, TOML, "nano.toml")
    volts = np.random.default_rng(1).uniform(-1.0, 1.0, (50, 6))
    by_hand = [[SI[i] * sum(MATRIX[i, j] * (v[j] - b[j]) for j in range(6)) for i in range(6)]
               for v in volts for b in [[0.1, 0, 0, 0, 0, -0.2]]]  # fmt: skip
    np.testing.assert_allclose(calibration.wrench(volts), by_hand, rtol=0, atol=1e-13)
    assert (calibration.serial, calibration.ratings) == ("FT8577", (25.0, 25.0, 35.0, 0.25, 0.25, 0.25))


@pytest.mark.parametrize("text, name", [(CSV, "nano.csv"), (xml(), "FT8577.cal"), (xml(), "FT8577.XML")])
def test_three_layouts_give_the_same_matrix(tmp_path, text, name):
    calibration = read(tmp_path, text, name)
    np.testing.assert_allclose(calibration.matrix, SI[:, None] * MATRIX, rtol=1e-15)
    assert calibration.full_scale == 10.0 and not calibration.bias.any()


def test_a_file_without_user_axes_gives_the_matrix_of_newer_files(tmp_path):
    calibration = read(tmp_path, xml(user=False), "FT8577.cal")
    # the maker rounds to 1e-5; six such roundings times the shift of 6 mm
    np.testing.assert_allclose(calibration.matrix / SI[:, None], MATRIX, rtol=0, atol=2e-5)
    assert "BasicTransform" in calibration.notes[0]
    np.testing.assert_allclose(calibration.ratings, [25.0, 25.0, 35.0, 0.25, 0.25, 0.25])


def test_a_gauge_at_the_end_of_the_range_is_reported_as_saturated(tmp_path):
    calibration = read(tmp_path, TOML, "nano.toml")
    volts = np.zeros((4, 6))
    volts[1, 5], volts[2, 0], volts[3, 2] = 4.999, 5.0, -7.0
    assert calibration.status(volts).tolist() == [0, 0, 1 << 17, 1 << 17]


@pytest.mark.parametrize(
    "change, message",
    [
        (lambda m: m[:5], r"shape \(5, 6\)"),
        (lambda m: [*m[:5], m[4]], "singular"),
        (lambda m: [*m[:5], [0.0] * 6], "singular"),
        (lambda m: [*m[:5], [float("nan")] * 6], "not finite"),
        (lambda m: [row[:5] for row in m], r"shape \(6, 5\)"),
        (lambda m: [*m[:5], m[5][:3]], "ragged"),
    ],
)
def test_invalid_matrices_are_refused(tmp_path, change, message):
    text = TOML.replace(str(MATRIX.tolist()), str(change(MATRIX.tolist())))
    with pytest.raises(nf.InputError, match=f"nano.toml.*{message}"):
        read(tmp_path, text, "nano.toml")


@pytest.mark.parametrize(
    "text, name, message",
    [
        (TOML + "colour = 3\n", "a.toml", "unknown field `colour`"),
        (TOML.replace('"Nmm"', '"furlong"'), "a.toml", "unit of torque"),
        (TOML.replace("full_scale_V = 5", "full_scale_V = 0"), "a.toml", "full scale"),
        (TOML.replace("bias_V = [0.1, ", "bias_V = ["), "a.toml", "bias voltages"),
        ("matrix = ", "a.toml", "Invalid value"),
        (CSV.replace("Fz", "Fq"), "a.csv", "row is 'Fq'"),
        (CSV.replace("Fz", "Fy"), "a.csv", "row is 'Fy'"),
        ("".join(CSV.splitlines(keepends=True)[:4]), "a.csv", "fx, fy, fz"),
        (CSV.replace("3.74583", "three"), "a.csv", "three"),
        (CSV.replace(",-0.10953", ""), "a.csv", "six numbers"),
        (CSV + "\nfx", "a.csv", "row is 'fx'"),
        (xml(units="stone"), "a.cal", "TorqueUnits"),
        (xml(user=False, rotation="90"), "a.cal", "a rotation"),
        (xml(names=("Fx",) * 6), "a.cal", "one each"),
        (xml().replace("3.74583", "x"), "a.cal", "'x'"),
        (xml().replace("3.74583 ", ""), "a.cal", "not six"),
        (xml()[:400], "a.cal", "not readable"),
        ("<!DOCTYPE x>" + xml(), "a.cal", "not readable"),
        ("<netft/>", "a.cal", "<netft>"),
        (xml(), "a.txt", "known endings"),
    ],
)
def test_invalid_calibration_files_are_refused_with_their_name(tmp_path, text, name, message):
    with pytest.raises(nf.InputError, match=message) as caught:
        read(tmp_path, text, name)
    assert name in str(caught.value)


def test_the_error_for_a_missing_file_has_the_reason(tmp_path):
    with pytest.raises(nf.InputError, match="calibration file is missing"):
        read_calibration(tmp_path / "none.toml")
