# SPDX-License-Identifier: Apache-2.0
"""Least squares of the force of an insertion into a condensed solid, and the covariance of what is found."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from scipy.sparse import csc_array

from ... import core
from ...core import laws
from ...display.quantities import plain
from ...errors import InputError
from ...identification.statistics.noise import TWO_SIDED, noise_of, slow_noise
from ...models.model import Layer, Model
from ..elastic.condensed import CondensedInsertion, CondensedTissue
from ..elastic.needle_path import NeedlePath
from ..elastic.tissue import Tissue
from .insertion_curve import InsertionCurve

_STEP = 0.03  # of logarithms, in a derivative: a node or two begin to slide meanwhile, so that kinks average out
_STEP_CUTTING = 0.01  # of the range of the force
_STEP_CONTACT = 0.1  # of the path's spacing
_SCALES = 5.0, 2.0, 1.0, 0.5  # of these steps, in turn: wide ones see past kinks, narrow ones end between them
_FACTORS = np.log(10.0) * np.linspace(-2.0, 2.0, 7)  # of the given moduli, with which the search begins
_SHARES = 0.1, 0.5, 0.9  # of the largest force that is cutting at the start, next to what a line through it gives
_LIKELIEST = 2  # of these
_FOLLOWED, _FOLLOWED_ON = 4, 2  # of the starts to the end; of the ends along another spacing
_FIRST_STEPS, MAX_STEPS = 6, 60
_BLOCKS = 20  # of successive means
AS_GOOD = 3.84  # [long-run variances] more in the sum of squares: so much noise takes from the truth in 1 of 20
_MISFIT = 1.5  # [of the noise] residual of a model that is wrong; of noise, AR(1) up to 0.8, in 2 of 1000 at most
_APART = 8  # samples from one to the next that has no noise in common with it
_PLACES = 40  # among which the largest residual is named
_MAX_REFINED = 200_000  # unknowns of a solid that is refined in addition
_STIFF_CONTACT = 1e6  # [N/m] of a tip that breaks through at once
_FASTEST = 1e3  # [m/s] a limit that no step meets: time does not matter
_MODULUS, _FRICTION, _RATIO = 1e4, (1e-6, 1e4), 10.0  # limits of a factor, of friction per length [N/m], of its ratio
_KNOWN = 2  # numbers that are known within some error without the force
_RATIO_ERROR = 0.5  # standard error of the logarithm of the ratio, as long as the shaft has not slid outwards
_CONTACT_ERROR = 0.3e-3  # of the depth of contact [m], as long as the force does not show it better
_CONTACT = 0.25  # [of the deepest indentation] by which the contact may be elsewhere


@dataclass(frozen=True, eq=False)
class StiffnessByLabel:
    """A condensed tissue and how its compliance changes with the moduli of its labels: the stiffness of the path that
    each label contributes, and last that of the others.

    With the displacements U for unit forces at the path, ``dS = -U' dK U`` exactly. The shares are ``S^-1 U' K_i U
    S^-1``: their sum is the stiffness, and scaled by factors of the moduli they are Rayleigh's bound on it, with the
    right value and slope. A common factor of all moduli is exact.
    """

    condensed: CondensedTissue
    shares: np.ndarray  # (k, n, n) [N/m]

    def compliance(self, logarithms: np.ndarray) -> np.ndarray:
        """Of the path (n, n) [m/N], for logarithms (k - 1,) of the factors of the moduli."""
        factors = np.append(np.exp(logarithms), 1.0)
        found = np.linalg.inv(np.tensordot(factors, self.shares, axes=1))
        return 0.5 * (found + found.T)


def stiffness_by_label(tissue: Tissue, path: NeedlePath, labels: Sequence[str]) -> StiffnessByLabel:
    """Condense a tissue onto a path and divide its stiffness among labels; without any all have one factor. Raises
    InputError as ``Tissue.condense``."""
    condensed = tissue.condense(path)
    total = np.linalg.inv(condensed.compliance)
    if not labels:
        return StiffnessByLabel(condensed, np.stack([total, np.zeros_like(total)]))
    displaced = tissue.solve(path.loads(tissue).toarray()) @ total
    shares = [displaced.T @ (_stiffness_of(tissue, label) @ displaced) for label in labels]
    shares = [0.5 * (share + share.T) for share in shares]
    return StiffnessByLabel(condensed, np.stack([*shares, total - sum(shares)]))


def _stiffness_of(tissue: Tissue, label: str) -> csc_array:
    """Of the cells with a label alone."""
    here = tissue.mesh.labels.astype(str) == label
    shear, lame = tissue.moduli()
    return tissue.elements.stiffness(np.where(here, shear, 0.0), np.where(here, lame, 0.0))


@dataclass(frozen=True, eq=False)
class Found:
    """Numbers of the smallest sum of squares, their weighted residual [N], its long-run variance [N^2], and their
    covariance."""

    numbers: np.ndarray
    residual: np.ndarray
    long_run: float
    covariance: np.ndarray

    @property
    def cost(self) -> float:
        """Sum of squares [N^2]."""
        return float(self.residual @ self.residual)

    @property
    def errors(self) -> np.ndarray:
        """Standard errors of the numbers."""
        return np.sqrt(np.diagonal(self.covariance))


@dataclass(frozen=True, eq=False)
class InsertionSearch:
    """A curve, the solid, and the depths [m] at which layers of other friction and cutting force begin along the path.

    Numbers are logarithms of the factors of k moduli, logarithms of friction per length [N/m] and cutting force [N] of
    j layers, logarithm of friction outwards over inwards, force offset [N] and contact depth [m].
    """

    curve: InsertionCurve
    solid: StiffnessByLabel
    tops: tuple[float, ...] = (0.0,)
    steps: int = 1  # from one mean to the next

    @property
    def moduli(self) -> slice:
        """Where logarithms of factors of moduli are."""
        return slice(0, len(self.solid.shares) - 1)

    @property
    def friction(self) -> slice:
        """Where logarithms of friction per length are."""
        return slice(self.moduli.stop, self.moduli.stop + len(self.tops))

    @property
    def cutting(self) -> slice:
        """Where cutting forces are."""
        return slice(self.friction.stop, self.friction.stop + len(self.tops))

    @property
    def measured(self) -> np.ndarray:
        """Force [N] of what is used."""
        return self.curve.force[self.curve.used]

    def condensed(self, numbers: np.ndarray) -> CondensedTissue:
        """The tissue with the moduli of some numbers."""
        known = self.solid.condensed
        return CondensedTissue(known.spacing, self.solid.compliance(numbers[self.moduli]), known.radius, known.summary)

    def model(self, numbers: np.ndarray) -> Model:
        """Friction and cutting force of some numbers, with a tip that breaks through at once."""
        inwards, ratio = np.exp(numbers[self.friction]), np.exp(numbers[-3])
        parts = [_parts(f, ratio * f, cut) for f, cut in zip(inwards, numbers[self.cutting])]
        deeper = tuple(Layer(top, *each) for top, each in zip(self.tops[1:], parts[1:]))
        return Model(*parts[0], deeper=deeper)

    def force(self, numbers: np.ndarray) -> np.ndarray:
        """Of the needle in the solid, at what is used of the curve [N]."""
        tissue = self.condensed(numbers)
        insertion = CondensedInsertion(tissue, self.model(numbers), max_speed=_FASTEST)
        depth = np.minimum(self.curve.depth - numbers[-1], tissue.nodes[-1])
        if self.steps > 1:
            means = np.arange(len(depth))
            depth = np.interp(np.arange(self.steps * means[-1] + 1) / self.steps, means, depth)
        return numbers[-2] + insertion.run(depth, np.ones(len(depth)))["force"][:: self.steps][self.curve.used]

    def residual(self, numbers: np.ndarray) -> np.ndarray:
        """Weighted, of what is used, and last those of the ratio of friction and the depth of contact [N]."""
        away = self.curve.weight[self.curve.used] * (self.force(numbers) - self.measured)
        known = numbers[-3] / _RATIO_ERROR, (numbers[-1] - self.curve.contact_depth) / _CONTACT_ERROR
        return np.append(away, self.noise * np.array(known))

    @cached_property
    def noise(self) -> float:
        """Standard deviation of white noise in the means [N]."""
        return core.second_difference_noise(self.measured)

    def jacobian(self, numbers: np.ndarray, scale: float = 1.0) -> np.ndarray:
        """Derivatives of the residual by central differences over steps times a scale, (m, p)."""
        columns = []
        for k, step in enumerate(scale * self._steps()):
            move = np.zeros(len(numbers))
            move[k] = step
            up, down = numbers + move, numbers - move
            up[self.cutting], down[self.cutting] = (np.maximum(each[self.cutting], 0.0) for each in (up, down))
            columns.append((self.residual(up) - self.residual(down)) / (up[k] - down[k]))
        return np.array(columns).T

    def optima(self) -> list[Found]:
        """Where searches from several starts end, the best first: a few steps from many, then more from the best."""
        first = [self.solved(start, _FIRST_STEPS) for starts in self._starts() for start in starts]
        ahead = sorted(first, key=lambda each: each.cost)[:_FOLLOWED]
        return sorted((self.polished(each.numbers) for each in ahead), key=lambda each: each.cost)

    def polished(self, numbers: np.ndarray) -> Found:
        """Least squares from some numbers, with derivatives over ever narrower steps."""
        best = self.solved(numbers, scale=_SCALES[0])
        for scale in _SCALES[1:]:
            best = min(best, self.solved(best.numbers, scale=scale), key=lambda each: each.cost)
        return best

    def solved(self, start: np.ndarray, steps: int = MAX_STEPS, scale: float = 1.0) -> Found:
        """Least squares from some numbers."""
        from scipy.optimize import least_squares

        done = least_squares(
            self.residual, start, lambda numbers: self.jacobian(numbers, scale), bounds=self._bounds(),
            x_scale=10.0 * self._steps(), max_nfev=steps, xtol=1e-4, ftol=1e-6,
        )  # fmt: skip
        return Found(done.x, done.fun[:-_KNOWN], *uncertainty(done.jac, done.fun[:-_KNOWN]))

    def sticking(self, numbers: np.ndarray) -> float:
        """Travel [m] after a reversal at the deepest in which the shaft sticks, with the range of the force at most."""
        tissue = self.condensed(numbers)
        embedded = float(np.clip(self.curve.depth.max() - numbers[-1], 2.0 * tissue.spacing, tissue.nodes[-1]))
        inwards = np.exp(numbers[self.friction]) @ np.diff([*np.minimum(self.tops, embedded), embedded])
        change = (1.0 + np.exp(numbers[-3])) * inwards + max(numbers[self.cutting][-1], 0.0)
        return float(min(change, np.ptp(self.measured)) / tissue.bonded_stiffness(embedded))

    def _steps(self) -> np.ndarray:
        layers, span = len(self.tops), float(np.ptp(self.measured))
        logarithms = np.full(self.friction.stop, _STEP)
        last = [_STEP, _STEP_CUTTING * span, _STEP_CONTACT * self.solid.condensed.spacing]
        return np.concatenate([logarithms, np.full(layers, _STEP_CUTTING * span), last])

    def _bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest numbers."""
        layers, span = np.ones(len(self.tops)), float(np.ptp(self.measured))
        contact, reach = self.curve.contact_depth, _CONTACT * (self.curve.depth.max() - self.curve.contact_depth)
        ends = []
        for side, friction, cutting in ((-1.0, _FRICTION[0], -1e-12), (1.0, _FRICTION[1], 10.0 * span)):
            moduli = np.full(self.moduli.stop, side * np.log(_MODULUS))
            last = [side * np.log(_RATIO), side * np.inf, contact + side * reach]
            ends.append(np.concatenate([moduli, np.log(friction) * layers, cutting * layers, last]))
        return ends[0], ends[1]

    def _starts(self) -> Iterator[list[np.ndarray]]:
        """Friction and cutting force of a line through the force while the needle cuts, or shares of the largest, each
        with the likeliest moduli of two decades to either side."""
        curve, (layers, k) = self.curve, (len(self.tops), self.moduli.stop)
        cuts = curve.used & (curve.depth >= np.maximum.accumulate(curve.depth)) & (curve.depth > curve.contact_depth)
        free = curve.used & (np.arange(len(curve.depth)) < np.argmax(cuts))
        offset = float(np.mean(curve.force[free])) if free.any() else 0.0
        span, reach = float(np.ptp(self.measured)), float(curve.depth.max() - curve.contact_depth)
        slope, level = np.polyfit(curve.depth[cuts] - curve.contact_depth, curve.force[cuts] - offset, 1)
        top = max(float(self.measured.max()) - offset, 0.1 * span)
        shared = [((1.0 - share) * top / reach, share * top) for share in _SHARES]
        straight = max(slope, 0.1 * span / reach), np.clip(level, 0.01 * span, span)
        for friction, cutting in [straight, *shared]:
            known = np.full(layers, np.log(friction)), np.full(layers, cutting), [0.0, offset, curve.contact_depth]
            starts = [np.concatenate([np.full(k, factor), *known]) for factor in _FACTORS]
            yield sorted(starts, key=lambda start: float(np.sum(self.residual(start) ** 2)))[:_LIKELIEST]


