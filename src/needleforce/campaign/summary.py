# SPDX-License-Identifier: Apache-2.0
"""What a recording shows without any model: its motion, the size of its force, its baseline, its samples."""

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from ..identification.estimates import Estimate
from ..recording import Recording
from ..segmentation import Events
from ..segmentation.strokes import Cycle, cycles

FLAT = 5  # samples of one value that a force at rest in its extreme has at least …
OFTEN = 3.0  # … and so many times more than at any other value: a coarse sensor repeats all of its values
NEAR_CONTACT = 0.8  # share of the free travel whose force is the baseline
FEWEST = 10  # samples of a baseline
UNITS = {"speed": "m/s", "travel": "m", "hold": "s", "peak_force": "N", "drift": "N", "longest_gap": "s"}
DRAWN = 90  # blocks of equal travel, each with its lowest and highest force
STEP = 0.1e-3  # [m] between the points of a curve that is compared
LONGEST = 1000  # points of it


@dataclass(frozen=True, eq=False)
class Trace:
    """A curve to draw: ``indentation`` (m,) [m] from the contact, ``force`` (m,) [N]; m is some 200 at most."""

    indentation: np.ndarray
    force: np.ndarray


@dataclass(frozen=True, eq=False)
class RecordingSummary:
    """Median ``speed`` [m/s], ``travel`` [m] and ``hold`` [s] of the first insertion, greatest force and baselines [N];
    ``end`` is the force at the end of the way in.

    ``push`` and ``pull`` are the mean forces [N] of the strokes against the force at the start; ``noise`` is that of
    the free travel. ``flat`` counts the samples of a flat top, 0 if there is none, and ``flat_ends`` is where it ends.
    ``gap`` [s] is the longest step of the time, ``lost`` the share of samples that gaps swallowed; ``fall`` [samples]
    is how long the first puncture's drop takes from a tenth to nine tenths.
    """

    speed: float
    travel: float
    hold: float
    peak: float
    end: float
    push: float
    pull: float
    before: float
    after: float
    noise: float
    flat: int
    flat_ends: int
    gap: float
    step: float
    lost: float
    fall: float
    shown: Trace
    curve: np.ndarray = field(default_factory=lambda: np.empty(0))

    @property
    def drift(self) -> float:
        """By how much the baseline changed [N]; NaN where one of the two cannot be seen."""
        return self.after - self.before

    def quantities(self) -> dict[str, Estimate]:
        """What the table tells of it."""
        named = {"speed": self.speed, "travel": self.travel, "hold": self.hold, "peak_force": self.peak,
                 "drift": self.drift, "longest_gap": self.gap}  # fmt: skip
        return {name: _seen(name, value, UNITS[name]) for name, value in named.items() if np.isfinite(value)}


def summarise(recording: Recording, events: Events, usual: float | None) -> RecordingSummary | None:
    """What the first insertion of a recording shows; None where nothing moves inwards.

    ``usual`` is the contact depth [m] of its repeats, for a recording that shows no contact of its own.
    """
    time, depth, force = recording.time, recording.depth, recording.force
    found = cycles(time, depth)
    if not found or not np.isfinite(force).all():
        return None
    cycle = found[0]
    inwards = slice(cycle.start, cycle.stop)
    elsewhere = float(depth[cycle.start]) if usual is None else usual
    surface = events.contact.depth if events.contact is not None else elsewhere
    return RecordingSummary(
        speed=float(np.median(recording.velocity[inwards])),
        travel=float(depth[cycle.stop - 1] - depth[cycle.start]),
        hold=_hold(time, cycle),
        **_forces(force, cycle),
        **_baselines(depth, force, cycle, surface),
        **_flat_top(depth, force, cycle),
        **_steps(time),
        fall=_fall(recording, events),
        shown=trace(depth, force, surface),
        curve=loading(depth[inwards], force[inwards]),
    )


def event_quantities(recording: Recording, events: Events) -> dict[str, Estimate]:
    """Contact, punctures and exit as rows of the table, with the depths between which each surely lies."""
    depth = recording.depth
    named = [("contact", events.contact), ("exit", events.exit)]
    named += [(f"puncture_{k}", puncture) for k, puncture in enumerate(events.punctures, 1)]
    found = [Estimate("event_punctures", float(len(events.punctures)), "1", np.nan, np.nan, source="seen")]
    for name, event in named:
        if event is not None:
            ends = sorted((float(depth[event.low]), float(depth[event.high])))
            found.append(Estimate(f"event_{name}_depth", event.depth, "m", *ends, source="seen"))
    for k, puncture in enumerate(events.punctures, 1):
        found.append(_seen(f"event_puncture_{k}_force", puncture.force, "N"))
        found.append(_seen(f"event_puncture_{k}_indentation", puncture.indentation, "m"))
    return {each.name: each for each in found}


