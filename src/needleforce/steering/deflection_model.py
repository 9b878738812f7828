# SPDX-License-Identifier: Apache-2.0
"""The parameters of a steered insertion that are identified: tissue, tip, guide, and how tip and base were measured."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import core
from ..models.flexible_insertion import FlexibleInsertion
from .tip_paths import TipPath

PATH_SPACING = 5e-4  # [m]; the tip differs by less than 1 um from that with 0.1 mm
SKIN_THICKNESS = 2e-3  # [m]; tip paths do not tell it from the strength of the skin
ELEMENTS = 30


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
    "yielding": (*_TISSUE, *_YIELDING, *_GUIDE, *_MEASURED),
}
"""Name of a model -> the parameters that are identified."""


@dataclass(frozen=True)
class Course:
    """Tip and slope of one insertion for given parameters, before its own pose.

    Attributes
    ----------
    tip, slope : ndarray, shape (n, 2)
        Lateral position of the tip [m] and slope that its sensor shows [1].
    depth : ndarray, shape (n,)
        Travel in tissue [m].
    """

    tip: np.ndarray
    slope: np.ndarray
    depth: np.ndarray


def _layers(values: dict[str, float], tip_force: float) -> list[core.LateralLayer]:
    """The tissue as lateral layers, with a force on the tip [N]."""
    common = {"modulus": values["modulus"], "tip_force": tip_force}
    if "yield_force" not in values:
        return [core.LateralLayer(**common)]
    common["tip_stiffness"] = values["tip_stiffness"]
    skin = {"yielding_modulus": values["skin_modulus"], "yield_force": values["skin_yield_force"]}
    below = {"yielding_modulus": values["yielding_modulus"], "yield_force": values["yield_force"]}
    return [core.LateralLayer(**common, **skin), core.LateralLayer(top=SKIN_THICKNESS, **common, **below)]


def _guide(values: dict[str, float], needle: core.Needle) -> dict[str, float]:
    """Guide, limits, and the length over which the tip's force builds up: a bevel of 27 degrees where none is known."""
    bevel = {} if isinstance(needle.tip, core.tips.LancetBevel) else {"bevel_length": 2.0 * needle.outer_diameter}
    names = ("guide_distance", "rotational_compliance", "pivot_stiffness")
    given = {name: values[name] for name in names if name in values}
    return given | bevel | {"max_speed": math.inf, "max_travel": 0.3}


def _in_plane(values: dict[str, float], needle: core.Needle, across: int) -> FlexibleInsertion:
    """The insertion of one plane (0: x, 1: y), as finely as a search needs it."""
    layers = _layers(values, values["tip_force_y" if across else "tip_force_x"])
    fineness = {
        "planar": True,
        "elements": ELEMENTS,
        "path_spacing": PATH_SPACING,
        "small_slopes": True,
        "max_slope": 1.5,
    }
    return FlexibleInsertion(None, needle, lateral=layers, **fineness, **_guide(values, needle))


def course_of(values: dict[str, float], needle: core.Needle, path: TipPath) -> Course:
    """The tip that the parameters predict for the motion of the base: it moves across at rest, then the needle is
    pushed in, then the next motion begins and the tip is read."""
    depth = np.maximum.accumulate(np.maximum(path.depth - values["surface"], 0.0))
    tip, slope = np.empty((len(path), 2)), np.empty((len(path), 2))
    for across in (0, 1):
        moved = path.base[:, across] - path.base[0, across]
        seen = moved + values["lead"] * (np.append(moved[1:], moved[-1]) - moved)
        depths = np.column_stack([np.append(0.0, depth[:-1]), depth, depth]).ravel()
        bases = np.column_stack([moved, moved, seen]).ravel()
        rows = _in_plane(values, needle, across).run(depths, np.column_stack([bases, np.zeros_like(bases)]))
        tip[:, across] = rows["tip"][2::3, 0]
        slope[:, across] = rows["tangent"][2::3, 0]
    axis, sensor = (np.array([values[f"{name}_x"], values[f"{name}_y"]]) for name in ("axis", "sensor"))
    return Course(tip + np.outer(depth, axis), slope + axis + sensor, depth)


def search_values(parameters: Sequence[Parameter], numbers: np.ndarray) -> dict[str, float]:
    """Name -> value for the numbers of a search."""
    return {parameter.name: parameter.outside(float(number)) for parameter, number in zip(parameters, numbers)}


@dataclass(frozen=True)
class SteeringModel:
    """An identified steered needle.

    Attributes
    ----------
    form : str
        ``"linear"`` or ``"yielding"``.
    values : dict of str to float
        Value of each identified parameter, in SI.
    needle : Needle
        The needle with which it was identified.
    """

    form: str
    values: dict[str, float]
    needle: core.Needle

    @property
    def roll(self) -> float:
        """Direction of the tip's lateral force at the roll of the insertions [rad], from x towards y."""
        return math.atan2(self.values["tip_force_y"], self.values["tip_force_x"])

    def insertion(self, **options: Any) -> FlexibleInsertion:
        """A needle in space with the identified tissue and guide; ``roll`` is the roll at which it was inserted.

        Parameters
        ----------
        **options : object
            Of ``FlexibleInsertion``, such as ``elements``.

        Returns
        -------
        FlexibleInsertion
        """
        force = math.hypot(self.values["tip_force_x"], self.values["tip_force_y"])
        layers = _layers(self.values, force)
        return FlexibleInsertion(None, self.needle, lateral=layers, **(_guide(self.values, self.needle) | options))

    def course(self, path: TipPath) -> Course:
        """Tip and slope for the motion of the base of an insertion, before its pose."""
        return course_of(self.values, self.needle, path)
