# SPDX-License-Identifier: Apache-2.0
"""Independent draws of all that a fit identified: of each recording, and of the mean over repeats."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...checks import random_seed
from ...errors import InputError
from ..estimates import Estimate, Parameters
from ..one_layer.cycle_values import CycleFit
from ..one_layer.loading_curves import FITS
from ..recording_fit import RecordingFit
from ..strokes import Strokes
from .noise import TWO_SIDED, student_quantile
from .posterior import Linear, Posterior, can_be_exact, posterior_of

MAX_DRAWS = 10_000_000  # more would need several GB
EXACT = "exact posterior: a grid over contact and puncture, the linear coefficients Gaussian in each cell"
GAUSSIAN = "Gaussian with the fit's covariance, puncture uniform over its interval"
LAYERS = "Gaussian with the correlations of the fit of the layers, scaled to the intervals"
MAX_ROUNDS = 100  # of draws: if the priors reject more than this, another method is used


@dataclass(frozen=True, eq=False)
class Draws(Mapping[str, np.ndarray]):
    """Independent draws by the names of the estimates, in SI: ``draws["friction_per_length"]`` is (count,).

    Draws with the same index belong together, so that they have the correlations of the estimates.

    Attributes
    ----------
    mean : mapping of str to numpy.ndarray
        Draws (count,) of the mean over repeats; of one recording its own. ``draws[name]`` is ``draws.mean[name]``.
    own : mapping of str to numpy.ndarray
        Draws (repeats, count) of each recording.
    files : tuple of str
        Names of the recordings, in the order of the rows of ``own``.
    methods : tuple of str
        How each recording was drawn.
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

    def save(self, path: str | Path) -> None:
        """Write the draws to a file.

        Parameters
        ----------
        path : str or path-like
            Ends in ``.csv`` or ``.json``; see ``write_draws`` for the columns and keys.

        Raises
        ------
        InputError
            For another ending.
        """
        from ..export import write_draws

        write_draws(self, path)


def checked_count(count: int) -> int:
    """``count`` as a whole number. Raises InputError outside 1 to 10 million."""
    if not 1 <= count <= MAX_DRAWS or count != int(count):
        raise InputError("number of draws", count, f"it must be a whole number from 1 to {MAX_DRAWS}")
    return int(count)


