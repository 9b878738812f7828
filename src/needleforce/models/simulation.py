# SPDX-License-Identifier: Apache-2.0
"""A prescribed motion of the tip along its axis, and the simulation of a model along it: a recording without sensor,
filter or noise."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import within
from ..errors import InputError
from ..recording import Card, Note, Recording
from ..vocabulary import Status
from .model import Insertion, Model, solid_engine
from .validity import contact_warnings, crossed_by_depth

MAX_SAMPLES = 50_000_000
PARTS = ("stiffness", "friction", "cutting")
STATUS_NOTES = {
    Status.outside_range: "samples outside the range of the model: beyond a law's range of depth, or too fast a step",
    Status.invalid_parameter: "samples without force: a parameter of the model is invalid",
    Status.not_finite: "samples with a depth, velocity or time that is not finite",
}


@dataclass(frozen=True)
class Motion:
    """Prescribed depth over time, with trapezoidal velocity profiles.

    Parameters
    ----------
    start : float
        Depth at time 0 [m], -1 to 1; negative above the surface.
    moves : tuple of (float, float)
        Target depth [m], -1 to 1, and speed [m/s] of each move. A move to the present depth is a hold; its second
        number is then the duration [s].
    acceleration : float
        Acceleration and deceleration of every move [m/s^2].

    Raises
    ------
    InputError
        If a value is outside its range.
    """

    start: float
    moves: tuple[tuple[float, float], ...]
    acceleration: float = 10e-3

    def __post_init__(self):
        _check(self.start, 1.0, 1.0, 0.0, self.acceleration)
        for target, speed in self.moves:
            within("motion.moves", target, -1.0, 1.0, "m")
            if not 0.0 <= speed <= 1e6:
                raise InputError("motion.moves", speed, "not a speed [m/s] or a duration of a hold [s] from 0 to 1e6")

    @classmethod
    def insert(
        cls,
        start: float,
        speed: float,
        depth: float,
        hold: float = 0.0,
        withdraw: bool = True,
        acceleration: float = 10e-3,
    ) -> "Motion":
        """An insertion stroke, a hold, and a withdrawal stroke.

        Parameters
        ----------
        start : float
            Depth at time 0 [m], negative above the surface.
        speed : float
            Speed of both strokes [m/s], 1e-9 to 10.
        depth : float
            Deepest point [m], above ``start`` and at most 1.
        hold : float
            Duration of the hold at the deepest point [s], 0 to 1e6.
        withdraw : bool
            Whether the needle is withdrawn to ``start``.
        acceleration : float
            Acceleration [m/s^2], 1e-9 to 1e4.

        Returns
        -------
        Motion

        Raises
        ------
        InputError
            If a value is outside its range.
        """
        _check(start, speed, depth, hold, acceleration)
        moves = [(depth, speed), (depth, hold)] + ([(start, speed)] if withdraw else [])
        return cls(start, tuple(moves), acceleration)

    @property
    def duration(self) -> float:
        """Duration of the motion [s]."""
        return float(self._knots()[0][-1])

    def at(self, time: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Depth and velocity at given times; the tip is at rest before the start and after the end.

        Parameters
        ----------
        time : array_like, shape (n,)
            Times [s].

        Returns
        -------
        depth : ndarray, shape (n,)
            Depth [m].
        velocity : ndarray, shape (n,)
            Velocity [m/s], positive inwards.
        """
        begin, depth, velocity, acceleration = self._knots()
        time = np.asarray(time, dtype=float)
        k = np.clip(np.searchsorted(begin, time, side="right") - 1, 0, len(begin) - 1)
        t = np.clip(time - begin[k], 0.0, None)
        return depth[k] + velocity[k] * t + 0.5 * acceleration[k] * t * t, velocity[k] + acceleration[k] * t

    def _knots(self) -> tuple[np.ndarray, ...]:
        """Time, depth, velocity and acceleration at the start of each segment of constant acceleration."""
        knots, now, here = [], 0.0, self.start
        for target, speed in self.moves:
            for length, velocity, acceleration in self._segments(here, target, speed):
                knots.append((now, here, velocity, acceleration))
                now += length
                here += velocity * length + 0.5 * acceleration * length**2
            here = target
        knots.append((now, here, 0.0, 0.0))
        return tuple(np.array(column) for column in zip(*knots))

    def _segments(self, here: float, target: float, speed: float) -> list[tuple[float, float, float]]:
        """Duration [s], initial velocity [m/s] and acceleration [m/s^2] of the segments of one move."""
        travel, sign = abs(target - here), np.sign(target - here)
        if travel == 0.0:
            return [(speed, 0.0, 0.0)]
        top = min(speed, np.sqrt(travel * self.acceleration))
        ramp, acceleration = top / self.acceleration, sign * self.acceleration
        cruise = travel / top - ramp
        return [(ramp, 0.0, acceleration), (cruise, sign * top, 0.0), (ramp, sign * top, -acceleration)]


