# SPDX-License-Identifier: Apache-2.0
"""Motion, tissue and sensor of the trial of strangers, in plain NumPy. Nothing here imports needleforce: the trial is a
second opinion. All quantities in SI; ``docs/evidence/trial_of_strangers.md`` has the equations."""

from dataclasses import dataclass, field

import numpy as np

FINE = 8000  # steps of the integration, whatever the rate of the recording
NODE = 50e-6  # [m] of shaft per friction element; the last one counts with the share that is inside


@dataclass
class Layer:
    """Tissue between ``top`` and the next layer: it is pressed in, ruptures, then rubs and is cut.

    Parameters
    ----------
    top : float
        Depth of its undeformed surface [m], in the zero of the recording.
    law : str
        ``cone`` c h², ``cone_cylinder`` (linear beyond h_s), ``power_law`` a h^n, ``polynomial`` a h + b h².
    values : tuple of float
        (c,), (c, h_s), (a, n) or (a, b).
    rupture : tuple of float
        Indentation [m] at which the rupture starts and its length [m]; 0 is a sharp one.
    friction : float
        Sliding friction per embedded length [N/m].
    cutting : float
        Mean cutting force [N].
    """

    top: float
    law: str
    values: tuple
    rupture: tuple
    friction: float
    cutting: float

    def stiffness(self, indentation):
        """Force [N] of the unbroken surface at an indentation [m]."""
        h, (a, *more) = np.maximum(indentation, 0.0), self.values
        if self.law == "cone":
            return a * h**2
        if self.law == "cone_cylinder":
            return a * (np.minimum(h, more[0]) ** 2 + 2.0 * more[0] * np.maximum(h - more[0], 0.0))
        if self.law == "power_law":
            return a * h ** more[0]
        return a * h + more[0] * h**2

    def broken(self, deepest):
        """Share of the surface that has ruptured, 0 to 1, at a deepest depth so far [m]."""
        start, length = self.rupture
        share = np.clip((deepest - self.top - start) / max(length, 1e-12), 0.0, 1.0)
        return share * share * (3.0 - 2.0 * share)


@dataclass
class Specimen:
    """Layers, and what they have in common."""

    layers: list
    stretch: float = 0.1e-3  # [m] of travel from stick to slide
    relaxing: tuple = (0.0, 1.0)  # share of every force that relaxes at rest, and its time constant [s]
    oscillation: tuple = (0.0, 1e-3, 0.0)  # of the cutting force: amplitude as a share, wavelength [m], phase
    surface: tuple = (0.0, 1.0)  # depth [m] below its top where the broken surface comes to rest, time constant [s]
    texture: tuple = (0.0, 0.5e-3, 0)  # of the friction along the path: standard deviation as a share, length [m], seed
    grip: float = 0.0  # friction [N] of the surface by itself, as skin around the shaft
    outwards: float = 1.0  # friction of the withdrawal over that of the insertion
    speed_power: float = 0.0  # of the sliding friction, which is as given at the largest speed
    ageing: tuple = (0.0, 1.0)  # share by which the friction has grown after a long time, time constant [s]


@dataclass
class Motion:
    """Depth [m] of the tip over time [s] on a fine grid."""

    time: np.ndarray
    depth: np.ndarray
    at_rest: np.ndarray = field(init=False)

    def __post_init__(self):
        self.at_rest = np.abs(np.diff(self.depth, prepend=self.depth[0])) < 1e-12


def trapezoid(start, end, speed, acceleration):
    """Time [s] and depth [m] of one move from rest to rest with limited acceleration."""
    distance = abs(end - start)
    ramp = min(speed / acceleration, np.sqrt(distance / acceleration))
    top = ramp * acceleration
    total = distance / top + ramp if distance else 0.0
    t = np.linspace(0.0, total, 400)
    left = np.minimum(t, total - t)
    rising = np.where(left < ramp, 0.5 * acceleration * left**2, 0.5 * top * ramp + top * (left - ramp))
    travelled = np.where(t <= total / 2, rising, distance - rising)
    return t, start + np.sign(end - start) * travelled


def moved(start, legs, acceleration, rest):
    """The motion through ``legs``: (depth, speed) moves there, (None, duration) waits; ``rest`` [s] at both ends."""
    time, depth = [np.zeros(1), np.array([rest])], [np.full(2, start)]
    for goal, value in [*legs, (None, rest)]:
        now, here = time[-1][-1], depth[-1][-1]
        t, x = ([value], [here]) if goal is None else trapezoid(here, goal, value, acceleration)
        time.append(now + np.asarray(t))
        depth.append(np.asarray(x))
    time, depth = np.concatenate(time), np.concatenate(depth)
    fine = np.linspace(0.0, time[-1], FINE)
    return Motion(fine, np.interp(fine, time, depth))