def draws_of(
    recordings: Sequence[RecordingFit], parameters: Parameters, count: int, seed: int, *, passes: int = 1
) -> Draws:
    """Independent draws of every identified quantity, the same for the same seed.

    The draws of a recording are of its exact posterior, or Gaussian where there is none: see ``draw_cycle``; those of
    layers in an insertion are Gaussian, scaled to its intervals. Estimates made otherwise (the measured puncture force,
    presliding) are drawn as Gaussian with their interval, independent of the rest.

    The mean over n repeats has Student's distribution: x + g sum_j z_j (x_j - x) / sqrt(n (n - 1)), z normal, g the
    root of n - 1 over a chi-square, one z and g for all quantities. Its correlations are those of the repeats. Where
    repeats scatter less than their own errors, a normal part is added. Errors of the model are shared by the repeats:
    each has one normal number for all repeats and quantities, which moves them as it moves their values, and the draws
    of a quantity are then scaled to its interval in the table. Estimates from second passes are drawn by their
    interval.

    Parameters
    ----------
    recordings : sequence of RecordingFit
        Those without a fit are left out.
    parameters : Parameters
        The pooled estimates.
    count : int
        From 1 to 10 million.
    seed : int
        Seed of the random numbers; the same seed gives the same draws.
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
    answering = [each for each in recordings if each.cycle is not None or each.layers is not None]
    if not answering:
        limit = "no recording has a one-layer fit, or one of gradual_layers"
        raise InputError("draws", "not available", limit, next_step="Give a recording with contact and puncture.")
    random = np.random.default_rng(random_seed(seed))
    drawn = [_own(each, count, random) for each in answering]
    names = [name for name in drawn[0][0] if all(name in found for found, _ in drawn)]
    own = {name: np.stack([found[name] for found, _ in drawn]) for name in names}
    mean = _mean(parameters, answering, own, random, passes)
    if "reduced_modulus" in parameters and "stiffness_coefficient" in mean:
        per = parameters["reduced_modulus"].value / parameters["stiffness_coefficient"].value
        mean["reduced_modulus"] = per * mean["stiffness_coefficient"]
    return Draws(mean, own, tuple(each.file for each in answering), tuple(method for _, method in drawn))


def _own(each: RecordingFit, count: int, random: np.random.Generator) -> tuple[dict, str]:
    """The draws of one recording by the names of its estimates, in their order, and how its cycle was drawn."""
    if each.cycle is None:
        return _own_layers(each, count, random), LAYERS
    joint, method = draw_cycle(each.cycle, each.strokes, count, random)
    found = {}
    for name, estimate in each.parameters.items():
        if name in joint and estimate.value == each.cycle.values[name]:
            found[name] = _widened(joint[name], estimate, each.cycle)
        elif math.isfinite(estimate.high - estimate.low):
            found[name] = _by_interval(estimate, random.standard_normal(count) / TWO_SIDED)
    return found, method


def _own_layers(each: RecordingFit, count: int, random: np.random.Generator) -> dict:
    """The draws of the layers of one insertion whose intervals have ends, each scaled on each side to its interval."""
    from ..layered.insertion_fit import lowest

    standard, found = each.layers.standard(count, random), {}
    for name, estimate in each.parameters.items():
        if math.isfinite(estimate.high - estimate.low):
            share = standard[name] if name in standard else random.standard_normal(count)
            found[name] = np.maximum(_by_interval(estimate, share / TWO_SIDED), lowest(name))
    return found


def _widened(values: np.ndarray, estimate: Estimate, cycle: CycleFit) -> np.ndarray:
    """Gaussian draws (d,) scaled on each side to an interval that errors of the model widened."""
    if estimate.name not in cycle.order or not any(estimate.name in moved for moved in cycle.causes.values()):
        return values
    place = cycle.order.index(estimate.name)
    return _by_interval(estimate, (values - estimate.value) / (TWO_SIDED * math.sqrt(cycle.covariance[place, place])))


def _by_interval(estimate: Estimate, share: np.ndarray) -> np.ndarray:
    """Draws (d,) at ``share`` (d,) of the distance from the value to the ends of its interval."""
    return estimate.value + share * np.where(share < 0.0, estimate.value - estimate.low, estimate.high - estimate.value)


def _mean(
    parameters: Parameters, answering: list[RecordingFit], own: dict, random: np.random.Generator, passes: int
) -> dict:
    """Draws (count,) of the pooled quantities."""
    n, count = len(answering), next(iter(own.values())).shape[1]
    normal, chi_square = random.standard_normal((n, count)), random.chisquare(max(n - 1, 1), count)
    shared = normal * np.sqrt(max(n - 1, 1) / chi_square)
    moved, found = _moved_by_model_errors(answering, random, count), {}
    for name, draws in own.items():
        estimates, pooled = [each.parameters[name] for each in answering], parameters[name]
        values = np.array([estimate.value for estimate in estimates])
        if not math.isclose(pooled.value, values.mean(), rel_tol=1e-12):
            found[name] = _replaced(pooled, passes, count, random)
        elif n == 1:
            found[name] = draws[0]
        elif pooled.identifiable and math.isfinite(pooled.high - pooled.low):
            scattered = (values - values.mean()) @ shared / math.sqrt(n * (n - 1))
            scattered += _beyond_scatter(values, pooled) * random.standard_normal(count)
            found[name] = pooled.value + _with_systematic(scattered, pooled, moved.get(name), random)
        else:  # the mean has the uncertainty of a single repeat
            found[name] = draws[np.arange(count) % n, np.arange(count)]
    return found


def _beyond_scatter(values: np.ndarray, pooled: Estimate) -> float:
    """Standard error of the random part of the pooled interval in excess of the scatter between repeats."""
    n, half = len(values), pooled.random
    scatter = student_quantile(n - 1) * float(values.std(ddof=1)) / math.sqrt(n)
    return math.sqrt(max(half**2 - scatter**2, 0.0)) / TWO_SIDED


def _moved_by_model_errors(
    answering: list[RecordingFit], random: np.random.Generator, count: int
) -> dict[str, np.ndarray]:
    """Draws (count,) of standard size, by name, of where the errors of the model move the mean over repeats."""
    answering = [each for each in answering if each.cycle is not None]
    causes = dict.fromkeys(cause for each in answering for cause in each.cycle.causes)
    drawn, moved = random.standard_normal((len(causes), count)), {}
    for number, cause in zip(drawn, causes):
        for changes in (each.cycle.causes.get(cause, {}) for each in answering):
            for name, change in changes.items():
                moved[name] = moved.get(name, 0.0) + np.nan_to_num(change) * number
    return {name: values / values.std() for name, values in moved.items() if values.std() > 0.0}


def _with_systematic(
    scattered: np.ndarray, pooled: Estimate, moved: np.ndarray | None, random: np.random.Generator
) -> np.ndarray:
    """Deviations (count,) from the mean with the systematic part, which follows ``moved``, scaled on each side to the
    interval of the table."""
    size = 0.5 * sum(pooled.systematic)
    if not size > 0.0:
        return scattered
    moved = random.standard_normal(len(scattered)) if moved is None else moved
    both = scattered + size / TWO_SIDED * moved
    below, above = pooled.value - pooled.low, pooled.high - pooled.value
    return both * np.where(both < 0.0, below, above) / math.hypot(pooled.random, size)


def _replaced(pooled: Estimate, n: int, count: int, random: np.random.Generator) -> np.ndarray:
    """Draws of an estimate from second passes at ``n`` sites, by its interval."""
    if n < 2:
        share = random.standard_normal(count) / TWO_SIDED
    else:
        share = random.standard_t(n - 1, count) / student_quantile(n - 1)
    return _by_interval(pooled, share)


def draw_cycle(fit: CycleFit, strokes: Strokes, count: int, random: np.random.Generator) -> tuple[dict, str]:
    """Draws (count,) of each quantity of the cycle by name, SI, and the method that gave them.

    Exact for a complete fit, see ``can_be_exact``; otherwise Gaussian. No draw has a coefficient below 0. Parameters
    that the cycle does not determine are NaN.
    """
    bounded = {*FITS[fit.law].parameters, "friction_per_length"}
    if can_be_exact(fit):
        posterior = posterior_of(fit, strokes)
        found = _allowed(lambda: _exact(fit, strokes, posterior, count, random), bounded)
        if found is not None:
            return found, EXACT
    bounded |= {"cutting_force"} if fit.by_stages else set()
    found = _allowed(lambda: _gaussian(fit, count, random), bounded)
    return _gaussian(fit, count, random) if found is None else found, GAUSSIAN


def _allowed(draw: Callable[[], dict], bounded: set[str]) -> dict | None:
    """As many draws as ``draw`` gives, the bounded ones not below 0; None where fewer than one in MAX_ROUNDS is."""
    kept: list[dict] = []
    for _ in range(MAX_ROUNDS):
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
    c, f, k, b = random.standard_normal((4, count))
    at = Linear(*(np.take(each, cell) for each in posterior.linear))
    b = b * at.zero_sd
    c, f = c * at.stiffness_sd + b * at.stiffness_by_zero, f * at.friction_sd + b * at.friction_by_zero
    k = k * at.cutting_sd + f * at.cutting_by_friction - b
    means = (posterior.interpolated(each, cell, along, across) for each in posterior.linear[2:6])
    c, f, k, b = (scatter + mean for scatter, mean in zip((c, f, k, b), means))
    unit = posterior.depth_unit
    found = {"stiffness_coefficient": c / unit**2, "contact_depth": places[0]}
    found |= {"friction_per_length": f / unit, "cutting_force": k, "force_offset": b}
    found |= {"saturation_depth": places[1]} if fit.saturation_sought else {}
    before, after = (strokes.depth_in[places[2] - side] for side in (1, 0))
    puncture = before + random.random(count) * (after - before)
    if fit.puncture.left_out:
        puncture = fit.values["puncture_depth"] + _smear(fit) * random.standard_normal(count)
    return _with_puncture(fit, found, puncture)


def _smear(fit: CycleFit) -> float:
    """Standard error [m] of the puncture depth behind a filter, from the interval of the indentation."""
    half = {name: 0.5 * (fit.high[name] - fit.low[name]) for name in ("puncture_indentation", "contact_depth")}
    return math.sqrt(max(half["puncture_indentation"] ** 2 - half["contact_depth"] ** 2, 0.0)) / TWO_SIDED


def _gaussian(fit: CycleFit, count: int, random: np.random.Generator) -> dict:
    """Draws of the Gaussian before the bounds; NaN for a parameter without a finite variance."""
    order = fit.order
    known = np.flatnonzero(np.isfinite(fit.covariance.diagonal()))
    values = np.full((len(order), count), np.nan)
    values[known] = _correlated(fit.covariance[np.ix_(known, known)], count, random)
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
    """The draws with the puncture's depth, its indentation and the law's force there; undetermined parameters held."""
    indentation = puncture - found["contact_depth"]
    known = {name: values for name, values in found.items() if not np.isnan(values).any()}
    values = {name: known.get(name, fit.values[name]) for name in FITS[fit.law].parameters}
    force = FITS[fit.law].force(indentation, values)
    return found | {"puncture_depth": puncture, "puncture_indentation": indentation, "puncture_force": force}
