# SPDX-License-Identifier: Apache-2.0
"""``--anonymous``: no output holds a name of a file or folder, a text of its card, a time or a host."""

import re
import socket
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from needleforce.cli import app

CARD = """# needle: of Jane Doe, at 192.168.1.7
# tissue: liver, 2026-03-04T10:20:30
# rig: http://lab7.example:80
# note: glitch 1 of jane_doe_1.csv at 2026-03-04 10:20:30, from lab7.example.org and 192.168.1.7:80"""
TIME = re.compile(r"\d{4}-\d\d-\d\dT|\d\d:\d\d:\d\d|<dc:date>")
PAPER = ("--needle", "{root}/src/needleforce/presets/paper.toml")
RECORDINGS, CONE = ("jane_doe_1.csv", "jane_doe_2.csv"), ("--model", "cone_cylinder")
# command, its files, its options, the endings of its outputs
COMMANDS = {
    "identify": (RECORDINGS, (*PAPER, *CONE), {"--report": "html", "--json": "json", "--csv": "csv", "--save": "toml",
                                               "--draws": "csv"}),
    "compare": (RECORDINGS, (*PAPER, "--models", "cone_cylinder"), {"--report": "html", "--json": "json"}),
    "campaign": (RECORDINGS, (*PAPER, *CONE, "--jobs", "1", "--pattern", "{{surgeon}}_{{patient}}_{{repeat}}"),
                 {"--report": "html", "--json": "json", "--table": "csv"}),
    "indentation": (["curve of jane.csv"], ("--tip", "cone", "--half-angle-deg", "9"), {"--json": "json"}),
    "penetration": (RECORDINGS, (), {"--report": "html", "--json": "json", "--table": "csv"}),
    "tension": (["stress of jane.csv"], ("--law", "neo_hookean"), {"--report": "html", "--json": "json"}),
    "bending": (["bench&jane.csv"], PAPER, {"--json": "json"}),
    "steer identify": (["tips of jane.csv"], (*PAPER, "--model", "linear"),
                       {"--report": "html", "--json": "json", "--save": "toml"}),
    "convert": (RECORDINGS[:1], (), {"-o": "csv"}),
}  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory, root):
    folder = tmp_path_factory.mktemp("data") / "home of jane" / "2026-03-04"
    folder.mkdir(parents=True)
    rows = [line for line in (root / "examples" / "insertion.csv").read_text().split("\n") if not line.startswith("#")]
    (folder / "jane_doe_1.csv").write_text(f"{CARD}\n" + "\n".join(rows))
    (folder / "jane_doe_2.csv").write_text("time,force\nJane,Doe\n")
    depth, chance = np.linspace(-0.1, 0.5, 300), np.random.default_rng(1)
    noisy = 0.4 * np.maximum(depth, 0.0) ** 2 + chance.normal(0.0, 1e-3, len(depth))
    pressed = (f"{0.01 * k:.2f},{each:.4f},{force:.5f}" for k, (each, force) in enumerate(zip(depth, noisy)))
    (folder / "curve of jane.csv").write_text(
        "\n".join([CARD.replace("jane_doe_1", "curve of jane"), "time_s,depth_mm,force_N", *pressed])
    )
    stretch = np.linspace(1.0, 1.3, 40)
    pulled = (f"{each:.4f},{5.0 * (each - each**-2):.5f}" for each in stretch)
    (folder / "stress of jane.csv").write_text("\n".join(["stretch,stress_kPa", *pulled]))
    bent = (f"{0.01 * force:.3f},40,{0.5 * force:.3f}" for force in range(1, 12))
    (folder / "bench&jane.csv").write_text("\n".join(["force_N,position_mm,tip_deflection_mm", *bent]))
    tips = CliRunner().invoke(app, ["steer", "simulate", "-o", str(folder / "tips.csv"), "--insertions", "2",
                                    "--depth-mm", "40"])  # fmt: skip
    assert tips.exit_code == 0
    lines = (folder / "tips.csv").read_text().split("\n")
    (folder / "tips of jane.csv").write_text("\n".join([lines[0], *(f"jane {line}" for line in lines[1:] if line)]))
    return folder


@pytest.mark.parametrize("command", COMMANDS)
def test_no_output_holds_names_times_or_hosts(folder, root, tmp_path, command):
    files, options, outputs = COMMANDS[command]
    out = {name: tmp_path / f"{name.strip('-')}.{ending}" for name, ending in outputs.items()}
    typed = [*command.split(), *(str(folder / name) for name in files), *(each.format(root=root) for each in options)]
    for name, path in out.items():
        typed += [name, str(path)]
    named = CliRunner().invoke(app, typed)
    assert "jane" in "".join(path.read_text() for path in out.values()).lower() + named.output.lower()
    done = CliRunner().invoke(app, [*typed, "--anonymous"])
    assert done.exit_code == named.exit_code == 0, named.output + done.output
    for path in out.values():
        text = path.read_text(encoding="utf-8")
        for word in ("jane", "doe", "lab7", "192.168", "liver", str(Path.home()), socket.gethostname()):
            assert not re.search(rf"\b{re.escape(word)}(\b|_)", text, re.IGNORECASE), (path.name, word)
        assert not TIME.search(text), path.name
    assert "jane" not in done.output.replace(str(tmp_path), "").lower()
    number = {"tension": "file 1", "bending": "file 1", "steer identify": "insertion 1"}.get(command, "recording 1")
    assert number in "".join(path.read_text() for path in out.values())