def by_hand(motion, rng, jerk):
    """The same path as a hand would drive it: its clock runs unevenly and now and then backwards."""
    n, period = motion.time.size, motion.time[-1] / motion.time.size
    rough = sum(
        rng.standard_normal() * np.sin(2 * np.pi * f * motion.time + rng.uniform(0, 7)) for f in rng.uniform(0.3, 4, 8)
    )
    clock = np.cumsum(np.where(motion.at_rest, 1.0, 1.0 + jerk * rough / 2.0)) * period
    clock = np.interp(clock * motion.time[-1] / max(clock[-1], period), motion.time, np.arange(n))
    return Motion(motion.time, np.interp(clock, np.arange(n), motion.depth))


def relaxed(motion, share, constant):
    """Factor of each step by which a force relaxes at rest, as 1 - share (1 - exp(-t/constant)) since the stop."""
    step = motion.time[1] - motion.time[0]
    since, factor = 0.0, np.ones(motion.time.size)
    left = lambda t: 1.0 - share * (1.0 - np.exp(-t / constant))  # noqa: E731
    for k in np.flatnonzero(motion.at_rest):
        since = since + step if k and motion.at_rest[k - 1] else step
        factor[k] = left(since) / left(since - step)
    return factor


def friction(motion, specimen):
    """Friction [N] of each layer along the shaft, (layers, steps), as if all were ruptured.

    The hole is a row of elastic elements that the needle stretches up to ``stretch`` and then drags along. An element
    that the tip cuts is dragged along at once, one that it meets again in its old hole begins unstretched. An element
    that the tip leaves loses its stretch.
    """
    top = specimen.layers[0].top
    edges = np.arange(top, motion.depth.max() + 2 * NODE, NODE)
    bounds = np.searchsorted(edges, [layer.top - NODE / 2 for layer in specimen.layers])
    factor = relaxed(motion, *specimen.relaxing)
    surface = resting_surface(motion, specimen) if specimen.surface[0] else None
    shares = element_shares(edges.size, specimen)
    stretch, u, out = specimen.stretch, np.zeros(edges.size), np.zeros((len(bounds), motion.depth.size))
    limit = stretch * sliding_share(motion, specimen)
    cut = inside = 0
    for k in range(motion.depth.size):
        depth = motion.depth[k]
        step = depth - motion.depth[k - 1] if k else 0.0
        now = min(max(int(np.ceil((depth - top) / NODE)), 0), edges.size)
        if now > inside:
            u[inside:now] = np.minimum(depth - edges[inside:now], step) - step
            u[max(cut, inside) : now] = limit[k]
        u[now:inside] = 0.0
        inside, cut = now, max(cut, now)
        if now == 0:
            continue
        if k and step == 0.0 and factor[k] == 1.0 and surface is None:
            out[:, k] = out[:, k - 1]  # nothing moves
            continue
        u[:now] = np.minimum(np.maximum(u[:now] + step, -specimen.outwards * limit[k]), limit[k]) * factor[k]
        weight = u[:now] * shares[:now]
        weight[-1] *= min((depth - edges[now - 1]) / NODE, 1.0)
        if surface is not None:
            weight *= np.clip((edges[:now] - surface[k]) / NODE + 1.0, 0.0, 1.0)
        starts = bounds[bounds < now]
        out[: starts.size, k] = np.add.reduceat(weight, starts)
    return out * (NODE / stretch) * np.array([[layer.friction] for layer in specimen.layers])


def sliding_share(motion, specimen):
    """Sliding friction of each step over the one given: it may depend on the speed, and grow with time."""
    share, constant = specimen.ageing
    found = 1.0 + share * (1.0 - np.exp(-motion.time / constant))
    if specimen.speed_power:
        speed = np.abs(np.gradient(motion.depth, motion.time))
        moving = np.maximum(speed / speed.max(), 1e-6) ** specimen.speed_power
        found = found * np.where(motion.at_rest, 1.0, moving)  # what rests keeps its stretch
    return found


def element_shares(n, specimen):
    """Friction of each element over the mean, for tissue that is not uniform."""
    amplitude, length, seed = specimen.texture
    memory = np.exp(-NODE / length)
    shares = (
        1.0 + np.clip(coloured(n, amplitude, memory, np.random.default_rng(seed)), -0.9, 3.0)
        if amplitude
        else np.ones(n)
    )
    shares[0] += specimen.grip / (specimen.layers[0].friction * NODE)
    return shares


def resting_surface(motion, specimen):
    """Depth [m] of the surface over time: it leaves the first puncture and comes to rest below its top."""
    first = specimen.layers[0]
    rest, constant = first.top + specimen.surface[0], specimen.surface[1]
    after = np.flatnonzero(motion.depth > first.top + first.rupture[0])
    since = motion.time - (motion.time[after[0]] if after.size else np.inf)
    return np.where(
        since < 0, first.top, rest + (first.rupture[0] - specimen.surface[0]) * np.exp(-np.maximum(since, 0) / constant)
    )


