# SPDX-License-Identifier: Apache-2.0
"""The search layer by layer over starting values, which are derived from the events, not given by the user."""

import itertools
import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .binned_cycle import BIN_ERROR, MIN_BINS, BinnedCycle, at_rest, relaxation_times
from .parameters import (
    COEFFICIENT,
    FRICTION_RATIO,
    MM,
    NO_SATURATION,
    PER_LAYER,
    RESTING_SURFACE,
    RUPTURE_LENGTH,
    SATURATION,
    TISSUE_STIFFNESS,
    TOP,
    LayeredParameters,
    logistic,
)
from .problem import TIED_RIDGE, Problem
from .starts import first_starts, grown_starts, typical_starts

SCREENING_STEPS, FINAL_STEPS = 15, 100  # of the descent from every start, and from the finalists
N_FINALISTS = 3  # best starts after the screening
N_REPLACED, MIN_GAIN = 5, 1e-3  # how often other mechanisms are tried, and the gain of cost that one of them needs
ASIDE = {TOP: 2.0, FRICTION_RATIO: 1.5, TISSUE_STIFFNESS: 0.6, RUPTURE_LENGTH: 2.0, RESTING_SURFACE: 3.0}
"""How far each value of a layer is moved to leave a shallow minimum, in the unit of x."""
MAX_OVER_NOISE = 1.1
"""Residual over a well-known noise, beyond which it is more than noise: right fits of three layers stay below 1.03."""
OTHER_LAW_OVER_NOISE = 5.0  # from here on another law is left, which no other minimum of this one meets
STIFFER_STARTS = ((0.0, 0.0), (0.7, 0.0), (0.7, 0.7))  # added to the logarithms of c and k_t
MIN_SPEED_RATIO = 1.3  # between repeats, to identify the dependence of forces on speed
SATURATION_SHARES = (0.4, 0.75)  # [of the indentation at the rupture] other saturation depths
MIN_INDENTATION_MM = 1.0  # [mm] between a layer's top and its puncture


@dataclass(frozen=True, eq=False)
class Solved:
    """A problem with its best vector; ``cost`` is half the sum of squares."""

    problem: Problem
    x: np.ndarray
    cost: float

    @property
    def residual(self) -> float:
        """Rms over the runs of the residual over the peak."""
        return float(np.sqrt(2.0 * self.cost / len(self.problem.cycles)))

    @property
    def noise(self) -> float:
        """Rms over the runs of the noise of the free travel over the peak; NaN where none shows it."""
        noises = [cycle.zero.noise.long_run * len(cycle.force) / cycle.count.sum() for cycle in self.problem.cycles]
        return float(np.sqrt(np.mean(noises))) / self.problem.cycles[0].scale

    @property
    def explained(self) -> bool:
        """Whether it leaves no more than the noise and the error of the bins: one layer more is a small change then,
        and no other fit with it is better."""
        return self.residual**2 <= (MAX_OVER_NOISE * self.noise) ** 2 + BIN_ERROR**2

    @property
    def near_the_noise(self) -> bool:
        """Whether it leaves more than the noise, but less than tissue of another law."""
        return MAX_OVER_NOISE * self.noise < self.residual < OTHER_LAW_OVER_NOISE * self.noise


def grow(cycles: tuple[BinnedCycle, ...], max_layers: int, form: str = "as_fitted") -> Iterator[Solved]:
    """Fits with 1, 2, … ``max_layers`` layers in a form, each without a warm start and from the fit with one layer
    less; from that alone where it leaves nothing to explain."""
    speeds, before = [cycle.speed for cycle in cycles], None
    typical = float(np.exp(np.mean(np.log(speeds))))
    times = relaxation_times(cycles)
    for layers in range(1, max_layers + 1):
        unknowns = LayeredParameters(layers, len(cycles), times)
        held = {unknowns.speed} if max(speeds) < MIN_SPEED_RATIO * min(speeds) else set()
        held |= set() if any((cycle.stroke == 2).any() for cycle in cycles) else {unknowns.withdrawal}
        held |= {unknowns.constants, unknowns.constants + 1}  # as the hold shows them, until the layers are known
        unknowns = replace(unknowns, held=frozenset(held))
        problem = Problem(cycles=cycles, unknowns=unknowns, form=form, speed=typical)
        if before is not None and before.explained:
            before = _one_layer_more(before)
        else:
            starts = list(first_starts(problem, on_all_cores))
            starts += list(_symmetric(problem, typical_starts(cycles, unknowns))) if layers < 3 else []
            starts += [] if before is None else grown_starts(cycles, before.problem.unknowns, before.x)
            before = best(problem, starts)
        yield before


