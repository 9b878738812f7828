# SPDX-License-Identifier: Apache-2.0
"""The parameters fitted by a layered fit, the values of the law that they define, and their names."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ...models.parameter_units import unit_of

MM = 1e-3
PER_LAYER = 7
COEFFICIENT, SATURATION, TOP, FRICTION_RATIO, TISSUE_STIFFNESS, RUPTURE_LENGTH, RESTING_SURFACE = range(PER_LAYER)
"""Indices in a layer: log c, log h_s, top [mm], logit rho f'/k_t, log k_t, log delta, z_r - z_0 [mm]."""
MIN_INDENTATION_M = 1e-6  # [m] between the top of a layer and its puncture
SHARP_RUPTURE, NO_SATURATION, NO_RELAXATION = np.log(2e-5), np.log(0.15), -30.0
"""Values of x that remove a mechanism: rupture within 20 um, saturation beyond 150 mm, no relaxing share."""

LOWEST = (np.log(1.0), np.log(2e-4), -500.0, -6.0, np.log(0.1), np.log(2e-5), -30.0)
HIGHEST = (np.log(1e9), np.log(0.15), 500.0, 7.0, np.log(1e6), np.log(3e-2), 60.0)
MIN_COMMON, MAX_COMMON = (-31.0, -4.0, -1.0, -2.5, -2.0, -2.0), (4.0, 4.0, 1.0, 2.5, 2.0, 2.0)
MAX_PUNCTURE_MM = 1e4  # [mm] no insertion is deeper
STEPS = np.array([1e-4, 1e-4, 1e-3, 1e-4, 1e-4, 1e-4, 1e-3])
STEP_PUNCTURE_MM = 0.03  # [mm] a third of a bin: a smaller step leaves the rupture in its bin
OF_A_LAYER = (
    "stiffness_coefficient",
    "saturation_depth",
    "contact_stiffness",
    "puncture_depth",
    "puncture_indentation",
    "friction_per_length",
    "tissue_stiffness",
    "rupture_length",
    "resting_surface",
)
SHARES = ("relaxation_share_1", "relaxation_share_2")
TIMES = ("relaxation_time_1", "relaxation_time_2")
SIGNED = {"contact_depth", "top", "puncture_depth", "resting_surface", "speed_exponent"}


class LayerRow(NamedTuple):
    """The values of one layer in the order of the core's row, SI; each a number or an array over layers."""

    stiffness_coefficient: Any
    """c [N/m^2]."""
    saturation_depth: Any
    """h_s [m]."""
    top: Any
    """z_0 [m], in the recordings' zero."""
    puncture_depth: Any
    """z_1 [m], in the recordings' zero."""
    friction_per_length: Any
    """f' [N/m]."""
    tissue_stiffness: Any
    """k_t [N/m]."""
    rupture_length: Any
    """delta [m]."""
    resting_surface: Any
    """z_r - z_0 [m]."""
    brittleness: Any
    """q [1]."""
    withdrawal_ratio: Any
    """rho [1]."""
    share_1: Any
    """Relaxing share [1] with the time constant ``time_1`` [s]."""
    time_1: Any
    share_2: Any
    """Relaxing share [1] with the time constant ``time_2`` [s]."""
    time_2: Any


