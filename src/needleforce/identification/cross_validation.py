# SPDX-License-Identifier: Apache-2.0
"""Each repeat predicted from the others, compared with the repeatability floor of the experiment."""

import dataclasses
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from .one_layer.segmented_recording import SegmentedRecording
from .result import Fit
from .statistics.noise import student_quantile
from .strokes import STROKES, cycle_span, stroke_speed

DEPTH_TOLERANCE = 0.02  # [of the deepest point] beyond, it is another motion
SPEED_TOLERANCE = 0.15  # [of the mean speed of the insertion]
MIN_OTHERS = 2  # repeats of the same motion, for a mean


@dataclass(frozen=True, eq=False, kw_only=True)
class HeldOut:
    """One repeat and what the others say of it: samples (n,) of depth [m] and of the force [N] that was measured, that
    a fit to the others predicts, and the mean of the others."""

    file: str
    depth: np.ndarray
    measured: np.ndarray
    predicted: np.ndarray
    others: np.ndarray


@dataclass(frozen=True, eq=False)
class CrossValidation:
    """Rms errors on held-out repeats over the peak force.

    Attributes
    ----------
    prediction : numpy.ndarray
        Errors (repeats, 4) [1] with the mean puncture depths of the fit, of the complete cycle, insertion, hold and
        withdrawal; NaN without a prediction.
    replay : numpy.ndarray
        The same with the depths and forces of the punctures of the held-out repeat.
    floor : numpy.ndarray
        The same of the mean of the other repeats, the repeatability floor.
    refused : tuple of str
        A sentence with the reason for each repeat that the model cannot predict.
    shown : HeldOut or None
        The repeat whose floor is the median, if the model predicts it.
    """

    prediction: np.ndarray
    replay: np.ndarray
    floor: np.ndarray
    refused: tuple[str, ...] = ()
    shown: HeldOut | None = None

    def over_floor(self, errors: np.ndarray) -> np.ndarray:
        """Rms of the errors divided by that of the floor, (4,), over the repeats that have both."""
        both = np.isfinite(errors) & np.isfinite(self.floor)
        squares = [np.where(both, values, 0.0) ** 2 for values in (errors, self.floor)]
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.sqrt(squares[0].sum(axis=0) / squares[1].sum(axis=0))

    def dots(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Errors of prediction, replay and floor over the rms of the floor, complete cycle, for each repeat that has
        all; the rms of the first two are those of ``over_floor``."""
        errors = np.stack([self.prediction[:, 0], self.replay[:, 0], self.floor[:, 0]])
        errors = errors[:, np.isfinite(errors).all(axis=0)]
        prediction, replay, floor = errors / np.sqrt(np.mean(errors[2] ** 2)) if errors.size else errors
        return prediction, replay, floor

    def distinguishes(self, other: "CrossValidation") -> bool:
        """True if the ratio of the prediction errors differs from 1, by Student's t on its logarithm."""
        difference = np.log(self.prediction[:, 0] / other.prediction[:, 0])
        difference = difference[np.isfinite(difference)]
        if len(difference) < 2:
            return False
        error = difference.std(ddof=1) / np.sqrt(len(difference))
        return bool(abs(difference.mean()) > student_quantile(len(difference) - 1) * error)


def cross_validate(
    singles: list[SegmentedRecording],
    identified: Callable[[list[SegmentedRecording]], Fit],
    watched: Callable[[list[int]], Iterable[int]] = iter,
) -> CrossValidation:
    """Leave out each of the recordings in turn; ``identified`` makes a fit from the others, without a warm start.

    Recordings without contact are ignored. ``watched(list)`` may show progress.
    """
    usable = [single for single in singles if single.events.contact is not None]
    cycles = [measured_cycle(single) for single in usable]
    refused: list[str] = []
    means = [mean_of_others(cycles, k) for k in range(len(usable))]
    floors = np.array([cycle.errors(mean) for cycle, mean in zip(cycles, means)]).reshape(len(usable), 4)
    rows, drawn = [], np.argsort(floors[:, 0])[(np.isfinite(floors[:, 0]).sum() - 1) // 2] if len(usable) else 0
    shown = None
    for k in watched(list(range(len(usable)))):
        forces = _predicted(usable, cycles[k], k, identified, refused)
        rows.append([cycles[k].errors(force) for force in forces])
        if k == drawn and np.isfinite([forces[0], means[k]]).all():
            one = {"depth": cycles[k].depth, "measured": cycles[k].force, "predicted": forces[0], "others": means[k]}
            shown = HeldOut(file=usable[k].recording.card.source, **one)
    prediction, replay = np.array(rows).reshape(len(rows), 2, 4).transpose(1, 0, 2)
    return CrossValidation(prediction, replay, floors, tuple(refused), shown)


@dataclass(frozen=True, eq=False, kw_only=True)
class MeasuredCycle:
    """One recording's cycle: samples (n,) of time [s], depth [m], force [N] and index of the stroke."""

    span: slice
    time: np.ndarray
    depth: np.ndarray
    force: np.ndarray
    stroke: np.ndarray

    @property
    def peak(self) -> float:
        """Largest force [N]."""
        return float(np.abs(self.force).max())

    @property
    def speed(self) -> float:
        """Mean speed of the insertion [m/s]."""
        inwards = self.stroke == 0
        return stroke_speed(self.time[inwards], self.depth[inwards])

    def errors(self, predicted: np.ndarray) -> np.ndarray:
        """Rms error over the peak of a force (n,) [N]: complete cycle, insertion, hold, withdrawal; NaN for a missing
        stroke."""
        squares = ((predicted - self.force) / self.peak) ** 2
        parts = [squares[self.stroke == k] for k in range(len(STROKES))]
        return np.sqrt([part.mean() if len(part) else np.nan for part in (squares, *parts)])


def _predicted(
    usable: list[SegmentedRecording],
    cycle: MeasuredCycle,
    k: int,
    identified: Callable[[list[SegmentedRecording]], Fit],
    refused: list[str],
) -> list[np.ndarray]:
    """Forces (n,) [N] of a cycle as predicted and as replayed, NaN without a prediction, whose reason is added to
    ``refused``."""
    others = identified(usable[:k] + usable[k + 1 :]) if len(usable) > 1 else None
    if others is None or others.identified_model is None:
        return [np.full(len(cycle.force), np.nan)] * 2
    left = usable[k]
    # a replay uses the punctures of the repeat, but neither its contact nor its exit
    events = dataclasses.replace(left.events, contact=None, exit=None)
    try:
        forces = others.predict(left.recording), others.predict(left.recording, events=events)
    except InputError as error:
        refused.append(f"{left.recording.card.source}: the fit to the other repeats does not predict it: {error}")
        return [np.full(len(cycle.force), np.nan)] * 2
    return [force[cycle.span] for force in forces]


def measured_cycle(single: SegmentedRecording) -> MeasuredCycle:
    """The first cycle with contact."""
    span, stroke = cycle_span(single.strokes, single.events)
    recording = single.recording
    return MeasuredCycle(
        span=span,
        time=recording.time[span],
        depth=recording.depth[span],
        force=recording.force[span],
        stroke=stroke,
    )


def mean_of_others(cycles: list[MeasuredCycle], left: int) -> np.ndarray:
    """Mean force (n,) [N] of the other repeats of the same motion at the samples of one, by depth in the strokes, by
    time in the hold; NaN with fewer than two such repeats."""
    own = cycles[left]
    others = [cycle for k, cycle in enumerate(cycles) if k != left and same_motion(own, cycle)]
    if len(others) < MIN_OTHERS:
        return np.full(len(own.force), np.nan)
    return np.mean([_at(own, other) for other in others], axis=0)


def same_motion(one: MeasuredCycle, other: MeasuredCycle) -> bool:
    """True if both have the same depth, speed and strokes, within the tolerances."""
    deep = abs(one.depth.max() - other.depth.max()) <= DEPTH_TOLERANCE * one.depth.max()
    fast = abs(one.speed - other.speed) <= SPEED_TOLERANCE * one.speed
    return bool(deep and fast and set(one.stroke) == set(other.stroke))


def _at(own: MeasuredCycle, other: MeasuredCycle) -> np.ndarray:
    """Force of another repeat at the depths of this one, in the hold at its times."""
    found = np.empty(len(own.force))
    for k in range(len(STROKES)):
        here, there = own.stroke == k, other.stroke == k
        if not here.any():
            continue
        place, places = (own.depth[here], other.depth[there]) if k != 1 else _since(own.time[here], other.time[there])
        order = np.argsort(places, kind="stable")
        found[here] = np.interp(place, places[order], other.force[there][order])
    return found


def _since(time: np.ndarray, others: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return time - time[0], others - others[0]
