# SPDX-License-Identifier: Apache-2.0
"""Selection of the number of layers and of the mechanisms that the recordings support."""

from dataclasses import dataclass, replace

import numpy as np

from ..statistics.noise import noise_of
from ..statistics.regression import VERY_STRONG_BIC, bic_gain, criterion, independent_samples
from .binned_cycle import BIN_ERROR, BinnedCycle
from .parameters import (
    NO_RELAXATION,
    NO_SATURATION,
    PER_LAYER,
    RUPTURE_LENGTH,
    SATURATION,
    SHARP_RUPTURE,
    LayeredParameters,
    prefix,
)
from .prediction import expectation
from .problem import REFUSED_RESIDUAL
from .search import Solved, again, with_saturation

MAX_ERROR_RATIO = 1.02  # over the smallest error: a smaller difference matters to nobody
MIN_HOLD_BINS, MAX_T = 6, 3.6  # Student's quantile of 0.1 % with 20 degrees of freedom
HELD_OUT_STEPS = 25  # of the fit to the other repeats, which starts at the fit to all
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
    problem = replace(solved.problem, cycles=cycles[:run] + cycles[run + 1 :], unknowns=one_run_less(unknowns))
    return Solved(problem, *problem.solve(x, HELD_OUT_STEPS))


def one_run_less(unknowns: LayeredParameters) -> LayeredParameters:
    """The layout with one run less."""
    return replace(unknowns, runs=unknowns.runs - 1)


def prediction_error(solved: Solved, cycle: BinnedCycle) -> float:
    """Rms error over the scale of the expected force on a held-out cycle."""
    force = solved.problem.speed_factor(cycle, solved.x) * expectation(solved).force(cycle.depth, cycle.dt)
    error = (force - cycle.force) * cycle.weight
    return float(np.sqrt(np.nan_to_num(error @ error, nan=REFUSED_RESIDUAL)))


def with_bic(candidates: list[Candidate]) -> list[Candidate]:
    """The candidates with their BIC, all with the number of independent samples of the best fit's residual."""
    smallest = min(candidates, key=lambda each: each.residual)
    samples = sum(_independent(smallest.solved, run) for run in range(len(smallest.solved.problem.cycles)))
    return [replace(each, bic=criterion(each.residual**2, each.parameters, samples)) for each in candidates]


def _independent(solved: Solved, run: int) -> float:
    noise = noise_of(solved.problem.residuals(run, solved.x), len(solved.problem.cycles[run].depth))
    return independent_samples([noise])


def fewest_layers(candidates: list[Candidate]) -> Candidate:
    """The fit with the fewest layers of those that are as good as the best."""
    best = min(candidates, key=_merit)
    return min((each for each in candidates if as_good(each, best)), key=lambda each: (each.parameters, _merit(each)))


def fewest_mechanisms(complete: Candidate, reduced: list[Candidate]) -> Candidate:
    """The fit with the fewest parameters of ``complete`` and those reduced ones that are as good, and against which the
    residual of the recordings is no very strong evidence. Relaxation stays where the force falls at rest."""
    unknowns, shown = complete.solved.problem.unknowns, any(map(relaxes, complete.solved.problem.cycles))
    kept = [
        each
        for each in reduced
        if as_good(each, complete)
        and each.bic - complete.bic < VERY_STRONG_BIC
        and not (shown and unknowns.relaxing in each.solved.problem.unknowns.held)
    ]
    return min([complete, *kept], key=lambda each: (each.parameters, _merit(each)))


def as_good(one: Candidate, best: Candidate) -> bool:
    """True if ``one`` predicts held-out repeats as well as ``best``.

    The error is larger by no more than 2 %, or by no more than the standard error of the difference. Without held-out
    repeats: the BIC is larger by no more than 10.
    """
    if not (len(one.held_out) and len(best.held_out)):
        return bool(one.bic - best.bic < VERY_STRONG_BIC)
    ratio = np.log(np.hypot(one.held_out, BIN_ERROR) / np.hypot(best.held_out, BIN_ERROR))
    if ratio.mean() <= np.log(MAX_ERROR_RATIO):
        return True
    return bool(ratio.mean() <= ratio.std(ddof=1) / np.sqrt(len(ratio)))


def _merit(each: Candidate) -> float:
    """The smaller the better: error on held-out repeats, or the BIC without them."""
    return each.error if len(each.held_out) else each.bic


def removable(unknowns: LayeredParameters) -> dict[str, dict[int, float]]:
    """Mechanisms that can be removed: the name, and the indices in x with the values that remove it."""
    first = PER_LAYER * np.arange(unknowns.layers)
    found = {
        "sharp rupture": dict.fromkeys(first + RUPTURE_LENGTH, SHARP_RUPTURE),
        "no saturation": dict.fromkeys(first + SATURATION, NO_SATURATION),
        "no relaxation": {unknowns.relaxing: NO_RELAXATION, unknowns.relaxing + 1: 0.0},
    }
    common = {"no dependence on speed": unknowns.speed, "the same friction in both directions": unknowns.withdrawal}
    return found | {name: {place: 0.0} for name, place in common.items() if place not in unknowns.held}


def undecided_saturations(found: Solved) -> frozenset[str]:
    """Names of saturation depths in the model against whose absence the residual is no very strong evidence, by the
    BIC: an interval about one minimum does not contain the other."""
    unknowns, undecided = found.problem.unknowns, set()
    samples = sum(_independent(found, run) for run in range(len(found.problem.cycles)))
    for layer in range(unknowns.layers):
        place = PER_LAYER * layer + SATURATION
        if place in unknowns.held:
            continue
        ratio = without(found, {place: NO_SATURATION}).residual / found.residual
        if bic_gain(1.0, ratio**2, 1, samples) < VERY_STRONG_BIC:
            undecided.add(f"{prefix(layer)}saturation_depth")
    return frozenset(undecided)


def relaxes(cycle: BinnedCycle) -> bool:
    """True if the force falls over the hold: the slope of a line over the bins, by Student's t (one-sided, 0.1 %)."""
    force = cycle.force[cycle.stroke == 1]
    count = len(force)
    if count < MIN_HOLD_BINS:
        return False
    place = np.arange(count) - 0.5 * (count - 1)
    slope = place @ force / (place @ place)
    residual = force - force.mean() - slope * place
    error = np.sqrt(residual @ residual / (count - 2) / (place @ place))
    return bool(-slope > MAX_T * error)


def without(solved: Solved, values: dict[int, float]) -> Solved:
    """The fit with parameters held at values. A contact that no longer saturates starts with the same force at its
    rupture."""
    x, unknowns = solved.x.copy(), solved.problem.unknowns
    for k in (k for k in values if k < unknowns.relaxing and k % PER_LAYER == SATURATION):
        x = with_saturation(unknowns, x, k // PER_LAYER, NO_SATURATION)
    x[list(values)] = list(values.values())
    return again(solved, x, unknowns=replace(unknowns, held=unknowns.held | frozenset(map(int, values))))
