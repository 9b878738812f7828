# SPDX-License-Identifier: Apache-2.0
"""The complete fit compared with other methods, over the same recordings: correct fits, errors and time.

    python benchmarks/fit_peers.py [--full] [--write FILE]

The other methods fit the same five parameters to both strokes, with the faster of two forms of the model: scipy's
curve_fit, lmfit's leastsq and Nelder-Mead from starts within 10 % of the truth, and scipy's differential evolution
between half and twice the truth. ``fit_cycle`` gets no start. A fit is correct if the puncture is within 0.05 mm, and
contact, stiffness, friction and cutting are within four standard errors. Two kinds of standard errors are used: the
method's own (a method that gives none is not correct), and the same for every method, those of least squares at the
truth with known puncture. Without ``--full`` few recordings (under a minute); with it 1000 at each noise, and 50 for
differential evolution.
"""

import argparse
import sys
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import lmfit
import numpy as np
from fit import PARAMETERS, progress, simulate, sliced
from scipy.optimize import curve_fit, differential_evolution

from needleforce.identification.one_layer.cycle_fit import fit_cycle
from needleforce.identification.statistics.noise import TWO_SIDED

ORDER = ("stiffness_coefficient", "contact_depth", "puncture_depth", "friction_per_length", "cutting_force")
PUNCTURE, SIGMAS = 0.05e-3, 4.0
NOISES = (5e-3, 20e-3, 50e-3)
SHOWN = (
    ("stiffness_coefficient", "c %", 0.0),
    ("contact_depth", "z0 um", 1e6),
    ("friction_per_length", "f' %", 0.0),
    ("cutting_force", "f_c mN", 1e3),
    ("puncture_depth", "z1 um", 1e6),
)


@dataclass
class Outcome:
    """One fit: values and standard errors by quantity (NaN if the method gives none), and its time [s]."""

    values: dict
    errors: dict
    seconds: float


def ours(arrays, truth, seed) -> Outcome:
    began = time.perf_counter()
    fit = fit_cycle(*arrays)
    taken = time.perf_counter() - began
    errors = {name: (fit.high[name] - fit.low[name]) / (2 * TWO_SIDED) for name in PARAMETERS}
    return Outcome({name: fit.values[name] for name in ORDER}, errors, taken)


def peer(solve: Callable) -> Callable:
    """A method whose ``solve`` takes the model, depth, force, the truth in ORDER and a random generator."""

    def fit(arrays, truth, seed) -> Outcome:
        depth, force, model = np.concatenate(arrays[0::2]), np.concatenate(arrays[1::2]), sliced(len(arrays[0]))
        at = np.array([truth[name] for name in ORDER])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            began = time.perf_counter()
            values, errors = solve(model, depth, force, at, np.random.default_rng(seed))
        taken = time.perf_counter() - began
        return Outcome(dict(zip(ORDER, values)), dict(zip(ORDER, errors)), taken)

    return fit


def by_curve_fit(model, depth, force, at, random):
    values, covariance = curve_fit(model, depth, force, at * random.uniform(0.9, 1.1, 5))
    return values, np.sqrt(np.diagonal(covariance))


def by_lmfit(method: str) -> Callable:
    def solve(model, depth, force, at, random):
        parameters = lmfit.Parameters()
        for name, value in zip(ORDER, at * random.uniform(0.9, 1.1, 5)):
            parameters.add(name, value)
        found = lmfit.minimize(
            lambda p: model(depth, *(p[name].value for name in ORDER)) - force, parameters, method=method
        )
        rows = [found.params[name] for name in ORDER]
        return [row.value for row in rows], [np.nan if row.stderr is None else row.stderr for row in rows]

    return solve


def by_differential_evolution(model, depth, force, at, random):
    def misfit(values):
        return float(np.sum((model(depth, *values) - force) ** 2))

    found = differential_evolution(misfit, list(zip(0.5 * at, 2.0 * at)), rng=random)
    return found.x, np.full(5, np.nan)


METHODS = {
    "needleforce fit_cycle": ours,
    "scipy curve_fit": peer(by_curve_fit),
    "lmfit leastsq": peer(by_lmfit("leastsq")),
    "lmfit nelder": peer(by_lmfit("nelder")),
    "scipy differential_evolution": peer(by_differential_evolution),
}
SLOWEST = "scipy differential_evolution"


