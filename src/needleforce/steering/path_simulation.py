# SPDX-License-Identifier: Apache-2.0
"""The tip of one insertion for the motion of its base, as the mechanics say, before its own pose."""

import math
from dataclasses import dataclass

import numpy as np

from .. import core
from ..models.flexible_insertion import FlexibleInsertion
from .tip_paths import TipPath

PATH_SPACING = 5e-4  # [m]; the tip differs by less than 1 um from that with 0.1 mm
SKIN_THICKNESS = 2e-3  # [m]; tip paths do not tell it from the strength of the skin
ELEMENTS = 30


@dataclass(frozen=True)
class SimulatedPath:
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


def lateral_layers(values: dict[str, float], tip_force: float) -> list[core.LateralLayer]:
    """The tissue as lateral layers, with a force on the tip [N]."""
    common = {"modulus": values["modulus"], "tip_force": tip_force}
    if "yield_force" not in values:
        return [core.LateralLayer(**common)]
    common["tip_stiffness"] = values["tip_stiffness"]
    skin = {"yielding_modulus": values["skin_modulus"], "yield_force": values["skin_yield_force"]}
    below = {"yielding_modulus": values["yielding_modulus"], "yield_force": values["yield_force"]}
    return [core.LateralLayer(**common, **skin), core.LateralLayer(top=SKIN_THICKNESS, **common, **below)]


def guide_of(values: dict[str, float], needle: core.Needle) -> dict[str, float]:
    """Guide, limits, and the length over which the tip's force builds up: a bevel of 27 degrees where none is known."""
    bevel = {} if isinstance(needle.tip, core.tips.LancetBevel) else {"bevel_length": 2.0 * needle.outer_diameter}
    names = ("guide_distance", "rotational_compliance", "pivot_stiffness", "tip_memory")
    given = {name: values[name] for name in names if name in values}
    return given | bevel | {"max_speed": math.inf, "max_travel": 0.3}


def simulated_path(values: dict[str, float], needle: core.Needle, path: TipPath) -> SimulatedPath:
    """The tip that the parameters predict for the motion of the base: it moves across and rolls at rest, then the
    needle is pushed in, then the next motion begins and the tip is read."""
    depth = np.maximum.accumulate(np.maximum(path.depth - values["surface"], 0.0))
    moved = path.base - path.base[0]
    seen = moved + values["lead"] * (np.vstack([moved[1:], moved[-1:]]) - moved)
    depths = np.column_stack([np.append(0.0, depth[:-1]), depth, depth]).ravel()
    base = np.stack([moved, moved, seen], axis=1).reshape(-1, 2)
    if path.rolls:
        rows = _in_space(values, needle).run(depths, base, roll=np.repeat(_near(path.roll + _bevel(values)), 3))
        tip, slope = rows["tip"][2::3, :2], rows["tangent"][2::3, :2] / rows["tangent"][2::3, 2:]
    else:
        tip, slope = _by_planes(values, needle, depths, base, float(path.roll[0]))
    axis, sensor = (np.array([values[f"{name}_x"], values[f"{name}_y"]]) for name in ("axis", "sensor"))
    return SimulatedPath(tip + np.outer(depth, axis), slope + axis + sensor, depth)


def _by_planes(
    values: dict[str, float], needle: core.Needle, depths: np.ndarray, base: np.ndarray, roll: float
) -> tuple[np.ndarray, np.ndarray]:
    """Tip and slope, (n, 2) each, of a needle that does not roll, plane by plane."""
    forces = math.hypot(values["tip_force_x"], values["tip_force_y"]) * np.exp(1j * (_bevel(values) + roll))
    tips, slopes = [], []
    for across, force in enumerate((forces.real, forces.imag)):
        flex = _fine_enough(values, needle, lateral_layers(values, float(force)), planar=True)
        rows = flex.run(depths, np.column_stack([base[:, across], np.zeros(len(depths))]))
        tips.append(rows["tip"][2::3, 0])
        slopes.append(rows["tangent"][2::3, 0])
    return np.column_stack(tips), np.column_stack(slopes)


def _in_space(values: dict[str, float], needle: core.Needle) -> FlexibleInsertion:
    force = math.hypot(values["tip_force_x"], values["tip_force_y"])
    return _fine_enough(values, needle, lateral_layers(values, force), planar=False)


def _fine_enough(
    values: dict[str, float], needle: core.Needle, layers: list[core.LateralLayer], *, planar: bool
) -> FlexibleInsertion:
    """The insertion as finely as a search needs it."""
    fineness = {"elements": ELEMENTS, "path_spacing": PATH_SPACING, "small_slopes": True, "max_slope": 1.5}
    return FlexibleInsertion(None, needle, lateral=layers, planar=planar, **fineness, **guide_of(values, needle))


def _bevel(values: dict[str, float]) -> float:
    """Direction of the tip's force where the roll is 0 [rad]."""
    return math.atan2(values["tip_force_y"], values["tip_force_x"])


def _near(roll: np.ndarray) -> np.ndarray:
    """The same angles by turns of at most half a turn: what the tip is turned by at rest leaves no trace."""
    return np.unwrap(np.asarray(roll))
