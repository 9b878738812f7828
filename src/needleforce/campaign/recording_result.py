# SPDX-License-Identifier: Apache-2.0
"""One recording of a campaign: what it shows without a model (motion, maximum force, baselines, sampling), its result
with its anomalies, and numbers formatted for their sentences."""

import math
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from ..identification.estimates import Estimate, Parameters, Quality
from ..recording import Recording
from ..segmentation import Events
from ..segmentation.strokes import Cycle, cycles
from ..vocabulary import Status

INVALIDATING = ("dead", "sign", "force_unit", "depth_unit", "saturated")
"""Kinds of anomalies that invalidate the values of a recording."""
_DISPLAY_UNITS = {
    "m": (1e3, "mm"),
    "m/s": (1e3, "mm/s"),
    "N/m": (1e-3, "N/mm"),
    "N/m^2": (1e-6, "N/mm²"),
    "1": (1.0, ""),
}
MIN_FLAT_SAMPLES = 5  # consecutive equal samples at the extreme of a saturated force, at least
MIN_FLAT_RATIO = 3.0  # ratio of that number to the longest run at any other value: a coarse sensor repeats all values
FREE_TRAVEL_SHARE = 0.8  # of the free travel: the part whose force is the baseline
MIN_BASELINE_SAMPLES = 10  # samples needed for a baseline
UNITS = {"speed": "m/s", "travel": "m", "hold": "s", "peak_force": "N", "drift": "N", "longest_gap": "s"}
N_DRAWN_BLOCKS = 90  # blocks of equal travel of a drawn curve, each with its lowest and highest force
CURVE_STEP_M = 0.1e-3  # [m] between the points of a loading curve
MAX_CURVE_POINTS = 1000  # points of a loading curve


@dataclass(frozen=True, eq=False)
class Trace:
    """A curve for drawing: ``indentation`` (m,) [m] from the contact and ``force`` (m,) [N]; m is at most about 200."""

    indentation: np.ndarray
    force: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Anomaly:
    """An anomaly of a recording.

    Parameters
    ----------
    kind : str
        A short name, such as ``sign``, ``force_unit``, ``motion`` or ``outlier``.
    quantity : str
        The quantity that is anomalous; empty for none.
    value : float
        Its value [``unit``].
    usual : float
        The value of the repeats [``unit``], NaN if nothing is compared.
    unit : str
        SI unit.
    sentence : str
        A description with the next step.
    left_out : bool
        True if the pooled fit does not use the recording.
    """

    kind: str
    quantity: str = ""
    value: float = math.nan
    usual: float = math.nan
    unit: str = ""
    sentence: str
    left_out: bool = False


@dataclass(frozen=True, eq=False, kw_only=True)
class RecordingResult:
    """The result of one recording.

    Parameters
    ----------
    file : str
        Path relative to the campaign's folder.
    fields : dict
        The label: field -> text.
    status : Status
        Status of the recording.
    notes : tuple of str
        Notes of segmentation and fit, or why the file could not be read.
    reading : tuple of str
        Notes made while reading.
    anomalies : tuple of Anomaly
        Its anomalies.
    pooled : bool
        Whether the pooled parameters of the condition use it.
    events : Events
        Its events and phases.
    measured : dict
        Quantities measured without a model: motion, forces and events.
    parameters : dict
        Parameters of its own fit, empty if there is none.
    quality : Quality or None
        Quality of its own fit.
    shown : Trace or None
        Its curve for drawing, None if it could not be read.
    curve : (m,) array
        Its loading curve [N] for comparison, empty if it could not be read or is too short.
    """

    file: str
    fields: dict[str, str]
    status: Status
    notes: tuple[str, ...] = ()
    reading: tuple[str, ...] = ()
    anomalies: tuple[Anomaly, ...] = ()
    pooled: bool = False
    events: Events = field(default_factory=Events)
    measured: dict[str, Estimate] = field(default_factory=dict)
    parameters: dict[str, Estimate] = field(default_factory=dict)
    quality: Quality | None = None
    shown: Trace | None = None
    curve: np.ndarray = field(default_factory=lambda: np.empty(0))

    def __post_init__(self):
        object.__setattr__(self, "parameters", Parameters(self.parameters))

    @property
    def has_parameters(self) -> bool:
        """Whether its own fit has parameters."""
        return bool(self.parameters)

    @property
    def left_out(self) -> bool:
        """Whether the pooled fit does not use it because of an anomaly."""
        return any(each.left_out for each in self.anomalies)

    @property
    def why(self) -> str:
        """Its anomalies in sentences and, if it has no parameters, the reason."""
        sentences = [each.sentence for each in self.anomalies]
        explained = self.has_parameters or any(each.kind in ("dead", "no_puncture") for each in self.anomalies)
        return " ".join(sentences if explained else [*sentences, *self.notes])