def _one_layer_more(solved: Solved) -> Solved:
    """The fit with one layer more, from this one alone."""
    problem, fewer = solved.problem, solved.problem.unknowns
    unknowns = replace(fewer, layers=fewer.layers + 1, held=frozenset(k + PER_LAYER for k in fewer.held))
    return best(replace(problem, unknowns=unknowns), grown_starts(problem.cycles, fewer, solved.x))


def _symmetric(problem: Problem, starts: Iterable[np.ndarray]) -> Iterator[np.ndarray]:
    """Rough starts after a few steps with the same friction in both directions: with their ratio free at once, a search
    from them ends more often where friction stands for something else."""
    unknowns = problem.unknowns
    held = replace(problem, unknowns=replace(unknowns, held=unknowns.held | {unknowns.withdrawal}))
    yield from (x for x, _ in on_all_cores(lambda x: held.solve(x, 10), starts))


def on_all_cores(work: Callable, items: Iterable) -> list:
    """The work on each of the items, in their order, a share of them on each of the processor's cores; searches leave
    Python meanwhile, and their results do not depend on the sharing."""
    items, cores = list(items), os.cpu_count() or 1
    found: list = [None] * len(items)

    def share(first: int) -> None:
        found[first::cores] = list(map(work, items[first::cores]))

    if cores > 1 and len(items) > 1:
        with ThreadPoolExecutor(cores) as pool:
            list(pool.map(share, range(cores)))
    else:
        found = list(map(work, items))
    return found


def _cost(found: tuple[np.ndarray, float]) -> float:
    return found[1]


def best(problem: Problem, starts: Iterable[np.ndarray]) -> Solved:
    """The best of several starts: all with few steps, the best with more and with scans of the punctures; then with
    other mechanisms from there."""
    screened = sorted(on_all_cores(lambda x: problem.solve(x, SCREENING_STEPS), starts), key=_cost)
    x, cost = min(on_all_cores(lambda found: problem.settled(found[0], FINAL_STEPS), screened[:N_FINALISTS]), key=_cost)
    x, cost = _with_other_mechanisms(problem, x, cost)
    return Solved(problem, problem.unknowns.in_order(x), cost)


def _with_other_mechanisms(problem: Problem, x: np.ndarray, cost: float) -> tuple[np.ndarray, float]:
    """The vector and its cost after other mechanisms have been tried, as long as one of them leads lower."""
    for _ in range(N_REPLACED):
        tried = on_all_cores(
            lambda other: problem.solve(other, SCREENING_STEPS), _other_mechanisms(problem.unknowns, x)
        )
        other, lower = min(tried, key=_cost)
        if not lower < (1.0 - MIN_GAIN) * cost:
            break
        x, cost = problem.settled(other, FINAL_STEPS)
    return x, cost


def _other_mechanisms(unknowns: LayeredParameters, x: np.ndarray) -> Iterator[np.ndarray]:
    """Vectors that a descent does not reach: with the springs of two layers exchanged or equal, whose forces add up
    below both ruptures, so that only the strokes above the deeper one distinguish them; and with a contact that
    saturates elsewhere on the way to the rupture of one of the layers, or not at all; and with one value of a layer
    moved, as the rupture of a gradual layer changes all of its values together."""
    for upper, lower in itertools.combinations(range(unknowns.layers), 2):
        yield with_exchanged_springs(unknowns, x, upper, lower)
        yield _with_equal_springs(unknowns, x, upper, lower)
    for layer in range(unknowns.layers):
        reached = indentations(unknowns, x)[layer]
        for depth in (NO_SATURATION, *np.log(reached * np.array(SATURATION_SHARES))):
            yield with_saturation(unknowns, x, layer, depth)
        for place, size in ASIDE.items():
            yield from (_moved_aside(x, PER_LAYER * layer, place, move) for move in (size, -size))


