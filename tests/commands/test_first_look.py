# SPDX-License-Identifier: Apache-2.0
"""``needleforce FILE``: a short look, the model and a report; of a folder the command for its recordings."""

import shlex
import shutil
import webbrowser

import pytest
from command_line import run
from typer.testing import CliRunner

from needleforce.cli import app
from needleforce.commands.inspect import terminal_plot


@pytest.fixture
def folder(root, tmp_path):
    """An empty folder with a folder of one recording, whose names have a space."""
    (tmp_path / "my runs").mkdir()
    shutil.copy(root / "examples" / "insertion.csv", tmp_path / "my runs" / "gel 1.csv")
    return tmp_path


def test_a_file_alone_is_looked_at_identified_and_reported(folder):
    done = run("my runs/gel 1.csv", "--needle", "paper", cwd=folder)
    assert done.returncode == 0, done.stderr
    for part in ("1592 at 100 Hz", "depth [mm]", "C", "P", "puncture_force", "reduced_modulus"):
        assert part in done.stdout, part
    assert done.stderr.splitlines()[-1] == "report: gel 1_report.html"
    assert (folder / "gel 1_report.html").read_text(encoding="utf-8").startswith("<!DOCTYPE html>")


def test_a_report_that_is_there_is_kept(folder):
    (folder / "gel 1_report.html").write_text("mine")
    done = run("my runs/gel 1.csv", cwd=folder)
    assert "report: gel 1_report_2.html" in done.stderr and (folder / "gel 1_report.html").read_text() == "mine"
    again = run("my runs/gel 1.csv", cwd=folder)
    assert "gel 1_report_3.html: removed, as gel 1_report_2.html is the same" in again.stderr
    assert sorted(each.name for each in folder.glob("*.html")) == ["gel 1_report.html", "gel 1_report_2.html"]


def test_a_folder_has_the_command_of_its_campaign(folder):
    done = run("my runs", cwd=folder)
    assert done.returncode == 0 and "recordings: 1" in done.stdout
    command = shlex.split(done.stdout.splitlines()[-1])
    assert command[:3] == ["needleforce", "campaign", "my runs"]
    again = run(*command[1:-1], cwd=folder)  # without --open
    assert again.returncode == 0 and (folder / "my runs.html").exists() and (folder / "my runs.csv").exists()


def test_a_file_named_as_a_command_is_reached_by_its_folder(folder):
    shutil.copy(folder / "my runs" / "gel 1.csv", folder / "laws")
    assert "Coulomb" in run("laws", cwd=folder).stdout
    assert "1592 at 100 Hz" in run("./laws", cwd=folder).stdout


@pytest.mark.parametrize(
    "name, text, message", [("none.csv", None, "missing"), ("bare.txt", "1,2\n3,4\n5,6\n", "no column holds")]
)
def test_a_file_that_is_not_read_has_no_report(tmp_path, name, text, message):
    if text:
        (tmp_path / name).write_text(text)
    done = run(name, cwd=tmp_path)
    assert done.returncode == 1 and message in done.stderr and not list(tmp_path.glob("*.html"))


def test_what_is_neither_a_command_nor_a_file_is_wrong_usage(tmp_path):
    (tmp_path / "gels").mkdir()
    for wrong, right in (("identifi", "identify"), ("gel", "gels")):
        done = run(wrong, cwd=tmp_path)
        assert done.returncode == 2 and f"Did you mean '{right}'" in done.stderr


@pytest.mark.parametrize("opens", [True, False])
def test_a_report_is_opened_in_the_browser(folder, monkeypatch, opens):
    opened = []
    monkeypatch.setattr(webbrowser, "open", lambda address: opened.append(address) or opens)
    monkeypatch.chdir(folder)
    done = CliRunner().invoke(app, ["identify", "my runs/gel 1.csv", "--report", "out.html", "--open"])
    assert done.exit_code == 0 and opened == [(folder / "out.html").as_uri()]
    assert ("no browser was found" in done.stderr) is not opens


def test_open_needs_a_report(folder):
    done = run("identify", "my runs/gel 1.csv", "--open", cwd=folder)
    assert done.returncode == 2 and "Add --report report.html" in done.stderr


@pytest.mark.parametrize("encoding, columns, dot", [("utf-8", "80", "⣀"), ("ascii", "80", "."), ("ascii", "40", ".")])
def test_the_plot_is_what_the_terminal_can_show(monkeypatch, encoding, columns, dot):
    """A rise along the axis: one dot a column, from the lowest to the highest row."""
    import numpy as np

    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", columns)
    monkeypatch.setattr("sys.stdout", type("Terminal", (), {"encoding": encoding})())
    x = np.linspace(0.0, 1.0, 400)
    lines = terminal_plot(x, np.where(x < 0.5, 0.0, 1.0), "depth [mm]", "force [N]", [(1.0, 1.0, "P")]).splitlines()
    assert dot in lines[-2] and lines[1].rstrip().endswith("P")
    assert max(map(len, lines)) <= int(columns) and "".join(lines).isascii() == (encoding == "ascii")
