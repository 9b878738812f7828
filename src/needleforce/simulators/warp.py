# SPDX-License-Identifier: Apache-2.0
"""The paper's and the layered law as one function for NVIDIA Warp, in float32 or float64, for many needles at once.

``needle_force(real)`` is the function of a step, for kernels of your own; ``Needles`` holds the arrays that it needs.
"""

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np

from ..checks import above_zero, instance_of
from ..errors import InputError
from ..models.members import numbers, one_each, whole_number
from ..models.model import Layer, Model

try:
    import warp as wp
except ImportError as error:
    raise ImportError('needleforce.simulators.warp needs NVIDIA Warp: pip install "needleforce[warp]"') from error

MAX_LAYERS = 4
# of a model: law and layers; of a layer: top, puncture, coefficient, saturation, then friction, cutting and relaxation
HEAD, PER_LAYER = 2, 13
# of a needle: started, depth, waited, deepest, layers pierced; then of the paper's law or of each layer; the status
KEPT, PER_LAYER_KEPT = 5, 12
STATUS = KEPT + PER_LAYER_KEPT * MAX_LAYERS
_PAPER = ("cone", "cone_cylinder"), ("coulomb",), ("constant_cutting", "no_cutting"), ("no_relaxation",)
_LAYERED = ("cone", "cone_cylinder"), ("dragged_tissue",), ("no_cutting",), ("no_relaxation", "prony")


