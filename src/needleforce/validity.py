# SPDX-License-Identifier: Apache-2.0
"""Limits of validity, said in plain words when a model or a fit crosses them."""

import math

from .needle_mechanics import buckling_force

SMALL_SLOPE_ANGLE = math.radians(60.0)
FRICTION_LIMIT = 12e-3  # the paper, sec. 2.2: beyond this depth the needle no longer stays straight


def crossed_limits(model) -> tuple[str, ...]:
    """Every limit that the model's own numbers cross; empty where none is."""
    return tuple(sentence for sentence in (_slope(model), _saturation(model), _buckling(model)) if sentence)


def _slope(model) -> str:
    angle = getattr(model.stiffness, "half_angle", math.pi / 2)
    # without a tip the angle is a stand-in: only its product with the modulus is known
    if angle >= SMALL_SLOPE_ANGLE or model.needle is None or model.needle.tip is None:
        return ""
    strain = 0.2 / math.tan(angle)
    return (
        f"The tip's half angle of {math.degrees(angle):.3g} degrees is below 60: representative strain {strain:.2f}, "
        "so linear contact theory is a scaling law here, not a prediction."
    )


def _saturation(model) -> str:
    radius = model.needle.radius if model.needle is not None else math.inf
    if model.stiffness.name != "cone":
        return ""
    contact = 2.0 * model.puncture_depth * math.tan(model.stiffness.half_angle) / math.pi
    if contact <= radius:
        return ""
    return (
        f"At puncture the bare cone's contact radius is {1e3 * contact:.3g} mm, wider than the "
        f"needle ({1e3 * radius:.3g} mm): "
        "use the law cone_cylinder."
    )


def _buckling(model) -> str:
    if model.needle is None:
        return ""
    critical = buckling_force(model.needle)
    peak = model.stiffness.force(model.puncture_depth)
    if peak <= critical:
        return ""
    return (
        f"The model's force at puncture, {peak:.3g} N, exceeds the buckling load of a clamped needle with a "
        f"free tip, {critical:.3g} N: "
        "the needle must be guided."
    )
