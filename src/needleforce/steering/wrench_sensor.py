# SPDX-License-Identifier: Apache-2.0
"""What a six-axis sensor behind the base reads of the wrench on the needle, and the wrench from its readings."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..checks import FORCE, Range, above_zero, in_range
from ..errors import InputError

_NO_TURN = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
_ORIGIN = (0.0, 0.0, 0.0)
_ON_ROBOT = Range(-10.0, 10.0, "m", "no robot holds a needle farther away")
_PART = Range(-1.001, 1.001, "", "of a unit vector")
_MIN_COSINE = 0.5  # cosine of the angle between the sensor's z and the insertion


@dataclass(frozen=True, kw_only=True)
class WrenchSensor:
    """A six-axis force and torque sensor that holds the needle.

    The frame of the base is that of ``FlexibleInsertion``: z along the insertion, x and y across, at the guide or hub.

    Parameters
    ----------
    position : (float, float, float)
        Of the sensor's origin from the base, in the frame of the base at a roll of 0 [m]; behind the base z is
        negative.
    axes : array_like, shape (3, 3)
        Rows: the sensor's x, y and z in the frame of the base at a roll of 0. A left-handed set, as of a sensor whose
        z is reported with the other sign, is allowed.
    reports_load : bool
        True: the force of the tissue on the needle; False: that of the needle on the tissue.
    rolls : bool
        Whether the sensor turns with the needle.
    weight : (float, float, float)
        Of what the sensor holds, in the frame of the base [N].
    center : (float, float, float)
        Its center of mass from the base, at a roll of 0 [m].
    zeroed : bool
        Whether the readings were set to zero at a roll of 0, before the insertion.
    force_noise, moment_noise : float
        Standard deviations of a reading [N], [N m].

    Raises
    ------
    InputError
        If a value is not finite, the axes are not perpendicular unit vectors, or a noise is not above 0.
    """

    position: tuple[float, float, float] = _ORIGIN
    axes: ArrayLike = _NO_TURN
    reports_load: bool = True
    rolls: bool = False
    weight: tuple[float, float, float] = _ORIGIN
    center: tuple[float, float, float] = _ORIGIN
    zeroed: bool = True
    force_noise: float = 5e-3
    moment_noise: float = 2e-4

    def __post_init__(self) -> None:
        for quantity, allowed in (("position", _ON_ROBOT), ("axes", _PART), ("weight", FORCE), ("center", _ON_ROBOT)):
            shape = (3, 3) if quantity == "axes" else (3,)
            in_range(f"{quantity} of the sensor", getattr(self, quantity), allowed, "Give SI units.", shape)
        axes = np.asarray(self.axes, dtype=float)
        if not np.allclose(axes @ axes.T, np.eye(3), atol=1e-6):
            limit = "must be perpendicular unit vectors"
            raise InputError("axes of the sensor", axes.tolist(), limit, next_step="Give the rows of a rotation.")
        for quantity in ("force_noise", "moment_noise"):
            step = "Give a standard deviation in N or N m."
            above_zero(f"{quantity} of the sensor", getattr(self, quantity), next_step=step)

    def readings(self, wrench: ArrayLike, roll: ArrayLike = 0.0) -> np.ndarray:
        """What the sensor reads.

        Parameters
        ----------
        wrench : array_like, shape (n, 6) or (6,)
            Of the tissue on the needle at the base [N], [N m].
        roll : array_like, shape (n,) or scalar
            Rotation of the needle [rad].

        Returns
        -------
        ndarray, shape (n, 6) or (6,)
            fx, fy, fz [N], tx, ty, tz [N m] in the sensor's frame.
        """
        loads = self._moved(np.asarray(wrench, dtype=float), np.asarray(roll, dtype=float), back=False)
        held = self._weight(np.asarray(roll, dtype=float))
        return (1.0 if self.reports_load else -1.0) * (loads + held)

    def wrench(self, readings: ArrayLike, roll: ArrayLike = 0.0) -> np.ndarray:
        """The wrench of the tissue on the needle at the base, the inverse of ``readings``.

        Parameters
        ----------
        readings : array_like, shape (n, 6) or (6,)
            fx, fy, fz [N], tx, ty, tz [N m] in the sensor's frame.
        roll : array_like, shape (n,) or scalar
            Rotation of the needle [rad].

        Returns
        -------
        ndarray, shape (n, 6) or (6,)
            In the frame of the base [N], [N m].
        """
        loads = (1.0 if self.reports_load else -1.0) * np.asarray(readings, dtype=float)
        angle = np.asarray(roll, dtype=float)
        return self._moved(loads - self._weight(angle), angle, back=True)

    def completed(self, readings: np.ndarray, force: np.ndarray, roll: np.ndarray) -> np.ndarray:
        """Readings with fz and tz as they follow from a known axial force and a needle without twist.

        Parameters
        ----------
        readings : ndarray, shape (n, 6)
            Of which fx, fy [N], tx and ty [N m] are used.
        force : ndarray, shape (n,)
            Axial force of the tissue on the needle, positive against the insertion [N].
        roll : ndarray, shape (n,)
            Rotation of the needle [rad].

        Returns
        -------
        ndarray, shape (n, 6)
            With all six components.

        Raises
        ------
        InputError
            If the sensor's z is more than 60 degrees from the insertion.
        """
        along = np.asarray(self.axes, dtype=float)[:, 2]
        if abs(along[2]) < _MIN_COSINE:
            limit, step = "its z must be along the insertion", "Turn six readings with WrenchSensor.wrench."
            raise InputError("axes of the sensor", np.asarray(self.axes).tolist(), limit, next_step=step)
        sign, weight = 1.0 if self.reports_load else -1.0, self._weight(roll)
        loads = sign * readings - weight
        loads[:, 2] = (-force - loads[:, :2] @ along[:2]) / along[2]
        loads[:, 5] = 0.0
        twist = self._moved(loads, roll, back=True)[:, 5]  # about the base, which has none
        loads[:, 5] = -twist / along[2]
        return sign * (loads + weight)

    def _weight(self, roll: np.ndarray) -> np.ndarray:
        """Reading of the weight, less that at a roll of 0 if the sensor was zeroed there."""
        load = self._of_weight(roll)
        return load - self._of_weight(np.zeros_like(roll)) if self.zeroed else load

    def _of_weight(self, roll: np.ndarray) -> np.ndarray:
        weight = np.broadcast_to(np.asarray(self.weight, dtype=float), (*roll.shape, 3))
        center = self._turned(np.asarray(self.center, dtype=float), roll) if self.rolls else np.asarray(self.center)
        about_base = np.concatenate([weight, np.cross(center, weight)], axis=-1)
        return self._moved(about_base, roll, back=False)

    def _moved(self, load: np.ndarray, roll: np.ndarray, *, back: bool) -> np.ndarray:
        """A load about the base in the base's frame as one about the sensor's origin in its own, or the reverse."""
        angle = roll if self.rolls else np.zeros_like(roll)
        place = self._turned(np.asarray(self.position, dtype=float), angle)
        turn = np.einsum("ij,...kj->...ik", np.asarray(self.axes, dtype=float), _about_z(angle))
        if back:
            force, moment = (np.einsum("...ji,...j->...i", turn, part) for part in (load[..., :3], load[..., 3:]))
            return np.concatenate([force, moment + np.cross(place, force)], axis=-1)
        force, moment = load[..., :3], load[..., 3:] - np.cross(place, load[..., :3])
        return np.concatenate([np.einsum("...ij,...j->...i", turn, part) for part in (force, moment)], axis=-1)

    @staticmethod
    def _turned(vector: np.ndarray, roll: np.ndarray) -> np.ndarray:
        return np.einsum("...ij,j->...i", _about_z(roll), vector)


def _about_z(angle: np.ndarray) -> np.ndarray:
    """Rotations about z, (..., 3, 3)."""
    c, s, zero, one = np.cos(angle), np.sin(angle), np.zeros_like(angle), np.ones_like(angle)
    return np.stack([np.stack([c, -s, zero], -1), np.stack([s, c, zero], -1), np.stack([zero, zero, one], -1)], -2)
