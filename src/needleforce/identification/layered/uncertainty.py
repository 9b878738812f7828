# SPDX-License-Identifier: Apache-2.0
"""Uncertainty of the parameters of a layered fit: intervals, correlations, draws."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ...display.quantities import counted
from ...vocabulary import SMALLEST
from ..estimates import Correlations, Estimate
from ..statistics.noise import TWO_SIDED, noise_of, student_quantile
from .model_selection import MIN_REPEATS
from .parameters import (
    COEFFICIENT,
    FRICTION_RATIO,
    PER_LAYER,
    RESTING_SURFACE,
    RUPTURE_LENGTH,
    SATURATION,
    SHARES,
    TISSUE_STIFFNESS,
    LayerRow,
    by_unknowns,
    positive,
    prefix,
    units,
    values,
)
from .search import Solved

MIN_SENSITIVITY = 1e-9  # [of the median of the diagonal of J'J] below, no run informs about a parameter
MAX_FACTOR = 3.0  # upper limit over value, beyond which a positive parameter is not identifiable
MAX_DEPTH_SHARE = 0.5  # [of the indentation at the rupture] a depth with a larger half width is not known
MAX_EXPONENT_HALF = 1.0
NAMES = {
    COEFFICIENT: "stiffness_coefficient",
    SATURATION: "saturation_depth",
    FRICTION_RATIO: "friction_per_length",
    TISSUE_STIFFNESS: "tissue_stiffness",
    RUPTURE_LENGTH: "rupture_length",
    RESTING_SURFACE: "resting_surface",
}
OF_A_RUPTURE = ("friction_per_length", "tissue_stiffness", "rupture_length", "resting_surface", "puncture_indentation")
WHERE = ("contact_depth", "top", "puncture_depth")
DERIVED = ("contact_stiffness", "puncture_indentation")
MAX_LOG, MAX_LOG_HALF = 300.0, 7.0  # of draws; of a half width: more than a factor of 1000 is no interval


@dataclass(frozen=True, eq=False, kw_only=True)
class Uncertainty:
    """Uncertainty of the named parameters (p,).

    Attributes
    ----------
    units : dict of str to str
        SI unit of each parameter by name.
    value : numpy.ndarray
        Values (p,).
    within : numpy.ndarray
        Covariance (p, p) from the noise within the runs, correlated samples counted as one; infinite for a parameter
        on which no run depends.
    moves : numpy.ndarray
        Changes (runs, p) of the values if each run is left out, minus their mean (jackknife). Each is one Gauss-Newton
        step, as a new search could stop at the jump of the force at a rupture.
    travel : float
        Travel of the needle [m].
    deepest : float
        Largest depth [m] of the runs: a layer with a deeper rupture did not rupture.
    absent : frozenset of str
        Names of parameters that are not in the model: a contact that does not saturate, tissue that does not relax.
    limited : frozenset of str
        Names of parameters at a limit of the search, whose intervals have no meaning.
    undecided : frozenset of str
        Names of saturation depths without which the fit is about as good: their intervals have no upper end.
    for_unit_noise : numpy.ndarray
        Variances (p,) that uncorrelated residuals of variance 1 would give.
    by_prior : numpy.ndarray or float
        Part (p,) of the standard errors that stems from what was known beforehand; it is in ``within`` too.
    known : dict of str to str
        What was known beforehand, in words, by the names of the parameters.
    """

    units: dict[str, str]
    value: np.ndarray
    within: np.ndarray
    moves: np.ndarray
    travel: float
    deepest: float = np.inf
    absent: frozenset[str] = frozenset()
    limited: frozenset[str] = frozenset()
    undecided: frozenset[str] = frozenset()
    for_unit_noise: np.ndarray | float = np.nan
    by_prior: np.ndarray | float = 0.0
    known: dict[str, str] = field(default_factory=dict)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the p parameters."""
        return tuple(self.units)

    @property
    def runs(self) -> int:
        """Number of repeats."""
        return len(self.moves)

    @property
    def within_sd(self) -> np.ndarray:
        """Standard errors (p,) from the noise within the runs."""
        return np.sqrt(np.maximum(self.within.diagonal(), 0.0))

    @property
    def between_sd(self) -> np.ndarray:
        """Standard deviation (p,) between the values of single repeats, by the jackknife."""
        return np.sqrt((self.runs - 1) * (self.moves**2).sum(axis=0))

    @cached_property
    def half(self) -> np.ndarray:
        """Half widths (p,) of the intervals: Student's on the scatter between repeats, not less than from the error
        within runs; with fewer than three repeats from the error within runs. The scatter does not contain the error of
        what was known beforehand, which is the same in all repeats."""
        within = TWO_SIDED * self.within_sd
        if self.runs < MIN_REPEATS:
            return within
        return np.fmax(within, np.hypot(self._scatter, TWO_SIDED * self.by_prior))

    @cached_property
    def random_half(self) -> np.ndarray:
        """Half widths (p,) without the error of what was known beforehand."""
        within = TWO_SIDED * np.sqrt(np.maximum(self.within_sd**2 - np.square(self.by_prior), 0.0))
        return within if self.runs < MIN_REPEATS else np.fmax(within, self._scatter)

    @property
    def _scatter(self) -> np.ndarray:
        """Half widths (p,) of Student's intervals on the scatter between repeats."""
        return student_quantile(self.runs - 1) * self.between_sd / np.sqrt(self.runs)

    def _indentation(self, name: str) -> float:
        """Indentation [m] at the rupture of the layer to which a parameter belongs, within the travel."""
        found = name.split("_")[1] if name.startswith("layer_") else "1"
        value = self.value[self.names.index(prefix(int(found) - 1) + "puncture_indentation")]
        return min(float(value), self.travel)

    @cached_property
    def undetermined(self) -> tuple[str, ...]:
        """Names of the parameters in the model that the recordings leave open: a positive one between nothing and
        infinity, or a depth over more than the travel. Where layers begin and rupture, they always state."""
        return tuple(
            name
            for k, (name, unit) in enumerate(self.units.items())
            if name not in self.absent
            and not name.endswith(WHERE)
            and (
                self.half[k] >= MAX_LOG_HALF * self.value[k]
                if positive([name])[0]
                else self.half[k] > (self.travel if unit == "m" else np.inf)
            )
        )

    def estimates(self) -> dict[str, Estimate]:
        """Every parameter that is determined, with its interval; a positive one has an interval of its logarithm."""
        enough, source = self.runs >= MIN_REPEATS, f"layered fit, {counted(self.runs, 'recording')}"
        source += ", jackknife over repeats" if enough else ""
        made = {}
        for k, (name, unit) in enumerate(self.units.items()):
            if name in self.absent or name in self.undetermined:
                continue
            value, half, above_zero = float(self.value[k]), float(self.half[k]), bool(positive([name])[0])
            low, high = _limits(value, half, above_zero)
            if name.endswith("puncture_depth") and value > self.deepest:
                low, high = self.deepest, np.inf
            by_noise = _limits(value, min(float(self.random_half[k]), half), above_zero)
            systematic = (by_noise[0] - low, high - by_noise[1]) if np.isfinite(half) else (0.0, 0.0)
            high = np.inf if name in self.undecided else high
            within = MAX_DEPTH_SHARE * self._indentation(name) if unit == "m" else MAX_EXPONENT_HALF
            identifiable = high < MAX_FACTOR * value if above_zero else 0.5 * (high - low) < within
            if name.endswith("saturation_depth"):  # a contact that may not saturate before its rupture shows no depth
                identifiable = identifiable and high < self._indentation(name)
            made[name] = Estimate(
                name,
                value,
                unit,
                low,
                high,
                between_repeats_sd=float(self.between_sd[k]) if enough else None,
                identifiable=bool(identifiable and name not in self.limited),
                source=f"{source}, with {self.known[name]}" if name in self.known else source,
                within_run_sd=float(self.within_sd[k]) if enough else None,
                systematic=tuple(float(max(part, 0.0)) if np.isfinite(part) else 0.0 for part in systematic),
            )
        return made

    def correlations(self) -> Correlations:
        """Correlations of the errors within the runs, without the derived parameters."""
        made = np.array([name.endswith(DERIVED) for name in self.names])
        known = np.flatnonzero(np.isfinite(self.within_sd) & (self.within_sd > 0.0) & ~made)
        sd = self.within_sd[known]
        relative = np.divide(
            sd, np.abs(self.value[known]), out=np.full(len(sd), np.nan), where=self.value[known] != 0.0
        )
        matrix = self.within[np.ix_(known, known)] / np.outer(sd, sd)
        return Correlations(tuple(self.names[k] for k in known), matrix, relative)

    def draws(self, count: int, random: np.random.Generator) -> dict[str, np.ndarray]:
        """Draws (count,) of each parameter with an interval: normal within runs, Student's with the scatter between
        three repeats or more, with the correlations of both; their quantiles are the limits of the intervals."""
        known = np.flatnonzero(np.isfinite(self.half))
        both = self.within[np.ix_(known, known)] + (self.moves.T @ self.moves)[np.ix_(known, known)]
        sd = np.sqrt(np.maximum(both.diagonal(), SMALLEST))
        place, ends = np.linalg.eigh(both / np.outer(sd, sd))
        normal = random.standard_normal((count, len(known))) * np.sqrt(np.maximum(place, 0.0)) @ ends.T
        if self.runs >= MIN_REPEATS:
            freedom, scale = self.runs - 1, student_quantile(self.runs - 1)
            normal *= np.sqrt(freedom / random.chisquare(freedom, count))[:, None]
        else:
            scale = TWO_SIDED
        moved = normal / scale * self.half[known]
        found = {}
        for column, k in enumerate(known):
            value, above_zero = self.value[k], positive([self.names[k]])[0]
            change = moved[:, column]
            if above_zero and value > 0.0:
                found[self.names[k]] = value * np.exp(np.clip(change / value, -MAX_LOG, MAX_LOG))
            else:
                found[self.names[k]] = value + change
        return found


