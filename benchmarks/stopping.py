# SPDX-License-Identifier: Apache-2.0
"""How far past a puncture an axis stops, with the delays of the virtual rig: by nf.EventDetector, by a force threshold,
by a fall below the running maximum and by a force rate, on the same readings.

    python benchmarks/stopping.py [--full]

Sensor: counts, noise and a moving average of 10 readings at 1 kHz, as the rig's. Axis: servo lag, encoder and states at
60 Hz, a stop at 1 m/s^2, as the rig's. Network: 0.5 to 2 ms for a reading, and as much for the stop. The code is that
of ``needleforce record --stop-at``. Every threshold of the others is the best one for the very insertions that are
reported: the fewest that stop too early or not at all, then the smallest 90th percentile; and once it is that of the
tissue or sensor in the table before. ``--full`` makes 1002 insertions instead of 180.
"""

import argparse
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from online_streams import simulated
from rich.console import Console
from rich.table import Table

from needleforce.acquisition.sources.source import ForceSample
from needleforce.acquisition.stop_at import EventStop, StopAt
from needleforce.core import EventSettings
from needleforce.rig import Sensor
from needleforce.rig.live.axis import START, Axis, Encoder
from needleforce.rig.live.simulated import phantom_site
from needleforce.wire.axis_lines import AxisState

BEGIN = 0.5  # [s] at rest before the move, from which the bias is taken
SENSOR, NOISY = Sensor(), Sensor(noise=10.0 / 320.0)
FARTHEST = 4e-3  # [m] past the puncture, at which the planned motion ends


class Insertion(NamedTuple):
    """The planned motion, what arrives of it, and the truth."""

    depth: float  # at which the motion ends [m]
    speed: float  # [m/s]
    puncture: float  # depth [m]
    time: np.ndarray  # of each reading [s]
    force: np.ndarray  # as read, without its bias [N]
    arrival: np.ndarray  # [s]
    states: list[tuple[AxisState, float]]  # each with its arrival
    order: float  # from a reading's arrival to the stop's at the axis [s]


def moved(depth: float, speed: float, random) -> tuple[np.ndarray, np.ndarray, list[AxisState]]:
    """Times, depths of the needle and states of the axis in a motion to ``depth``."""
    axis = Axis()
    encoder, states, depths = Encoder(axis, random), [], []
    axis.move(BEGIN, depth, speed)
    times = np.arange(0.0, BEGIN + (depth - START) / speed + speed / 10e-3 + 0.3, 1e-3)
    for time in times:
        axis.tick(float(time))
        states += encoder.states()
        depths.append(axis.needle)
    return times, np.array(depths), states


def measured(force_at: Callable, puncture: float, speed: float, random, sensor: Sensor = SENSOR) -> Insertion:
    """An insertion as the recorder gets it."""
    depth = puncture + FARTHEST
    times, depths, states = moved(depth, speed, random)
    read = sensor.record({"force": force_at(depths)}, random)["force"]
    late = random.uniform(0.5e-3, 2e-3, len(times))
    arrival = np.maximum.accumulate(times + late)
    seen = [(state, state.time + random.uniform(0.5e-3, 2e-3)) for state in states]
    bias = read[times < BEGIN].mean()
    return Insertion(depth, speed, puncture, times, read - bias, arrival, seen, float(random.uniform(0.5e-3, 2e-3)))


def gel(seed: int) -> Insertion:
    """A site of the source paper's phantom."""
    random, site = np.random.default_rng([seed, 7]), phantom_site(seed, 1)
    speed = float(random.choice([1e-3, 3e-3, 5e-3, 10e-3]))
    puncture = site.surface + site.specimen.puncture_depth
    return measured(lambda depths: site.specimen.force(depths - site.surface), puncture, speed, random)


def layered(seed: int, sensor: Sensor = SENSOR) -> Insertion:
    """Skin-like layers of 0.5 to 4 N with texture; the first puncture."""
    random = np.random.default_rng([seed, 8])
    (_, (each,)) = simulated(1, noise=0.0, seed=seed)
    until = int(each.punctures[1].snap)  # up to the second puncture

    def force_at(depths):
        rising = np.maximum.accumulate(depths)
        return np.interp(rising, each.depth[:until], each.force[:until], left=0.0)

    puncture, speed = float(each.depth[each.punctures[0].snap]), float(random.choice([1e-3, 3e-3, 5e-3, 10e-3]))
    return measured(force_at, puncture, speed, random, sensor)


def noisy(seed: int) -> Insertion:
    """The same layers with a sensor of ten times the noise."""
    return layered(seed, NOISY)


def rest(insertion: Insertion, stopped: float | None) -> float:
    """Where the needle rests, relative to the puncture [m], if the stop is known at this time [s], or never."""
    axis = Axis()
    axis.move(BEGIN, insertion.depth, insertion.speed)
    if stopped is not None:
        axis.stop(stopped + insertion.order)
    axis.tick(float(insertion.time[-1]) + 60.0)
    return axis.needle - insertion.puncture