@cache
def needle_force(real: Any = wp.float64) -> Any:
    """The function of a step, for kernels of your own.

    Parameters
    ----------
    real : type
        ``warp.float64`` or ``warp.float32``.

    Returns
    -------
    warp.Function
        ``(parameters, model, memory, needle, depth, dt, max_speed)`` gives the force [N], + against the insertion, and
        changes the row ``needle`` of ``memory``: call it once a step. ``parameters`` and ``memory`` are those of
        ``Needles``, ``model`` a row of the first. Depth + inwards [m]; the velocity is the change of depth. Input that
        the engine refuses gives 0 and changes nothing but column ``STATUS`` of ``memory``: a place in
        ``list(nf.Status)``, 0 for an accepted step.
    """

    @wp.func
    def contact(h: real, coefficient: real, saturation: real):
        if h <= saturation:
            return coefficient * h * h
        return coefficient * saturation * (real(2.0) * h - saturation)

    @wp.func
    def energy(h: real, coefficient: real, saturation: real):
        if h <= saturation:
            return coefficient * h * h * h / real(3.0)
        return coefficient * saturation * (h * h - saturation * h + saturation * saturation / real(3.0))

    @wp.func
    def begun(free_force: real, free_energy: real, length: real, stiffness: real, dragged: real, limit: real):
        """The traction with which friction begins at the puncture, of the energy that the cut leaves."""
        if length <= real(0.0):
            return real(0.0)
        by_energy = wp.sqrt(real(2.0) * stiffness * free_energy / length)
        by_force = wp.min(free_force / length, real(2.0) * stiffness * length)
        return wp.min(wp.min(limit, dragged), wp.min(by_force, by_energy))

    @wp.func
    def paper(p: wp.array2d(dtype=real), m: int, s: wp.array2d(dtype=real), i: int, z: real, travel: real,
              before: real):  # fmt: skip
        top, puncture = p[m, 2], p[m, 3]
        per_length, stiffness, surface = p[m, 6], p[m, 7], p[m, 8]
        full, per_travel = p[m, 9], p[m, 10]
        below = wp.where(z > real(0.0), wp.min(travel, z), real(0.0))
        pressing = real(0.0)
        if s[i, 4] == real(0.0):
            if z > puncture:
                h = wp.max(real(0.0), before - top)  # nothing presses yet where the first step is behind the puncture
                free = contact(h, p[m, 4], p[m, 5])
                left = energy(h, p[m, 4], p[m, 5])
                at = wp.min(wp.max(puncture, z - travel), z)
                s[i, 4] = real(1.0)
                s[i, 5] = at
                s[i, 6] = at
                s[i, 7] = at
                if full > real(0.0):
                    s[i, 7] = at - wp.min(at - top, left / full)
                length = wp.max(real(0.0), z - surface)
                free = wp.max(real(0.0), free - full)
                s[i, 8] = begun(free, real(0.5) * left, length, stiffness, stiffness * (puncture - top), per_length)
                below = wp.min(below, wp.max(real(0.0), z - puncture))
            else:
                pressing = contact(wp.max(real(0.0), z - top), p[m, 4], p[m, 5])
        if s[i, 4] == real(0.0):
            return pressing
        s[i, 5] = wp.max(s[i, 5], z)
        cutting = full * wp.max(real(0.0), real(1.0) - (s[i, 5] - z) * per_travel)
        entry, retreat = s[i, 6], s[i, 7]
        if z <= entry:
            left = cutting * (z - retreat) / wp.max(entry - retreat, real(1e-30))
            cutting = wp.where(z > retreat, left, real(0.0))
        embedded = wp.max(real(0.0), z - surface)
        low = wp.where(embedded > real(0.0), -per_length, real(0.0))
        high = wp.min(per_length, real(2.0) * stiffness * embedded)
        traction = wp.min(wp.max(low, s[i, 8] + stiffness * below), high)
        if z <= real(0.0):
            traction = real(0.0)
        s[i, 8] = traction
        return cutting + traction * embedded

    @wp.func
    def remaining(x: real):
        """(1 - exp(-x)) / x, which does not cancel at small x."""
        if x < real(1e-3):
            return real(1.0) - x / real(2.0) + x * x / real(6.0) - x * x * x / real(24.0)
        return (real(1.0) - wp.exp(-x)) / x

    @wp.func
    def load(s: wp.array2d(dtype=real), i: int, e: int, wanted: real, low: real, high: real, dt: real,
             p: wp.array2d(dtype=real), m: int, g: int):  # fmt: skip
        """An element whose force is in columns e to e + 2; returns force, slipped, and force by load."""
        g1, g2 = p[m, g], p[m, g + 2]
        x1, x2 = dt / p[m, g + 1], dt / p[m, g + 3]
        lasting = real(1.0) - g1 - g2
        during1, during2 = g1 * remaining(x1), g2 * remaining(x2)
        left1, left2 = s[i, e + 1] * wp.exp(-x1), s[i, e + 2] * wp.exp(-x2)
        standing = lasting * s[i, e] + left1 + left2
        per_load = lasting + during1 + during2
        free = standing + per_load * wanted
        force = wp.min(wp.max(low, free), high)
        slipped = (free - force) / per_load
        taken = wp.where(force != free, (force - standing) / per_load, wanted)
        stiffening = wp.where(force > low and force < high, per_load, real(0.0))
        s[i, e] = s[i, e] + taken
        s[i, e + 1] = left1 + during1 * taken
        s[i, e + 2] = left2 + during2 * taken
        return force, slipped, stiffening

    @wp.func
    def dragged(p: wp.array2d(dtype=real), m: int, s: wp.array2d(dtype=real), i: int, a: int, c: int, z: real,
                travel: real, deepest: real, dt: real):  # fmt: skip
        """The force of a layer that is pierced; its surface moves with the spring of the step before."""
        per_length, stiffness, outwards = p[m, a + 4], p[m, a + 5], p[m, a + 8]
        relaxes = p[m, a + 9] + p[m, a + 11] > real(0.0)
        top, puncture = p[m, a], p[m, a + 1]
        embedded = wp.max(real(0.0), z - (top + p[m, a + 7] + s[i, c + 7] / stiffness))
        if embedded == real(0.0) and z < deepest - real(3e-5) and (s[i, c + 10] <= real(0.0) or z <= top):
            for k in range(4):
                s[i, c + 7 + k] = real(0.0)
            return real(0.0)
        grip = per_length * embedded
        above = wp.max(real(0.0), s[i, c + 11] - grip)
        high = grip + above * wp.exp(-(deepest - puncture) * p[m, a + 6])
        force, slipped, stiffening = load(s, i, c + 7, stiffness * travel, -outwards * grip, high, dt, p, m, a + 9)
        if relaxes and stiffening == real(0.0):
            old = real(0.0)
            if force != real(0.0):
                old = wp.exp(-wp.abs(slipped / force))
            s[i, c + 7] = force + old * (s[i, c + 7] - force)
            for j in range(2):
                held = p[m, a + 9 + 2 * j] * force
                s[i, c + 8 + j] = held + old * (s[i, c + 8 + j] - held)
        s[i, c + 10] = force
        return force

    @wp.func
    def pierce(p: wp.array2d(dtype=real), m: int, s: wp.array2d(dtype=real), i: int, a: int, c: int):
        """The tissue's spring takes over from the contact, with no more energy than that held."""
        stiffness = p[m, a + 5]
        s[i, c] = real(1.0)
        s[i, c + 11] = s[i, c + 2]
        bound = wp.sqrt(real(2.0) * stiffness * energy(s[i, c + 1], p[m, a + 2], p[m, a + 3]))
        share = wp.where(s[i, c + 4] > bound, bound / wp.max(s[i, c + 4], real(1e-30)), real(1.0))
        softer = wp.sqrt(wp.min(real(1.0), stiffness / wp.max(s[i, c + 3], real(1e-30))))
        s[i, c + 7] = share * s[i, c + 4]
        s[i, c + 8] = wp.min(share, softer) * s[i, c + 5]
        s[i, c + 9] = wp.min(share, softer) * s[i, c + 6]

    @wp.func
    def press(p: wp.array2d(dtype=real), m: int, s: wp.array2d(dtype=real), i: int, a: int, c: int, z: real, dt: real):
        """The contact of a layer that is not pierced."""
        h, coefficient, saturation = wp.max(real(0.0), z - p[m, a]), p[m, a + 2], p[m, a + 3]
        instant = contact(h, coefficient, saturation)
        force, _slipped, per_load = load(s, i, c + 4, instant - s[i, c + 4], real(0.0), real(1e30), dt, p, m, a + 9)
        s[i, c + 1] = h
        s[i, c + 2] = force
        s[i, c + 3] = real(2.0) * coefficient * wp.min(h, saturation) * per_load
        return force

    @wp.func
    def layered(p: wp.array2d(dtype=real), m: int, s: wp.array2d(dtype=real), i: int, z: real, travel: real,
                deepest: real, dt: real):  # fmt: skip
        force = real(0.0)
        for k in range(int(p[m, 1])):
            a, c = HEAD + PER_LAYER * k, KEPT + PER_LAYER_KEPT * k
            if s[i, c] == real(0.0):
                if z > p[m, a + 1]:
                    pierce(p, m, s, i, a, c)
                else:
                    force += press(p, m, s, i, a, c, z, dt)
            if s[i, c] > real(0.0):
                force += dragged(p, m, s, i, a, c, z, travel, deepest, dt)
        return force

    @wp.func
    def step(parameters: wp.array2d(dtype=real), model: int, memory: wp.array2d(dtype=real), needle: int, depth: real,
             dt: real, max_speed: real):  # fmt: skip
        memory[needle, STATUS] = wp.where(wp.isfinite(depth) and wp.isfinite(dt), real(1.0), real(3.0))
        if not (dt > real(0.0) and dt <= real(1e9)):
            return real(0.0)
        elapsed = memory[needle, 2] + dt
        before = wp.where(memory[needle, 0] > real(0.0), memory[needle, 1], real(-1e30))
        travel = wp.where(memory[needle, 0] > real(0.0), depth - memory[needle, 1], real(0.0))
        if not (wp.abs(depth) <= real(1.0) and wp.abs(travel) <= real(1.0 + 1e-9) * max_speed * elapsed):
            memory[needle, 2] = elapsed
            return real(0.0)
        if memory[needle, 0] > real(0.0):
            memory[needle, 3] = wp.max(memory[needle, 3], depth)
        else:
            memory[needle, 3] = depth
        memory[needle, 0] = real(1.0)
        memory[needle, 1] = depth
        memory[needle, 2] = real(0.0)
        memory[needle, STATUS] = real(0.0)
        if parameters[model, 0] == real(0.0):
            return paper(parameters, model, memory, needle, depth, travel, before)
        return layered(parameters, model, memory, needle, depth, travel, memory[needle, 3], elapsed)

    return step


