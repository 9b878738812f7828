# SPDX-License-Identifier: Apache-2.0
"""Runs the tools that build: their words on an error are the test's."""

import subprocess
import sys
from pathlib import Path

TOOLS = Path(sys.executable).parent


def said(command, **options) -> str:
    """What a command prints; what it complains about where it fails."""
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, **options)
    assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    return done.stdout


def built(source, build, *options):
    """Configures a folder with CMake and builds it, as fast as compilers can; the build folder."""
    ninja = ["-G", "Ninja", f"-DCMAKE_MAKE_PROGRAM={TOOLS / 'ninja'}", "-DCMAKE_UNITY_BUILD=ON"]
    ninja += ["-DCMAKE_CXX_FLAGS_DEBUG=-O0"]
    said([TOOLS / "cmake", "-S", source, "-B", build, *ninja, *options])
    said([TOOLS / "cmake", "--build", build])
    return build
