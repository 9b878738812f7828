# SPDX-License-Identifier: Apache-2.0
"""A layered fit as a model of the engine, and where each layer ruptures: in every run, on the mean, and next to what
segmentation found."""

from dataclasses import dataclass

import numpy as np

from ... import core
from ...models.model import Layer, Model
from ...recording import Recording
from ...segmentation import Events
from ..estimates import Estimate
from ..models import UNKNOWN_TIP, half_angle
from ..statistics.noise import Z_95, noise_of
from .parameters import BARE, LEAST_INDENTATION, MM, prefix
from .search import Solved

LEAST_SHARE = 1e-9  # below, nothing fades
NEVER = 0.99  # of the largest saturation depth: the contact does not saturate
NEAR = 2.0  # [mm] a rupture seen farther from the fitted one belongs to no layer
CLOSE = 0.4  # [mm] the steep fall begins so near the peak: more is another rupture
TOGETHER = 0.7  # [mm] so near, two layers give way in one rupture
FINE = 0.02  # [mm]
REACH = 1.5  # [mm]


def model_of(solved: Solved, punctures: np.ndarray, needle=None, reference: str = "") -> Model:
    """The model that gives way at ``punctures`` (layers,) [m] in the recordings' zero; InputError out of range."""
    passive, rows = solved.problem.passive, solved.problem.unknowns.rows(solved.x[None], punctures[None] / MM)[0]
    # two layers that begin at the same place are one to the engine: it takes them a micrometre apart
    tops = np.maximum.accumulate(rows[:, 2] - rows[0, 2] - LEAST_INDENTATION * np.arange(len(rows)))
    layers = [
        _layer(row, float(top + LEAST_INDENTATION * k), half_angle(needle), passive)
        for k, (row, top) in enumerate(zip(rows, tops))
    ]
    first = {name: getattr(layers[0], name) for name in ("stiffness", "puncture", "friction", "cutting", "relaxation")}
    return Model(
        **first,
        deeper=tuple(layers[1:]),
        name="identified_layered" if passive else "identified_layered_as_fitted",
        summary="Identified from recordings.",
        reference=reference or "identified by needleforce",
        doubts=(UNKNOWN_TIP,) if needle is None or needle.tip is None else (),
        needle=needle,
    )


def _layer(row: np.ndarray, top: float, angle: float, passive: bool) -> Layer:
    c, saturation, place, puncture, grip, stiffness, rupture, resting = map(float, row[:8])
    friction = core.laws.DraggedTissue if passive else core.laws.DraggedTissueAsFitted
    modulus, radius = 0.5 * np.pi * c / np.tan(angle), 2.0 * saturation * np.tan(angle) / np.pi
    bare = saturation >= NEVER * np.exp(BARE)
    return Layer(
        top=top,
        stiffness=core.laws.Cone(modulus, angle) if bare else core.laws.ConeCylinder(modulus, angle, radius),
        puncture=core.laws.PunctureDepth(puncture - place),
        friction=friction(grip, stiffness, rupture, resting),
        cutting=core.laws.NoCutting(),
        relaxation=_fading(row[8:], passive),
    )


def _fading(numbers: np.ndarray, passive: bool):
    share_1, time_1, share_2, time_2 = map(float, numbers)
    if share_1 + share_2 < LEAST_SHARE:
        return core.laws.NoRelaxation()
    return (core.laws.Prony if passive else core.laws.PronyAtRest)(share_1, time_1, share_2, time_2)


@dataclass(frozen=True, eq=False)
class Ruptures:
    """Mean depth (layers,) [m] at which each layer gives way, and by how much it lies past the peak that is seen.

    ``contact`` [m] is the mean contact that segmentation sees. Depths are in the recordings' zero.
    """

    depth: np.ndarray
    past_peak: np.ndarray
    contact: float

    def of(self, events: Events, recording: Recording) -> tuple[float, np.ndarray]:
        """By how much a recording's surface lies deeper [m], and where its layers give way: where its own ruptures were
        seen, and no later than they are seen to be over, else on the mean."""
        shift = 0.0 if events.contact is None else events.contact.depth - self.contact
        over = {puncture.depth: recording.depth[puncture.high] for puncture in events.punctures}
        peaks = matched((self.depth + shift - self.past_peak) / MM, tuple(over)) * MM
        latest = np.array([min(over.items(), key=lambda p: abs(p[0] - z))[1] if z == z else np.nan for z in peaks])
        own = np.minimum(peaks + self.past_peak, latest)
        return shift, np.where(np.isfinite(own), own, self.depth + shift)


def matched(expected: np.ndarray, seen: tuple[float, ...]) -> np.ndarray:
    """For each expected depth (layers,) [mm] the rupture seen [m] that is nearest to it, in mm; NaN without one."""
    found = np.full(len(expected), np.nan)
    pairs = sorted((abs(z - s / MM), layer, s / MM) for layer, z in enumerate(expected) for s in seen)
    for distance, layer, place in pairs:
        taken = place in found and distance > TOGETHER
        if distance <= NEAR and np.isnan(found[layer]) and not taken:
            found[layer] = place
    return found


def ruptures(solved: Solved) -> Ruptures:
    """The mean ruptures of a fit."""
    cycles = solved.problem.cycles
    fitted = solved.problem.unknowns.punctures(solved.x)
    seen = np.array([matched(own, cycle.punctures) for own, cycle in zip(fitted, cycles)])
    known = np.isfinite(seen).any(axis=0)
    past = np.zeros(fitted.shape[1])
    past[known] = np.clip(np.nanmedian((fitted - seen)[:, known], axis=0), -CLOSE, CLOSE)
    return Ruptures(MM * fitted.mean(axis=0), MM * past, float(np.mean([cycle.contact for cycle in cycles])))


def own_ruptures(solved: Solved, run: int) -> dict[str, Estimate]:
    """Where the layers gave way in one run: an interval between two places, never a standard error.

    It holds what the noise of this run does not refuse at 95 %, the other numbers as they are, and the bin.
    """
    problem, cycle = solved.problem, solved.problem.cycles[run]
    own = problem.unknowns.punctures(solved.x)[run]
    noise = noise_of(problem.residuals(run, solved.x), len(cycle.depth))
    bin_width = float(np.ptp(cycle.depth)) / max((cycle.stroke == 0).sum(), 1) / MM
    found = {}
    for layer, place in enumerate(own):
        name = f"{prefix(layer)}puncture_depth"
        allowed = _allowed(solved, run, layer, Z_95**2 * noise.long_run)
        low, high = MM * (allowed.min() - 0.5 * bin_width), MM * (allowed.max() + 0.5 * bin_width)
        reached = place < cycle.deepest / MM
        high, source = (high, "layered fit") if reached else (np.inf, "layered fit: not reached in this run")
        found[name] = Estimate(name, MM * place, "m", low, high, None, reached, source)
    return found


def _allowed(solved: Solved, run: int, layer: int, rise: float) -> np.ndarray:
    """Places [mm] around a rupture where the sum of squares is no more than ``rise`` above the least."""
    problem, cycle = solved.problem, solved.problem.cycles[run]
    own = problem.unknowns.punctures(solved.x)[run]
    places = np.append(np.arange(own[layer] - REACH, own[layer] + REACH, FINE), own[layer])
    tried = np.tile(own, (len(places), 1))
    tried[:, layer] = places
    squares = problem.squares(cycle, np.tile(solved.x, (len(places), 1)), tried)
    return places[squares <= squares[-1] + rise]
