# SPDX-License-Identifier: Apache-2.0
import fcntl
import os

import pytest
from building import TOOLS, built, said


@pytest.fixture(scope="session")
def prefix(root, tmp_path_factory):
    """Where `cmake --install` put the package; moved afterwards, as a package may be. Built once for all processes."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "package"
    folder.mkdir(exist_ok=True)
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (folder / "moved").exists():
            build = built(root, folder / "build", "-DCMAKE_INSTALL_LIBDIR=lib", "-DCMAKE_BUILD_TYPE=Debug")
            said([TOOLS / "cmake", "--install", build, "--prefix", folder / "first"])
            (folder / "first").rename(folder / "moved")
    return folder / "moved"
