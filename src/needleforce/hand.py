# SPDX-License-Identifier: Apache-2.0
"""Between an engine and a hand: a model that is replaced, the limits of a device, and the last cycles."""

import numpy as np

from . import core
from .errors import InputError
from .model import Model
from .vocabulary import Phase, Status
from .whole_file import whole_file

FLAGS = ("rejected", "stale", "clamped", "slewed", "limited_by_energy", "outside_bounds")


class Guard(core.Guard):
    """Limits between an engine, as ``nf.Insertion``, and a device: scale, clamp, slew, watchdog, energy.

    ``settings`` are those of ``core.GuardSettings``, in SI and the device's range; ``core.GuardSettings.table()`` lists
    them. Raises InputError for one that is unknown or outside its range, and for two that do not go together. The
    engine stays the caller's and must not be stepped elsewhere. ``step`` and ``miss`` give a ``GuardOutput``: ``force``
    [N] for the device, ``sample``, the balance of energy, and what the guard did.
    """

    def __init__(self, engine, **settings: float):
        checked = core.GuardSettings(**settings)
        try:
            super().__init__(engine, checked)
        except TypeError:
            raise InputError(
                "engine", repr(engine), "not one that a guard can step", "", "Give nf.Insertion(…)."
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
        return columns | {flag: columns[flag].astype(bool) for flag in FLAGS}

    def save_recorder(self, path) -> None:
        """Writes ``recorder()`` as CSV, a column for each name. Raises InputError where it cannot be written."""
        columns = self.recorder()
        with whole_file(path) as file:
            file.write(",".join(columns) + "\n")
            for row in zip(*(column.tolist() for column in columns.values())):
                file.write(",".join(str(int(value) if isinstance(value, bool) else value) for value in row) + "\n")


class LiveInsertion(core.LiveInsertion):
    """An insertion whose model other threads may replace while one thread, the loop, steps it.

    ``step(depth, velocity, dt) -> Sample`` and ``reset()`` as of an ``Insertion``; ``replace(model)`` from any thread.
    The memory of the hole goes on; the force goes evenly from the old model's to the new one's over ``blend_time`` [s],
    0 to 1, and the next model is taken when that is over. ``max_speed`` [m/s], ``hold_time`` [s] and ``bevel`` as of an
    ``Insertion``. ``taken``, ``refused``, ``last_refused`` and ``blending`` say what became of the models. Raises
    InputError for what is no model, and for times and speeds outside their limits.
    """

    def __init__(
        self,
        model: Model,
        *,
        blend_time: float = 10e-3,
        max_speed: float = 1.0,
        hold_time: float = 0.0,
        bevel: core.Bevel | None = None,
    ):
        if not 0.0 <= blend_time <= core.longest_blend:
            raise InputError("blend_time", blend_time, f"must be 0 to {core.longest_blend:g} s")
        if not max_speed > 0.0:
            raise InputError("max_speed", max_speed, "must be above 0 m/s")
        if not hold_time >= 0.0:
            raise InputError("hold_time", hold_time, "must be at least 0 s")
        super().__init__(_layers(model), blend_time, max_speed, hold_time, bevel or core.Bevel())

    def replace(self, model: Model) -> None:
        """Offers a model to the loop, which takes the newest over with its next step, or after a blend.

        It is checked and prepared in the calling thread, without the interpreter's lock. Raises InputError for what is
        no model; then the model before it goes on.
        """
        self.replace_layers(_layers(model))


def _layers(model: Model) -> list:
    if not isinstance(model, Model):
        raise InputError("model", repr(model), "not a Model", next_step="Give nf.preset(…) or nf.Model(…).")
    return model.stack
