# SPDX-License-Identifier: Apache-2.0
"""Selection of the number of layers and of the mechanisms that the recordings support, and the comparison of layers
with one layer over insertion and withdrawal."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..one_layer.segmented_recording import SegmentedRecording
from ..recording_fit import RecordingFit
from ..result import Fit
from ..statistics.noise import noise_of
from ..statistics.regression import VERY_STRONG_BIC, bic_gain, criterion, independent_samples, misfit_gain
from .binned_cycle import BIN_ERROR, BinnedCycle
from .parameters import (
    NO_RELAXATION,
    NO_SATURATION,
    PER_LAYER,
    RUPTURE_LENGTH,
    SATURATION,
    SHARP_RUPTURE,
    LayeredParameters,
    prefix,
)
from .prediction import expectation
from .problem import REFUSED_RESIDUAL
from .search import Solved, again, at_runs, with_saturation

MAX_ERROR_RATIO = 1.02  # over the smallest error: a smaller difference matters to nobody
MIN_HOLD_BINS, MAX_T = 6, 3.6  # Student's quantile of 0.1 % with 20 degrees of freedom
HELD_OUT_STEPS = 25  # of the fit to the other repeats, which starts at the fit to all
MIN_REPEATS = 3  # for a selection by held-out repeats, and for a scatter between repeats
MIN_LINE = 10  # samples of a stroke, for a line of its own


@dataclass(frozen=True, eq=False, kw_only=True)
class Candidate:
    """One choice of layers and mechanisms: number of fitted ``parameters``, ``residual`` rms over the peak.

    ``bic`` is Schwarz's criterion over the complete cycles, correlated samples counted as one; ``held_out`` the rms
    error over the peak on each repeat (n,) predicted from the ``others``, the fits without it; empty with fewer than
    three.
    """

    name: str
    solved: Solved
    parameters: int
    residual: float
    bic: float
    held_out: np.ndarray
    others: tuple[Solved, ...]

    @property
    def error(self) -> float:
        """Geometric mean over the held-out repeats, robust to one anomalous repeat; NaN without them."""
        return float(np.exp(np.mean(np.log(self.held_out)))) if len(self.held_out) else float("nan")


def candidate(name: str, solved: Solved) -> Candidate:
    """Number of parameters, residual and prediction errors of one fit; ``with_bic`` adds the BIC."""
    count = len(solved.problem.cycles)
    others = tuple(without_run(solved, run) for run in range(count)) if count >= MIN_REPEATS else ()
    errors = [prediction_error(other, cycle) for other, cycle in zip(others, solved.problem.cycles)]
    return Candidate(
        name=name,
        solved=solved,
        parameters=len(solved.problem.unknowns.free),
        residual=solved.residual,
        bic=float("nan"),
        held_out=np.array(errors),
        others=others,
    )


def without_run(solved: Solved, run: int) -> Solved:
    """The fit to the other repeats, started at the fit to all."""
    unknowns, cycles = solved.problem.unknowns, solved.problem.cycles
    others = [k for k in range(len(cycles)) if k != run]
    less = replace(unknowns, runs=len(others))
    problem = replace(solved.problem, cycles=tuple(cycles[k] for k in others), unknowns=less)
    return Solved(problem, *problem.solve(at_runs(solved, others), HELD_OUT_STEPS))


def prediction_error(solved: Solved, cycle: BinnedCycle) -> float:
    """Rms error over the scale of the expected force on a held-out cycle."""
    factor = solved.problem.speed_factor(cycle, solved.x)
    force = expectation(solved).force((cycle.depth, cycle.dt), factor=factor)
    error = (force - cycle.force) * cycle.weight
    return float(np.sqrt(np.nan_to_num(error @ error, nan=REFUSED_RESIDUAL)))


def with_bic(candidates: list[Candidate]) -> list[Candidate]:
    """The candidates with their BIC, all with the number of independent samples of the best fit's residual."""
    smallest = min(candidates, key=lambda each: each.residual)
    samples = sum(_independent(smallest.solved, run) for run in range(len(smallest.solved.problem.cycles)))
    return [replace(each, bic=criterion(each.residual**2, each.parameters, samples)) for each in candidates]


