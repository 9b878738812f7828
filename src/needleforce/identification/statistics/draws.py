# SPDX-License-Identifier: Apache-2.0
"""Independent draws of all that a fit identified: of each recording, and of the mean over repeats."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ..estimates import Estimate, Parameters, student
from ..one_layer.cycle_estimates import CycleFit
from ..one_layer.loading_curves import CURVES
from ..recording_fit import RecordingFit
from ..strokes import Strokes
from .noise import Z_95
from .posterior import Linear, Posterior, can_be_exact, posterior_of

MOST = 10_000_000
EXACT = "exact posterior: a grid over contact and puncture, the linear coefficients Gaussian in each cell"
GAUSSIAN = "Gaussian with the fit's covariance, puncture even over its interval"
ROUNDS = 100  # of draws, before what the priors allow is said to be too little


@dataclass(frozen=True, eq=False)
class Draws(Mapping[str, np.ndarray]):
    """Independent draws by the names of the estimates, SI: ``draws["friction_per_length"]`` is (count,).

    With one recording they are its own; with several, of the mean over repeats. ``own[name]`` is (repeats, count), one
    row a recording, named by ``files``; ``methods`` says of each how it was drawn. Draws of one recording belong
    together along count, those of the mean as well, so that what trades off does so in them.
    """

    mean: Mapping[str, np.ndarray]
    own: Mapping[str, np.ndarray]
    files: tuple[str, ...]
    methods: tuple[str, ...]

    def __getitem__(self, name: str) -> np.ndarray:
        return self.mean[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.mean)

    def __len__(self) -> int:
        return len(self.mean)

    def save(self, path) -> None:
        """Writes the draws as CSV or JSON, by the ending of ``path``; see ``write_draws``."""
        from ..export import write_draws

        write_draws(self, path)


def checked_count(count: int) -> int:
    """``count`` as a whole number. Raises InputError outside 1 to 10 million."""
    if not 1 <= count <= MOST or count != int(count):
        raise InputError("count of draws", count, f"must be a whole number from 1 to {MOST}")
    return int(count)


def draws_of(
    recordings: Sequence[RecordingFit], parameters: Parameters, count: int, seed: int, *, passes: int = 1
) -> Draws:
    """Independent draws of every identified quantity, the same for the same seed.

    A recording's draws are of its exact posterior, or Gaussian where that has none: see ``draw_cycle``. What is
    estimated by other means (the measured puncture force, presliding) is Gaussian by its interval and independent of
    the rest.

    The mean over n repeats is Student's: x + g sum_j z_j (x_j - x) / sqrt(n (n - 1)), z normal, g the root of n - 1
    over a chi-square, one z and g for all quantities. Its 95 % are the table's interval, its correlations the repeats'.
    Where repeats scatter less than their own errors, the rest is normal. What second passes estimate is drawn by its
    interval.

    Parameters
    ----------
    recordings : sequence of RecordingFit
        Those without a cycle are left out.
    parameters : Parameters
        The pooled estimates.
    count : int
        From 1 to 10 million.
    seed : int
        Of the random numbers.
    passes : int
        Sites over which second passes were averaged.

    Returns
    -------
    Draws

    Raises
    ------
    InputError
        For a count out of range, and where no recording has a cycle to draw from.
    """
    count = checked_count(count)
    answering = [each for each in recordings if each.cycle is not None]
    if not answering:
        reason = "no recording was fitted by a one-layer cycle"
        raise InputError("draws", "none", reason, next_step="Give recordings that answer, and a one-layer model.")
    random = np.random.default_rng(seed)
    drawn = [_own(each, count, random) for each in answering]
    names = [name for name in drawn[0][0] if all(name in found for found, _ in drawn)]
    own = {name: np.stack([found[name] for found, _ in drawn]) for name in names}
    mean = _mean(parameters, answering, own, random, passes)
    if "reduced_modulus" in parameters and "stiffness_coefficient" in mean:
        per = parameters["reduced_modulus"].value / parameters["stiffness_coefficient"].value
        mean["reduced_modulus"] = per * mean["stiffness_coefficient"]
    return Draws(mean, own, tuple(each.file for each in answering), tuple(method for _, method in drawn))


def _own(each: RecordingFit, count: int, random: np.random.Generator) -> tuple[dict, str]:
    """One recording's draws by the names of its estimates, in their order, and the method of its cycle's."""
    joint, method = draw_cycle(each.cycle, each.strokes, count, random)
    found = {}
    for name, estimate in each.parameters.items():
        if name in joint and estimate.value == each.cycle.values[name]:
            found[name] = joint[name]
        elif math.isfinite(estimate.high - estimate.low):
            found[name] = _by_interval(estimate, random.standard_normal(count) / Z_95)
    return found, method


def _by_interval(estimate: Estimate, share: np.ndarray) -> np.ndarray:
    """Draws (d,) that stand ``share`` (d,) of the way from the value to either end of its interval."""
    return estimate.value + share * np.where(share < 0.0, estimate.value - estimate.low, estimate.high - estimate.value)


def _mean(
    parameters: Parameters, answering: list[RecordingFit], own: dict, random: np.random.Generator, passes: int
) -> dict:
    """Draws (count,) of the pooled quantities."""
    n, count = len(answering), next(iter(own.values())).shape[1]
    normal, chi_square = random.standard_normal((n, count)), random.chisquare(max(n - 1, 1), count)
    shared = normal * np.sqrt(max(n - 1, 1) / chi_square)
    found = {}
    for name, draws in own.items():
        estimates, pooled = [each.parameters[name] for each in answering], parameters[name]
        values = np.array([estimate.value for estimate in estimates])
        if not math.isclose(pooled.value, values.mean(), rel_tol=1e-12):
            found[name] = _replaced(pooled, passes, count, random)
        elif n == 1:
            found[name] = draws[0]
        elif pooled.identifiable and math.isfinite(pooled.high - pooled.low):
            found[name] = pooled.value + (values - values.mean()) @ shared / math.sqrt(n * (n - 1))
            found[name] += _beyond_scatter(values, pooled) * random.standard_normal(count)
        else:  # as little is known of the mean as of each
            found[name] = draws[np.arange(count) % n, np.arange(count)]
    return found


def _beyond_scatter(values: np.ndarray, pooled: Estimate) -> float:
    """Standard error that the pooled interval has beyond the scatter of repeats, which may be less than their own."""
    n, half = len(values), 0.5 * (pooled.high - pooled.low)
    scatter = student(n) * float(values.std(ddof=1)) / math.sqrt(n)
    return math.sqrt(max(half**2 - scatter**2, 0.0)) / Z_95


def _replaced(pooled: Estimate, n: int, count: int, random: np.random.Generator) -> np.ndarray:
    """Draws of an estimate from second passes at ``n`` sites, by its interval."""
    share = random.standard_normal(count) / Z_95 if n < 2 else random.standard_t(n - 1, count) / student(n)
    return _by_interval(pooled, share)


def draw_cycle(fit: CycleFit, strokes: Strokes, count: int, random: np.random.Generator) -> tuple[dict, str]:
    """Draws (count,) of each quantity of the cycle by name, SI, and the method that gave them.

    Exact where all was fitted at once with noise that running sums can carry; else Gaussian. No draw has a coefficient
    below 0. What the cycle does not tell is NaN.
    """
    bounded = {*CURVES[fit.law].units, "friction_per_length"}
    if can_be_exact(fit):
        posterior = posterior_of(fit, strokes)
        found = _allowed(lambda: _exact(fit, strokes, posterior, count, random), bounded)
        if found is not None:
            return found, EXACT
    bounded |= {"cutting_force"} if fit.by_stages else set()
    found = _allowed(lambda: _gaussian(fit, count, random), bounded)
    return _gaussian(fit, count, random) if found is None else found, GAUSSIAN


def _allowed(draw: Callable[[], dict], bounded: set[str]) -> dict | None:
    """As many draws as ``draw`` gives, none below 0 where bounded; None where such are rarer than one in ROUNDS."""
    kept: list[dict] = []
    for _ in range(ROUNDS):
        found = draw()
        good = np.all([~(found[name] < 0.0) for name in bounded & found.keys()], axis=0)
        if not kept and good.all():
            return found
        kept.append({name: values[good] for name, values in found.items()})
        if sum(len(each["contact_depth"]) for each in kept) >= len(good):
            return {name: np.concatenate([each[name] for each in kept])[: len(good)] for name in found}
    return None


def _exact(fit: CycleFit, strokes: Strokes, posterior: Posterior, count: int, random: np.random.Generator) -> dict:
    """Draws of the posterior before the bounds: a cell, a place within it, then the coefficients there."""
    cell = np.searchsorted(np.cumsum(posterior.weights.ravel()), random.random(count), side="right")
    cell = np.minimum(cell, posterior.weights.size - 1)
    along, across = posterior.steps * (random.random((count, 2)) - 0.5).T
    places = posterior.places(cell, along, across)
    c, f, k = random.standard_normal((3, count))
    at = Linear(*(np.take(each, cell) for each in posterior.linear))
    c, f, k = c * at.stiffness_sd, f * at.friction_sd, f * at.cutting_by_friction + k * at.cutting_sd
    means = (posterior.interpolated(each, cell, along, across) for each in posterior.linear[2:5])
    c, f, k = (scatter + mean for scatter, mean in zip((c, f, k), means))
    unit = posterior.depth_unit
    found = {"stiffness_coefficient": c / unit**2, "contact_depth": places[0]}
    found |= {"friction_per_length": f / unit, "cutting_force": k}
    found |= {"saturation_depth": places[1]} if fit.saturation_sought else {}
    before, after = (strokes.depth_in[places[2] - side] for side in (1, 0))
    puncture = before + random.random(count) * (after - before)
    if fit.left_out:
        puncture = fit.values["puncture_depth"] + _smear(fit) * random.standard_normal(count)
    return _with_puncture(fit, found, puncture)


def _smear(fit: CycleFit) -> float:
    """Standard error of the puncture's depth behind a filter [m], as the indentation's interval has it."""
    half = {name: 0.5 * (fit.high[name] - fit.low[name]) for name in ("puncture_indentation", "contact_depth")}
    return math.sqrt(max(half["puncture_indentation"] ** 2 - half["contact_depth"] ** 2, 0.0)) / Z_95


def _gaussian(fit: CycleFit, count: int, random: np.random.Generator) -> dict:
    """Draws of the Gaussian before the bounds; NaN for a number that the covariance does not know."""
    order = fit.covariance_order
    told = np.flatnonzero(np.isfinite(fit.covariance.diagonal()))
    values = np.full((len(order), count), np.nan)
    values[told] = _correlated(fit.covariance[np.ix_(told, told)], count, random)
    found = {name: fit.values[name] + scatter for name, scatter in zip(order, values)}
    ends = (limit["puncture_depth"] for limit in (fit.low, fit.high))
    return _with_puncture(fit, found, random.uniform(*ends, count))


def _correlated(covariance: np.ndarray, count: int, random: np.random.Generator) -> np.ndarray:
    """Draws (p, count) of a Gaussian about 0, scaled first as its units differ by orders of magnitude."""
    scale = np.sqrt(covariance.diagonal())
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    return scale[:, None] * (root @ random.standard_normal((len(scale), count)))


def _with_puncture(fit: CycleFit, found: dict, puncture: np.ndarray) -> dict:
    """The draws with the puncture's depth, its indentation and the law's force there, what is not told held."""
    indentation = puncture - found["contact_depth"]
    told = {name: values for name, values in found.items() if not np.isnan(values).any()}
    values = {name: told.get(name, fit.values[name]) for name in CURVES[fit.law].units}
    force = CURVES[fit.law].force(indentation, values)
    return found | {"puncture_depth": puncture, "puncture_indentation": indentation, "puncture_force": force}
