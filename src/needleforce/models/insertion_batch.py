# SPDX-License-Identifier: Apache-2.0
"""Many insertions that are stepped together, of one model or each of its own."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import core
from ..checks import instance_of
from ..errors import InputError
from .engine_batch import EngineBatch
from .model import Model

_NUMBERS = ("depth", "velocity", "force", "stiffness", "friction", "cutting", "lateral", "force_by_depth")
_NUMBERS += ("force_by_velocity",)
_PLACES, _EVENTS = ("phase", "status"), ("contact", "punctured", "exit")
_ROWS = {name: row for row, name in enumerate(_NUMBERS + _PLACES + _EVENTS)}


class BatchSample:
    """One step of a batch: an array (n,) for each number of a ``Sample``.

    Attributes
    ----------
    depth, velocity, force, stiffness, friction, cutting, lateral, force_by_depth, force_by_velocity : ndarray
        As in ``Sample``: [m], [m/s], [N], and derivatives.
    phase, status : ndarray
        Places in ``list(nf.Phase)`` and ``list(nf.Status)``.
    contact, punctured, exit : ndarray
        True in the one step that touches, breaks through or leaves.
    """

    def __init__(self, rows: np.ndarray):
        self._rows = rows

    def __getattr__(self, name: str) -> np.ndarray:
        if name not in _ROWS:
            raise AttributeError(f"a BatchSample has no {name!r}: it has {', '.join(_ROWS)}")
        row = self._rows[_ROWS[name]]
        return row if name in _NUMBERS else row.astype(np.int8 if name in _PLACES else bool)

    def __len__(self) -> int:
        return self._rows.shape[1]

    def __repr__(self) -> str:
        force = self.force
        span = f", forces {force.min():.4g} to {force.max():.4g} N" if len(force) else ""
        return f"<BatchSample of {len(force)}{span}>"


class InsertionBatch(core.InsertionBatch):
    """n insertions that are stepped together, each with the values of an ``Insertion`` of its own.

    Where every model has one layer with ``coulomb`` friction, ``constant_cutting`` and no relaxation, and neither
    ``hold_time`` nor ``depth_noise`` is given, several are computed at a time; others one after the other.

    Parameters
    ----------
    models : Model or sequence of Model
        One model for all, or one for each member.
    n : int, optional
        How many members, 0 or more; needed with one model, otherwise as many as there are models.
    max_speed, hold_time, depth_noise, bevel
        As for ``Insertion``.
    threads : int
        How many threads may share the work of thousands of members.

    Raises
    ------
    InputError
        If a model is none, or a number is outside its range.
    """

    def __init__(
        self,
        models: Model | Sequence[Model],
        n: int | None = None,
        *,
        max_speed: float = 1.0,
        hold_time: float = 0.0,
        depth_noise: float = 0.0,
        bevel: core.Bevel | None = None,
        threads: int = 1,
    ):
        alone = isinstance(models, Model)
        each = [models] if alone else list(models)
        for number, model in enumerate(each):
            instance_of(f"model {number}", model, Model, "Give nf.preset(…) or nf.Model(…).")
        count = _count(n, None if alone else len(each))
        if threads < 1:
            raise InputError("threads", threads, "less than 1")
        limits = core.Limits(max_speed=max_speed, hold_time=hold_time, depth_noise=depth_noise)
        super().__init__([model.stack for model in each], count if alone else None, limits, bevel or core.Bevel())
        self.threads, self._models = int(threads), each
        limited = {"max_speed": max_speed, "hold_time": hold_time, "depth_noise": depth_noise}
        self._options = {**limited, "bevel": bevel, "threads": threads}

    @property
    def models(self) -> tuple[Model, ...]:
        """The model of all, or that of each member."""
        return tuple(self._models)

    @staticmethod
    def of(engines: Sequence[Any], threads: int = 1) -> EngineBatch:
        """Needles that bend, or condensed solids, as members: ``of([nf.FlexibleInsertion(…) for each in range(100)])``.

        Parameters
        ----------
        engines : sequence
            ``FlexibleInsertion`` or ``fe.CondensedInsertion``, each another object.
        threads : int
            How many may run at the same time.

        Returns
        -------
        EngineBatch
        """
        return EngineBatch(engines, threads)

    def step(self, depths: ArrayLike, velocities: ArrayLike | None, dt: ArrayLike) -> BatchSample:
        """One cycle of all members; never raises but for arrays of another length.

        Parameters
        ----------
        depths : array_like
            (n,) [m], or one for all.
        velocities : array_like or None
            (n,) [m/s], or one for all; None takes the change of depth.
        dt : array_like
            Since the last cycle [s], (n,) or one for all.

        Returns
        -------
        BatchSample
        """
        speeds = None if velocities is None else self._row(velocities)
        return BatchSample(self._step(self._row(depths), speeds, _numbers(np.atleast_1d(dt)), self.threads))

    def run(self, depths: ArrayLike, dt: ArrayLike) -> np.ndarray:
        """Whole motions, the velocity being the change of depth.

        Parameters
        ----------
        depths : array_like
            (steps, n) [m].
        dt : array_like
            Of each step [s], (steps,) or one for all.

        Returns
        -------
        ndarray
            (steps, n), forces [N].
        """
        motions = np.ascontiguousarray(depths, dtype=float)
        if motions.ndim != 2:
            raise InputError("the dimensions of depths", motions.ndim, "not 2", next_step="Give (steps, n).")
        times = np.broadcast_to(np.asarray(dt, dtype=float), (len(motions),)) if np.ndim(dt) == 0 else _numbers(dt)
        return self._run(motions, np.ascontiguousarray(times), self.threads)

    def reset(self, members: ArrayLike | None = None) -> None:
        """Some members, or all, back to before the first contact; ``members`` are their places, or a mask (n,)."""
        self._reset(self._places(members))

    def replace(self, member: int, model: Model) -> None:
        """Another model for a member, which is then before its first contact; the others continue.

        Parameters
        ----------
        member : int
            Its place, from 0.
        model : Model
            If its laws do not allow several members at a time, all are stepped one after the other from now on.

        Raises
        ------
        InputError
            If there is no such member or the model is invalid: nothing changes.
        """
        instance_of("model", model, Model, "Give nf.preset(…) or nf.Model(…).")
        self._replace(int(member), model.stack)
        if len(self._models) == 1:
            self._models = self._models * len(self)
        self._models[int(member)] = model

    def snapshot(self) -> "InsertionBatch":
        """A copy with its state, which can be stepped independently or passed to ``restore``."""
        alone = len(self._models) == 1
        copy = InsertionBatch(self._models[0] if alone else self._models, len(self), **self._options)
        copy._restore(self, None)
        return copy

    def restore(self, snapshot: "InsertionBatch", members: ArrayLike | None = None) -> None:
        """Some members, or all, as they were at a ``snapshot()``."""
        instance_of("snapshot", snapshot, InsertionBatch, "Give what snapshot() gave.")
        self._restore(snapshot, self._places(members))

    def _row(self, values: ArrayLike) -> np.ndarray:
        given = np.asarray(values, dtype=float)
        return _numbers(np.full(len(self), given) if given.ndim == 0 else given)

    def _places(self, members: ArrayLike | None) -> np.ndarray | None:
        if members is None:
            return None
        given = np.atleast_1d(members)
        if given.dtype == bool:
            if given.shape != (len(self),):
                raise InputError("the length of members", given.size, f"not that of the batch, {len(self)}")
            given = np.flatnonzero(given)
        return np.ascontiguousarray(given, dtype=np.int64)

    def __repr__(self) -> str:
        return f"<InsertionBatch of {len(self)} in {len(self.models)} model{'s' if len(self.models) != 1 else ''}>"


def _numbers(values: Any) -> np.ndarray:
    found = np.ascontiguousarray(values, dtype=float)
    if found.ndim != 1:
        raise InputError("the dimensions of an array", found.ndim, "not 1", next_step="Give a number for each member.")
    return found


def _count(n: int | None, models: int | None) -> int:
    """How many members there are."""
    if n is None and models is None:
        raise InputError(
            "n", None, "needed with one model", next_step="Give how many insertions: InsertionBatch(model, 1000)."
        )
    if n is not None and n < 0:
        raise InputError("n", n, "below 0")
    if n is not None and models is not None and n != models:
        raise InputError("n", n, f"not the number of models, {models}", next_step="Leave it out.")
    return int(n if models is None else models)  # type: ignore[arg-type]
