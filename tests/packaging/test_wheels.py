# SPDX-License-Identifier: Apache-2.0
"""What is published is whole: a wheel has each file of the package and the terms of what is compiled into it, the
source distribution has the tests."""

import re
import runpy
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from importlib import metadata
from pathlib import Path

import nanobind
import pytest
from building import said

BACKEND = "import sys, scikit_build_core.build as build; getattr(build, sys.argv[1])(sys.argv[2], eval(sys.argv[3]))"


@pytest.fixture(scope="module")
def trial(root):
    sys.path.insert(0, str(root / "tools"))
    return runpy.run_path(str(root / "tools" / "try_wheel.py"))


@pytest.fixture(scope="module")
def wheel(root, tmp_path_factory):
    """A wheel of everything that is not compiled."""
    folder = tmp_path_factory.mktemp("wheel")
    said([sys.executable, "-c", BACKEND, "build_wheel", folder, {"wheel.cmake": "false", "wheel.py-api": ""}], cwd=root)
    return next(folder.glob("*.whl"))


def test_a_wheel_has_every_file_and_licence_of_the_tree(trial, wheel):
    core = [f"needleforce/core/{name}.pyi is not inside" for name in ("__init__", "laws", "tips")]
    assert trial["contents_faults"](wheel) == [*core, "0 compiled modules instead of one"]


def test_what_a_wheel_lacks_or_has_too_much_is_named(trial, wheel, tmp_path):
    other = tmp_path / wheel.name
    with zipfile.ZipFile(wheel) as old, zipfile.ZipFile(other, "w") as new:
        for each in old.namelist():
            if not each.endswith(("py.typed", "mappings/zwick.toml", "licenses/LICENSE")):
                new.writestr(each, old.read(each))
        new.writestr("needleforce/notes.txt", "")
    faults = trial["contents_faults"](other)
    assert "needleforce/py.typed is not inside" in faults
    assert "needleforce/recording/mappings/zwick.toml is not inside" in faults
    assert "needleforce/notes.txt does not belong inside" in faults
    assert "the licence LICENSE is not inside" in faults


def test_the_licences_are_those_of_what_is_compiled(root):
    nanobinds = next(each for each in metadata.files("nanobind") if each.name == "LICENSE").read_text()
    assert (root / "licenses" / "nanobind.txt").read_text(encoding="utf-8").split() == nanobinds.split()
    header = Path(nanobind.__file__).parent / "ext" / "robin_map" / "include" / "tsl" / "robin_map.h"
    stated = re.sub(r"^ \*", "", header.read_text(encoding="utf-8").split("*/")[0].removeprefix("/**"), flags=re.M)
    assert (root / "licenses" / "robin-map.txt").read_text(encoding="utf-8").split() == stated.split()


def test_the_source_distribution_has_every_file_of_the_tree(root, tmp_path):
    listed = subprocess.run(["git", "ls-files"], cwd=root, capture_output=True, text=True)
    if listed.returncode:
        pytest.skip("not a checkout of git: this is the source distribution")
    said([sys.executable, "-c", BACKEND, "build_sdist", tmp_path, {}], cwd=root)
    with tarfile.open(next(tmp_path.glob("*.tar.gz"))) as archive:
        inside = {name.split("/", 1)[1] for name in archive.getnames()}
    assert [each for each in listed.stdout.split("\n") if each and each not in inside] == []


def test_the_conda_recipe_needs_what_the_wheel_needs(root):
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    recipe = (root / "conda" / "recipe.yaml").read_text(encoding="utf-8")
    run = re.findall(r"^    - (\S+) (>=\S+)$", recipe.split("  run:\n")[1].split("\ntests:")[0], re.M)
    needed = [re.fullmatch(r"([\w-]+)(>=.+)", each).groups() for each in project["dependencies"]]
    named = {"matplotlib": "matplotlib-base"}  # without windows
    wanted = [("python", project["requires-python"]), *((named.get(name, name), at) for name, at in needed)]
    assert run == wanted and f"license: {project['license']}\n" in recipe


def test_a_wheel_is_for_the_python_it_names(trial):
    named = {"needleforce-1-cp311-cp311-linux_x86_64.whl": {11}, "needleforce-1-cp312-abi3-win_amd64.whl": {12, 13, 14}}
    for name, minors in named.items():
        assert {minor for minor in range(10, 15) if trial["is_for"](Path(name), minor)} == minors
