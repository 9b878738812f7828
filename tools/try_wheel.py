#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tries wheels as a user has them: what is inside, and whether it works in an empty environment outside the repository.

    try_wheel.py WHEEL ...       with every Python here; one that a wheel is not for has to refuse it
    try_wheel.py --this WHEEL    with the Python that runs this and its packages, without the demo and the type checkers

Prints a row for each wheel and Python. What fails is printed whole, and ends the trial.
"""

import argparse
import csv
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import time
import zipfile
from collections.abc import Callable
from pathlib import Path

from pythons import pythons

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "src" / "needleforce"
TOOLS = Path(sys.executable).parent
MAX_BYTES = 6_000_000
STUBS = ("core/__init__.pyi", "core/laws.pyi", "core/tips.pyi")
IDENTIFY = (
    "identify",
    "examples/insertion.csv",
    "--needle",
    "paper.toml",
    "--report",
    "report.html",
    "--json",
    "fit.json",
)


class Failed(Exception):
    """What is wrong with a wheel, in words."""


def contents_faults(wheel: Path) -> list[str]:
    """What a wheel lacks, or has too much, against the tree that it was made from."""
    with zipfile.ZipFile(wheel) as archive:
        inside = {each for each in archive.namelist() if not each.endswith("/")}
    information = {each for each in inside if each.split("/")[0].endswith(".dist-info")}
    modules = {
        each for each in inside if re.fullmatch(r"needleforce/core\.[\w.-]+\.(so|pyd)|needleforce/core\.pyd", each)
    }
    sources = [each.relative_to(PACKAGE).as_posix() for each in PACKAGE.rglob("*") if each.is_file()]
    made = re.compile(r"core\.[\w.-]+$|core/|(.*/)?__pycache__/")
    wanted = {f"needleforce/{each}" for each in (*STUBS, *(each for each in sources if not made.match(each)))}
    if modules:  # CMake puts both there: the module, and what an exported FMU is compiled from
        library = (each for folder in ("include", "bindings/c") for each in (ROOT / folder).rglob("*"))
        paths = (each.relative_to(ROOT).as_posix() for each in library if each.is_file())
        wanted |= {f"needleforce/export/c_library/{each}" for each in paths}
    licences = {each.split("/licenses/")[1] for each in information if "/licenses/" in each}
    texts = {"LICENSE", *(f"licenses/{each.name}" for each in (ROOT / "licenses").iterdir())}
    faults = [f"{each} is not inside" for each in sorted(wanted - inside)]
    faults += [f"{each} does not belong inside" for each in sorted(inside - wanted - information - modules)]
    faults += [f"the licence {each} is not inside" for each in sorted(texts - licences)]
    if len(modules) != 1:
        faults.append(f"{len(modules)} compiled modules instead of one")
    if wheel.stat().st_size > MAX_BYTES:
        faults.append(f"{wheel.stat().st_size / 1e6:.1f} MB, more than {MAX_BYTES / 1e6:g}")
    return faults


class Environment:
    """An empty virtual environment in a folder of its own, with the recording of the README."""

    def __init__(self, python: Path, folder: Path):
        self.folder = folder
        self.bin = folder / "environment" / ("Scripts" if os.name == "nt" else "bin")
        self.python = self.bin / "python"
        self._run(python, "-m", "venv", "--without-pip", folder / "environment", where=None)
        (folder / "examples").mkdir()
        shutil.copy(ROOT / "examples" / "insertion.csv", folder / "examples")
        shutil.copy(PACKAGE / "presets" / "paper.toml", folder)

    def install(self, wheel: Path, lent: Path | None = None) -> None:
        """As ``pip install WHEEL``; without what the wheel needs if that is lent by another environment."""
        quiet = ["--quiet", "--disable-pip-version-check"]
        if lent:
            quiet += ["--no-deps", "--no-compile"]
            own = self._run(self.python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", where={})
            Path(own.strip(), "lent.pth").write_text(f"{lent}\n", encoding="utf-8")
        self._run(
            sys.executable, "-m", "pip", "--python", self.python, "install", *quiet, wheel, where=dict(os.environ)
        )

    def says(self, name: str, *words: object) -> str:
        """What a command of the environment prints, in the folder."""
        return self._run(self.bin / name, *words, where={})

    def checked(self, tool: str, *words: object) -> str:
        """What a type checker outside says of the environment."""
        return self._run(TOOLS / tool, *words, where={"XDG_CACHE_HOME": str(self.folder)})

    def _run(self, *command: object, where: dict[str, str] | None) -> str:
        environment = {"PATH": os.defpath, "HOME": str(self.folder), "PYTHONPATH": ""} | (where or {})
        words = list(map(str, command))
        done = subprocess.run(words, capture_output=True, text=True, cwd=self.folder, env=environment)
        if done.returncode:
            raise Failed(f"{' '.join(words)}\n{done.stdout}{done.stderr}")
        return done.stdout + done.stderr


def example(at: Environment) -> None:
    """The README's: numbers, and a picture."""
    shutil.copy(ROOT / "examples" / "first.py", at.folder)
    if "friction_per_length" not in at.says("python", "first.py") or not (at.folder / "first.svg").exists():
        raise Failed("the README's example gives neither parameters nor a picture")


