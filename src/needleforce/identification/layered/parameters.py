# SPDX-License-Identifier: Apache-2.0
"""The numbers sought, and the numbers of the law that they stand for."""

from dataclasses import dataclass, field

import numpy as np

MM = 1e-3
PER_LAYER = 7
COEFFICIENT, SATURATION, TOP, GRIP, STIFFNESS, RUPTURE, DIMPLE = range(PER_LAYER)
"""Places in a layer: log c, log h_s, top [mm], logit f'/k_t, log k_t, log delta, z_r - z_0 [mm]."""
ROW = 12  # numbers in the core: c, h_s, z_0, z_1, f', k_t, delta, z_r - z_0, share, time, share, time
LEAST_INDENTATION = 1e-6  # [m]
SHARP, BARE, NO_FADING = np.log(2e-5), np.log(0.15), -30.0
"""Values that take an element away: rupture within 20 um, a contact that never saturates, nothing that fades."""

LOWEST = (np.log(1.0), np.log(2e-4), -500.0, -6.0, np.log(0.1), np.log(2e-5), -30.0)
HIGHEST = (np.log(1e9), np.log(0.15), 500.0, 7.0, np.log(1e6), np.log(3e-2), 60.0)
LEAST_COMMON, MOST_COMMON = (-31.0, -4.0, -1.0), (4.0, 4.0, 1.0)
FAR = 1e4  # [mm]
STEPS = np.array([1e-4, 1e-4, 1e-3, 1e-4, 1e-4, 1e-4, 1e-3])
STEP_PUNCTURE = 0.03  # [mm] a third of a bin: less moves the rupture into no other bin


@dataclass(frozen=True)
class Unknowns:
    """Layout of the vector x: ``layers`` times ``PER_LAYER`` numbers, two of relaxation, one of speed, punctures [mm]
    run by run.

    All repeats share everything but the punctures. Relaxation is the logit of the share that fades, and of the part
    of it that has the shorter of the two ``times`` [s]; all forces go by the power ``speed`` of the insertion's speed.
    ``held`` are places in x that keep their value.
    """

    layers: int
    runs: int
    times: tuple[float, float]
    held: frozenset[int] = field(default_factory=frozenset)

    @property
    def shared(self) -> int:
        """How many numbers the repeats share."""
        return PER_LAYER * self.layers + 3

    @property
    def fading(self) -> int:
        """Where in x the share stands that fades; the part that fades sooner comes after it."""
        return PER_LAYER * self.layers

    @property
    def speed(self) -> int:
        """Where in x the exponent of the speed stands."""
        return PER_LAYER * self.layers + 2

    @property
    def size(self) -> int:
        """Length of x."""
        return self.shared + self.layers * self.runs

    @property
    def free(self) -> np.ndarray:
        """Places in x that are sought."""
        return np.array([k for k in range(self.size) if k not in self.held])

    def punctures(self, x: np.ndarray) -> np.ndarray:
        """The punctures (runs, layers) [mm]."""
        return x[self.shared :].reshape(self.runs, self.layers)

    def punctures_of(self, run: int) -> slice:
        """Where in x the punctures of one run stand."""
        first = self.shared + run * self.layers
        return slice(first, first + self.layers)

    def touches(self, place: int) -> np.ndarray:
        """True (layers,) for the layers whose force one unknown moves."""
        if place < self.fading:
            layer = place // PER_LAYER
        elif place < self.shared:
            return np.ones(self.layers, bool)
        else:
            layer = (place - self.shared) % self.layers
        return np.arange(self.layers) == layer

    def run_places(self, run: int) -> np.ndarray:
        """Free places in x that the force of one run depends on."""
        own = [*range(self.shared), *range(self.size)[self.punctures_of(run)]]
        return np.array([k for k in own if k not in self.held])

    def steps(self) -> np.ndarray:
        """Steps (size,) of the differences that stand for derivatives."""
        common, punctures = np.full(3, 1e-4), np.full(self.layers * self.runs, STEP_PUNCTURE)
        return np.concatenate([np.tile(STEPS, self.layers), common, punctures])

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest x (size,)."""
        ends = zip((LOWEST, HIGHEST), (LEAST_COMMON, MOST_COMMON), (-FAR, FAR))
        low, high = (
            np.concatenate([np.tile(layer, self.layers), common, np.full(self.layers * self.runs, far)])
            for layer, common, far in ends
        )
        return low, high

    def in_order(self, x: np.ndarray) -> np.ndarray:
        """x with its layers from the surface down."""
        own = x[: self.fading].reshape(self.layers, PER_LAYER)
        order = np.argsort(own[:, TOP], kind="stable")
        common = x[self.fading : self.shared]
        return np.concatenate([own[order].ravel(), common, self.punctures(x)[:, order].ravel()])

    def rows(self, xs: np.ndarray, punctures: np.ndarray) -> np.ndarray:
        """Rows (k, layers, 12) for the core from x (k, shared or more) and punctures (k, layers) [mm], in SI."""
        own = xs[:, : self.fading].reshape(len(xs), self.layers, PER_LAYER)
        stiffness, top = np.exp(own[..., STIFFNESS]), MM * own[..., TOP]
        law = np.empty((len(xs), self.layers, ROW))
        law[..., 0], law[..., 1] = np.exp(own[..., COEFFICIENT]), np.exp(own[..., SATURATION])
        law[..., 2], law[..., 3] = top, np.maximum(MM * punctures, top + LEAST_INDENTATION)
        law[..., 4], law[..., 5] = stiffness * logistic(own[..., GRIP]), stiffness
        law[..., 6], law[..., 7] = np.exp(own[..., RUPTURE]), MM * own[..., DIMPLE]
        law[..., 8:] = self._relaxation(xs)[:, None]
        return law

    def _relaxation(self, xs: np.ndarray) -> np.ndarray:
        """Share, time, share, time, (k, 4)."""
        fades, short = (logistic(xs[:, self.fading + k]) for k in (0, 1))
        ones = np.ones(len(xs))
        return np.column_stack([fades * short, self.times[0] * ones, fades * (1 - short), self.times[1] * ones])


def logistic(x):
    """1 / (1 + exp(-x)) without overflow."""
    return 0.5 * (1.0 + np.tanh(0.5 * x))
