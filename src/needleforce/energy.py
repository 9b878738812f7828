# SPDX-License-Identifier: Apache-2.0
"""Where the work of a whole cycle goes."""

from .errors import InputError


def cycle_work(model, deepest: float) -> dict[str, float]:
    """Work [J] of a slow first insertion to ``deepest`` [m] and back to the surface, by what takes it; all terms >= 0.

    ``stiffness`` is the elastic energy at the puncture, lost when it breaks through. ``deepest`` lies below the
    puncture.
    """
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