def identify(at: Environment) -> None:
    """A recording, with the needle of a preset: a report, and a header for a loop."""
    at.says("needleforce", *IDENTIFY)
    at.says("needleforce", "export", "fit.json", "--name", "gel", "-o", "gel.hpp")
    if "</html>" not in (at.folder / "report.html").read_text(encoding="utf-8"):
        raise Failed("the report is not whole")


def inspect(at: Environment) -> None:
    """A workbook of the README's recording."""
    import openpyxl

    book = openpyxl.Workbook()
    with open(at.folder / "examples" / "insertion.csv", encoding="utf-8") as file:
        for row in csv.reader(line for line in file if not line.startswith("#")):
            book.active.append([float(each) if re.fullmatch(r"-?[\d.]+(e-?\d+)?", each) else each for each in row])
    book.save(at.folder / "insertion.xlsx")
    if "force" not in at.says("needleforce", "inspect", "insertion.xlsx"):
        raise Failed("a workbook is not read")


def presets(at: Environment) -> None:
    """Each file of data that the package has."""
    listed = at.says("needleforce", "presets")
    if missing := [each.stem for each in (PACKAGE / "presets").glob("*.toml") if each.stem not in listed]:
        raise Failed(f"presets that are not found: {missing}")


def studio(at: Environment) -> None:
    """The page with the core for WebAssembly, as files."""
    at.says("needleforce", "studio", "--static", "page")
    if missing := {"index.html", "core/needleforce.wasm"} - {
        each.relative_to(at.folder / "page").as_posix() for each in (at.folder / "page").rglob("*")
    }:
        raise Failed(f"the studio lacks {missing}")


def demo(at: Environment) -> None:
    """The paper's experiment."""
    at.says("needleforce", "demo", "--out", "demo")


def types(at: Environment) -> None:
    """The README's example by mypy and pyright."""
    at.checked("mypy", "--strict", "--python-executable", at.python, "--cache-dir", at.folder / "cache", "first.py")
    at.checked("pyright", "--pythonpath", at.python, "first.py")


QUICK: tuple[Callable[[Environment], None], ...] = (example, identify, inspect, presets, studio)


def tried(python: Path, wheel: Path, steps: tuple[Callable[[Environment], None], ...], lent: Path | None = None) -> str:
    """A few words on what works."""
    with tempfile.TemporaryDirectory() as folder:
        at = Environment(python, Path(folder).resolve())
        began = time.monotonic()
        at.install(wheel, lent)
        installed = time.monotonic() - began
        place = at.says("python", "-c", "import needleforce; print(needleforce.__file__)").strip()
        if not Path(place).is_relative_to(at.folder):
            raise Failed(f"{place} is used, not the wheel")
        for step in steps:
            step(at)
        return f"installed in {installed:.0f} s, {', '.join(each.__name__ for each in steps)} work"


def is_for(wheel: Path, minor: int) -> bool:
    """Whether a wheel says that it is for a Python 3 of this minor version."""
    lowest, abi = re.search(r"-cp3(\d+)-(\w+)-", wheel.name).groups()
    return minor >= int(lowest) if abi == "abi3" else minor == int(lowest)


def main() -> None:
    """Tries what the command line names."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--this", action="store_true")
    parser.add_argument("wheels", nargs="+", type=Path)
    options = parser.parse_args()
    for wheel in map(Path.resolve, options.wheels):
        if faults := contents_faults(wheel):
            raise Failed("\n".join((wheel.name, *faults)))
        print(f"{wheel.name}: {wheel.stat().st_size / 1e6:.1f} MB, whole", flush=True)
        if options.this:
            lent = Path(sysconfig.get_path("purelib"))
            print(f"  {sys.version.split()[0]}: {tried(Path(sys.executable), wheel, QUICK, lent)}")
            continue
        for minor, python in pythons().items():
            if is_for(wheel, minor):
                print(f"  3.{minor}: {tried(python, wheel, (*QUICK, demo, types))}", flush=True)
            elif minor == 10:
                print(f"  3.{minor}: {refusal(python, wheel)}", flush=True)


def refusal(python: Path, wheel: Path) -> str:
    """The line with which pip refuses a wheel for another Python."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            Environment(python, Path(folder)).install(wheel)
        except Failed as failed:
            return str(failed).splitlines()[-1]
    raise Failed(f"{python} took {wheel.name}, which is not for it")


if __name__ == "__main__":
    try:
        main()
    except Failed as failed:
        sys.exit(str(failed))
