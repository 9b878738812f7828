# SPDX-License-Identifier: Apache-2.0
"""``needleforce tension`` and ``needleforce bending`` on files with known moduli, and on wrong usage."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from needleforce.bench_tests import elastica_deflection, nominal_stress, three_point_load
from needleforce.cli import app
from needleforce.preset_files import needle_of

STRETCH = np.linspace(1.0, 1.3, 31)
NOISE = np.random.default_rng(1).standard_normal(31)


def run(*arguments):
    return CliRunner().invoke(app, [str(each) for each in arguments])


@pytest.fixture
def headerless(tmp_path):
    """Stress first, then stretch, of an equibiaxial test of 30 kPa."""
    stress = nominal_stress("neo_hookean", STRETCH, [10e3], "equibiaxial") + 50.0 * NOISE
    np.savetxt(tmp_path / "curve.txt", np.column_stack([1e-3 * stress, STRETCH]))
    return tmp_path / "curve.txt"


BY_POSITION = ("--column", "stress=1", "--column", "stretch=2", "--unit", "stress=kPa")


def test_tension_gives_modulus_law_figure_and_report(headerless, tmp_path):
    outputs = {name: tmp_path / f"out.{name}" for name in ("svg", "png", "html")}
    done = run("tension", headerless, *BY_POSITION, "--mode", "equibiaxial", "--json", "-", "--figure", outputs["svg"],
               "--report", outputs["html"])  # fmt: skip
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    (modulus,) = found["parameters"]
    assert modulus["low"] <= 30e3 <= modulus["high"] and not found["mode_assumed"]
    assert found["misfit"] < 0.01 and len(found["laws"]) == 7
    assert outputs["svg"].read_text().lstrip().startswith("<?xml")
    page = outputs["html"].read_text()
    assert "neo-Hookean" in page and "Mooney-Rivlin" in page and "<svg" in page


def test_a_mode_that_was_not_given_is_in_the_result(headerless):
    done = run("tension", headerless, *BY_POSITION)
    assert done.exit_code == 0 and "uniaxial (assumed)" in done.stdout
    assert "a curve does not show it" in done.stderr
    document = json.loads(run("tension", headerless, *BY_POSITION, "--json", "-").stdout)
    assert document["mode_assumed"] and any("loading mode is uniaxial" in each for each in document["assumptions"])


def test_one_law_and_a_range(headerless):
    done = run("tension", headerless, *BY_POSITION, "--law", "linear", "--max-stretch", "1.1", "--json", "-")
    found = json.loads(done.stdout)
    assert [law["law"] for law in found["laws"]] == ["linear"] and found["readings"] == [11]


@pytest.mark.parametrize(
    "arguments, code, message",
    [
        ((), 1, "--unit stress="),
        ((*BY_POSITION, "--max-stretch", "1.01"), 1, "at least 3 are needed"),
        (("--unit", "stress=kPa", "--column", "stress=3", "--column", "stretch=2"), 1, "from 1 to 2"),
        (("--mode", "biaxial"), 2, "equibiaxial"),
        (("--law", "hooke"), 2, "neo_hookean"),
        (("--mode", "planar", "--mode", "uniaxial"), 2, "there are 1 files"),
        (("--area-mm2", "-1"), 2, "must be above 0"),
        (("--figure", "out.bmp"), 2, ".svg"),
    ],
)
def test_wrong_usage_and_files_without_result(headerless, arguments, code, message):
    done = run("tension", headerless, *arguments)
    assert getattr(done.exception, "exit_code", done.exit_code) == code
    assert message in done.stderr + str(done.exception)


def test_bending_of_a_cantilever_and_of_a_supported_needle(tmp_path):
    needle = needle_of("paper")
    position = np.array([8e-3, 20e-3, 40e-3, 60e-3, 80e-3])
    deflection = elastica_deflection(0.1, position, needle) * [1.001, 0.999, 1.0, 1.001, 0.999]
    rows = np.column_stack([1e3 * position, np.full(5, 0.1), 1e3 * deflection])
    np.savetxt(tmp_path / "c.csv", rows, delimiter=",", header="position_mm,force_N,tip_deflection_mm", comments="")
    done = run("bending", tmp_path / "c.csv", "--needle", "paper", "--json", "-")
    found = json.loads(done.stdout)
    (modulus,) = found["parameters"]  # the form of `tension` and `identify`
    assert modulus["name"] == "needle_young_modulus" and modulus["unit"] == "Pa"
    assert modulus["low"] <= needle.young_modulus <= modulus["high"] and found["readings"] == 5
    assert "formula for small ones" in done.stderr
    share = np.linspace(0.0, 0.15, 30)
    rows = np.column_stack([40.0 * share, needle.bending_stiffness / 0.04**2 * three_point_load(share)])
    np.savetxt(tmp_path / "t.csv", rows, delimiter=",", header="Extension (mm),Load (N)", comments="")
    done = run("bending", tmp_path / "t.csv", "--span-mm", "40", "--json", "-")
    assert json.loads(done.stdout)["bending_stiffness_Nm2"] == pytest.approx(needle.bending_stiffness, rel=1e-4)
    shown = run("bending", tmp_path / "t.csv", "--span-mm", "40", "--needle", "paper")
    assert shown.exit_code == 0 and "Young's modulus" in shown.stdout


def test_a_cantilever_needs_its_needle(tmp_path):
    (tmp_path / "c.csv").write_text("position_mm,force_N,tip_deflection_mm\n1,2,3\n")
    done = run("bending", tmp_path / "c.csv")
    assert "--needle" in str(done.exception) + done.stderr
