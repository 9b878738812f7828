# SPDX-License-Identifier: Apache-2.0
"""Least squares of the force of an insertion into a condensed solid, and the covariance of what is found."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csc_array

from ... import core
from ...core import laws
from ...identification.statistics.noise import noise_of, slow_noise
from ...models.model import Layer, Model
from ..elastic.condensed import CondensedInsertion, CondensedTissue
from ..elastic.needle_path import NeedlePath
from ..elastic.tissue import Tissue
from .insertion_curve import InsertionCurve

_STEP = 0.03  # of logarithms, in a derivative: a node or two begin to slide meanwhile, so that kinks average out
_STEP_CUTTING = 0.01  # of the range of the force
_STEP_CONTACT = 0.1  # of the path's spacing
_FACTORS = np.log(10.0) * np.linspace(-2.0, 2.0, 7)  # of the given moduli, with which the search begins
_FOLLOWED = 3  # of the starts, to the end
_FIRST_STEPS, MAX_STEPS = 6, 60
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
    """Numbers of the smallest sum of squares, their weighted residual [N], and their covariance."""

    numbers: np.ndarray
    residual: np.ndarray
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
        return numbers[-2] + insertion.run(depth, np.ones(len(depth)))["force"][self.curve.used]

    def residual(self, numbers: np.ndarray) -> np.ndarray:
        """Weighted, of what is used, and last those of the ratio of friction and the depth of contact [N]."""
        away = self.curve.weight[self.curve.used] * (self.force(numbers) - self.measured)
        known = numbers[-3] / _RATIO_ERROR, (numbers[-1] - self.curve.contact_depth) / _CONTACT_ERROR
        return np.append(away, self.noise * np.array(known))

    @cached_property
    def noise(self) -> float:
        """Standard deviation of white noise in the means [N]."""
        return core.second_difference_noise(self.measured)

    def jacobian(self, numbers: np.ndarray) -> np.ndarray:
        """Derivatives of the residual by central differences, (m, p)."""
        columns = []
        for k, step in enumerate(self._steps()):
            move = np.zeros(len(numbers))
            move[k] = step
            up, down = numbers + move, numbers - move
            up[self.cutting], down[self.cutting] = (np.maximum(each[self.cutting], 0.0) for each in (up, down))
            columns.append((self.residual(up) - self.residual(down)) / (up[k] - down[k]))
        return np.array(columns).T

    def found(self) -> Found:
        """The best of several starts: a few steps from all, then more from the best."""
        first = [self.solved(self._start(factor), _FIRST_STEPS) for factor in _FACTORS]
        ahead = sorted(first, key=lambda each: each.cost)[:_FOLLOWED]
        return min((self.solved(each.numbers) for each in ahead), key=lambda each: each.cost)

    def solved(self, start: np.ndarray, steps: int = MAX_STEPS) -> Found:
        """Least squares from some numbers."""
        from scipy.optimize import least_squares

        done = least_squares(
            self.residual, start, self.jacobian, bounds=self._bounds(),
            x_scale=10.0 * self._steps(), max_nfev=steps, xtol=1e-4, ftol=1e-6,
        )  # fmt: skip
        return Found(done.x, done.fun[:-_KNOWN], _covariance(done.jac, done.fun[:-_KNOWN]))

    def sticking(self, numbers: np.ndarray) -> float:
        """Travel [m] after a reversal at the deepest in which the shaft sticks."""
        tissue = self.condensed(numbers)
        embedded = float(np.clip(self.curve.depth.max() - numbers[-1], 2.0 * tissue.spacing, tissue.nodes[-1]))
        inwards = np.exp(numbers[self.friction]) @ np.diff([*np.minimum(self.tops, embedded), embedded])
        change = (1.0 + np.exp(numbers[-3])) * inwards + max(numbers[self.cutting][-1], 0.0)
        return float(change / tissue.bonded_stiffness(embedded))

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

    def _start(self, factor: float) -> np.ndarray:
        """Friction and cutting force of a line through the force while the needle cuts."""
        curve, (layers, k) = self.curve, (len(self.tops), self.moduli.stop)
        cuts = curve.used & (curve.depth >= np.maximum.accumulate(curve.depth)) & (curve.depth > curve.contact_depth)
        free = curve.used & (np.arange(len(curve.depth)) < np.argmax(cuts))
        offset = float(np.mean(curve.force[free])) if free.any() else 0.0
        span = float(np.ptp(self.measured))
        slope, level = np.polyfit(curve.depth[cuts] - curve.contact_depth, curve.force[cuts] - offset, 1)
        slope = max(slope, 0.1 * span / (curve.depth.max() - curve.contact_depth))
        friction, cutting = np.full(layers, np.log(slope)), np.full(layers, np.clip(level, 0.01 * span, span))
        return np.concatenate([np.full(k, factor), friction, cutting, [0.0, offset, curve.contact_depth]])


def _parts(inwards: float, outwards: float, cutting: float) -> tuple:
    """Laws of a layer that the tip breaks through at once."""
    friction = laws.Karnopp(
        coulomb_in=inwards, coulomb_out=-outwards, viscous_in=0.0, viscous_out=0.0,
        static_in=inwards, static_out=-outwards,
    )  # fmt: skip
    contact, puncture = laws.Polynomial(linear=_STIFF_CONTACT, quadratic=0.0), laws.PunctureForce(force=0.0)
    return contact, puncture, friction, laws.ConstantCutting(force=max(cutting, 0.0), unloading=1e-6)


def _covariance(jacobian: np.ndarray, residual: np.ndarray) -> np.ndarray:
    """Of the numbers, for noise with the long-run variance of the residual; what has no effect is not determined."""
    noise = noise_of(residual, len(residual), lost=jacobian.shape[1]).long_run
    noise = slow_noise(residual, jacobian[: len(residual)], noise)
    size = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-30)
    _, values, rows = np.linalg.svd(jacobian / size, full_matrices=False)
    inverse = (rows.T / np.maximum(values, 1e-9) ** 2) @ rows
    return noise * inverse / np.outer(size, size)
