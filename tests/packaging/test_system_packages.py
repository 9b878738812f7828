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


def run(root, folder, what, user, python=sys.executable, **programs) -> subprocess.CompletedProcess:
    """The script where there are only a few programs, for a user of this number."""
    for name in ("bash", "sort", "xargs", "echo", "sleep"):
        (folder / name).symlink_to(shutil.which(name))
    for name, line in {"id": f"echo {user}", "uname": "echo Linux", **programs}.items():
        (folder / name).write_text(f"#!{folder}/bash\n{line}\n", encoding="utf-8")
        (folder / name).chmod(0o755)
    command = [folder / "bash", root / "tools" / "system_packages.sh", what]
    return subprocess.run(command, env={"PATH": str(folder), "PYTHON": str(python)}, capture_output=True, text=True)


def named(root, folder, system, what) -> str:
    """What the script names to somebody who may not install."""
    programs = {"uname": "echo Darwin"} if system == "brew" else {system: "exit 0"}
    done = run(root, folder, what, 1000, **programs)
    assert done.returncode == 1 and done.stdout == "" and done.stderr.count("\n") == 1, done.stderr
    return done.stderr.strip()


@pytest.mark.parametrize("system", SYSTEMS)
def test_what_is_missing_is_named_as_the_system_names_it(system, root, tmp_path):
    assert named(root, tmp_path, system, "tests") == f"needleforce needs these system packages first: {SYSTEMS[system]}"


ALONE = {
    ("browser", "apt-get"): "sudo apt-get install chromium",
    ("browser", "brew"): "brew install --cask chromium",
    ("hosts", "apt-get"): "sudo apt-get install mono-mcs octave-dev",
    ("hosts", "dnf"): "sudo dnf install mono-devel octave-devel",
    ("hosts", "brew"): "brew install mono octave",
}


@pytest.mark.parametrize("what, system", ALONE)
def test_the_browser_and_the_hosts_are_named_alone(what, system, root, tmp_path):
    expected = f"needleforce needs these system packages first: {ALONE[what, system]}"
    assert named(root, tmp_path, system, what) == expected


def test_somebody_who_may_install_gets_the_browser_and_nothing_more(root, tmp_path):
    done = run(root, tmp_path, "browser", 0, **{"apt-get": f'echo "$@" >> {tmp_path}/calls'})
    assert done.returncode == 0, done.stderr
    _update, install = (tmp_path / "calls").read_text().splitlines()
    assert install.split()[0] == "install" and "--no-install-recommends" in install
    assert [word for word in install.split()[1:] if not word.startswith("-")] == ["chromium"]


def test_a_browser_that_is_there_is_taken(root, tmp_path):
    done = run(root, tmp_path, "browser", 0, **{"google-chrome": "exit 0", "apt-get": "exit 1"})
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
