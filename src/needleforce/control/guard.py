# SPDX-License-Identifier: Apache-2.0
"""The guard between an engine and a device: limits of the force, and a record of the last cycles."""

import os
from typing import Any

import numpy as np

from .. import core
from ..errors import InputError
from ..files import atomic_write
from ..vocabulary import Phase, Status


class Guard(core.Guard):
    """Limits between an engine and a device: scale, largest force, slew rate, watchdog, energy.

    ``step(depth, velocity, dt)`` and ``miss(dt)``, for a cycle without input, return a ``GuardOutput``: the ``force``
    [N] for the device, the engine's ``sample``, the energy balance, and flags for the guard's interventions.

    Parameters
    ----------
    engine : Insertion or LiveInsertion
        The engine, owned by the caller; it must not be stepped elsewhere.
    **settings : float
        Settings of ``core.GuardSettings``, in SI and in the device's range; ``core.GuardSettings.table()`` lists them
        with unit and range.

    Raises
    ------
    InputError
        If the engine cannot be stepped by a guard, a setting is unknown or outside its range, or settings contradict
        each other.
    """

    def __init__(self, engine: Any, **settings: float):
        checked = core.GuardSettings(**settings)
        try:
            super().__init__(engine, checked)
        except TypeError:
            limit, next_step = "not an engine that a guard can step", "Give nf.Insertion(…) or LiveInsertion(…)."
            raise InputError("engine", type(engine).__name__, limit, next_step=next_step) from None
        self.engine = engine

    def recorder(self) -> dict[str, np.ndarray]:
        """Record of the last 4096 cycles; may be called from any thread.

        Returns
        -------
        dict of str to ndarray
            Columns (n,), oldest cycle first: ``number``; ``dt`` [s], ``depth`` [m] and ``velocity`` [m/s] as given, NaN
            if not given; ``sample_force`` and ``force`` [N]; ``energy`` and ``reserve`` [J]; ``phase`` and ``status``
            in words; a flag for each kind of intervention.
        """
        columns = self.columns()
        columns["number"] = columns["number"].astype(np.int64)
        columns["phase"] = np.array(list(Phase))[columns["phase"].astype(int)]
        columns["status"] = np.array(list(Status))[columns["status"].astype(int)]
        return columns | {flag: columns[flag].astype(bool) for flag in core.interventions}

    def save_recorder(self, path: str | os.PathLike) -> None:
        """Write ``recorder()`` as CSV, one column for each name.

        Parameters
        ----------
        path : str or path
            The file.

        Raises
        ------
        InputError
            If the file cannot be written.
        """
        columns = self.recorder()
        with atomic_write(path) as file:
            file.write(",".join(columns) + "\n")
            for row in zip(*(column.tolist() for column in columns.values())):
                file.write(",".join(str(int(value) if isinstance(value, bool) else value) for value in row) + "\n")
