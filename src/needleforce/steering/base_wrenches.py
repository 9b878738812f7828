# SPDX-License-Identifier: Apache-2.0
"""Wrenches at the base of an insertion, as they were recorded."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..errors import InputError
from ..recording import Recording
from .tip_paths import TipPath
from .wrench_sensor import WrenchSensor

AXES = ("fx", "fy", "tx", "ty")
_COMPONENTS = [0, 1, 3, 4]  # of a wrench: the lateral forces and the bending moments


@dataclass(frozen=True, eq=False)
class BaseWrench:
    """One insertion whose lateral forces and bending moments were recorded.

    Attributes
    ----------
    name : str
        Of the insertion.
    depth : ndarray, shape (n,)
        Travel of the needle in tissue [m].
    base : ndarray, shape (n, 2)
        Lateral position of the guide or hub [m].
    roll : ndarray, shape (n,)
        Rotation of the needle [rad].
    lateral : ndarray, shape (n, 4)
        fx, fy [N], tx, ty [N m] of the tissue on the needle at the base, in its frame.
    sensor : WrenchSensor
        What read them.
    """

    name: str
    depth: np.ndarray
    base: np.ndarray
    roll: np.ndarray
    lateral: np.ndarray
    sensor: WrenchSensor = field(default_factory=WrenchSensor)

    def __post_init__(self) -> None:
        n = len(self.depth)
        for quantity, shape in (("base", (n, 2)), ("roll", (n,)), ("lateral", (n, 4))):
            if np.shape(getattr(self, quantity)) != shape:
                raise InputError(f"shape of {quantity}", np.shape(getattr(self, quantity)), f"must be {shape}")
        for quantity in ("depth", "base", "roll", "lateral"):
            if not np.all(np.isfinite(getattr(self, quantity))):
                step = "Leave these rows out."
                raise InputError(f"{quantity} of {self.name}", "not finite", "must be numbers", next_step=step)

    def __len__(self) -> int:
        return len(self.depth)

    @property
    def path(self) -> TipPath:
        """The motion of the base, with a tip that goes straight."""
        tip = np.column_stack([np.zeros((len(self), 2)), self.depth])
        return TipPath(self.name, self.base, tip, None, roll=self.roll)

    @property
    def noise(self) -> np.ndarray:
        """Standard deviations of the four components at the base [N], [N m]: a lever turns noise of the force into
        noise of the moment."""
        lever = float(np.linalg.norm(self.sensor.position))
        moment = np.hypot(self.sensor.moment_noise, lever * self.sensor.force_noise)
        return np.array([self.sensor.force_noise] * 2 + [moment] * 2)

    def rows(self, index: np.ndarray) -> "BaseWrench":
        """Some of its rows."""
        return BaseWrench(
            self.name, self.depth[index], self.base[index], self.roll[index], self.lateral[index], self.sensor
        )


def base_wrench(
    recording: Recording,
    *,
    entry: float,
    sensor: WrenchSensor | None = None,
    roll: float = 0.0,
    lateral: Sequence[np.ndarray] | None = None,
) -> BaseWrench:
    """Lateral forces and moments of a recording, from its entry into the tissue to its deepest point.

    Parameters
    ----------
    recording : Recording
        With the axes fx, fy [N], tx, ty [N m]; units of torques are given when it is read (``units={"tx": "Nmm"}``).
    entry : float
        Depth at which the tip enters the tissue, in the recording's own zero [m], such as that of the first puncture.
    sensor : WrenchSensor, optional
        Frame, lever and noise; the default is a sensor at the base in its frame.
    roll : float
        Rotation at which the needle was mounted [rad].
    lateral : sequence of two ndarray, shape (n,), optional
        Position of the base across [m]; the default is at rest.

    Returns
    -------
    BaseWrench

    Raises
    ------
    InputError
        If an axis is missing, or the recording does not reach the entry.
    """
    missing = [axis for axis in AXES if axis not in recording.axes]
    if missing:
        step = "Give their units when the file is read: units={'tx': 'Nmm', 'ty': 'Nmm'}."
        raise InputError(
            "axes of the recording", ", ".join(recording.axes) or "none", f"{missing[0]} is missing", next_step=step
        )
    deepest = int(np.argmax(recording.depth))
    inside = np.flatnonzero(recording.depth[: deepest + 1] >= entry)
    if len(inside) < 3:
        limit = f"is not passed; the deepest point is {1e3 * recording.depth[deepest]:.2f} mm"
        raise InputError("entry", f"{1e3 * entry:.2f} mm", limit, next_step="Give a depth of the recording.")
    readings = np.zeros((len(inside), 6))
    readings[:, _COMPONENTS] = np.column_stack([recording.axes[axis][inside] for axis in AXES])
    readings[:, 2] = recording.force[inside]
    rolls, sensor = np.full(len(inside), roll), sensor or WrenchSensor()
    base = np.zeros((len(inside), 2)) if lateral is None else np.column_stack([each[inside] for each in lateral])
    at_base = sensor.wrench(readings, rolls)[:, _COMPONENTS]
    depth = np.maximum.accumulate(recording.depth[inside]) - entry
    return BaseWrench(recording.card.source or "recording", depth, base, rolls, at_base, sensor)
