# SPDX-License-Identifier: Apache-2.0
"""Programs outside the tree, as a user writes them: find_package, pkg-config, a subdirectory."""

import os
import re
import shutil
import sys

import nanobind
import pytest
from building import TOOLS, built, said

from needleforce.export import header, model_source

# the paper's 18.6 N/m over 8 mm of shaft, and 0.0776 N at the tip; the puncture at the first step beyond 3.237 mm
SAID = "puncture at 3.238 mm\nforce at 8.0 mm: 0.2264 N\n"


@pytest.fixture
def outside(root, tmp_path):
    return shutil.copytree(root / "examples" / "outside", tmp_path / "outside")


@pytest.mark.parametrize("language", ["cpp", "c"])
def test_an_installed_package_is_found_where_it_was_moved(prefix, outside, language):
    build = built(outside / language, outside / "build", f"-DCMAKE_PREFIX_PATH={prefix}")
    assert said([build / "controller"]) == SAID


def test_the_compiled_form_takes_one_line(prefix, outside):
    lists = outside / "cpp" / "CMakeLists.txt"
    lists.write_text(lists.read_text().replace("needleforce::needleforce", "needleforce::compiled"))
    build = built(outside / "cpp", outside / "build", f"-DCMAKE_PREFIX_PATH={prefix}")
    assert said([build / "controller"]) == SAID
    made = said(["nm", "-C", *build.rglob("*.o")])
    # compiled by the library alone: the step of all laws
    assert re.search(r" U needleforce::BasicPreparedInsertion<double>::in_general", made)


def test_pkg_config_gives_the_flags(prefix, outside):
    if not (tool := shutil.which("pkg-config")):
        pytest.skip("no pkg-config: apt-get install pkg-config")
    search = os.environ | {"PKG_CONFIG_PATH": str(prefix / "lib/pkgconfig")}
    flags = said([tool, "--cflags", "--libs", "needleforce-c"], env=search).split()
    said(["gcc", "main.c", *flags, "-o", "controller"], cwd=outside / "c")
    assert said([outside / "c" / "controller"]) == SAID
    guarded = '#include "needleforce_guard.h"\nint main(void) { return nf_guard_size() == 0; }\n'
    said(["gcc", "-x", "c", "-", *flags, "-o", outside / "guarded"], input=guarded)
    said([outside / "guarded"])
    flags = said([tool, "--cflags", "--libs", "needleforce"], env=search).split()
    said(["g++", "-std=c++20", "-fsyntax-only", *flags, "main.cpp"], cwd=outside / "cpp")


@pytest.mark.long
def test_a_subdirectory_gives_the_same_targets_and_installs_nothing(root, outside, tmp_path):
    """With the C library as a shared one, and neither tests nor Python."""
    lists = outside / "c" / "CMakeLists.txt"
    text = lists.read_text().replace("find_package(needleforce 0.2 REQUIRED)", f"add_subdirectory({root} needleforce)")
    lists.write_text(text + "get_target_property(found needleforce::needleforce INTERFACE_COMPILE_FEATURES)\n")
    build = built(outside / "c", tmp_path / "build", "-DBUILD_SHARED_LIBS=ON", "-DCMAKE_BUILD_TYPE=Debug")
    assert said([build / "controller"]) == SAID
    assert list((build / "needleforce").glob("libneedleforce.so.*"))
    assert not list(build.rglob("*tests*")) and not list(build.rglob("core*.so"))
    said([TOOLS / "cmake", "--install", build, "--prefix", tmp_path / "prefix"])
    assert not (tmp_path / "prefix").exists()


def test_another_minor_version_is_not_taken(prefix, outside):
    lists = outside / "c" / "CMakeLists.txt"
    lists.write_text(lists.read_text().replace("needleforce 0.2", "needleforce 0.1"))
    with pytest.raises(AssertionError, match="compatible with requested version"):
        built(outside / "c", outside / "build", f"-DCMAKE_PREFIX_PATH={prefix}")


@pytest.mark.parametrize("path, language", [("cpp/gel.hpp", "c++"), ("c/gel.h", "c")])
def test_their_headers_are_what_export_writes(root, path, language):
    """After a change: needleforce export paper --name gel --language … -o examples/outside/…"""
    assert (root / "examples" / "outside" / path).read_text() == header(model_source("paper").model, language, "gel")


def test_a_wheel_has_none_of_this(root, tmp_path):
    """What CMake installs for Python goes into the wheel: the module and its stubs."""
    places = [f"-Dnanobind_DIR={nanobind.cmake_dir()}", f"-DPython_EXECUTABLE={sys.executable}"]
    ninja = ["-G", "Ninja", f"-DCMAKE_MAKE_PROGRAM={TOOLS / 'ninja'}"]
    said([TOOLS / "cmake", "-S", root, "-B", tmp_path, *ninja, "-DNEEDLEFORCE_PYTHON=ON", *places])
    steps = (tmp_path / "cmake_install.cmake").read_text()
    assert set(re.findall(r'INSTALL DESTINATION "\$\{CMAKE_INSTALL_PREFIX\}/?([^"]*)"', steps)) == {"needleforce"}
