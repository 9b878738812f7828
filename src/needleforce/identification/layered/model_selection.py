# SPDX-License-Identifier: Apache-2.0
"""Selection of the number of layers and of the mechanisms that the recordings support."""

from dataclasses import dataclass, replace

import numpy as np

from ..statistics.noise import noise_of, student_quantile
from ..statistics.regression import VERY_STRONG_BIC, independent_samples
from .binned_cycle import BinnedCycle
from .parameters import (
    NO_RELAXATION,
    NO_SATURATION,
    PER_LAYER,
    RUPTURE_LENGTH,
    SATURATION,
    SHARP_RUPTURE,
    LayeredParameters,
)
from .problem import REFUSED_RESIDUAL
from .search import Solved, again, population_fit

MAX_ERROR_RATIO = 1.02  # over the smallest error; of these the model with the fewest parameters is chosen
ROUNDING = 1e-9  # of a ratio of errors
MIN_REPEATS = 3  # for a selection by held-out repeats, and for a scatter between repeats


@dataclass(frozen=True, eq=False, kw_only=True)
class Candidate:
    """One choice of layers and mechanisms: number of fitted ``parameters``, ``residual`` rms over the peak.

    ``bic`` is Schwarz's criterion over the complete cycles, correlated samples counted as one; ``held_out`` the rms
    error over the peak on each repeat (n,) predicted from the others, empty with fewer than three.
    """

    name: str
    solved: Solved
    parameters: int
    residual: float
    bic: float
    held_out: np.ndarray

    @property
    def error(self) -> float:
        """Geometric mean over the held-out repeats, robust to one anomalous repeat; NaN without them."""
        return float(np.exp(np.mean(np.log(self.held_out)))) if len(self.held_out) else float("nan")


def candidate(name: str, solved: Solved) -> Candidate:
    """Number of parameters, residual and prediction errors of one fit; ``with_bic`` adds the BIC."""
    count = len(solved.problem.cycles)
    runs = range(count) if count >= MIN_REPEATS else ()
    errors = [prediction_error(without_run(solved, run), solved.problem.cycles[run]) for run in runs]
    return Candidate(
        name=name,
        solved=solved,
        parameters=len(solved.problem.unknowns.free),
        residual=solved.residual,
        bic=float("nan"),
        held_out=np.array(errors),
    )


def without_run(solved: Solved, run: int) -> Solved:
    """The fit to the other repeats, started at the fit to all."""
    unknowns, cycles = solved.problem.unknowns, solved.problem.cycles
    punctures = np.delete(unknowns.punctures(solved.x), run, axis=0).ravel()
    x = np.concatenate([solved.x[: unknowns.shared], punctures])
    return again(solved, x, cycles=cycles[:run] + cycles[run + 1 :], unknowns=one_run_less(unknowns))


def one_run_less(unknowns: LayeredParameters) -> LayeredParameters:
    """The layout with one run less."""
    return replace(unknowns, runs=unknowns.runs - 1)


def prediction_error(solved: Solved, cycle: BinnedCycle) -> float:
    """Rms error over the peak on a held-out cycle, predicted by the population fit."""
    population = population_fit(solved)
    punctures = population.problem.unknowns.punctures(population.x).mean(axis=0)
    error = (population.problem.along(cycle, population.x, punctures) - cycle.force) * cycle.weight
    return float(np.sqrt(np.nan_to_num(error @ error, nan=REFUSED_RESIDUAL)))


def with_bic(candidates: list[Candidate]) -> list[Candidate]:
    """The candidates with their BIC, all with the number of independent samples of the best fit's residual."""
    smallest = min(candidates, key=lambda each: each.residual)
    samples = sum(_independent(smallest.solved, run) for run in range(len(smallest.solved.problem.cycles)))
    return [
        replace(each, bic=samples * np.log(each.residual**2) + each.parameters * np.log(samples)) for each in candidates
    ]


def _independent(solved: Solved, run: int) -> float:
    noise = noise_of(solved.problem.residuals(run, solved.x), len(solved.problem.cycles[run].depth))
    return independent_samples([noise])


def chosen(candidates: list[Candidate]) -> Candidate:
    """Of those that predict held-out repeats as well as the best, within 2 %, the one with the fewest parameters; with
    fewer than three repeats the one with the lowest BIC."""
    if not all(len(each.held_out) for each in candidates):
        return min(candidates, key=lambda each: each.bic)
    smallest = min(each.error for each in candidates)
    good = [each for each in candidates if each.error <= MAX_ERROR_RATIO * smallest]
    return min(good, key=lambda each: (each.parameters, each.error))


def ties(one: Candidate, other: Candidate) -> bool:
    """True if the ratio of the errors on held-out repeats does not differ from 1, by Student's t; without them, if the
    BIC values differ by less than 10."""
    if not (len(one.held_out) and len(other.held_out)):
        return abs(one.bic - other.bic) < VERY_STRONG_BIC
    return abs(_log_error_ratio(one, other)) <= student_quantile(len(one.held_out) - 1)


def _log_error_ratio(one: Candidate, other: Candidate) -> float:
    """Mean logarithm of the ratio of the errors on held-out repeats, in its standard errors.

    Repeats that are copies of one another have ratios without scatter; the error is then that of rounding.
    """
    difference = np.log(one.held_out / other.held_out)
    error = max(float(difference.std(ddof=1)) / np.sqrt(len(difference)), ROUNDING)
    return float(difference.mean()) / error


def removable(unknowns: LayeredParameters) -> dict[str, dict[int, float]]:
    """Mechanisms that can be removed: the name, and the indices in x with the values that remove it."""
    first = PER_LAYER * np.arange(unknowns.layers)
    found = {
        "sharp rupture": dict.fromkeys(first + RUPTURE_LENGTH, SHARP_RUPTURE),
        "no saturation": dict.fromkeys(first + SATURATION, NO_SATURATION),
        "no relaxation": {unknowns.relaxing: NO_RELAXATION, unknowns.relaxing + 1: 0.0},
    }
    return found if unknowns.speed in unknowns.held else found | {"no dependence on speed": {unknowns.speed: 0.0}}


def without(solved: Solved, values: dict[int, float]) -> Solved:
    """The fit with parameters held at values."""
    x, unknowns = solved.x.copy(), solved.problem.unknowns
    x[list(values)] = list(values.values())
    return again(solved, x, unknowns=replace(unknowns, held=unknowns.held | frozenset(map(int, values))))
