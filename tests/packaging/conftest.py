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


@pytest.fixture(scope="session")
def shared_library(root, tmp_path_factory):
    """The C library as the hosts load it, of all faces."""
    build = built(root, tmp_path_factory.mktemp("shared"), "-DBUILD_SHARED_LIBS=ON", "-DCMAKE_BUILD_TYPE=Debug")
    return build / "libneedleforce.so"
