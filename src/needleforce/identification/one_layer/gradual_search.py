# SPDX-License-Identifier: Apache-2.0
"""The search of a gradual rupture: its force, linear in four coefficients, and least squares in the others; and whether
a sharp rupture explains the samples as well.

Up to its onset the contact follows its loading curve F(h). From there on the share exp(-(s / delta)^m) of it is intact
after an advance s, which carries what friction and cutting do not (law ``yielding_coulomb``):

| insertion  | b + f' h + f_c + (F(h_o) - f' h_o - f_c) exp(-(s / delta)^m) F(h) / F(h_o), s = h - h_o |
| withdrawal | b - f' h |

h = z - z0 is the indentation, h_o that of the onset. Amplitude, friction, cutting force and zero are projected out.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from ...errors import InputError
from ...vocabulary import SMALLEST
from ..statistics.noise import noise_of
from ..statistics.regression import VERY_STRONG_BIC, bic_gain, independent_samples
from ..strokes import Strokes
from .cycle_values import CycleFit
from .deformation_fit import CONTACT_RANGE, DeformationFit
from .loading_curves import LoadingCurve

SEARCH_BLOCKS = 300  # the search works on means of so many blocks of each stroke
FINE_BLOCKS = 1000  # and what it finds is refined on so many
PLACES = (-0.3, 0.0, 0.25, 0.5)  # [indentations at the peak] contacts to start from
ONSETS = (0.15, 0.4, 0.7, 0.95)  # [indentations at the peak, from the contact]
LENGTHS = (0.05, 0.2, 0.5, 1.0)  # [indentations at the peak]
EXPONENTS = (1.3, 2.0, 3.0)
MIN_GAIN = 1e-7  # [of the sum of squares] of the last step of a search
N_STARTS = 4  # of the best, from which minima are sought
MAX_AT_ONCE = 120_000  # samples times starts, for the memory
EXPONENT = 2.0  # of the first fit: the fall begins smoothly
EXPONENT_RANGE = (1.0, 4.0)  # above, a smooth fall and an earlier onset are alike
ONSET_RANGE = (0.02, 3.0)  # [indentations at the peak]
LENGTH_RANGE = (1e-3, 10.0)
N_LINEAR = 4
AMPLITUDE, FRICTION, CUTTING, ZERO = range(N_LINEAR)


@dataclass(frozen=True, eq=False, kw_only=True)
class Samples:
    """Scaled samples of one fit: indentation ``x`` from the given contact and ``force``, in units of the indentation at
    the peak and of the peak force; the first ``n_in`` are those of the insertion, behind a filter of ``filter_length``
    samples."""

    x: np.ndarray
    force: np.ndarray
    n_in: int
    filter_length: int = 1

    def blocks(self, count: int) -> "Samples":
        """Means of ``count`` blocks of each stroke; all samples behind a filter, whose length is in samples."""
        if self.filter_length > 1:
            return self
        parts = [slice(0, self.n_in), slice(self.n_in, None)]
        x, force = ([_means(each[part], count) for part in parts] for each in (self.x, self.force))
        return Samples(x=np.concatenate(x), force=np.concatenate(force), n_in=len(x[0]))


def _means(values: np.ndarray, count: int) -> np.ndarray:
    if len(values) <= count:
        return values
    edges = np.linspace(0, len(values), count + 1).astype(int)
    return np.add.reduceat(values, edges[:-1]) / np.diff(edges)


@dataclass(frozen=True, eq=False, kw_only=True)
class Shape:
    """The nonlinear parameters, scaled: contact ``place``, ``onset`` (an indentation) and ``length`` of the rupture,
    its ``exponent``, and the shape parameters of the loading curve; (k, 1) each for k shapes at once."""

    place: float
    onset: float
    length: float
    exponent: float
    curve: tuple[float, ...]

    @classmethod
    def of(cls, numbers: np.ndarray, n_curve: int, exponent: float | None) -> "Shape":
        """From the (p,) or (k, p) numbers of the search: place, logarithms of onset and length, shape, perhaps the
        exponent."""
        place, onset, length, *more = numbers if numbers.ndim == 1 else numbers.T[..., None]
        own = more[n_curve] if exponent is None else exponent
        return cls(place=place, onset=np.exp(onset), length=np.exp(length), exponent=own, curve=tuple(more[:n_curve]))


def columns(curve: LoadingCurve, shape: Shape, samples: Samples) -> np.ndarray:
    """The (n, 4) force of each linear coefficient: amplitude, friction per length, cutting force and zero; (k, n, 4)
    for k shapes."""
    h = np.maximum(samples.x - shape.place, 0.0)
    (loaded,) = curve.basis(h, *shape.curve)
    (at_onset,) = curve.basis(shape.onset, *shape.curve)
    advance = np.maximum(h - shape.onset, 0.0)
    intact = np.exp(-((advance / shape.length) ** shape.exponent))
    remaining, cuts = intact * loaded / at_onset, advance > 0.0
    found, out = np.empty((*h.shape, N_LINEAR)), slice(samples.n_in, None)
    found[..., AMPLITUDE], found[..., ZERO] = intact * loaded, 1.0
    found[..., FRICTION] = np.where(cuts, h - shape.onset * remaining, 0.0)
    found[..., CUTTING] = np.where(cuts, 1.0 - remaining, 0.0)
    found[..., out, AMPLITUDE] = found[..., out, CUTTING] = 0.0
    found[..., out, FRICTION] = -h[..., out]
    if samples.filter_length > 1:
        from scipy.ndimage import uniform_filter1d

        inwards = found[..., : samples.n_in, :]
        inwards[:] = uniform_filter1d(inwards, samples.filter_length, axis=-2, mode="nearest")
    return found


def linear(design: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Least-squares coefficients (4,), or (k, 4) of k designs (n, 4); amplitude, friction and cutting are none below
    0."""
    across = np.swapaxes(design, -1, -2)
    scale = np.sqrt(np.einsum("...ij,...ij->...j", design, design)) + 1e-30
    gram = across @ design / (scale[..., :, None] * scale[..., None, :]) + 1e-13 * np.eye(N_LINEAR)
    along, free = across @ force / scale, np.ones(scale.shape, bool)
    while True:
        part = np.where(free[..., :, None] & free[..., None, :], gram, np.eye(N_LINEAR))
        found = np.linalg.solve(part, np.where(free, along, 0.0)[..., None])[..., 0] / scale
        negative = free & (found < 0.0)
        negative[..., ZERO] = False
        if not negative.any():
            return found
        free &= ~negative


