# SPDX-License-Identifier: Apache-2.0
"""``inspect``, its ``--save``, and the options kept for an instrument."""

import json
import re
import shlex

import numpy as np
import pytest
from typer.testing import CliRunner

import needleforce as nf
from needleforce.cli import app
from needleforce.recording.mappings import load_mapping, mapping_names


def insertion():
    """Time [s], depth [mm] and force [N] of an insertion and withdrawal."""
    time = np.arange(0.0, 20.0, 0.02)
    depth = 20.0 - 2.0 * np.abs(time - 10.0)
    return time, depth - 5.0, 0.04 * np.clip(depth - 5.0, 0.0, None) * np.where(time < 10.0, 1.0, -0.3)


@pytest.fixture
def odd(tmp_path):
    """A file that reads with options only: no headers, microns, a force in grams of the opposite sign."""
    time, depth, force = insertion()
    np.savetxt(tmp_path / "odd.txt", np.column_stack([-force / 9.80665e-3, 1e3 * depth, time]), delimiter="\t")
    return tmp_path / "odd.txt"


OPTIONS = ["--column", "time=3", "--column", "depth=2", "--column", "force=1", "--unit", "time=s", "--unit", "depth=um",
           "--unit", "force=g"]  # fmt: skip


@pytest.fixture
def home(tmp_path, monkeypatch):
    monkeypatch.setenv("NEEDLEFORCE_MAPPINGS", str(tmp_path / "mappings"))
    return tmp_path / "mappings"


def run(*arguments):
    return CliRunner().invoke(app, ["inspect", *map(str, arguments)])


def test_a_file_that_is_not_read_shows_its_columns_and_what_is_missing(odd):
    done = run(odd)
    assert done.exit_code == 1
    assert "no column holds the time and the force and the depth" in done.stderr
    for part in ("text", "15000", "19.98", "-5000"):  # the largest and smallest depth, the last time
        assert part in done.stdout, part


def test_the_command_that_is_shown_reads_the_file(odd):
    done = run(odd, *OPTIONS)
    assert done.exit_code == 0, done.output
    for part in ("1000 at 50 Hz", "-5.00 to 15.00 mm", "depth [mm]", "force [N]", "its sign is reversed", "contact at"):
        assert part in done.stdout, part
    command = shlex.split(done.stdout.strip().splitlines()[-1])
    assert command[:2] == ["needleforce", "identify"]
    again = CliRunner().invoke(app, ["inspect", *command[2:], "--no-plot"])
    assert again.exit_code == 0 and "1000 at 50 Hz" in again.stdout


def test_a_file_without_numbers_has_no_recording(tmp_path):
    (tmp_path / "notes.txt").write_text("no numbers\nin this text\n")
    shown = CliRunner().invoke(app, ["inspect", str(tmp_path / "notes.txt")])
    assert shown.exit_code == 1 and re.search(r"recordings \W+none", shown.stdout), shown.stdout


def test_a_dry_run_is_the_same_for_a_script(odd):
    found = nf.read(odd, dry_run=True)
    assert found.recording is None and "no column holds the time" in found.problem
    assert [column.largest for column in found.columns][1:] == pytest.approx([15000.0, 19.98])
    assert "Not read:" in str(found)
    assert "--column: columns" in str(found) and "--rate-hz: rate" in str(found)
    found = nf.read(
        odd, columns={"time": 3, "depth": 2, "force": 1}, units={"depth": "um", "force": "gf"}, dry_run=True
    )
    _, depth, force = insertion()
    np.testing.assert_allclose(found.recording.force, force, atol=1e-12)
    np.testing.assert_allclose(found.recording.depth, 1e-3 * depth, atol=1e-12)
    assert [column.quantity for column in found.columns] == ["force", "depth", "time"]


def test_a_figure(odd, tmp_path):
    assert run(odd, *OPTIONS, "--figure", tmp_path / "look.png").exit_code == 0
    assert (tmp_path / "look.png").read_bytes().startswith(b"\x89PNG")


def test_options_are_kept_under_a_name(odd, home):
    assert run(odd, *OPTIONS, "--save", "my-rig").exit_code == 0
    assert load_mapping("my-rig").columns == {"time": "3", "depth": "2", "force": "1"}
    done = run(odd, "--as", "my-rig")
    assert done.exit_code == 0 and "1000 at 50 Hz" in done.stdout
    assert done.stdout.strip().endswith("--as my-rig")
    np.testing.assert_allclose(nf.read(odd, mapping="my-rig").force, insertion()[2], atol=1e-12)


def test_a_file_in_the_folder_applies_to_all_in_it(odd, tmp_path):
    assert run(odd, *OPTIONS, "--save", tmp_path / "needleforce.toml").exit_code == 0
    recording = nf.read(odd)
    np.testing.assert_allclose(recording.force, insertion()[2], atol=1e-12)
    assert any("needleforce.toml in the folder" in sentence for sentence in recording.card.assumptions)
    assert nf.read(odd, units={"force": "mN"}).force.max() == pytest.approx(insertion()[2].max() / 9.80665)


def test_options_come_before_those_kept(odd, home):
    run(odd, *OPTIONS, "--save", "my-rig")
    assert nf.read(odd, mapping="my-rig", units={"depth": "nm"}).depth.max() == pytest.approx(15e-6)


def test_speed_step_and_first_row_are_kept_in_the_units_of_their_names(odd, home):
    options = ["--column", "force=1", "--unit", "force=g", "--speed-mm-s", "2", "--step-um", "40", "--first-row", "5"]
    done = run(odd, *options, "--save", "other")
    assert done.exit_code == 0, done.output
    kept = load_mapping("other")
    assert (kept.speed_mm_s, kept.step_um, kept.first_row) == (2.0, 40.0, 5)
    assert len(nf.read(odd, mapping="other")) == 996
    assert nf.read(odd, mapping="other").depth[1] == pytest.approx(40e-6)


