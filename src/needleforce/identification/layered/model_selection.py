# SPDX-License-Identifier: Apache-2.0
"""How many layers, and which mechanisms, the recordings ask for."""

from dataclasses import dataclass, replace

import numpy as np

from ..estimates import student
from ..statistics.noise import noise_of
from ..statistics.regression import VERY_STRONG, independent_samples
from .binned_cycle import BinnedCycle
from .parameters import BARE, NO_FADING, PER_LAYER, RUPTURE, SATURATION, SHARP, LayeredParameters
from .search import Solved, again, of_the_population

AS_GOOD = 1.02  # ratio of errors
ROUNDING = 1e-9  # of a ratio
ENOUGH = 3  # repeats: to judge by those left out, and to tell a scatter


@dataclass(frozen=True, eq=False)
class Candidate:
    """One choice of layers and mechanisms: ``parameters`` sought in all, ``residual`` rms over the peak.

    ``bic`` is Schwarz's criterion over the whole cycles, neighbours that are alike counting as one; ``left_out`` the
    rms error over the peak on each repeat (n,) foretold from the others, empty with fewer than three.
    """

    name: str
    solved: Solved
    parameters: int
    residual: float
    bic: float
    left_out: np.ndarray

    @property
    def error(self) -> float:
        """Geometric mean over the repeats left out, which one odd repeat does not decide; NaN without."""
        return float(np.exp(np.mean(np.log(self.left_out)))) if len(self.left_out) else float("nan")


def candidate(name: str, solved: Solved) -> Candidate:
    """What speaks for one fit; its criterion is set by ``with_bic``, which knows the others."""
    count = len(solved.problem.cycles)
    runs = range(count) if count >= ENOUGH else ()
    errors = [prediction_error(left_out(solved, run), solved.problem.cycles[run]) for run in runs]
    parameters = len(solved.problem.unknowns.free)
    return Candidate(name, solved, parameters, solved.residual, float("nan"), np.array(errors))


def left_out(solved: Solved, run: int) -> Solved:
    """The fit to the other repeats, from where all of them end."""
    unknowns, cycles = solved.problem.unknowns, solved.problem.cycles
    punctures = np.delete(unknowns.punctures(solved.x), run, axis=0).ravel()
    x = np.concatenate([solved.x[: unknowns.shared], punctures])
    return again(solved, x, cycles=cycles[:run] + cycles[run + 1 :], unknowns=fewer(unknowns))


def fewer(unknowns: LayeredParameters) -> LayeredParameters:
    """The layout with one run less."""
    return replace(unknowns, runs=unknowns.runs - 1)


def prediction_error(solved: Solved, cycle: BinnedCycle) -> float:
    """Rms error over the peak on a course not fitted, foretold by the law of the population."""
    typical = of_the_population(solved)
    punctures = typical.problem.unknowns.punctures(typical.x).mean(axis=0)
    return float(np.sqrt(typical.problem.squares(cycle, typical.x[None], punctures[None])[0]))


def with_bic(candidates: list[Candidate]) -> list[Candidate]:
    """The same with their criteria, on the same number of independent samples: those of the best fit's residual."""
    least = min(candidates, key=lambda each: each.residual)
    samples = sum(_independent(least.solved, run) for run in range(len(least.solved.problem.cycles)))
    return [
        replace(each, bic=samples * np.log(each.residual**2) + each.parameters * np.log(samples)) for each in candidates
    ]


def _independent(solved: Solved, run: int) -> float:
    noise = noise_of(solved.problem.residuals(run, solved.x), len(solved.problem.cycles[run].depth))
    return independent_samples([noise])


def chosen(candidates: list[Candidate]) -> Candidate:
    """Of those that foretell the repeats left out as well as the best, within 2 %, the one of the fewest numbers; with
    fewer than three repeats that of the least BIC."""
    if not all(len(each.left_out) for each in candidates):
        return min(candidates, key=lambda each: each.bic)
    least = min(each.error for each in candidates)
    good = [each for each in candidates if each.error <= AS_GOOD * least]
    return min(good, key=lambda each: (each.parameters, each.error))


def ties(one: Candidate, other: Candidate) -> bool:
    """True if the errors on the repeats left out have no other ratio than 1, by Student's t; without them, if the
    criteria differ by less than 10."""
    if not (len(one.left_out) and len(other.left_out)):
        return abs(one.bic - other.bic) < VERY_STRONG
    return abs(_worse(one, other)) <= student(len(one.left_out))


def _worse(one: Candidate, other: Candidate) -> float:
    """Mean logarithm of the ratio of the errors on the repeats left out, in its standard errors.

    Repeats that are copies of one another have a ratio without scatter: rounding alone parts it from 1 or is its error.
    """
    difference = np.log(one.left_out / other.left_out)
    error = max(float(difference.std(ddof=1)) / np.sqrt(len(difference)), ROUNDING)
    return float(difference.mean()) / error


def removable(unknowns: LayeredParameters) -> dict[str, dict[int, float]]:
    """What can be left away: its name, and the places in x with the values that take it away."""
    first = PER_LAYER * np.arange(unknowns.layers)
    found = {
        "sharp rupture": dict.fromkeys(first + RUPTURE, SHARP),
        "no saturation": dict.fromkeys(first + SATURATION, BARE),
        "no relaxation": {unknowns.fading: NO_FADING, unknowns.fading + 1: 0.0},
    }
    return found if unknowns.speed in unknowns.held else found | {"no dependence on speed": {unknowns.speed: 0.0}}


def without(solved: Solved, values: dict[int, float]) -> Solved:
    """The fit with numbers held at values."""
    x, unknowns = solved.x.copy(), solved.problem.unknowns
    x[list(values)] = list(values.values())
    return again(solved, x, unknowns=replace(unknowns, held=unknowns.held | frozenset(map(int, values))))
