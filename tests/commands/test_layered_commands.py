# SPDX-License-Identifier: Apache-2.0
"""Layered fits and comparisons on the command line, on repeats of one layered specimen."""

import json

import numpy as np
import pytest
from command_line import run

import needleforce as nf
from needleforce.commands.compare import names_of
from needleforce.identification.models import IDENTIFIED, MODELS, OF_LAYERS, stiffness_law

PUNCTURES = ((7.5e-3, 4.5e-3), (8e-3, 5e-3), (8.5e-3, 4.8e-3))  # m below the tops of the two layers


@pytest.fixture(scope="module")
def repeats(tmp_path_factory):
    """Three repeats of a specimen with the two layers of the preset, whose punctures differ."""
    folder, specimen = tmp_path_factory.mktemp("repeats"), nf.preset("layered")
    (deeper,) = specimen.deeper
    for k, (first, second) in enumerate(PUNCTURES):
        layer = nf.Layer(deeper.top, deeper.stiffness, nf.laws.PunctureDepth(second), *deeper.parts[2:])
        model = specimen.replace(puncture=nf.laws.PunctureDepth(first), deeper=(layer,))
        made = nf.simulate(model, nf.Motion.insert(start=-3e-3, speed=4e-3, depth=19e-3, hold=3.0), rate=100.0)
        force = made.force + 5e-3 * np.random.default_rng(k).standard_normal(len(made))
        nf.write(nf.Recording(made.time, made.depth, made.velocity, force), folder / f"run{k}.csv")
    return sorted(folder.glob("*.csv"))


def test_a_layered_fit_from_files_to_a_preset(repeats, tmp_path):
    out = {name: tmp_path / f"out.{name}" for name in ("json", "html", "toml", "csv")}
    done = run("identify", *repeats, "--model", "layered", "--layers", 2, "--json", out["json"], "--report",
               out["html"], "--save", out["toml"], "--csv", out["csv"])  # fmt: skip
    assert done.returncode == 0, done.stderr
    for words in ("identified, layer 1", "identified, layer 2", "all layers", "choice of layers", "chosen"):
        assert words in done.stdout, words
    assert "The number of layers was given" in done.stderr.replace("\n", " ")
    document = json.loads(out["json"].read_text())
    assert document["settings"]["evidence"][0]["choice"] == "2 layers"
    assert document["quality"]["nrmse"] < 0.03
    # total drag of all layers: the sum of the specimen's 140 and 70 N/m
    found = {row["name"]: row["value"] for row in document["parameters"]}
    friction = found["friction_per_length"] + found["layer_2_friction_per_length"]
    assert friction == pytest.approx(210.0, rel=0.15)
    assert len(nf.preset(out["toml"]).layers) == 2 == len(document["ruptures"]["depth_m"])
    assert "layer_2_puncture_depth" in out["csv"].read_text()
    assert 'id="figure-layers"' in out["html"].read_text()


def test_layers_are_refused_for_other_models(repeats):
    for arguments in (("--layers", 2), ("--model", "layered", "--layers", 4)):
        done = run("identify", repeats[0], *arguments)
        assert done.returncode == 2 and "layers" in done.stderr and "Traceback" not in done.stderr


def test_compare_reports_floor_and_held_out_repeats(repeats, tmp_path):
    out = tmp_path / "out.json", tmp_path / "out.html"
    done = run("compare", *repeats, "--models", "paper,cone_cylinder", "--json", out[0], "--report", out[1])
    assert done.returncode == 0, done.stderr
    assert "prediction" in done.stdout and "rms over 3 repeats" in done.stderr
    rows = json.loads(out[0].read_text())
    for row in rows:
        errors, floor = (np.array(row["cross_validation"][name]) for name in ("prediction", "floor"))
        assert errors.shape == floor.shape == (3, 4)
        assert row["prediction"] == pytest.approx(np.sqrt((errors[:, 0] ** 2).sum() / (floor[:, 0] ** 2).sum()))
    assert 'id="figure-cross-validation"' in out[1].read_text() and "run2.csv" in out[1].read_text()


def test_one_recording_has_no_floor(repeats):
    done = run("compare", repeats[0], "--models", "paper")
    assert done.returncode == 0 and "it needs 3 repeats of the same motion" in done.stderr


def test_all_is_every_law_once():
    names = names_of("all")
    laws = [stiffness_law(name) for name in names if name in MODELS]
    assert sorted(laws) == sorted(set(MODELS.values())) and set(OF_LAYERS) <= set(names)
    assert names_of("paper, maurin") == ["paper", "maurin"]


@pytest.mark.parametrize("command", ["identify", "compare"])
def test_the_help_has_every_name(command):
    shown = run(command, "--help").stdout
    words = shown.replace("│", " ").replace("|", " ").split()
    assert not [name for name in IDENTIFIED if not any(name in word for word in words)], shown
