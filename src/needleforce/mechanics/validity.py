# SPDX-License-Identifier: Apache-2.0
"""Limits of validity, as sentences for the limits that a model crosses."""

import math
from typing import Any

from .buckling import buckling_force, equivalent_half_angle

SMALL_SLOPE_ANGLE = math.radians(60.0)
FRICTION_LIMIT = 12e-3  # [m] source paper sec. 2.2: deeper, the needle does not stay straight
THIN_SHARE = 0.1  # of a specimen's thickness; at a larger indentation its bottom matters and it is not a half-space
FRICTION_BY_LENGTH = ("coulomb", "relaxing_surface", "karnopp", "lugre")


def crossed_limits(model: Any) -> tuple[str, ...]:
    """A sentence for each limit that the model's parameters cross."""
    contacts = [check(layer, model) for check in (_slope, _saturation) for layer in model.layers]
    found = dict.fromkeys((*contacts, _buckling(model), _reach(model), _unverified(model)))
    return tuple(sentence for sentence in found if sentence)


def crossed_by_depth(model: Any, deepest: float) -> tuple[str, ...]:
    """A sentence for each limit that ``model`` crosses when the tip reaches ``deepest`` [m]."""
    by_length = any(layer.friction.name in FRICTION_BY_LENGTH for layer in model.layers)
    if not by_length or not deepest > FRICTION_LIMIT:
        return ()
    return (
        f"The tip goes {1e3 * deepest:.3g} mm deep; the source paper reports friction proportional to the embedded "
        f"length down to {1e3 * FRICTION_LIMIT:.3g} mm.",
    )


def _slope(layer: Any, model: Any) -> str:
    tip = getattr(layer.stiffness, "tip", None)
    if tip is not None and not hasattr(tip, "equivalent_cone"):
        return _slope_of_profile(layer, tip)
    angle = equivalent_half_angle(tip) if tip is not None else getattr(layer.stiffness, "half_angle", math.pi / 2)
    # without a tip the angle is arbitrary: only its product with the modulus is identified
    has_tip = tip is not None or (model.needle is not None and model.needle.tip is not None)
    if angle >= SMALL_SLOPE_ANGLE or not has_tip:
        return ""
    strain = 0.2 / math.tan(angle)
    return (
        f"The tip's half angle of {math.degrees(angle):.3g} degrees is below 60: representative strain {strain:.2f}, "
        "so linear contact theory is a scaling law here, not a prediction."
    )


def _slope_of_profile(layer: Any, tip: Any) -> str:
    # dF/dh = 2 E_r a; the slope of a tip is largest at the edge of its contact
    contact = 0.5 * layer.stiffness.slope(layer.laws.puncture_depth) / layer.stiffness.reduced_modulus
    slope = tip.slope(min(contact, tip.end * (1 - 1e-9)))
    if slope <= 1 / math.tan(SMALL_SLOPE_ANGLE):
        return ""
    return (
        f"At puncture the tip's slope at the edge of the contact is {slope:.3g}, which is that of a half angle of "
        f"{math.degrees(math.atan2(1, slope)):.3g} degrees, below 60: representative strain {0.2 * slope:.2f}, so "
        "linear contact theory is a scaling law here, not a prediction."
    )


def _saturation(layer: Any, model: Any) -> str:
    radius = model.needle.radius if model.needle is not None else math.inf
    max_radius = min(layer.stiffness.radius, layer.stiffness.tip.end) if layer.stiffness.name == "tip_contact" else 0.0
    if max_radius > radius * (1 + 1e-9):
        return (
            f"The contact stops growing at {1e3 * max_radius:.3g} mm, wider than the needle "
            f"({1e3 * radius:.3g} mm): give the law the needle's radius."
        )
    if layer.stiffness.name != "cone":
        return ""
    contact = 2.0 * layer.laws.puncture_depth * math.tan(layer.stiffness.half_angle) / math.pi
    if contact <= radius:
        return ""
    return (
        f"At puncture the bare cone's contact radius is {1e3 * contact:.3g} mm, wider than the "
        f"needle ({1e3 * radius:.3g} mm): use the law cone_cylinder."
    )


def _buckling(model: Any) -> str:
    if model.needle is None:
        return ""
    critical = buckling_force(model.needle)
    peak = model.stiffness.force(model.puncture_depth)
    if peak <= critical:
        return ""
    return (
        f"The model's force at puncture, {peak:.3g} N, exceeds the buckling load of a clamped needle with a "
        f"free tip, {critical:.3g} N: the needle must be guided."
    )


def _reach(model: Any) -> str:
    for number, layer in enumerate(model.layers, 1):
        reach, puncture = layer.stiffness.reach, layer.laws.puncture_depth
        if puncture > reach:
            return (
                f"Layer {number} punctures at {1e3 * puncture:.3g} mm, beyond the {1e3 * reach:.3g} mm to which the "
                f"law {layer.stiffness.name} holds: its force is continued as a straight line."
            )
    return ""


def _unverified(model: Any) -> str:
    return f"Unverified: {'; '.join(model.unverified)}." if model.unverified else ""
