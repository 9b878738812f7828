# SPDX-License-Identifier: Apache-2.0
"""Least squares of the force of an insertion into a condensed solid, and the covariance of what is found."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from ... import core
from ...core import laws
from ...display.quantities import plain
from ...errors import InputError
from ...identification.statistics.noise import SIGNIFICANT, TWO_SIDED, noise_of, slow_noise
from ...models.model import Layer, Model
from ...vocabulary import SMALLEST
from ..elastic.condensed import CondensedInsertion, CondensedTissue
from ..elastic.needle_path import NeedlePath
from ..elastic.shaft_stiffness import StiffnessByLabel, stiffness_by_label
from ..elastic.tissue import Tissue
from .insertion_curve import InsertionCurve

_STEP = 0.03  # of logarithms, in a derivative: a node or two begin to slide meanwhile, so that kinks average out
_STEP_CUTTING = 0.01  # of the range of the force
_STEP_CONTACT = 0.1  # of the path's spacing
_STEP_BRANCH, _STEP_SPRING = (0.01, 0.05), 0.05  # of a share that relaxes, and of logarithms of a time and a travel
_SCALES = 5.0, 2.0, 1.0, 0.5  # of these steps, in turn: wide ones see past kinks, narrow ones end between them
_FACTORS = np.log(10.0) * np.linspace(-2.0, 2.0, 7)  # of the given moduli, with which the search begins
# friction and cutting at the start, of the largest force: a shaft that mostly sticks may bear several times as much
_SHARES = (0.9, 0.1), (0.5, 0.5), (0.1, 0.9), (3.6, 0.1), (2.0, 0.5)
_LIKELIEST = 2  # of these
_FOLLOWED, _FOLLOWED_ON = 4, 2  # of the starts to the end; of the ends along another spacing
_ANEW = 8  # starts of a search for what relaxes, where nothing else fits
_FIRST_STEPS, MAX_STEPS = 6, 60
_BLOCKS = 20  # of successive means
AS_GOOD = 3.84  # [long-run variances] more in the sum of squares: so much noise takes from the truth in 1 of 20
_MISFIT = 1.5  # [of the noise] residual of a model that is wrong; of noise, AR(1) up to 0.8, in 2 of 1000 at most
_APART = 8  # samples from one to the next that has no noise in common with it
_PLACES = 40  # among which the largest residual is named
_MAX_REFINED = 200_000  # unknowns of a solid that is refined in addition
_THROUGH = laws.Polynomial(linear=1e6, quadratic=0.0), laws.PunctureForce(force=0.0)  # a tip that does so at once
_FASTEST, _SHORTEST = 1e3, 1e-6  # [m/s], [s] limits that no step meets
_MAX, _LIKELY = 0.95, 0.6  # share that relaxes, at most and at the start
_BRANCHES, _TIMES = 2, 9  # that are looked for, at most; time constants among which one is
_SPRING, _SPRINGS = (1e-8, 5e-3), (20e-6, 50e-6, 100e-6, 200e-6)  # [m] limits of a spring's travel, and the first ones
_SHOWN = 12.0  # [long-run variances] less in the sum of squares: noise gives that much in 1 of 100
_MODULUS, _FRICTION, _RATIO = 1e4, (1e-6, 1e4), 10.0  # limits of a factor, of friction per length [N/m], of its ratio
_KNOWN = 2  # numbers that are known within some error without the force
_RATIO_ERROR = 0.5  # standard error of the logarithm of the ratio, as long as the shaft has not slid outwards
_CONTACT_ERROR = 0.3e-3  # of the depth of contact [m], as long as the force does not show it better
_CONTACT = 0.25  # [of the deepest indentation] by which the contact may be elsewhere


@dataclass(frozen=True, eq=False)
class Found:
    """Numbers of the smallest sum of squares, their weighted residual [N] and its derivatives, its long-run variance
    [N^2], and their covariance."""

    numbers: np.ndarray
    residual: np.ndarray
    jacobian: np.ndarray
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

    def part(self, effect: np.ndarray) -> tuple[float, float]:
        """How much of an effect on the force (m,) is in the residual, next to those of the numbers, with its error."""
        basis = np.linalg.qr(self.jacobian)[0]
        effect = effect - basis @ (basis.T @ effect)
        seen = max(float(effect @ effect), SMALLEST)
        return -float(effect @ self.residual) / seen, float(np.sqrt(self.long_run / seen))


@dataclass(frozen=True, eq=False)
class InsertionSearch:
    """A curve, the solid, and the depths [m] at which layers of other friction and cutting force begin along the path.

    Numbers are logarithms of the factors of k moduli, logarithms of friction per length [N/m] and cutting force [N] of
    j layers, of each branch that relaxes its share of what the others left and the logarithm of its time constant [s],
    logarithms of the travel [m] of a spring at the shaft and of friction outwards over inwards, which is 1 behind a
    spring, force offset [N] and contact depth [m].
    """

    curve: InsertionCurve
    solid: StiffnessByLabel
    tops: tuple[float, ...] = (0.0,)
    branches: int = 0
    sprung: bool = False
    steps: int = 1  # from one mean to the next

    @cached_property
    def _places(self) -> list[slice]:
        """Of logarithms of factors of moduli, and of friction per length, cutting forces, and branches."""
        counts = len(self.solid.shares) - 1, len(self.tops), len(self.tops), 2 * self.branches
        return [slice(end - count, end) for count, end in zip(counts, np.cumsum(counts).tolist())]

    moduli, friction, cutting, relaxation = (property(lambda self, k=k: self._places[k]) for k in range(4))

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
        spring = float(np.exp(numbers[self.relaxation.stop])) if self.sprung else None
        cutting = [laws.ConstantCutting(force=max(each, 0.0), unloading=1e-6) for each in numbers[self.cutting]]
        parts = [(*_THROUGH, _friction(f, ratio * f, spring), cut) for f, cut in zip(inwards, cutting)]
        relaxation = _prony(numbers[self.relaxation])
        deeper = tuple(Layer(top, *each, relaxation) for top, each in zip(self.tops[1:], parts[1:]))
        return Model(*parts[0], relaxation=relaxation, deeper=deeper)

    def force(self, numbers: np.ndarray) -> np.ndarray:
        """Of the needle in the solid, at what is used of the curve [N]."""
        tissue = self.condensed(numbers)
        insertion = CondensedInsertion(tissue, self.model(numbers), max_speed=_FASTEST)
        depth, dt = self._motion
        depth = np.minimum(depth - numbers[-1], tissue.nodes[-1])
        return numbers[-2] + insertion.run(depth, dt)["force"][:: self.steps][self.curve.used]

    @cached_property
    def _motion(self) -> tuple[np.ndarray, np.ndarray]:
        """Depth [m] and time since the last [s] of each step."""
        means, steps = np.arange(len(self.curve.depth)), self.steps
        fine = np.arange(steps * means[-1] + 1) / steps
        depth, time = (np.interp(fine, means, each) for each in (self.curve.depth, self.curve.time))
        return depth, np.append(1.0, np.maximum(np.diff(time), _SHORTEST))

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
        columns, (low, high) = [], self._bounds()
        for k, step in enumerate(scale * self._steps()):
            move = np.zeros(len(numbers))
            move[k] = step
            up, down = (np.clip(each, low, high) for each in (numbers + move, numbers - move))
            columns.append((self.residual(up) - self.residual(down)) / (up[k] - down[k]))
        return np.array(columns).T

    def optima(self) -> list[Found]:
        """Where searches from several starts end, the best first."""
        return self.followed(list(self._starts()), _FOLLOWED)

    def followed(self, starts: Sequence[np.ndarray], ahead: int) -> list[Found]:
        """Where searches end, the best first: a few steps from all starts, then more from those ahead."""
        first = sorted((self.solved(start, _FIRST_STEPS) for start in starts), key=lambda each: each.cost)
        return sorted((self.polished(each.numbers) for each in first[:ahead]), key=lambda each: each.cost)

    @cached_property
    def times(self) -> tuple[float, float]:
        """Logarithms of the shortest and the longest time constant that the means show [s]."""
        usual = float(np.median(np.diff(self.curve.time)[~self.curve.rests[1:]]))
        return float(np.log(2.0 * usual)), float(np.log(np.ptp(self.curve.time)))

    def misfit(self, found: Found) -> str:
        """What numbers leave beyond the noise, and where; nothing where noise explains it."""
        return misfit(found.residual[:-_KNOWN], self.curve.depth[self.curve.used])

    def cost(self, numbers: np.ndarray) -> float:
        """Sum of squares [N^2]."""
        return float(np.sum(self.residual(numbers) ** 2))

    def extended(self, best: Found) -> tuple["InsertionSearch", list[Found]] | None:
        """The same with what of a branch or a spring the force shows, and where its searches end, the best first."""
        wrong, tried = bool(self.misfit(best)), []
        for search, effects in self.branch(best), self._spring(best):
            effects.sort(key=lambda each: -each[0] / each[1])
            starts = [start for part, _, start in effects[:_LIKELIEST] if part > 0.0]
            visible = bool(starts) and effects[0][0] > TWO_SIDED * effects[0][1]
            first = search.branches > self.branches == 0
            if wrong and first:  # of the best, nothing may be right
                anew = [self._longer(each, 0.5 * _LIKELY, float(np.mean(self.times))) for each in self._starts()]
                starts += sorted(anew, key=search.cost)[:_ANEW]
            if starts and (visible or wrong):
                ends = search.followed(starts, _FOLLOWED_ON)
                needed = 0.0 if first and self.falls else _SHOWN * min(ends[0].long_run, best.long_run)
                tried += [(search, ends)] if best.cost - ends[0].cost > needed else []
        return min(tried, key=lambda each: each[1][0].cost, default=None)

    @cached_property
    def falls(self) -> bool:
        """True where the force changes while the needle rests in the tissue, which only what relaxes does."""
        curve = self.curve
        at = np.flatnonzero(curve.used & curve.rests & (curve.depth > curve.contact_depth))
        runs = [each[[1, -1]] for each in np.split(at, np.flatnonzero(np.diff(at) > 1) + 1) if len(each) > 2]
        still = [ends for ends in runs if np.ptp(curve.depth[ends]) <= curve.resolution]
        errors = [np.ptp(curve.force[ends]) / np.linalg.norm(1.0 / curve.weight[ends]) for ends in still]
        return bool(max(errors, default=0.0) > SIGNIFICANT * self.noise)

    def branch(self, best: Found) -> tuple["InsertionSearch", list[tuple]]:
        """The same with one more branch; for time constants its share in the residual, the error of it, and numbers."""
        more, step, effects = replace(self, branches=self.branches + 1), 5.0 * _STEP_BRANCH[0], []
        for time in np.linspace(*self.times, _TIMES) if self.branches < _BRANCHES else ():
            by = more.residual(self._longer(best.numbers, step, time)) - best.residual
            share, error = best.part(by / step)
            effects.append((share, error, self._longer(best.numbers, np.clip(share, step, _LIKELY), time)))
        return more, effects

    def _spring(self, best: Found) -> tuple["InsertionSearch", list[tuple]]:
        """The same with a spring between shaft and tissue, for several travels how much of it is in the residual."""
        more, effects = replace(self, sprung=True), []
        for travel in () if self.sprung else _SPRINGS:
            soft, rigid = (self._longer(best.numbers, np.log(each)) for each in (travel, _SPRING[0]))
            effects.append((*best.part(more.residual(soft) - more.residual(rigid)), soft))
        return more, effects

    def _longer(self, numbers: np.ndarray, *more: float) -> np.ndarray:
        """Numbers with those of a branch or a spring."""
        return np.insert(numbers, self.relaxation.stop, more)

    def polished(self, numbers: np.ndarray) -> Found:
        """Least squares from some numbers, with derivatives over ever narrower steps."""
        best = self.solved(numbers, scale=_SCALES[0])
        for scale in _SCALES[1:]:
            best = min(best, self.solved(best.numbers, scale=scale), key=lambda each: each.cost)
        return best

    def solved(self, start: np.ndarray, steps: int = MAX_STEPS, scale: float = 1.0) -> Found:
        """Least squares from some numbers."""
        from scipy.optimize import least_squares

        low, high = bounds = self._bounds()
        done = least_squares(
            self.residual, np.clip(start, low, high), lambda numbers: self.jacobian(numbers, scale), bounds=bounds,
            x_scale=10.0 * self._steps(), max_nfev=steps, xtol=1e-4, ftol=1e-6,
        )  # fmt: skip
        return Found(done.x, done.fun, done.jac, *uncertainty(done.jac, done.fun[:-_KNOWN]))

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
        more = self.branches * _STEP_BRANCH + self.sprung * (_STEP_SPRING,)
        last = [_STEP, _STEP_CUTTING * span, _STEP_CONTACT * self.solid.condensed.spacing]
        return np.concatenate([logarithms, np.full(layers, _STEP_CUTTING * span), more, last])

    def _bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest numbers."""
        layers, span = np.ones(len(self.tops)), float(np.ptp(self.measured))
        contact, reach = self.curve.contact_depth, _CONTACT * (self.curve.depth.max() - self.curve.contact_depth)
        shares, cuttings, ends = (-1e-9, _MAX), (-1e-12, 10.0 * span), []
        for end, side in enumerate((-1.0, 1.0)):
            moduli = np.full(self.moduli.stop, side * np.log(_MODULUS))
            last = [side * np.log(_RATIO), side * np.inf, contact + side * reach]
            more = self.branches * (shares[end], self.times[end]) + self.sprung * (np.log(_SPRING[end]),)
            ends.append(np.concatenate([moduli, np.log(_FRICTION[end]) * layers, cuttings[end] * layers, more, last]))
        return ends[0], ends[1]

    def _starts(self) -> Iterator[np.ndarray]:
        """Friction and cutting force of a line through the force while the needle cuts, or shares of the largest, each
        with the likeliest moduli of two decades to either side."""
        curve, (layers, k) = self.curve, (len(self.tops), self.moduli.stop)
        cuts, free = curve.cuts, curve.used & (np.arange(len(curve.depth)) < np.argmax(curve.cuts))
        offset = float(np.mean(curve.force[free])) if free.any() else 0.0
        span, reach = float(np.ptp(self.measured)), float(curve.depth.max() - curve.contact_depth)
        slope, level = np.polyfit(curve.depth[cuts] - curve.contact_depth, curve.force[cuts] - offset, 1)
        top = max(float(self.measured.max()) - offset, 0.1 * span)
        shared = [(friction * top / reach, cutting * top) for friction, cutting in _SHARES]
        straight = max(slope, 0.1 * span / reach), np.clip(level, 0.01 * span, span)
        for friction, cutting in [straight, *shared]:
            last = [*[np.log(_SPRINGS[-1])] * self.sprung, 0.0, offset, curve.contact_depth]
            known = np.full(layers, np.log(friction)), np.full(layers, cutting), last
            starts = [np.concatenate([np.full(k, factor), *known]) for factor in _FACTORS]
            yield from sorted(starts, key=self.cost)[:_LIKELIEST]


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
    """Those of optima, the best first, that are as good, or nearly where none fits; without a finer one, no other."""
    best, as_good = optima[0], [optima[0]]
    allowed = (_MISFIT**2 - 1.0) * best.cost if search.misfit(best) else AS_GOOD * best.long_run
    for each in optima[1:]:
        near = [np.all(np.abs(each.numbers - known.numbers) < known.errors) for known in as_good]
        if each.cost - best.cost <= allowed and not any(near):
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