@dataclass(frozen=True, eq=False)
class Solutions:
    """The solutions of a curve that fit as well as noise allows, the best first, what is found from there along half
    the spacing, and ends of intervals that hold them and as much again beyond: errors of spacing, steps and cells fall
    in proportion to them or faster, but not always in one direction."""

    as_good: list[Found]
    other: Found
    low: np.ndarray
    high: np.ndarray


def solutions(
    search: InsertionSearch, optima: Sequence[Found], tissue: Tissue, path: NeedlePath, labels: Sequence[str]
) -> Solutions:
    """Those of optima, the best first, that are as good; the other is the same where nothing finer can be solved."""
    best, as_good = optima[0], [optima[0]]
    for each in optima[1:]:
        near = [np.all(np.abs(each.numbers - known.numbers) < known.errors) for known in as_good]
        if each.cost - best.cost <= AS_GOOD * best.long_run and not any(near):
            as_good.append(each)
    try:
        finer = replace(search, solid=_finer(tissue, path, tuple(labels)), steps=2)
        other = min((finer.polished(each.numbers) for each in as_good[:_FOLLOWED_ON]), key=lambda each: each.cost)
    except InputError:
        other = best
    change, half = other.numbers - best.numbers, TWO_SIDED * best.errors
    numbers = np.array([each.numbers for each in as_good] + [best.numbers - change, best.numbers + 2.0 * change])
    return Solutions(as_good, other, numbers.min(axis=0) - half, numbers.max(axis=0) + half)


