# SPDX-License-Identifier: Apache-2.0
"""``needleforce steer`` from the rig's table to a plan and back, and on wrong usage."""

import csv
import json
from html.parser import HTMLParser

import numpy as np
import pytest
from typer.testing import CliRunner

import needleforce as nf
from needleforce.cli import app
from needleforce.errors import InputError
from needleforce.rig import SteeringPhantom
from needleforce.steering import BaseMotion

NEEDLE = """[needle]
outer_diameter_mm = 1.27
inner_diameter_mm = 0.0
length_mm = 300.0
young_modulus_GPa = 162.0
poisson_ratio = 0.3
"""


def run(*arguments):
    return CliRunner().invoke(app, ["steer", *(str(each) for each in arguments)])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A table of the rig, and the needle identified from it with a model of such tissue."""
    folder = tmp_path_factory.mktemp("steer")
    (folder / "needle.toml").write_text(NEEDLE, encoding="utf-8")
    assert run("simulate", "-o", folder / "paths.csv", "--insertions", 4, "--depth-mm", 80).exit_code == 0
    done = run(
        "identify", folder / "paths.csv", "--needle", folder / "needle.toml", "--model", "yielding", "--save",
        folder / "gel.toml", "--report", folder / "fit.html", "--json", folder / "fit.json",
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    (folder / "identify.txt").write_text(done.stdout, encoding="utf-8")
    return folder


def test_identified_needle_is_shown_and_kept(folder):
    text = (folder / "identify.txt").read_text(encoding="utf-8")
    assert "tip_force_x" in text and "error when left out [mm]" in text and "insertion 3" in text
    document = json.loads((folder / "fit.json").read_text(encoding="utf-8"))
    assert document["model"] == "yielding" and len(document["insertions"]) == 4
    by_name = {each["name"]: each for each in document["parameters"]}
    assert by_name["tip_force_x"]["low"] < SteeringPhantom().tip_force < by_name["tip_force_x"]["high"]


def test_model_file_predicts_as_the_fit(folder):
    paths = nf.steering.read(folder / "paths.csv")
    fit = nf.steering.identify(paths[:3], nf.Needle(1.27e-3, 0.0, 0.3, 162e9, 0.3), model="linear")
    fit.save(folder / "three.toml")
    again = nf.steering.load(folder / "three.toml")
    np.testing.assert_array_equal(again.predictor.tip(paths[3]), fit.predict(paths[3]))
    np.testing.assert_array_equal(again.predictor.uncertainty(paths[3]), fit.uncertainty(paths[3]))


def test_plan_ends_at_its_target_when_it_is_simulated(folder):
    done = run("plan", folder / "gel.toml", "--target-mm", "2,-1,70", "-o", folder / "plan.csv", "--json", "-")
    assert done.exit_code == 0, done.output
    document = json.loads(done.stdout)
    assert document["miss_m"] < 1e-4 and document["faults"] == [] and len(document["steps"]) == 15
    given = ["--model", folder / "gel.toml", "--motion", folder / "plan.csv", "--axial", "paper"]
    done = run("simulate", *given, "-o", folder / "run.csv", "--report", folder / "run.html")
    assert done.exit_code == 0 and "axial force" in done.output, done.output
    with open(folder / "run.csv", encoding="utf-8", newline="") as text:
        rows = list(csv.DictReader(text))
    # the axial force and a finer path move the tip by some tenths of a millimetre
    np.testing.assert_allclose([float(rows[-1][f"tip_{axis}_mm"]) for axis in "xyz"], [2.0, -1.0, 70.0], atol=0.3)
    assert float(rows[-1]["force_N"]) > 0.5 and rows[-1]["status"] == "ok"
    done = run("simulate", *given[:4], "-o", folder / "run.csv")
    assert "steps, tip at" in done.output and "axial force" not in done.output  # tip paths do not show one


def test_plan_with_measured_tips_begins_where_they_end(folder):
    tips = (folder / "paths.csv").read_text(encoding="utf-8").splitlines()
    measured = [line for line in tips if line.startswith(("insertion,", "insertion 3"))][:8]
    (folder / "measured.csv").write_text("\n".join(measured) + "\n", encoding="utf-8")
    done = run(
        "plan", folder / "gel.toml", "--target-mm", "0,0,80", "--measured", folder / "measured.csv", "--json", "-"
    )
    steps = json.loads(done.stdout)["steps"]
    with open(folder / "measured.csv", encoding="utf-8", newline="") as text:
        rows = list(csv.DictReader(text))
    np.testing.assert_allclose(
        [s["base_x_m"] for s in steps[:7]], [1e-3 * float(r["base_x_mm"]) for r in rows], atol=1e-8
    )
    assert len(steps) > 8 and steps[-1]["tip"]["z_m"] == pytest.approx(0.08, abs=1e-4)


def test_what_cannot_be_had_is_stated_and_ends_with_1(folder):
    done = run("plan", folder / "gel.toml", "--target-mm", "40,0,60", "--report", folder / "far.html")
    assert done.exit_code == 1 and "out of reach by" in done.output
    assert "out of reach by" in (folder / "far.html").read_text(encoding="utf-8")
    done = run(
        "plan", folder / "gel.toml", "--target-mm", "0,0,60", "--box-mm", "-1,-1,30,30,30,35", "--clearance-mm", 0.2
    )
    assert done.exit_code == 0 and "away from obstacles" in done.output


class _Text(HTMLParser):
    def __init__(self, html):
        super().__init__()
        self.tags, self.text = [], ""
        self.feed(html)

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)

    def handle_data(self, data):
        self.text += data


@pytest.mark.parametrize("name, words", [("fit.html", "Needle identified from 4"), ("run.html", "The tip ends at")])
def test_reports_show_figures_with_units(folder, name, words):
    test_plan_ends_at_its_target_when_it_is_simulated(folder)
    page = _Text((folder / name).read_text(encoding="utf-8"))
    assert words in page.text and page.tags.count("svg") >= 2 and "[mm]" in page.text
    assert "http" not in page.text  # opens offline


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["plan", "gel.toml", "--target-mm", "1,2"], "3 numbers"),
        (["plan", "gel.toml", "--target-mm", "1_0,0,50"], "3 numbers"),
        (["plan", "gel.toml", "--target-mm", "0,0,-5"], "below the surface"),
        (["plan", "gel.toml", "--target-mm", "0,0,50", "--sphere-mm", "0,0,50"], "4 numbers"),
        (["plan", "gel.toml", "--target-mm", "0,0,50", "--max-lateral-mm", "-1"], "max_lateral"),
        (["plan", "needle.toml", "--target-mm", "0,0,50"], "steering"),
        (["identify", "paths.csv", "--needle", "needle.toml", "--only", "nobody"], "no insertion has a name"),
        (["identify", "needle.toml", "--needle", "needle.toml"], "needle.toml"),
        (["simulate", "-o", "x.csv", "--step-mm", "0"], "step-mm"),
        (["simulate", "-o", "x.csv", "--insertions", "0"], "insertions"),
        (["simulate", "-o", "x.csv", "--report", "x.html"], "--model"),
        (["simulate", "-o", "x.csv", "--motion", "paths.csv"], "depth_mm"),
    ],
)
def test_wrong_usage_is_named(folder, arguments, words, monkeypatch):
    monkeypatch.chdir(folder)
    done = run(*arguments)
    assert isinstance(done.exception, InputError) and words in str(done.exception), done.exception


@pytest.mark.parametrize(
    "change, words",
    [
        (lambda text: text.replace('steering = "yielding"\n', ""), "steering"),
        (lambda text: text.replace('steering = "yielding"', 'steering = "given"'), "linear or yielding"),
        (lambda text: text.replace("yielding_modulus", "pivot_stiffness"), "yielding_modulus is missing"),
        (lambda text: text.replace("covariance = [[", "covariance = [[-"), "eigenvalues above 0"),
        (lambda text: text.replace("modulus = ", "modulus = 1e9 # "), "outside"),
        (lambda text: text.replace("covariance = [[", "covariance = [[1.0, "), "covariance"),
        (lambda text: text.replace('"modulus"', '"magic"'), "magic"),
        (lambda text: text.replace("tip_force_x = ", "tip_force_x = nan # "), "tip_force_x"),
        (lambda text: text + "\n[other]\n", "other"),
        (lambda text: text.replace("roll = [0.0, ", "roll = ["), "insertion 0"),
    ],
)
def test_damaged_model_files_are_named(folder, change, words, tmp_path):
    text = (folder / "gel.toml").read_text(encoding="utf-8")
    assert change(text) != text
    (tmp_path / "bad.toml").write_text(change(text), encoding="utf-8")
    with pytest.raises(InputError, match=words):
        nf.steering.load(tmp_path / "bad.toml")


def test_base_motions_are_read_as_they_were_written(tmp_path):
    rng = np.random.default_rng(1)
    motion = BaseMotion(np.cumsum(rng.uniform(0.0, 5e-3, 9)), rng.normal(0.0, 1e-3, (9, 2)), rng.normal(size=9))
    motion.write(tmp_path / "plan.csv")
    again = BaseMotion.read(tmp_path / "plan.csv")
    for name in ("depth", "lateral", "roll"):
        np.testing.assert_allclose(getattr(again, name), getattr(motion, name), rtol=1e-5)
    (tmp_path / "bad.csv").write_text("depth_mm,base_x_mm,base_y_mm,roll_deg\n0,0,0,0\n5,x,0,0\n", encoding="utf-8")
    with pytest.raises(InputError):
        BaseMotion.read(tmp_path / "bad.csv")