def cutting(motion, specimen):
    """Share of the cutting force that acts, with its oscillation: a spring ahead of the tip that the cut follows."""
    factor, front = relaxed(motion, *specimen.relaxing), -np.inf
    amplitude, wavelength, phase = specimen.oscillation
    out = np.zeros(FINE)
    for k, depth in enumerate(motion.depth.tolist()):
        front = max(front, depth - specimen.stretch)  # the tip advances the cut
        pressed = max(depth - front, 0.0)
        out[k] = pressed / specimen.stretch * (1.0 + amplitude * np.sin(2 * np.pi * front / wavelength + phase))
        if factor[k] < 1.0 and pressed > 0.0:
            front = depth - pressed * factor[k]
    return out


def unbroken(motion, specimen):
    """What a stop has taken from the stiffness force of each layer so far, (layers, steps) [N]."""
    share, constant = specimen.relaxing
    out = np.zeros((len(specimen.layers), FINE))
    if share == 0.0 or not motion.at_rest.any():
        return out
    step = motion.time[1] - motion.time[0]
    for row, layer in zip(out, specimen.layers, strict=True):
        full = share * layer.stiffness(motion.depth - layer.top)
        lost = 0.0
        for k in range(FINE):
            lost += (full[k] - lost) * (1 - np.exp(-step / constant)) * motion.at_rest[k]
            lost = min(lost, full[k])  # the surface does not pull
            row[k] = lost
    return out


class Process:
    """Forces of one insertion at any time. A motion that starts inside continues an insertion to that depth."""

    def __init__(self, motion, specimen):
        self.motion, self.specimen = motion, specimen
        self.deepest = np.maximum.accumulate(motion.depth)
        self.rubbing = friction(motion, specimen)
        self.cut = cutting(motion, specimen)
        self.lost = unbroken(motion, specimen)

    def at(self, time, states):
        """The states, (..., steps), at ``time`` [s]."""
        return np.interp(time, self.motion.time, states)

    def force(self, time):
        """Force [N] at any times; what jumps is evaluated there, what is continuous is interpolated."""
        depth, deepest, cut = (self.at(time, s) for s in (self.motion.depth, self.deepest, self.cut))
        total, tip = np.zeros(np.shape(time)), np.zeros(np.shape(time))
        for layer, rubbing, lost in zip(self.specimen.layers, self.rubbing, self.lost, strict=True):
            broken = layer.broken(deepest)
            total = total + (1 - broken) * np.maximum(layer.stiffness(depth - layer.top) - self.at(time, lost), 0.0)
            total = total + broken * self.at(time, rubbing)
            tip = np.where(
                depth > layer.top, (1 - broken) * tip + broken * layer.cutting * cut, tip
            )  # the deepest layer
        return total + tip

    def rupture_times(self, layer):
        """Times [s] at which the rupture of a layer starts and ends in this motion, at its deepest point at the latest;
        None if it never starts."""
        start = layer.top + layer.rupture[0]
        if self.deepest[0] >= start or self.deepest[-1] <= start:
            return None
        reached = [np.searchsorted(self.deepest, d, side="right") for d in (start, start + layer.rupture[1])]
        times = [self.motion.time[min(k, int(np.argmax(self.motion.depth)))] for k in reached]
        return times[0] - (self.motion.time[1]), times[1]


def coloured(n, sd, memory, rng):
    """Noise of a standard deviation ``sd``, autocorrelated with ``memory`` per sample (0 is white)."""
    white = rng.standard_normal(n) * sd
    if memory == 0.0:
        return white
    taps = int(min(n, np.ceil(np.log(1e-4) / np.log(memory))))
    kernel = memory ** np.arange(taps) * np.sqrt(1 - memory**2)
    return np.convolve(rng.standard_normal(n + taps) * sd, kernel)[taps : taps + n]


def averaged(force, length):
    """Trailing mean of ``length`` samples, as an instrument forms it."""
    if length <= 1:
        return force
    padded = np.concatenate([np.full(length - 1, force[0]), force])
    sums = np.cumsum(np.concatenate([[0.0], padded]))
    return (sums[length:] - sums[:-length]) / length


def rounded_to(values, quantum):
    """Values in steps of ``quantum``; 0 leaves them."""
    return np.round(values / quantum) * quantum if quantum else values


def sensed(time, true_force, sensor, rng):
    """What the sensor writes for a true force [N] at ``time`` [s]; ``sensor`` is a dict of its faults."""
    n, peak = time.size, np.abs(true_force).max()
    force = true_force + sensor["hum"] * np.sin(2 * np.pi * sensor["hum_frequency"] * time + rng.uniform(0, 7))
    force = force + coloured(n, sensor["noise"], sensor["memory"], rng)
    share = (time - time[0]) / (time[-1] - time[0])
    force = averaged(force * (1.0 + sensor["gain"] * share), sensor["filter"]) + sensor["offset"]
    force = force + sensor["drift"] * (share if sensor["drift_power"] == 1 else 1 - np.exp(-3 * share))
    struck = rng.integers(0, n, sensor["spikes"])
    force[struck] += (
        rng.choice([-1, 1], struck.size) * rng.uniform(0.3, 3, struck.size) * max(peak, 20 * sensor["noise"])
    )
    if sensor["limit"]:
        force = np.minimum(force, sensor["limit"] * sensor["puncture_force"])
    return rounded_to(force, sensor["quantum"])
