# SPDX-License-Identifier: Apache-2.0
"""``needleforce indentation`` on a file with known parameters, and on wrong usage."""

import json
import math
import re

import numpy as np
import pytest
from typer.testing import CliRunner

import needleforce as nf
from needleforce.cli import app
from needleforce.identification import fit_indentation

DEPTH, E_R, CONTACT = np.linspace(-2e-3, 1.5e-3, 500), 2e4, 0.1234e-3


@pytest.fixture
def file(tmp_path):
    """An indentation in micrometres, positive outwards, and a retraction with hysteresis."""
    force = E_R * 4 / 3 * math.sqrt(1e-3) * np.maximum(DEPTH - CONTACT, 0.0) ** 1.5
    force += 3e-3 + 1e-4 * np.random.default_rng(17).normal(size=len(DEPTH))
    rows = np.column_stack([np.r_[DEPTH, DEPTH[::-1]] * -1e6, np.r_[force, 0.5 * force[::-1]]])
    rows = np.column_stack([np.arange(len(rows)) * 1e-3, np.repeat([0, 1], len(DEPTH)), rows])
    path = tmp_path / "curve.csv"
    np.savetxt(path, rows, delimiter=",", header="time_s,segment,height_um,force_N", comments="")
    return path


READING = ["--column", "depth=height_um", "--unit", "depth=um", "--depth-inwards", "decreasing"]
SPHERE = ["--tip", "paraboloid", "--radius-um", "1000"]


@pytest.mark.parametrize("more", [[], ["--segment", "segment=0.000000000000000000e+00"]])
def test_the_command(file, more):
    done = CliRunner().invoke(
        app, ["indentation", str(file), *READING, *SPHERE, *more, "--poisson-ratio", "0.5", "--json", "-"]
    )
    assert done.exit_code == 0, done.output
    (found,) = json.loads(done.stdout)["tips"]
    values = {each["name"]: each for each in found["parameters"]}
    assert values["young_modulus"]["low"] <= 0.75 * E_R <= values["young_modulus"]["high"]
    assert values["contact_depth"]["value"] == pytest.approx(CONTACT, abs=2e-6)
    assert ("indentation ends at the deepest" in done.stderr) == (not more)
    unloading = {each["name"]: each["value"] for each in found["unloading"]["parameters"]}
    # half of the force and of its zero at every depth
    assert unloading["reduced_modulus"] == pytest.approx(0.5 * E_R, rel=0.05)


@pytest.mark.parametrize(
    "arguments, code, message",
    [
        ([*READING, *SPHERE, "--segment", "segment=7"], 1, "never 7, it contains 0"),
        ([*READING, *SPHERE, "--segment", "part=0"], 1, "the columns are 'time_s', 'segment'"),
        (["--column", "depth=none", *SPHERE], 1, "column for the depth is 'none', the columns are 'time_s'"),
    ],
)
def test_a_file_without_result_exits_with_1(file, arguments, code, message):
    done = CliRunner().invoke(app, ["indentation", str(file), *arguments])
    assert done.exit_code == code
    assert re.search(message, done.stderr), done.stderr


def test_a_depth_that_decreases_inwards_is_recognised(file):
    given, recognised, alone = (
        CliRunner().invoke(app, ["indentation", str(file), *reading, *SPHERE, "--json", "-"])
        for reading in (READING, READING[:4], [])
    )
    assert recognised.stdout == alone.stdout == given.stdout
    assert "depth decreases while the needle goes in: its sign is reversed" in recognised.stderr
    assert "the depth is the column 'height_um', the only one with a unit for it" in alone.stderr


def test_a_file_without_a_depth_exits_with_1(tmp_path):
    np.savetxt(tmp_path / "force.csv", np.column_stack([np.arange(99.0)] * 2), delimiter=",", header="time_s,force_N",
               comments="")  # fmt: skip
    done = CliRunner().invoke(app, ["indentation", str(tmp_path / "force.csv"), *SPHERE])
    assert done.exit_code == 1 and "no column holds the depth" in done.stderr


@pytest.mark.parametrize(
    "arguments, message",
    [
        ([], "--needle with a file"),
        (["--tip", "ball"], "known are cone"),
        (["--tip", "cone"], "Give --half-angle-deg"),
        (["--tip", "cone", "--half-angle-deg", "25", "--radius-um", "1"], "no selected tip"),
        ([*SPHERE, "--baseline", "bent"], "Give one of none, constant, line"),
        ([*SPHERE, "--poisson-ratio", "0.6"], "poisson_ratio is 0.6"),
        ([*SPHERE, "--segment", "approach"], "quantity=name"),
    ],
)
def test_wrong_usage(file, arguments, message):
    done = CliRunner().invoke(app, ["indentation", str(file), *READING, *arguments])
    assert isinstance(done.exception, nf.InputError) and message in str(done.exception)


def test_a_needle_brings_its_tip_and_shank(file, tmp_path):
    needle = tmp_path / "needle.toml"
    needle.write_text(
        "outer_diameter_mm = 0.4\nlength_mm = 80\nyoung_modulus_GPa = 200\n"
        'tip = {shape = "cone", half_angle_deg = 15}\n'
    )
    done = CliRunner().invoke(app, ["indentation", str(file), *READING, "--needle", str(needle), "--json", "-"])
    assert done.exit_code == 0, done.output
    (found,) = json.loads(done.stdout)["tips"]
    rows = np.loadtxt(file, delimiter=",", skiprows=1)[: len(DEPTH)]
    cone = nf.tips.Cone(math.radians(15))
    fit = fit_indentation(-1e-6 * rows[:, 2], rows[:, 3], cone, shank_radius=0.2e-3)
    assert found["parameters"][0]["value"] == pytest.approx(fit.reduced_modulus.value, rel=1e-9)
    bare = fit_indentation(-1e-6 * rows[:, 2], rows[:, 3], cone)
    assert bare.reduced_modulus.value != pytest.approx(fit.reduced_modulus.value, rel=0.05)