def _moved_aside(x: np.ndarray, first: int, place: int, move: float) -> np.ndarray:
    """The vector with one value of a layer moved; the friction stays where its spring moves."""
    x = x.copy()
    x[first + place] += move
    if place == TISSUE_STIFFNESS:
        x[first + FRICTION_RATIO] -= move
    return x


def with_exchanged_springs(unknowns: LayeredParameters, x: np.ndarray, one: int, other: int) -> np.ndarray:
    """The vector with friction, spring and surface at rest of two layers exchanged."""
    x = x.copy()
    layers = x[: unknowns.relaxing].reshape(unknowns.layers, PER_LAYER)  # a view
    surfaces = layers[[one, other], TOP] + layers[[one, other], RESTING_SURFACE]
    for place in (FRICTION_RATIO, TISSUE_STIFFNESS):
        layers[[one, other], place] = layers[[other, one], place]
    layers[[one, other], RESTING_SURFACE] = np.maximum(surfaces[::-1] - layers[[one, other], TOP], 0.0)
    return x


def _with_equal_springs(unknowns: LayeredParameters, x: np.ndarray, one: int, other: int) -> np.ndarray:
    """The vector with the mean stiffness and friction in two layers, whose surfaces come to rest at their tops."""
    x = x.copy()
    layers = x[: unknowns.relaxing].reshape(unknowns.layers, PER_LAYER)  # a view
    stiffness = np.exp(layers[[one, other], TISSUE_STIFFNESS])
    ratio = (stiffness @ logistic(layers[[one, other], FRICTION_RATIO])) / stiffness.sum()
    layers[[one, other], TISSUE_STIFFNESS] = np.log(stiffness.mean())
    layers[[one, other], FRICTION_RATIO] = np.log(ratio / (1.0 - ratio))
    layers[[one, other], RESTING_SURFACE] = 0.0
    return x


def indentations(unknowns: LayeredParameters, x: np.ndarray) -> np.ndarray:
    """Mean indentations (layers,) [m] at the ruptures."""
    tops = x[: unknowns.relaxing].reshape(unknowns.layers, PER_LAYER)[:, TOP]
    return MM * np.maximum(unknowns.punctures(x).mean(axis=0) - tops, MIN_INDENTATION_MM)


def with_saturation(unknowns: LayeredParameters, x: np.ndarray, layer: int, depth: float) -> np.ndarray:
    """The vector with another logarithm of a saturation ``depth``, and the same force of the contact at its rupture."""
    x, first, reached = x.copy(), PER_LAYER * layer, indentations(unknowns, x)[layer]
    before, after = (min(np.exp(value) / reached, 1.0) for value in (x[first + SATURATION], depth))
    x[first + COEFFICIENT] += np.log(before * (2.0 - before)) - np.log(after * (2.0 - after))
    x[first + SATURATION] = depth
    return x


def again(solved: Solved, x: np.ndarray, **changes: Any) -> Solved:
    """A fit from ``x`` with changed fields of the problem, such as ``unknowns`` or ``cycles``."""
    problem = replace(solved.problem, **changes)
    x, cost = problem.settled(x, FINAL_STEPS)
    return Solved(problem, problem.unknowns.in_order(x), cost)


def refined(solved: Solved, cycles: tuple[BinnedCycle, ...], between: tuple[BinnedCycle, ...] = ()) -> Solved:
    """The same fit to the same runs in shorter bins, with the time constants of relaxation by the whole cycle: a hold
    shows no longer times than itself, and wrong ones change the values of every layer. Where it ends near the noise but
    above it, the search was in a minimum of its long bins: other mechanisms are tried in those ``between``."""
    unknowns = solved.problem.unknowns
    constants = {unknowns.constants, unknowns.constants + 1}
    if unknowns.relaxing not in unknowns.held and any(at_rest(cycle).sum() >= MIN_BINS for cycle in cycles):
        unknowns = replace(unknowns, held=unknowns.held - constants)
    found = again(solved, solved.x, cycles=cycles, unknowns=unknowns)
    if not (between and found.near_the_noise):
        return found
    problem = replace(found.problem, cycles=between)
    x, _ = _with_other_mechanisms(problem, *problem.solve(found.x, FINAL_STEPS))
    return min(found, again(found, x), key=lambda each: each.cost)