def not_negative(design: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Least-squares coefficients (2,) of force (n,) on design (n, 2), none below 0."""
    best = np.linalg.lstsq(design, force, rcond=None)[0]
    if (best >= 0.0).all():
        return best
    alone = np.maximum(design.T @ force / np.maximum(np.einsum("ij,ij->j", design, design), SMALLEST), 0.0)
    choices = [np.array([alone[0], 0.0]), np.array([0.0, alone[1]])]
    return min(choices, key=lambda each: float(np.sum((force - design @ each) ** 2)))


class GradualProblem:
    """The search of the nonlinear parameters of one curve; ``exponent`` None is fitted too."""

    def __init__(self, curve: LoadingCurve, samples: Samples, known: tuple[float, ...], exponent: float | None):
        self.curve, self.samples, self.known, self.exponent = curve, samples, known, exponent
        free = [] if known else list(curve.shape.values())
        low = [CONTACT_RANGE[0], math.log(ONSET_RANGE[0]), math.log(LENGTH_RANGE[0]), *(each.low for each in free)]
        high = [CONTACT_RANGE[1], math.log(ONSET_RANGE[1]), math.log(LENGTH_RANGE[1]), *(each.high for each in free)]
        own = [] if exponent is not None else [EXPONENT_RANGE]
        self.low = np.array([*low, *(each[0] for each in own)])
        self.high = np.array([*high, *(each[1] for each in own)])

    def shape(self, numbers: np.ndarray) -> Shape:
        """The parameters of the search as a shape."""
        if not self.known:
            return Shape.of(numbers, len(self.curve.shape), self.exponent)
        return Shape.of(np.insert(numbers, 3, self.known, axis=-1), len(self.known), self.exponent)

    def solved(self, numbers: np.ndarray, samples: Samples | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Residual (n,) and linear coefficients (4,) of least squares; (k, n) and (k, 4) of k rows of numbers."""
        samples = samples or self.samples
        design = columns(self.curve, self.shape(numbers), samples)
        found = linear(design, samples.force)
        return samples.force - (design @ found[..., None])[..., 0], found

    def minimum(self, start: np.ndarray, samples: Samples, rounds: int) -> tuple[np.ndarray, float]:
        """The local minimum near a start, and its sum of squares, by Gauss-Newton with Marquardt's damping on the
        residual without its linear part (variable projection, the derivative as by Kaufman 1975)."""
        at, damping = np.clip(start, self.low, self.high), 1e-2
        residual, coefficients = self.solved(at, samples)
        slopes = self._projected(at, coefficients, samples)
        for _ in range(rounds):
            gradient = slopes.T @ residual
            free = ~((at <= self.low) & (gradient < 0.0)) & ~((at >= self.high) & (gradient > 0.0))
            gram = slopes.T @ slopes
            gram[np.diag_indices(len(at))] *= 1.0 + damping
            gram[np.diag_indices(len(at))] += 1e-12 * max(float(np.trace(gram)), SMALLEST)
            moved = at.copy()
            moved[free] += np.linalg.solve(gram[np.ix_(free, free)], gradient[free])
            moved = np.clip(moved, self.low, self.high)
            new, found = self.solved(moved, samples)
            gain = 1.0 - float(new @ new) / max(float(residual @ residual), SMALLEST)
            if gain > 0.0:
                at, residual, coefficients = moved, new, found
            elif damping > 1e6:
                break
            if 0.0 <= gain < MIN_GAIN:
                break
            slopes = self._projected(at, coefficients, samples) if gain > 0.0 else slopes
            damping = damping * 0.1 if gain > 0.0 else damping * 10.0
        return at, float(residual @ residual)

    def _projected(self, numbers: np.ndarray, coefficients: np.ndarray, samples: Samples) -> np.ndarray:
        """Derivatives (n, p) of the force by the numbers, without what the linear coefficients can take up."""
        slopes = self.jacobian(numbers, coefficients, samples)
        linear, own = slopes[:N_LINEAR][coefficients != 0.0].T, slopes[N_LINEAR:].T
        basis, _ = np.linalg.qr(linear)
        return own - basis @ (basis.T @ own)

    def best(self) -> np.ndarray:
        """The best minimum that block means find, without a starting value."""
        means, fine = self.samples.blocks(SEARCH_BLOCKS), self.samples.blocks(FINE_BLOCKS)
        starts = np.array(list(_starts(self.curve, self.known)))
        parts = np.array_split(starts, len(starts) * len(means.x) // MAX_AT_ONCE + 1)
        squares = np.concatenate([np.sum(self.solved(part, means)[0] ** 2, axis=1) for part in parts])
        rough = starts[np.argsort(squares, kind="stable")[:N_STARTS]]
        found = min((self.minimum(start, means, 20) for start in rough), key=lambda each: each[1])
        return self.minimum(found[0], fine, 20)[0]

    def jacobian(self, numbers: np.ndarray, coefficients: np.ndarray, samples: Samples | None = None) -> np.ndarray:
        """Derivatives (p, n) of the force by the linear coefficients, then by the numbers of the search."""
        samples = samples or self.samples
        steps = np.where(numbers + 1e-6 < self.high, 1e-6, -1e-6)
        moves = np.vstack([np.zeros_like(steps), np.diag(steps)])
        found = columns(self.curve, self.shape(numbers + moves), samples)
        return np.concatenate([found[0].T, (found[1:] - found[0]) @ coefficients / steps[:, None]])


def _starts(curve: LoadingCurve, given: tuple[float, ...]) -> Iterator[np.ndarray]:
    """A grid of places, onsets, lengths and shapes; the onset is a share of the indentation at the peak."""
    shapes: list[tuple[float, ...]] = [()]
    for each in () if given else curve.shape.values():
        shapes = [(start,) for start in each.starts[len(each.starts) % 3 :: len(each.starts) // 3]]
    for place, onset, length, shape in product(PLACES, ONSETS, LENGTHS, shapes):
        yield np.array([place, math.log(onset * (1.0 - place)), math.log(length), *shape])


def refined(problem: GradualProblem, numbers: np.ndarray) -> tuple[GradualProblem, np.ndarray]:
    """The minimum on all samples near that of block means; with a free exponent if its BIC is lower."""
    samples = problem.samples
    free, fine = GradualProblem(problem.curve, samples, problem.known, None), samples.blocks(FINE_BLOCKS)
    starts = [free.minimum(np.append(numbers, m), samples.blocks(SEARCH_BLOCKS), 8) for m in EXPONENTS]
    more = free.minimum(min(starts, key=lambda each: each[1])[0], fine, 20)[0]
    numbers, more = (each.minimum(start, samples, 5)[0] for each, start in ((problem, numbers), (free, more)))
    residuals = [problem.solved(numbers)[0], free.solved(more)[0]]
    noises = [noise_of(each, len(each), samples.filter_length, 1.0) for each in residuals]
    n = independent_samples(noises)
    gain = bic_gain(noises[1].sse, noises[0].sse, 1, n)
    return (free, more) if gain > 0.0 else (problem, numbers)


def refuse_sharp(
    residual: np.ndarray, sharp: CycleFit, loading: DeformationFit, strokes: Strokes, *, end: int, filter_length: int
) -> None:
    """Raises InputError unless the evidence of the gradual rupture's ``residual`` (n,) [N] against a sharp one is very
    strong."""
    modelled = _sharp_force(sharp, loading, strokes, end)
    used = np.ones(len(modelled), bool)
    if filter_length > 1:  # which smears a sharp rupture as well
        place = sharp.puncture.before
        used[max(place - filter_length, 0) : place + filter_length] = False
    force = np.concatenate([strokes.force_in[:end], strokes.force_out])
    residuals = [residual, force - modelled]
    one, other = (noise_of(np.where(used, each, 0.0), int(used.sum()), filter_length, 1.0) for each in residuals)
    n = independent_samples([one, other])
    if not bic_gain(one.sse, other.sse, 2, n) > VERY_STRONG_BIC:
        limit = f"a sharp one explains the samples as well with the law {loading.law}"
        raise InputError("rupture", "not gradual", limit, next_step="Use paper, cone_cylinder or power_law.")


def _sharp_force(sharp: CycleFit, loading: DeformationFit, strokes: Strokes, end: int) -> np.ndarray:
    """Force (n,) [N] of a sharp rupture at the place that suits the samples best, with the ``loading`` curve by itself
    before it, the best that a sharp rupture can have."""
    values, depth = sharp.values, strokes.depth_in[:end]
    loaded = loading.curve.force(depth - loading.values["contact_depth"], loading.values)
    loaded = loaded + loading.values["force_offset"] - values["force_offset"]
    cut = values["friction_per_length"] * np.maximum(depth - values["contact_depth"], 0.0) + values["cutting_force"]
    force = strokes.force_in[:end] - values["force_offset"]
    gain = np.cumsum((force - cut) ** 2 - (force - loaded) ** 2)
    modelled = np.where(np.arange(end) <= int(gain.argmax()), loaded, cut)
    back = -values["friction_per_length"] * np.maximum(strokes.depth_out - values["contact_depth"], 0.0)
    return np.concatenate([modelled, back]) + values["force_offset"]


def sharp_free(warnings: Sequence[str]) -> tuple[str, ...]:
    """The warnings that do not speak of a sharp rupture."""
    return tuple(each for each in warnings if "starts in contact" in each or "no withdrawal" in each)
