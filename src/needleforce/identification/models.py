# SPDX-License-Identifier: Apache-2.0
"""Identified values become laws and a model, and with needle and tissue imply further quantities; what a log cannot
tell is held at a stated value."""

import dataclasses
import math

import numpy as np

from .. import core
from ..core import Tissue
from ..errors import InputError
from ..mechanics.buckling import equivalent_half_angle
from ..mechanics.contact import contact
from ..mechanics.foundation import READINGS, friction_coefficient
from ..models.model import Insertion, Model
from ..recording import Recording
from .estimates import Estimate
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
UNKNOWN_TIP = (
    "tip: none was given, so reduced modulus and radius are those of a cone with a half angle of 45 degrees; "
    "only the products that set the force are identified"
)
INCOMPRESSIBLE = 0.5


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
        doubts=(UNKNOWN_TIP,) if curve.gives_modulus and (needle is None or needle.tip is None) else (),
        needle=needle,
    )


def derived(parameters: dict[str, Estimate], needle, tissue: Estimate | None) -> dict[str, Estimate]:
    """``reduced_modulus`` with a tip, of a law that has one; with the tissue's modulus too, the Poisson ratio and
    friction coefficients it implies."""
    if needle is None or needle.tip is None or "stiffness_coefficient" not in parameters:
        return {}
    found = {"reduced_modulus": _reduced_modulus(parameters["stiffness_coefficient"], needle)}
    if tissue is not None:
        found |= _poisson(found["reduced_modulus"], needle, tissue)
        found |= _friction(parameters["friction_per_length"], found, needle, tissue)
    return found


def _reduced_modulus(coefficient: Estimate, needle) -> Estimate:
    factor = 0.5 * math.pi / math.tan(equivalent_half_angle(needle.tip))
    sd = coefficient.between_repeats_sd
    return Estimate(
        "reduced_modulus",
        factor * coefficient.value,
        "Pa",
        factor * coefficient.low,
        factor * coefficient.high,
        None if sd is None else factor * sd,
        True,
        f"stiffness coefficient and a tip of half angle {math.degrees(equivalent_half_angle(needle.tip)):.3g} degrees",
    )


def _poisson(modulus: Estimate, needle, tissue: Estimate) -> dict[str, Estimate]:
    ratio = implied_poisson_ratio(modulus.value, tissue.value, needle)
    corners = [
        implied_poisson_ratio(reduced, young, needle)
        for reduced in (modulus.low, modulus.high)
        for young in (tissue.low, tissue.high)
    ]
    source = f"implied by reduced modulus and {_stated(tissue)}; no measurement of it"
    low, high = _span(corners, lowest=0.0)
    return {"implied_poisson_ratio": Estimate("implied_poisson_ratio", ratio, "1", low, high, None, False, source)}


def _friction(per_length: Estimate, found: dict, needle, tissue: Estimate) -> dict[str, Estimate]:
    implied = found["implied_poisson_ratio"].value
    ratio = implied if 0.0 <= implied <= INCOMPRESSIBLE else INCOMPRESSIBLE
    source = f"implied by friction per length with {_stated(tissue)} and nu = {ratio:.3g}"

    def coefficients(force: float, young: float) -> dict[str, float]:
        body = Tissue(young_modulus=young, poisson_ratio=ratio)
        return implied_friction_coefficients(force, needle, body)

    middle = coefficients(per_length.value, tissue.value)
    ends = [coefficients(f, e) for f in (per_length.low, per_length.high) for e in (tissue.low, tissue.high)]
    made = [_coefficient(reading, middle, ends, source) for reading in middle]
    return {estimate.name: estimate for estimate in made}


def _coefficient(reading: str, middle: dict, ends: list[dict], source: str) -> Estimate:
    low, high = _span([end[reading] for end in ends])
    name = f"friction_coefficient_{reading}"
    return Estimate(name, middle[reading], "1", low, high, None, False, f"{source}, reading {reading}")


def _span(corners: list[float], lowest: float = math.nan) -> tuple[float, float]:
    """Least and greatest of the corners of two intervals; ``lowest`` stands for a corner that has no value."""
    known = [lowest if math.isnan(corner) else corner for corner in corners]
    return min(known), max(known)


def _stated(tissue: Estimate) -> str:
    return f"E = {tissue.value / 1e3:.4g} kPa"


def implied_reduced_modulus(force: float, depth: float, tip, shank_radius: float | None = None) -> float:
    """E_r [Pa] at which ``tip`` needs ``force`` [N] to reach ``depth`` [m]: force is proportional to E_r."""
    return force / contact(tip, depth=depth, reduced_modulus=1.0, shank_radius=shank_radius).force


def implied_poisson_ratio(reduced_modulus: float, young_modulus: float, needle=None) -> float:
    """nu_2 that makes a tissue of ``young_modulus`` [Pa] meet ``reduced_modulus`` [Pa]; NaN where none in 0 to 1 does.

    ``needle`` None is a rigid one; otherwise eq. (4) in full.
    """
    needle_part = 0.0 if needle is None else (1.0 - needle.poisson_ratio**2) / needle.young_modulus
    squared = 1.0 - young_modulus * (1.0 / reduced_modulus - needle_part)
    return math.sqrt(squared) if 0.0 <= squared <= 1.0 else math.nan


def implied_friction_coefficients(per_length: float, needle, tissue) -> dict[str, float]:
    """The friction coefficient under each reading of the paper's foundation formula."""
    return {reading: friction_coefficient(per_length, needle, tissue, reading=reading) for reading in READINGS}


def with_ruptures(model: Model, depths) -> Model:
    """The model whose layers, from the surface down, give way at ``depths`` [m] below the undeformed surface."""
    first, *others = (
        core.laws.PunctureDepth(max(float(depth) - layer.top, 0.0)) for depth, layer in zip(depths, model.layers)
    )
    deeper = [dataclasses.replace(layer, puncture=law) for layer, law in zip(model.deeper, others)]
    return dataclasses.replace(model, puncture=first, deeper=tuple(deeper))


def run_model(model: Model, recording: Recording, contact_depth: float) -> np.ndarray:
    """Force (n,) [N] of ``model`` along a recording whose surface is at ``contact_depth`` [m] in its own zero."""
    dt = np.diff(recording.time, prepend=recording.time[0] - 1.0 / recording.rate)
    return Insertion(model, max_speed=np.inf).run(recording.depth - contact_depth, None, dt)["force"]
