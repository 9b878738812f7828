# SPDX-License-Identifier: Apache-2.0
"""The fit of layers that rupture one after another to one insertion: values and intervals.

The intervals hold what the noise allows, and what an insertion does not show: the law of the contacts (a second fit has
power laws), the shares of friction and cutting force (fits without either, unless the evidence against it is very
strong), where below the force of the layer before a contact begins, and where on a flat peak the puncture is.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from ...errors import InputError
from ...models.model import Insertion, Model
from ..one_layer.segmented_recording import SegmentedRecording
from ..replay import punctures_of_layers
from ..statistics.noise import TWO_SIDED, Noise, noise_of
from ..statistics.regression import VERY_STRONG_BIC, bic_gain, independent_samples, misfit_gain
from .insertion_problem import POWER_LAW, SIZE, STEP_S, UNDETERMINED, InsertionProblem, Scaled, problem_of, stacked
from .parameters import prefix

DERIVATIVE_STEP = 1e-5  # of the scaled parameters
PEAK_GRID = 4000  # depths at which the peaks of the model are searched
AT_LIMIT = 1e-3  # of a scaled parameter from its limit: held there
IN_ZERO = "contact_depth", "puncture_depth", "force_offset"
"""Endings of the names of what may be negative."""


@dataclass(frozen=True, eq=False, kw_only=True)
class InsertionFit:
    """The layers of one insertion: ``values`` by name with the limits of their intervals, the half widths that are
    ``random``, by how much independent normal numbers ``spread`` (m,) each value, and the ``noise`` of the residual."""

    problem: InsertionProblem
    x: np.ndarray
    values: dict[str, float]
    low: dict[str, float]
    high: dict[str, float]
    random: dict[str, float]
    spread: dict[str, np.ndarray]
    noise: Noise

    def systematic(self, name: str) -> tuple[float, float]:
        """How much farther the interval reaches below and above the value than the noise alone: what an insertion does
        not show is common to repeats."""
        value, half = self.values[name], self.random[name]
        if not math.isfinite(half):
            return 0.0, 0.0
        return max(value - half - self.low[name], 0.0), max(self.high[name] - value - half, 0.0)

    @property
    def layers(self) -> int:
        """How many."""
        return len(self.problem.peaks)

    def standard(self, count: int, random: np.random.Generator) -> dict[str, np.ndarray]:
        """Normal numbers (count,) of variance 1 for each value that the noise moves, correlated as the values are."""
        normal = random.standard_normal((count, len(next(iter(self.spread.values())))))
        sizes = {name: float(np.linalg.norm(each)) for name, each in self.spread.items()}
        return {name: normal @ self.spread[name] / size for name, size in sizes.items() if 0.0 < size < math.inf}


def lowest(name: str) -> float:
    """The least value that a parameter may have."""
    if name.endswith(IN_ZERO):
        return -math.inf
    return 1.0 if name.endswith("rupture_exponent") else 0.0


class InsertionFits:
    """Solutions and fits of insertions with so many layers, each made once: no insertion depends on the others, so that
    several sets of the same recordings may share them."""

    def __init__(self) -> None:
        self.solution, self.fit = cache(_solution), cache(self._fit)

    def _fit(self, single: SegmentedRecording, layers: int) -> InsertionFit:
        """The layers of a recording, those with the largest drops.

        Raises InputError where there are fewer punctures than ``layers``, or too few samples about one.
        """
        problem, x, noise = self.solution(single, layers)
        values, (half, spread) = values_of(problem, x), _half_widths(problem, x, noise)
        found = [
            values,
            *_other_answers(problem, x, noise),
            *_flat(problem, x, noise, values),
            *_hidden(problem, values),
        ]
        found.append(_measured(problem, single, values))
        low, high = {}, {}
        for name in values:
            each = [one[name] for one in found if name in one]
            low[name], high[name] = max(min(each) - half[name], lowest(name)), max(each) + half[name]
        return InsertionFit(
            problem=problem, x=x, values=values, low=low, high=high, random=half, spread=spread, noise=noise
        )

    def needed_layers(self, singles: list[SegmentedRecording], max_layers: int) -> int:
        """How many of up to ``max_layers`` layers the insertions show: the layer with the smallest drop is left out,
        one after another, as long as the evidence for it is not very strong. A false puncture gains no more than noise
        of the same correlation lets its parameters gain; a rupture that is only not sharp is no second layer."""
        return next((count for count in range(max_layers, 1, -1) if self._gain(singles, count) > VERY_STRONG_BIC), 1)

    def _gain(self, singles: list[SegmentedRecording], layers: int) -> float:
        """By how much the BIC of so many layers is lower than that of one layer less, correlated samples counted as
        one."""
        found = []
        for single in (each for each in singles if len(each.events.punctures) >= layers and each.events.contact):
            try:
                more, fewer = (self.solution(single, count)[-1] for count in (layers, layers - 1))
            except InputError:
                continue
            found.append(misfit_gain(more, fewer) - SIZE * math.log(independent_samples([more, fewer])))
        return sum(found) if found else -math.inf


def _other_answers(problem: InsertionProblem, x: np.ndarray, noise: Noise) -> Iterator[dict[str, float]]:
    """The values with power laws for contacts, without friction and without cutting forces, where the insertion is no
    very strong evidence against these."""
    power = replace(problem, curve=POWER_LAW)
    for other in (power, replace(problem, without="friction"), replace(problem, without="cutting")):
        found, left = _solved(other, x if other.without else None)
        samples = independent_samples([noise, left])
        if bic_gain(noise.sse, left.sse, len(problem.peaks) if other.without else 0, samples) < VERY_STRONG_BIC:
            yield values_of(other, found)


def _flat(
    problem: InsertionProblem, x: np.ndarray, noise: Noise, values: dict[str, float]
) -> Iterator[dict[str, float]]:
    """The depths about each peak at which the force is still that of the peak within the noise."""
    force = problem.forces(x, problem.depth)
    for k, (part, peak) in enumerate(zip(problem.parts, problem.peaks)):
        top = float(force[part].max())
        lower = force < top - TWO_SIDED * math.sqrt(noise.variance)
        before, behind = np.flatnonzero(lower[part.start : peak]), np.flatnonzero(lower[peak : part.stop])
        ends = part.start + before[-1:] + 1, peak + behind[:1] - 1
        for depth in (float(problem.depth[each[0]]) for each in ends if len(each)):
            yield _at_depth(values, k, depth)


def _hidden(problem: InsertionProblem, values: dict[str, float]) -> Iterator[dict[str, float]]:
    """A deeper layer whose contact begins as much higher or deeper as it takes to exceed the force before it: a cutting
    force, of an unknown share of that force, hides it until then."""
    for k in range(1, len(problem.peaks)):
        start = prefix(k)
        own = {name.removeprefix(start): each for name, each in values.items() if name.startswith(start)}
        reached = own["puncture_indentation"]
        depth = np.linspace(0.0, reached, 200)
        over = problem.curve.force(depth, own) < problem.force[problem.parts[k].start] - values["force_offset"]
        hidden = float(depth[over][-1]) if over.any() else 0.0
        for other in (min(reached + hidden, 2.0 * reached), max(reached - hidden, 0.5 * reached)):
            moved = {"top": own["top"] + reached - other, "puncture_indentation": other}
            moved["rupture_onset"] = max(own["rupture_onset"] + other - reached, 0.0)
            moved["stiffness_coefficient"] = own["stiffness_coefficient"] * (reached / other) ** 2
            yield {f"{start}{name}": each for name, each in moved.items()}


def _measured(problem: InsertionProblem, single: SegmentedRecording, values: dict[str, float]) -> dict[str, float]:
    """Depth and force of the punctures as segmentation has them, and the indentation with that depth."""
    found: dict[str, float] = {}
    for k, puncture in enumerate(punctures_of_layers(single.events, len(problem.peaks))):
        found |= _at_depth(values, k, puncture.depth)
        found[f"{prefix(k)}puncture_force"] = puncture.force - values["force_offset"]
    return found


def _at_depth(values: dict[str, float], layer: int, depth: float) -> dict[str, float]:
    """The puncture of a layer at another depth [m]."""
    place, indentation = f"{prefix(layer)}puncture_depth", f"{prefix(layer)}puncture_indentation"
    return {place: depth, indentation: values[indentation] + depth - values[place]}


def _solution(single: SegmentedRecording, layers: int) -> tuple[InsertionProblem, np.ndarray, Noise]:
    """Problem, least squares and noise of a recording."""
    problem = problem_of(single, layers)
    return problem, *_solved(problem)


def _solved(problem: InsertionProblem, start: np.ndarray | None = None) -> tuple[np.ndarray, Noise]:
    """The least squares and their noise."""
    x = problem.solve(start)
    residual = problem.force - problem.forces(x, problem.depth)
    return x, noise_of(residual, len(residual), problem.filter_length, float(len(x)))


def _peaks_of(model: Model) -> list[tuple[float, float]]:
    """Depth [m] below the surface and force [N] of the peak of each layer: the largest force from its onset to the top
    of the next, between the depths of a grid."""
    tops = [layer.top for layer in model.layers]
    ends = [*tops[1:], tops[-1] + model.layers[-1].puncture.depth + 3.0 * model.layers[-1].friction.rupture_length]
    depth = np.concatenate([np.linspace(*each, PEAK_GRID, endpoint=False) for each in zip(tops, ends)])
    force = Insertion(model, max_speed=np.inf).forces(depth, np.full(len(depth), STEP_S))
    found = []
    for k, layer in enumerate(model.layers):
        part = slice(k * PEAK_GRID, (k + 1) * PEAK_GRID)
        near = force[part] * (depth[part] >= layer.top + layer.puncture.depth)
        found.append(_vertex(depth[part], force[part], int(np.argmax(near))))
    return found


def _vertex(x: np.ndarray, y: np.ndarray, k: int) -> tuple[float, float]:
    """Place and height of the parabola through the largest value and its neighbours; the value itself at an end."""
    if not 0 < k < len(x) - 1:
        return float(x[k]), float(y[k])
    left, middle, right = y[k - 1 : k + 2]
    bend = left - 2.0 * middle + right
    shift = 0.5 * (left - right) / bend if bend < 0.0 else 0.0
    shift = float(np.clip(shift, -0.5, 0.5))
    return float(x[k] + shift * (x[k + 1] - x[k])), float(middle - 0.25 * (left - right) * shift)


def values_of(problem: InsertionProblem, x: np.ndarray) -> dict[str, float]:
    """Every parameter by name, those of deeper layers with their prefix."""
    layers, surface = list(problem.values_of_layers(x)), problem.surface(x)
    found: dict[str, float] = {}
    for k, (own, (depth, force)) in enumerate(zip(layers, _peaks_of(stacked(layers, problem.curve)))):
        top = own.pop("top")
        own |= {"puncture_depth": surface + depth, "puncture_indentation": depth - top, "puncture_force": force}
        found |= {f"{prefix(k)}top": top} if k else {"contact_depth": surface}
        found |= {f"{prefix(k)}{name}": value for name, value in own.items()}
    return found | {"force_offset": problem.scale * float(x[-1])}


def _half_widths(
    problem: InsertionProblem, x: np.ndarray, noise: Noise
) -> tuple[dict[str, float], dict[str, np.ndarray]]:
    """Half widths of the intervals, by the derivatives of force and values, and the spread (m,) of each value; infinite
    for what the samples do not determine, and the travel of a sample at least for a depth."""
    values, jacobian = values_of(problem, x), problem.slopes(x, problem.depth)
    (low, high), slopes = problem.limits, []
    for k in range(len(x)):
        moved = x.copy()
        moved[k] += DERIVATIVE_STEP if x[k] + DERIVATIVE_STEP < high[k] else -DERIVATIVE_STEP
        other = values_of(problem, moved)
        slopes.append([_difference(other[name], values[name]) / (moved[k] - x[k]) for name in values])
    by = np.array(slopes)
    norm = np.linalg.norm(jacobian, axis=0)
    inside = (x > low + AT_LIMIT) & (x < high - AT_LIMIT)
    usable = (norm > 0.0) & (inside | _one_sided(len(x)))
    _, size, turn = np.linalg.svd(jacobian[:, usable] / norm[usable], full_matrices=False)
    known = size > UNDETERMINED * size[0]
    turn = turn / norm[usable] @ by[usable]
    spread = math.sqrt(noise.long_run) * turn[known] / size[known, None]
    spread[:, np.abs(turn[~known]).sum(axis=0) > 0.0] = np.inf
    travel = float(np.median(np.diff(problem.depth)))
    half = {
        name: math.hypot(TWO_SIDED * each, 0.5 * travel if name.endswith("puncture_depth") else 0.0)
        for name, each in zip(values, np.linalg.norm(spread, axis=0).tolist())
    }
    return half, dict(zip(values, spread.T))


def _one_sided(count: int) -> np.ndarray:
    """True (count,) for the parameters that may be none, and so may be more too: friction and cutting force."""
    names = np.array([*Scaled._fields * ((count - 1) // SIZE), "zero"])
    return np.isin(names, ("friction", "cutting"))


def _difference(one: float, other: float) -> float:
    return one - other if math.isfinite(one) and math.isfinite(other) else 0.0
