# SPDX-License-Identifier: Apache-2.0
"""A computer that cannot compile the Python module is shown what it lacks, and where to get it."""

import re
import shutil
import subprocess
import sys

import pytest
from building import TOOLS

COMPILER = f"-DCMAKE_CXX_COMPILER={shutil.which('g++')}"
LACKS = {  # -> arguments of CMake, and what is said
    "compiler": ([], r"needs a C\+\+20 compiler, and none was found: install"),
    "headers": ([COMPILER, "-DPython_INCLUDE_DIR=/nowhere"], "with its headers, found .* Install them"),
    "64 bits": (
        [COMPILER, "-DCMAKE_CXX_FLAGS=-m32", "-DCMAKE_TRY_COMPILE_TARGET_TYPE=STATIC_LIBRARY"],
        "needs a Python of 64 bits: SciPy and pandas are not published for 32",
    ),
}


@pytest.mark.parametrize("lacking", LACKS)
def test_what_is_missing_to_compile_is_named(lacking, root, tmp_path):
    given, message = LACKS[lacking]
    ninja = ["-G", "Ninja", f"-DCMAKE_MAKE_PROGRAM={TOOLS / 'ninja'}", f"-DPython_EXECUTABLE={sys.executable}"]
    command = [TOOLS / "cmake", "-S", root, "-B", tmp_path / "build", "-DNEEDLEFORCE_PYTHON=ON", *ninja, *given]
    found = "/usr/bin:/bin" if given else str(tmp_path)  # g++ finds its assembler there
    done = subprocess.run(list(map(str, command)), env={"PATH": found}, capture_output=True, text=True)
    assert done.returncode == 1
    said = " ".join(done.stderr.split())
    assert said.count("CMake Error") == 1
    assert re.search(message, said), said
