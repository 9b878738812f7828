# SPDX-License-Identifier: Apache-2.0
"""Many insertions that are stepped together, of one model or each of its own."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from .. import core
from ..checks import instance_of
from ..errors import InputError
from .engine_batch import EngineBatch
from .members import motions, numbers, one_each, places, times, whole_number
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

    Where all models have as many layers, each with ``coulomb`` friction, ``constant_cutting`` or ``no_cutting`` and no
    relaxation, and neither ``hold_time`` nor ``depth_noise`` is given, several are computed at a time; others one after
    the other.

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
        alone = isinstance(models, Model) or not isinstance(models, Iterable)
        each = [models] if alone else list(models)
        for number, model in enumerate(each):
            instance_of(f"model {number}", model, Model, "Give nf.preset(…) or nf.Model(…).")
        count = _count(n, None if alone else len(each))
        self.threads, self._models = whole_number("threads", threads, 1), each
        limits = core.Limits(max_speed=max_speed, hold_time=hold_time, depth_noise=depth_noise)
        self._make([model.stack for model in each], count if alone else None, limits, bevel or core.Bevel())

    def _make(self, stacks: list, n: int | None, limits: core.Limits, bevel: core.Bevel) -> None:
        try:
            super().__init__(stacks, n, limits, bevel)
        except MemoryError:
            count, next_step = len(stacks) if n is None else n, "Make several batches, one after another."
            raise InputError("n", count, "more than memory has room for", next_step=next_step) from None
        except InputError:
            for number, stack in enumerate(stacks):
                try:
                    core.InsertionBatch([stack], 0, limits, bevel)
                except InputError as refused:
                    raise refused.at(f"model {number}") from None
            raise

    @property
    def models(self) -> tuple[Model, ...]:
        """The model of all, or that of each member."""
        return tuple(self._models)

    of = EngineBatch  #: needles that bend, or condensed solids, as members

    def step(self, depths: ArrayLike, velocities: ArrayLike | None, dt: ArrayLike) -> BatchSample:
        """One cycle of all members; never raises but for what is no array of numbers, or of another length.

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
        n = len(self)
        speeds = None if velocities is None else one_each("velocities", velocities, n)
        time = numbers("dt", dt)
        time = time.reshape(1) if time.size == 1 else one_each("dt", time, n)
        return BatchSample(self._step(one_each("depths", depths, n), speeds, time, self.threads))

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
        given = motions(depths, len(self))
        return self._run(given, times(dt, len(given)), self.threads)

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
            If it does not allow several members at a time, or has another number of layers, all are stepped one after
            the other from now on.

        Raises
        ------
        InputError
            If there is no such member or the model is invalid: nothing changes.
        """
        instance_of("model", model, Model, "Give nf.preset(…) or nf.Model(…).")
        place = whole_number("member", member, 0, f"Give a place from 0 to {len(self) - 1}.")
        self._replace(place, model.stack)
        if len(self._models) == 1:
            self._models = self._models * len(self)
        self._models[place] = model

    def snapshot(self) -> "InsertionBatch":
        """A copy with its state, which can be stepped independently or passed to ``restore``."""
        copy = InsertionBatch.__new__(InsertionBatch)
        core.InsertionBatch.__init__(copy, self)
        copy.threads, copy._models = self.threads, list(self._models)
        return copy

    def restore(self, snapshot: "InsertionBatch", members: ArrayLike | None = None) -> None:
        """Some members, or all, as they were at a ``snapshot()``: depth, cut and forces. What the batch was made with,
        such as ``max_speed``, stays its own, also where the snapshot is of a batch of the same models with another."""
        instance_of("snapshot", snapshot, InsertionBatch, "Give what snapshot() gave.")
        self._restore(snapshot, self._places(members))

    def _places(self, members: ArrayLike | None) -> np.ndarray | None:
        return None if members is None else places(members, len(self))

    def __repr__(self) -> str:
        return f"<InsertionBatch of {len(self)} in {len(self.models)} model{'s' if len(self.models) != 1 else ''}>"


def _count(n: int | None, models: int | None) -> int:
    """How many members there are."""
    if n is None and models is None:
        raise InputError(
            "n", None, "needed with one model", next_step="Give how many insertions: InsertionBatch(model, 1000)."
        )
    if n is None:
        return int(models)  # type: ignore[arg-type]
    count = whole_number("n", n, 0, "Give how many insertions: InsertionBatch(model, 1000).")
    if models is not None and count != models:
        raise InputError("n", n, f"not the number of models, {models}", next_step="Leave it out.")
    return count
