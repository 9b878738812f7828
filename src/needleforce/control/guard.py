# SPDX-License-Identifier: Apache-2.0
"""Between an engine and a device: the guard, with limits of the force and a record of the last cycles, an insertion
whose model is replaced while the loop runs, and the size of the noise of the depth."""

import math
import os
from statistics import NormalDist
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import core
from ..checks import instance_of, within
from ..errors import InputError
from ..files import atomic_write
from ..models.model import Model
from ..vocabulary import Phase, Status


class Guard(core.Guard):
    """Limits between an engine and a device: scale, largest force, slew rate, watchdog, energy.

    ``step(depth, velocity, dt)`` and ``miss(dt)``, for a cycle without input, return a ``GuardOutput``: the ``force``
    [N] for the device, the engine's ``sample``, the energy balance, and flags for the guard's interventions.

    Parameters
    ----------
    engine : Insertion, LiveInsertion or nf.fe.CondensedInsertion
        The engine, owned by the caller; it must not be stepped elsewhere. ``BaseGuard`` takes needles that bend.
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
            known = "nf.Insertion(…), LiveInsertion(…) or nf.fe.CondensedInsertion(…)"
            raise _no_engine(engine, "along the depth", known) from None
        self.engine = engine

    def recorder(self) -> dict[str, np.ndarray]:
        """Record of the last 4096 cycles; may be called from any thread.

        Returns
        -------
        dict of str to ndarray
            Columns (n,), oldest cycle first: ``number``; ``dt`` [s], ``depth`` [m] and ``velocity`` [m/s] as given, NaN
            if not given; ``sample_force`` and ``force`` [N]; ``energy`` and ``reserve`` [J]; ``phase`` and ``status``
            in words; a flag for each kind of intervention. Of a base ``lateral_x``, ``tilt_x``, ``roll`` and so on, as
            given, with ``lateral_force_x`` [N], ``tilt_moment_x``, ``roll_moment`` [N m].
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


class BaseGuard(core.BaseGuard):
    """A ``Guard`` of a needle that bends: forces and moments along all axes of its base, from one account of energy.

    ``miss(dt)`` is for a cycle without input; ``reset``, ``recorder`` and ``save_recorder`` are those of a ``Guard``.

    Parameters
    ----------
    engine : FlexibleInsertion
        The engine, owned by the caller; it must not be stepped elsewhere.
    **settings : float
        As for ``Guard``, with ``max_lateral_force``, ``max_moment`` and others for what moves across and turns;
        ``max_speed`` needs ``max_angular_speed``.

    Raises
    ------
    InputError
        As for ``Guard``.
    """

    def __init__(self, engine: Any, **settings: float):
        checked = core.GuardSettings(**settings)
        try:
            super().__init__(getattr(engine, "_core", engine), checked)
        except TypeError:
            raise _no_engine(engine, "by its base", "nf.FlexibleInsertion(…)") from None
        self.engine = engine

    def step(
        self,
        depth: float,
        lateral: tuple[float, float] = (0.0, 0.0),
        *,
        roll: float = 0.0,
        tilt: tuple[float, float] = (0.0, 0.0),
        dt: float,
    ) -> core.BaseGuardOutput:
        """A cycle with a measurement of the device; never raises.

        Parameters
        ----------
        depth, lateral, roll, tilt, dt
            As for ``FlexibleInsertion.step``, in the device's metres; ``dt`` since the last cycle of either kind.

        Returns
        -------
        BaseGuardOutput
            What the device gives along each coordinate, + where it opposes that coordinate: ``force`` [N] along the
            depth, ``lateral_force`` (x, y) [N], ``tilt_moment`` (x, y) and ``roll_moment`` [N m]; ``sample``, energy
            balance and flags as for ``Guard``.
        """
        return super().step(depth, lateral, tilt, roll, dt)

    recorder, save_recorder = Guard.recorder, Guard.save_recorder


