# SPDX-License-Identifier: Apache-2.0
"""Between an engine and a hand: the limits of a device, and the last cycles."""

import numpy as np

from .. import core
from ..errors import InputError
from ..files import atomic_write
from ..vocabulary import Phase, Status


class Guard(core.Guard):
    """Limits between an engine and a device: scale, clamp, slew, watchdog, energy.

    ``settings`` are those of ``core.GuardSettings``, in SI and the device's range; ``core.GuardSettings.table()`` lists
    them. Raises InputError for one that is unknown or outside its range, and for two that do not go together. The
    engine, ``nf.Insertion`` or ``LiveInsertion``, stays the caller's and must not be stepped elsewhere. ``step`` and
    ``miss`` give a ``GuardOutput``: ``force`` [N] for the device, ``sample``, the balance of energy, and what the guard
    did.
    """

    def __init__(self, engine, **settings: float):
        checked = core.GuardSettings(**settings)
        try:
            super().__init__(engine, checked)
        except TypeError:
            raise InputError(
                "engine",
                type(engine).__name__,
                "not one that a guard can step",
                "",
                "Give nf.Insertion(…) or LiveInsertion(…).",
            ) from None
        self.engine = engine

    def recorder(self) -> dict[str, np.ndarray]:
        """The last 4096 cycles, oldest first, by name, (n,) each: ``number``; ``dt`` [s], ``depth`` [m] and
        ``velocity`` [m/s] as given, NaN where none was; ``sample_force`` and ``force`` [N]; ``energy`` and ``reserve``
        [J]; ``phase`` and ``status`` in words; a flag for each thing the guard may do. May be called from any thread.
        """
        columns = self.columns()
        columns["number"] = columns["number"].astype(np.int64)
        columns["phase"] = np.array(list(Phase))[columns["phase"].astype(int)]
        columns["status"] = np.array(list(Status))[columns["status"].astype(int)]
        return columns | {flag: columns[flag].astype(bool) for flag in core.interventions}

    def save_recorder(self, path) -> None:
        """Writes ``recorder()`` as CSV, a column for each name. Raises InputError where it cannot be written."""
        columns = self.recorder()
        with atomic_write(path) as file:
            file.write(",".join(columns) + "\n")
            for row in zip(*(column.tolist() for column in columns.values())):
                file.write(",".join(str(int(value) if isinstance(value, bool) else value) for value in row) + "\n")
