# SPDX-License-Identifier: Apache-2.0
"""The command line: exit codes, files and messages."""

import json

import numpy as np
import pytest
from command_line import run

import needleforce as nf


@pytest.fixture(scope="module")
def example(root):
    return root / "examples" / "insertion.csv"


@pytest.fixture
def document(example, tmp_path):
    outputs = ["--json", tmp_path / "out.json", "--report", tmp_path / "out.html", "--save", tmp_path / "mine.toml"]
    done = run("identify", example, *outputs)
    assert done.returncode == 0, done.stderr
    return json.loads((tmp_path / "out.json").read_text())


def test_identify_writes_json_report_and_preset(document, tmp_path):
    (one,) = document["recordings"]
    assert set(one) >= {"file", "status", "events", "phases", "parameters", "quality"} and one["status"] == "ok"
    assert set(one["events"]) == {"contact_depth_m", "punctures", "exit_depth_m"}
    assert set(one["events"]["punctures"][0]) >= {"depth_m", "indentation_m", "force_N", "drop_N"}
    assert set(one["phases"][0]) == {"phase", "start_s", "end_s"}
    assert [p["phase"] for p in one["phases"]] == ["free", "deformation", "insertion", "hold", "extraction", "free"]
    keys = {"name", "value", "unit", "low", "high", "between_repeats_sd", "identifiable", "source"}
    assert all(set(p) == keys | {"within_run_sd", "random", "systematic"} for p in document["parameters"])
    assert set(document["quality"]) == {"rmse_N", "nrmse", "r2", "sliding_N", "reversal_N"}
    assert (tmp_path / "out.html").stat().st_size > 10_000
    model = nf.preset(tmp_path / "mine.toml")
    named = {p["name"]: p["value"] for p in document["parameters"]}
    assert model.cutting.force == named["cutting_force"] and model.friction.per_length == named["friction_per_length"]


def test_identify_writes_estimates_and_draws(example, tmp_path):
    done = run("identify", example, "--csv", tmp_path / "estimates.csv", "--draws", tmp_path / "draws.csv")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "estimates.csv").read_text().startswith("recording,quantity,value,low,high,unit,")
    assert len((tmp_path / "draws.csv").read_text().splitlines()) == 1 + 2 * 4000  # pooled, and of the recording
    refused = run("identify", example, "--draws", tmp_path / "draws.txt")
    assert refused.returncode == 2 and "must end in .csv or .json" in refused.stderr


def test_a_bad_file_does_not_stop_the_rest(example, tmp_path):
    (tmp_path / "empty.csv").write_text("")
    done = run("identify", example, tmp_path / "empty.csv", "--json", "-")
    assert done.returncode == 0
    assert [r["status"] for r in json.loads(done.stdout)["recordings"]] == ["ok", "unreadable"]
    assert "empty.csv" in done.stderr