def formatted(value: float, unit: str) -> str:
    """Format a value with its unit: three significant digits, or all digits before the decimal point."""
    factor, name = _DISPLAY_UNITS.get(unit, (1.0, unit))
    value = factor * value
    return f"{value:.0f} {name}".rstrip() if 1000.0 <= abs(value) < 1e6 else f"{value:.3g} {name}".rstrip()


def nearest(ratio: float, known: tuple[float, ...], within: float) -> float | None:
    """The factor of ``known``, or the inverse of one, that is within a relative distance ``within`` of ``ratio``, or
    None."""
    if not (np.isfinite(ratio) and ratio > 0.0):
        return None
    candidates = [factor for each in known for factor in (each, 1.0 / each)]
    best = min(candidates, key=lambda factor: abs(np.log(ratio / factor)))
    return best if abs(np.log(ratio / best)) <= np.log1p(within) else None


@dataclass(frozen=True, eq=False)
class RecordingSummary:
    """Quantities of the first insertion of a recording.

    ``speed`` [m/s] is the median of the insertion stroke, ``travel`` [m] its length, ``end_depth`` [m] where it ends in
    the recording's own zero, ``beyond_contact`` [m] its part below the contact (NaN without a contact), ``hold`` [s]
    the duration of the hold. Forces [N] are relative to the start: ``peak`` is the maximum, ``end`` the force at the
    end of the insertion stroke, ``push`` and ``pull`` the means of insertion and withdrawal. ``before`` and ``after``
    are the baselines [N], ``noise`` the standard deviation in the free travel. ``flat`` is the number of samples of a
    saturated part, 0 if there is none, and ``flat_ends`` the sample after it. ``gap`` [s] is the longest step of time,
    ``step`` [s] the median, ``lost`` the share of missing samples. ``drop_samples`` is the number of samples of the
    first puncture's drop from 10 % to 90 %. ``curve`` (m,) [N] is the loading curve from the start of the stroke, since
    the position of the tissue distinguishes specimens, ``from_contact`` (m,) [N] the one from the contact.
    """

    speed: float
    travel: float
    end_depth: float
    beyond_contact: float
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
    drop_samples: float
    shown: Trace
    curve: np.ndarray = field(default_factory=lambda: np.empty(0))
    from_contact: np.ndarray = field(default_factory=lambda: np.empty(0))

    @property
    def drift(self) -> float:
        """The change of the baseline [N]; NaN if one of the two baselines is unknown."""
        return self.after - self.before

    def quantities(self) -> dict[str, Estimate]:
        """The quantities for the table."""
        named = {"speed": self.speed, "travel": self.travel, "hold": self.hold, "peak_force": self.peak,
                 "drift": self.drift, "longest_gap": self.gap}  # fmt: skip
        return {name: _measured(name, value, UNITS[name]) for name, value in named.items() if np.isfinite(value)}


