# SPDX-License-Identifier: Apache-2.0
"""Laws and a model from identified values, and the further quantities that needle and tissue imply; parameters that a
recording does not identify are held at a stated value."""

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from .. import core
from ..core import Needle, Tissue
from ..errors import InputError, did_you_mean
from ..mechanics.buckling import equivalent_half_angle
from ..mechanics.contact import contact
from ..mechanics.foundation import LAWS, READINGS, friction_coefficient
from ..models.laws import law_called
from ..models.model import Insertion, Model
from ..models.parameter_units import UNITS
from ..recording import Recording
from .estimates import Estimate
from .motion import DepthSignal, wander_at_rest
from .one_layer.loading_curves import FITS, LoadingCurve
from .one_layer.loading_curves import GRADUAL as GRADUAL_FITS

# name of a model, as in identify and compare -> its stiffness law
MODELS = {
    "paper": "cone",
    "cone_cylinder": "cone_cylinder",
    "power_law": "power_law",
    "okamura": "polynomial",
    "simone": "polynomial",
    "maurin": "exponential",
}
BENT = tuple(LAWS.values())
"""Models of a shaft that bends on a nonlinear foundation, by the name of their friction law, after the contact of a
cone + cylinder."""
GRADUAL = tuple(GRADUAL_FITS)
"""Models of a contact that ruptures gradually, by the name of what is fitted."""
GRADUAL_LAYERS = "gradual_layers"
"""Name of the model of layers that rupture gradually one after another, fitted to insertions alone."""
SAME_FORCE = {
    "paper_by_force": "paper",
    "paper_by_energy": "paper",
    "physical": "cone_cylinder",
    "azar": "cone_cylinder",
    "lugre": "cone_cylinder",
    "stick_slip": "cone_cylinder",
    "stribeck": "cone_cylinder",
}
"""Named models that a recording at one speed does not distinguish from another: they add a reason for the puncture, for
the modulus or for the cutting force, friction at other speeds, or an oscillation about the mean."""
LAYERED = {"layered": "passive", "layered_as_fitted": "as_fitted", "layered_yielding": "yielding"}
"""Name of the model -> form of the layered law."""
MECHANICAL = ("paper", "cone_cylinder")
"""Models from which ``identify`` chooses by default: only these give a modulus, and so the force of another tip."""
COMPARED = ("paper", "cone_cylinder", "power_law", "okamura", "maurin")
"""Each loading curve once."""
OF_LAYERS = (*LAYERED, GRADUAL_LAYERS)
IDENTIFIED = (*MODELS, *BENT, *GRADUAL, *OF_LAYERS)
"""Every name that ``identify`` takes; ``compare`` takes those of ``SAME_FORCE`` too."""
NOMINAL_HALF_ANGLE = math.radians(45.0)  # [rad] of an unknown tip
MIN_PRESLIDING_M = 1e-6  # [m] shorter than the resolution of any recorded depth
UNKNOWN_TIP = (
    "tip: not given; reduced modulus and radius are those of a cone with a half angle of 45 degrees, and only the "
    "products that determine the force are identified"
)
MAX_POISSON_RATIO = 0.5  # of an incompressible tissue


def stiffness_law(name: str) -> str:
    """What is fitted under a model's name, a key of ``FITS``: its stiffness law, or the friction law of a bent
    shaft."""
    if name not in (*MODELS, *BENT, *GRADUAL):
        step = f"{did_you_mean(name, IDENTIFIED)}Give one of {', '.join(IDENTIFIED)}."
        raise InputError("model", repr(name), "it cannot be identified", next_step=step)
    return MODELS.get(name, name)


def model_called(law: str) -> str:
    """The name of the model under which ``stiffness_law`` gives a law."""
    return next((name for name, each in MODELS.items() if each == law), law)


def half_angle(needle: Needle | None) -> float:
    """The tip's half angle [rad], or 45 degrees for an unknown tip: a recording identifies only the product of its
    tangent and the modulus."""
    return equivalent_half_angle(needle.tip) if needle is not None and needle.tip is not None else NOMINAL_HALF_ANGLE


def needle_saturation(needle: Needle | None) -> float | None:
    """The depth [m] at which a cone on this needle's shank saturates; None for an unknown tip or needle."""
    if needle is None or needle.tip is None:
        return None
    tip, reach = needle.tip, needle.tip.end / needle.radius
    if reach < 1.0 - 1e-9:
        value = f"a {tip.name} that ends at a radius of {1e3 * tip.end:.4g} mm"
        step = "Give a tip that reaches the shaft, or the diameter of the shaft behind the tip."
        raise InputError("tip", value, f"inside the shaft's radius of {1e3 * needle.radius:.4g} mm", next_step=step)
    if reach < 1.0 + 1e-9 and tip.end > tip.flat:  # as of a half sphere: the contact nears the shank at no finite depth
        return None
    return contact(needle.tip, contact_radius=needle.radius, reduced_modulus=1.0).depth


