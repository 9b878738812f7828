# SPDX-License-Identifier: Apache-2.0
"""A haptic device in the loop, discretised exactly for a force that is held over each cycle, with a spring or the
engine in it, and the stiffness that the engine has there."""

import math
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from ..display.quantities import plain
from ..errors import InputError
from ..models.model import Insertion, Model
from ..vocabulary import SMALLEST

INSERTION_SPEED = 5e-3  # m/s
SECONDS, MAX_CYCLES = 3.0, 45_000  # of one simulated loop
DEPTHS, STEP_INWARDS = 24, 50e-6  # at which the stiffness of the tissue is probed; m
SUSTAINED = 0.9  # chatter of the last third over that of the third before: a cycle, not a decay
SMALLEST_CHATTER = 1e-5  # N rms
ROUNDING = 1e-12  # of the modulus of an eigenvalue


@dataclass(frozen=True, kw_only=True)
class Device:
    """A haptic device, with what holds it, along the needle's axis.

    Parameters
    ----------
    mass : float
        Apparent mass at the needle [kg], above 0.
    damping : float
        Viscous damping [N s/m], of the device and of the hand that holds it.
    stiffness : float
        Of the spring that holds the device in its place [N/m]; 0 if nothing does.
    rate : float
        Cycles of the loop per second [Hz].
    lag : float
        Time constant of the actuator, of first order [s].
    delay : int
        Whole cycles between a depth and the force computed from it, 0 to 16.
    controller_damping : float
        Damping that the controller adds to the force, from the difference of two depths [N s/m].
    name : str
        For tables.

    Raises
    ------
    InputError
        If a value is not a number or outside its range.
    """

    mass: float
    damping: float
    stiffness: float = 0.0
    rate: float = 1000.0
    lag: float = 0.0
    delay: int = 0
    controller_damping: float = 0.0
    name: str = "device"

    def __post_init__(self):
        for field in fields(self):
            if field.name in RANGES:
                _check(field.name, getattr(self, field.name))

    def replace(self, **changes: float) -> "Device":
        """A copy with the given values changed."""
        return replace(self, **changes)

    @property
    def cycle(self) -> float:
        """Time of a cycle [s]."""
        return 1.0 / self.rate

    @cached_property
    def step(self) -> tuple[np.ndarray, np.ndarray]:
        """The state (depth, velocity and, with a lag, the actuator's force) over a cycle.

        Returns
        -------
        change : ndarray, shape (n, n)
            Matrix from the state to its change over a cycle.
        inputs : ndarray, shape (n, 2)
            From the force that is commanded and from a constant load on the device [N] to that change.
        """
        rates, inputs = self._rates()
        integral = _integral(rates, self.cycle)
        return rates @ integral, integral @ inputs

    def _rates(self) -> tuple[np.ndarray, np.ndarray]:
        pull, drag, mobility = self.stiffness / self.mass, self.damping / self.mass, 1.0 / self.mass
        if self.lag == 0.0:
            return np.array([[0.0, 1.0], [-pull, -drag]]), np.array([[0.0, 0.0], [-mobility, mobility]])
        rates = np.array([[0.0, 1.0, 0.0], [-pull, -drag, -mobility], [0.0, 0.0, -1.0 / self.lag]])
        return rates, np.array([[0.0, 0.0], [0.0, mobility], [1.0 / self.lag, 0.0]])


# field: unit, smallest and largest value, whether the smallest is allowed
RANGES = {
    "mass": ("kg", 0.0, 1e3, False),
    "damping": ("N s/m", 0.0, 1e6, True),
    "stiffness": ("N/m", 0.0, 1e7, True),
    "rate": ("Hz", 1.0, 1e6, True),
    "lag": ("s", 0.0, 1.0, True),
    "delay": ("cycles", 0, 16, True),
    "controller_damping": ("N s/m", 0.0, 1e6, True),
}


