# SPDX-License-Identifier: Apache-2.0
"""The best motion of a planning problem: least squares from several starts."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from .base_motion import BaseMotion
from .plan_problem import CLEARANCE, EFFORT, TARGET, PlanProblem

_STEP = 1e-4  # of a derivative, in shares of the limit and radians
_DIRECTIONS = 8  # of the starts where the first ends in front of an obstacle
_ENOUGH = 30  # evaluations of a search
_CLOSE = 2.5 * TARGET  # [m] of a target that is met


@dataclass(frozen=True)
class Search:
    """A motion to begin with, and what is called on progress."""

    before: BaseMotion | None = None
    progress: Callable[[int, float], None] | None = None


def best(problem: PlanProblem, search: Search) -> tuple[PlanProblem, BaseMotion]:
    """The problem with its final depths, and the motion with the lowest cost.

    A start that meets target and obstacles ends the search. If none does, what the motion costs is neglected.
    """
    found: list[tuple[float, PlanProblem, np.ndarray]] = []
    for start in _starts(problem, search.before):
        found.append(_from(problem, start, search))
        if _meets(found[-1][1], found[-1][2]):
            break
    _, solved, sought = min(found, key=lambda each: each[0])
    if not _meets(solved, sought):
        _, solved, sought = _from(replace(solved, effort=1e-3 * EFFORT), sought, search)
    return solved, _within_steps(solved, solved.motion(sought))


def _starts(problem: PlanProblem, before: BaseMotion | None) -> Iterator[np.ndarray]:
    if before is not None:
        yield _numbers_of(problem, before)
    yield problem.start()
    if not (problem.limits.rolls or len(problem.obstacles)):
        return  # nearly linear: one start suffices
    for direction in 2.0 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS:
        yield problem.start(direction, 0.5)


def _numbers_of(problem: PlanProblem, motion: BaseMotion) -> np.ndarray:
    """The sought numbers of a motion, of the rows that are still free."""
    rows = len(motion) - problem.free + problem.knots
    numbers = []
    if problem.limits.moves:
        numbers.append(np.clip(motion.lateral[rows] / problem.limits.max_lateral, -1.0, 1.0).ravel())
    if problem.limits.rolls:
        numbers.append(motion.roll[rows])
    return np.concatenate(numbers)


def _from(problem: PlanProblem, start: np.ndarray, search: Search) -> tuple[float, PlanProblem, np.ndarray]:
    """Cost, problem and numbers at the end of a search; the depth of the last row follows the needle's arc."""
    from scipy.optimize import least_squares

    sought, cost = start, np.inf
    for _ in range(4):
        low, high = problem.bounds()
        sought = np.clip(sought, low + 1e-9, high - 1e-9)
        solution = least_squares(
            _counted(problem, search), sought, lambda x, p=problem: _slopes(p, x), (low, high), max_nfev=_ENOUGH,
            xtol=1e-3, ftol=1e-2, gtol=1e-6,
        )  # fmt: skip
        sought, cost = solution.x, float(solution.cost)
        tip, _ = problem.predicted(problem.motion(sought))
        short = problem.target[2] - tip[-1, 2]
        if abs(short) < 0.5 * TARGET:
            break
        problem = replace(problem, depths=_lengthened(problem, short))
    return cost, problem, sought


def _lengthened(problem: PlanProblem, by: float) -> np.ndarray:
    """The depths of the free rows, stretched so that the last is deeper by a length [m]."""
    done = len(problem.executed)
    begin, ahead = problem.depths[done - 1], problem.depths[done:]
    return np.append(problem.depths[:done], begin + (ahead - begin) * (ahead[-1] + by - begin) / (ahead[-1] - begin))


def _counted(problem: PlanProblem, search: Search) -> Callable[[np.ndarray], np.ndarray]:
    calls = 0

    def residuals(sought: np.ndarray) -> np.ndarray:
        nonlocal calls
        calls += 1
        values = problem.residuals(sought)
        if search.progress:
            search.progress(calls, 0.5 * float(values @ values))
        return values

    return residuals


def _slopes(problem: PlanProblem, sought: np.ndarray) -> np.ndarray:
    if not problem.limits.rolls:
        return _slopes_by_pairs(problem, sought)
    here, columns = problem.residuals(sought), []
    for k, step in enumerate(_steps(problem, sought)):
        aside = sought.copy()
        aside[k] += step
        columns.append((problem.residuals(aside) - here) / step)
    return np.column_stack(columns)


def _slopes_by_pairs(problem: PlanProblem, sought: np.ndarray) -> np.ndarray:
    """Both coordinates of a knot with one simulation: what motion along x does along y, where tissue yields, is
    neglected in the slopes of the search, not in what is found."""
    steps, columns = _steps(problem, sought), []
    tip, simulated = problem.predicted(problem.motion(sought))
    here = problem.residuals_of(sought, tip, simulated)
    for k in range(0, len(sought), 2):
        both = sought.copy()
        both[k : k + 2] += steps[k : k + 2]
        moved, other = problem.predicted(problem.motion(both))
        for across in (0, 1):
            aside, mixed = sought.copy(), tip.copy()
            aside[k + across] += steps[k + across]
            mixed[:, across] = moved[:, across]
            wrench = simulated.wrench.copy()
            wrench[:, [across, 4 - across]] = other.wrench[:, [across, 4 - across]]
            residuals = problem.residuals_of(aside, mixed, replace(simulated, wrench=wrench))
            columns.append((residuals - here) / steps[k + across])
    return np.column_stack(columns)


def _steps(problem: PlanProblem, sought: np.ndarray) -> np.ndarray:
    return np.where(sought + _STEP < problem.bounds()[1], _STEP, -_STEP)


def _meets(problem: PlanProblem, sought: np.ndarray) -> bool:
    tip, _ = problem.predicted(problem.motion(sought))
    near = np.linalg.norm(tip[-1] - problem.target) < _CLOSE
    return bool(near and problem.distances(tip).min() >= problem.clearance - 0.1 * CLEARANCE)


def _within_steps(problem: PlanProblem, motion: BaseMotion) -> BaseMotion:
    """The motion with steps across that keep their limit exactly."""
    lateral, limit = motion.lateral.copy(), problem.limits.max_lateral_step
    for row in range(len(problem.executed), len(lateral)):
        lateral[row] = lateral[row - 1] + np.clip(lateral[row] - lateral[row - 1], -limit, limit)
    return BaseMotion(motion.depth, lateral, motion.roll)
