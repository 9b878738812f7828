# SPDX-License-Identifier: Apache-2.0
"""How well the numbers of a layered fit are known: intervals, correlations, draws."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...display.quantities import counted
from ..estimates import Correlations, Estimate, student
from ..statistics.noise import Z_95, noise_of
from .model_selection import ENOUGH
from .parameters import PER_LAYER, RUPTURE, SATURATION, SHARES, by_unknowns, positive, prefix, units, values
from .search import Solved

UNFELT = 1e-9  # of the median: no run tells of a number that its residuals feel less
MOST_FACTOR = 3.0  # a positive number that may be so much larger is not told
DERIVED = ("contact_stiffness", "puncture_indentation")
FARTHEST, HOPELESS = 300.0, 7.0  # logarithms: what is known to a factor of a thousand is not known


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Of the named numbers (p,): ``value``, and ``within`` (p, p), their covariance from the noise within the runs,
    neighbours that are alike counting as one; ``moves`` (runs, p) by which each run, left out, moves them, less the
    mean.

    The moves are one Gauss-Newton step each: the force jumps at ruptures, where a search would come to rest. What no
    run feels has an infinite variance. ``reach`` [m] is the travel, ``held`` are the names of what was not
    sought.
    """

    units: dict[str, str]
    value: np.ndarray
    within: np.ndarray
    moves: np.ndarray
    reach: float
    held: frozenset[str]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the p numbers."""
        return tuple(self.units)

    @property
    def runs(self) -> int:
        """How many repeats there are."""
        return len(self.moves)

    @property
    def within_sd(self) -> np.ndarray:
        """Standard errors (p,) from the noise within the runs."""
        return np.sqrt(np.maximum(self.within.diagonal(), 0.0))

    @property
    def between_sd(self) -> np.ndarray:
        """Scatter (p,) between repeats, by the jackknife: what one repeat tells of a number strays by so much."""
        return np.sqrt((self.runs - 1) * (self.moves**2).sum(axis=0))

    @cached_property
    def half(self) -> np.ndarray:
        """Half widths (p,) of 95 % intervals: Student's on the scatter between repeats, never below the error within
        runs; that alone with fewer than three repeats."""
        within = Z_95 * self.within_sd
        if self.runs < ENOUGH:
            return within
        return np.fmax(within, student(self.runs) * self.between_sd / np.sqrt(self.runs))

    def estimates(self) -> dict[str, Estimate]:
        """Every number with its interval; one that is positive has it by its logarithm."""
        enough, source = self.runs >= ENOUGH, f"layered fit, {counted(self.runs, 'recording')}"
        source += ", jackknife over repeats" if enough else ""
        made = {}
        for k, (name, unit) in enumerate(self.units.items()):
            value, half, above_zero = float(self.value[k]), float(self.half[k]), bool(positive([name])[0])
            low, high = _limits(value, half, above_zero)
            told = high < MOST_FACTOR * value if above_zero else half < (self.reach if unit == "m" else 1.0)
            told = told and name not in self.held
            scatter = (float(self.between_sd[k]), float(self.within_sd[k])) if enough else (None, None)
            made[name] = Estimate(name, value, unit, low, high, scatter[0], bool(told), source, scatter[1])
        return made

    def correlations(self) -> Correlations:
        """What the runs cannot tell apart: correlations of the errors within them, of what is not made of the rest."""
        made = np.array([name.endswith(DERIVED) for name in self.names])
        known = np.flatnonzero(np.isfinite(self.within_sd) & (self.within_sd > 0.0) & ~made)
        sd = self.within_sd[known]
        relative = np.divide(
            sd, np.abs(self.value[known]), out=np.full(len(sd), np.nan), where=self.value[known] != 0.0
        )
        matrix = self.within[np.ix_(known, known)] / np.outer(sd, sd)
        return Correlations(tuple(self.names[k] for k in known), matrix, relative)

    def draws(self, count: int, random: np.random.Generator) -> dict[str, np.ndarray]:
        """Draws (count,) of each number that has an interval: normal within runs, Student's with the scatter between
        three repeats or more, in the correlations of both; their 95 % are the intervals."""
        known = np.flatnonzero(np.isfinite(self.half))
        both = self.within[np.ix_(known, known)] + (self.moves.T @ self.moves)[np.ix_(known, known)]
        sd = np.sqrt(np.maximum(both.diagonal(), 1e-300))
        place, ends = np.linalg.eigh(both / np.outer(sd, sd))
        normal = random.standard_normal((count, len(known))) * np.sqrt(np.maximum(place, 0.0)) @ ends.T
        if self.runs >= ENOUGH:
            freedom, scale = self.runs - 1, student(self.runs)
            normal *= np.sqrt(freedom / random.chisquare(freedom, count))[:, None]
        else:
            scale = Z_95
        moved = normal / scale * self.half[known]
        found = {}
        for column, k in enumerate(known):
            value, above_zero = self.value[k], positive([self.names[k]])[0]
            grows = above_zero and value > 0.0
            far = moved[:, column]
            found[self.names[k]] = value * np.exp(np.clip(far / value, -FARTHEST, FARTHEST)) if grows else value + far
        return found


def uncertainty_of(solved: Solved) -> Uncertainty:
    """The uncertainty of the parameters of a fit."""
    problem, size = solved.problem, solved.problem.unknowns.size
    grams, slopes, longs = [], [], []
    for run, cycle in enumerate(problem.cycles):
        places, jacobian = problem.jacobian(run, solved.x)
        residual, gram, slope = problem.residuals(run, solved.x), np.zeros((size, size)), np.zeros(size)
        gram[np.ix_(places, places)], slope[places] = jacobian.T @ jacobian, jacobian.T @ residual
        grams, slopes = [*grams, gram], [*slopes, slope]
        longs.append(noise_of(residual, len(cycle.depth)).long_run)
    whole, by = sum(grams), by_unknowns(solved.problem.unknowns, solved.x)
    felt = whole.diagonal() > UNFELT * np.median(whole.diagonal()[problem.unknowns.free])
    bread = by @ _inverse(whole, felt)
    within = bread @ sum(long * gram for long, gram in zip(longs, grams)) @ bread.T
    sought = np.isin(np.arange(size), problem.unknowns.free)
    unfelt = np.abs(by[:, ~felt & sought]).max(axis=1, initial=0.0) > 0.0
    within[unfelt, unfelt] = np.inf
    named = units(problem.unknowns.layers, problem.unknowns.speed not in problem.unknowns.held)
    reach = max(float(np.ptp(cycle.depth)) for cycle in problem.cycles)
    return Uncertainty(
        named,
        values(solved.problem.unknowns, solved.x),
        within,
        _moves(solved, by, grams, slopes, felt),
        reach,
        _held(solved),
    )


def _held(solved: Solved) -> frozenset[str]:
    """Names of numbers that were held to take a mechanism away."""
    unknowns = solved.problem.unknowns
    names = {SATURATION: "saturation_depth", RUPTURE: "rupture_length"}
    own = {prefix(k // PER_LAYER) + names[k % PER_LAYER] for k in unknowns.held if k < unknowns.fading}
    return frozenset(own | (set(SHARES) if unknowns.fading in unknowns.held else set()))


def _moves(solved: Solved, by: np.ndarray, grams: list, slopes: list, felt: np.ndarray) -> np.ndarray:
    """By how much each run, left out, moves the numbers, less the mean."""
    if len(grams) < ENOUGH:
        return np.zeros((len(grams), len(by)))
    whole, slope, own = sum(grams), sum(slopes), values(solved.problem.unknowns, solved.x)
    steps = [-_inverse(whole - gram, felt) @ (slope - part) for gram, part in zip(grams, slopes)]
    moves = np.array(
        [by @ step + values(solved.problem.unknowns, solved.x, but) - own for but, step in enumerate(steps)]
    )
    return moves - moves.mean(axis=0)


def _inverse(gram: np.ndarray, felt: np.ndarray) -> np.ndarray:
    """Inverse of J'J (size, size), zero for what is not felt; scaled, directions without data left away."""
    part = felt & (gram.diagonal() > 0.0)
    scale = 1.0 / np.sqrt(gram.diagonal()[part])
    found = np.zeros_like(gram)
    inner = np.linalg.pinv(gram[np.ix_(part, part)] * np.outer(scale, scale), rcond=1e-10, hermitian=True)
    found[np.ix_(part, part)] = inner * np.outer(scale, scale)
    return found


def _limits(value: float, half: float, above_zero: bool) -> tuple[float, float]:
    """Limits of a number; of one that is positive by its logarithm."""
    if not np.isfinite(half):
        return (0.0 if above_zero else -np.inf), np.inf
    if not above_zero or value <= 0.0:
        return value - half, value + half
    factor = float(np.exp(half / value)) if half < HOPELESS * value else np.inf
    return value / factor, value * factor