@pytest.mark.parametrize("name, message", [("none", "known are anton_paar, instron"), ("x/y", "missing")])
def test_unknown_mappings(odd, home, name, message):
    done = CliRunner().invoke(app, ["inspect", str(odd), "--as", name])
    assert done.exit_code != 0 and re.search(message, str(done.exception) + done.output)


@pytest.mark.parametrize("text", ["column = 1", "first_row = 'a'", "[columns]\nforce = 1.5", "x = ["])
def test_damaged_mappings_are_refused_by_name(odd, tmp_path, text):
    (tmp_path / "broken.toml").write_text(text)
    with pytest.raises(nf.InputError, match=r"broken.toml"):
        nf.read(odd, mapping=tmp_path / "broken.toml")


def test_every_shipped_mapping_is_valid_and_described(home):
    names = mapping_names()
    assert set(names) >= {"instron", "zwick", "mach1", "ta_xt", "piuma", "anton_paar"}
    assert all(names.values())
    for name in names:
        assert set(load_mapping(name).columns) == {"time", "depth", "force"}


@pytest.mark.parametrize(
    "name, headers",
    [
        ("instron", "Time,Extension,Load"), ("instron", "Time,Displacement,Force"),
        ("zwick", "Prüfzeit,Standardweg,Standardkraft"), ("mach1", "Time,Position (z),Fz"),
        ("ta_xt", "Time,Distance,Force"), ("piuma", "Time,Indentation,Load"), ("anton_paar", "Time,Pd,Fn"),
    ],
)  # fmt: skip
def test_a_shipped_mapping_chooses_its_columns(tmp_path, name, headers):
    """With a second column that would match as well."""
    time, depth, force = insertion()
    rows = "\n".join(f"{t},{d},{f},{9 * f}" for t, d, f in zip(time, depth, force))
    (tmp_path / "x.csv").write_text(f"{headers},Force 2\n(s),(mm),(N),(N)\n{rows}\n", encoding="utf-8")
    recording = nf.read(tmp_path / "x.csv", mapping=name)
    np.testing.assert_allclose(recording.force, force, atol=1e-15)
    np.testing.assert_allclose(recording.depth, 1e-3 * depth, atol=1e-15)


def test_a_campaign_takes_every_recording_of_a_file(tmp_path):
    from needleforce.campaign import campaign

    time, depth, force = insertion()
    rng = np.random.default_rng(1)
    groups = [f"Time {k},Ext {k},Load {k}" for k in (1, 2, 3)]
    noisy = [force + rng.normal(0.0, 2e-3, len(force)) for _ in groups]
    rows = "\n".join(",".join(f"{t},{d},{f[i]:.6f}" for f in noisy) for i, (t, d) in enumerate(zip(time, depth)))
    units = ",".join(["s,mm,N"] * 3)
    (tmp_path / "three.csv").write_text(f"{','.join(groups)}\n{units}\n{rows}\n")
    found = campaign(tmp_path)
    assert [each.file for each in found.recordings] == ["three.csv: 1", "three.csv: 2", "three.csv: 3"]
    (condition,) = found.conditions
    assert len(condition.recordings) == 3


def test_an_absent_file_is_one_line():
    done = run("nothing.csv")
    assert done.stdout == "" and isinstance(done.exception, nf.InputError)


def test_the_command_after_saving_uses_the_mapping(odd, home):
    done = run(odd, *OPTIONS, "--save", "odd_rig", "--no-plot")
    assert shlex.split(done.stdout.strip().splitlines()[-1]) == ["needleforce", "identify", str(odd), "--as", "odd_rig"]
    again = run(odd, "--as", "odd_rig", "--no-plot")
    assert again.exit_code == 0 and "1000 at 50 Hz" in again.stdout
    of_folder = run(odd, *OPTIONS, "--save", odd.with_name("needleforce.toml"), "--no-plot")
    assert shlex.split(of_folder.stdout.strip().splitlines()[-1]) == ["needleforce", "identify", str(odd)]


@pytest.mark.parametrize("part", ["all", "cycle *", "*"])
def test_inspect_shows_the_first_of_all(tmp_path, part):
    """What ``--part`` of the other commands takes is shown, and a command that takes all follows."""
    time, depth, force = (np.tile(each, 4) for each in insertion())
    time = np.arange(len(time)) * 0.02
    np.savetxt(tmp_path / "run.csv", np.column_stack([time, depth, np.abs(force)]), delimiter=",",
               header="time_s,depth_mm,force_N", comments="")  # fmt: skip
    done = CliRunner().invoke(app, ["inspect", str(tmp_path / "run.csv"), "--no-plot", "--part", part])
    assert done.exit_code == 0, done.output
    assert "cycle 4" in done.output


def test_an_indentation_of_every_cycle(tmp_path):
    time, depth, force = (np.tile(each, 4) for each in insertion())
    time = np.arange(len(time)) * 0.02
    np.savetxt(tmp_path / "run.csv", np.column_stack([time, depth, np.abs(force)]), delimiter=",",
               header="time_s,depth_mm,force_N", comments="")  # fmt: skip
    words = ["indentation", str(tmp_path / "run.csv"), "--tip", "flat", "--radius-um", "1000", "--part", "cycle *"]
    done = CliRunner().invoke(app, [*words, "--json", str(tmp_path / "fits.json")])
    assert done.exit_code == 0, done.output
    found = json.loads((tmp_path / "fits.json").read_text())["recordings"]
    assert [each["part"] for each in found] == ["cycle 1", "cycle 2", "cycle 3", "cycle 4"]
