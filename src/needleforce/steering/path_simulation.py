# SPDX-License-Identifier: Apache-2.0
"""One insertion for the motion of its base, by the mechanics: tip, slope and base wrench, before its own pose."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from .. import core
from ..models.flexible_insertion import FlexibleInsertion
from ..models.model import Model
from .base_motion import Replays, base_moves, replay_of, rows_of
from .tip_paths import TipPath

PATH_SPACING = (
    5e-4  # [m]; the tip differs by some 10 um from that with 0.05 mm, where 3 mm of base motion make 1 mm of it
)
SKIN_THICKNESS = 2e-3  # [m]; not identifiable separately from the strength of the skin
ELEMENTS = 30
Simulation = Callable[..., "SimulatedPath"]
"""Parameters and the motion of an insertion -> its simulation; with ``replays``, faster."""


@dataclass(frozen=True, kw_only=True)
class SimulatedPath:
    """One insertion for given parameters, before its own pose."""

    tip: np.ndarray  # (n, 2) [m] across
    slope: np.ndarray  # (n, 2) that the sensor in the tip shows
    depth: np.ndarray  # (n,) [m] travel in tissue
    along: np.ndarray  # (n,) [m] position of the tip along the insertion
    wrench: np.ndarray  # (n, 6) [N], [N m] of the tissue on the needle at the base
    force: np.ndarray  # (n,) [N] along the axis; 0 without a model of the axial force
    lost: np.ndarray  # (n,) where the needle buckled, or a step was impossible


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
    """Guide, bevel and limits as options of ``FlexibleInsertion``."""
    names = ("guide_distance", "rotational_compliance", "pivot_stiffness", "tip_memory")
    given = {name: values[name] for name in names if name in values}
    return given | {"bevel_length": bevel_length_of(needle), "max_speed": math.inf, "max_travel": 0.3}


def bevel_length_of(needle: core.Needle) -> float:
    """Travel over which the tip's force builds up [m]: of a bevel of 27 degrees where none is known."""
    tip = needle.tip
    slope = math.tan(tip.half_angle) if isinstance(tip, core.tips.LancetBevel) else 0.5
    return needle.outer_diameter / slope


def tip_force_of(values: dict[str, float]) -> float:
    """Size of the lateral force on the tip [N]."""
    return values["tip_force"] if "tip_force" in values else math.hypot(values["tip_force_x"], values["tip_force_y"])


def bevel_direction(values: dict[str, float]) -> float:
    """Direction of the tip's force where the roll of the insertions is 0 [rad], from x towards y; x if unknown."""
    return 0.0 if "tip_force" in values else math.atan2(values["tip_force_y"], values["tip_force_x"])


def simulated_path(
    values: dict[str, float],
    path: TipPath,
    *,
    needle: core.Needle,
    axial: Model | None = None,
    replays: Replays | None = None,
) -> SimulatedPath:
    """What the parameters predict: the base moves across and the needle rolls at rest, then it is pushed in, then the
    next motion begins and the tip is read. ``replays`` is what a search with the same parameters keeps from one call to
    the next."""
    depth = np.maximum.accumulate(np.maximum(path.depth - values["surface"], 0.0))
    moves = base_moves(depth, path, values["lead"])
    replay = replay_of(replays, "needle", lambda: _fine_enough(values, needle, axial))
    simulated = rows_of(replay, replace(moves, roll=moves.roll + bevel_direction(values)))
    axis, sensor = (np.array([values[f"{name}_x"], values[f"{name}_y"]]) for name in ("axis", "sensor"))
    return SimulatedPath(
        tip=simulated["tip"] + np.outer(depth, axis),
        slope=simulated["slope"] + axis + sensor,
        depth=depth,
        along=depth,
        wrench=simulated["wrench"],
        force=simulated["force"],
        lost=simulated["lost"],
    )


def _fine_enough(values: dict[str, float], needle: core.Needle, axial: Model | None) -> FlexibleInsertion:
    """The insertion as finely as a search needs it."""
    fineness = {"elements": ELEMENTS, "path_spacing": PATH_SPACING, "small_slopes": True, "max_slope": 1.5}
    layers = lateral_layers(values, tip_force_of(values))
    return FlexibleInsertion(axial, needle, lateral=layers, **fineness, **guide_of(values, needle))