@cache
def _kernel(real: Any) -> Any:
    step = needle_force(real)

    @wp.kernel(module="unique")
    def each(parameters: wp.array2d(dtype=real), which: wp.array(dtype=int), memory: wp.array2d(dtype=real),
             depth: wp.array(dtype=real), dt: real, max_speed: real, force: wp.array(dtype=real)):  # fmt: skip
        i = wp.tid()
        force[i] = step(parameters, which[i], memory, i, depth[i], dt, max_speed)

    return each


class Needles:
    """n needles, each with the force of an ``Insertion`` of its own, on any device of Warp.

    Parameters
    ----------
    models : Model or sequence of Model
        One for all, or one for each. Warp has the paper's law (cone or cone_cylinder, any puncture, coulomb,
        constant_cutting or no_cutting, one layer) and the layered one (dragged_tissue, no_cutting, prony or none, up to
        4 layers).
    n : int, optional
        How many, with one model.
    real : type
        ``warp.float64``, or ``warp.float32``: within 1e-5 of the largest force.
    max_speed : float
        Faster is refused [m/s].
    device : str, optional
        As of Warp: ``"cpu"``, ``"cuda:0"``.

    Attributes
    ----------
    parameters, which, memory, force : warp.array
        What ``needle_force`` takes: (models, …), (n,), (n, …); and the last forces [N].

    Raises
    ------
    InputError
        If a model has a law that Warp does not, or there is no such device or precision.
    """

    def __init__(
        self,
        models: Model | Sequence[Model],
        n: int | None = None,
        *,
        real: Any = wp.float64,
        max_speed: float = 1.0,
        device: str | None = None,
    ):
        given = [models] if isinstance(models, Model) else list(models)
        count = len(given) if n is None else whole_number("n", n, 0, "Give how many needles: Needles(model, 1000).")
        rows = [_row(instance_of(f"model {k}", model, Model, "Give nf.preset(…).")) for k, model in enumerate(given)]
        if not given:
            raise InputError("models", "[]", "none", next_step="Give at least one model.")
        if len(given) != 1 and count != len(given):
            raise InputError("n", n, f"not the number of models, {len(given)}", next_step="Leave it out.")
        if real not in (wp.float64, wp.float32):
            raise InputError("real", repr(real), "no precision", next_step="Give warp.float64 or warp.float32.")
        self.real, self.max_speed, self.device = real, above_zero("max_speed", max_speed, "m/s"), _known(device)
        self.parameters = wp.array(np.array(rows), dtype=real, device=device)
        which = np.arange(count) if len(given) == count else np.zeros(count)
        self.which = wp.array(which.astype(np.int32), dtype=int, device=device)
        self.memory = wp.zeros((count, STATUS + 1), dtype=real, device=device)
        self.force = wp.zeros(count, dtype=real, device=device)

    def __len__(self) -> int:
        return len(self.which)

    def step(self, depths: Any, dt: float) -> Any:
        """One cycle of all.

        Parameters
        ----------
        depths : warp.array or array_like
            (n,) [m]; an array of Warp is taken as it is.
        dt : float
            Since the last cycle [s].

        Returns
        -------
        warp.array
            (n,), forces [N]: ``force``, which the next step writes over. Keep a copy, ``.numpy().copy()``.
        """
        if not isinstance(depths, wp.array):
            depths = wp.array(one_each("depths", depths, len(self)), dtype=self.real, device=self.device)
        if depths.shape != (len(self),) or depths.dtype is not self.real:
            found, limit = f"{depths.dtype.__name__} {depths.shape}", f"not {self.real.__name__} ({len(self)},)"
            raise InputError("depths", found, limit, next_step="Give an array of Warp like force.")
        if (time := numbers("dt", dt, "Give one time for all [s].")).ndim:
            raise InputError("the shape of dt", time.shape, "not one number", next_step="Give one time for all [s].")
        limits = [float(time), min(self.max_speed, 1e9)]
        inputs = [self.parameters, self.which, self.memory, depths, *limits, self.force]
        wp.launch(_kernel(self.real), dim=len(self), inputs=inputs, device=self.device)
        return self.force

    @property
    def status(self) -> np.ndarray:
        """Of the last step (n,): places in ``list(nf.Status)``, 0 where the depth was accepted."""
        return self.memory.numpy()[:, STATUS].astype(np.int8)

    def reset(self) -> None:
        """All back to before the first contact; of some, set their rows of ``memory`` to 0."""
        self.memory.zero_()