def uncertainty_of(solved: Solved) -> Uncertainty:
    """The uncertainty of the parameters of a fit. A value known beforehand is one more measurement with its own noise:
    it adds to J'J, and by its own error to the covariance."""
    problem, size = solved.problem, solved.problem.unknowns.size
    grams, slopes, longs, zeros = [], [], [], []
    for run, cycle in enumerate(problem.cycles):
        places, jacobian = problem.jacobian(run, solved.x)
        residual, gram, slope = problem.residuals(run, solved.x), np.zeros((size, size)), np.zeros(size)
        if not cycle.zero.known:  # a parameter of the fit
            jacobian = jacobian - np.outer(cycle.zero_column, cycle.zero_column @ jacobian)
            residual = residual - cycle.zero_column * (cycle.zero_column @ residual)
        gram[np.ix_(places, places)], slope[places] = jacobian.T @ jacobian, jacobian.T @ residual
        grams, slopes = [*grams, gram], [*slopes, slope]
        moved = np.zeros(size)
        moved[places] = jacobian.T @ cycle.weight * (cycle.zero.error if cycle.zero.known else 0.0)
        zeros.append(np.outer(moved, moved))
        longs.append(noise_of(residual, len(cycle.depth)).long_run)
    prior, by_error, pull = _of_priors(solved)
    total, by = sum(grams) + prior, by_unknowns(solved.problem.unknowns, solved.x)
    known = total.diagonal() > MIN_SENSITIVITY * np.median(total.diagonal()[problem.unknowns.free])
    bread = by @ _inverse(total, known)
    within = bread @ (sum(long * gram for long, gram in zip(longs, grams)) + sum(zeros) + by_error) @ bread.T
    fitted = np.isin(np.arange(size), problem.unknowns.free)
    unknown = np.abs(by[:, ~known & fitted]).max(axis=1, initial=0.0) > 0.0
    within[unknown, unknown] = np.inf
    named = units(problem.unknowns)
    return Uncertainty(
        units=named,
        value=values(solved.problem.unknowns, solved.x),
        within=within,
        moves=_moves(solved, by, (grams, slopes), (total, sum(slopes) + pull), known),
        travel=max(float(np.ptp(cycle.depth)) for cycle in problem.cycles),
        deepest=max(cycle.deepest for cycle in problem.cycles),
        absent=absent(solved),
        limited=_limited(solved),
        for_unit_noise=(bread * by).sum(axis=1),
        by_prior=np.sqrt((bread @ by_error * bread).sum(axis=1)),
        known={each.name: each.text for each in problem.known},
    )


