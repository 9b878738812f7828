# SPDX-License-Identifier: Apache-2.0
"""A computer that cannot compile the Python module is shown what it lacks, and where to get it."""

import re
import shutil
import subprocess
import sys
from importlib.metadata import distributions
from types import SimpleNamespace

import pytest
from building import TOOLS
from packaging.specifiers import SpecifierSet
from scikit_build_core import build

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


@pytest.mark.parametrize(
    ("of_skbuild", "there", "message"),
    [
        ("platform.machine", lambda: "i686", "needs a system and a Python of 64 bits: SciPy and pandas are not"),
        ("sys", SimpleNamespace(version_info=(3, 10, 13), platform="linux"), "needs Python 3.11 or newer. Install one"),
    ],
)
def test_pip_is_refused_before_it_looks_for_packages(of_skbuild, there, message, root, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(root)
    monkeypatch.setattr(f"scikit_build_core.settings.skbuild_overrides.{of_skbuild}", there)
    with pytest.raises(SystemExit):
        build.prepare_metadata_for_build_wheel(str(tmp_path))
    assert re.search(f"^needleforce {message}", capsys.readouterr().out, re.M)


@pytest.mark.parametrize(
    ("said", "last"),
    [
        ("ERROR: Could not install packages: OSError: [Errno 28] No space left on device", "The disk"),
        ("fatal error: closing dependency file a.o.d: No space left on device", "The disk is full: make room."),
        ("after connection broken by 'NewConnectionError('<pip._vendor", "The network does not answer: look at it"),
        ("error: expected ';' before '}' token", "a job: failed after "),
    ],
)
def test_a_full_disk_and_a_lost_network_are_the_last_line(said, last, root):
    fails = [sys.executable, "-c", f"import sys; print({said!r}); print('more words'); sys.exit(3)"]
    watched = [sys.executable, root / "tools" / "progress.py", "a job", "--", *fails]
    done = subprocess.run(watched, capture_output=True, text=True)
    assert done.returncode == 3 and said in done.stdout
    assert done.stdout.splitlines()[-1].startswith(last)


def test_what_is_pinned_runs_on_every_python_that_is_promised(root):
    pinned = set(re.findall("^(.+)==", (root / "constraints.txt").read_text(encoding="utf-8"), re.M))
    needs = {each.name: each.metadata.get("Requires-Python") or "" for each in distributions() if each.name in pinned}
    assert len(needs) > 20
    assert [name for name, versions in needs.items() if not SpecifierSet(versions).contains("3.11.0")] == []
