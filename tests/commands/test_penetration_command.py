# SPDX-License-Identifier: Apache-2.0
"""``needleforce penetration`` on files with known peaks, and on wrong usage."""

import csv
import json

import numpy as np
import pytest
from typer.testing import CliRunner

from needleforce.cli import app

ENTRY, HEEL, DRAG = 0.8, 1.2, 0.3  # [N]


def run(*arguments):
    return CliRunner().invoke(app, [str(each) for each in arguments])


def write(path, seed):
    """Free travel of 1 mm, entry at 2 mm, heel at 4 mm, drag from 5 mm on; 1 mm/s."""
    z = np.arange(0.0, 12.0, 0.01)
    force = np.interp(z, [0, 1, 2, 2.02, 4, 5, 12], [0, 0, ENTRY, 0.4, HEEL, DRAG, DRAG])
    force += 4e-3 * np.random.default_rng(seed).standard_normal(len(z))
    lines = ["time [s],depth [mm],force [N]", *(f"{a:.3f},{a:.3f},{b:.5f}" for a, b in zip(z, force))]
    path.write_text("\n".join(lines) + "\n")


@pytest.fixture
def files(tmp_path):
    for k in (1, 2, 3):
        write(tmp_path / f"21G-{k}.csv", k)
    return [tmp_path / f"21G-{k}.csv" for k in (1, 2, 3)]


def test_figures_of_several_files(files, tmp_path):
    outputs = tmp_path / "out.html", tmp_path / "out.csv"
    done = run("penetration", *files, "--json", "-", "--report", outputs[0], "--table", outputs[1])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert [(each["name"], each["group"]) for each in found["needles"]] == [(f"21G-{k}", "21G") for k in (1, 2, 3)]
    for needle in found["needles"]:
        figures = {each["name"]: each for each in needle["figures"]}
        for name, value in (("entry_force", ENTRY), ("heel_force", HEEL), ("max_force", HEEL), ("drag", DRAG)):
            assert figures[name]["value"] == pytest.approx(value, rel=0.03), name
            assert figures[name]["low"] < figures[name]["value"] < figures[name]["high"]
        assert figures["entry_travel"]["value"] == pytest.approx(1e-3, rel=0.1)
        assert len(needle["peaks"]) == 2 and needle["plateau"]["start"] > 3.5e-3
    drag = next(each for each in found["statistics"] if each["figure"] == "drag")
    values = [figure["value"] for each in found["needles"] for figure in each["figures"] if figure["name"] == "drag"]
    assert (drag["group"], drag["n"], drag["unit"]) == ("21G", 3, "N")
    assert drag["mean"] == pytest.approx(np.mean(values)) and drag["sd"] == pytest.approx(np.std(values, ddof=1))
    page = outputs[0].read_text(encoding="utf-8")
    assert "<svg" in page and "21G-2" in page and "Plateau drag" in page and "Conformity to a standard" in page
    with outputs[1].open() as file:
        rows = list(csv.DictReader(file))
    assert [float(row["drag [N]"]) for row in rows] == pytest.approx(values)


def test_tables_on_the_terminal(files):
    done = run("penetration", *files)
    assert done.exit_code == 0
    assert "peak at tip entry" in done.stdout and "statistics over the needles" in done.stdout
    assert "21G-3" in done.stdout and "21G" in done.stdout
    assert "statistics over the needles" not in run("penetration", files[0]).stdout


def test_stated_travels(files):
    done = run("penetration", files[0], "--work-to-mm", 20, "--plateau-mm", "7:9", "--tips", 3, "--json", "-")
    figures = {each["name"]: each for each in json.loads(done.stdout)["needles"][0]["figures"]}
    assert figures["work"]["value"] is None and "before the stated travel" in figures["work"]["reason"]
    assert figures["drag"]["value"] == pytest.approx(DRAG, rel=0.02)
    assert figures["heel_force"]["value"] is None and "3 tips" in figures["heel_force"]["reason"]
    assert "before the stated travel of the work" in done.stderr


def test_a_file_without_a_curve_is_listed(files, tmp_path):
    broken = tmp_path / "21G-4.csv"
    broken.write_text("Broken\n")
    done = run("penetration", *files, broken, "--json", "-")
    assert done.exit_code == 0
    needle = json.loads(done.stdout)["needles"][-1]
    assert needle["name"] == "21G-4" and all(each["value"] is None for each in needle["figures"])
    assert "21G-4.csv" in needle["figures"][0]["reason"]
    alone = run("penetration", broken)
    assert alone.exit_code == 1 and "21G-4.csv" in alone.stderr


def test_files_of_the_same_name_in_two_folders(files, tmp_path):
    (tmp_path / "other").mkdir()
    write(tmp_path / "other" / "21G-1.csv", 5)
    done = run("penetration", files[0], tmp_path / "other" / "21G-1.csv", "--json", "-")
    assert len({each["name"] for each in json.loads(done.stdout)["needles"]}) == 2


@pytest.mark.parametrize(
    "options, message",
    [
        (["--plateau-mm", "7"], "--plateau-mm"),
        (["--plateau-mm", "9:7"], "plateau_travel"),
        (["--work-to-mm", "-1"], "work_to"),
        (["--tips", "0"], "tips"),
        (["--min-fall-n", "-1"], "min_fall"),
        (["--column", "force"], "--column"),
        (["--unit", "force=parsec"], "parsec"),
    ],
)
def test_wrong_usage(files, options, message):
    done = run("penetration", files[0], *options)
    assert done.exit_code != 0 and message in str(done.exception or done.stderr)


def test_an_output_is_not_an_input(files):
    done = run("penetration", *files, "--table", files[0])
    assert done.exit_code != 0 and "is also read" in str(done.exception)
