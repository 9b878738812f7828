# SPDX-License-Identifier: Apache-2.0
import os
import shutil
import subprocess
import sys

import pytest


@pytest.fixture(scope="session")
def mujoco(root, tmp_path_factory):
    """The package with the plugin built by its own script, and loaded."""
    module = pytest.importorskip("mujoco", reason="the extra mujoco is not installed")
    if not shutil.which("g++"):
        pytest.skip("no g++ to build the plugin with")
    folder = tmp_path_factory.mktemp("plugin")
    script = root / "integrations" / "mujoco" / "build.sh"
    built = subprocess.run(
        [script, folder], env={**os.environ, "PYTHON": sys.executable}, capture_output=True, text=True
    )
    assert built.returncode == 0, built.stderr
    assert built.stderr == ""  # warnings of the compiler
    module.mj_loadPluginLibrary(built.stdout.strip())
    return module
