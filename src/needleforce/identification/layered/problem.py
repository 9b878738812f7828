# SPDX-License-Identifier: Apache-2.0
"""Residuals of the layered law over several repeats, and the search of their smallest sum of squares in the core."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ... import core
from ...models.parameter_units import UNITS
from ..estimates import Estimate
from ..statistics.noise import TWO_SIDED, noise_of
from .binned_cycle import COARSE, BinnedCycle
from .parameters import COEFFICIENT, MM, PER_LAYER, RESTING_SURFACE, TISSUE_STIFFNESS, TOP, LayeredParameters, prefix

FREE_RIDGE, TIED_RIDGE = 3e-4, 0.3
"""[1/mm] Residual per distance of a puncture from the mean: small, for layers that a run does not reach; and large, so
that all runs have one puncture depth."""
TOP_MARGIN_MM = 0.5  # [mm] by which the first layer may begin above the smallest contact depth
MIN_BINS = min(COARSE.values())  # of a stroke in the search
REFUSED_RESIDUAL = 1e3  # [scale] for values that the core refuses
BEYOND_LIMIT = np.log(2.0)  # of the logarithm of a known stiffness outside the usual limits, to the limit that it sets


@dataclass(frozen=True, kw_only=True)
class KnownStiffness:
    """A layer's stiffness of dragged tissue that is known before the fit, one row more of the least squares.

    Attributes
    ----------
    layer : int
        The layer, 0 at the surface.
    value, relative_error : float
        The stiffness [N/m], and the standard deviation of its logarithm.
    noise : float
        Variance of the residuals by which the row is weighted; 0 as long as no fit has shown it.
    alone, alone_error : float
        The stiffness [N/m] by the recordings alone, and the standard error of its logarithm.
    contradicted : bool
        True if the recordings alone contradict it.
    """

    layer: int
    value: float
    relative_error: float
    noise: float = 0.0
    alone: float = np.nan
    alone_error: float = np.inf
    contradicted: bool = False

    @property
    def place(self) -> int:
        """Its index in x."""
        return PER_LAYER * self.layer + TISSUE_STIFFNESS

    @property
    def name(self) -> str:
        """The name of the parameter."""
        return f"{prefix(self.layer)}tissue_stiffness"

    @property
    def weight(self) -> float:
        """Factor of the square of its logarithm's error in the sum of squares. Minus twice the logarithm of the
        likelihood is that sum over the noise, and of the prior the square over that of the relative error."""
        return self.noise / self.relative_error / self.relative_error

    @property
    def text(self) -> str:
        """What is known, in words."""
        return f"{self.value:.4g} N/m within {100 * self.relative_error:.3g} % known beforehand"


@dataclass(frozen=True, eq=False, kw_only=True)
class Problem:
    """The law with ``unknowns`` and the ``cycles`` of the repeats, in a ``form`` of ``LAYERED``.

    ``ridge`` keeps the punctures of the runs near their mean: ``FREE_RIDGE`` or ``TIED_RIDGE``. ``speed`` [m/s] is that
    to which the parameters refer, ``known`` what is known of springs beforehand; ``limits`` are lowest and highest x
    where these cycles are parts of others, whose limits they are.
    """

    cycles: tuple[BinnedCycle, ...]
    unknowns: LayeredParameters
    form: str
    speed: float
    ridge: float = FREE_RIDGE
    known: tuple[KnownStiffness, ...] = ()
    limits: tuple[np.ndarray, np.ndarray] | None = None

    @cached_property
    def _core(self) -> core.LayeredProblem:
        """The problem over these cycles in the core."""
        unknowns = self.unknowns
        repeats = [
            (
                cycle.depth,
                cycle.dt,
                cycle.force,
                cycle.weight,
                float(np.log(cycle.speed / self.speed)),
                cycle.zero_column,
            )
            for cycle in self.cycles
        ]
        return core.LayeredProblem(
            form=self.form,
            layers=unknowns.layers,
            times=unknowns.times,
            brittleness=unknowns.brittleness,
            ridge=self.ridge,
            repeats=repeats,
            priors=[(each.place, float(np.log(each.value)), each.weight) for each in self.known],
        )

    @cached_property
    def _free(self) -> np.ndarray:
        """1 (size,) for the fitted values."""
        free = np.ones(self.unknowns.size, np.uint8)
        free[list(self.unknowns.held)] = 0
        return free

    def speed_factor(self, cycle: BinnedCycle, x: np.ndarray) -> float:
        """Factor of the forces at the speed of a cycle."""
        return float((cycle.speed / self.speed) ** x[self.unknowns.speed])

    def residuals(self, run: int, x: np.ndarray) -> np.ndarray:
        """Model minus measured force over the scale, weighted, (m,)."""
        return self._core.residuals(run, x)

    def cost(self, x: np.ndarray) -> float:
        """Half the sum of squares of all residuals, of the punctures' distances from their mean, and of the
        distances from what is known beforehand."""
        return self._core.cost(x)

    def zero(self, run: int, x: np.ndarray) -> Estimate:
        """``force_offset`` [N] of a run: by its free travel, or without any by the complete cycle."""
        cycle, zero = self.cycles[run], self.cycles[run].zero
        value, error, source = zero.value, zero.error, "mean of the free travel"
        if not zero.known:
            residual = self.residuals(run, x)
            value, source = -float(cycle.zero_column @ residual) * cycle.scale, "layered fit"
            long_run = noise_of(residual + value * cycle.weight, len(residual)).long_run
            error = float(cycle.scale * np.sqrt(long_run))
        half = TWO_SIDED * error
        return Estimate("force_offset", value, UNITS["force_offset"], value - half, value + half, source=source)

    def jacobian(self, run: int, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Indices in x on which one run's residuals depend (k,), and their derivatives (m, k), by differences."""
        places, columns = self._core.jacobian(run, x, self._free)
        return np.array(places), columns.T

    def solve(self, x: np.ndarray, max_steps: int) -> tuple[np.ndarray, float]:
        """Least squares from x in at most ``max_steps`` steps: the vector, and half the sum of squares."""
        return self._core.search(x, self._free, *self.bounds, max_steps, False)

    def settled(self, x: np.ndarray, max_steps: int) -> tuple[np.ndarray, float]:
        """``solve`` and scans of the parameters at which the force jumps, in turn, as long as the cost decreases."""
        return self._core.search(x, self._free, *self.bounds, max_steps, True)

    @cached_property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest x (size,): a layer begins between the smallest contact depth, with a margin, and the
        deepest point, its surface comes to rest inside the tissue, and no spring is stiffer than one that the largest
        force strains by a bin of the search. A stiffer one is a rigid body: it would fit the noise of the depth. A
        limit moves beyond a stiffness that is known beforehand."""
        if self.limits is not None:
            return self.limits
        low, high = self.unknowns.bounds()
        first = PER_LAYER * np.arange(self.unknowns.layers)
        contact = min(cycle.contact for cycle in self.cycles)
        deepest = max(cycle.deepest for cycle in self.cycles)
        low[first + TOP] = contact / MM - TOP_MARGIN_MM
        high[first + TOP] = deepest / MM
        low[self.unknowns.shared :] += low[TOP]
        high[self.unknowns.shared :] += high[TOP]
        strain = (deepest - contact) / MIN_BINS
        peak = max(cycle.peak for cycle in self.cycles)
        high[first + TISSUE_STIFFNESS] = np.log(max(peak / strain, 1.0))
        high[first + COEFFICIENT] = np.log(max(peak / strain**2, 10.0))
        low[first + RESTING_SURFACE], high[first + RESTING_SURFACE] = 0.0, (deepest - contact) / MM
        for place, value in ((each.place, np.log(each.value)) for each in self.known):
            if not low[place] <= value <= high[place]:
                low[place], high[place] = min(low[place], value - BEYOND_LIMIT), max(high[place], value + BEYOND_LIMIT)
        return low, high

    def squares_by_puncture(self, run: int, layer: int, x: np.ndarray, depths: np.ndarray) -> np.ndarray:
        """Sums of squares (k,) of the residuals of a run for depths (k,) [mm] of a layer's rupture."""
        return np.nan_to_num(self._core.squares_by_puncture(run, layer, x, depths), nan=REFUSED_RESIDUAL)
