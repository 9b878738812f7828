# SPDX-License-Identifier: Apache-2.0
"""Where the work of a whole cycle goes."""

from . import core
from .errors import InputError


def cycle_work(model, deepest: float) -> dict[str, float]:
    """Work [J] of a slow first insertion to ``deepest`` [m] and back to the surface, by what takes it; all terms >= 0.

    ``stiffness`` is the elastic energy at the puncture, lost when it breaks through. ``deepest`` lies below the
    puncture. A closed form for the laws Coulomb and ConstantCutting without their elastic travel: InputError for
    others.
    """
    _require(model.friction, core.laws.Coulomb)
    _require(model.cutting, core.laws.ConstantCutting)
    puncture = model.puncture_depth
    if not deepest >= puncture:
        raise InputError("deepest", f"{deepest} m", f"must be at least the puncture depth {puncture:.4g} m")
    surface = model.friction.dimple_ratio * puncture
    half = 0.5 * model.friction.per_length
    return {
        "stiffness": model.stiffness.energy(puncture),
        "cutting": model.cutting.force * (deepest - puncture),
        "friction_in": half * ((deepest - surface) ** 2 - (puncture - surface) ** 2),
        "friction_out": half * (deepest - surface) ** 2,
    }


def _require(law, known) -> None:
    if not isinstance(law, known):
        raise InputError(
            f"the model's {known.family} law",
            law.name,
            f"not {known.name}, the one whose work is known in closed form",
            next_step="Run an Insertion and sum force times change of depth.",
        )
