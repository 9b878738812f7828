# SPDX-License-Identifier: Apache-2.0
"""Identified numbers become laws; what a log cannot tell is held at a stated value."""

import math

from .. import core
from ..errors import InputError
from ..mechanics.buckling import equivalent_half_angle
from ..mechanics.contact import contact
from ..models.model import Model
from .one_layer.loading_curves import CURVES

# what identify and compare take as a model's name -> its stiffness law
MODELS = {
    "paper": "cone",
    "cone_cylinder": "cone_cylinder",
    "power_law": "power_law",
    "okamura": "polynomial",
    "simone": "polynomial",
    "maurin": "exponential",
}
SAME_FORCE = {
    "paper_by_force": "paper",
    "paper_by_energy": "paper",
    "physical": "cone_cylinder",
    "azar": "cone_cylinder",
    "lugre": "cone_cylinder",
    "stick_slip": "cone_cylinder",
    "stribeck": "cone_cylinder",
}
"""Named models that a log at one speed cannot tell from another: what they add is a reason for the puncture, for the
modulus or for the cutting force, friction at other speeds, or a swing about the mean."""
LAYERED = {"layered": True, "layered_as_fitted": False}
"""Name of the model -> whether it is the passive form."""
MECHANICAL = ("paper", "cone_cylinder")
"""What ``identify`` chooses from unasked: a modulus, and so another tip or tissue, follows from these alone."""
COMPARED = ("paper", "cone_cylinder", "power_law", "okamura", "maurin")
"""Each loading curve once."""
NOMINAL_HALF_ANGLE = math.radians(45.0)
LEAST_PRESLIDING = 1e-6  # [m]; shorter than any recorded depth tells


def stiffness_law(name: str) -> str:
    """The stiffness law of a model's name."""
    if name not in MODELS:
        known = ", ".join((*MODELS, *LAYERED))
        raise InputError("model", repr(name), "not one that can be identified", next_step=f"Give one of {known}.")
    return MODELS[name]


def half_angle(needle) -> float:
    """The tip's half angle [rad], or 45 degrees where no tip is known: a log tells only its product with the
    modulus."""
    return equivalent_half_angle(needle.tip) if needle is not None and needle.tip is not None else NOMINAL_HALF_ANGLE


def needle_saturation(needle) -> float | None:
    """The depth [m] at which a cone on this needle's shank saturates, or None where tip or needle are unknown."""
    if needle is None or needle.tip is None:
        return None
    return contact(needle.tip, contact_radius=needle.radius, reduced_modulus=1.0).depth


def model_of(values: dict[str, float], law: str, needle=None, name: str = "identified", reference: str = "") -> Model:
    """The model of a stiffness law's fitted values (names as in ``CycleFit``); InputError where a value lies outside a
    law's range."""
    curve = CURVES[law]
    # friction turns over twice its elastic travel; the cutting force unloads meanwhile
    presliding = max(values.get("presliding", 0.0), LEAST_PRESLIDING)
    return Model(
        stiffness=curve.stiffness(values, half_angle(needle)),
        puncture=core.laws.PunctureDepth(values["puncture_indentation"]),
        friction=core.laws.Coulomb(values["friction_per_length"], presliding),
        cutting=core.laws.ConstantCutting(values["cutting_force"], 2.0 * presliding),
        name=name,
        summary="Identified from recordings.",
        reference=reference or "identified by needleforce",
        doubts=(UNKNOWN_TIP,) if curve.tells_modulus and (needle is None or needle.tip is None) else (),
        needle=needle,
    )


UNKNOWN_TIP = (
    "tip: none was given, so reduced modulus and radius are those of a cone with a half angle of 45 degrees; "
    "only the products that set the force are identified"
)