def _no_engine(engine: Any, way: str, known: str) -> InputError:
    limit = f"not an engine that a guard can step {way}"
    return InputError("engine", type(engine).__name__, limit, next_step=f"Give {known}.")


class LiveInsertion(core.LiveInsertion):
    """An insertion whose model other threads may replace while one thread, the loop, steps it.

    ``step(depth, velocity, dt) -> Sample`` and ``reset()`` are those of an ``Insertion``. After ``replace`` the memory
    of the hole is kept, and the force changes linearly from the old to the new model during the blend; a further model
    is accepted when the blend is complete. ``taken`` and ``refused`` count models, ``last_refused`` and ``blending``
    are flags.

    Parameters
    ----------
    model : Model
        The first model.
    blend_time : float
        Duration of the blend from one model to the next [s], 0 to 1.
    max_speed, hold_time, depth_noise, bevel
        As for ``Insertion``.

    Raises
    ------
    InputError
        If the model is not a ``Model``, or a time or speed is outside its range.
    """

    def __init__(
        self,
        model: Model,
        *,
        blend_time: float = 10e-3,
        max_speed: float = 1.0,
        hold_time: float = 0.0,
        depth_noise: float = 0.0,
        bevel: core.Bevel | None = None,
    ):
        within("blend_time", blend_time, 0.0, core.longest_blend, "s")
        limits = core.Limits(max_speed=max_speed, hold_time=hold_time, depth_noise=depth_noise)
        super().__init__(_layers(model), blend_time, limits, bevel or core.Bevel())

    def replace(self, model: Model) -> None:
        """Offer a model to the loop, which uses the newest one from its next step on, or after the present blend.

        The model is checked and prepared in the calling thread, without the interpreter's lock.

        Parameters
        ----------
        model : Model
            The new model.

        Raises
        ------
        InputError
            If the model is invalid; the loop then continues with the previous one.
        """
        self.replace_layers(_layers(model))


def _layers(model: Model) -> list[tuple[float, core.Laws]]:
    instance_of("model", model, Model, "Give nf.preset(…) or nf.Model(…).")
    return model.stack


def depth_noise(depth: ArrayLike, *, samples: int = 3_600_000, probability: float = 0.01) -> float:
    """Half the range of the noise of a measured depth, for the ``depth_noise`` of an insertion.

    Parameters
    ----------
    depth : array_like, shape (n,)
        Depths [m] at equal times, of a needle at rest or moving freely at constant speed; at least 100.
    samples : int
        For how many samples the range is to hold, 1 to 1e12; by default an hour at 1 kHz.
    probability : float
        Probability that one of them leaves the range, for normal noise, 1e-9 to 0.5.

    Returns
    -------
    float
        Half the range [m]: the residual from a straight line, as many standard deviations as this probability needs,
        and half a count of the encoder.

    Raises
    ------
    InputError
        If there are too few depths, one is not finite, or a number is outside its range.
    """
    values = np.asarray(depth, dtype=float)
    if values.ndim != 1 or values.size < 100 or not np.isfinite(values).all():
        raise InputError("depth", f"{values.size} values", "not 100 finite depths or more", next_step="Record longer.")
    within("samples", samples, 1, 1e12)
    within("probability", probability, 1e-9, 0.5)
    index = np.arange(values.size) - 0.5 * (values.size - 1)
    residual = values - np.polynomial.Polynomial.fit(index, values, 1)(index)
    deviation = math.sqrt(float(residual @ residual) / (values.size - 2))
    steps = np.abs(np.diff(values))
    count = float(steps[steps > 0.0].min(initial=np.inf)) if (steps > 0.0).any() else 0.0
    quantised = np.unique(values).size < values.size // 2  # continuous noise does not repeat values
    return float(NormalDist().inv_cdf(1.0 - 0.5 * probability / samples) * deviation + 0.5 * count * quantised)