def _check(name: str, value: float) -> None:
    unit, low, high, includes_low = RANGES[name]
    number = isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
    inside = number and (low <= value if includes_low else low < value) and value <= high
    if not inside:
        limit = (
            f"outside {low:g} to {high:g} {unit}" if includes_low else f"not above {low:g}, or above {high:g} {unit}"
        )
        raise InputError(f"device.{name}", value, limit, next_step=f"Give it in {unit}.")
    if name == "delay" and value != int(value):
        raise InputError("device.delay", value, "not a whole number of cycles", next_step="Give the rest as lag.")


def _integral(rates: np.ndarray, time: float) -> np.ndarray:
    """The integral of exp(rates t) from 0 to ``time``, to rounding however slow the system is: no 1 is subtracted."""
    doublings = max(0, math.ceil(math.log2(max(np.abs(rates).sum(axis=1).max() * time, SMALLEST))) + 2)
    short = time / 2.0**doublings
    term = short * np.eye(len(rates))
    integral = term.copy()
    for k in range(2, 20):
        term = term @ rates * (short / k)
        integral += term
    for _ in range(doublings):
        integral = 2.0 * integral + integral @ (rates @ integral)
    return integral


def linear_limit(device: Device) -> float:
    """The stiffness [N/m] beyond which the loop of a spring oscillates by itself, by the eigenvalues of its cycle."""
    stiffness = np.geomspace(1e-4, 1e8, 97)
    grown = [growth(device, each) for each in stiffness]
    first = next((k for k, rate in enumerate(grown) if rate > 1.0 + ROUNDING), None)
    if not first:
        return math.inf if first is None else 0.0
    low, high = stiffness[first - 1], stiffness[first]
    for _ in range(30):
        middle = math.sqrt(low * high)
        low, high = (low, middle) if growth(device, middle) > 1.0 + ROUNDING else (middle, high)
    return low


def growth(device: Device, stiffness: float) -> float:
    """Largest modulus of the eigenvalues of one cycle with a spring of a ``stiffness`` [N/m] in the loop."""
    change, inputs = device.step
    n, delay = len(change), int(device.delay)
    cycle = np.zeros((n + delay + 1, n + delay + 1))  # state, forces under way, depth of the cycle before
    command = np.zeros(n + delay + 1)
    command[0] = stiffness + device.controller_damping * device.rate
    command[-1] = -device.controller_damping * device.rate
    cycle[:n, :n] = np.eye(n) + change
    arriving = command if delay == 0 else np.eye(n + delay + 1)[n]
    cycle[:n] += np.outer(inputs[:, 0], arriving)
    for k in range(delay):
        cycle[n + k] = command if k == delay - 1 else np.eye(n + delay + 1)[n + k + 1]
    cycle[-1, 0] = 1.0
    return float(np.abs(np.linalg.eigvals(cycle)).max())


@dataclass(frozen=True)
class Chatter:
    """How a simulated loop moves in its last third.

    Attributes
    ----------
    force : float
        Standard deviation of the tissue's force [N] from a cubic over the time, which takes out relaxation.
    travel : float
        Distance between the smallest and the largest depth [m].
    frequency : float
        Of the largest line in the force's spectrum [Hz]; NaN at rest.
    creep : float
        Mean speed of the depth [m/s].
    sustained : bool
        Whether it does not decay.
    load_share, kick : float
        The initial state: load over the force of sliding, and speed [m/s].
    """

    force: float
    travel: float
    frequency: float
    creep: float
    sustained: bool
    load_share: float
    kick: float

    def __str__(self) -> str:
        return f"{plain(self.force, 'N')} rms, {plain(self.travel, 'm')}, {self.frequency:.3g} Hz"