def _known(device: Any) -> Any:
    """The device, if Warp has it here."""
    try:
        wp.get_device(device)
    except (ValueError, RuntimeError):
        step = f"Give one of {', '.join(map(str, wp.get_devices()))}, or leave it out."
        raise InputError("device", repr(device), "no device that Warp finds here", next_step=step) from None
    return device


def _row(model: Model) -> list[float]:
    """What the function reads of a model."""
    layers = model.layers
    if len(layers) == 1 and _has(layers[0], _PAPER):
        return [0.0, 1.0, *_layer(layers[0], _of_paper), *[0.0] * PER_LAYER * (MAX_LAYERS - 1)]
    if len(layers) <= MAX_LAYERS and all(_has(layer, _LAYERED) and _punctured_at(layer) > 0.0 for layer in layers):
        row = [number for layer in layers for number in _layer(layer, _of_layered)]
        return [1.0, float(len(layers)), *row, *[0.0] * PER_LAYER * (MAX_LAYERS - len(layers))]
    laws = ", ".join(law.name for layer in layers for law in layer.parts)
    raise InputError(
        f"model {model.name}", laws, "not the paper's law in one layer, nor dragged_tissue in up to 4",
        next_step="Take nf.InsertionBatch, which has every law, or a preset such as paper or layered.",
    )  # fmt: skip


