# SPDX-License-Identifier: Apache-2.0
"""A needle that bends on a robot in MuJoCo: its base follows a site, and the wrench of the tissue acts there."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import core
from ..errors import InputError
from ..models.flexible_insertion import FlexibleInsertion
from .attached import library, named


@dataclass(frozen=True)
class BaseSite:
    """The site of the base, whose z axis points along the needle, and that of the surface."""

    site: int
    surface: int
    tree: int
    from_surface: float  # depth of the needle with the site at the surface [m]

    def tissue(self, d: Any) -> tuple[np.ndarray, np.ndarray]:
        """Origin of the tissue's frame, and its axes as rows: x of the surface's site, z into the tissue."""
        axes = d.site_xmat[self.surface].reshape(3, 3).T
        return d.site_xpos[self.surface], np.array([axes[0], np.cross(-axes[2], axes[0]), -axes[2]])


class AttachedBending:
    """A needle that bends; ``sample`` is its last sample, ``shape()`` its line in the world. Use one for each
    ``MjData``."""

    def __init__(self, needle: FlexibleInsertion, place: BaseSite):
        self.needle, self.place, self.sample = needle, place, None
        self._roll: float | None = None

    def reset(self) -> None:
        """Reset to intact tissue, as after ``mj_resetData``."""
        self.needle.reset()
        self.sample, self._roll = None, None

    def push(self, m: Any, d: Any, needles: int = 1) -> core.BentSample:
        """Add the wrench of the tissue to ``d.qfrc_passive``; for use between ``mj_step1`` and ``mj_step2``.

        Parameters
        ----------
        m, d : mujoco.MjModel, mujoco.MjData
            MuJoCo's model and state.
        needles : int
            Without effect: the wrench is that of where the base is.

        Returns
        -------
        BentSample

        Raises
        ------
        InputError
            If the needle is turned away from the tissue by more than 60 degrees.
        """
        origin, axes = self.place.tissue(d)
        place = axes @ (d.site_xpos[self.place.site] - origin)
        frame = axes @ d.site_xmat[self.place.site].reshape(3, 3)  # columns: the site's axes in the tissue's frame
        along = frame[:, 2]
        if along[2] < 0.5:
            limit = "must be within 60 degrees of the tissue's normal"
            step = "Point the z axis of the site into the tissue."
            raise InputError("axis of the needle", along.tolist(), limit, next_step=step)
        slope = along[:2] / along[2]
        angle = math.atan2(frame[1, 0], frame[0, 0])
        # the same roll, next to the last one
        self._roll = angle if self._roll is None else self._roll + math.remainder(angle - self._roll, 2.0 * math.pi)
        depth = place[2] + self.place.from_surface
        self.sample = self.needle.step(depth, tuple(place[:2]), roll=self._roll, tilt=tuple(slope), dt=m.opt.timestep)
        self._apply(m, d, axes, along)
        return self.sample

    def _apply(self, m: Any, d: Any, axes: np.ndarray, along: np.ndarray) -> None:
        across = np.array([1.0, 0.0, 0.0]) - along[0] * along
        x = across / np.linalg.norm(across)
        base = np.array([x, np.cross(along, x), along]) @ axes  # rows: the axes of the wrench in the world
        wrench = np.asarray(self.sample.wrench) if self.sample is not None else np.zeros(6)
        body, point = m.site_bodyid[self.place.site], d.site_xpos[self.place.site]
        force, torque = wrench[:3] @ base, wrench[3:] @ base
        library().mj_applyFT(m, d, force=force, torque=torque, point=point, body=body, qfrc_target=d.qfrc_passive)

    def shape(self, d: Any) -> np.ndarray:
        """The needle from the base to the tip in the world, (n, 3) [m]."""
        origin, axes = self.place.tissue(d)
        return origin + self.needle.shape() @ axes


def attach_bending(needle: FlexibleInsertion, mj_model: Any, *, site: str, surface_site: str) -> AttachedBending:
    """Attach a needle that bends to a site of a robot.

    Parameters
    ----------
    needle : FlexibleInsertion
        In space, held at its hub; it is reset to intact tissue.
    mj_model : mujoco.MjModel
        MuJoCo's model.
    site : str
        At the hub; its z axis points along the needle, and about it the needle rolls: a bevel pushes along its x axis.
    surface_site : str
        Fixed site in the surface whose z axis points out of the tissue; its x axis is that of the tissue.

    Returns
    -------
    AttachedBending
        To be passed to ``step``.

    Raises
    ------
    InputError
        If a name is not in the model, the needle is planar or held by a guide, or ``mujoco`` is not installed.

    Notes
    -----
    The wrench is that of the base at the beginning of the step: it is stable where the stiffness of needle and tissue
    times the square of the time step is below the mass at the site.
    """
    library()
    if needle.planar or math.isfinite(needle.guide_distance):
        limit = "must be in space and held at its hub, which the robot moves"
        kind, step = ("planar", "Give planar=False.") if needle.planar else ("guided", "Leave out guide_distance.")
        raise InputError("needle", kind, limit, next_step=step)
    number, surface = named(mj_model, "SITE", site), named(mj_model, "SITE", surface_site)
    if mj_model.body_weldid[mj_model.site_bodyid[surface]] != 0:
        raise InputError("surface_site", surface_site, "on a moving body", next_step="Fix it to the world.")
    needle.reset()
    tree = mj_model.body_treeid[mj_model.site_bodyid[number]]
    return AttachedBending(needle, BaseSite(number, surface, tree, needle.needle.length))
