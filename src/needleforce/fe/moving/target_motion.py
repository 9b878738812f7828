# SPDX-License-Identifier: Apache-2.0
"""Where to enter, and how deep, so that the tip meets a target that moves with the tissue."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ...errors import InputError
from ..elastic.elements import Symmetry
from ..elastic.needle_path import NeedlePath
from .dynamic_insertion import DynamicInsertion, stroke
from .insertion_run import InsertionRun

_UNKNOWNS = ("entry", "depth")


@dataclass(frozen=True, eq=False)
class EntryPlan:
    """Outcome of ``plan_entry``.

    Attributes
    ----------
    path : NeedlePath
        From the planned entry.
    entry : ndarray, shape (d - 1,)
        Where it begins at the surface [m].
    depth : float
        Of the tip at the end, from the undeformed surface along the path [m].
    target : ndarray, shape (d,)
        Where the target is at the end [m].
    miss : ndarray, shape (d,)
        From the tip to the target at the end [m].
    reached : bool
        Whether what could be adjusted is within the tolerance.
    runs : int
        Number of insertions that were simulated.
    run : InsertionRun
        The planned insertion.
    """

    path: NeedlePath
    entry: np.ndarray
    depth: float
    target: np.ndarray
    miss: np.ndarray
    reached: bool
    runs: int
    run: InsertionRun

    @property
    def distance(self) -> float:
        """From the tip to the target at the end [m]."""
        return float(np.linalg.norm(self.miss))


def plan_entry(
    insertion: DynamicInsertion,
    target: ArrayLike,
    *,
    speed: float,
    hold: float = 0.0,
    adjust: Sequence[str] = _UNKNOWNS,
    tolerance: float = 2e-5,
    max_runs: int = 12,
) -> EntryPlan:
    """Entry and depth with which the tip meets a target where the insertion has moved it.

    The first insertion aims at the target where it was; each next one where the last has moved it, corrected by a
    secant in all unknowns (Broyden's method).

    Parameters
    ----------
    insertion : DynamicInsertion
        The needle, along a path from about the entry, and the tissue. Other entries need a full model: a reduced one
        knows a single path.
    target : array_like, shape (d,)
        In the tissue before it moved [m].
    speed : float
        Of the stroke [m/s].
    hold : float
        Duration of rest after the stroke, at the end of which the target is to be met [s].
    adjust : sequence of str
        ``"entry"``, ``"depth"``, or both. What is not adjusted stays: the entry of the path, or the depth of the
        target before it moved.
    tolerance : float
        Distance in what is adjusted [m].
    max_runs : int
        Insertions at most.

    Returns
    -------
    EntryPlan
        The best of all insertions, with its miss.

    Raises
    ------
    InputError
        If the target is outside the mesh, an unknown has another name, or the path does not reach so deep.

    Notes
    -----
    The needle stays straight; the tip is where it is commanded, not where the tissue in front of it was.
    Alterovitz et al. (2003), Proc. IEEE ICRA.
    """
    place = np.asarray(target, dtype=float)
    adjust = _adjusted(adjust, insertion)
    aim = _Aim(insertion, place, adjust, (speed, hold))
    values, inverse = aim.first(), np.eye(len(aim.axes.T))
    plans = [aim.plan(values)]
    offsets = [aim.offset(plans[0])]
    while np.linalg.norm(offsets[-1]) > tolerance and len(plans) < max_runs:
        step = inverse @ offsets[-1]
        values = values + step
        plans.append(aim.plan(values))
        offsets.append(aim.offset(plans[-1]))
        inverse = _secant(inverse, step, offsets[-2] - offsets[-1])
    best = int(np.argmin([np.linalg.norm(each) for each in offsets]))
    return replace(plans[best], runs=len(plans), reached=bool(np.linalg.norm(offsets[best]) <= tolerance))


class _Aim:
    """Insertions for values of what is adjusted."""

    def __init__(
        self, insertion: DynamicInsertion, target: np.ndarray, adjust: Sequence[str], motion: tuple[float, float]
    ):
        self.insertion, self.target, self.adjust, self.motion = insertion, target, adjust, motion
        self.dimension = insertion.model.values_at(target[None]).shape[0]
        self.along = insertion.path.along(self.dimension)
        lateral = np.eye(self.dimension)[:, :-1]
        depth = self.along[:, None]
        self.axes = np.column_stack([each for name, each in zip(_UNKNOWNS, (lateral, depth)) if name in adjust])

    def first(self) -> np.ndarray:
        """Values that meet the target where it was."""
        start, depth = self._default()
        tip = start + depth * self.along
        return self._values(start[:-1], depth) + np.linalg.pinv(self.axes) @ (self.target - tip)

    def plan(self, values: np.ndarray) -> EntryPlan:
        start, depth = self._default()
        entry = values[: self.dimension - 1] if "entry" in self.adjust else start[:-1]
        depth = float(values[-1]) if "depth" in self.adjust else depth
        path = self.insertion.path
        if "entry" in self.adjust:
            path = replace(path, entry=tuple(entry.tolist()))
        insertion = self.insertion if path is self.insertion.path else self.insertion.along(path)
        run = insertion.run(stroke(depth, self.motion[0], insertion.dt, hold=self.motion[1]), targets=[self.target])
        tip = np.append(entry, 0.0) + depth * self.along
        return EntryPlan(
            path=path, entry=entry, depth=depth, target=run.targets[-1, 0], miss=run.targets[-1, 0] - tip,
            reached=False, runs=1, run=run,
        )  # fmt: skip

    def offset(self, plan: EntryPlan) -> np.ndarray:
        """The miss in what is adjusted [m]."""
        return np.linalg.pinv(self.axes) @ plan.miss

    def _default(self) -> tuple[np.ndarray, float]:
        """Start of the path, and the depth of the target before it moved."""
        start = self.insertion.path.start(self.dimension)
        return start, float((self.target - start)[-1] / self.along[-1])

    def _values(self, entry: np.ndarray, depth: float) -> np.ndarray:
        parts = {"entry": entry, "depth": np.array([depth])}
        return np.concatenate([parts[name] for name in _UNKNOWNS if name in self.adjust])


def _adjusted(adjust: Sequence[str], insertion: DynamicInsertion) -> list[str]:
    unknown = [each for each in adjust if each not in _UNKNOWNS]
    if unknown or not len(adjust):
        raise InputError("adjust", list(adjust), f"must be {' or '.join(_UNKNOWNS)}, or both")
    model = getattr(insertion.model, "full", insertion.model)
    if "entry" in adjust and model.tissue.symmetry is Symmetry.AXISYMMETRIC:
        step = 'Use adjust=("depth",), or a mesh in the plane or in space.'
        raise InputError("entry", "fixed", "on the axis of an axisymmetric mesh", next_step=step)
    return list(adjust)


def _secant(inverse: np.ndarray, step: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Broyden's update, after which ``inverse @ change`` is the step that made the change."""
    scale = step @ inverse @ change
    if abs(scale) < 1e-12 * (step @ step):
        return inverse
    return inverse + np.outer(step - inverse @ change, step @ inverse) / scale
