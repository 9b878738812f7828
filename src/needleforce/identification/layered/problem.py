# SPDX-License-Identifier: Apache-2.0
"""Residuals of the layered law over several repeats, and Levenberg-Marquardt on them within bounds."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ... import core
from .binned_cycle import BinnedCycle
from .parameters import DIMPLE, MM, PER_LAYER, TOP, LayeredParameters

FREE, TIED = 3e-4, 0.3
"""Residual per mm that a puncture lies off the mean: for layers that a run does not reach; and so that all are one."""
ABOVE = 0.5  # [mm]
ROUNDS, GAIN = 3, 1e-3
NEARBY = np.append(np.arange(-1.0, 1.01, 0.1), 0.0)  # [mm]
REFUSED = 1e3  # times the scale: the core refuses these numbers
SHRINK, GROW = 0.2, 4.0
FIRST, LEAST, MOST = 1e-3, 1e-12, 1e8
SETTLED = 1e-5  # relative gain of a step below which …
PATIENCE = 3  # … so many steps in a row end the descent
Equations = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True, eq=False)
class Problem:
    """The law in ``unknowns`` beside the ``cycles`` of the repeats; ``passive`` says in which of its two forms.

    ``ridge`` holds the punctures of the runs together: ``FREE`` or ``TIED``. ``speed`` [m/s] is that at which the
    numbers hold.
    """

    cycles: tuple[BinnedCycle, ...]
    unknowns: LayeredParameters
    passive: bool
    speed: float
    ridge: float = FREE

    def by_layer(self, cycle: BinnedCycle, xs: np.ndarray, punctures: np.ndarray) -> np.ndarray:
        """Forces (k, layers, m) [N] of every layer along a course for vectors (k, shared or more) and punctures
        (k, layers) [mm]; they add up."""
        rows = self.unknowns.rows(xs, punctures)
        forces = core.layer_forces(rows.reshape(-1, rows.shape[-1]), self.passive, cycle.depth, cycle.dt)
        return forces.reshape(*rows.shape[:2], -1) * self._factor(cycle, xs)[:, None, None]

    def _factor(self, cycle: BinnedCycle, xs: np.ndarray) -> np.ndarray:
        """By which the speed of a course multiplies its forces, (k,)."""
        return (cycle.speed / self.speed) ** xs[:, self.unknowns.speed]

    def along(self, cycle: BinnedCycle, xs: np.ndarray, punctures: np.ndarray) -> np.ndarray:
        """Their sum (k, m) [N]."""
        return self.by_layer(cycle, xs, punctures).sum(axis=1)

    def residuals(self, run: int, x: np.ndarray) -> np.ndarray:
        """Model minus measured force over the scale, weighted, (m,)."""
        cycle = self.cycles[run]
        found = (self.along(cycle, x[None], self.unknowns.punctures(x)[run][None])[0] - cycle.force) * cycle.weight
        return np.nan_to_num(found, nan=REFUSED)

    def cost(self, x: np.ndarray) -> float:
        """Half the sum of squares of all residuals, and of the punctures' distances from their mean."""
        own = [self.residuals(run, x) for run in range(len(self.cycles))]
        punctures = self.unknowns.punctures(x)
        apart = self.ridge * (punctures - punctures.mean(axis=0)).ravel()
        return 0.5 * float(sum(each @ each for each in own) + apart @ apart)

    def jacobian(self, run: int, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Places in x that one run's residuals feel (k,), and their differences by them (m, k).

        A number of one layer moves the force of that layer alone, which saves running the others.
        """
        cycle, unknowns = self.cycles[run], self.unknowns
        places, steps = unknowns.run_places(run), unknowns.steps()
        xs = x + steps * np.eye(unknowns.size)[places]
        punctures = xs[:, unknowns.punctures_of(run)]
        touched = np.array([unknowns.touches(place) for place in places])
        base = self.by_layer(cycle, x[None], x[None, unknowns.punctures_of(run)])[0]
        rows, (moved, layer) = unknowns.rows(xs, punctures)[touched], np.nonzero(touched)
        forces = core.layer_forces(rows, self.passive, cycle.depth, cycle.dt)
        changes = forces * self._factor(cycle, xs)[moved, None] - base[layer]
        slopes = np.add.reduceat(changes, np.concatenate([[0], touched.sum(axis=1).cumsum()[:-1]]), axis=0)
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

    def solve(self, x: np.ndarray, most: int) -> tuple[np.ndarray, float]:
        """Least squares from x in at most ``most`` steps: the vector, and half the sum of squares."""
        free, whole = self.unknowns.free, x.copy()
        low, high = self.bounds()

        def filled(part: np.ndarray) -> np.ndarray:
            whole[free] = part
            return whole

        def equations(part: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            gram, slope = self.equations(filled(part))
            return gram[np.ix_(free, free)], slope[free]

        found, cost = descend(x[free], lambda part: self.cost(filled(part)), equations, (low[free], high[free]), most)
        return filled(found).copy(), cost

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest x (size,): no layer begins far above the contact that is seen, nor below the deepest
        point, wherever the recordings have their zero."""
        low, high = self.unknowns.bounds()
        tops = PER_LAYER * np.arange(self.unknowns.layers) + TOP
        low[tops] = min(cycle.contact for cycle in self.cycles) / MM - ABOVE
        high[tops] = max(cycle.deepest for cycle in self.cycles) / MM
        low[self.unknowns.shared :] += low[tops].min()
        high[self.unknowns.shared :] += high[tops].max()
        return low, high

    def settled(self, x: np.ndarray, most: int) -> tuple[np.ndarray, float]:
        """``solve`` and scans of what jumps, in turn, as long as they gain."""
        x, cost = self.solve(x, most)
        for _ in range(ROUNDS):
            tried, found = self.solve(self._scanned_dimples(self._scanned_punctures(x)), most)
            gain, x, cost = cost - found, *((tried, found) if found < cost else (x, cost))
            if gain < GAIN * cost:
                break
        return x, cost

    def _scanned_punctures(self, x: np.ndarray) -> np.ndarray:
        """x with every run's punctures, one by one, at the best of many places: the force jumps there."""
        x = x.copy()
        for run, cycle in enumerate(self.cycles):
            own = x[self.unknowns.punctures_of(run)]
            for layer in range(self.unknowns.layers):
                places = np.append(_places(cycle), own[layer])
                tried = np.tile(own, (len(places), 1))
                tried[:, layer] = places
                own[layer] = places[int(np.argmin(self.squares(cycle, np.tile(x, (len(places), 1)), tried)))]
        return x

    def _scanned_dimples(self, x: np.ndarray) -> np.ndarray:
        """x with every layer's resting surface at the best of many places: there it lets go at once."""
        x = x.copy()
        for layer in range(self.unknowns.layers):
            place = PER_LAYER * layer + DIMPLE
            tried = np.tile(x, (len(NEARBY), 1))
            tried[:, place] += NEARBY
            squares = sum(
                self.squares(cycle, tried, tried[:, self.unknowns.punctures_of(run)])
                for run, cycle in enumerate(self.cycles)
            )
            x[place] = tried[int(np.argmin(squares)), place]
        return x

    def squares(self, cycle: BinnedCycle, xs: np.ndarray, punctures: np.ndarray) -> np.ndarray:
        """Sums of squares (k,) of the residual over the scale along a course."""
        found = (((self.along(cycle, xs, punctures) - cycle.force) * cycle.weight) ** 2).sum(axis=1)
        return np.nan_to_num(found, nan=REFUSED)


def _places(cycle: BinnedCycle, step: float = 0.2) -> np.ndarray:
    """Depths [mm] at which a layer may give way."""
    return np.arange(cycle.contact / MM + step, cycle.deepest / MM + 2.0 * step, step)


def descend(
    x: np.ndarray,
    cost: Callable[[np.ndarray], float],
    equations: Equations,
    bounds: tuple[np.ndarray, np.ndarray],
    most: int,
) -> tuple[np.ndarray, float]:
    """The least ``cost`` (half a sum of squares) from x (p,) in at most ``most`` steps, and where it lies.

    ``equations(x)`` gives J'J (p, p) and J'r (p,). Damping is Marquardt's (1963), scaled by the diagonal; a step that
    leaves the bounds is cut to them, and what lies at a bound and is pushed outwards is held there.
    """
    low, high = bounds
    x = np.clip(x, low, high)
    now, damping, idle = cost(x), FIRST, 0
    gram, slope = equations(x)
    for _ in range(most):
        tried = np.clip(x - _step(gram, slope, damping, x, bounds), low, high)
        then = cost(tried)
        if not then < now:
            damping *= GROW
            if damping > MOST:
                break
            continue
        idle = idle + 1 if now - then < SETTLED * now else 0
        x, now, damping = tried, then, max(SHRINK * damping, LEAST)
        if idle == PATIENCE:
            break
        gram, slope = equations(x)
    return x, now


def _step(gram: np.ndarray, slope: np.ndarray, damping: float, x: np.ndarray, bounds) -> np.ndarray:
    low, high = bounds
    pushed = ((x <= low) & (slope > 0.0)) | ((x >= high) & (slope < 0.0))
    free = np.flatnonzero(~pushed & (gram.diagonal() > 0.0))
    part = gram[np.ix_(free, free)]
    scale = np.sqrt(part.diagonal())
    scaled = part / np.outer(scale, scale) + damping * np.eye(len(free))
    step = np.zeros_like(x)
    step[free] = np.linalg.solve(scaled, slope[free] / scale) / scale
    return step