BAD_FILES = {
    "empty": "",
    "header only": "time_s,depth_m,force_N\n",
    "text": "time_s,depth_m,force_N\n" + "".join(f"{i},{i}e-5,{'x' if i == 7 else 0}\n" for i in range(60)),
    "not finite": "time_s,depth_m,force_N\n" + "".join(f"{i},{i}e-5,{'nan' if i > 30 else 0}\n" for i in range(60)),
    "backwards": "time_s,depth_m,force_N\n" + "".join(f"{60 - i},{i}e-5,0\n" for i in range(60)),
    "constant": "time_s,depth_m,force_N\n" + "".join(f"{i},0,{i}\n" for i in range(60)),
    "no force": "time_s,depth_m\n0,0\n1,1\n",
    "two forces": "time_s,depth_m,force_N,fz_N\n0,0,0,0\n1,1e-3,1,1\n",
    "one sample": "time_s,depth_m,force_N\n0,0,0\n",
    "units": "time,depth,force\n0,0,0\n1,1,1\n2,2,2\n",
    "no contact": "time_s,depth_m,force_N\n" + "".join(f"{i / 100},{i}e-5,{1e-3 * (i % 3)}\n" for i in range(1000)),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_recordings_without_parameters_are_explained(name, tmp_path):
    path = tmp_path / "run.csv"
    path.write_text(BAD_FILES[name])
    done = run("identify", path, "--report", tmp_path / "r.html", "--save", tmp_path / "m.toml")
    assert done.returncode == 1
    assert "run.csv" in done.stderr and "Traceback" not in done.stderr
    assert not (tmp_path / "m.toml").exists()


def test_no_puncture_and_cut_off(tmp_path):
    model = nf.preset("paper")
    shallow = nf.simulate(model, nf.Motion.insert(start=-2e-3, speed=3e-3, depth=2e-3))
    cut = nf.simulate(model, nf.Motion.insert(start=-2e-3, speed=3e-3, depth=10e-3, withdraw=False))
    for name, recording in (("shallow", shallow), ("cut", cut)):
        nf.write(recording, tmp_path / f"{name}.csv")
    done = run("identify", tmp_path / "shallow.csv")
    assert done.returncode == 1 and "no_puncture" in done.stderr
    done = run("identify", tmp_path / "cut.csv", "--json", "-")
    assert done.returncode == 0
    assert json.loads(done.stdout)["recordings"][0]["status"] == "incomplete"


def test_a_depth_that_decreases_inwards_is_recognised_and_reported(tmp_path):
    recording = nf.simulate(nf.preset("paper"), nf.Motion.insert(start=-2e-3, speed=3e-3, depth=10e-3, hold=1.0))
    rows = np.column_stack([recording.time, -recording.depth, recording.force])
    np.savetxt(tmp_path / "up.csv", rows, delimiter=",", header="time_s,depth_m,force_N", comments="")
    recognised, given = (
        run("identify", tmp_path / "up.csv", "--json", "-", *more) for more in ((), ("--depth-inwards", "decreasing"))
    )
    assert recognised.returncode == given.returncode == 0
    assert "its sign is reversed (--depth-inwards increasing keeps it)" in recognised.stderr
    found, expected = (json.loads(each.stdout)["parameters"] for each in (recognised, given))
    assert found == expected


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["identify"], "Missing argument"),
        (["identify", "x.csv", "--column", "fz"], "force=fz"),
        (["simulate", "--preset", "nothing", "-o", "x.csv"], "paper_116"),
        (["simulate", "--preset", "paper", "--speed-mm-s", "0", "-o", "x.csv"], "speed"),
        (["compare"], "Missing argument"),
        (["magic"], "magic"),
    ],
)
def test_wrong_usage(arguments, message, tmp_path):
    done = run(*arguments, cwd=tmp_path)
    assert done.returncode == 2 and message in done.stderr
    assert not list(tmp_path.iterdir())


def test_a_model_that_does_not_exist_is_wrong_usage(example):
    done = run("identify", example, "--model", "papr")
    assert done.returncode == 2 and "Did you mean paper?" in done.stderr and "cone_cylinder" in done.stderr


def test_a_name_that_is_mistyped_is_proposed(example, tmp_path):
    (tmp_path / "liver").mkdir()
    for arguments in (["identify", "livr"], ["campaign", "./livr"], ["./livr"]):
        assert "Did you mean liver?" in run(*arguments, cwd=tmp_path).stderr
    assert "Did you mean paper" in run("identify", example, "--needle", "papper").stderr


def test_names_are_not_broken_in_a_narrow_table(example, capsys, monkeypatch):
    from needleforce.commands.output import table

    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    table("models", ["model", *(f"quantity {k}" for k in range(10))], [["layered_as_fitted", *["1.234"] * 10]])
    assert "layered_as_fitted" in capsys.readouterr().out


