# SPDX-License-Identifier: Apache-2.0
"""Work of an insertion and withdrawal, by the mechanism that dissipates it."""

from typing import Any

import numpy as np

from .. import core
from ..errors import InputError

STEP_M = 1e-6  # of the numeric integral; the elastic travels of the presets are twenty times as long


def cycle_work(model: Any, deepest: float, *, speed: float = 3e-3, elastic_travel: bool = False) -> dict[str, float]:
    """Work of a first insertion to a depth and the withdrawal to above the surface, by mechanism.

    Parameters
    ----------
    model : Model
        The model, with one or more layers.
    deepest : float
        Largest depth [m], finite and at least the depth of the first puncture.
    speed : float
        Speed of both strokes [m/s] where the work is integrated numerically.
    elastic_travel : bool
        With the travel over which friction and cutting are loaded, as an ``Insertion`` steps it. Otherwise the closed
        form neglects it, which is the limit of a short travel; the numeric integral always has it.

    Returns
    -------
    dict of str to float
        Work [J]: ``stiffness`` is the energy of the contacts, lost at the punctures; ``cutting`` is that of the tip;
        ``friction_in`` and ``friction_out`` are those of the insertion and the withdrawal stroke. The sum is the work
        done by the device; it is never negative, except for laws that state that they may return energy.

    Raises
    ------
    InputError
        If ``deepest`` is above the first puncture or not finite.

    Notes
    -----
    A closed form is used for one layer with the laws Coulomb and ConstantCutting and no relaxation, if the depth is
    at least the unloading travel of the cut below the puncture. Otherwise the force of an ``Insertion`` is integrated
    in steps of one micrometre.
    """
    puncture = model.puncture_depth
    if not (np.isfinite(deepest) and deepest >= puncture):
        limit = f"must be finite and at least the puncture depth, {puncture:.4g} m"
        raise InputError("deepest", f"{deepest} m", limit, next_step="Give a larger depth.")
    if not _is_closed(model, deepest):
        return _integrated(model, deepest, speed)
    return _closed_elastic(model, deepest) if elastic_travel else _closed(model, deepest)


def _is_closed(model: Any, deepest: float) -> bool:
    """Whether a closed form holds for the laws of the model down to a depth."""
    laws = core.laws
    covered = isinstance(model.friction, laws.Coulomb) and isinstance(model.cutting, laws.ConstantCutting)
    covered = covered and isinstance(model.relaxation, laws.NoRelaxation) and not model.deeper
    return covered and deepest - model.puncture_depth >= model.cutting.unloading


def _closed(model: Any, deepest: float) -> dict[str, float]:
    puncture = model.puncture_depth
    surface = model.friction.dimple_ratio * puncture
    half = 0.5 * model.friction.per_length
    return {
        "stiffness": model.stiffness.energy(puncture),
        "cutting": model.cutting.force * (deepest - puncture),
        "friction_in": half * ((deepest - surface) ** 2 - (puncture - surface) ** 2),
        "friction_out": half * (deepest - surface) ** 2,
    }


def _closed_elastic(model: Any, deepest: float) -> dict[str, float]:
    """The same while the traction p moves by k = f'/s_0 a travel between its limits, and the cut unloads."""
    friction, puncture, cutting = model.friction, model.puncture_depth, model.cutting
    surface, limit = friction.dimple_ratio * puncture, friction.per_length
    rate = limit / friction.presliding
    begun = _traction_at_puncture(model, puncture - surface, rate)
    slides = min(deepest, puncture + (limit - begun) / rate if rate else deepest)
    turned = begun + rate * (slides - puncture)  # the traction at the largest depth
    back = max(surface, deepest - (turned + limit) / rate if rate else surface)
    loading = _work_along(puncture, slides, begun, turned, surface)
    unloading = _work_along(deepest, back, turned, turned - rate * (deepest - back), surface)
    return {
        "stiffness": model.stiffness.energy(puncture),
        "cutting": cutting.force * (deepest - puncture - 0.5 * cutting.unloading),
        "friction_in": loading + _work_along(slides, deepest, limit, limit, surface),
        "friction_out": unloading + _work_along(back, surface, -limit, -limit, surface),
    }


def _traction_at_puncture(model: Any, length: float, rate: float) -> float:
    """What friction takes over from the contact [N/m]: decision 13."""
    if length <= 0.0:
        return 0.0
    puncture = model.puncture_depth
    free = max(0.0, model.stiffness.force(puncture) - model.cutting.force)
    by_energy = np.sqrt(rate * model.stiffness.energy(puncture) / length)  # half of it, the cut has the other
    return min(model.friction.per_length, rate * puncture, free / length, by_energy, 2.0 * rate * length)


def _work_along(start: float, end: float, first: float, last: float, surface: float) -> float:
    """Work of a traction that changes evenly along a travel, on the shaft below the surface; exact."""
    middle = 0.25 * (first + last) * (start + end - 2.0 * surface)
    return (end - start) * (first * (start - surface) + 4.0 * middle + last * (end - surface)) / 6.0


def _integrated(model: Any, deepest: float, speed: float) -> dict[str, float]:
    above = -0.25 * deepest
    steps = int(np.ceil((deepest - above) / STEP_M))
    stroke = np.linspace(above, deepest, steps + 1)
    depth = np.concatenate([stroke, stroke[-2::-1]])
    run = core.Insertion(model.stack, core.Limits(max_speed=np.inf)).run(
        depth, None, np.full(len(depth), (stroke[1] - stroke[0]) / speed)
    )
    strokes = {"in": slice(0, steps + 1), "out": slice(steps, None)}

    def work(part: str, stroke: slice = slice(None)) -> float:
        return float(np.trapezoid(run[part][stroke], depth[stroke]))

    friction = {f"friction_{name}": work("friction", part) for name, part in strokes.items()}
    return {"stiffness": work("stiffness"), "cutting": work("cutting"), **friction}
