# SPDX-License-Identifier: Apache-2.0
"""The parameters sought by a layered fit, the values of the law that they stand for, and their names."""

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
OF_A_LAYER = {
    "stiffness_coefficient": "N/m^2",
    "saturation_depth": "m",
    "contact_stiffness": "N/m",
    "puncture_depth": "m",
    "puncture_indentation": "m",
    "friction_per_length": "N/m",
    "tissue_stiffness": "N/m",
    "rupture_length": "m",
    "resting_surface": "m",
}
SHARES = {"relaxation_share_1": "1", "relaxation_share_2": "1"}
SIGNED = {"contact_depth", "top", "puncture_depth", "resting_surface", "speed_exponent"}


@dataclass(frozen=True)
class LayeredParameters:
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


def prefix(layer: int) -> str:
    """Nothing for the first layer, layer_2_ for the second."""
    return f"layer_{layer + 1}_" if layer else ""


def units(layers: int, speed: bool = False) -> dict[str, str]:
    """Every name with its SI unit, in the order of ``values``."""
    found = {}
    for layer in range(layers):
        found[f"{prefix(layer)}{'top' if layer else 'contact_depth'}"] = "m"
        found |= {prefix(layer) + name: unit for name, unit in OF_A_LAYER.items()}
    return found | SHARES | ({"speed_exponent": "1"} if speed else {})


def values(unknowns: LayeredParameters, x: np.ndarray, but: int | None = None) -> np.ndarray:
    """The named numbers (p,) of x at the mean punctures, those of the run ``but`` left out; deeper tops below the
    surface, other depths in the recording's zero."""
    punctures = unknowns.punctures(x) if but is None else np.delete(unknowns.punctures(x), but, axis=0)
    rows = unknowns.rows(x[None], punctures.mean(axis=0)[None])[0]
    surface, found = rows[0, 2], []
    for c, saturation, top, puncture, grip, stiffness, rupture, resting in rows[:, :8]:
        place = top - surface if found else top
        slope = 2.0 * c * min(saturation, puncture - top)
        found += [place, c, saturation, slope, puncture, puncture - top, grip, stiffness, rupture, resting]
    exponent = [] if unknowns.speed in unknowns.held else [x[unknowns.speed]]
    return np.array([*found, rows[0, 8], rows[0, 10], *exponent])


def positive(names) -> np.ndarray:
    """True (p,) for the names of numbers that cannot be negative."""
    return np.array([not any(name.endswith(word) for word in SIGNED) for name in names])


def by_unknowns(unknowns: LayeredParameters, x: np.ndarray) -> np.ndarray:
    """Derivatives (p, size) of the named numbers by x."""
    columns, step = [], 1e-5
    for k in range(unknowns.size):
        move = np.zeros(unknowns.size)
        move[k] = step
        up, down = (values(unknowns, x + sign * move) for sign in (1.0, -1.0))
        columns.append((up - down) / (2.0 * step))
    return np.array(columns).T
