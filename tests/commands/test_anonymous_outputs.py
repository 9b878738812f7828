# SPDX-License-Identifier: Apache-2.0
"""``--anonymous``: no output holds a name of a file or folder, a text of its card, a time or a host."""

import re
import socket
from pathlib import Path

import pytest
from typer.testing import CliRunner

from needleforce.cli import app

CARD = """# needle: of Jane Doe, at 192.168.1.7
# tissue: liver, 2026-03-04T10:20:30
# rig: http://lab7.example:80
# note: glitch 1 of jane_doe_1.csv at 2026-03-04 10:20:30, from lab7.example.org and 192.168.1.7:80"""
TIME = re.compile(r"\d{4}-\d\d-\d\dT|\d\d:\d\d:\d\d|<dc:date>")


@pytest.mark.parametrize("command", ["identify", "compare"])
def test_no_output_holds_names_times_or_hosts(root, tmp_path, command):
    folder = tmp_path / "home of jane" / "2026-03-04"
    folder.mkdir(parents=True)
    rows = [line for line in (root / "examples" / "insertion.csv").read_text().split("\n") if not line.startswith("#")]
    (folder / "jane_doe_1.csv").write_text(f"{CARD}\n" + "\n".join(rows))
    (folder / "jane_doe_2.csv").write_text("time,force\nJane,Doe\n")
    out = {name: tmp_path / f"out{ending}" for name, ending in (("--report", ".html"), ("--json", ".json"))}
    if command == "identify":
        out |= {name: tmp_path / f"o{ending}" for name, ending in (("--csv", ".csv"), ("--save", ".toml"))}
        out["--draws"] = tmp_path / "draws.csv"
    models = {"identify": ["--model", "cone_cylinder"], "compare": ["--models", "cone_cylinder"]}[command]
    more = ["--needle", str(root / "src/needleforce/presets/paper.toml"), *models]
    for name, path in out.items():
        more += [name, str(path)]
    files = [str(path) for path in sorted(folder.iterdir())]
    named = CliRunner().invoke(app, [command, *files, *more])
    assert "jane" in out["--report"].read_text() + named.output
    done = CliRunner().invoke(app, [command, *files, *more, "--anonymous"])
    assert done.exit_code == named.exit_code == 0, done.output
    for path in out.values():
        text = path.read_text(encoding="utf-8")
        for word in ("jane", "doe", "lab7", "192.168", "liver", str(Path.home()), socket.gethostname()):
            assert word.casefold() not in text.casefold(), (path.name, word)
        assert not TIME.search(text), path.name
    assert "recording 1" in out["--report"].read_text() and "jane" not in done.output.replace(str(tmp_path), "").lower()
