# SPDX-License-Identifier: Apache-2.0
"""Layers that rupture one after another, as least squares on one insertion alone, without a withdrawal.

Each has a contact, a cone or a cone + cylinder, that ruptures gradually from its onset on, and behind it friction and
cutting force (law ``yielding_coulomb``). The force is that of the engine along the insertion. Least squares have all
parameters at once; they start with each layer as its peak shows it, between the least forces before and behind it.
"""

import itertools
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ... import core
from ...core import Needle
from ...errors import InputError
from ...models.model import Layer, Model
from ..models import UNKNOWN_TIP, half_angle
from ..one_layer.loading_curves import FITS, LoadingCurve
from ..one_layer.segmented_recording import SegmentedRecording, without_drift
from ..replay import MIN_TOP_M, punctures_of_layers
from ..strokes import strokes_of

CONE_CYLINDER, POWER_LAW = FITS["gradual_cone_cylinder"], FITS["gradual_power_law"]
MAX_LAYERS = 8  # of the engine
MIN_SAMPLES = 12  # between the least forces before and behind a peak, for the parameters of its layer
MAX_BLOCKS = 800  # means of samples on which the search works
RISE_SHARE = 0.05  # of a peak above the least force before it: where the contact of a layer is to begin, to start with
STEP_S = 1e-3  # [s] from sample to sample: the laws do not depend on the speed
STEP_M = 20e-6  # [m] over which friction reverses, which an insertion does not show
START, START_POWER = (0.7, 0.5, 0.7), (0.7, 0.5, 2.0)
"""Onset and rupture length [indentations at the peak], and saturation depth [onsets] or exponent, of a start."""
EXPONENT = 2.0  # of a rupture, to start with
MAX_STEPS = 100  # of the least squares
NO_SATURATION = 3.0  # [indentations at the onset] from here on, the contact is a cone
UNDETERMINED = 1e-6  # of the largest derivative: a parameter, or a combination, that changes nothing
MIN_LEFT = 1e-3  # [of the largest force] of a contact that ruptures
STIFFEST = 0.6 * next(row["high"] for row in core.laws.Cone.table() if row["name"] == "reduced_modulus")
"""[N/m^2] of c h^2 with the largest modulus of the law and an unknown tip, 2 / pi of it: no contact is stiffer."""


class Scaled(NamedTuple):
    """One layer in the search: its top from the contact and its lengths in units of its indentation at the peak, forces
    in units of the largest force; those that are positive as logarithms. ``log_left`` is of the contact's force at the
    onset without friction and cutting force there: what ruptures, and so positive; ``log_shape`` of the saturation
    depth over the onset, or of the exponent of a power law."""

    top: float
    log_onset: float
    log_length: float
    exponent: float
    log_left: float
    log_shape: float
    friction: float
    cutting: float


SIZE = len(Scaled._fields)
LOWEST = Scaled(
    top=-3.0,
    log_onset=math.log(0.02),
    log_length=math.log(1e-3),
    exponent=1.0,
    log_left=math.log(MIN_LEFT),
    log_shape=math.log(0.05),
    friction=0.0,
    cutting=0.0,
)
HIGHEST = Scaled(
    top=0.0,
    log_onset=math.log(1.2),
    log_length=math.log(10.0),
    exponent=6.0,
    log_left=math.log(20.0),
    log_shape=math.log(NO_SATURATION),
    friction=10.0,
    cutting=3.0,
)
_ANY_SPEED = core.Limits(max_speed=math.inf)
EXPONENTS = 0.0, math.log(6.0)  # limits of the logarithm of that of a power law
SCALED_STEP = 1e-6  # of a scaled parameter, for the derivatives of the laws by it
IN_ENGINE = {
    "top": (5, 0, 1.0),
    "stiffness_coefficient": (0, 0, 0.5 * math.pi),
    "saturation_depth": (0, 2, 2.0 / math.pi),
    "reference_force": (0, 0, 1.0),
    "exponent": (0, 1, 1.0),
    "rupture_onset": (1, 0, 1.0),
    "friction_per_length": (2, 0, 1.0),
    "rupture_length": (2, 2, 1.0),
    "rupture_exponent": (2, 3, 1.0),
    "cutting_force": (3, 0, 1.0),
}
"""Where the engine has a value of a layer: its law, the number of its parameter, and that over the value: a contact is
of the cone of 45 degrees that stands for an unknown tip."""


