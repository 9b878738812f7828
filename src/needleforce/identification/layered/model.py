# SPDX-License-Identifier: Apache-2.0
"""A layered fit as a model for simulation, and the rupture depths of its layers in every run."""

from typing import Any

import numpy as np

from ... import core
from ...core import Needle
from ...models.model import Layer, Model
from ...models.parameter_units import UNITS
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
        return core.laws.YieldingTissue(*numbers, row.brittleness, withdrawal_ratio=row.withdrawal_ratio)
    law = core.laws.DraggedTissue if form == "passive" else core.laws.DraggedTissueAsFitted
    return law(*numbers, row.withdrawal_ratio)


def _relaxation(row: LayerRow, form: str) -> Any:
    if row.share_1 + row.share_2 < MIN_SHARE:
        return core.laws.NoRelaxation()
    return RELAXATION[form](row.share_1, row.time_1, row.share_2, row.time_2)


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
        found[name] = Estimate(
            name, MM * place, UNITS["puncture_depth"], low, high, identifiable=reached, source=source
        )
    return found


def _allowed(solved: Solved, run: int, layer: int, rise: float) -> np.ndarray:
    """Depths [mm] around a rupture where the sum of squares is at most ``rise`` above the least."""
    problem = solved.problem
    own = problem.unknowns.punctures(solved.x)[run]
    places = np.append(np.arange(own[layer] - SCAN_RANGE_MM, own[layer] + SCAN_RANGE_MM, SCAN_STEP_MM), own[layer])
    squares = problem.squares_by_puncture(run, layer, solved.x, places)
    return places[squares <= squares[-1] + rise]
