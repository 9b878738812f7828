# SPDX-License-Identifier: Apache-2.0
"""Which Pythons this computer has: those that PYTHONS names, else of the search path and of pyenv."""

import os
import shutil
import subprocess
from pathlib import Path

ASKED = "import sys, sysconfig; print(sys.version_info[1], sys.executable, sysconfig.get_path('include'), sep='\\n')"


def pythons() -> dict[int, Path]:
    """The first Python 3 of each minor version that starts and has its headers, the oldest first."""
    named = [Path(each) for each in os.environ.get("PYTHONS", "").split()]
    on_path = [found for minor in range(10, 20) if (found := shutil.which(f"python3.{minor}"))]
    of_pyenv = sorted(Path.home().glob(".pyenv/versions/3.*/bin/python3"))
    found: dict[int, Path] = {}
    for path in named or [*map(Path, on_path), *of_pyenv]:  # a name may start another program that chooses
        done = subprocess.run([path, "-c", ASKED], capture_output=True, text=True)
        if done.returncode == 0:
            minor, itself, headers = done.stdout.splitlines()
            if (Path(headers) / "Python.h").exists():
                found.setdefault(int(minor), Path(itself))
    return dict(sorted(found.items()))