def model_of(
    values: dict[str, float], law: str, needle: Needle | None = None, name: str = "identified", reference: str = ""
) -> Model:
    """The model of a stiffness law's fitted values (names as in ``CycleFit``); InputError for a value outside the
    range of a law."""
    curve = FITS[law]
    # friction reverses over twice its presliding; the cutting force unloads over the same travel
    presliding = max(values.get("presliding", 0.0), MIN_PRESLIDING_M)
    return Model(
        stiffness=curve.stiffness(values, half_angle(needle)),
        puncture=core.laws.PunctureDepth(values["rupture_onset" if curve.gradual else "puncture_indentation"]),
        friction=_friction_law(values, curve, presliding),
        cutting=core.laws.ConstantCutting(values["cutting_force"], 2.0 * presliding),
        name=name,
        summary="Identified from recordings.",
        reference=reference or "identified by needleforce",
        doubts=(UNKNOWN_TIP,) if curve.gives_modulus and (needle is None or needle.tip is None) else (),
        needle=needle,
    )


def _friction_law(values: dict[str, float], curve: LoadingCurve, presliding: float) -> Any:
    """Coulomb friction, with a gradual rupture of the contact where the curve has one, or that of a shaft which bends
    over its whole embedded length on a nonlinear foundation."""
    form = curve.foundation
    if curve.gradual:
        rupture = values["rupture_length"], values["rupture_exponent"]
        return core.laws.YieldingCoulomb(values["friction_per_length"], presliding, *rupture)
    if form == "linear":
        return core.laws.Coulomb(values["friction_per_length"], presliding)
    # the travel of a reversal is proportional to the force that reverses
    straight = max(presliding / max(1.0 + values["friction_bend"], 0.1), MIN_PRESLIDING_M)
    return law_called("friction", LAWS[form])(
        per_length=values["friction_per_length"],
        settlement_ratio=values["settlement_ratio"],
        deflection_length=values["deflection_length"],
        presliding=straight,
    )


def derived(parameters: dict[str, Estimate], needle: Needle | None, tissue: Estimate | None) -> dict[str, Estimate]:
    """``reduced_modulus`` of a law that has one and a known tip; with the tissue's modulus also the implied Poisson
    ratio and friction coefficients."""
    if needle is None or needle.tip is None or "stiffness_coefficient" not in parameters:
        return {}
    found = {"reduced_modulus": _reduced_modulus(parameters["stiffness_coefficient"], needle)}
    if tissue is not None:
        found |= _poisson(found["reduced_modulus"], needle, tissue)
        found |= _friction(parameters["friction_per_length"], found, needle, tissue)
    return found


def _reduced_modulus(coefficient: Estimate, needle: Needle) -> Estimate:
    factor = 0.5 * math.pi / math.tan(equivalent_half_angle(needle.tip))
    sd, angle = coefficient.between_repeats_sd, math.degrees(equivalent_half_angle(needle.tip))
    below, above = coefficient.systematic
    return Estimate(
        "reduced_modulus",
        factor * coefficient.value,
        UNITS["reduced_modulus"],
        factor * coefficient.low,
        factor * coefficient.high,
        between_repeats_sd=None if sd is None else factor * sd,
        systematic=(factor * below, factor * above),
        source=f"stiffness coefficient and tip of half angle {angle:.3g} degrees",
    )


def _poisson(modulus: Estimate, needle: Needle, tissue: Estimate) -> dict[str, Estimate]:
    ratio = implied_poisson_ratio(modulus.value, tissue.value, needle)
    corners = [
        implied_poisson_ratio(reduced, young, needle)
        for reduced in (modulus.low, modulus.high)
        for young in (tissue.low, tissue.high)
    ]
    low, high = _span(corners, lowest=0.0)
    source = f"implied by the reduced modulus and {_stated(tissue)}; not measured{_impossible(ratio, low)}"
    name = "implied_poisson_ratio"
    return {name: Estimate(name, ratio, UNITS[name], low, high, identifiable=False, source=source)}


def _impossible(ratio: float, low: float) -> str:
    """What is wrong with an implied Poisson ratio that no isotropic tissue from 0 to incompressible has; empty for a
    possible one."""
    if ratio <= MAX_POISSON_RATIO:
        return ""
    if math.isnan(ratio):
        return "; no ratio gives this: the reduced modulus is below the tissue's modulus"
    if low <= MAX_POISSON_RATIO:
        return f"; outside 0 to {MAX_POISSON_RATIO:g}, which the interval does not exclude"
    return f"; impossible, above the {MAX_POISSON_RATIO:g} of an incompressible tissue: check tip angle and moduli"