def smallest_errors(arrays, truth, noise: float) -> dict:
    """Standard errors of least squares at the truth, with known puncture: no method can have smaller ones."""
    inwards, outwards = (depth - truth["contact_depth"] for depth in arrays[0::2])
    loading = (inwards > 0.0) & (inwards <= truth["puncture_indentation"])
    cutting = inwards > truth["puncture_indentation"]
    c, slope = truth["stiffness_coefficient"], truth["friction_per_length"]
    columns = np.zeros((len(inwards) + len(outwards), 4))
    columns[: len(inwards)][loading, 0] = inwards[loading] ** 2
    columns[: len(inwards)][loading, 1] = -2.0 * c * inwards[loading]
    columns[: len(inwards)][cutting, 1:] = np.array([[-slope, 0.0, 1.0]]) + np.outer(inwards[cutting], [0, 1, 0])
    pulled = outwards > 0.0
    columns[len(inwards) :][pulled, 1:3] = np.array([[slope, 0.0]]) + np.outer(outwards[pulled], [0, -1])
    scale = np.linalg.norm(columns, axis=0)
    covariance = np.linalg.inv((columns / scale).T @ (columns / scale))
    return dict(zip(PARAMETERS, noise * np.sqrt(np.diagonal(covariance)) / scale))


def correct(outcome: Outcome, truth: dict, errors: dict) -> bool:
    near = all(abs(outcome.values[name] - truth[name]) <= SIGMAS * errors[name] < np.inf for name in PARAMETERS)
    return near and abs(outcome.values["puncture_depth"] - truth["puncture_depth"]) <= PUNCTURE


def shown_errors(outcomes: list, truths: list) -> list[float]:
    """Median error of each quantity, in percent of the truth or in the unit shown."""
    medians = []
    for name, _, factor in SHOWN:
        apart = [abs(outcome.values[name] - truth[name]) for outcome, truth in zip(outcomes, truths)]
        scale = factor or 100.0 / truths[0][name]
        medians.append(scale * float(np.median(apart)))
    return medians


def rows_of(noise: float, counts: dict[str, int]) -> list[list]:
    """One row per method: recordings, correct by own and by common errors, median errors, milliseconds, time ratio."""
    done = {name: [] for name in METHODS}
    for k in range(max(counts.values())):
        arrays, truth = simulate(7_000_000 + k + round(1e8 * noise), noise)
        common = smallest_errors(arrays, truth, noise)
        for name, method in METHODS.items():
            if k < counts[name]:
                outcome = method(arrays, truth, k)
                own = correct(outcome, truth, outcome.errors) if np.isfinite(outcome.errors["contact_depth"]) else None
                done[name].append((outcome, truth, own, correct(outcome, truth, common)))
        progress(f"{1e3 * noise:.0f} mN", k + 1, max(counts.values()))
    middle = {name: 1e3 * float(np.median([each[0].seconds for each in fits])) for name, fits in done.items()}
    reference = middle["needleforce fit_cycle"]
    return [
        [f"{1e3 * noise:.0f}", name, *summary(fits), middle[name], middle[name] / reference]
        for name, fits in done.items()
    ]


def summary(fits: list[tuple]) -> list:
    """Recordings, shares of correct fits (the first is None if no fit gave errors), and median errors."""
    outcomes, truths, own, same = zip(*fits)
    own_share = None if all(each is None for each in own) else 100 * sum(each is True for each in own) / len(fits)
    return [len(fits), own_share, 100 * sum(same) / len(fits), *shown_errors(outcomes, truths)]


HEAD = ["noise mN", "method", "recordings", "correct %, own errors", "correct %, same errors"]
HEAD += [shown for _, shown, _ in SHOWN] + ["median ms", "time ÷ fit_cycle"]


def markdown(rows: list[list]) -> str:
    """The table in Markdown, values with three digits."""
    lines = ["| " + " | ".join(HEAD) + " |", "|---:|---|" + "---:|" * (len(HEAD) - 2)]
    return "\n".join(lines + ["| " + " | ".join(map(cell, row)) + " |" for row in rows])


def cell(value) -> str:
    if value is None or isinstance(value, str | int):
        return "none given" if value is None else str(value)
    return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.3g}" if abs(value) < 90 else f"{value:.1f}"


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--full", action="store_true", help="1000 recordings at each noise, 50 for the slowest")
    options.add_argument("--write", type=Path, help="a file for the table")
    arguments = options.parse_args()
    counts = dict.fromkeys(METHODS, 1000 if arguments.full else 12) | {SLOWEST: 50 if arguments.full else 1}
    rows = []
    for noise in NOISES:
        rows += rows_of(noise, counts)
    print(f"\ncorrect: puncture within 0.05 mm, the others within {SIGMAS:g} standard errors; errors are medians\n")
    print(markdown(rows), flush=True)
    if arguments.write:
        arguments.write.write_text(markdown(rows) + "\n", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