def _independent(solved: Solved, run: int) -> float:
    noise = noise_of(solved.problem.residuals(run, solved.x), len(solved.problem.cycles[run].depth))
    return independent_samples([noise])


def fewest_layers(candidates: list[Candidate]) -> Candidate:
    """The fit with the fewest layers of those that are as good as the best; where some leave no more than the noise,
    of these alone: the scatter of the ruptures may hide a layer from the prediction of held-out repeats."""
    left = [each for each in candidates if each.solved.explained] or candidates
    best = min(left, key=_merit)
    return min((each for each in left if as_good(each, best)), key=lambda each: (each.parameters, _merit(each)))


def fewest_mechanisms(complete: Candidate, reduced: list[Candidate]) -> Candidate:
    """The fit with the fewest parameters of ``complete`` and those reduced ones that are as good, and against which the
    residual of the recordings is no very strong evidence. Relaxation stays where the force falls at rest."""
    unknowns, shown = complete.solved.problem.unknowns, any(map(relaxes, complete.solved.problem.cycles))
    kept = [
        each
        for each in reduced
        if as_good(each, complete)
        and each.bic - complete.bic < VERY_STRONG_BIC
        and not (shown and unknowns.relaxing in each.solved.problem.unknowns.held)
    ]
    return min([complete, *kept], key=lambda each: (each.parameters, _merit(each)))


def as_good(one: Candidate, best: Candidate) -> bool:
    """True if ``one`` predicts held-out repeats as well as ``best``.

    The error is larger by no more than 2 %, or by no more than the standard error of the difference. Without held-out
    repeats: the BIC is larger by no more than 10.
    """
    if not (len(one.held_out) and len(best.held_out)):
        return bool(one.bic - best.bic < VERY_STRONG_BIC)
    return predicts_as_well(one.held_out, best.held_out)


def predicts_as_well(one: np.ndarray, best: np.ndarray) -> bool:
    """The same of errors on held-out repeats (n,) over the peak."""
    ratio = np.log(np.hypot(one, BIN_ERROR) / np.hypot(best, BIN_ERROR))
    return bool(ratio.mean() <= max(np.log(MAX_ERROR_RATIO), ratio.std(ddof=1) / np.sqrt(len(ratio))))


def _merit(each: Candidate) -> float:
    """The smaller the better: error on held-out repeats, or the BIC without them."""
    return each.error if len(each.held_out) else each.bic


def removable(unknowns: LayeredParameters) -> dict[str, dict[int, float]]:
    """Mechanisms that can be removed: the name, and the indices in x with the values that remove it."""
    first = PER_LAYER * np.arange(unknowns.layers)
    found = {
        "sharp rupture": dict.fromkeys(first + RUPTURE_LENGTH, SHARP_RUPTURE),
        "no saturation": dict.fromkeys(first + SATURATION, NO_SATURATION),
        "no relaxation": {unknowns.relaxing: NO_RELAXATION, unknowns.relaxing + 1: 0.0},
    }
    common = {"no dependence on speed": unknowns.speed, "the same friction in both directions": unknowns.withdrawal}
    return found | {name: {place: 0.0} for name, place in common.items() if place not in unknowns.held}


def undecided_saturations(found: Solved) -> frozenset[str]:
    """Names of saturation depths in the model against whose absence the residual is no very strong evidence, by the
    BIC: an interval about one minimum does not contain the other."""
    unknowns, undecided = found.problem.unknowns, set()
    samples = sum(_independent(found, run) for run in range(len(found.problem.cycles)))
    for layer in range(unknowns.layers):
        place = PER_LAYER * layer + SATURATION
        if place in unknowns.held:
            continue
        ratio = without(found, {place: NO_SATURATION}).residual / found.residual
        if bic_gain(1.0, ratio**2, 1, samples) < VERY_STRONG_BIC:
            undecided.add(f"{prefix(layer)}saturation_depth")
    return frozenset(undecided)


