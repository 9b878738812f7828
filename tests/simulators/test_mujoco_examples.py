# SPDX-License-Identifier: Apache-2.0
"""The examples run and say what the closed forms say, and the benchmark runs."""

import importlib.util
import re
import subprocess
import sys

import pytest

FRICTION, CUTTING = 18.6, 0.0776  # the paper's


def said_by(root, folder, name):
    pytest.importorskip("mujoco", reason="the extra mujoco is not installed")
    command = [sys.executable, root / "examples" / f"{name}.py"]
    environment = {"MPLBACKEND": "Agg", "PATH": "/usr/bin:/bin"}
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    return [float(number) for number in re.findall(r"-?\d+\.\d+", done.stdout)]


def test_the_needle_on_a_slide(root, tmp_path):
    push, pull, held, rms = said_by(root, tmp_path, "mujoco_slide")
    # 20 mm deep but for the servo's sag; friction alone on the way out
    assert push == pytest.approx(FRICTION * 20e-3 + CUTTING, abs=0.002)
    assert pull == pytest.approx(FRICTION * 20e-3, abs=0.002)
    assert held == pytest.approx(push, abs=0.002) and rms < 1.0  # mN
    assert 5_000 < (tmp_path / "mujoco_slide.svg").stat().st_size < 60_000


def test_the_needle_on_an_arm(root, tmp_path):
    force, depth, shoulder, elbow, wrist = said_by(root, tmp_path, "mujoco_arm")
    assert force == pytest.approx(FRICTION * 1e-3 * depth + CUTTING, abs=1e-3)
    assert shoulder == pytest.approx(-250.0 * force, rel=0.01)  # mN m; the tip stands 0.25 m from the shoulder
    assert abs(wrist) < 1.0 < abs(elbow)  # upright below the wrist


def test_the_arm_stops_after_the_second_layer(root, tmp_path):
    first, second, past = said_by(root, tmp_path, "mujoco_two_layers")
    # 3 mm into the first layer, 2.5 mm into that at 8 mm; a cycle of 5 um, and the median of three readings
    assert (first, second) == pytest.approx((3.0, 10.5), abs=0.03)
    assert 0.0 < past < 0.1


def test_the_benchmark_measures_both(mujoco, root):
    spec = importlib.util.spec_from_file_location("mujoco_step", root / "benchmarks" / "mujoco_step.py")
    benchmark = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(benchmark)
    costs = benchmark.measure(rounds=3)
    assert costs["plugin_us"] > costs["bare_us"] > 0.0  # the tissue costs something: it is in the one scene alone
