# SPDX-License-Identifier: Apache-2.0
"""Recordings of needle insertions that nobody tuned for, each with its truth: ``stranger(seed)``.

Written without looking at the fits, on the physics of ``stranger_physics``. Every second seed is of the scenario
``anything``, the others go through the named ones in turn; a scenario is a plain recording with faults.
"""

from dataclasses import dataclass, field

import numpy as np
from stranger_faults import COMMON, EXCLUSIVE, FAULTS, RARE, REPEATED, SCENARIOS, SHARED_FAULTS, log, plain
from stranger_physics import Layer, Process, Specimen, by_hand, moved, rounded_to, sensed

MAX_SAMPLES = 40_000


@dataclass
class Rupture:
    """A true rupture in a recording; depths [m] in its zero, forces [N] without the sensor."""

    start: float
    end: float
    force: float  # just before
    peak: float  # the largest in the rupture
    drop: float  # as far as the sensor shows it
    detectable: bool = True


@dataclass
class Truth:
    """What is physically true of a recording.

    ``values`` has a range (low, high) [SI] for each quantity that exists: one number twice, or more where layers
    differ or a rupture is gradual. ``meaningful`` are those that a recording can be asked for; ``absent`` do not exist
    (the puncture of an unpunctured tissue), so that any number is wrong.
    """

    seed: int
    scenario: str
    faults: tuple
    values: dict
    meaningful: frozenset
    absent: frozenset
    ruptures: list
    offset: float
    peak: float
    noise: float  # standard deviation of the force, all of it [N]
    travel: float  # embedded length at the deepest point [m]
    specimen: Specimen
    filter_length: int = 1  # declared
    depth_error: float = 0.0  # of quantum, jitter and sampling [m]
    event_margin: float = 0.0  # by which lag and filter displace an event in the written depth, besides [m]
    clean: np.ndarray = field(default=None, repr=False)  # true force at the samples


def law_values(law, rng, indentation, force, exponent=None):
    """Parameters of a law that reaches ``force`` at ``indentation``."""
    if law == "cone_cylinder":
        h = indentation * rng.uniform(0.2, 0.8)
        return (force / (h**2 + 2 * h * (indentation - h)), h)
    if law == "power_law":
        n = exponent or rng.uniform(1.1, 2.2)
        return (force / indentation**n, n)
    if law == "polynomial":
        share = rng.uniform(0.1, 0.9)
        return (share * force / indentation, (1 - share) * force / indentation**2)
    return (force / indentation**2,)


def drawn_faults(rng):
    """Faults of the scenario ``anything``: most recordings have few, some many."""
    names = list(FAULTS)
    weights = np.array([0.3 if name in RARE else 2.0 if name in COMMON else 1.0 for name in names])
    count = rng.choice([0, 1, 2, 3, 4, 7, 10], p=[0.08, 0.27, 0.27, 0.15, 0.1, 0.08, 0.05])
    chosen = []
    for name in rng.choice(names, size=count, replace=False, p=weights / weights.sum()):
        if not any(name in group and group & set(chosen) for group in EXCLUSIVE):
            chosen.append(str(name))
    return tuple(chosen)