@dataclass(frozen=True)
class LayeredParameters:
    """Layout of the vector x: ``layers`` times ``PER_LAYER`` values, two of relaxation, one of speed, one of the
    withdrawal, two of the time constants, punctures [mm] run by run.

    All repeats share everything except the punctures. Relaxation is the logit of the relaxing share, and of the part of
    it with the shorter of two time constants, which are the logarithms of those over ``times`` [s]; all forces change
    with the power ``speed`` of the insertion's speed; ``withdrawal`` is the logarithm of the friction outwards over
    that inwards, the same in all layers. ``held`` are indices in x of values that are not fitted.
    """

    layers: int
    runs: int
    times: tuple[float, float]
    held: frozenset[int] = field(default_factory=frozenset)
    brittleness: float = 0.0

    @property
    def shared(self) -> int:
        """Number of values that the repeats share."""
        return self.constants + 2

    @property
    def relaxing(self) -> int:
        """Index in x of the relaxing share; the part of it with the shorter time is next."""
        return PER_LAYER * self.layers

    @property
    def speed(self) -> int:
        """Index in x of the exponent of the speed."""
        return PER_LAYER * self.layers + 2

    @property
    def withdrawal(self) -> int:
        """Index in x of the logarithm of the friction outwards over that inwards."""
        return PER_LAYER * self.layers + 3

    @property
    def constants(self) -> int:
        """Index in x of the first of the time constants."""
        return PER_LAYER * self.layers + 4

    @property
    def size(self) -> int:
        """Length of x."""
        return self.shared + self.layers * self.runs

    @property
    def free(self) -> np.ndarray:
        """Indices in x of the fitted values."""
        return np.array([k for k in range(self.size) if k not in self.held])

    def punctures(self, x: np.ndarray) -> np.ndarray:
        """The punctures (runs, layers) [mm]."""
        return x[self.shared :].reshape(self.runs, self.layers)

    def steps(self) -> np.ndarray:
        """Steps (size,) of the finite differences."""
        common, punctures = np.full(6, 1e-4), np.full(self.layers * self.runs, STEP_PUNCTURE_MM)
        return np.concatenate([np.tile(STEPS, self.layers), common, punctures])

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest x (size,)."""
        ends = zip((LOWEST, HIGHEST), (MIN_COMMON, MAX_COMMON), (-MAX_PUNCTURE_MM, MAX_PUNCTURE_MM))
        low, high = (
            np.concatenate([np.tile(layer, self.layers), common, np.full(self.layers * self.runs, puncture)])
            for layer, common, puncture in ends
        )
        return low, high

    def in_order(self, x: np.ndarray) -> np.ndarray:
        """x with its layers from the surface down."""
        own = x[: self.relaxing].reshape(self.layers, PER_LAYER)
        order = np.argsort(own[:, TOP], kind="stable")
        common = x[self.relaxing : self.shared]
        return np.concatenate([own[order].ravel(), common, self.punctures(x)[:, order].ravel()])

    def rows(self, xs: np.ndarray, punctures: np.ndarray) -> np.ndarray:
        """Rows (k, layers, 14) for the core, each in the order of ``LayerRow``, from x (k, shared or more) and
        punctures (k, layers) [mm]."""
        own = xs[:, : self.relaxing].reshape(len(xs), self.layers, PER_LAYER)
        tissue_stiffness, top = np.exp(own[..., TISSUE_STIFFNESS]), MM * own[..., TOP]
        relaxing, short = (logistic(xs[:, self.relaxing + k])[:, None] for k in (0, 1))
        ratio = np.exp(xs[:, self.withdrawal])[:, None]
        times = (time * np.exp(xs[:, self.constants + k])[:, None] for k, time in enumerate(self.times))
        at = np.maximum(MM * punctures, top + MIN_INDENTATION_M)
        row = LayerRow(
            stiffness_coefficient=np.exp(own[..., COEFFICIENT]),
            saturation_depth=np.exp(own[..., SATURATION]),
            top=top,
            puncture_depth=at,
            friction_per_length=tissue_stiffness * logistic(own[..., FRICTION_RATIO]) / ratio,
            tissue_stiffness=tissue_stiffness,
            rupture_length=np.exp(own[..., RUPTURE_LENGTH]),
            resting_surface=np.minimum(MM * own[..., RESTING_SURFACE], at - top),
            brittleness=self.brittleness,
            withdrawal_ratio=ratio,
            share_1=relaxing * short,
            time_1=next(times),
            share_2=relaxing * (1 - short),
            time_2=next(times),
        )
        return np.stack(np.broadcast_arrays(*row), axis=-1)


def logistic(x: Any) -> Any:
    """1 / (1 + exp(-x)) without overflow."""
    return 0.5 * (1.0 + np.tanh(0.5 * x))


def prefix(layer: int) -> str:
    """Nothing for the first layer, layer_2_ for the second."""
    return f"layer_{layer + 1}_" if layer else ""


def units(unknowns: LayeredParameters) -> dict[str, str]:
    """Every name with its SI unit, in the order of ``values``."""
    names: list[str] = []
    for layer in range(unknowns.layers):
        names += [prefix(layer) + name for name in ("top" if layer else "contact_depth", *OF_A_LAYER)]
    common = {"speed_exponent": unknowns.speed, "withdrawal_ratio": unknowns.withdrawal}
    common |= {name: unknowns.constants + k for k, name in enumerate(TIMES)}
    names += [*SHARES, *(name for name, place in common.items() if place not in unknowns.held)]
    return {name: unit_of(name) for name in names}


def values(unknowns: LayeredParameters, x: np.ndarray, excluded: int | None = None) -> np.ndarray:
    """The named values (p,) of x at the mean punctures without those of the run ``excluded``; deeper tops below the
    surface, other depths in the recording's zero."""
    punctures = unknowns.punctures(x) if excluded is None else np.delete(unknowns.punctures(x), excluded, axis=0)
    rows = [LayerRow(*row) for row in unknowns.rows(x[None], punctures.mean(axis=0)[None])[0]]
    first, found = rows[0], []
    for row in rows:
        indentation = row.puncture_depth - row.top
        found += [
            row.top - first.top if found else row.top,
            row.stiffness_coefficient,
            row.saturation_depth,
            2.0 * row.stiffness_coefficient * min(row.saturation_depth, indentation),  # contact_stiffness
            row.puncture_depth,
            indentation,
            row.friction_per_length,
            row.tissue_stiffness,
            row.rupture_length,
            row.resting_surface,
        ]
    common = {unknowns.speed: x[unknowns.speed], unknowns.withdrawal: first.withdrawal_ratio}
    common |= {unknowns.constants: first.time_1, unknowns.constants + 1: first.time_2}
    fitted = [value for place, value in common.items() if place not in unknowns.held]
    return np.array([*found, first.share_1, first.share_2, *fitted])


def positive(names: Sequence[str]) -> np.ndarray:
    """True (p,) for the names of values that cannot be negative."""
    return np.array([not any(name.endswith(word) for word in SIGNED) for name in names])


def by_unknowns(unknowns: LayeredParameters, x: np.ndarray) -> np.ndarray:
    """Derivatives (p, size) of the named values by x."""
    columns, step = [], 1e-5
    for k in range(unknowns.size):
        move = np.zeros(unknowns.size)
        move[k] = step
        up, down = (values(unknowns, x + sign * move) for sign in (1.0, -1.0))
        columns.append((up - down) / (2.0 * step))
    return np.array(columns).T
