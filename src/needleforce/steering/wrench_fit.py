# SPDX-License-Identifier: Apache-2.0
"""Wrenches at the base of an insertion, and tissue, tip and guide from them alone."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from .. import core
from ..checks import FORCE, PLACE, ROLL, TRAVEL, in_range, one_of
from ..errors import InputError
from ..recording import Recording
from .path_simulation import simulated_path
from .result import SteeringResult
from .steering_model import identified_model
from .steering_parameters import ALIGNED, WRENCH_MODELS, Progress, held_at, search, within_reach
from .tip_paths import MAX_COMPARED, TipPath
from .wrench_sensor import WrenchSensor

AXES = ("fx", "fy", "tx", "ty")
_LATERAL = [0, 1, 3, 4]  # of a wrench: the lateral forces and the bending moments


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
        step = "Give a row a step, and leave out rows without a reading."
        shapes = {"depth": ((n,), TRAVEL), "base": ((n, 2), PLACE), "roll": ((n,), ROLL), "lateral": ((n, 4), FORCE)}
        for quantity, (shape, allowed) in shapes.items():
            in_range(f"{quantity} of {self.name}", getattr(self, quantity), allowed, step, shape)

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
        columns = (values[index] for values in (self.depth, self.base, self.roll, self.lateral))
        return BaseWrench(self.name, *columns, sensor=self.sensor)


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
        If an axis is missing, the recording does not reach the entry, or the sensor's z is across the insertion.
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
    rolls, sensor = np.full(len(inside), roll), sensor or WrenchSensor()
    readings = np.zeros((len(inside), 6))
    readings[:, _LATERAL] = np.column_stack([recording.axes[axis][inside] for axis in AXES])
    readings = sensor.completed(readings, recording.force[inside], rolls)
    base = np.zeros((len(inside), 2)) if lateral is None else np.column_stack([each[inside] for each in lateral])
    at_base = sensor.wrench(readings, rolls)[:, _LATERAL]
    depth = np.maximum.accumulate(recording.depth[inside]) - entry
    name = recording.card.source or "recording"
    return BaseWrench(name, depth, base, rolls, at_base, sensor=sensor)


# what the mechanics get wrong at the site to which they are fitted: a share of the largest force and moment, which
# varies along this length
MODEL_ERROR = 0.05
MODEL_LENGTH = 0.01  # [m]
_BIAS = 10.0  # of the sensor, in standard deviations of its noise


class WrenchFit(SteeringResult):
    """A needle identified from base wrenches, whose tip is predicted without any tip having been measured; ``rms`` is
    the residual of fx, fy [N], tx, ty [N m] of each insertion."""

    measured = "recorded base wrenches"

    def predict(self, insertion: BaseWrench) -> np.ndarray:
        """fx, fy [N], tx, ty [N m] at the base for the motion of an insertion, (n, 4)."""
        return _simulated(self.model.values, insertion, self.model.needle)


def identify_wrenches(
    insertions: Sequence[BaseWrench],
    needle: core.Needle,
    *,
    model: str = "linear",
    held: str = "guide",
    progress: Progress | None = None,
) -> WrenchFit:
    """Identify tissue, tip and guide from base wrenches: ``nf.steering.identify`` for ``BaseWrench``.

    More than 60 rows are thinned evenly. The bending stiffness of the needle turns wrenches into deflections: an error
    of it is one of the predicted tip. Raises InputError if the model is unknown, or an insertion has less than three
    rows.
    """
    one_of("model", model, WRENCH_MODELS)
    if not insertions or any(len(each) < 3 for each in insertions):
        limit = "needed with at least three rows each"
        raise InputError("insertions", len(insertions), limit, next_step="Give nf.steering.base_wrench(…).")
    thinned = [each.rows(np.unique(np.linspace(0, len(each) - 1, MAX_COMPARED).astype(int))) for each in insertions]
    factors = [[np.linalg.cholesky(block) for block in _covariances(each)] for each in thinned]

    def misfit(values: dict[str, float]) -> np.ndarray:
        parts = []
        for each, blocks in zip(thinned, factors):
            residuals = each.lateral - _simulated(values, each, needle)
            parts += [np.linalg.solve(block, column) for block, column in zip(blocks, residuals.T)]
        return np.concatenate(parts)

    parameters = within_reach(held_at(WRENCH_MODELS[model], held), needle.length, insertions)
    found = search(parameters, misfit, progress)
    values = found.values | ALIGNED
    fitted = identified_model(model, needle, values, parameters=parameters, covariance=found.spread.covariance)
    left = {each.name: _simulated(values, each, needle) - each.lateral for each in insertions}
    rms = {name: np.sqrt(np.mean(apart**2, axis=0)) for name, apart in left.items()}
    return WrenchFit(fitted, found.estimates, found.trade_offs, rms)


def _simulated(values: dict[str, float], insertion: BaseWrench, needle: core.Needle) -> np.ndarray:
    """Lateral forces and moments (n, 4) about a sensor that is further behind the base by the lever."""
    wrench = simulated_path(values | ALIGNED, insertion.path, needle=needle).wrench
    force, moment, lever = wrench[:, :2], wrench[:, 3:5], values["lever"]
    return np.column_stack([force, moment + lever * np.column_stack([-force[:, 1], force[:, 0]])])


def _covariances(insertion: BaseWrench) -> list[np.ndarray]:
    """Of the errors of each component: noise and bias of the sensor, and what the mechanics get wrong."""
    apart = insertion.depth[:, None] - insertion.depth
    similar = np.exp(-0.5 * (apart / MODEL_LENGTH) ** 2)
    largest = np.abs(insertion.lateral).reshape(-1, 2, 2).max(axis=(0, 2))  # of the forces and of the moments
    return [
        noise**2 * (np.eye(len(insertion)) + _BIAS**2) + (MODEL_ERROR * size) ** 2 * similar
        for noise, size in zip(insertion.noise, np.repeat(largest, 2))
    ]
