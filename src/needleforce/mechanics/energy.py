# SPDX-License-Identifier: Apache-2.0
"""Where the work of a whole cycle goes."""

import numpy as np

from .. import core
from ..errors import InputError

STEP = 1e-6  # [m] of the numeric integral; the elastic travels of the presets are twenty times as long


def cycle_work(model, deepest: float, *, speed: float = 3e-3) -> dict[str, float]:
    """Work [J] of a first insertion to ``deepest`` [m] and back to above the surface, by what takes it.

    ``stiffness`` is what the contacts took, lost when they break through; ``cutting`` is that of the tip, and of
    friction on the way ``in`` and ``out``. A closed form for one layer with the laws Coulomb and ConstantCutting and no
    relaxation, slow and without their elastic travel; else the integral over an ``Insertion`` at ``speed`` [m/s] in
    steps of a micrometre. ``deepest`` lies below the first puncture. The terms add up to the work of the hand, which is
    never negative but for laws that say that they may return energy.
    """
    puncture = model.puncture_depth
    if not (np.isfinite(deepest) and deepest >= puncture):
        raise InputError("deepest", f"{deepest} m", f"must be at least the puncture depth {puncture:.4g} m")
    return _closed(model, deepest) if _is_closed(model) else _integrated(model, deepest, speed)


def _is_closed(model) -> bool:
    laws = core.laws
    known = isinstance(model.friction, laws.Coulomb) and isinstance(model.cutting, laws.ConstantCutting)
    return known and isinstance(model.relaxation, laws.NoRelaxation) and not model.deeper


def _closed(model, deepest: float) -> dict[str, float]:
    puncture = model.puncture_depth
    surface = model.friction.dimple_ratio * puncture
    half = 0.5 * model.friction.per_length
    return {
        "stiffness": model.stiffness.energy(puncture),
        "cutting": model.cutting.force * (deepest - puncture),
        "friction_in": half * ((deepest - surface) ** 2 - (puncture - surface) ** 2),
        "friction_out": half * (deepest - surface) ** 2,
    }


def _integrated(model, deepest: float, speed: float) -> dict[str, float]:
    above = -0.25 * deepest
    steps = int(np.ceil((deepest - above) / STEP))
    stroke = np.linspace(above, deepest, steps + 1)
    depth = np.concatenate([stroke, stroke[-2::-1]])
    run = core.Insertion(model.stack, core.Limits(max_speed=np.inf)).run(
        depth, None, np.full(len(depth), (stroke[1] - stroke[0]) / speed)
    )
    inwards = slice(0, steps + 1), slice(steps, None)

    def work(part: str, stroke: slice = slice(None)) -> float:
        return float(np.trapezoid(run[part][stroke], depth[stroke]))

    friction = {f"friction_{way}": work("friction", part) for way, part in zip(("in", "out"), inwards)}
    return {"stiffness": work("stiffness"), "cutting": work("cutting"), **friction}
