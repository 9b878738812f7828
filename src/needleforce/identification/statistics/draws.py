# SPDX-License-Identifier: Apache-2.0
"""Draws of everything a fit identified: of each recording, and of the mean over repeats."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ..estimates import Estimate
from ..pooling import student
from ..result import Fit, RecordingFit
from .cycle_draws import draw_cycle
from .noise import Z_95

MOST = 10_000_000


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


def draws_of(fit: Fit, count: int, seed: int) -> Draws:
    """``count`` draws of every quantity that ``fit`` identified, the same for the same ``seed``.

    A recording's are of its exact posterior, or Gaussian where that has none: see ``draw_cycle``. What is estimated by
    other means (the measured puncture force, presliding) is Gaussian by its interval and independent of the rest.

    The mean over n repeats is Student's: x + g sum_j z_j (x_j - x) / sqrt(n (n - 1)), z normal, g the root of n - 1
    over a chi-square, one z and g for all quantities. Its 95 % are the table's interval, its correlations the repeats'.
    Where repeats scatter less than their own errors, the rest is normal. What second passes estimate is drawn by its
    interval.

    A layered fit has draws of the numbers that its repeats share, no own ones; see ``Spread.draws``.

    Raises InputError for a count outside 1 to 10 million, and for a fit without a cycle to draw from.
    """
    if not 1 <= count <= MOST or count != int(count):
        raise InputError("count of draws", count, f"must be a whole number from 1 to {MOST}")
    if fit.spread is not None:
        return Draws(fit.spread.draws(int(count), np.random.default_rng(seed)), {}, (), ("layered fit",))
    answering = [each for each in fit.recordings if each.cycle is not None]
    if not answering:
        said = "no recording was fitted by a one-layer cycle"
        raise InputError("draws", "none", said, next_step="Give recordings that answer, and a one-layer model.")
    random = np.random.default_rng(seed)
    drawn = [_own(each, int(count), random) for each in answering]
    names = [name for name in drawn[0][0] if all(name in found for found, _ in drawn)]
    own = {name: np.stack([found[name] for found, _ in drawn]) for name in names}
    mean = _mean(fit, answering, own, random)
    if "reduced_modulus" in fit.parameters and "stiffness_coefficient" in mean:
        per = fit.parameters["reduced_modulus"].value / fit.parameters["stiffness_coefficient"].value
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


def _mean(fit: Fit, answering: list[RecordingFit], own: dict, random: np.random.Generator) -> dict:
    """Draws (count,) of the pooled quantities."""
    n, count = len(answering), next(iter(own.values())).shape[1]
    normal, chi_square = random.standard_normal((n, count)), random.chisquare(max(n - 1, 1), count)
    shared = normal * np.sqrt(max(n - 1, 1) / chi_square)
    found = {}
    for name, draws in own.items():
        estimates, pooled = [each.parameters[name] for each in answering], fit.parameters[name]
        values = np.array([estimate.value for estimate in estimates])
        if not math.isclose(pooled.value, values.mean(), rel_tol=1e-12):
            found[name] = _replaced(pooled, fit, count, random)
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


def _replaced(pooled: Estimate, fit: Fit, count: int, random: np.random.Generator) -> np.ndarray:
    """Draws of an estimate from second passes, by its interval."""
    n = len(fit.two_pass.sites) if fit.two_pass else 1
    share = random.standard_normal(count) / Z_95 if n < 2 else random.standard_t(n - 1, count) / student(n)
    return _by_interval(pooled, share)
