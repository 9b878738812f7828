# SPDX-License-Identifier: Apache-2.0
"""The parameters of a steered insertion that are identified: tissue, tip, guide, and how tip and base were measured."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import InputError


@dataclass(frozen=True)
class Parameter:
    """One identified quantity: its prior is a normal distribution of the value, or of its logarithm."""

    name: str
    unit: str
    center: float
    spread: float  # standard deviation; of the natural logarithm where `positive`
    positive: bool
    low: float
    high: float
    meaning: str

    def inside(self, value: float) -> float:
        """The value as the search sees it."""
        return math.log(value) if self.positive else value

    def outside(self, number: float) -> float:
        """The value of a number of the search."""
        return math.exp(number) if self.positive else number


def _parameters(*rows: tuple) -> tuple[Parameter, ...]:
    return tuple(Parameter(*row) for row in rows)


# The priors are wide: gels to muscle, guides from the skin to a hand's breadth, sensors as they are glued in.
_TISSUE = _parameters(
    ("modulus", "Pa", 3e4, 1.5, True, 1e2, 1e7, "foundation modulus of the tissue that stays"),
    ("tip_force_x", "N", 0.0, 0.3, False, -5.0, 5.0, "lateral force on the tip"),
    ("tip_force_y", "N", 0.0, 0.3, False, -5.0, 5.0, "lateral force on the tip, the other way across"),
)
_YIELDING = _parameters(
    ("yielding_modulus", "Pa", 1e5, 1.5, True, 1e2, 1e7, "foundation modulus of the tissue that yields"),
    ("yield_force", "N/m", 30.0, 1.5, True, 1e-1, 1e5, "lateral force per length at which it yields"),
    ("tip_stiffness", "N/m", 100.0, 1.5, True, 1e-1, 1e5, "of the tissue ahead of a tip at rest"),
    ("tip_memory", "m", 2e-3, 1.0, True, 1e-4, 5e-2, "travel over which the tip leaves that tissue"),
)
_SKIN = _parameters(
    ("skin_modulus", "Pa", 1e6, 1.5, True, 1e3, 1e8, "as yielding_modulus, in the skin"),
    ("skin_yield_force", "N/m", 500.0, 1.5, True, 1.0, 1e7, "as yield_force, in the skin"),
)
_PIVOT = _parameters(("pivot_stiffness", "N/m", 500.0, 2.0, True, 1e-2, 5e6, "of the surface at the entry"))
_GUIDE = _parameters(
    ("guide_distance", "m", 0.03, 0.7, True, 2e-3, 0.3, "from the guide to the surface"),
    ("rotational_compliance", "rad/(N m)", 1.0, 3.0, True, 1e-4, 5e3, "of the guide"),
    ("surface", "m", 0.0, 3e-3, False, -0.02, 0.02, "where the tissue begins, from where depth counts"),
)
_MEASURED = _parameters(
    ("lead", "1", 0.5, 0.5, False, 0.0, 1.0, "share of the base's next motion that a reading has seen"),
    ("axis_x", "rad", 0.0, 0.05, False, -0.3, 0.3, "slope of the insertion axis in the tip's frame"),
    ("axis_y", "rad", 0.0, 0.05, False, -0.3, 0.3, "the other way across"),
    ("sensor_x", "rad", 0.0, 0.05, False, -0.3, 0.3, "slope of the sensor's axis against the needle"),
    ("sensor_y", "rad", 0.0, 0.05, False, -0.3, 0.3, "the other way across"),
)
MODELS = {
    "linear": (*_TISSUE, *_GUIDE, *_PIVOT, *_MEASURED),
    "yielding": (*_TISSUE, *_YIELDING, *_SKIN, *_GUIDE, *_MEASURED),
}
"""Name of a model -> the parameters that are identified."""


def search_values(parameters: Sequence[Parameter], numbers: np.ndarray) -> dict[str, float]:
    """Name -> value for the numbers of a search."""
    return {parameter.name: parameter.outside(float(number)) for parameter, number in zip(parameters, numbers)}


def deviations_of(parameters: Sequence[Parameter], values: dict[str, float]) -> np.ndarray:
    """Values as deviations from the means of their priors, in standard deviations, (p,)."""
    return np.array([(p.inside(values[p.name]) - p.inside(p.center)) / p.spread for p in parameters])


_SENSOR = _parameters(
    ("lever", "m", 0.0, 5e-3, False, -0.1, 0.1, "of the sensor behind the base, beyond its stated position"),
)
_TIP = _parameters(("tip_force", "N", 0.2, 1.5, True, 1e-4, 5.0, "lateral force on the tip, in the plane of a shape"))
WRENCH_MODELS = {
    "linear": (*_TISSUE, *_GUIDE, *_PIVOT, *_SENSOR),
    "yielding": (*_TISSUE, *_YIELDING, *_SKIN, *_GUIDE, *_SENSOR),
}
"""Name of a model -> the parameters that are identified from base wrenches."""
SHAPE_MODELS = {"linear": (*_TISSUE[:1], *_TIP, *_GUIDE)}
"""Name of a model -> the parameters that are identified from shapes."""
ALIGNED = {"lead": 0.0, "axis_x": 0.0, "axis_y": 0.0, "sensor_x": 0.0, "sensor_y": 0.0}
"""A tracker whose frame is that of the base, for needles that were identified without one."""


def held_at(parameters: Sequence[Parameter], held: str) -> tuple[Parameter, ...]:
    """The parameters of a needle that is held by a ``"guide"``, or at its ``"hub"``, which has no distance.

    Raises
    ------
    InputError
        If it is held otherwise.
    """
    if held not in ("guide", "hub"):
        raise InputError("held", repr(held), "unknown", next_step="Give guide or hub.")
    return tuple(p for p in parameters if held == "guide" or p.name != "guide_distance")
