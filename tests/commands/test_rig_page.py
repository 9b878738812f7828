"""The recording with the virtual rig as its page shows it, on free ports."""

import re
import shlex

from simulated_time import SimulatedTime
from typer.testing import CliRunner

from needleforce.cli import app
from needleforce.rig.live import VirtualRig


def output_of(line: str) -> str:
    program, *arguments = shlex.split(line, comments=True)
    done = CliRunner().invoke(app, arguments)
    assert program == "needleforce" and done.exit_code == 0, done.output
    return done.output


def test_the_page_records_an_insertion_and_identifies_it(root, tmp_path, monkeypatch):
    page = (root / "docs" / "howto" / "try_a_rig.md").read_text(encoding="utf-8").replace("\\\n", "")
    block = next(text for text in re.findall(r"```sh\n(.*?)```", page, re.S) if "needleforce rig" in text)
    rig, record, identify = block.splitlines()
    assert shlex.split(rig, comments=True) == ["needleforce", "rig"]  # test_rig_command runs it as a program
    monkeypatch.chdir(tmp_path)
    with SimulatedTime(), VirtualRig() as real:
        for shown, port in (("--sensor 127.0.0.1", real.sensor_port), ("--axis 127.0.0.1", real.axis_port)):
            assert shown in record
            record = record.replace(shown, f"{shown}:{port}")
        assert "http://127.0.0.1:49154/" in record
        record = record.replace("http://127.0.0.1:49154/", f"http://127.0.0.1:{real.page_port}/")
        assert "insertion.mcap: done" in output_of(record)
    assert "puncture_force" in output_of(identify)
