# SPDX-License-Identifier: Apache-2.0
"""Many engines of one kind that are moved together: needles that bend, condensed solids."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import instance_of
from ..errors import InputError
from .members import motions, numbers, one_each, places, whole_number


class EngineBatch:
    """Needles that bend, or condensed solids, that are moved together: ``InsertionBatch.of([…])``.

    Each has the values that it has alone and costs what it costs alone. Threads share out the members of ``run``, which
    leaves Python's lock to others.

    Parameters
    ----------
    engines : sequence
        ``FlexibleInsertion`` or ``fe.CondensedInsertion``, each another object.
    threads : int
        How many may run at the same time.

    Raises
    ------
    InputError
        If one is given twice or cannot be run, or ``threads`` is below 1.
    """

    def __init__(self, engines: Sequence[Any], threads: int = 1):
        self.engines, self.threads = tuple(engines), whole_number("threads", threads, 1)
        seen: dict[int, int] = {}
        for number, engine in enumerate(self.engines):
            if not all(hasattr(engine, needed) for needed in ("step", "run", "reset", "snapshot", "restore")):
                raise InputError(
                    f"engine {number}", type(engine).__name__, "not an insertion",
                    next_step="Give nf.FlexibleInsertion(…) or nf.fe.CondensedInsertion(…).",
                )  # fmt: skip
            if id(engine) in seen:
                raise InputError(
                    f"engine {number}", "given", f"the same object as engine {seen[id(engine)]}",
                    next_step="Make one for each member: [nf.FlexibleInsertion(…) for each in range(n)].",
                )  # fmt: skip
            seen[id(engine)] = number

    def __len__(self) -> int:
        return len(self.engines)

    def step(self, depths: ArrayLike, **moves: Any) -> list[Any]:
        """One cycle of all members.

        Parameters
        ----------
        depths : array_like
            (n,) [m], or one for all.
        **moves
            What ``step`` of one takes by name, for all.

        Returns
        -------
        list
            The sample of each.
        """
        given = one_each("depths", depths, len(self))
        return [engine.step(depth, **moves) for engine, depth in zip(self.engines, given.tolist(), strict=True)]

    def run(self, depths: ArrayLike, **moves: ArrayLike) -> dict[str, np.ndarray]:
        """Whole motions.

        Parameters
        ----------
        depths : array_like
            (steps, n) [m].
        **moves
            What ``run`` of one takes by name, for all, or (steps, n, …) for each; ``dt`` may be one number.

        Returns
        -------
        dict of ndarray
            As ``run`` of one returns it, (steps, n, …).
        """
        depths = motions(depths, len(self))
        each = {name: numbers(name, values) for name, values in moves.items()}
        if "dt" in each and each["dt"].ndim == 0:
            each["dt"] = np.full(len(depths), each["dt"])

        def one(i: int) -> dict[str, np.ndarray]:
            own = {name: values[:, i] if values.shape[:2] == depths.shape else values for name, values in each.items()}
            return self.engines[i].run(np.ascontiguousarray(depths[:, i]), **own)

        with ThreadPoolExecutor(self.threads) as pool:
            runs = list(pool.map(one, range(len(self))))
        return {name: np.stack([run[name] for run in runs], axis=1) for name in (runs[0] if runs else ())}

    def reset(self, members: Sequence[int] | None = None) -> None:
        """Some members, or all, back to before the first contact."""
        for i in self._places(members):
            self.engines[i].reset()

    def snapshot(self) -> tuple[Any, ...]:
        """What each remembers, for ``restore``."""
        return tuple(engine.snapshot() for engine in self.engines)

    def restore(self, snapshot: tuple[Any, ...], members: Sequence[int] | None = None) -> None:
        """Some members, or all, as they were at a ``snapshot()``."""
        given = instance_of("snapshot", snapshot, tuple, "Give what snapshot() gave.")
        if len(given) != len(self):
            raise InputError("snapshot", len(given), f"not of a batch of {len(self)}", next_step="Give one of it.")
        for i in self._places(members):
            self.engines[i].restore(given[i])

    def _places(self, members: Sequence[int] | None) -> Sequence[int]:
        return range(len(self)) if members is None else places(members, len(self)).tolist()

    def __repr__(self) -> str:
        return f"<EngineBatch of {len(self)} {type(self.engines[0]).__name__ if self.engines else 'engines'}>"