def _has(layer: Layer, laws: tuple) -> bool:
    return all(law.name in names for law, names in zip((layer.stiffness, *layer.parts[2:]), laws))


def _punctured_at(layer: Layer) -> float:
    """The depth of the puncture below the layer's top [m]."""
    model = Model(**dict(zip(("stiffness", "puncture", "friction", "cutting", "relaxation"), layer.parts)))
    return model.puncture_depth


def _layer(layer: Layer, rest: Callable[[Layer, float], list[float]]) -> list[float]:
    contact = layer.stiffness
    coefficient = 2.0 / np.pi * contact.reduced_modulus * np.tan(contact.half_angle)
    saturation = 0.5 * np.pi * contact.radius / np.tan(contact.half_angle) if contact.name == "cone_cylinder" else 1e30
    puncture = layer.top + _punctured_at(layer)
    return [layer.top, puncture, coefficient, saturation, *rest(layer, puncture)]


def _of_paper(layer: Layer, puncture: float) -> list[float]:
    friction, cutting = layer.friction, layer.cutting
    surface = layer.top + friction.dimple_ratio * (puncture - layer.top)
    full, unloading = (cutting.force, cutting.unloading) if cutting.name == "constant_cutting" else (0.0, 1.0)
    stiffness = friction.per_length / friction.presliding
    return [friction.per_length, stiffness, surface, full, 1.0 / unloading, 0.0, 0.0, 0.0, 0.0]


def _of_layered(layer: Layer, puncture: float) -> list[float]:
    law, relaxation = layer.friction, layer.relaxation
    prony = relaxation.name == "prony"
    shares = [relaxation.share_1, relaxation.time_1, relaxation.share_2, relaxation.time_2] if prony else [0.0, 1.0] * 2
    spring = [law.per_length, law.stiffness, 1.0 / law.rupture_length, law.resting_surface, law.withdrawal_ratio]
    return [*spring, *shares]
