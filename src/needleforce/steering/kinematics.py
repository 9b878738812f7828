# SPDX-License-Identifier: Apache-2.0
"""Kinematic models of a bevel-tip needle: the tip follows a curve of constant curvature, whatever the tissue."""

import math
from dataclasses import dataclass

import numpy as np

from ..checks import TRAVEL, Range, above_zero, in_range
from ..errors import InputError

_CURVATURE = Range(-1e5, 1e5, "1/m", "the radius is that of the thinnest needle")


@dataclass(frozen=True)
class KinematicSample:
    """One row of a kinematic model.

    Attributes
    ----------
    tip, tangent : ndarray, shape (3,)
        Position of the tip [m], the surface at z = 0, and its unit tangent.
    status : str
        ``"ok"``, or why the step was refused: ``"not_finite"``, ``"outside_range"``.
    """

    tip: np.ndarray
    tangent: np.ndarray
    status: str = "ok"


class Unicycle:
    """The unicycle model: the tip advances along its tangent and turns towards the bevel's point.

    It has the methods of ``FlexibleInsertion``. Motion of the base across has no effect after the first step, and there
    are no forces.

    Parameters
    ----------
    curvature : float
        Curvature of the path [1/m]; ``nf.steady_curvature`` gives it from the mechanics.

    Raises
    ------
    InputError
        If the curvature is out of its range.

    Notes
    -----
    Webster et al. 2006: the frame g of the tip follows g' = g (u_1 [v = e_3, w = kappa e_2] + u_2 [w = e_3]) with the
    speed u_1 and the rate of roll u_2; at a roll of 0 the path turns towards +x. Each step is exact for a speed and a
    rate of roll that are constant in it.
    """

    ahead = 0.0  # distance of the tip ahead of the frame that turns [m]

    def __init__(self, curvature: float):
        self.curvature = float(in_range("curvature", curvature, _CURVATURE, "Give 0 1/m for a straight path.", ()))
        self.reset()

    def reset(self) -> None:
        """Back to before the first step."""
        self._pieces: list[_Piece] = []
        self._end = (0.0, np.eye(4))  # deepest travel [m], and the frame there, which does not roll
        self._base: tuple[float, float] | None = None  # depth and roll of the last step

    def step(
        self,
        depth: float,
        lateral: tuple[float, float] = (0.0, 0.0),
        *,
        roll: float = 0.0,
        tilt: tuple[float, float] = (0.0, 0.0),
        dt: float = 1.0,
    ) -> KinematicSample:
        """Move the base; never raises.

        Parameters
        ----------
        depth : float
            Travel of the needle along its axis [m], 0 with the tip at the surface.
        lateral, tilt : (float, float)
            Position [m] and slope [rad] of the base at the first step, where the path begins; without effect later.
        roll : float
            Rotation of the needle [rad], not wrapped.
        dt : float
            Time of the step [s]; without effect.

        Returns
        -------
        KinematicSample
            On withdrawal the tip follows its path back; what was cut is kept.
        """
        if not np.all(np.isfinite([depth, *lateral, *tilt, roll, dt])):
            return self._sample("not_finite")
        if self._base is None:
            self._end = (depth, _entry(depth, lateral, tilt))
        elif abs(roll - self._base[1]) > math.pi * (1.0 + 1e-9):
            return self._sample("outside_range")
        elif depth > self._end[0]:
            self._cut(depth, roll)
        self._base = (depth, roll)
        return self._sample("ok")

    def _cut(self, depth: float, roll: float) -> None:
        """The part of the step in new tissue, in which the needle rolls evenly."""
        start, frame = self._end
        before, roll_before = self._base
        begin = roll - (depth - start) / (depth - before) * (roll - roll_before)
        piece = _Piece(start, frame, begin, length=depth - start, curvature=self.curvature, turn=roll - begin)
        self._pieces.append(piece)
        self._end = (depth, piece.frame_at(depth))

    def _sample(self, status: str) -> KinematicSample:
        depth = self._base[0] if self._base else 0.0
        later = [piece for piece in self._pieces if piece.start < depth]
        if later:
            frame = later[-1].frame_at(depth)
        else:
            start, first = (self._pieces[0].start, self._pieces[0].frame) if self._pieces else self._end
            frame = first @ _screw(np.zeros(3), depth - start)
        return KinematicSample(frame[:3, 3] + self.ahead * frame[:3, 2], frame[:3, 2].copy(), status)


class Bicycle(Unicycle):
    """The bicycle model: a unicycle whose tip is ahead of the frame that turns, so that a flip of the bevel makes a
    kink in the path of the tip.

    Parameters
    ----------
    wheel_angle : float
        Angle phi of the front wheel [rad], below pi/2.
    wheelbase : float
        Distance l_1 of the wheels [m], above 0.
    ahead : float
        Distance l_2 of the tip ahead of the back wheel [m].

    Raises
    ------
    InputError
        If a value is outside its range.

    Notes
    -----
    Webster et al. 2006: curvature tan(phi) / l_1, tip at p + l_2 times the tangent.
    """

    def __init__(self, wheel_angle: float, wheelbase: float, ahead: float):
        above_zero("wheelbase", wheelbase, "m", "Give l_1 in m.")
        if not abs(wheel_angle) < 0.5 * math.pi:
            raise InputError("wheel_angle", f"{wheel_angle} rad", "must be below pi/2", next_step="Give phi in rad.")
        in_range("ahead", ahead, TRAVEL, "Give l_2 in m.", ())
        super().__init__(math.tan(wheel_angle) / wheelbase)
        self.ahead = float(ahead)


@dataclass(frozen=True)
class _Piece:
    """A piece of path: where it starts, and by how much the needle advances, bends and rolls along it."""

    start: float
    frame: np.ndarray
    roll: float
    length: float
    curvature: float
    turn: float

    def frame_at(self, depth: float) -> np.ndarray:
        share = min((depth - self.start) / self.length, 1.0)
        rotation = share * np.array([0.0, self.curvature * self.length, self.turn])
        motion = _screw(rotation, share * self.length)
        return self.frame @ _turned(self.roll) @ motion @ _turned(-self.roll - share * self.turn)


def _turned(angle: float) -> np.ndarray:
    return _screw(np.array([0.0, 0.0, angle]), 0.0)


def _screw(rotation: np.ndarray, length: float) -> np.ndarray:
    """The motion of a frame that turns by a rotation vector [rad] in its own axes while it goes `length` [m] along
    its z axis."""
    angle = math.hypot(*rotation)
    x, y, z = rotation
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    if angle > 1e-3:
        sine, first, second = (
            math.sin(angle) / angle,
            (1.0 - math.cos(angle)) / angle**2,
            (angle - math.sin(angle)) / angle**3,
        )
    else:
        square = angle**2
        sine, first, second = 1.0 - square / 6.0, 0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0
    frame = np.eye(4)
    frame[:3, :3] += sine * cross + first * cross @ cross
    frame[:3, 3] = length * (np.eye(3) + first * cross + second * cross @ cross)[:, 2]
    return frame


def _entry(depth: float, lateral: tuple[float, float], tilt: tuple[float, float]) -> np.ndarray:
    """The first frame, on the line of the base."""
    frame = _screw(np.array([-tilt[1], tilt[0], 0.0]), 0.0)
    frame[:3, 3] = [lateral[0], lateral[1], depth]
    return frame