def relaxes(cycle: BinnedCycle) -> bool:
    """True if the force falls over the hold: the slope of a line over the bins, by Student's t (one-sided, 0.1 %)."""
    force = cycle.force[cycle.stroke == 1]
    count = len(force)
    if count < MIN_HOLD_BINS:
        return False
    place = np.arange(count) - 0.5 * (count - 1)
    slope = place @ force / (place @ place)
    residual = force - force.mean() - slope * place
    error = np.sqrt(residual @ residual / (count - 2) / (place @ place))
    return bool(-slope > MAX_T * error)


def without(solved: Solved, values: dict[int, float]) -> Solved:
    """The fit with parameters held at values. A contact that no longer saturates starts with the same force at its
    rupture."""
    x, unknowns = solved.x.copy(), solved.problem.unknowns
    for k in (k for k in values if k < unknowns.relaxing and k % PER_LAYER == SATURATION):
        x = with_saturation(unknowns, x, k // PER_LAYER, NO_SATURATION)
    x[list(values)] = list(values.values())
    return again(solved, x, unknowns=replace(unknowns, held=unknowns.held | frozenset(map(int, values))))


@dataclass(frozen=True, kw_only=True)
class StrokeEvidence:
    """Errors of one layer and of the layered model over insertion and withdrawal, rms over the peak, whether they are
    those on ``held_out`` repeats, and whether they are evidence ``for_layers``."""

    one_layer: float
    layered: float
    held_out: bool
    for_layers: bool

    def sentence(self, law: str, layers: int) -> str:
        """The comparison of one layer of a ``law`` with so many ``layers``, in words."""
        error = "error on held-out repeats" if self.held_out else "residual"
        compared = (
            f"Compared with one layer ({law}), over insertion and withdrawal its {error} is {100 * self.one_layer:.2g} "
            f"% of the peak and that of layers {100 * self.layered:.2g} %: "
        )
        if self.for_layers:
            return f"{compared}the layered law describes these recordings better."
        deeper = " The deeper layers are none of the tissue: none is identified." if layers > 1 else ""
        return f"{compared}one layer describes these recordings as well or better. Give model='{law}'.{deeper}"


def stroke_evidence(
    one: Fit, layered: Fit, held_out: tuple[np.ndarray, ...], singles: list[SegmentedRecording]
) -> StrokeEvidence | None:
    """The evidence of the recordings that both models describe, over the strokes that both describe; None without one.
    ``held_out`` is the layered model's force [N] for each recording that it was not given, if there are repeats.

    A force that relaxes at rest is no evidence for layers, and so the hold is left out. Layers have a friction of their
    own in each direction, a surface from which it counts, and no cutting force; one layer is given a line in each
    stroke. Layers are needed where a typical recording alone shows it, on very strong evidence, correlated samples
    counted as one, and, with three repeats or more, where they predict held-out ones better.
    """
    described = [each for each in zip(one.recordings, layered.recordings, singles) if len(each[1].residuals)]
    forces = held_out if len(held_out) == len(described) else (None,) * len(described)
    found = [(_Compared.made(*each), force) for each, force in zip(described, forces) if len(each[0].residuals)]
    both = [each for each, _ in found]
    if not both:
        return None
    shown = float(np.mean([each.gain(len(layered.parameters)) for each in both])) > VERY_STRONG_BIC
    predicted = len(both) >= MIN_REPEATS and all(force is not None for _, force in found)
    errors = [each.held_out([*both[:k], *both[k + 1 :]], force) for k, (each, force) in enumerate(found) if predicted]
    predicted = predicted and None not in errors
    errors = errors if predicted else [each.residuals for each in both]
    ours, theirs = np.array(errors).T
    needed = shown and not (predicted and predicts_as_well(ours, theirs))
    first, second = (float(np.exp(np.log(each).mean())) for each in (ours, theirs))
    return StrokeEvidence(one_layer=first, layered=second, held_out=predicted, for_layers=needed)


class _Stroke(NamedTuple):
    """Depth (m,) [m] of a stroke, and the forces [N] without the zero: measured, as each model has its zero, of one
    layer with a line behind its puncture, and of the layered model; ``samples`` are its numbers in the recording."""

    samples: np.ndarray
    depth: np.ndarray
    measured: tuple[np.ndarray, np.ndarray]
    modelled: tuple[np.ndarray, np.ndarray]

    @property
    def left(self) -> tuple[np.ndarray, np.ndarray]:
        """What each model leaves."""
        return self.measured[0] - self.modelled[0], self.measured[1] - self.modelled[1]


@dataclass(frozen=True, eq=False, kw_only=True)
class _Compared:
    """The strokes of one recording under both models, its peak [N], and how many more parameters the layered model has
    for it alone."""

    strokes: tuple[_Stroke, ...]
    peak: float
    more: int

    @staticmethod
    def made(one: RecordingFit, layered: RecordingFit, single: SegmentedRecording) -> "_Compared":
        """From the two fits of a recording."""
        own, force, drift = single.strokes, single.recording.force, single.drift.at(single.recording)
        ends = (own.index_in, own.depth_in, "puncture_depth"), (own.index_out, own.depth_out, "contact_depth")
        strokes = []
        for samples, depth, end in ends:
            if not len(samples):
                continue
            zeros = [each.parameters["force_offset"].value + drift[samples] for each in (one, layered)]
            straight, behind = one.predicted[samples].copy(), depth > one.parameters[end].value
            if np.count_nonzero(behind) >= MIN_LINE:
                left, z = (force[samples] - straight)[behind], depth[behind]
                design = np.column_stack([z - z.mean(), np.ones_like(z)])  # of one depth: their mean
                straight[behind] += design @ np.linalg.lstsq(design, left, rcond=None)[0]
            measured = force[samples] - zeros[0], force[samples] - zeros[1]
            modelled = straight - zeros[0], layered.predicted[samples] - zeros[1]
            strokes.append(_Stroke(samples, depth, measured, modelled))
        more = len(layered.parameters) - len(one.parameters) - 2 * len(strokes)
        return _Compared(strokes=tuple(strokes), peak=float(force.max()), more=more)

    def gain(self, shared: int) -> float:
        """By how much the BIC of the layered model is lower, with its ``shared`` parameters."""
        noises = [[noise_of(left, len(left)) for left in each.left] for each in self.strokes]
        samples = sum(independent_samples(each) for each in noises)
        return sum(misfit_gain(two, one) for one, two in noises) - (shared + self.more) * float(np.log(samples))

    @property
    def residuals(self) -> tuple[float, float]:
        """Rms over the peak of what each model leaves."""
        return self._rms([each.left for each in self.strokes])

    def held_out(self, others: list["_Compared"], layered: np.ndarray) -> tuple[float, float] | None:
        """Rms errors over the peak: of the mean of the ``others``' one layer at the same depth, and of the ``layered``
        force (n,) [N] that is predicted from them. None where the others have no depth in common with it."""
        left = []
        for k, stroke in enumerate(self.strokes):
            found = [other.strokes[k] for other in others if len(other.strokes) > k]
            known = stroke.depth <= min((float(each.depth.max()) for each in found), default=-np.inf)
            if known.any():
                mean = np.mean([_at(stroke.depth[known], each.depth, each.modelled[0]) for each in found], axis=0)
                ours = stroke.measured[0][known] - mean
                left.append((ours, (stroke.measured[1] - layered[stroke.samples])[known]))
        return self._rms(left) if left else None

    def _rms(self, left: list) -> tuple[float, float]:
        one, layered = (np.concatenate(each) / self.peak for each in zip(*left))
        return float(np.sqrt(np.mean(one**2))), float(np.sqrt(np.mean(layered**2)))


def _at(depth: np.ndarray, places: np.ndarray, force: np.ndarray) -> np.ndarray:
    """A force (m,) at ``places`` (m,) interpolated at a ``depth`` (n,)."""
    order = np.argsort(places, kind="stable")
    return np.interp(depth, places[order], force[order])
