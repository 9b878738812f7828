# SPDX-License-Identifier: Apache-2.0
"""The search layer by layer over starting values, which come from the events, never from the user."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from .binned_cycle import BinnedCycle
from .parameters import COEFFICIENT, GRIP, MM, PER_LAYER, SATURATION, STIFFNESS, TOP, LayeredParameters
from .problem import TIED, Problem

QUICK, LONG = 15, 100  # evaluations of a screening, and of what is kept
KEPT = 2
TIMES = (0.13, 1.0)  # of the hold: 0.7 s and 5 s for a hold of 5 s; how it fades over longer times no hold can tell
STIFFER = ((0.0, 0.0), (0.7, 0.0), (0.7, 0.7))  # logarithms of c and k_t
FASTER = 1.3  # ratio of speeds that can tell how forces depend on speed
NO_HOLD = 5.0  # [s] stands for the hold where there is none
LIKE_TISSUE = (0.0, 0.0, 0.0, 0.2, 5.5, -7.8, 2.0)
"""Grip ratio, stiffness of 250 N/m, rupture within 0.4 mm, a dimple of 2 mm; the contact is set by the forces."""
SMALL = (7.6, -6.9, 0.0, 0.0, 4.6, -7.6, 1.0)
"""A weak layer, to be added: c = 2 kN/m^2, h_s = 1 mm, k_t = 100 N/m."""
COMMON = (0.2, 0.0, 0.0)
"""Half fades, half of it sooner; forces do not depend on speed."""
BEYOND = 1.0  # [mm] past the deepest point: a layer that does not give way
APART = 1.0  # [mm] between a layer's top and its puncture, at least
TOPS = (0.35, 0.7, 1.0)  # of the way from contact to the first puncture, where a second layer may begin
ADDED = 4  # places of a further layer


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


def grow(cycles: tuple[BinnedCycle, ...], most: int) -> Iterator[Solved]:
    """Fits with 1, 2, … ``most`` layers in the form fitted to recordings, each from cold and from the one before."""
    rests = [cycle.rest for cycle in cycles if cycle.rest > 0.0]
    rest = float(np.median(rests)) if rests else NO_HOLD
    speeds, before = [cycle.speed for cycle in cycles], None
    typical = float(np.exp(np.mean(np.log(speeds))))
    for layers in range(1, most + 1):
        unknowns = LayeredParameters(layers, len(cycles), (TIMES[0] * rest, TIMES[1] * rest))
        if max(speeds) < FASTER * min(speeds):
            unknowns = replace(unknowns, held=frozenset({unknowns.speed}))
        starts = list(first_starts(cycles, unknowns)) if layers < 3 else []
        if before is not None:
            starts += grown_starts(cycles, before.problem.unknowns, before.x)
        before = best(Problem(cycles, unknowns, passive=False, speed=typical), starts)
        yield before


def best(problem: Problem, starts: Iterable[np.ndarray]) -> Solved:
    """The best of several starts: all briefly, the first few to the end, punctures scanned between."""
    screened = sorted((problem.solve(x, QUICK) for x in starts), key=lambda found: found[1])
    x, cost = min((problem.settled(x, LONG) for x, _ in screened[:KEPT]), key=lambda found: found[1])
    return Solved(problem, problem.unknowns.in_order(x), cost)


def again(solved: Solved, x: np.ndarray, **changes) -> Solved:
    """A fit from ``x`` with something changed, such as ``unknowns`` or ``cycles``."""
    problem = replace(solved.problem, **changes)
    x, cost = problem.settled(x, LONG)
    return Solved(problem, problem.unknowns.in_order(x), cost)


def refined(solved: Solved, cycles: tuple[BinnedCycle, ...]) -> Solved:
    """The same fit to the same runs in shorter bins."""
    return again(solved, solved.x, cycles=cycles)


def of_the_population(solved: Solved) -> Solved:
    """The law that one puncture depth for all runs fits best: where a new insertion gives way is not known, and a
    rupture spread over the scatter between repeats foretells its force better than a sharp one at the mean depth."""
    unknowns, x = solved.problem.unknowns, solved.x.copy()
    x[unknowns.shared :] = np.tile(unknowns.punctures(x).mean(axis=0), unknowns.runs)
    problem = replace(solved.problem, ridge=TIED)
    x, cost = problem.solve(x, LONG)
    return Solved(problem, unknowns.in_order(x), cost)


def made_passive(solved: Iterable[Solved]) -> Iterator[Solved]:
    """Fits with 1, 2, … layers in the passive form, from those in the other form."""
    before = None
    for fitted in solved:
        problem = replace(fitted.problem, passive=True)
        found = [best(problem, _stiffer(fitted))]
        if before is not None:
            # else one layer more may fit worse: what the other form's third layer is for, this one need not lack
            found.append(best(problem, grown_starts(problem.cycles, before.problem.unknowns, before.x)))
        before = min(found, key=lambda each: each.cost)
        yield before


def _stiffer(solved: Solved) -> Iterator[np.ndarray]:
    """The numbers of the other form, and stiffer ones: the passive form's spring takes over less at a rupture."""
    for contact, spring in STIFFER:
        x, layers = solved.x.copy(), PER_LAYER * np.arange(solved.problem.unknowns.layers)
        x[layers + COEFFICIENT] += contact
        x[layers + STIFFNESS] += spring
        x[layers + GRIP] -= spring
        yield x


