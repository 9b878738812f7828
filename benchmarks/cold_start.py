# SPDX-License-Identifier: Apache-2.0
"""The first answer of a new process: import, first fit and first plot, next to lmfit and scikit-learn.

    python benchmarks/cold_start.py [--rounds 9] [--write FILE]

Each program reads examples/insertion.csv, fits it, and draws measured and fitted force: needleforce by ``identify``,
lmfit by a step and a line, scikit-learn by a regression tree. In each round every program runs once, in turn, in a
process of its own. A figure is the processor time, user and system, from the start of Python to that stage, the least
of all rounds. Files are in memory and modules compiled, as from the second start on. A program that is not installed is
named.
"""

import argparse
import importlib.util
import os
import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path

RECORDING = Path(__file__).resolve().parents[1] / "examples" / "insertion.csv"
MARK = """
import sys, time
recording, figure, marks = sys.argv[1], sys.argv[2], open(sys.argv[3], "w")
def mark():
    print(time.process_time(), file=marks, flush=True)
"""
OURS = """
import needleforce as nf
mark()
fit = nf.identify(nf.read(recording), needle="paper")
assert fit.parameters
mark()
fit.plot().figure.savefig(figure)
mark()
"""
READ = """
import numpy as np
depth, force = np.loadtxt(recording, delimiter=",", skiprows=5, usecols=(1, 3), unpack=True)
"""
PLOT = """
mark()
import matplotlib.pyplot as plt
axes = plt.figure().subplots()
axes.plot(depth, force, ".", depth, fitted)
plt.savefig(figure)
mark()
"""
LMFIT = f"""
import lmfit
mark()
{READ}
model = lmfit.models.StepModel(form="logistic") + lmfit.models.LinearModel()
fitted = model.fit(force, x=depth, amplitude=0.1, center=5e-3, sigma=1e-3, slope=10.0, intercept=0.0).best_fit
{PLOT}
"""
SCIKIT_LEARN = f"""
from sklearn.tree import DecisionTreeRegressor
mark()
{READ}
fitted = DecisionTreeRegressor(max_leaf_nodes=8).fit(depth[:, None], force).predict(depth[:, None])
{PLOT}
"""
HELP = """
sys.argv = ["needleforce", "--help"]
from needleforce.cli import main
try:
    main()
finally:
    mark()
"""
STAGES = ("import", "first fit", "first plot")
PEERS = {"lmfit": ("lmfit", LMFIT), "scikit-learn": ("sklearn", SCIKIT_LEARN)}


def times(code: str, folder: Path) -> list[float]:
    """Processor time [s] of a new process at each of its marks."""
    environment = {**os.environ, "MPLBACKEND": "agg"}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)  # what is compiled stays so, as for a user
    command = [sys.executable, "-c", MARK + code, RECORDING, folder / "first.svg", folder / "marks"]
    subprocess.run(command, env=environment, check=True, stdout=subprocess.DEVNULL)
    return [float(line) for line in (folder / "marks").read_text().split()]


def least(programs: dict[str, str], rounds: int) -> dict[str, list[float]]:
    """The least time at each mark of each program; the first round compiles what is new, and does not count."""
    found: dict[str, list[list[float]]] = {name: [] for name in programs}
    with tempfile.TemporaryDirectory() as folder:
        for number in range(rounds + 1):
            for name, code in programs.items():
                found[name].append(times(code, Path(folder)))
            print(f"round {number} of {rounds}", file=sys.stderr, flush=True)
    return {name: [min(stage) for stage in zip(*rows[1:])] for name, rows in found.items()}


def markdown(found: dict[str, list[float]]) -> str:
    """A row for each stage and program: milliseconds, and needleforce's divided by them."""
    lines = ["| program | stage | ms of processor time | needleforce ÷ this |", "|---|---|---:|---:|"]
    for name, seconds in found.items():
        for stage, mine, each in zip(STAGES if len(seconds) == 3 else ("",), found["needleforce"], seconds):
            ratio = f"{mine / each:.2f}" if name in PEERS else ""
            lines.append(f"| {name} | {stage} | {1e3 * each:.0f} | {ratio} |")
    return "\n".join(lines)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--rounds", type=int, default=9)
    options.add_argument("--write", type=Path, help="a file for the table")
    arguments = options.parse_args()
    programs = {"only Python": "mark()", "needleforce --help": HELP, "needleforce": OURS}
    for name, (module, code) in PEERS.items():
        if importlib.util.find_spec(module):
            print(name, version(name))
            programs[name] = code
        else:
            print(f"{name} is not installed: pip install --requirement benchmarks/requirements.txt")
    table = markdown(least(programs, arguments.rounds))
    print("\n" + table, flush=True)
    if arguments.write:
        arguments.write.write_text(table + "\n", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