@lru_cache(maxsize=4)
def _finer(tissue: Tissue, path: NeedlePath, labels: tuple[str, ...]) -> StiffnessByLabel:
    """Along half the spacing, in the plane in cells of half the size."""
    if tissue.mesh.dimension == 2 and 4 * tissue.unknowns <= _MAX_REFINED:
        tissue = Tissue(tissue.mesh.refined(), tissue.materials, **tissue.options)
    return stiffness_by_label(tissue, replace(path, spacing=0.5 * path.nodes[1]), labels)


def _parts(inwards: float, outwards: float, cutting: float) -> tuple:
    """Laws of a layer that the tip breaks through at once."""
    friction = laws.Karnopp(
        coulomb_in=inwards, coulomb_out=-outwards, viscous_in=0.0, viscous_out=0.0,
        static_in=inwards, static_out=-outwards,
    )  # fmt: skip
    contact, puncture = laws.Polynomial(linear=_STIFF_CONTACT, quadratic=0.0), laws.PunctureForce(force=0.0)
    return contact, puncture, friction, laws.ConstantCutting(force=max(cutting, 0.0), unloading=1e-6)


def uncertainty(jacobian: np.ndarray, residual: np.ndarray) -> tuple[float, np.ndarray]:
    """Long-run variance [N^2] of the residual, and the covariance of the numbers for such noise; what has no effect is
    not determined. Where blocks of the curve pull at a number more strongly than noise does, their scatter counts."""
    size = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-30)
    _, values, rows = np.linalg.svd(jacobian / size, full_matrices=False)
    inverse = (rows.T / np.maximum(values, 1e-9) ** 2) @ rows
    noise = noise_of(residual, len(residual), lost=jacobian.shape[1]).long_run
    noise = slow_noise(residual, jacobian[: len(residual)], noise)
    pulls = (jacobian / size)[: len(residual)] * residual[:, None]
    pulls = np.array([block.sum(axis=0) for block in np.array_split(pulls, _BLOCKS)]) @ inverse
    scatter = np.sum(pulls**2, axis=0) * _BLOCKS / max(_BLOCKS - len(size), 1)
    wider = np.sqrt(np.maximum(scatter / (noise * np.diagonal(inverse)), 1.0))
    return noise, noise * inverse * np.outer(wider / size, wider / size)


def misfit(residual: np.ndarray, depth: np.ndarray) -> str:
    """What a fit leaves beyond the noise, and where along the depth (n,) [m]; nothing where noise explains it: white
    noise, or what a few samples share if that is more."""
    shared = np.mean([core.second_difference_noise(residual[first::_APART]) for first in range(_APART)])
    noise = max(core.second_difference_noise(residual), float(shared))
    rms = float(np.sqrt(np.mean(residual**2)))
    if rms <= _MISFIT * noise:
        return ""
    worst = max(np.array_split(np.arange(len(depth)), _PLACES), key=lambda part: np.mean(residual[part] ** 2))
    way = "in" if depth[worst[-1]] > depth[worst[0]] else "out"
    place = f"at {1e3 * np.mean(depth[worst]):.3g} mm on the way {way}wards"
    return f"The fit leaves {plain(rms, 'N')} rms, {rms / noise:.3g} times the noise, most of it {place}"
