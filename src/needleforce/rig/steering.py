# SPDX-License-Identifier: Apache-2.0
"""A steering rig: a robot moves the base of a bevel-tip needle across and rolls it, a tracker reads its tip."""

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .. import core
from ..checks import above_zero, not_below_zero
from ..files import write_rows
from ..models.flexible_insertion import FlexibleInsertion
from ..models.model import Model
from .experiment import streams

_NEEDLE = core.Needle(1.27e-3, 0.0, 0.3, 162e9, 0.3)  # 18 gauge, solid: E I = 0.0207 N m^2
_TOPS = (0.0, 2e-3, 12e-3, 25e-3, 40e-3, 55e-3, 70e-3, 85e-3)  # [m]; the tissue changes at these depths
_POSITIVE = ("modulus", "scale", "yielding_modulus", "yield_force", "skin", "guide_distance")
_PUSH, _PUSH_S = 1e-3, 0.2  # [m] and [s] of a push


@dataclass(frozen=True, kw_only=True)
class SteeringPhantom:
    """A block of gel with a skin, and how the needle is held and tracked; it has effects that the identified model
    omits: an uneven tissue in eight layers whose stiffness falls with the offset, a bevel whose force wanders, a guide
    with play, and a pose that differs between insertions.

    Parameters
    ----------
    needle : Needle
        The needle.
    modulus, yielding_modulus : float
        Foundation moduli of the gel [Pa]: of the part that stays, and of the part that yields.
    scale : float
        Offset at which the part that stays softens [m].
    yield_force : float
        Lateral force per length at which the other yields [N/m].
    skin : float
        Factor by which the first 2 mm are stiffer and stronger [1].
    tip_force : float
        Lateral force on the tip [N].
    guide_distance, rotational_compliance : float
        Of the guide [m], [rad/(N m)].
    play : float
        Of the guide, half of its width [m]: the needle follows the guide with this backlash.
    unevenness : float
        Standard deviation of modulus and tip force between layers, relative to the mean [1].
    wander : float
        Standard deviation of the direction of the tip's force between layers [rad].
    offset, tilt : float
        Standard deviations of the entry [m] and of the axis [rad] between insertions.
    noise, slope_noise : float
        Standard deviations of a reading of the tip [m] and of its slope [1].

    Raises
    ------
    InputError
        If a value is not finite or negative, or one that the tissue or the guide needs is 0.
    """

    needle: core.Needle = _NEEDLE
    modulus: float = 2.5e4
    scale: float = 2e-3
    yielding_modulus: float = 8e4
    yield_force: float = 50.0
    skin: float = 8.0
    tip_force: float = 0.2
    guide_distance: float = 0.02
    rotational_compliance: float = 1.0
    play: float = 0.05e-3
    unevenness: float = 0.1
    wander: float = 0.1
    offset: float = 0.3e-3
    tilt: float = 5e-3
    noise: float = 0.15e-3
    slope_noise: float = 2e-3

    def __post_init__(self) -> None:
        for quantity, value in vars(self).items():
            if quantity != "needle":
                check = above_zero if quantity in _POSITIVE else not_below_zero
                check(f"{quantity} of the steering phantom", value, next_step="Give SI units.")

    def layers(self, random: np.random.Generator) -> list[core.LateralLayer]:
        """The layers of one site."""
        made = []
        for number, top in enumerate(_TOPS):
            factor = self.skin if number == 0 else 1.0
            stiffer, stronger, harder = np.exp(self.unevenness * random.standard_normal(3))
            made.append(
                core.LateralLayer(
                    top=top, modulus=self.modulus * float(stiffer), scale=self.scale,
                    tip_force=self.tip_force * float(stronger), yielding_modulus=factor * self.yielding_modulus,
                    yield_force=factor * self.yield_force * float(harder), tip_stiffness=100.0,
                    form="hyperbolic",
                )
            )  # fmt: skip
        return made


_PHANTOM = SteeringPhantom()


COLUMNS = (
    "insertion", "step_depth_mm", "tip_x_mm", "tip_y_mm", "tip_z_mm", "tip_slope_x", "tip_slope_y", "base_x_mm",
    "base_y_mm", "roll_deg",
)  # fmt: skip