def at_runs(solved: Solved, runs: list[int]) -> np.ndarray:
    """The vector of a fit for some of its ``runs`` alone."""
    unknowns = solved.problem.unknowns
    return np.concatenate([solved.x[: unknowns.shared], unknowns.punctures(solved.x)[runs].ravel()])


def population_fit(solved: Solved) -> Solved:
    """The fit with one puncture depth for all runs: the rupture depth of a new insertion is unknown, and a rupture that
    extends over the scatter between repeats predicts its force better than a sharp one at the mean depth."""
    unknowns, x = solved.problem.unknowns, solved.x.copy()
    x[unknowns.shared :] = np.tile(unknowns.punctures(x).mean(axis=0), unknowns.runs)
    problem = replace(solved.problem, ridge=TIED_RIDGE)
    x, cost = problem.solve(x, FINAL_STEPS)
    return Solved(problem, unknowns.in_order(x), cost)


def made_passive(
    solved: Iterable[Solved], layers: int, form: str = "passive", cycles: tuple[BinnedCycle, ...] | None = None
) -> Iterator[Solved]:
    """Fits with 1, 2, … ``layers`` layers in a passive form, to ``cycles`` if given, started at those in the form as
    fitted and, as those, without; from one layer less alone where that leaves nothing to explain."""
    upwards: list[Solved] = []
    for fitted in solved:
        problem = replace(fitted.problem, form=form, cycles=cycles or fitted.problem.cycles)
        starts = [*_stiffer(fitted), *first_starts(problem, on_all_cores)]
        if problem.unknowns.layers < 3:
            starts += typical_starts(problem.cycles, problem.unknowns)
        if upwards:
            # without this start, one layer more might fit worse in this form
            starts += grown_starts(problem.cycles, upwards[-1].problem.unknowns, upwards[-1].x)
        upwards.append(best(problem, starts))
        if upwards[-1].explained:
            break
    while len(upwards) < layers:
        upwards.append(_one_layer_more(upwards[-1]))
    yield from _downwards(upwards)


def _downwards(upwards: list[Solved]) -> Iterator[Solved]:
    """The fits with 1, 2, … layers, or those that one layer more without one of its layers leads to, if better."""
    kept = upwards[-1:]
    for fewer in reversed(upwards[:-1]):
        found = fewer if fewer.explained else best(fewer.problem, _without_a_layer(kept[0]))
        less, more = min(found, fewer, key=lambda each: each.cost), kept[0]
        if less.cost < more.cost:  # the fit with one layer more has missed this one
            starts = grown_starts(more.problem.cycles, less.problem.unknowns, less.x)
            kept[0] = min(more, best(more.problem, starts), key=lambda each: each.cost)
        kept.insert(0, less)
    yield from kept


def _without_a_layer(solved: Solved) -> Iterator[np.ndarray]:
    """The vector of a fit without each of its layers in turn."""
    unknowns, x = solved.problem.unknowns, solved.x
    shared = x[: unknowns.relaxing].reshape(unknowns.layers, PER_LAYER)
    for layer in range(unknowns.layers):
        own = np.delete(unknowns.punctures(x), layer, axis=1)
        left = np.delete(shared, layer, axis=0)
        yield np.concatenate([left.ravel(), x[unknowns.relaxing : unknowns.shared], own.ravel()])


def _stiffer(solved: Solved) -> Iterator[np.ndarray]:
    """The parameters of the other form, and stiffer ones: at a rupture the spring of the passive form carries less."""
    for contact, spring in STIFFER_STARTS:
        x, layers = solved.x.copy(), PER_LAYER * np.arange(solved.problem.unknowns.layers)
        x[layers + COEFFICIENT] += contact
        x[layers + TISSUE_STIFFNESS] += spring
        x[layers + FRICTION_RATIO] -= spring
        yield x