def test_simulate_then_identify(tmp_path):
    done = run("simulate", "--preset", "paper", "--speed-mm-s", "3", "--depth-mm", "15", "-o", tmp_path / "run.csv")
    assert done.returncode == 0, done.stderr
    done = run("identify", tmp_path / "run.csv", "--json", "-", "--model", "paper")
    found = {p["name"]: p["value"] for p in json.loads(done.stdout)["parameters"]}
    assert found["cutting_force"] == pytest.approx(0.0776, rel=1e-3)
    assert found["friction_per_length"] == pytest.approx(18.6, rel=1e-3)
    assert found["puncture_indentation"] == pytest.approx(3.237e-3, abs=5e-6)
    assert found["stiffness_coefficient"] == pytest.approx(2 / np.pi * 117546.06 * np.tan(np.radians(15)), rel=1e-3)


def test_compare_laws_and_presets_write_json(example):
    rows = json.loads(run("compare", example, "--models", "paper,cone_cylinder", "--json", "-").stdout)
    assert {row["model"] for row in rows} == {"paper", "cone_cylinder"} and rows[0]["bic"] <= rows[1]["bic"]
    everything = json.loads(run("compare", example, "--json", "-").stdout)
    assert {row["model"] for row in everything} == {"paper", "cone_cylinder", "power_law", "okamura", "maurin"}
    assert sum(row["wins"] for row in everything) == 1 == everything[0]["wins"]
    laws = json.loads(run("laws", "--json", "-").stdout)
    assert {"cone", "cone_cylinder", "coulomb", "constant_cutting"} <= {law["name"] for law in laws}
    presets = json.loads(run("presets", "--json", "-").stdout)
    assert [p["name"] for p in presets] == list(nf.presets()) and all(p["reference"] for p in presets)


def test_laws_for_a_needle_come_with_a_verdict():
    rows = json.loads(run("laws", "--needle", "physical", "--indentation-mm", "3", "--json", "-").stdout)
    verdicts = {row["law"]: row["verdict"] for row in rows}
    assert verdicts["cone"] == "not applicable" and verdicts["cone_cylinder"] == "scaling law only"
    # the preset paper has a needle and no tissue
    rows = json.loads(run("laws", "--needle", "paper", "--json", "-").stdout)
    assert "no tissue" in next(row["reason"] for row in rows if row["law"] == "relaxing_surface")
    assert next(row["verdict"] for row in rows if row["law"] == "cone") == "scaling law only"  # by its angle
    rows = json.loads(run("laws", "--needle", "paper", "--tissue", "physical", "--json", "-").stdout)
    assert next(row["verdict"] for row in rows if row["law"] == "cone") == "scaling law only"


def test_named_models_references_and_published_values_write_json():
    models = json.loads(run("laws", "--models", "--json", "-").stdout)
    assert {"paper", "okamura", "maurin", "azar", "layered"} <= {model["name"] for model in models}
    references = json.loads(run("laws", "--citations", "--json", "-").stdout)
    assert any(work["key"] == "Sneddon 1965" and "Boussinesq" in work["reference"] for work in references)
    values = json.loads(run("presets", "--published", "--json", "-").stdout)
    assert {value["status"] for value in values} == {"verified", "secondary"}


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["laws"], ["cone_cylinder", "N s/m^2", "free: elastic"]),
        (["laws", "--models"], ["layered_as_fitted"]),
        (["presets"], ["unverified", "okamura_liver"]),
        (["presets", "--published"], ["secondary", "J/m^2"]),
        (["laws", "--needle", "physical"], ["scaling law only"]),
    ],
)
def test_tables_show_their_content(arguments, words):
    done = run(*arguments)
    assert done.returncode == 0 and all(word in done.stdout for word in words)


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["laws", "--needle", "nowhere.toml"], "nowhere.toml"),
        (["laws", "--tissue", "paper"], "[tissue]"),
        (["laws", "--needle", "okamura_liver"], "needle"),
        (["laws", "--needle", "paper", "--depth-mm", "0"], "depth"),
    ],
)
def test_an_invalid_case_is_refused(arguments, message):
    done = run(*arguments)
    assert done.returncode == 2 and message in done.stderr and "Traceback" not in done.stderr