def _of_priors(solved: Solved) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What is known beforehand: its parts of J'J (size, size), of the covariance of J'r, and of J'r (size,)."""
    size = solved.problem.unknowns.size
    weight, noise, pull = np.zeros(size), np.zeros(size), np.zeros(size)
    for each in solved.problem.known:
        weight[each.place], noise[each.place] = each.weight, each.noise
        pull[each.place] = each.weight * (solved.x[each.place] - np.log(each.value))
    return np.diag(weight), np.diag(noise * weight), pull


def absent(solved: Solved) -> frozenset[str]:
    """Names of parameters that are not in the model: removed, or a saturation that no contact reaches before its
    rupture, and what follows a rupture that no run shows."""
    unknowns, x = solved.problem.unknowns, solved.x
    own = {prefix(k // PER_LAYER) + "saturation_depth" for k in unknowns.held if k % PER_LAYER == SATURATION}
    rows = unknowns.rows(x[None], unknowns.punctures(x).max(axis=0)[None])[0]
    deepest = max(cycle.deepest for cycle in solved.problem.cycles)
    for layer, row in enumerate(LayerRow(*row) for row in rows):
        if row.saturation_depth >= min(row.puncture_depth, deepest) - row.top:
            own.add(f"{prefix(layer)}saturation_depth")
        if row.puncture_depth > deepest:
            own |= {prefix(layer) + name for name in OF_A_RUPTURE}
    return frozenset(own | (set(SHARES) if unknowns.relaxing in unknowns.held else set()))


def _limited(solved: Solved) -> frozenset[str]:
    """Names of parameters that were held, or that the search ended with at one of their limits."""
    unknowns, x = solved.problem.unknowns, solved.x
    low, high = solved.problem.bounds
    near = 1e-6 * (high - low)
    at = np.flatnonzero((x <= low + near) | (x >= high - near))
    places = {k for k in (*at, *unknowns.held) if k < unknowns.relaxing}
    common = {"withdrawal_ratio"} if unknowns.withdrawal in at else set()
    return frozenset(common | {prefix(k // PER_LAYER) + NAMES[k % PER_LAYER] for k in places if k % PER_LAYER in NAMES})


def _moves(solved: Solved, by: np.ndarray, runs: tuple, all_rows: tuple, known: np.ndarray) -> np.ndarray:
    """Changes (runs, p) of the values if each run is left out, minus their mean; J'J and J'r of each of the ``runs``,
    and those of all rows."""
    (grams, slopes), (total, slope) = runs, all_rows
    if len(grams) < MIN_REPEATS:
        return np.zeros((len(grams), len(by)))
    own = values(solved.problem.unknowns, solved.x)
    steps = [-_inverse(total - gram, known) @ (slope - part) for gram, part in zip(grams, slopes)]
    moves = np.array(
        [by @ step + values(solved.problem.unknowns, solved.x, run) - own for run, step in enumerate(steps)]
    )
    return moves - moves.mean(axis=0)


def _inverse(gram: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Pseudo-inverse of the scaled J'J (size, size), zero for unknown parameters and directions without data."""
    part = known & (gram.diagonal() > 0.0)
    scale = 1.0 / np.sqrt(gram.diagonal()[part])
    found = np.zeros_like(gram)
    inner = np.linalg.pinv(gram[np.ix_(part, part)] * np.outer(scale, scale), rcond=1e-10, hermitian=True)
    found[np.ix_(part, part)] = inner * np.outer(scale, scale)
    return found


def _limits(value: float, half: float, above_zero: bool) -> tuple[float, float]:
    """Limits of the interval; of a positive parameter from its logarithm."""
    if not np.isfinite(half):
        return (0.0 if above_zero else -np.inf), np.inf
    if not above_zero or value <= 0.0:
        return value - half, value + half
    factor = float(np.exp(half / value)) if half < MAX_LOG_HALF * value else np.inf
    return value / factor, value * factor
