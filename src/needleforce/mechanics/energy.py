# SPDX-License-Identifier: Apache-2.0
"""Work of an insertion and withdrawal, by the mechanism that dissipates it."""

from typing import Any

import numpy as np

from .. import core
from ..errors import InputError

STEP_M = 1e-6  # of the numeric integral; the elastic travels of the presets are twenty times as long


def cycle_work(model: Any, deepest: float, *, speed: float = 3e-3) -> dict[str, float]:
    """Work of a first insertion to a depth and the withdrawal to above the surface, by mechanism.

    Parameters
    ----------
    model : Model
        The model, with one or more layers.
    deepest : float
        Largest depth [m], finite and at least the depth of the first puncture.
    speed : float
        Speed of both strokes [m/s] where the work is integrated numerically.

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
    A closed form is used for one layer with the laws Coulomb and ConstantCutting and no relaxation, in the limit of
    slow motion and without their elastic travel. Otherwise the force of an ``Insertion`` is integrated in steps of one
    micrometre.
    """
    puncture = model.puncture_depth
    if not (np.isfinite(deepest) and deepest >= puncture):
        limit = f"must be finite and at least the puncture depth, {puncture:.4g} m"
        raise InputError("deepest", f"{deepest} m", limit, next_step="Give a larger depth.")
    return _closed(model, deepest) if _is_closed(model) else _integrated(model, deepest, speed)


def _is_closed(model: Any) -> bool:
    """Whether the closed form holds for the laws of the model."""
    laws = core.laws
    covered = isinstance(model.friction, laws.Coulomb) and isinstance(model.cutting, laws.ConstantCutting)
    return covered and isinstance(model.relaxation, laws.NoRelaxation) and not model.deeper


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