def first_starts(cycles: tuple[BinnedCycle, ...], unknowns: LayeredParameters) -> Iterator[np.ndarray]:
    """Vectors for one or two layers."""
    contact = np.median([cycle.contact for cycle in cycles]) / MM
    deepest = np.median([cycle.deepest for cycle in cycles]) / MM
    first = _seen(cycles, 0.0, deepest + BEYOND)
    if unknowns.layers == 1:
        yield _start(cycles, [contact], first[:, None])
        return
    middle = float(np.median(first))
    never = np.full(len(cycles), deepest + BEYOND)
    for share in TOPS:
        for second in (_seen(cycles, middle + APART, 0.5 * (middle + deepest)), never):
            top = min(contact + share * (middle - contact), float(np.median(second)) - APART)
            yield _start(cycles, [contact, top], np.column_stack([first, second]))


def grown_starts(cycles: tuple[BinnedCycle, ...], before: LayeredParameters, x: np.ndarray) -> Iterator[np.ndarray]:
    """The vector ``x`` of a fit with one layer less, with a weak layer added at several places, that gives way or
    does not."""
    shared, common = x[: before.fading], x[before.fading : before.shared]
    deepest = np.median([cycle.deepest for cycle in cycles]) / MM
    highest = shared[TOP::PER_LAYER].min()
    for top in np.linspace(highest + 1.0, deepest - 3.0, ADDED):
        for puncture in sorted({round(deepest + BEYOND, 1), round(min(top + 3.0, deepest + BEYOND), 1)}):
            added = np.array(SMALL)
            added[TOP] = top
            own = np.column_stack([before.punctures(x), np.full(before.runs, puncture)])
            yield np.concatenate([shared, added, common, own.ravel()])


def _start(cycles: tuple[BinnedCycle, ...], tops: list[float], punctures: np.ndarray) -> np.ndarray:
    """The vector of layers like tissue from ``tops`` [mm], that give way at ``punctures`` (runs, layers) [mm]."""
    peak = np.median([cycle.peak for cycle in cycles])
    parts = []
    for layer, top in enumerate(tops):
        indentation = max(float(np.median(punctures[:, layer])) - top, 0.5) * MM
        saturation = min(6e-3, 0.5 * indentation)
        force = peak * (0.8 if layer == 0 else 0.4)
        part = np.array(LIKE_TISSUE)
        part[COEFFICIENT] = np.log(force / (saturation * (2.0 * indentation - saturation)))
        part[SATURATION], part[TOP] = np.log(saturation), top
        part[STIFFNESS] += np.log(peak / 5.0)  # a stiff tissue drags as stiffly as it resists
        parts.append(part)
    return np.concatenate([*parts, COMMON, punctures.ravel()])


def _seen(cycles: tuple[BinnedCycle, ...], least: float, otherwise: float) -> np.ndarray:
    """Each run's first puncture past ``least`` [mm]; the median where it has none, ``otherwise`` where none has."""
    found = [[depth / MM for depth in cycle.punctures if depth / MM > least] for cycle in cycles]
    known = [depths[0] for depths in found if depths]
    middle = float(np.median(known)) if known else otherwise
    return np.array([depths[0] if depths else middle for depths in found])