def by_events(insertion: Insertion, settings: EventSettings) -> float | None:
    """When the recorder orders the stop."""
    stop, states = EventStop(StopAt(settings=settings)), iter(insertion.states)
    state, arrived = next(states)
    readings = zip(insertion.time.tolist(), insertion.force.tolist(), insertion.arrival.tolist(), strict=True)
    for k, (time, force, arrival) in enumerate(readings):
        while arrived <= arrival:
            stop.add_state(state, round(1e9 * arrived))
            state, arrived = next(states, (state, np.inf))
        device, at = round(1e9 * time), round(1e9 * arrival)
        if stop.add(ForceSample(k, device, at, at, (0, 0, force, 0, 0, 0), 0), force):
            return arrival
    return None


def above(insertion: Insertion) -> np.ndarray:
    """The force itself [N]."""
    return insertion.force


def below_maximum(insertion: Insertion) -> np.ndarray:
    """How far the force is below its running maximum [N]."""
    return np.maximum.accumulate(insertion.force) - insertion.force


def rate(insertion: Insertion) -> np.ndarray:
    """Fall of the force over 10 ms [N/s]."""
    force = insertion.force
    return np.r_[np.zeros(10), force[:-10] - force[10:]] / 10e-3


def rests_by(insertions: list[Insertion], highest: list[np.ndarray], threshold: float) -> list[float]:
    """Where the needle rests if the stop is ordered where a statistic, of which these are the running maxima in the
    motion, first reaches a threshold."""
    first = [int(np.searchsorted(each, threshold)) for each in highest]
    return [rest(i, float(i.arrival[k]) if k < len(i.time) else None) for i, k in zip(insertions, first, strict=True)]


def running(insertions: list[Insertion], statistic: Callable) -> list[np.ndarray]:
    """The running maximum of a statistic in the motion."""
    return [np.maximum.accumulate(np.where(i.time > BEGIN, statistic(i), -np.inf)) for i in insertions]


def best(insertions: list[Insertion], highest: list[np.ndarray]) -> float:
    """The best threshold for these insertions."""
    levels = np.geomspace(5e-3, max(each[-1] for each in highest), 60).tolist()

    def cost(level: float) -> tuple[int, float]:
        rests = rests_by(insertions, highest, level)
        return failed(rests), float(np.percentile(np.abs(rests), 90))

    return min(levels, key=cost)


def failed(rests: list[float]) -> int:
    """Stops before the puncture, and motions that nothing stopped."""
    return sum(not 0.0 < each < FARTHEST - 0.05e-3 for each in rests)


def row(name: str, rests: list[float]) -> list[str]:
    """Failures, and the distances of the others in mm."""
    fine = [1e3 * each for each in rests if 0.0 < each < FARTHEST - 0.05e-3] or [np.nan]
    cells = (np.median(fine), np.percentile(fine, 90), np.max(fine))
    return [name, f"{failed(rests) / len(rests):.1%}", *(f"{each:.3f}" for each in cells)]


SETS = {
    "gel of the source paper, 0.2 N": gel,
    "layers of 0.5 to 4 N": layered,
    "the same, sensor of ten times the noise": noisy,
}
SIMPLE = {"force": (above, "N"), "fall below maximum": (below_maximum, "N"), "force rate": (rate, "N/s")}


def main(full: bool) -> None:
    """Prints a table for each tissue."""
    console, count = Console(width=110), 334 if full else 60
    sets = {title: [made(seed) for seed in range(1, count + 1)] for title, made in SETS.items()}
    seen = {title: {name: running(each, SIMPLE[name][0]) for name in SIMPLE} for title, each in sets.items()}
    limits = {title: {name: best(sets[title], each) for name, each in of.items()} for title, of in seen.items()}
    before = list(sets)[-1]
    for title, insertions in sets.items():
        shown = Table("stopped by", "early or never", "median [mm]", "90 %", "worst", title_justify="left",
                      title=f"{title}: {count} insertions, distance past the puncture")  # fmt: skip
        for settings in (EventSettings(), EventSettings(fall=0.05)):
            found = [rest(each, by_events(each, settings)) for each in insertions]
            shown.add_row(*row(f"EventDetector(fall={settings.fall:g})", found))
        for speed in sorted({each.speed for each in insertions}):
            mine = [r for r, each in zip(found, insertions, strict=True) if each.speed == speed]
            shown.add_row(*row(f"  of these at {1e3 * speed:g} mm/s", mine))
        for name, (_, unit) in SIMPLE.items():
            for of, words in ((title, "best"), (before, "of the table before")):
                level = limits[of][name]
                shown.add_row(
                    *row(f"{name}, {level:.2g} {unit}, {words}", rests_by(insertions, seen[title][name], level))
                )
        console.print(shown)
        before = title


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true", help="1002 insertions instead of 180")
    main(parser.parse_args().full)
