# SPDX-License-Identifier: Apache-2.0
"""Planning as least squares: knots of base motion in, distances from target, obstacles and limits out."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..checks import TRAVEL, in_range
from ..errors import InputError
from ..models.model import Model
from .base_motion import BaseMotion, Replays
from .obstacles import Obstacle, distance_to
from .path_simulation import SimulatedPath
from .steering_model import SteeringModel
from .tip_paths import TipPath

# residuals are in units of these
TARGET = 2e-5  # [m]
CLEARANCE = 2e-5  # [m] kept beyond the one that is asked for
TOLERANCE = 1e-4  # [m] of a target that is reached
OVER_LIMIT = 1e-2  # share of a limit that a plan may exceed
# obstacles and limits are kept before the target is met
_NEARER = 2e-6  # [m] than that
_BEYOND = 1e-3  # share of a limit
EFFORT = 5.0  # of a base at its limit; a tip 0.1 mm off counts as much
UNSMOOTH = 2.0  # of two knots that differ by the limit
_KNOTS = 8
_APART = 1e-4  # [m] of the places that are compared with obstacles


@dataclass(frozen=True, kw_only=True)
class SteeringLimits:
    """What the robot and the tissue allow; limits of loads, like obstacles, are kept before the target is met.

    Parameters
    ----------
    max_lateral : float
        Motion of the base across from its start, along x and along y [m]; 0: the base does not move.
    max_lateral_step : float
        Motion across in one step, along x and along y [m].
    steer_from : float
        Depth up to which the base does not move, so that the point of entry stays where it is [m].
    rolls : bool
        Whether the needle may be turned about its axis between the steps.
    max_force : float
        Axial force [N]; it needs a model of the axial force.
    max_lateral_force : float
        Lateral force at the base [N].
    max_moment : float
        Bending moment at the base [N m].

    Raises
    ------
    InputError
        If a limit is negative or not a number, a limit of a load is 0, or neither motion is allowed.
    """

    max_lateral: float = 6e-3
    max_lateral_step: float = 6e-3
    steer_from: float = 5e-3
    rolls: bool = False
    max_force: float = np.inf
    max_lateral_force: float = np.inf
    max_moment: float = np.inf

    def __post_init__(self) -> None:
        loads = ("max_force", "max_lateral_force", "max_moment")
        for quantity in ("max_lateral", "max_lateral_step", "steer_from", *loads):
            value, low = getattr(self, quantity), "above 0" if quantity in loads else "at least 0"
            if not (value > 0.0 or (value == 0.0 and low == "at least 0")):
                raise InputError(quantity, value, f"must be {low}", next_step="Give it in SI units.")
        in_range("max_lateral", self.max_lateral, TRAVEL, "Give it in m.", ())
        if not (self.rolls or self.moves):
            step = "Allow max_lateral above 0, or rolls=True."
            raise InputError("limits", "no motion", "a needle is steered by one", next_step=step)

    @property
    def moves(self) -> bool:
        """Whether the base may move across."""
        return self.max_lateral > 0.0 and self.max_lateral_step > 0.0


@dataclass(frozen=True, eq=False, kw_only=True)
class PlanProblem:
    """What is planned: rows of base motion from the executed ones to the target's depth."""

    model: SteeringModel
    target: np.ndarray  # (3,) [m] from the point of entry
    depths: np.ndarray  # (n,) [m] of each row; the last is that of the target
    executed: BaseMotion  # at least the first row
    limits: SteeringLimits
    readings: TipPath | None = None  # of the executed rows; without them the tip is at the origin in the first row
    obstacles: Sequence[Obstacle] = ()
    clearance: float = 0.0  # [m] kept from the obstacles
    axial: Model | None = None  # laws of the axial force
    effort: float = EFFORT
    replays: Replays = field(default_factory=dict)

    @property
    def free(self) -> int:
        """Rows that are still to be planned."""
        return len(self.depths) - len(self.executed)

    @cached_property
    def knots(self) -> np.ndarray:
        """Indices, among the free rows, at which the motion is sought; between them it is linear."""
        before = self.depths[len(self.executed) - 1 : -1]  # where the base moves
        first = min(int(np.sum(before < self.limits.steer_from - 1e-9)), self.free - 1)
        return np.unique(np.linspace(first, self.free - 1, min(_KNOTS, self.free - first)).round().astype(int))

    def motion(self, sought: np.ndarray) -> BaseMotion:
        """Base motion of all rows for the sought numbers: x and y at the knots as shares of the limit, then rolls."""
        lateral, roll = self._split(sought)
        n, rows = len(self.knots), np.arange(self.free)
        across = np.tile(self.executed.lateral[-1], (self.free, 1))
        if self.limits.moves:
            columns = [np.interp(rows, self.knots, column) for column in lateral.reshape(n, 2).T]
            across[self.knots[0] :] = self.limits.max_lateral * np.column_stack(columns)[self.knots[0] :]
        turned = np.full(self.free, self.executed.roll[-1])
        if self.limits.rolls:
            turned = roll[np.maximum(np.searchsorted(self.knots, rows, side="right") - 1, 0)]
        return self._continued(across, turned)

    def _continued(self, across: np.ndarray, turned: np.ndarray) -> BaseMotion:
        """The executed rows, and behind them free ones."""
        lateral, roll = np.vstack([self.executed.lateral, across]), np.append(self.executed.roll, turned)
        return BaseMotion(self.depths, lateral, roll)

    def start(self, direction: float | None = None, share: float = 0.0) -> np.ndarray:
        """Numbers to begin with: the base where it is, or towards a direction [rad] by a share of its limit."""
        n = len(self.knots)
        aside = np.zeros(2) if direction is None else share * np.array([np.cos(direction), np.sin(direction)])
        numbers = []
        if self.limits.moves:
            here = self.executed.lateral[-1] / self.limits.max_lateral
            numbers.append(np.clip(np.tile(here + aside, n), -1.0, 1.0))
        if self.limits.rolls:
            to_target = np.arctan2(self.target[1], self.target[0]) - self.model.roll
            towards = to_target if direction is None else direction - self.model.roll
            spread = 0.25 * np.pi * (-1.0) ** np.arange(n)  # equal rolls would stay equal in the search
            numbers.append(towards + spread)
        return np.concatenate(numbers)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Of the sought numbers."""
        n = len(self.knots)
        high = np.concatenate([np.ones(2 * n * self.limits.moves), np.full(n * self.limits.rolls, np.inf)])
        return -high, high

    def path(self, motion: BaseMotion) -> TipPath:
        """The rows as a tip path: what was read, and behind it straight on."""
        n = len(motion.depth)
        tip = np.column_stack([np.zeros((n, 2)), motion.depth])
        slope = None
        if self.readings is not None:
            done = len(self.executed)
            tip[:done] = self.readings.tip[:done] - self.readings.tip[0]
            tip[:, 2] = np.append(self.readings.depth[:done], motion.depth[done:])
            if self.readings.slope is not None:
                slope = np.vstack([self.readings.slope, np.zeros((n - done, 2))])
        return TipPath("plan", motion.lateral, tip, slope, roll=motion.roll)

    @cached_property
    def _error(self) -> np.ndarray:
        """Expected difference between the tip and the simulated one in all rows, (n, 2) [m], given the executed rows
        and the fit; it does not depend on the motion to come."""
        still = np.tile(self.executed.lateral[-1], (self.free, 1))
        path = self.path(self._continued(still, np.full(self.free, self.executed.roll[-1])))
        simulated = self.model.simulated(path, self.axial, self.replays)
        return self.model.predictor.expected_error(simulated, path, path.compared_until(len(self.executed)))

    def predicted(self, motion: BaseMotion) -> tuple[np.ndarray, SimulatedPath]:
        """Tip (n, 3) from the point of entry [m], with its expected error, and the simulation."""
        path = self.path(motion)
        simulated = self.model.simulated(path, self.axial, self.replays)
        across = simulated.tip - simulated.tip[0] + self._error
        along = path.depth - simulated.depth + simulated.along  # wherever the tissue begins
        return np.column_stack([across, along - along[0]]), simulated

    def residuals(self, sought: np.ndarray) -> np.ndarray:
        """Distances from target, obstacles and limits, and effort, for least squares."""
        return self.residuals_of(sought, *self.predicted(self.motion(sought)))

    def residuals_of(self, sought: np.ndarray, tip: np.ndarray, simulated: SimulatedPath) -> np.ndarray:
        """The same for a predicted tip."""
        motion = self.motion(sought)
        miss = (tip[-1, :2] - self.target[:2]) / TARGET
        return np.concatenate(
            [miss, self._near_obstacles(tip), self._over_limits(simulated), self._effort(motion), self._turns(sought)]
        )

    def distances(self, tip: np.ndarray, radius: np.ndarray | float = 0.0) -> np.ndarray:
        """Distance of the path that is still to be cut from the nearest obstacle [m], at places at most 0.1 mm apart,
        less a radius at the rows [m]."""
        if not len(self.obstacles):
            return np.full(self.free, np.inf)
        dense = self._between
        columns = (tip[:, 0], tip[:, 1], tip[:, 2], np.broadcast_to(radius, len(tip)))
        *points, less = (np.interp(dense, np.arange(len(tip)), column) for column in columns)
        return distance_to(self.obstacles, np.column_stack(points)) - less

    def faults(self, motion: BaseMotion, simulated: SimulatedPath, miss: float, distance: float) -> Iterator[str]:
        """What keeps a motion, which misses the target and passes obstacles by distances [m], from being executed."""
        if not miss <= TOLERANCE:
            yield f"the target is out of reach by {1e3 * miss:.2f} mm"
        if not distance >= self.clearance:
            clearance = f"the clearance of {1e3 * self.clearance:.2f} mm"
            yield f"an obstacle is {1e3 * distance:.2f} mm away, less than {clearance}"
        for load in loads_of(simulated, self.limits):
            if not load.sizes.max() <= load.limit * (1.0 + OVER_LIMIT):
                row = int(np.argmax(load.sizes))
                size = f"{load.name} is {load.sizes[row]:.3g} {load.unit}"
                depth = f"{1e3 * motion.depth[row]:.1f} mm"
                yield f"{size} at a depth of {depth}; the limit is {load.limit:.3g} {load.unit}"
        if simulated.lost.any():
            depth = 1e3 * motion.depth[int(np.argmax(simulated.lost))]
            yield f"the needle buckles, or the step is impossible, at a depth of {depth:.1f} mm"

    @cached_property
    def _between(self) -> np.ndarray:
        """Places along the rows that are still to be executed, which are compared with obstacles."""
        first, last = len(self.executed) - 1, len(self.depths) - 1
        counts = np.ceil(np.diff(self.depths[first:]) / _APART).astype(int)
        parts = [k + np.arange(count) / count for k, count in zip(range(first, last), counts) if count]
        return np.concatenate([*parts, [float(last)]])

    def _near_obstacles(self, tip: np.ndarray) -> np.ndarray:
        if not len(self.obstacles):
            return np.zeros(0)
        return np.maximum(self.clearance + CLEARANCE - self.distances(tip), 0.0) / _NEARER

    def _over_limits(self, simulated: SimulatedPath) -> np.ndarray:
        loads = loads_of(simulated, self.limits)
        parts = [np.maximum(load.sizes / load.limit - (1.0 - OVER_LIMIT), 0.0) / _BEYOND for load in loads]
        return np.concatenate([np.zeros(0), *(part[len(self.executed) :] for part in parts)])

    def _effort(self, motion: BaseMotion) -> np.ndarray:
        if not self.limits.moves:
            return np.zeros(0)
        done = len(self.executed)
        share = motion.lateral[done:] / self.limits.max_lateral
        steps = np.diff(motion.lateral[done - 1 :], axis=0)
        over = np.maximum(np.abs(steps) / self.limits.max_lateral_step - 1.0, 0.0) / OVER_LIMIT
        weight = self.effort / np.sqrt(self.free)
        parts = [weight * share, UNSMOOTH * weight / EFFORT * steps / self.limits.max_lateral_step, over]
        return np.concatenate([part.ravel() for part in parts])

    def _turns(self, sought: np.ndarray) -> np.ndarray:
        """A little of each turn, so that a roll without effect stays where it is."""
        if not self.limits.rolls:
            return np.zeros(0)
        roll = np.append(self.executed.roll[-1], self._split(sought)[1])
        return 1e-2 * self.effort * np.sin(0.5 * np.diff(roll))

    def _split(self, sought: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        n = 2 * len(self.knots) * self.limits.moves
        return sought[:n], sought[n:]


@dataclass(frozen=True, eq=False)
class LimitedLoad:
    """A force or moment along an insertion, and its limit."""

    name: str
    unit: str
    sizes: np.ndarray
    limit: float


def loads_of(simulated: SimulatedPath, limits: SteeringLimits) -> list[LimitedLoad]:
    """The loads that have a limit."""
    lateral, moment = np.hypot(*simulated.wrench[:, :2].T), np.hypot(*simulated.wrench[:, 3:5].T)
    loads = [
        LimitedLoad("axial force", "N", np.abs(simulated.force), limits.max_force),
        LimitedLoad("lateral force at the base", "N", lateral, limits.max_lateral_force),
        LimitedLoad("moment at the base", "N m", moment, limits.max_moment),
    ]
    return [load for load in loads if np.isfinite(load.limit)]
