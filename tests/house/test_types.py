# SPDX-License-Identifier: Apache-2.0
"""A user's scripts pass the type checkers: README's, and one of the usual calls."""

import importlib.util
import subprocess
import sys

import pytest

import needleforce as nf

SCRIPT = """
from pathlib import Path

import numpy as np

import needleforce as nf
from needleforce import Fit, Model, Recording


def force_at(fit: Fit, depth: float) -> float:
    if fit.identified_model is None:
        return float("nan")
    return nf.Insertion(fit.model).step(depth, 3e-3, 1e-3).force


def main(paths: list[Path]) -> dict[str, float]:
    look = nf.read(paths[0], dry_run=True)
    print(look.command, look.problem, [column.header for column in look.columns])
    runs: list[Recording] = [nf.read(path, units={"force": "N"}, columns={"time": 1}) for path in paths]
    every: list[Recording] = nf.read_all(paths[0], part="all")
    fit = nf.identify(every, needle="paper", model="cone_cylinder")
    events = nf.segment(runs[0])
    contact = events.contact.depth if events.contact is not None else 0.0
    best = nf.compare(runs, models=["paper", "maurin"])[0]
    model: Model = nf.preset("paper")
    run = nf.simulate(model, nf.Motion.insert(-5e-3, 3e-3, depth=20e-3, withdraw=False), rate=500.0)
    peak = float(np.max(np.abs(run.force - fit.predict(run))))
    fit.save("mine.toml")
    low, high = fit.parameters["puncture_force"].low, fit.parameters.puncture_force.high
    return {"contact": contact, "bic": best.bic, "peak": peak, "low": low, "high": high, "at": force_at(fit, 1e-3)}
"""
WRONG = """
import needleforce as nf

nf.read("x.csv").depth + nf.read("x.csv", dry_run=True).depth
nf.read("x.csv", uints={})
"""


def checked(module, *arguments):
    """What a type checker prints, and whether it found nothing."""
    done = subprocess.run([sys.executable, "-m", module, *map(str, arguments)], capture_output=True, text=True)
    return done.returncode == 0, done.stdout + done.stderr


@pytest.fixture(scope="module")
def scripts(root, tmp_path_factory):
    """README's script and a user's, which also runs; and one with a mistake in each of two lines."""
    folder = tmp_path_factory.mktemp("types")
    (folder / "user.py").write_text(SCRIPT)
    (folder / "wrong.py").write_text(WRONG)
    return [root / "examples" / "first.py", folder / "user.py"], folder / "wrong.py"


def test_the_script_runs(scripts, root, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    space: dict = {}
    exec(compile(SCRIPT, "user.py", "exec"), space)
    found = space["main"]([root / "examples" / "insertion.csv"])
    assert found["low"] < found["high"] and nf.preset("mine.toml").name


def test_mypy_passes_them(scripts, tmp_path):
    right, wrong = scripts
    passed, said = checked("mypy", "--strict", "--cache-dir", tmp_path, *right, wrong)
    mistakes = [line.split(":")[1] for line in said.splitlines() if ": error:" in line and "wrong.py" in line]
    assert not passed and mistakes == ["4", "5"] and "Found 2 errors in 1 file" in said, said


@pytest.mark.skipif(importlib.util.find_spec("basedpyright") is None, reason="pip install basedpyright: 60 MB, by hand")
def test_pyright_passes_them(scripts):
    right, _ = scripts
    passed, said = checked("basedpyright", "--level", "error", "--pythonpath", sys.executable, *right)
    assert passed, said