def summarise(recording: Recording, events: Events, usual: float | None) -> RecordingSummary | None:
    """Summarise the first insertion of a recording; None if the needle does not move inwards.

    ``usual`` is the contact depth [m] of its repeats, used for a recording without contact.
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
        end_depth=float(depth[cycle.stop - 1]),
        beyond_contact=float(depth[cycle.stop - 1] - surface) if events.contact is not None else np.nan,
        hold=float(time[cycle.withdrawal_start - 1] - time[cycle.stop]) if cycle.withdrawal_start > cycle.stop else 0.0,
        **_forces(force, cycle),
        **_baselines(depth, force, cycle, surface),
        **_flat_top(depth, force, cycle),
        **_steps(time),
        drop_samples=_drop_samples(recording, events),
        shown=trace(depth, force, surface),
        curve=loading(depth[inwards], force[inwards], float(depth[cycle.start])),
        from_contact=loading(depth[inwards], force[inwards], surface),
    )


def event_quantities(recording: Recording, events: Events) -> dict[str, Estimate]:
    """Contact, punctures and exit as rows of the table, with the depths that bound each of them."""
    depth = recording.depth
    named = [("contact", events.contact), ("exit", events.exit)]
    named += [(f"puncture_{k}", puncture) for k, puncture in enumerate(events.punctures, 1)]
    found = [Estimate("event_punctures", float(len(events.punctures)), "1", np.nan, np.nan, source="measured")]
    for name, event in named:
        if event is not None:
            ends = sorted((float(depth[event.low]), float(depth[event.high])))
            found.append(Estimate(f"event_{name}_depth", event.depth, "m", *ends, source="measured"))
    for k, puncture in enumerate(events.punctures, 1):
        found.append(_measured(f"event_puncture_{k}_force", puncture.force, "N"))
        found.append(_measured(f"event_puncture_{k}_indentation", puncture.indentation, "m"))
    return {each.name: each for each in found}


def _measured(name: str, value: float, unit: str) -> Estimate:
    return Estimate(name, float(value), unit, np.nan, np.nan, source="measured")


def _forces(force: np.ndarray, cycle: Cycle) -> dict[str, float]:
    """Forces relative to the start; ``pull`` is NaN without a withdrawal."""
    level = force - float(np.median(force[: max(cycle.start, MIN_BASELINE_SAMPLES)]))
    inwards, outwards = level[cycle.start : cycle.stop], level[cycle.withdrawal_start : cycle.end]
    return {
        "peak": float(np.abs(level[cycle.start : cycle.withdrawal_start]).max()),
        "end": float(np.median(inwards[-MIN_BASELINE_SAMPLES:])),
        "push": float(inwards.mean()),
        "pull": float(outwards.mean()) if cycle.withdrawn else np.nan,
    }


def _baselines(depth: np.ndarray, force: np.ndarray, cycle: Cycle, surface: float) -> dict[str, float]:
    """The force in the free travel before and after, and its noise; NaN if there are too few samples."""
    free = depth < depth[cycle.start] + FREE_TRAVEL_SHARE * (surface - depth[cycle.start])
    first, last = (force[part][free[part]] for part in (slice(cycle.stop), slice(cycle.withdrawal_start, cycle.end)))
    enough, back = len(first) >= MIN_BASELINE_SAMPLES, cycle.withdrawn and len(last) >= MIN_BASELINE_SAMPLES
    return {
        "before": float(np.median(first)) if enough else np.nan,
        "after": float(np.median(last)) if back else np.nan,
        "noise": float(first.std()) if enough else np.nan,
    }


def _flat_top(depth: np.ndarray, force: np.ndarray, cycle: Cycle) -> dict[str, int]:
    """The length of the longest run of samples at the maximum force of the moving insertion stroke, and the sample
    after it."""
    part, moves = force[cycle.start : cycle.stop], np.abs(np.diff(depth[cycle.start : cycle.stop])) > 0.0
    same = np.concatenate(([False], (part[1:] == part[:-1]) & moves, [False]))
    edges = np.flatnonzero(np.diff(same.astype(int)))
    firsts, ends = edges[::2], edges[1::2]
    away = np.abs(part - np.median(force[: max(cycle.start, MIN_BASELINE_SAMPLES)]))
    lengths, at_top = ends - firsts + 1, (part[firsts] == part[away.argmax()]) & (away.max() > 0.0)
    usual = int(lengths[~at_top].max(initial=1))
    if not at_top.any() or lengths[at_top].max() < max(MIN_FLAT_SAMPLES, MIN_FLAT_RATIO * usual):
        return {"flat": 0, "flat_ends": 0}
    longest = int(np.argmax(np.where(at_top, lengths, 0)))
    return {"flat": int(lengths[longest]), "flat_ends": int(cycle.start + ends[longest] + 1)}


def _steps(time: np.ndarray) -> dict[str, float]:
    """The longest and the median step, and the share of missing samples relative to uniform median steps."""
    steps = np.diff(time)
    step = float(np.median(steps))
    missing = float((np.round(steps[steps > 1.5 * step] / step) - 1.0).sum())
    return {"gap": float(steps.max()), "step": step, "lost": missing / (len(steps) + missing)}


def _drop_samples(recording: Recording, events: Events) -> float:
    """Samples from 10 % to 90 % of the first puncture's drop; NaN without a puncture."""
    if not events.punctures:
        return np.nan
    puncture = events.punctures[0]
    after = recording.force[int(np.searchsorted(recording.time, puncture.time)) :]
    past = [np.flatnonzero(after < puncture.force - share * puncture.drop) for share in (0.1, 0.9)]
    return float(past[1][0] - past[0][0]) if len(past[0]) and len(past[1]) else np.nan


def trace(depth: np.ndarray, force: np.ndarray, surface: float) -> Trace:
    """Reduce (n,) ``depth`` [m] and ``force`` [N] to the extremes in blocks of equal travel, which keeps peaks and
    drops."""
    travel = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(depth)))))
    edges = np.searchsorted(travel, np.linspace(0.0, travel[-1], N_DRAWN_BLOCKS + 1)[1:-1])
    edges = np.unique(np.concatenate(([0], edges, [len(depth)])))
    keep = [0, len(depth) - 1]
    for first, last in pairwise(edges):
        part = force[first:last]
        keep += [first + int(part.argmin()), first + int(part.argmax())]
    keep = np.unique(keep)
    return Trace(depth[keep] - surface, force[keep].copy())


def loading(depth: np.ndarray, force: np.ndarray, origin: float) -> np.ndarray:
    """The force (m,) [N] of an insertion stroke every ``CURVE_STEP_M`` from ``origin`` [m] on; empty if too short."""
    travel = np.maximum.accumulate(depth) - origin
    grid = CURVE_STEP_M * np.arange(min(max(int(travel[-1] / CURVE_STEP_M) + 1, 0), MAX_CURVE_POINTS))
    return np.interp(grid, travel, force) if len(grid) >= 20 else np.empty(0)
