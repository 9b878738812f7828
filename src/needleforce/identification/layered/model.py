# SPDX-License-Identifier: Apache-2.0
"""A layered fit as a model for simulation, and the rupture depths of its layers: in every run, as a mean, and compared
with the punctures of segmentation."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ... import core
from ...core import Needle
from ...models.model import Layer, Model
from ...recording import Recording
from ...segmentation import Events
from ..estimates import Estimate
from ..models import LAYERED, UNKNOWN_TIP, half_angle
from ..statistics.noise import TWO_SIDED, noise_of
from .parameters import MIN_INDENTATION_M, MM, NO_SATURATION, LayerRow, prefix
from .search import Solved

NAMES = {form: name for name, form in LAYERED.items()}
RELAXATION = {
    "as_fitted": core.laws.PronyAtRest,
    "passive": core.laws.Prony,
    "yielding": core.laws.PronyLocked,
}
MIN_SHARE = 1e-9  # [1] a smaller relaxing share is none
NO_SATURATION_SHARE = 0.99  # [of the largest saturation depth] beyond, the contact does not saturate
MAX_MATCH_DISTANCE_MM = 2.0  # [mm] a puncture farther from the fitted rupture belongs to no layer
MAX_PAST_PEAK_MM = 0.4  # [mm] from the peak to the steep fall; a larger distance is another rupture
MAX_JOINT_DISTANCE_MM = 0.7  # [mm] within, two layers rupture together
SCAN_STEP_MM = 0.02  # [mm] of the interval of a rupture
SCAN_RANGE_MM = 1.5  # [mm] on each side


def model_of(solved: Solved, punctures: np.ndarray, needle: Needle | None = None, reference: str = "") -> Model:
    """The model that ruptures at ``punctures`` (layers,) [m] in the recordings' zero; InputError out of range."""
    form = solved.problem.form
    rows = [LayerRow(*row) for row in solved.problem.unknowns.rows(solved.x[None], punctures[None] / MM)[0].tolist()]
    depths = np.array([row.top for row in rows])
    # the simulation does not accept two layers with the same top: they are put a micrometre apart
    tops = np.maximum.accumulate(depths - depths[0] - MIN_INDENTATION_M * np.arange(len(rows)))
    layers = [
        _layer(row, float(top + MIN_INDENTATION_M * k), half_angle(needle), form)
        for k, (row, top) in enumerate(zip(rows, tops))
    ]
    first = {name: getattr(layers[0], name) for name in ("stiffness", "puncture", "friction", "cutting", "relaxation")}
    return Model(
        **first,
        deeper=tuple(layers[1:]),
        name=f"identified_{NAMES[form]}",
        summary="Identified from recordings.",
        reference=reference or "identified by needleforce",
        doubts=(UNKNOWN_TIP,) if needle is None or needle.tip is None else (),
        needle=needle,
    )


def _layer(row: LayerRow, top: float, angle: float, form: str) -> Layer:
    modulus = 0.5 * np.pi * row.stiffness_coefficient / np.tan(angle)
    radius = 2.0 * row.saturation_depth * np.tan(angle) / np.pi
    cone = row.saturation_depth >= NO_SATURATION_SHARE * np.exp(NO_SATURATION)
    return Layer(
        top=top,
        stiffness=core.laws.Cone(modulus, angle) if cone else core.laws.ConeCylinder(modulus, angle, radius),
        puncture=core.laws.PunctureDepth(row.puncture_depth - row.top),
        friction=_friction(row, form),
        cutting=core.laws.NoCutting(),
        relaxation=_relaxation(row, form),
    )


def _friction(row: LayerRow, form: str) -> Any:
    numbers = row.friction_per_length, row.tissue_stiffness, row.rupture_length, row.resting_surface
    if form == "yielding":
        return core.laws.YieldingTissue(*numbers, row.brittleness)
    return (core.laws.DraggedTissue if form == "passive" else core.laws.DraggedTissueAsFitted)(*numbers)


def _relaxation(row: LayerRow, form: str) -> Any:
    if row.share_1 + row.share_2 < MIN_SHARE:
        return core.laws.NoRelaxation()
    return RELAXATION[form](row.share_1, row.time_1, row.share_2, row.time_2)