@dataclass(frozen=True, eq=False, kw_only=True)
class InsertionProblem:
    """The insertion as ``depth`` and ``force`` (n,) in SI with their numbers in the recording, ``samples``, its
    ``peaks`` by their place among them, a ``contact`` depth and the ``zero`` before it, from which the search starts,
    the loading ``curve`` of the contacts, and what they are ``without``: friction, cutting, or nothing."""

    depth: np.ndarray
    force: np.ndarray
    samples: np.ndarray
    peaks: tuple[int, ...]
    contact: float
    zero: float
    filter_length: int
    curve: LoadingCurve = CONE_CYLINDER
    without: str = ""

    @cached_property
    def parts(self) -> tuple[slice, ...]:
        """The samples of each layer, between the least forces before and behind its peak."""
        pairs = itertools.pairwise(self.peaks)
        ends = [first + int(np.argmin(self.force[first:second])) for first, second in pairs]
        return tuple(slice(*each) for each in itertools.pairwise([0, *ends, len(self.depth)]))

    @cached_property
    def begins(self) -> tuple[float, ...]:
        """Depth [m] at which the force of each layer begins to rise to its peak."""
        found = [self.contact]
        for part, peak in zip(self.parts[1:], self.peaks[1:]):
            force = self.force[part.start : peak]
            low = np.flatnonzero(force <= force[0] + RISE_SHARE * (self.force[peak] - force[0]))
            found.append(float(self.depth[part.start + low[-1]]))
        return tuple(found)

    @cached_property
    def units(self) -> tuple[float, ...]:
        """Indentation [m] of each layer at its peak."""
        return tuple(max(float(self.depth[p]) - z, 1e-6) for p, z in zip(self.peaks, self.begins))

    @cached_property
    def scale(self) -> float:
        """The largest force [N]."""
        return float(self.force.max())

    @cached_property
    def limits(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest x. A layer begins below the peak before and above its own; a rupture over less than the
        travel of a sample is sharp."""
        low, high = (np.tile(each, (len(self.peaks), 1)).astype(float) for each in (LOWEST, HIGHEST))
        travel = float(np.median(np.diff(self.depth)))
        for k, unit in enumerate(self.units):
            low[k, 0] = (self.depth[self.peaks[k - 1]] - self.contact) / unit if k else low[k, 0]
            high[k, 0] = (self.depth[self.peaks[k]] - self.contact) / unit - 0.02
            low[k, 2] = min(max(low[k, 2], math.log(travel / unit)), 0.0)
        if "exponent" in self.curve.shape:
            low[:, 5], high[:, 5] = EXPONENTS
        return np.append(low, -1.0), np.append(high, 1.0)

    def surface(self, x: np.ndarray) -> float:
        """Depth [m] of the first layer."""
        return self.contact + self.units[0] * float(x[0])

    def values_of_layers(self, x: np.ndarray) -> Iterator[dict[str, float]]:
        """The parameters of each layer in SI, with its ``top`` below the first and the onset of the one before."""
        for row in self._values(x):
            own = {name: float(each) for name, each in row.items()}
            if own.get("saturation_depth", 0.0) >= NO_SATURATION * own["rupture_onset"]:
                own["saturation_depth"] = math.inf
            yield own

    def _values(self, x: np.ndarray) -> Iterator[dict[str, np.ndarray]]:
        """The same of one x (size,) or of many (size, k), also where a contact is a cone with a saturation depth."""
        surface, before = self.units[0] * x[0], 0.0
        for unit, row in zip(self.units, x[:-1].reshape(-1, SIZE, *x.shape[1:])):
            own = Scaled(*row)
            onset, ((name, kind),) = unit * np.exp(own.log_onset), self.curve.shape.items()
            shape = np.exp(own.log_shape) * onset**kind.power
            (reached,) = self.curve.basis(onset, shape)
            force = self.scale * (np.exp(own.log_left) + own.friction * onset / unit + own.cutting)
            top = np.maximum(unit * own.top - surface, before)
            before = top + onset + MIN_TOP_M
            yield {
                "top": top,
                self.curve.amplitudes[0]: np.minimum(force / reached, STIFFEST),
                name: shape,
                "rupture_onset": onset,
                "rupture_length": unit * np.exp(own.log_length),
                "rupture_exponent": own.exponent,
                "friction_per_length": self.scale * own.friction / unit,
                "cutting_force": self.scale * own.cutting,
            }

    def forces(self, x: np.ndarray, depth: np.ndarray) -> np.ndarray:
        """Force (m,) [N] at increasing depths (m,) [m], with the zero."""
        steps = depth - self.surface(x), np.full(len(depth), STEP_S)
        return self._filtered(core.Insertion(self._stack(x), _ANY_SPEED).forces(*steps)) + self.scale * x[-1]

    def slopes(self, x: np.ndarray, depth: np.ndarray) -> np.ndarray:
        """Derivatives (m, size) of ``forces``: those of the engine by its laws, by those of the laws by x."""
        steps = depth - self.surface(x), np.full(len(depth), STEP_S)
        places = [(layer, *IN_ENGINE[name][:2]) for layer, row in enumerate(self._values(x)) for name in row]
        _, by_laws, _ = core.force_gradient(self._stack(x), *steps, places)
        moved = SCALED_STEP * np.eye(len(x))
        above, below = (self._of_laws(x[:, None] + each) for each in (moved, -moved))
        found = self._filtered(by_laws @ ((above - below) / (2.0 * SCALED_STEP)))
        found[:, -1] = self.scale
        return found

    def _stack(self, x: np.ndarray) -> list[tuple[float, core.Laws]]:
        return [(top, core.Laws(**laws)) for top, laws in _laws_of_layers(self.values_of_layers(x), self.curve)]

    def _of_laws(self, x: np.ndarray) -> np.ndarray:
        """The parameters (p, k) of the laws for many x (size, k), those of ``_values``; tops in the zero of depth."""
        surface = {"top": self.units[0] * x[0]}
        rows = (row.items() for row in self._values(x))
        return np.array([IN_ENGINE[name][2] * each + surface.get(name, 0.0) for row in rows for name, each in row])

    def _filtered(self, force: np.ndarray) -> np.ndarray:
        """As the sensor filtered it along the first axis."""
        if self.filter_length == 1:
            return force
        from scipy.ndimage import uniform_filter1d

        return uniform_filter1d(force, self.filter_length, axis=0, mode="nearest")

    def start(self) -> np.ndarray:
        """Each layer with its peak as it is, and all of the force behind it as cutting force."""
        rows = []
        for part, peak, begin, unit in zip(self.parts, self.peaks, self.begins, self.units):
            ends = peak, part.start, min(part.stop, len(self.force) - 1)
            top, before, behind = ((self.force[k] - self.zero) / self.scale for k in ends)
            onset, length, shape = map(math.log, START if "saturation_depth" in self.curve.shape else START_POWER)
            rows.append(
                Scaled(
                    top=(begin - self.contact) / unit,
                    log_onset=onset,
                    log_length=length,
                    exponent=EXPONENT,
                    log_left=math.log(max(top - before, MIN_LEFT)),
                    log_shape=shape,
                    friction=0.0,
                    cutting=max(behind, 0.0),
                )
            )
        return np.append(np.array(rows), self.zero / self.scale)

    def solve(self, start: np.ndarray | None = None) -> np.ndarray:
        """The least squares in all parameters, from a ``start`` or that of the peaks."""
        from scipy.optimize import least_squares

        count = len(self.depth) if self.filter_length > 1 else min(len(self.depth), MAX_BLOCKS)
        edges = np.linspace(0, len(self.depth), count + 1).astype(int)
        weight = np.sqrt(np.diff(edges) / np.diff(edges).mean())
        depth, force = (np.add.reduceat(each, edges[:-1]) / np.diff(edges) for each in (self.depth, self.force))

        low, high = self.limits
        inner = 1e-6 * (high - low)
        x = np.clip(self.start() if start is None else start, low + inner, high - inner)
        free = np.array([*(name != self.without for _ in self.peaks for name in Scaled._fields), True])
        x[~free] = 0.0

        def residual(found: np.ndarray) -> np.ndarray:
            x[free] = found
            return weight * (self.forces(x, depth) - force) / self.scale

        def slopes(found: np.ndarray) -> np.ndarray:
            x[free] = found
            by = weight[:, None] * self.slopes(x, depth)[:, free] / self.scale
            size = np.linalg.norm(by, axis=0)
            return np.where(size < UNDETERMINED * size.max(), 0.0, by)  # a long way to a limit would cut every step

        limits = low[free], high[free]
        x[free] = least_squares(residual, x[free], slopes, bounds=limits, x_scale="jac", max_nfev=MAX_STEPS).x
        return x


def stacked(
    layers: Iterable[dict[str, float]],
    curve: LoadingCurve = CONE_CYLINDER,
    needle: Needle | None = None,
    name: str = "",
    reference: str = "",
) -> Model:
    """The model of layers with the values of ``InsertionProblem.values_of_layers``; InputError for a value outside the
    range of a law."""
    (_, first), *deeper = _laws_of_layers(layers, curve, needle)
    return Model(
        **first,
        deeper=tuple(Layer(top=top, **laws) for top, laws in deeper),
        name=name or "model",
        summary="Identified from recordings.",
        reference=reference or "identified by needleforce",
        doubts=(UNKNOWN_TIP,) if needle is None or needle.tip is None else (),
        needle=needle,
    )


def _laws_of_layers(
    layers: Iterable[dict[str, float]], curve: LoadingCurve, needle: Needle | None = None
) -> Iterator[tuple[float, dict[str, Any]]]:
    """The top [m] of each layer, below the onset of the one before, and its laws by their part of the force."""
    above = 0.0
    for values in layers:
        top, onset = max(values["top"], above), values["rupture_onset"]
        above = top + onset + MIN_TOP_M
        rupture = values["rupture_length"], values["rupture_exponent"]
        yield (
            top,
            {
                "stiffness": curve.stiffness(values, half_angle(needle)),
                "puncture": core.laws.PunctureDepth(onset),
                "friction": core.laws.YieldingCoulomb(values["friction_per_length"], STEP_M, *rupture),
                "cutting": core.laws.ConstantCutting(values["cutting_force"], 2.0 * STEP_M),
            },
        )


def problem_of(single: SegmentedRecording, layers: int) -> InsertionProblem:
    """The insertion with its falls, of which the strokes of a segmented recording lack the gradual ones."""
    recording, events = single.recording, single.events
    if not 0 < layers <= len(events.punctures):
        raise InputError("number of punctures", len(events.punctures), f"{layers} layers need as many")
    chosen = punctures_of_layers(events, layers)
    sharp = replace(events, punctures=tuple(replace(each, gradual=False) for each in events.punctures))
    strokes, _, _ = without_drift(recording, events, strokes_of(recording, sharp))
    peaks = [strokes.place_in(int(np.searchsorted(recording.time, each.time))) for each in chosen]
    problem = InsertionProblem(
        depth=strokes.depth_in,
        force=strokes.force_in,
        samples=strokes.index_in,
        peaks=tuple(min(each, len(strokes.depth_in) - 1) for each in peaks),
        contact=events.contact.depth,
        zero=events.baseline or 0.0,
        filter_length=recording.card.filter_length,
    )
    for part, peak in zip(problem.parts, problem.peaks):
        if not (part.stop - part.start >= MIN_SAMPLES and part.start < peak < part.stop):
            where = f"a puncture at {1e3 * problem.depth[peak]:.4g} mm"
            limit = f"at least {MIN_SAMPLES} are needed from the least force before it to that behind it"
            raise InputError("number of samples", part.stop - part.start, limit, where, "Record at a higher rate.")
    return problem
