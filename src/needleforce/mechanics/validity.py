# SPDX-License-Identifier: Apache-2.0
"""Limits of validity, said in plain words when a model or a fit crosses them."""

import math

from .buckling import buckling_force, equivalent_half_angle

SMALL_SLOPE_ANGLE = math.radians(60.0)
FRICTION_LIMIT = 12e-3  # the paper, sec. 2.2: beyond this depth the needle no longer stays straight
THIN_SHARE = 0.1  # of a specimen's thickness: deeper indentation feels its bottom, and a half-space does not hold
FRICTION_BY_LENGTH = ("coulomb", "relaxing_surface", "karnopp", "lugre")


def crossed_limits(model) -> tuple[str, ...]:
    """Every limit that the model's own numbers cross; empty where none is."""
    contacts = [say(layer, model) for say in (_slope, _saturation) for layer in model.layers]
    found = dict.fromkeys((*contacts, _buckling(model), _reach(model), _unverified(model)))
    return tuple(sentence for sentence in found if sentence)


def crossed_by_depth(model, deepest: float) -> tuple[str, ...]:
    """The limits that ``model`` crosses by going as deep as ``deepest`` [m]; empty where none is."""
    by_length = any(layer.friction.name in FRICTION_BY_LENGTH for layer in model.layers)
    if not by_length or not deepest > FRICTION_LIMIT:
        return ()
    return (
        f"The tip goes {1e3 * deepest:.3g} mm deep; the source paper sees friction in proportion to the embedded "
        f"length to {1e3 * FRICTION_LIMIT:.3g} mm.",
    )


def _slope(layer, model) -> str:
    tip = getattr(layer.stiffness, "tip", None)
    if tip is not None and not hasattr(tip, "equivalent_cone"):
        return _slope_of_profile(layer, tip)
    angle = equivalent_half_angle(tip) if tip is not None else getattr(layer.stiffness, "half_angle", math.pi / 2)
    # without a tip the angle is a stand-in: only its product with the modulus is known
    told = tip is not None or (model.needle is not None and model.needle.tip is not None)
    if angle >= SMALL_SLOPE_ANGLE or not told:
        return ""
    strain = 0.2 / math.tan(angle)
    return (
        f"The tip's half angle of {math.degrees(angle):.3g} degrees is below 60: representative strain {strain:.2f}, "
        "so linear contact theory is a scaling law here, not a prediction."
    )


def _slope_of_profile(layer, tip) -> str:
    # dF/dh = 2 E_r a; a tip is steepest at the edge of its contact
    contact = 0.5 * layer.stiffness.slope(layer.laws.puncture_depth) / layer.stiffness.reduced_modulus
    slope = tip.slope(min(contact, tip.end * (1 - 1e-9)))
    if slope <= 1 / math.tan(SMALL_SLOPE_ANGLE):
        return ""
    return (
        f"At puncture the tip's slope at the edge of the contact is {slope:.3g}, that of a half angle of "
        f"{math.degrees(math.atan2(1, slope)):.3g} degrees and below 60: representative strain {0.2 * slope:.2f}, so "
        "linear contact theory is a scaling law here, not a prediction."
    )


def _saturation(layer, model) -> str:
    radius = model.needle.radius if model.needle is not None else math.inf
    widest = min(layer.stiffness.radius, layer.stiffness.tip.end) if layer.stiffness.name == "tip_contact" else 0.0
    if widest > radius * (1 + 1e-9):
        return (
            f"The contact stops growing at {1e3 * widest:.3g} mm, wider than the needle "
            f"({1e3 * radius:.3g} mm): give the law the needle's radius."
        )
    if layer.stiffness.name != "cone":
        return ""
    contact = 2.0 * layer.laws.puncture_depth * math.tan(layer.stiffness.half_angle) / math.pi
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


def _reach(model) -> str:
    for number, layer in enumerate(model.layers, 1):
        reach, puncture = layer.stiffness.reach, layer.laws.puncture_depth
        if puncture > reach:
            return (
                f"Layer {number} punctures at {1e3 * puncture:.3g} mm, beyond the {1e3 * reach:.3g} mm to which the "
                f"law {layer.stiffness.name} holds: it goes on straight from there."
            )
    return ""


def _unverified(model) -> str:
    return f"Unverified: {'; '.join(model.unverified)}." if model.unverified else ""
