# SPDX-License-Identifier: Apache-2.0
import pytest
from building import TOOLS, built, said


@pytest.fixture(scope="session")
def prefix(root, tmp_path_factory):
    """Where `cmake --install` put the package; moved afterwards, as a package may be."""
    folder = tmp_path_factory.mktemp("package")
    build = built(root, folder / "build", "-DCMAKE_INSTALL_LIBDIR=lib", "-DCMAKE_BUILD_TYPE=Debug")
    said([TOOLS / "cmake", "--install", build, "--prefix", folder / "first"])
    return (folder / "first").rename(folder / "moved")