def settings_of(seed, scenario=None):
    """The scenario of a seed, its faults and the settings of its recording."""
    rng = np.random.default_rng([seed, 20240])
    names = list(SCENARIOS)
    scenario = scenario or ("anything" if seed % 2 == 0 else names[seed // 2 % len(names)])
    faults = drawn_faults(rng) if scenario == "anything" else (SCENARIOS | REPEATED)[scenario]
    s = plain(rng)
    s["depth_below"] = max(s["depth_below"], 1.6 * s["indentation"])
    s["noise"] = min(s["noise"], s["puncture_force"] / 10)
    for fault in faults:
        (FAULTS | SHARED_FAULTS)[fault](rng, s)
    return scenario, faults, s, rng


def specimen_of(s, rng):
    """Layers from the settings; the drop and its split give friction and cutting."""
    out, top = [], s["contact"]
    for k in range(s["n_layers"]):
        indentation, force = (
            s["indentation"] * (1.0 if k == 0 else rng.uniform(0.4, 1.3)),
            s["puncture_force"] * (1.0 if k == 0 else log(rng, 0.3, 1.5)),
        )
        remaining, length = force * (1 - s["drop"]), indentation + s["rupture"]
        rubbed = min(remaining * (1 - s["cutting_share"]) / length, 1.2 * force / s["depth_below"])
        cut = remaining - rubbed * length
        stretch_limit = 2 * cut / max(rubbed, 1e-9)  # beyond it the cut could not pay for the stretch
        s["stretch"] = min(s["stretch"], stretch_limit)
        if k and rng.random() < 0.5:  # layers of one friction and one cutting force
            cut, rubbed = out[0].cutting, out[0].friction
        reach = 10.0 if s["unruptured"] else 1.0
        out.append(
            Layer(
                top,
                s["law"],
                law_values(s["law"], rng, indentation, force, s.get("exponent")),
                (indentation * reach, s["rupture"]),
                rubbed,
                cut,
            )
        )
        top += (indentation + s["rupture"]) * rng.uniform(1.1, 2.0)
    surface = (s["surface"], log(rng, 0.1, 3.0))
    more = {name: s[name] for name in ("texture", "grip", "outwards", "speed_power", "ageing")}
    return Specimen(out, s["stretch"], s["relaxing"], s["oscillation"], surface, **more)


def motion_of(s, rng):
    """The motion from the settings."""
    start, deep = s["contact"] - s["free"], s["contact"] + s["depth_below"]
    legs = s["legs"] or [(deep, s["speed"])]
    if s["start_inside"] == "deepest":
        start, legs = deep, []
    elif s["start_inside"] is not None:
        first = s["contact"] + s["indentation"] + s["rupture"]
        start = first + s["start_inside"] * max(deep - first, 0.5e-3)
        legs = [leg for leg in legs if leg[0] is None or leg[0] > start] or [(start + 2e-3, s["speed"])]
    if s["hold"]:
        legs = [*legs, (None, s["hold"])]
    if s["withdraw"]:
        out = min(start, s["contact"] - abs(s["free"]) - 0.5e-3)
        last = [leg[0] for leg in legs if leg[0] is not None]
        inside = last[-1] if last else start
        legs = [*legs, (inside + s["withdraw"] * (out - inside), s["speed"])]
    motion = moved(start, legs, s["acceleration"], s["rest"])
    return by_hand(motion, rng, s["hand"]) if s["hand"] else motion


def runs_of(s, rng):
    """One process for each site, in turn."""
    specimen = specimen_of(s, rng)
    return [Process(motion_of(s, rng), specimen) for _ in range(s["sites"])]


def sampled(processes, s, rng):
    """Time, true depth and true force of all sites at the recording's rate."""
    length = sum(p.motion.time[-1] for p in processes)
    n = int(min(max(length * s["rate"], 60), MAX_SAMPLES))
    time = (np.arange(n) + s["clock"] * rng.uniform(-1, 1, n)) * length / n
    depth, force, start = np.zeros(n), np.zeros(n), 0.0
    for p in processes:
        now = (time >= start) & (time <= start + p.motion.time[-1]) if p is not processes[-1] else time >= start
        depth[now] = np.interp(time[now] - start - max(-s["lag"], 0.0), p.motion.time, p.motion.depth)
        force[now] = p.force(np.clip(time[now] - start - max(s["lag"], 0.0), 0.0, None))
        start += p.motion.time[-1]
    return yielded(time, depth, force, processes, s) if s["compliance"] else (time, depth, force)


def yielded(time, depth, force, processes, s):
    """The same seen at the stage of a compliant rig: it is ahead of the tip, and where the force drops faster than the
    rig unloads, the tip jumps: those samples take no time."""
    stage = depth + s["compliance"] * force / s["puncture_force"]
    kept = np.ones(time.size, dtype=bool)
    for p in processes:
        for times in filter(None, map(p.rupture_times, p.specimen.layers)):
            first = int(np.searchsorted(time, times[0])) - 1
            further = np.flatnonzero(stage[first + 1 :] > stage[first])
            kept[first + 1 : first + 1 + (further[0] if further.size else 0)] = False
    return np.arange(kept.sum()) * time[-1] / time.size + time[0], stage[kept], force[kept]


def encoder(time, depth, s, rng):
    """The depth as it is written: jittered, in steps, or stuck for a while."""
    depth = rounded_to(depth + s["depth_jitter"] * rng.standard_normal(depth.size), s["depth_quantum"])
    if s["stuck"]:
        inside = np.flatnonzero((depth > s["contact"]) & (np.arange(depth.size) < np.argmax(depth)))
        first = rng.choice(inside) if inside.size else 0
        stays = (time >= time[first]) & (time < time[first] + s["stuck"])
        depth[stays] = depth[first]
    return depth


def true_ruptures(processes, s, rate, noise):
    """Every rupture in the recording, with what it takes to see it."""
    found = []
    for p in processes:
        for layer in p.specimen.layers:
            times = p.rupture_times(layer)
            if times is None:
                continue
            t = np.linspace(*times, 200)
            force = p.force(t)
            top = int(np.argmax(force))
            shown = np.minimum(force, s["limit"] * s["puncture_force"] if s["limit"] else np.inf)
            drop = float(shown[top] - shown[top:].min())
            speed = max(np.interp(times[0], p.motion.time, np.abs(np.gradient(p.motion.depth, p.motion.time))), 1e-5)
            around = max(min(0.1e-3 / speed * rate / s["filter"] * (1 - s["memory"]) / (1 + s["memory"]), 20), 1.0)
            error = noise * np.sqrt(2 / around) + layer.cutting * 2 * s["oscillation"][0] / 8
            start, bent = layer.top + layer.rupture[0], s["compliance"] * force[top] / s["puncture_force"]
            end = start + layer.rupture[1] + bent  # at the stage of a compliant rig
            found.append(Rupture(start, float(end), float(force[0]), float(force[top]), drop, bool(drop > 8 * error)))
    return found


def truth_values(processes, s, ruptures):
    """Ranges of the true values, those that are meaningful, and those that do not exist."""
    specimen = processes[0].specimen
    first, deepest = specimen.layers[0], max(p.deepest[-1] for p in processes)
    inside = s["start_inside"] is not None
    broken = [layer for layer in specimen.layers if layer.top + layer.rupture[0] < deepest]
    values = {"contact_depth": (first.top, first.top)}
    if broken:
        for name, key in (("friction_per_length", "friction"), ("cutting_force", "cutting")):
            numbers = [getattr(layer, key) for layer in broken]
            values[name] = (min(numbers), max(numbers))
        low, high = values["friction_per_length"]
        values["friction_per_length"] = low * min(s["outwards"], 1.0), high * max(s["outwards"], 1.0 + s["ageing"][0])
    if s["surface"] and "cutting_force" in values and s["withdraw"] < 1:  # only the way out shows where the hole begins
        values["cutting_force"] = (max(first.cutting - first.friction * s["surface"], 0.0), first.cutting)
    if first.law in ("cone", "cone_cylinder"):
        values["stiffness_coefficient"] = (first.values[0],) * 2
    if ruptures:
        until = next((k for k, r in enumerate(ruptures) if r.detectable), len(ruptures) - 1) + 1
        zones = ruptures[:until]
        values["puncture_depth"] = (min(r.start for r in zones), max(r.end for r in zones))
        values["puncture_indentation"] = tuple(d - first.top for d in values["puncture_depth"])
        values["puncture_force"] = (min(r.force for r in zones), max(r.peak for r in zones))
    for name in values.keys() - {"contact_depth", "puncture_depth", "puncture_indentation"}:
        ends = [value * gain for value in values[name] for gain in (1.0, 1.0 + s["gain"])]
        values[name] = min(ends), max(ends)
    without = {"contact_depth", "stiffness_coefficient"} if inside else set()
    if s["compliance"]:
        without |= {"stiffness_coefficient"}
    possible = {"puncture_depth", "puncture_indentation", "puncture_force", "friction_per_length", "cutting_force"}
    return values, frozenset(values) - without, frozenset(possible - set(values))


def stranger(seed, scenario=None):
    """A recording of a stranger: the first of its ``repeats``."""
    return repeats(seed, scenario)[0]


def repeats(seed, scenario=None, n=1):
    """Recordings of a stranger, repeats of each other: only what is random in the sensor differs.

    Parameters
    ----------
    seed : int
        Determines everything.
    scenario : str, optional
        A key of ``SCENARIOS`` or ``REPEATED`` or ``anything``; the default follows from the seed.

    Returns
    -------
    list of tuple
        time [s], depth [m], force [N], each (n,), and a ``Truth``.
    """
    scenario, faults, s, rng = settings_of(seed, scenario)
    processes = runs_of(s, rng)
    of_noise = [rng, *(np.random.default_rng([seed, 20240, k]) for k in range(1, n))]
    return [recorded(processes, dict(s), each, (seed, scenario, faults)) for each in of_noise]


def recorded(processes, s, rng, origin):
    """One recording of the processes with its truth; ``origin`` is its seed, scenario and faults."""
    seed, scenario, faults = origin
    time, depth, clean = sampled(processes, s, rng)
    rate = 1 / np.median(np.diff(time))
    if s["filter"] > 1:  # the noise of the settings is that of the written force
        s["noise"] *= np.sqrt(s["filter"])
    force = sensed(time, clean, s, rng)
    written = encoder(time, depth, s, rng)
    noise = np.sqrt(s["noise"] ** 2 / s["filter"] + s["hum"] ** 2 / 2 + s["quantum"] ** 2 / 12)
    ruptures = true_ruptures(processes, s, rate, noise)
    values, meaningful, absent = truth_values(processes, s, ruptures)
    for _ in range(s["disorder"]):
        k, j = rng.integers(0, time.size, 2)
        time[[k, j]], written[[k, j]], force[[k, j]] = time[[j, k]], written[[j, k]], force[[j, k]]
    error = s["depth_quantum"] + 2 * s["depth_jitter"] + s["speed"] / rate
    margin = s["speed"] * (abs(s["lag"]) + s["filter"] / rate)
    travel = max(p.deepest[-1] for p in processes) - s["contact"]
    truth = Truth(
        seed=seed,
        scenario=scenario,
        faults=faults,
        values=values,
        meaningful=meaningful,
        absent=absent,
        ruptures=ruptures,
        offset=s["offset"],
        peak=float(np.abs(clean).max()),
        noise=float(noise),
        travel=float(travel),
        specimen=processes[0].specimen,
        filter_length=s["filter"] if s["declared"] else 1,
        depth_error=float(error),
        event_margin=float(margin),
        clean=clean,
    )
    return time, written, force, truth