class RigInsertion:
    """One insertion of the rig, step by step.

    Attributes
    ----------
    tip : ndarray, shape (3,)
        Where the tip truly is, in the tracker's frame [m].
    wrench : ndarray, shape (6,)
        Of the tissue on the needle at the base [N], [N m].
    force : float
        Axial force [N]; 0 without a model of it.
    rows : list of dict
        What was commanded and read in each step, under ``COLUMNS``.
    """

    def __init__(
        self,
        phantom: SteeringPhantom,
        flex: FlexibleInsertion,
        random: np.random.Generator,
        *,
        name: str,
        bevel: np.ndarray,
        pose: tuple[np.ndarray, np.ndarray],
    ):
        self.phantom, self.name, self.rows = phantom, name, []
        self.tip, self.wrench, self.force = np.zeros(3), np.zeros(6), 0.0
        self._flex, self._random, self._bevel, self._pose = flex, random, bevel, pose
        self._held, self._depth, self._roll = np.zeros(2), 0.0, float(bevel[0])

    def advance(self, depth: float, lateral: Sequence[float], roll: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """One step: the base moves across and the needle rolls at rest, then it is pushed in; then the tracker reads.

        Parameters
        ----------
        depth : float
            Travel of the needle at the end of the step [m].
        lateral : (float, float)
            Where the robot moves the base [m].
        roll : float
            Rotation of the needle [rad].

        Returns
        -------
        tip : ndarray, shape (3,)
            Reading of the tracker [m].
        slope : ndarray, shape (2,)
            Reading of the tip's slope [1].
        """
        self._hold(np.asarray(lateral, dtype=float))
        count = max(1, math.ceil(abs(depth - self._depth) / _PUSH))
        for each in np.append(self._depth, np.linspace(self._depth, depth, count + 1)[1:]):
            slope = self._move(float(each), roll)
        self._depth = depth
        tip = self.tip + self.phantom.noise * self._random.standard_normal(3)
        slope = slope + self.phantom.slope_noise * self._random.standard_normal(2)
        values = (1e3 * depth, *(1e3 * tip), *slope, *(1e3 * np.asarray(lateral)), math.degrees(roll))
        self.rows.append(dict(zip(COLUMNS, (self.name, *map(float, values)), strict=True)))
        return tip, slope

    def _hold(self, lateral: np.ndarray) -> None:
        """The needle follows the guide once it touches its side."""
        away = lateral - self._held
        distance = float(np.hypot(*away))
        if distance > self.phantom.play:
            self._held = self._held + away * (1.0 - self.phantom.play / distance)

    def _move(self, depth: float, roll: float) -> np.ndarray:
        """Move the base, and return the slope of the tip."""
        layer = int(np.searchsorted(_TOPS, max(depth, 0.0), side="right")) - 1
        self._roll += math.remainder(roll + float(self._bevel[layer]) - self._roll, 2.0 * math.pi)
        sample = self._flex.step(depth, (float(self._held[0]), float(self._held[1])), roll=self._roll, dt=_PUSH_S)
        offset, axis = self._pose
        place, tangent = np.asarray(sample.tip), np.asarray(sample.tangent)
        self.tip = np.append(place[:2] + offset + depth * axis, place[2])
        self.wrench, self.force = np.asarray(sample.wrench), sample.force
        return tangent[:2] / tangent[2] + axis


def write_steering(insertions: Sequence[RigInsertion], path: str | os.PathLike) -> None:
    """Write what was commanded and read as a table that ``nf.steering.read`` reads. Raises InputError if it cannot be
    written."""
    write_rows(path, COLUMNS, [row for each in insertions for row in each.rows])


def steering_insertion(
    seed: int, number: int, phantom: SteeringPhantom = _PHANTOM, *, axial: Model | None = None
) -> RigInsertion:
    """Begin an insertion at a new site.

    Parameters
    ----------
    seed : int
        Seed of the phantom, at least 0; the same seed and number give the same site.
    number : int
        Number of the insertion, at least 0.
    phantom : SteeringPhantom
        Tissue, guide and tracker.
    axial : Model, optional
        Laws of the axial force.

    Returns
    -------
    RigInsertion
    """
    tissue, pose, noise = streams(seed, (number,), 3)
    flex = FlexibleInsertion(
        axial, phantom.needle, lateral=phantom.layers(tissue), guide_distance=phantom.guide_distance,
        rotational_compliance=phantom.rotational_compliance, bevel_length=2.0 * phantom.needle.outer_diameter,
        tip_memory=5e-3, max_speed=math.inf, path_spacing=2e-4, max_slope=1.0,
    )  # fmt: skip
    offset, axis = phantom.offset * pose.standard_normal(2), phantom.tilt * pose.standard_normal(2)
    bevel = phantom.wander * tissue.standard_normal(len(_TOPS))
    return RigInsertion(phantom, flex, noise, name=f"insertion {number}", bevel=bevel, pose=(offset, axis))
