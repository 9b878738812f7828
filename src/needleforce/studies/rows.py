# SPDX-License-Identifier: Apache-2.0
"""The insertions of a study as rows of numbers between 0 and 1, a column for each independent factor."""

import itertools
from typing import Any

import numpy as np

from ..errors import InputError, install_step
from .factors import GRID_TAIL, Factor

MORRIS_LEVELS = 4  # of the grid on which the trajectories of Morris move


def salib(module: str) -> Any:
    """A module of SALib. Raises InputError if it is not installed."""
    from importlib import import_module

    try:
        return import_module(f"SALib.{module}")
    except ImportError:
        step = install_step("SALib", "study")
        raise InputError("package SALib", "not installed", "sensitivity needs it", next_step=step) from None


def columns_of(factors: list[Factor], draws: int) -> list[str]:
    """The name of each independent column: the factors, one for all factors of a campaign, ``draws`` of a fit."""
    names = dict.fromkeys(factor.group or factor.name for factor in factors)
    return [*names, *(f"posterior {number}" for number in range(1, draws + 1))]


def problem(columns: list[str]) -> dict:
    """The columns in the words of SALib."""
    return {"num_vars": len(columns), "names": columns, "bounds": [[0.0, 1.0]] * len(columns)}


def number_of_rows(question: Any, factors: list[Factor], draws: int) -> int:
    """How many insertions a study has for each motion."""
    method, columns = question.study, len(columns_of(factors, draws))
    if method.method == "grid":
        return int(np.prod([float(count) for count in _levels(factors).values()]))
    if method.method == "sensitivity" and method.analysis == "sobol":
        return method.samples * (2 * columns + 2 if method.interactions else columns + 2)
    if method.method == "sensitivity" and method.analysis == "morris":
        return method.samples * (columns + 1)
    return method.samples


def unit_rows(question: Any, factors: list[Factor], draws: int) -> np.ndarray:
    """The rows (n, columns) of a question, the same for the same question."""
    method, names = question.study, columns_of(factors, draws)
    if method.method == "grid":
        return _grid(factors)
    if method.method == "sensitivity" and method.analysis == "sobol":
        sample = salib("sample.sobol").sample
        return sample(problem(names), method.samples, calc_second_order=method.interactions, seed=method.seed)
    if method.method == "sensitivity" and method.analysis == "morris":
        sample = salib("sample.morris").sample
        return sample(problem(names), method.samples, num_levels=MORRIS_LEVELS, seed=method.seed)
    return _space_filling(method, len(names))


def _space_filling(method: Any, columns: int) -> np.ndarray:
    from scipy.stats import qmc

    if method.sampler == "latin hypercube":
        return qmc.LatinHypercube(columns, rng=method.seed).random(method.samples)
    power = int(np.ceil(np.log2(method.samples)))  # a Sobol sequence is balanced over a power of two
    return qmc.Sobol(columns, rng=method.seed).random_base2(power)[: method.samples]


def _levels(factors: list[Factor]) -> dict[str, int]:
    """The number of values on a grid, by column."""
    return {factor.group or factor.name: factor.levels for factor in factors}


def _grid(factors: list[Factor]) -> np.ndarray:
    """Every combination of levels; a distribution without limits is cut at its tails."""
    kinds = {factor.group or factor.name: factor.spread for factor in factors}
    lines = {
        "ends": lambda count: np.linspace(0.0, 1.0, count) if count > 1 else np.array([0.5]),
        "tails": lambda count: np.linspace(GRID_TAIL, 1.0 - GRID_TAIL, count) if count > 1 else np.array([0.5]),
        "each": lambda count: (np.arange(count) + 0.5) / count,
    }
    levels = [lines[kinds[name]](count) for name, count in _levels(factors).items()]
    return np.array(list(itertools.product(*levels)))