def _friction(inwards: float, outwards: float, spring: float | None) -> laws.Karnopp | laws.Coulomb:
    """Per length [N/m], or the same in both directions behind a spring with a travel [m] until it slides."""
    if spring:
        return laws.Coulomb(per_length=inwards, presliding=spring, dimple_ratio=0.0)
    return laws.Karnopp(
        coulomb_in=inwards, coulomb_out=-outwards, viscous_in=0.0, viscous_out=0.0,
        static_in=inwards, static_out=-outwards,
    )  # fmt: skip


def branches(numbers: np.ndarray) -> list[tuple[int, float]]:
    """Place of each branch, the shorter time constant first, and what the other leaves it, of 1."""
    left = np.cumprod(np.append(1.0, 1.0 - numbers[::2]))
    return [(2 * int(k), float(left[k])) for k in np.argsort(numbers[1::2])]


def _prony(numbers: np.ndarray) -> laws.NoRelaxation | laws.Prony:
    """The law of branches."""
    named = {}
    for k, (place, left) in enumerate(branches(numbers), 1):
        named |= {f"share_{k}": left * np.clip(numbers[place], 0.0, _MAX), f"time_{k}": np.exp(numbers[place + 1])}
    return laws.Prony(**named) if named else laws.NoRelaxation()


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