def _friction(friction_per_length: Estimate, found: dict, needle: Needle, tissue: Estimate) -> dict[str, Estimate]:
    implied = found["implied_poisson_ratio"].value
    ratio = implied if 0.0 <= implied <= MAX_POISSON_RATIO else MAX_POISSON_RATIO
    source = f"implied by the friction per length with {_stated(tissue)} and nu = {ratio:.3g}"

    def coefficients(force: float, young: float) -> dict[str, float]:
        body = Tissue(young_modulus=young, poisson_ratio=ratio)
        return implied_friction_coefficients(force, needle, body)

    middle = coefficients(friction_per_length.value, tissue.value)
    limits = friction_per_length.low, friction_per_length.high
    ends = [coefficients(f, e) for f in limits for e in (tissue.low, tissue.high)]
    made = [_coefficient(reading, middle, ends, source) for reading in middle]
    return {estimate.name: estimate for estimate in made}


def _coefficient(reading: str, middle: dict, ends: list[dict], source: str) -> Estimate:
    low, high = _span([end[reading] for end in ends])
    name = f"friction_coefficient_{reading}"
    source = f"{source}, reading {reading}"
    return Estimate(name, middle[reading], UNITS[name], low, high, identifiable=False, source=source)


def _span(corners: list[float], lowest: float = math.nan) -> tuple[float, float]:
    """Smallest and largest of the values at the corners of two intervals; ``lowest`` replaces a missing value."""
    known = [lowest if math.isnan(corner) else corner for corner in corners]
    return min(known), max(known)


def _stated(tissue: Estimate) -> str:
    return f"E = {tissue.value / 1e3:.4g} kPa"


def implied_poisson_ratio(reduced_modulus: float, young_modulus: float, needle: Needle | None = None) -> float:
    """Poisson ratio nu_2 for which a tissue of ``young_modulus`` [Pa] has ``reduced_modulus`` [Pa]; NaN if none in 0 to
    1 does.

    ``needle`` None is a rigid needle; otherwise the complete eq. (4) of the paper.
    """
    needle_part = 0.0 if needle is None else (1.0 - needle.poisson_ratio**2) / needle.young_modulus
    squared = 1.0 - young_modulus * (1.0 / reduced_modulus - needle_part)
    return math.sqrt(squared) if 0.0 <= squared <= 1.0 else math.nan


def implied_friction_coefficients(friction_per_length: float, needle: Needle, tissue: Tissue) -> dict[str, float]:
    """The friction coefficient under each reading of the paper's foundation formula."""
    return {reading: friction_coefficient(friction_per_length, needle, tissue, reading=reading) for reading in READINGS}


def with_ruptures(model: Model, depths: Sequence[float] | np.ndarray) -> Model:
    """The model whose layers, from the surface down, rupture at ``depths`` [m] below the undeformed surface."""
    for k, (depth, layer) in enumerate(zip(depths, model.layers)):
        model = _with_law(model, k, puncture=core.laws.PunctureDepth(max(float(depth) - layer.top, 0.0)))
    return model


def with_stiffer_contact(model: Model, layer: int, times: float) -> Model:
    """The model with a contact in one of its layers whose force is so many times as large."""
    law = model.layers[layer].stiffness
    forces = [row["name"] for row in law.table() if row["unit"].startswith(("N", "Pa"))]
    return _with_law(model, layer, stiffness=law.replace(**{name: times * getattr(law, name) for name in forces}))


def _with_law(model: Model, layer: int, **law: Any) -> Model:
    """The model with another law in one of its layers."""
    if layer == 0:
        return dataclasses.replace(model, **law)
    changed = dataclasses.replace(model.deeper[layer - 1], **law)
    return dataclasses.replace(model, deeper=(*model.deeper[: layer - 1], changed, *model.deeper[layer:]))


def run_model(
    model: Model, recording: Recording, contact_depth: float, signal: DepthSignal | None = None
) -> np.ndarray:
    """Force (n,) [N] of ``model`` along a recording whose surface is at ``contact_depth`` [m] in its own zero;
    ``signal`` is that of its depth, where it is known.

    By how far the depth strays in a hold does not move the needle: tissue that sticks would answer it with a force."""
    dt = np.diff(recording.time, prepend=recording.time[0] - 1.0 / recording.rate)
    steady = (signal or DepthSignal(recording.depth)).steady
    steady = core.dead_band(steady, 0.5 * wander_at_rest(recording.time, steady))
    return Insertion(model, max_speed=np.inf).forces(steady - contact_depth, dt)
