# SPDX-License-Identifier: Apache-2.0
"""A prescribed motion of the tip along its axis, and a model run along it: a recording without sensor, filter or
noise."""

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..mechanics.validity import crossed_by_depth
from ..recording import Card, Note, Recording
from ..vocabulary import Status
from .model import Insertion, Model

MOST_SAMPLES = 50_000_000
PARTS = ("stiffness", "friction", "cutting")
WORDS = {
    Status.outside_range: "samples outside the range of the model, beyond a law's reach or faster than a step may be",
    Status.invalid_parameter: "samples without force, as the model's parameters are impossible",
    Status.not_finite: "samples with a depth, velocity or time that is not finite",
}


@dataclass(frozen=True)
class Motion:
    """Depth over time. ``moves`` are (target depth [m], speed [m/s]); a move to where the tip is waits, its speed a
    time [s].

    ``start`` [m] is the depth at time 0, below 0 above the surface; ``acceleration`` [m/s^2] is the same everywhere.
    """

    start: float
    moves: tuple[tuple[float, float], ...]
    acceleration: float = 10e-3

    def __post_init__(self):
        _check(self.start, 1.0, 1.0, 0.0, self.acceleration)
        for target, speed in self.moves:
            if not -1.0 <= target <= 1.0:
                raise InputError("motion.moves", target, "outside -1 to 1 m")
            if not 0.0 <= speed <= 1e6:
                raise InputError("motion.moves", speed, "not a speed [m/s], or a time to wait [s], from 0 to 1e6")

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
        """In from ``start`` to ``depth`` [m] at ``speed`` [m/s], a hold [s], and out again where ``withdraw``."""
        _check(start, speed, depth, hold, acceleration)
        moves = [(depth, speed), (depth, hold)] + ([(start, speed)] if withdraw else [])
        return cls(start, tuple(moves), acceleration)

    @property
    def duration(self) -> float:
        """Time from start to end [s]."""
        return float(self._knots()[0][-1])

    def at(self, time) -> tuple[np.ndarray, np.ndarray]:
        """Depth [m] and velocity [m/s] at times (n,) [s]; at rest before the start and after the end."""
        begin, depth, velocity, acceleration = self._knots()
        time = np.asarray(time, dtype=float)
        k = np.clip(np.searchsorted(begin, time, side="right") - 1, 0, len(begin) - 1)
        t = np.clip(time - begin[k], 0.0, None)
        return depth[k] + velocity[k] * t + 0.5 * acceleration[k] * t * t, velocity[k] + acceleration[k] * t

    def _knots(self) -> tuple[np.ndarray, ...]:
        """Where each stretch of constant acceleration begins: time, depth, velocity, acceleration."""
        knots, now, here = [], 0.0, self.start
        for target, speed in self.moves:
            for length, velocity, acceleration in self._stretches(here, target, speed):
                knots.append((now, here, velocity, acceleration))
                now += length
                here += velocity * length + 0.5 * acceleration * length**2
            here = target
        knots.append((now, here, 0.0, 0.0))
        return tuple(np.array(column) for column in zip(*knots))

    def _stretches(self, here: float, target: float, speed: float):
        travel, sign = abs(target - here), np.sign(target - here)
        if travel == 0.0:
            return [(speed, 0.0, 0.0)]
        top = min(speed, np.sqrt(travel * self.acceleration))
        ramp, push = top / self.acceleration, sign * self.acceleration
        cruise = travel / top - ramp
        return [(ramp, 0.0, push), (cruise, sign * top, 0.0), (ramp, sign * top, -push)]


def _check(start: float, speed: float, depth: float, hold: float, acceleration: float) -> None:
    limits = [
        ("start", start, -1.0, 1.0, "m"),
        ("depth", depth, np.nextafter(start, 1.0), 1.0, "m"),
        ("speed", speed, 1e-9, 10.0, "m/s"),
        ("acceleration", acceleration, 1e-9, 1e4, "m/s^2"),
        ("hold", hold, 0.0, 1e6, "s"),
    ]
    for quantity, value, low, high, unit in limits:
        if not low <= value <= high:
            raise InputError(f"motion.{quantity}", value, f"outside {low:.6g} to {high:g} {unit}")


def simulate(model: Model, motion: Motion, rate: float = 1000.0) -> Recording:
    """The force of ``model`` along ``motion``, sampled at ``rate`` [Hz]; the force's parts are in ``axes``.

    Depth is in the model's zero: the undeformed surface. The card assumes the limits the model crosses, and ``notes``
    tell how many samples are not ok. The virtual rig adds sensor, filter and clocks.
    """
    if not (np.isfinite(rate) and 0.0 < rate <= 1e6):
        raise InputError("rate", rate, "outside 0 to 1e6 Hz")
    count = int(np.floor(motion.duration * rate)) + 1
    if not 2 <= count <= MOST_SAMPLES:
        raise InputError("samples", count, f"outside 2 to {MOST_SAMPLES}", "simulation", "Change rate, speed or hold.")
    time = np.arange(count) / rate
    depth, velocity = motion.at(time)
    columns = Insertion(model).run(depth, velocity, np.full(len(time), 1.0 / rate))
    card = Card(
        source=f"simulated: {model.name}",
        needle=repr(model.needle or ""),
        tissue=repr(model.tissue or ""),
        assumptions=(*model.warnings, *crossed_by_depth(model, depth.max())),
    )
    axes = {part: columns[part] for part in PARTS}
    return Recording(time, depth, velocity, columns["force"], axes, card, _not_ok(columns["status"]))


def _not_ok(status: np.ndarray) -> tuple[Note, ...]:
    """One note for each status but ok, with its count."""
    counts = {word: int(np.count_nonzero(status == number)) for number, word in enumerate(Status)}
    return tuple(Note(word, f"{counts[word]} {said}", counts[word]) for word, said in WORDS.items() if counts[word])
