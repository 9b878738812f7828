# SPDX-License-Identifier: Apache-2.0
"""Base motion so that the tip reaches a target: past obstacles, within limits, with its force and its uncertainty."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import TRAVEL, above_zero, in_range, not_below_zero
from ..display.markup import listing, table
from ..display.result import Result
from ..errors import InputError
from ..models.flexible_insertion import FlexibleInsertion
from ..models.model import Model
from .base_motion import BaseMotion
from .obstacles import Obstacle, distance_to
from .path_errors import POSITION_NOISE
from .plan_problem import PlanProblem, SteeringLimits
from .plan_search import Search, best
from .steered_run import simulate
from .steering_model import SteeringModel, steering_model
from .tip_paths import TIP_COLUMNS, TipPath

if TYPE_CHECKING:
    import pandas

    from ..display.page import Page

MAX_ROWS = 400


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Plan(Result):
    """A planned insertion.

    Attributes
    ----------
    motion : BaseMotion
        What the base does, step by step.
    path : ndarray, shape (n, 3)
        Predicted tip after each step, from the point of entry [m].
    force : ndarray, shape (n,)
        Axial force [N]; 0 without a model of it.
    wrench : ndarray, shape (n, 6)
        Of the tissue on the needle at the base [N], [N m].
    miss : float
        Distance of the predicted tip from the target at the end [m].
    clearance : float
        Smallest distance of the predicted path from an obstacle [m]; infinity without obstacles.
    faults : tuple of str
        A target out of reach, an obstacle that is too close, a limit that is exceeded, a needle that buckles, each
        with value and limit. Empty for a plan that can be executed.
    """

    motion: BaseMotion
    path: np.ndarray
    force: np.ndarray
    wrench: np.ndarray
    miss: float
    clearance: float
    faults: tuple[str, ...]
    problem: PlanProblem

    @property
    def target(self) -> np.ndarray:
        """The target, (3,) from the point of entry [m]."""
        return self.problem.target

    @cached_property
    def sd(self) -> np.ndarray:
        """Standard deviation of the tip from the point of entry in each lateral direction, (n,) [m]."""
        path = self.problem.path(self.motion)
        read = path.compared_until(len(self.problem.executed))
        # the point of entry is where the first reading found it
        entry = 0.0 if self.problem.readings is None else POSITION_NOISE
        return np.hypot(self.problem.model.predictor.uncertainty(path, read, weight=1.0), entry)

    @cached_property
    def shapes(self) -> tuple[np.ndarray, ...]:
        """The needle at some of the steps, the last of which is the end, (m, 3) each [m]."""
        return simulate(self.problem.model, self.motion, axial=self.problem.axial).shapes

    @property
    def uncertain_clearance(self) -> float:
        """Smallest distance of the 95 % tube from an obstacle [m]; infinity without obstacles."""
        return float(self.problem.distances(self.path, self.tube()).min())

    def tube(self, level: float = 0.95) -> np.ndarray:
        """Radius around the path in which the tip is with a probability.

        Parameters
        ----------
        level : float
            The probability [1], above 0 and below 1.

        Returns
        -------
        ndarray, shape (n,)
            Radius [m].

        Raises
        ------
        InputError
            If the level is none.
        """
        if not 0.0 < level < 1.0:
            raise InputError("level", level, "must be above 0 and below 1", next_step="Give 0.95 for 95 %.")
        return self.sd * math.sqrt(-2.0 * math.log(1.0 - level))

    def _heading(self) -> str:
        target = ", ".join(f"{1e3 * value:.2f}" for value in self.target)
        within = f"within {1e3 * self.tube()[-1]:.2f} mm with 95 %"
        end = f"The tip ends {1e3 * self.miss:.2f} mm from the target at ({target}) mm, {within}"
        clear = ""
        if np.isfinite(self.clearance):
            touched = ", which it may touch within its uncertainty" * (self.uncertain_clearance < 0.0)
            clear = f", and stays {1e3 * self.clearance:.2f} mm away from obstacles{touched}"
        return f"{end}{clear}." + " The plan has faults, listed below." * bool(self.faults)

    def _cells(self) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
        heads = ("depth [mm]", "base x [mm]", "base y [mm]", "roll [°]", "tip x [mm]", "tip y [mm]", "95 % radius [mm]")
        rows = [
            [*(f"{value:.2f}" for value in row.values()), *(f"{1e3 * value:.2f}" for value in (*tip[:2], radius))]
            for row, tip, radius in zip(self.motion.rows(), self.path, self.tube())
        ]
        return heads, rows

    def _remarks(self) -> Iterable[tuple[str, Iterable[str]]]:
        yield "Faults", self.faults

    def _draw(self, axes: Any) -> tuple[str, ...]:
        """The path of the tip across, over its depth, with the target."""
        from .figures import draw_path

        labels = draw_path(axes, self.path)
        axes.plot([1e3 * self.target[2]] * 2, 1e3 * self.target[:2], "kx", label="target")
        return labels

    def document(self) -> dict:
        """Target, what is missed, faults and steps, as ``to_json`` writes them."""
        keys, motion = ("x_m", "y_m", "z_m"), self.motion
        steps = zip(motion.depth, motion.lateral, motion.roll)
        ends, loads = zip(self.path, self.tube()), zip(self.force, self.wrench)
        rows = [
            {
                "depth_m": depth, "base_x_m": base[0], "base_y_m": base[1], "roll_rad": roll,
                "tip": dict(zip(keys, tip)), "radius_95_m": radius, "force_N": force, "wrench": list(wrench),
            }
            for (depth, base, roll), (tip, radius), (force, wrench) in zip(steps, ends, loads)
        ]  # fmt: skip
        return {
            "target": dict(zip(keys, self.target)),
            "miss_m": self.miss,
            "clearance_m": self.clearance if math.isfinite(self.clearance) else None,
            "faults": list(self.faults),
            "steps": rows,
        }

    def to_dataframe(self) -> "pandas.DataFrame":
        """A pandas DataFrame with a row for each step, units in the names of its columns."""
        columns = dict(zip(TIP_COLUMNS, 1e3 * self.path.T)) | {"radius_95_mm": 1e3 * self.tube(), "force_N": self.force}
        return self.motion.to_dataframe().assign(**columns)

    def _page(self) -> "Page":
        from ..display.page import Page, section
        from . import figures

        names = ("depth [mm]", "base x [mm]", "base y [mm]", "roll [°]", "95 % radius [mm]", "axial force [N]")
        names = names if self.force.any() else names[:-1]  # the model has no laws along the needle
        values = np.column_stack([[list(row.values()) for row in self.motion.rows()], 1e3 * self.tube(), self.force])
        rows = [[f"{value:.3f}" for value in row[: len(names)]] for row in np.round(values, 3) + 0.0]  # no "-0.000"
        steps = table(names, rows, class_="numbers dense")
        seen = {"tube": self.tube(), "obstacles": self.problem.obstacles, "target": self.target}
        path = figures.Scene(path=self.path, shapes=self.shapes, **seen).figures()
        loads = figures.loads(self.motion.depth, self.force, self.wrench)
        return Page(
            title="A planned insertion",
            kind="steering plan",
            outcome=self.heading(),
            sections=[
                section("Faults", listing(self.faults), name="faults"),
                section("Path", *path, name="path"),
                section("Motion of the base", figures.base_motion(self.motion), name="motion"),
                section("Force and wrench", loads, name="loads"),
                section("Table", steps, name="table"),
            ],
        )

    def replan(self, readings: TipPath, *, progress: Callable[[int, float], None] | None = None) -> "Plan":
        """Plan the rest anew from the tips that were measured so far.

        Parameters
        ----------
        readings : TipPath
            Base, roll and tip of the executed steps, of which the first is the entry, as in ``motion``.
        progress : callable, optional
            Called with the number of evaluations and the cost.

        Returns
        -------
        Plan

        Raises
        ------
        InputError
            If no step or every planned step was executed, or the readings are more than half a step from the plan.
        """
        done, rows = len(readings), len(self.motion)
        if not 0 < done < rows:
            limit = f"must be 1 to {rows - 1}, as {rows} rows are planned"
            raise InputError("executed rows", done, limit, next_step="Give the rows that were executed.")
        off = np.abs(readings.depth - self.motion.depth[:done])
        step = float(np.diff(self.motion.depth).max())
        if off.max() > 0.5 * step:
            row = int(np.argmax(off))
            limit = f"the plan has {1e3 * self.motion.depth[row]:.1f} mm in row {row + 1}"
            again = "Give a row for each planned step, or plan anew with readings=."
            raise InputError("depth of the readings", f"{1e3 * readings.depth[row]:.1f} mm", limit, next_step=again)
        executed = BaseMotion(self.motion.depth[:done], readings.base - readings.base[0], readings.roll)
        problem = replace(self.problem, executed=executed, readings=readings)
        return _planned(problem, self.motion, progress)


def plan(
    model: SteeringModel | FlexibleInsertion,
    target: ArrayLike,
    *,
    obstacles: Sequence[Obstacle] = (),
    clearance: float = 0.0,
    limits: SteeringLimits | None = None,
    step: float = 5e-3,
    axial: Model | None = None,
    readings: TipPath | None = None,
    progress: Callable[[int, float], None] | None = None,
) -> Plan:
    """Plan the motion of the base that brings the tip to a target.

    Parameters
    ----------
    model : SteeringModel or FlexibleInsertion
        ``found.model`` of an identified needle; or an insertion whose parameters are given, which is reset.
    target : array_like, shape (3,)
        From the point of entry: x and y across, z along the insertion [m], in the frame of the tip paths with which
        the model was identified.
    obstacles : sequence
        ``Sphere``, ``Box``, or functions that return the signed distance of points.
    clearance : float
        Distance that the path keeps from them [m].
    limits : SteeringLimits, optional
        Default: a base that moves by 6 mm at most and does not roll.
    step : float
        Travel between two motions of the base [m].
    axial : Model, optional
        Laws of the axial force, for an identified needle.
    readings : TipPath, optional
        Steps that were executed, of which the first is the entry.
    progress : callable, optional
        Called with the number of evaluations and the cost.

    Returns
    -------
    Plan
        Also where the target cannot be reached: ``plan.faults`` states by how much.

    Raises
    ------
    InputError
        If the axial force has a limit but no laws; if the target is not below the surface and the readings, is too
        close to an obstacle or deeper than the needle reaches; if the point of entry is too close to an obstacle; or
        if a value is not finite.
    """
    steered, aim = steering_model(model, axial), _target(target)
    limits = limits or SteeringLimits()
    without_force = axial is None and (not isinstance(model, FlexibleInsertion) or model.model is None)
    if math.isfinite(limits.max_force) and without_force:
        step_back = "Give axial=nf.preset(…), or leave max_force out."
        raise InputError("max_force", f"{limits.max_force:g} N", "needs laws of the axial force", next_step=step_back)
    _check(steered, aim, obstacles, clearance, step)
    count = len(readings) if readings is not None else 1
    begin = float(readings.depth[count - 1]) if readings is not None else 0.0
    if begin >= aim[2]:
        limit = f"must be less than that of the target, {1e3 * aim[2]:g} mm"
        step_back = "Withdraw the needle, or give a deeper target."
        raise InputError("depth of the last reading", f"{1e3 * begin:g} mm", limit, next_step=step_back)
    depths = _depths(readings, begin, aim[2], step)
    executed = BaseMotion(np.zeros(1), np.zeros((1, 2)), np.zeros(1))
    if readings is not None:
        executed = BaseMotion(depths[:count], readings.base - readings.base[0], readings.roll)
    problem = PlanProblem(
        model=steered,
        target=aim,
        depths=depths,
        executed=executed,
        readings=readings,
        limits=limits,
        obstacles=tuple(obstacles),
        clearance=clearance,
        axial=axial,
    )
    return _planned(problem, None, progress)


def _planned(problem: PlanProblem, before: BaseMotion | None, progress: Callable[[int, float], None] | None) -> Plan:
    problem, motion = best(problem, Search(before=before, progress=progress))
    tip, simulated = problem.predicted(motion)
    miss = float(np.linalg.norm(tip[-1] - problem.target))
    distance = float(problem.distances(tip).min())
    return Plan(
        motion=motion,
        path=tip,
        force=simulated.force,
        wrench=simulated.wrench,
        miss=miss,
        clearance=distance,
        faults=tuple(problem.faults(motion, simulated, miss, distance)),
        problem=problem,
    )


def _target(target: ArrayLike) -> np.ndarray:
    aim = in_range("target", target, TRAVEL, "Give three numbers, x, y, z in m from the entry.", (3,))
    if not aim[2] > 0.0:
        limit = "must be below the surface"
        raise InputError("depth of the target", f"{1e3 * aim[2]:g} mm", limit, next_step="z is positive inwards.")
    return aim


def _check(
    model: SteeringModel, target: np.ndarray, obstacles: Sequence[Obstacle], clearance: float, step: float
) -> None:
    above_zero("step", step, "m")
    if not target[2] <= MAX_ROWS * step:
        limit = f"must give at most {MAX_ROWS} steps to the target"
        raise InputError("step", f"{1e3 * step:g} mm", limit, next_step="Give longer steps.")
    reach = model.needle.length - model.values.get("guide_distance", 0.0)
    if target[2] > reach:
        limit, step_back = f"the needle reaches {1e3 * reach:g} mm", "Give a longer needle or a nearer target."
        raise InputError("depth of the target", f"{1e3 * target[2]:g} mm", limit, next_step=step_back)
    not_below_zero("clearance", clearance, "m")
    for name, point in (("target", target), ("point of entry", np.zeros(3))):
        distance = float(distance_to(obstacles, point[None])[0])
        if distance < clearance:
            limit = f"must be at least the clearance of {1e3 * clearance:.2f} mm"
            step_away = "Move it, or give less clearance."
            raise InputError(
                f"distance of the {name} from an obstacle", f"{1e3 * distance:.2f} mm", limit, next_step=step_away
            )


def _depths(readings: TipPath | None, begin: float, end: float, step: float) -> np.ndarray:
    """Depths of the executed rows, then evenly to the target."""
    count = max(1, math.ceil((end - begin) / step - 1e-9))
    ahead = begin + (end - begin) * np.arange(1, count + 1) / count
    return np.append(readings.depth if readings is not None else 0.0, ahead)
