# SPDX-License-Identifier: Apache-2.0
"""What is missing on a computer is named in one line, as its system names it."""

import shutil
import subprocess
import sys

import pytest

SYSTEMS = {  # what a system has -> the line without a compiler, headers of GoogleTest and pkg-config
    "apt-get": "sudo apt-get install g++ libgtest-dev pkg-config",
    "dnf": "sudo dnf install gcc-c++ gtest-devel pkgconf-pkg-config",
    "zypper": "sudo zypper install gcc-c++ gtest-devel pkgconf-pkg-config",
    "pacman": "sudo pacman -S --needed gcc gtest pkgconf",
    "brew": "xcode-select --install; brew install googletest pkgconf",
    "nothing": "what Debian calls g++ libgtest-dev pkg-config",
}


def said(root, folder, system, python=sys.executable) -> str:
    """What the script says where there is no compiler, to somebody who may not install."""
    for name in ("bash", "sort", "xargs", "echo"):
        (folder / name).symlink_to(shutil.which(name))
    programs = {"id": "echo 1000", "uname": f"echo {'Darwin' if system == 'brew' else 'Linux'}", system: "exit 0"}
    for name, line in programs.items():
        (folder / name).write_text(f"#!{folder}/bash\n{line}\n", encoding="utf-8")
        (folder / name).chmod(0o755)
    command = [folder / "bash", root / "tools" / "system_packages.sh", "tests"]
    done = subprocess.run(command, env={"PATH": str(folder), "PYTHON": str(python)}, capture_output=True, text=True)
    assert done.returncode == 1 and done.stdout == "" and done.stderr.count("\n") == 1, done.stderr
    return done.stderr.strip()


@pytest.mark.parametrize("system", SYSTEMS)
def test_what_is_missing_is_named_as_the_system_names_it(system, root, tmp_path):
    assert said(root, tmp_path, system) == f"needleforce needs these system packages first: {SYSTEMS[system]}"
