# SPDX-License-Identifier: Apache-2.0
"""Benchmarks on real recordings start without the packages of the tests, and say what is missing."""

import os
import subprocess
import sys

import pytest


@pytest.mark.parametrize("name", ["cross_validation", "replay", "loading_curves", "events_by_eye"])
def test_without_recordings_a_benchmark_says_so(root, tmp_path, name):
    environment = os.environ | {"NEEDLEFORCE_RECORDINGS": str(tmp_path)}
    script = root / "benchmarks" / f"{name}.py"
    done = subprocess.run([sys.executable, script], env=environment, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "no" in done.stdout and str(tmp_path) in done.stdout
