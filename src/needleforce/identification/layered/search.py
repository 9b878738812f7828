# SPDX-License-Identifier: Apache-2.0
"""The search over starts, layer by layer."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from .binned_cycle import Course
from .parameters import COEFFICIENT, GRIP, PER_LAYER, STIFFNESS, Unknowns
from .problem import TIED, Problem
from .starts import first_starts, grown_starts

QUICK, LONG = 15, 100  # evaluations of a screening, and of what is kept
KEPT = 2
TIMES = (0.13, 1.0)  # of the hold: 0.7 s and 5 s for a hold of 5 s; how it fades over longer times no hold can tell
STIFFER = ((0.0, 0.0), (0.7, 0.0), (0.7, 0.7))  # logarithms of c and k_t
FASTER = 1.3  # ratio of speeds that can tell how forces depend on speed
NO_HOLD = 5.0  # [s] stands for the hold where there is none


@dataclass(frozen=True, eq=False)
class Solved:
    """A problem with its best vector; ``cost`` is half the sum of squares."""

    problem: Problem
    x: np.ndarray
    cost: float

    @property
    def residual(self) -> float:
        """Rms over the runs of the residual over the peak."""
        return float(np.sqrt(2.0 * self.cost / len(self.problem.courses)))


def grow(courses: tuple[Course, ...], most: int) -> Iterator[Solved]:
    """Fits with 1, 2, … ``most`` layers in the form fitted to recordings, each from cold and from the one before."""
    rests = [course.rest for course in courses if course.rest > 0.0]
    rest = float(np.median(rests)) if rests else NO_HOLD
    speeds, before = [course.speed for course in courses], None
    typical = float(np.exp(np.mean(np.log(speeds))))
    for layers in range(1, most + 1):
        unknowns = Unknowns(layers, len(courses), (TIMES[0] * rest, TIMES[1] * rest))
        if max(speeds) < FASTER * min(speeds):
            unknowns = replace(unknowns, held=frozenset({unknowns.speed}))
        starts = list(first_starts(courses, unknowns)) if layers < 3 else []
        if before is not None:
            starts += grown_starts(courses, before.problem.unknowns, before.x)
        before = best(Problem(courses, unknowns, passive=False, speed=typical), starts)
        yield before


def best(problem: Problem, starts: Iterable[np.ndarray]) -> Solved:
    """The best of several starts: all briefly, the first few to the end, punctures scanned between."""
    screened = sorted((problem.solve(x, QUICK) for x in starts), key=lambda found: found[1])
    x, cost = min((problem.settled(x, LONG) for x, _ in screened[:KEPT]), key=lambda found: found[1])
    return Solved(problem, problem.unknowns.in_order(x), cost)


def again(solved: Solved, x: np.ndarray, **changes) -> Solved:
    """A fit from ``x`` with something changed, such as ``unknowns`` or ``courses``."""
    problem = replace(solved.problem, **changes)
    x, cost = problem.settled(x, LONG)
    return Solved(problem, problem.unknowns.in_order(x), cost)


def refined(solved: Solved, courses: tuple[Course, ...]) -> Solved:
    """The same fit to the same runs in shorter bins."""
    return again(solved, solved.x, courses=courses)


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
            found.append(best(problem, grown_starts(problem.courses, before.problem.unknowns, before.x)))
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
