"""The README's recording with the virtual rig, on free ports."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

TOOLS = Path(sys.executable).parent
READY = r"ready: sensor (\S+), axis (\S+), page (\S+)"


def output_of(line: str, folder: Path) -> str:
    path = {"PATH": f"{TOOLS}{os.pathsep}/usr/bin{os.pathsep}/bin"}
    command = shlex.split(line, comments=True)
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, env=path, timeout=1000)
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


def test_the_readme_records_an_insertion_and_identifies_it(root, tmp_path):
    readme = (root / "README.md").read_text(encoding="utf-8").replace("\\\n", "")
    block = next(text for text in re.findall(r"```sh\n(.*?)```", readme, re.S) if "needleforce rig" in text)
    rig, record, identify = block.splitlines()
    free = ["--sensor-port", "0", "--axis-port", "0", "--page-port", "0"]
    assert shlex.split(rig, comments=True) == ["needleforce", "rig"]
    with subprocess.Popen([TOOLS / "needleforce", "rig", *free], stdout=subprocess.PIPE, text=True) as process:
        try:
            sensor, axis, page = re.match(READY, process.stdout.readline()).groups()
            for shown, real in (("--sensor 127.0.0.1", f"--sensor {sensor}"), ("--axis 127.0.0.1", f"--axis {axis}"),
                                ("http://127.0.0.1:49154/netftapi2.xml", page)):  # fmt: skip
                assert shown in record
                record = record.replace(shown, real)
            assert "insertion.mcap: done" in output_of(record, tmp_path)
        finally:
            process.terminate()
    for name in re.findall(r"src/\S+", identify):
        identify = identify.replace(name, str(root / name))
    assert "puncture_force" in output_of(identify, tmp_path)
