# SPDX-License-Identifier: Apache-2.0
"""Residuals of the layered law over several repeats, and Levenberg-Marquardt on them within bounds."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ... import core
from .binned_cycle import BinnedCycle
from .parameters import MM, PER_LAYER, RESTING_SURFACE, TOP, LayeredParameters

FREE_RIDGE, TIED_RIDGE = 3e-4, 0.3
"""[1/mm] Residual per distance of a puncture from the mean: small, for layers that a run does not reach; and large, so
that all runs have one puncture depth."""
TOP_MARGIN_MM = 0.5  # [mm] by which the first layer may begin above the smallest contact depth
MAX_ROUNDS, MIN_GAIN = 3, 1e-3  # of fit and scan in turn; relative gain of a round below which they end
SCAN_OFFSETS_MM = np.append(np.arange(-1.0, 1.01, 0.1), 0.0)  # [mm] around the resting surface
REFUSED_RESIDUAL = 1e3  # [scale] for values that the core refuses
DAMPING_DECREASE, DAMPING_INCREASE = 0.2, 4.0
FIRST_DAMPING, MIN_DAMPING, MAX_DAMPING = 1e-3, 1e-12, 1e8
MIN_STEP_GAIN = 1e-5  # relative gain of a step below which …
MAX_IDLE_STEPS = 3  # … so many steps in a row end the descent
Equations = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True, eq=False, kw_only=True)
class Problem:
    """The law with ``unknowns`` and the ``cycles`` of the repeats, in a ``form`` of ``LAYERED``.

    ``ridge`` keeps the punctures of the runs near their mean: ``FREE_RIDGE`` or ``TIED_RIDGE``. ``speed`` [m/s] is that
    to which the parameters refer.
    """

    cycles: tuple[BinnedCycle, ...]
    unknowns: LayeredParameters
    form: str
    speed: float
    ridge: float = FREE_RIDGE

    def by_layer(self, cycle: BinnedCycle, xs: np.ndarray, punctures: np.ndarray) -> np.ndarray:
        """Forces (k, layers, m) [N] of every layer along a cycle for vectors (k, shared or more) and punctures
        (k, layers) [mm]; the total force is their sum."""
        rows = self.unknowns.rows(xs, punctures)
        forces = core.layer_forces(rows.reshape(-1, rows.shape[-1]), self.form, cycle.depth, cycle.dt)
        return forces.reshape(*rows.shape[:2], -1) * self._factor(cycle, xs)[:, None, None]

    def _factor(self, cycle: BinnedCycle, xs: np.ndarray) -> np.ndarray:
        """Factor (k,) of the forces at the speed of a cycle."""
        return (cycle.speed / self.speed) ** xs[:, self.unknowns.speed]

    def along(self, cycle: BinnedCycle, xs: np.ndarray, punctures: np.ndarray) -> np.ndarray:
        """The total force (k, m) [N] along a cycle, with arguments as in ``by_layer``."""
        return self.by_layer(cycle, xs, punctures).sum(axis=1)

    def residuals(self, run: int, x: np.ndarray) -> np.ndarray:
        """Model minus measured force over the scale, weighted, (m,)."""
        cycle = self.cycles[run]
        found = (self.along(cycle, x[None], self.unknowns.punctures(x)[run][None])[0] - cycle.force) * cycle.weight
        return np.nan_to_num(found, nan=REFUSED_RESIDUAL)

    def cost(self, x: np.ndarray) -> float:
        """Half the sum of squares of all residuals, and of the punctures' distances from their mean."""
        own = [self.residuals(run, x) for run in range(len(self.cycles))]
        punctures = self.unknowns.punctures(x)
        distance = self.ridge * (punctures - punctures.mean(axis=0)).ravel()
        return 0.5 * float(sum(each @ each for each in own) + distance @ distance)

    def jacobian(self, run: int, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Indices in x on which one run's residuals depend (k,), and their derivatives (m, k), by differences.

        A value of one layer changes only the force of that layer; the others are not computed again.
        """
        cycle, unknowns = self.cycles[run], self.unknowns
        places, steps = unknowns.run_places(run), unknowns.steps()
        xs = x + steps * np.eye(unknowns.size)[places]
        punctures = xs[:, unknowns.punctures_of(run)]
        affected = np.array([unknowns.affected_layers(place) for place in places])
        base = self.by_layer(cycle, x[None], x[None, unknowns.punctures_of(run)])[0]
        rows, (moved, layer) = unknowns.rows(xs, punctures)[affected], np.nonzero(affected)
        forces = core.layer_forces(rows, self.form, cycle.depth, cycle.dt)
        changes = forces * self._factor(cycle, xs)[moved, None] - base[layer]
        slopes = np.add.reduceat(changes, np.concatenate([[0], affected.sum(axis=1).cumsum()[:-1]]), axis=0)
        return places, (np.nan_to_num(slopes / steps[places, None]) * cycle.weight).T

    def equations(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """J'J (size, size) and J'r (size,) of the cost."""
        gram, slope = np.zeros((len(x), len(x))), np.zeros(len(x))
        for run in range(len(self.cycles)):
            places, jacobian = self.jacobian(run, x)
            gram[np.ix_(places, places)] += jacobian.T @ jacobian
            slope[places] += jacobian.T @ self.residuals(run, x)
        unknowns = self.unknowns
        centred = np.eye(unknowns.runs) - 1.0 / unknowns.runs
        gram[unknowns.shared :, unknowns.shared :] += self.ridge**2 * np.kron(centred, np.eye(unknowns.layers))
        punctures = unknowns.punctures(x)
        slope[unknowns.shared :] += self.ridge**2 * (punctures - punctures.mean(axis=0)).ravel()
        return gram, slope

    def solve(self, x: np.ndarray, max_steps: int) -> tuple[np.ndarray, float]:
        """Least squares from x in at most ``max_steps`` steps: the vector, and half the sum of squares."""
        free, full = self.unknowns.free, x.copy()
        low, high = self.bounds()

        def filled(part: np.ndarray) -> np.ndarray:
            full[free] = part
            return full

        def equations(part: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            gram, slope = self.equations(filled(part))
            return gram[np.ix_(free, free)], slope[free]

        found, cost = descend(
            x[free], lambda part: self.cost(filled(part)), equations, (low[free], high[free]), max_steps
        )
        return filled(found).copy(), cost

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest x (size,): a layer begins between the smallest contact depth, with a margin, and the
        deepest point."""
        low, high = self.unknowns.bounds()
        tops = PER_LAYER * np.arange(self.unknowns.layers) + TOP
        low[tops] = min(cycle.contact for cycle in self.cycles) / MM - TOP_MARGIN_MM
        high[tops] = max(cycle.deepest for cycle in self.cycles) / MM
        low[self.unknowns.shared :] += low[tops].min()
        high[self.unknowns.shared :] += high[tops].max()
        return low, high

    def settled(self, x: np.ndarray, max_steps: int) -> tuple[np.ndarray, float]:
        """``solve`` and scans of the parameters at which the force jumps, in turn, as long as the cost decreases."""
        x, cost = self.solve(x, max_steps)
        for _ in range(MAX_ROUNDS):
            tried, found = self.solve(self._scanned_surfaces(self._scanned_punctures(x)), max_steps)
            gain, x, cost = cost - found, *((tried, found) if found < cost else (x, cost))
            if gain < MIN_GAIN * cost:
                break
        return x, cost

    def _scanned_punctures(self, x: np.ndarray) -> np.ndarray:
        """x with every run's punctures, one by one, at the best of many depths: the force jumps at a puncture."""
        x = x.copy()
        for run, cycle in enumerate(self.cycles):
            own = x[self.unknowns.punctures_of(run)]
            for layer in range(self.unknowns.layers):
                places = np.append(_places(cycle), own[layer])
                tried = np.tile(own, (len(places), 1))
                tried[:, layer] = places
                own[layer] = places[int(np.argmin(self.squares(cycle, np.tile(x, (len(places), 1)), tried)))]
        return x

    def _scanned_surfaces(self, x: np.ndarray) -> np.ndarray:
        """x with every layer's resting surface at the best of many depths: the force jumps at this surface."""
        x = x.copy()
        for layer in range(self.unknowns.layers):
            place = PER_LAYER * layer + RESTING_SURFACE
            tried = np.tile(x, (len(SCAN_OFFSETS_MM), 1))
            tried[:, place] += SCAN_OFFSETS_MM
            squares = sum(
                self.squares(cycle, tried, tried[:, self.unknowns.punctures_of(run)])
                for run, cycle in enumerate(self.cycles)
            )
            x[place] = tried[int(np.argmin(squares)), place]
        return x

    def squares(self, cycle: BinnedCycle, xs: np.ndarray, punctures: np.ndarray) -> np.ndarray:
        """Sums of squares (k,) of the residual over the scale along a cycle."""
        found = (((self.along(cycle, xs, punctures) - cycle.force) * cycle.weight) ** 2).sum(axis=1)
        return np.nan_to_num(found, nan=REFUSED_RESIDUAL)


def _places(cycle: BinnedCycle, step: float = 0.2) -> np.ndarray:
    """Depths [mm] at which a layer may rupture."""
    return np.arange(cycle.contact / MM + step, cycle.deepest / MM + 2.0 * step, step)


def descend(
    x: np.ndarray,
    cost: Callable[[np.ndarray], float],
    equations: Equations,
    bounds: tuple[np.ndarray, np.ndarray],
    max_steps: int,
) -> tuple[np.ndarray, float]:
    """The x (p,) with the lowest ``cost`` (half a sum of squares) after at most ``max_steps`` steps, and this cost.

    ``equations(x)`` gives J'J (p, p) and J'r (p,). Damping is Marquardt's (1963), scaled by the diagonal; a step
    beyond the bounds is limited to them, and a value at a bound with an outward step is held there.
    """
    low, high = bounds
    x = np.clip(x, low, high)
    now, damping, idle = cost(x), FIRST_DAMPING, 0
    gram, slope = equations(x)
    for _ in range(max_steps):
        tried = np.clip(x - _step(gram, slope, damping, x, bounds), low, high)
        then = cost(tried)
        if not then < now:
            damping *= DAMPING_INCREASE
            if damping > MAX_DAMPING:
                break
            continue
        idle = idle + 1 if now - then < MIN_STEP_GAIN * now else 0
        x, now, damping = tried, then, max(DAMPING_DECREASE * damping, MIN_DAMPING)
        if idle == MAX_IDLE_STEPS:
            break
        gram, slope = equations(x)
    return x, now


def _step(
    gram: np.ndarray, slope: np.ndarray, damping: float, x: np.ndarray, bounds: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    low, high = bounds
    at_bound = ((x <= low) & (slope > 0.0)) | ((x >= high) & (slope < 0.0))
    free = np.flatnonzero(~at_bound & (gram.diagonal() > 0.0))
    part = gram[np.ix_(free, free)]
    scale = np.sqrt(part.diagonal())
    scaled = part / np.outer(scale, scale) + damping * np.eye(len(free))
    step = np.zeros_like(x)
    step[free] = np.linalg.solve(scaled, slope[free] / scale) / scale
    return step