def test_simulate_reports_unverified_values_and_violated_ranges(tmp_path):
    done = run("simulate", "--preset", "okamura_liver", "--citations", "-o", tmp_path / "run.csv")
    assert done.returncode == 0 and "Unverified" in done.stderr and "831542" in done.stdout
    assert "831542" not in run("simulate", "--preset", "okamura_liver", "-o", tmp_path / "run.csv").stdout
    (tmp_path / "far.toml").write_text(
        'name = "far"\nsummary = "x"\nreference = "by hand"\n'
        '[stiffness]\nlaw = "exponential"\nrate_per_m = 5000\nscale_N = 1e-9\n'
        '[puncture]\nlaw = "puncture_depth"\ndepth_mm = 100\n'
        '[friction]\nlaw = "coulomb"\nper_length_N_per_m = 1\n[cutting]\nlaw = "no_cutting"\n'
    )
    done = run("simulate", "--preset", tmp_path / "far.toml", "-o", tmp_path / "far.csv")
    assert done.returncode == 0 and "outside the range of the model" in done.stderr
    assert "outside_range" in (tmp_path / "far.csv").read_text()[:2000]


def test_version():
    assert run("--version").stdout.strip() == nf.__version__


@pytest.mark.parametrize(
    "arguments",
    [
        ["--report", "run.csv"],
        ["--json", "run.csv"],
        ["--save", "a.toml", "--json", "a.toml"],
        ["--report", "nowhere/r.html"],
        ["--save", "."],
        ["--json", ""],
        ["--unit", "force=furlong"],
        ["--unit", "time=us", "--unit", "time=s"],
        ["--column", "bogus=fx"],
        ["--depth-inwards", "sideways"],
        ["--filter-length", "0"],
        ["run.csv"],
    ],
)
def test_usage_is_refused_before_anything_is_written(example, tmp_path, arguments):
    (tmp_path / "run.csv").write_bytes(example.read_bytes())
    done = run("identify", "run.csv", *arguments, cwd=tmp_path)
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["run.csv"]
    assert (tmp_path / "run.csv").read_bytes() == example.read_bytes()


def test_an_old_file_is_kept_when_the_new_one_fails(example, tmp_path):
    (tmp_path / "mine.toml").write_text("precious")
    done = run("identify", tmp_path / "absent.csv", "--save", tmp_path / "mine.toml")
    assert done.returncode == 1 and (tmp_path / "mine.toml").read_text() == "precious"
    assert "not written" in done.stderr


def test_one_bad_second_pass_does_not_stop_the_rest(tmp_path):
    model = nf.preset("paper")
    deep, shallow = (nf.Motion.insert(start=-2e-3, speed=3e-3, depth=z, hold=1.0) for z in (14e-3, 2e-3))
    for k in range(3):
        insertion = nf.Insertion(model)
        for number, motion in ((1, deep), (2, shallow if k == 2 else deep)):
            time = np.arange(int(motion.duration * 500)) / 500
            depth, velocity = motion.at(time)
            force = insertion.run(depth, None, np.full(len(time), 2e-3))["force"]
            force = force + np.random.default_rng(10 * k + number).normal(0, 1e-3, len(time))
            nf.write(nf.Recording(time, depth, velocity, force), tmp_path / f"site{k}_pass{number}.csv")
    passes = [[tmp_path / f"site{k}_pass{number}.csv" for k in range(3)] for number in (1, 2)]
    seconds = [word for path in passes[1] for word in ("--second-pass", path)]
    done = run("identify", *passes[0], *seconds, "--json", "-")
    document = json.loads(done.stdout)
    assert done.returncode == 0 and len(document["two_pass"]["sites"]) == 2
    assert any("second pass cannot be used" in note for note in document["recordings"][2]["notes"])
    found = {p["name"]: p["value"] for p in document["parameters"]}
    assert found["cutting_force"] == pytest.approx(0.0776, abs=2e-3)