def _seen(name: str, value: float, unit: str) -> Estimate:
    return Estimate(name, float(value), unit, np.nan, np.nan, source="seen")


def _hold(time: np.ndarray, cycle: Cycle) -> float:
    return float(time[cycle.leave - 1] - time[cycle.stop]) if cycle.leave > cycle.stop else 0.0


def _forces(force: np.ndarray, cycle: Cycle) -> dict[str, float]:
    """Against the force at the start; the pull is NaN without a withdrawal."""
    level = force - float(np.median(force[: max(cycle.start, FEWEST)]))
    inwards, outwards = level[cycle.start : cycle.stop], level[cycle.leave : cycle.end]
    return {
        "peak": float(np.abs(level[cycle.start : cycle.leave]).max()),
        "end": float(np.median(inwards[-FEWEST:])),
        "push": float(inwards.mean()),
        "pull": float(outwards.mean()) if cycle.withdrawn else np.nan,
    }


def _baselines(depth: np.ndarray, force: np.ndarray, cycle: Cycle, surface: float) -> dict[str, float]:
    """The force on the free travel in and out, and its noise; NaN where there is hardly any."""
    free = depth < depth[cycle.start] + NEAR_CONTACT * (surface - depth[cycle.start])
    first, last = (force[part][free[part]] for part in (slice(cycle.stop), slice(cycle.leave, cycle.end)))
    enough, back = len(first) >= FEWEST, cycle.withdrawn and len(last) >= FEWEST
    return {
        "before": float(np.median(first)) if enough else np.nan,
        "after": float(np.median(last)) if back else np.nan,
        "noise": float(first.std()) if enough else np.nan,
    }


def _flat_top(depth: np.ndarray, force: np.ndarray, cycle: Cycle) -> dict[str, int]:
    """The longest run of samples at the greatest force of the inward stroke, while it moves, and the sample after."""
    part, moves = force[cycle.start : cycle.stop], np.abs(np.diff(depth[cycle.start : cycle.stop])) > 0.0
    same = np.concatenate(([False], (part[1:] == part[:-1]) & moves, [False]))
    edges = np.flatnonzero(np.diff(same.astype(int)))
    firsts, ends = edges[::2], edges[1::2]
    away = np.abs(part - np.median(force[: max(cycle.start, FEWEST)]))
    lengths, at_top = ends - firsts + 1, (part[firsts] == part[away.argmax()]) & (away.max() > 0.0)
    usual = int(lengths[~at_top].max(initial=1))
    if not at_top.any() or lengths[at_top].max() < max(FLAT, OFTEN * usual):
        return {"flat": 0, "flat_ends": 0}
    longest = int(np.argmax(np.where(at_top, lengths, 0)))
    return {"flat": int(lengths[longest]), "flat_ends": int(cycle.start + ends[longest] + 1)}


def _steps(time: np.ndarray) -> dict[str, float]:
    """The longest and the median step, and the share of samples missing if every step were the median one."""
    steps = np.diff(time)
    step = float(np.median(steps))
    missing = float((np.round(steps[steps > 1.5 * step] / step) - 1.0).sum())
    return {"gap": float(steps.max()), "step": step, "lost": missing / (len(steps) + missing)}


def _fall(recording: Recording, events: Events) -> float:
    """Samples from a tenth to nine tenths of the first puncture's drop; NaN without a puncture."""
    if not events.punctures:
        return np.nan
    broke = events.punctures[0]
    after = recording.force[int(np.searchsorted(recording.time, broke.time)) :]
    past = [np.flatnonzero(after < broke.force - share * broke.drop) for share in (0.1, 0.9)]
    return float(past[1][0] - past[0][0]) if len(past[0]) and len(past[1]) else np.nan


def trace(depth: np.ndarray, force: np.ndarray, surface: float) -> Trace:
    """(n,) ``depth`` [m] and ``force`` [N] in blocks of equal travel, there and back: no peak and no drop is lost."""
    travel = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(depth)))))
    edges = np.searchsorted(travel, np.linspace(0.0, travel[-1], DRAWN + 1)[1:-1])
    edges = np.unique(np.concatenate(([0], edges, [len(depth)])))
    keep = [0, len(depth) - 1]
    for first, last in pairwise(edges):
        part = force[first:last]
        keep += [first + int(part.argmin()), first + int(part.argmax())]
    keep = np.unique(keep)
    return Trace(depth[keep] - surface, force[keep].copy())


def loading(depth: np.ndarray, force: np.ndarray) -> np.ndarray:
    """The force (m,) [N] of an inward stroke every ``STEP`` of travel from its start; empty for one too short to
    compare.

    Not from the contact: where the tissue lies is part of what tells two specimens apart.
    """
    travel = np.maximum.accumulate(depth) - depth[0]
    grid = STEP * np.arange(min(int(travel[-1] / STEP) + 1, LONGEST))
    return np.interp(grid, travel, force) if len(grid) >= 20 else np.empty(0)