def simulated_hold(
    model: Model, device: Device, depth: float, *, load_share: float = 0.0, kick: float = 0.0, seconds: float = SECONDS
) -> Chatter:
    """The engine itself in the loop: inserted to ``depth``, then left to the device under a constant load.

    Parameters
    ----------
    model, device : Model, Device
        The loop.
    depth : float
        Where the insertion ends and the spring of the device is at rest [m].
    load_share : float
        Constant load on the device, over the force at the end of the insertion.
    kick : float
        Initial speed [m/s].
    seconds : float
        Duration; at most 45 000 cycles.

    Returns
    -------
    Chatter
        Of the last third.
    """
    depths, forces = loop_motion(model, device, depth, load_share=load_share, kick=kick, seconds=seconds)
    third = len(forces) // 3
    before, after, tip = _quick(forces[third : 2 * third]), _quick(forces[-third:]), depths[-third:]
    rms = float(after.std())
    lines = np.abs(np.fft.rfft(after * np.hanning(third)))
    moves = rms > SMALLEST_CHATTER
    return Chatter(
        force=rms,
        travel=float(np.ptp(tip)),
        frequency=float(np.fft.rfftfreq(third, device.cycle)[lines.argmax()]) if moves else math.nan,
        creep=float(np.polyfit(np.arange(third) * device.cycle, tip, 1)[0]),
        sustained=moves and rms >= SUSTAINED * float(before.std()),
        load_share=load_share,
        kick=kick,
    )


def _quick(force: np.ndarray) -> np.ndarray:
    """The force without its slow course, as of relaxation: a cubic over the time."""
    time = np.linspace(-1.0, 1.0, len(force))
    return force - np.polynomial.Polynomial.fit(time, force, 3)(time)


def loop_motion(
    model: Model, device: Device, depth: float, *, load_share: float, kick: float, seconds: float
) -> tuple[np.ndarray, np.ndarray]:
    """Depth [m] and force of the tissue [N] in each cycle of a simulated loop, each (n,); see ``simulated_hold``."""
    engine, force = _inserted(model, depth)
    change, inputs = device.step
    load = device.stiffness * depth + load_share * force
    rows = [(*row, *given) for row, given in zip(change.tolist(), inputs.tolist())]
    state, waiting = [depth, kick, force][: len(change)], [force] * int(device.delay)
    per_travel, last, cycle = device.controller_damping * device.rate, depth, device.cycle
    count = max(300, min(MAX_CYCLES, round(seconds * device.rate)))
    depths, forces = np.empty(count), np.empty(count)
    for i in range(count):
        tip = state[0]
        depths[i] = tip
        forces[i] = felt = engine.step(tip, None, cycle).force
        waiting.append(felt + per_travel * (tip - last))
        given, last = (*state, waiting.pop(0), load), tip
        state = [x + sum(a * b for a, b in zip(row, given)) for x, row in zip(state, rows)]
    return depths, forces


def _inserted(model: Model, depth: float) -> tuple[Insertion, float]:
    engine = Insertion(model, max_speed=math.inf)
    count = max(2, math.ceil((depth + 1e-3) / (INSERTION_SPEED * 1e-3)))
    run = engine.run(np.linspace(-1e-3, depth, count), None, np.full(count, 1e-3))
    return engine, float(run["force"][-1])


def stiffness_at_rest(model: Model, depth: float, cycle: float = 1e-3) -> float:
    """Largest stiffness [N/m] that the tissue shows to small motions, anywhere down to a depth [m], from the engine,
    for a cycle [s].

    At each depth of the insertion the needle is moved back and forth over 1 nm to 5 mm. Damping of bristles counts with
    twice its value over a cycle, the most that the speed between two samples makes of it.
    """
    engine, found, last = Insertion(model, max_speed=math.inf), 0.0, -1e-3
    for stop in np.linspace(depth / DEPTHS, depth, DEPTHS):
        inwards = np.linspace(last, stop, max(2, math.ceil((stop - last) / STEP_INWARDS)))
        found = max(found, _steepest(engine, inwards, 1e-2, cycle))
        found = max(found, _steepest(engine.snapshot(), stop + PROBE, cycle, cycle))
        last = stop
    return found


def _steepest(engine: Insertion, depths: np.ndarray, dt: float, cycle: float) -> float:
    samples = [engine.step(depth, None, dt) for depth in depths.tolist()]
    damped = any(layer.friction.name == "lugre" for layer in engine.model.layers)  # elsewhere a speed moves the limits
    per_speed = 2.0 / cycle if damped else 0.0
    return max(sample.force_by_depth + per_speed * sample.force_by_velocity for sample in samples)


_TRAVEL = np.geomspace(1e-9, 5e-3, 80)
PROBE = np.concatenate([[0.0], -_TRAVEL, _TRAVEL - _TRAVEL[-1]])  # m, from the deepest point back and forth