@dataclass(frozen=True, eq=False)
class Ruptures:
    """Mean rupture depth (layers,) [m] of each layer, and its distance (layers,) [m] past the measured force peak.

    ``contact`` [m] is the mean contact depth of segmentation. Depths are in the recordings' zero.
    """

    depth: np.ndarray
    past_peak: np.ndarray
    contact: float

    def of(self, events: Events, recording: Recording) -> tuple[float, np.ndarray]:
        """How much deeper the surface of a recording is [m], and the rupture depths (layers,) [m] of its layers: at its
        own punctures, not later than the end of their drops, otherwise at the mean depths."""
        shift = 0.0 if events.contact is None else events.contact.depth - self.contact
        ends = {puncture.depth: recording.depth[puncture.high] for puncture in events.punctures}
        peaks = matched((self.depth + shift - self.past_peak) / MM, tuple(ends)) * MM
        latest = np.array([min(ends.items(), key=lambda p: abs(p[0] - z))[1] if z == z else np.nan for z in peaks])
        own = np.minimum(peaks + self.past_peak, latest)
        return shift, np.where(np.isfinite(own), own, self.depth + shift)


def matched(expected: np.ndarray, punctures: tuple[float, ...]) -> np.ndarray:
    """For each expected depth (layers,) [mm] the nearest of the punctures [m], in mm; NaN without one."""
    found = np.full(len(expected), np.nan)
    pairs = sorted((abs(z - s / MM), layer, s / MM) for layer, z in enumerate(expected) for s in punctures)
    for distance, layer, place in pairs:
        taken = place in found and distance > MAX_JOINT_DISTANCE_MM
        if distance <= MAX_MATCH_DISTANCE_MM and np.isnan(found[layer]) and not taken:
            found[layer] = place
    return found


def ruptures(solved: Solved) -> Ruptures:
    """The mean ruptures of a fit."""
    cycles = solved.problem.cycles
    fitted = solved.problem.unknowns.punctures(solved.x)
    peaks = np.array([matched(own, cycle.punctures) for own, cycle in zip(fitted, cycles)])
    known = np.isfinite(peaks).any(axis=0)
    past = np.zeros(fitted.shape[1])
    past[known] = np.clip(np.nanmedian((fitted - peaks)[:, known], axis=0), -MAX_PAST_PEAK_MM, MAX_PAST_PEAK_MM)
    return Ruptures(MM * fitted.mean(axis=0), MM * past, float(np.mean([cycle.contact for cycle in cycles])))


def own_ruptures(solved: Solved, run: int) -> dict[str, Estimate]:
    """Rupture depths of the layers in one run, with intervals between two depths instead of standard errors.

    An interval contains the depths that the noise of this run does not reject, with the other parameters held, and the
    width of the bin.
    """
    problem, cycle = solved.problem, solved.problem.cycles[run]
    own = problem.unknowns.punctures(solved.x)[run]
    noise = noise_of(problem.residuals(run, solved.x), len(cycle.depth))
    bin_width = float(np.ptp(cycle.depth)) / max((cycle.stroke == 0).sum(), 1) / MM
    found = {}
    for layer, place in enumerate(own):
        name = f"{prefix(layer)}puncture_depth"
        allowed = _allowed(solved, run, layer, TWO_SIDED**2 * noise.long_run)
        low, high = MM * (allowed.min() - 0.5 * bin_width), MM * (allowed.max() + 0.5 * bin_width)
        reached = place < cycle.deepest / MM
        high, source = (high, "layered fit") if reached else (np.inf, "layered fit: deeper than this run")
        found[name] = Estimate(name, MM * place, "m", low, high, identifiable=reached, source=source)
    return found


def _allowed(solved: Solved, run: int, layer: int, rise: float) -> np.ndarray:
    """Depths [mm] around a rupture where the sum of squares is at most ``rise`` above the least."""
    problem = solved.problem
    own = problem.unknowns.punctures(solved.x)[run]
    places = np.append(np.arange(own[layer] - SCAN_RANGE_MM, own[layer] + SCAN_RANGE_MM, SCAN_STEP_MM), own[layer])
    squares = problem.squares_by_puncture(run, layer, solved.x, places)
    return places[squares <= squares[-1] + rise]