def _check(start: float, speed: float, depth: float, hold: float, acceleration: float) -> None:
    limits = [
        ("start", start, -1.0, 1.0, "m"),
        ("depth", depth, np.nextafter(start, 1.0), 1.0, "m"),
        ("speed", speed, 1e-9, 10.0, "m/s"),
        ("acceleration", acceleration, 1e-9, 1e4, "m/s^2"),
        ("hold", hold, 0.0, 1e6, "s"),
    ]
    for quantity, value, low, high, unit in limits:
        within(f"motion.{quantity}", value, low, high, unit)


def simulate(model: Model, motion: Motion, rate: float = 1000.0, *, tissue: Any = None) -> Recording:
    """Simulate the force of a model along a motion; sensor, filter and clocks are added by the virtual rig instead.

    Parameters
    ----------
    model : Model
        The model.
    motion : Motion
        The motion of the tip.
    rate : float
        Sampling rate [Hz], above 0 and at most 1e6.
    tissue : nf.fe.CondensedTissue, optional
        A solid that the needle drags along its path.

    Returns
    -------
    Recording
        Depth is measured from the undeformed surface. ``axes`` has the parts of the force, the card lists the limits of
        validity that are crossed, and ``notes`` count the samples whose status is not ``ok``.

    Raises
    ------
    InputError
        If the rate is outside its range, the simulation has fewer than 2 or more than 5e7 samples, or the model does
        not fit the tissue.
    """
    if not isinstance(motion, Motion):
        step = "Give for example nf.Motion.insert(start=-5e-3, speed=3e-3, depth=20e-3), in m and m/s."
        raise InputError("motion", repr(motion), "not a nf.Motion", "simulation", step)
    if not (np.isfinite(rate) and 0.0 < rate <= 1e6):
        raise InputError("rate", rate, "outside 0 to 1e6 Hz")
    count = int(np.floor(motion.duration * rate)) + 1
    if not 2 <= count <= MAX_SAMPLES:
        raise InputError("samples", count, f"outside 2 to {MAX_SAMPLES}", "simulation", "Change rate, speed or hold.")
    time = np.arange(count) / rate
    depth, velocity = motion.at(time)
    dt = np.full(len(time), 1.0 / rate)
    if tissue is None:
        columns, doubts = Insertion(model).run(depth, velocity, dt), ()
    else:
        engine = solid_engine(model, tissue)
        columns, doubts = engine.run(depth, dt), contact_warnings(engine)
    card = Card(
        source=f"simulated: {model.name}",
        needle=repr(model.needle or ""),
        tissue=f"solid: {tissue.summary}" if tissue is not None else repr(model.tissue or ""),
        assumptions=(*model.warnings, *crossed_by_depth(model, depth.max()), *doubts),
    )
    axes = {part: columns[part] for part in PARTS}
    notes = _status_notes(columns["status"])
    if depth.max() <= 0.0:
        message = f"the tip stays above the surface, which is at depth 0: its deepest point is {1e3 * depth.max():g} mm"
        notes += (Note("no_contact", message),)
    return Recording(
        time=time, depth=depth, velocity=velocity, force=columns["force"], axes=axes, card=card, notes=notes
    )


def _status_notes(status: np.ndarray) -> tuple[Note, ...]:
    """One note for each status other than ok that occurs, with its count."""
    counts = {word: int(np.count_nonzero(status == number)) for number, word in enumerate(Status)}
    return tuple(
        Note(word, f"{counts[word]} {text}", counts[word]) for word, text in STATUS_NOTES.items() if counts[word]
    )
