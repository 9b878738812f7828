# SPDX-License-Identifier: Apache-2.0
"""Named models: a name is a choice of laws, a preset is such a choice with values."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from .. import core
from ..errors import InputError, did_you_mean
from .laws import FAMILIES, Surroundings, law_called, make_laws

# name: stiffness, puncture, friction, cutting, relaxation; summary; source, in the keys of the bibliography
_TABLE = {
    "paper": (
        "cone puncture_depth coulomb constant_cutting no_relaxation",
        "The paper's complete model: bare cone, friction per length, constant cutting force.",
        "sec. 2.1-2.4",
    ),
    "paper_by_force": (
        "cone puncture_force coulomb constant_cutting no_relaxation",
        "The paper's model with the puncture at a stiffness force instead of a depth.",
        "sec. 2.1-2.4",
    ),
    "paper_by_energy": (
        "cone puncture_energy coulomb constant_cutting no_relaxation",
        "The paper's model with the puncture at a work of indentation.",
        "sec. 2.1-2.4; Azar & Hayward 2008, the criterion",
    ),
    "cone_cylinder": (
        "cone_cylinder puncture_depth coulomb constant_cutting no_relaxation",
        "The paper's model with a contact that stops growing at the needle's radius.",
        "sec. 2.1-2.4; Sneddon 1965; Galin 1953",
    ),
    "physical": (
        "cone_cylinder puncture_depth coulomb constant_cutting no_relaxation",
        "As cone_cylinder, with the modulus from needle and tissue.",
        "sec. 2.1-2.4; Sneddon 1965; Galin 1953",
    ),
    "any_tip": (
        "tip_contact puncture_depth coulomb constant_cutting no_relaxation",
        "The paper's model with the contact of the needle's tip, of any shape, on its shank.",
        "Sneddon 1965; Galin 1953; sec. 2.1-2.4",
    ),
    "power_law": (
        "power_law puncture_depth coulomb constant_cutting no_relaxation",
        "The paper's model with a free power of the depth.",
        "sec. 2.2-2.4; Sneddon 1965",
    ),
    "simone": (
        "polynomial puncture_depth karnopp constant_cutting no_relaxation",
        "Polynomial stiffness, modified Karnopp friction and constant cutting.",
        "Simone & Okamura 2002",
    ),
    "okamura": (
        "polynomial puncture_depth karnopp constant_cutting no_relaxation",
        "The same structure as simone, as published two years later.",
        "Okamura, Simone & O'Leary 2004",
    ),
    "maurin": (
        "exponential puncture_depth coulomb constant_cutting no_relaxation",
        "Exponential stiffness; friction and cutting as in the paper.",
        "Maurin et al. 2004; sec. 2.2-2.4",
    ),
    "azar": (
        "cone_cylinder puncture_depth coulomb fracture no_relaxation",
        "Cutting as fracture work and work of spreading, friction per length.",
        "Azar & Hayward 2008; sec. 2.2-2.4",
    ),
    "lugre": (
        "cone_cylinder puncture_depth lugre constant_cutting no_relaxation",
        "LuGre bristle friction per embedded length, a reconstruction.",
        "Canudas de Wit et al. 1995; Asadian, Kermani & Patel 2012",
    ),
    "stick_slip": (
        "cone_cylinder puncture_depth coulomb stick_slip no_relaxation",
        "Stick–slip cutting below an arrest speed.",
        "sec. 2.3, range of the cutting force; free: the law is this project's",
    ),
    "stribeck": (
        "cone_cylinder puncture_depth coulomb stribeck_cutting no_relaxation",
        "The smooth variant of stick_slip: the force decreases with the crack's speed.",
        "sec. 2.3, range of the cutting force; Stribeck 1902",
    ),
    "relaxing": (
        "cone_cylinder puncture_depth coulomb constant_cutting prony",
        "As cone_cylinder, with elastic forces that relax.",
        "sec. 2.1-2.4; Sneddon 1965; Fung 1993",
    ),
    "relaxing_surface": (
        "cone_cylinder puncture_depth relaxing_surface constant_cutting no_relaxation",
        "As cone_cylinder, with a dimple that recovers after the puncture.",
        "sec. 2.1-2.4; Sneddon 1965",
    ),
    "cubic_foundation": (
        "cone_cylinder puncture_depth cubic_foundation constant_cutting no_relaxation",
        "As cone_cylinder, with friction of a bent shaft on a foundation that hardens, p = k_1 u + k_3 u^3.",
        "sec. 2.1-2.4 and 3, future work; Sneddon 1965; free: offset of the shaft linear behind the tip",
    ),
    "hyperbolic_foundation": (
        "cone_cylinder puncture_depth hyperbolic_foundation constant_cutting no_relaxation",
        "As cone_cylinder, with friction of a bent shaft on a foundation that softens, p = k_1 u / (1 + k_1 u / p_u).",
        "sec. 2.1-2.4 and 3, future work; Sneddon 1965; free: offset of the shaft linear behind the tip",
    ),
    "tanh_foundation": (
        "cone_cylinder puncture_depth tanh_foundation constant_cutting no_relaxation",
        "As cone_cylinder, with friction of a bent shaft on a foundation that softens, p = p_u tanh(k_1 u / p_u).",
        "sec. 2.1-2.4 and 3, future work; Sneddon 1965; free: offset of the shaft linear behind the tip",
    ),
    "friction_alone": (
        "power_law puncture_depth coulomb no_cutting no_relaxation",
        "Friction along the shaft in an existing hole.",
        "sec. 2.2",
    ),
    "layered": (
        "cone_cylinder puncture_depth dragged_tissue no_cutting prony",
        "Tissue dragged along by a spring, gradual rupture and relaxation, passive; two layers are typical.",
        "layered law; Fung 1993",
    ),
    "layered_yielding": (
        "cone_cylinder puncture_depth yielding_tissue no_cutting prony_locked",
        "As layered, with a contact that yields along the travel after the puncture; passive, and predicts as fitted.",
        "layered law; Fung 1993; Kachanov 1958",
    ),
    "layered_as_fitted": (
        "cone_cylinder puncture_depth dragged_tissue_as_fitted no_cutting prony_at_rest",
        "The form of layered that was fitted to recordings; it may return energy.",
        "layered law",
    ),
}


@dataclass(frozen=True)
class NamedModel:
    """One law for each part of the force, a one-sentence summary, and the source of the choice."""

    name: str
    stiffness: str
    puncture: str
    friction: str
    cutting: str
    relaxation: str
    summary: str
    source: str

    @property
    def choice(self) -> dict[str, str]:
        """Family -> name of its law."""
        return {family: getattr(self, family) for family in FAMILIES}


NAMED_MODELS = {
    name: NamedModel(name, *laws.split(), summary, source) for name, (laws, summary, source) in _TABLE.items()
}


def named_model(name: str) -> NamedModel:
    """The choice of laws of a model's name; InputError that lists the names for an unknown one."""
    if name not in NAMED_MODELS:
        known = ", ".join(NAMED_MODELS)
        step = f"{did_you_mean(name, NAMED_MODELS)}Give one of {known}."
        raise InputError("model", repr(name), "not a named model", next_step=step)
    return NAMED_MODELS[name]


def names_of(model: Any) -> tuple[str, ...]:
    """The names whose choice of laws is that of every layer of ``model``; several names may share one choice."""
    chosen = [{family: getattr(layer, family).name for family in FAMILIES} for layer in model.layers]
    return tuple(name for name, named in NAMED_MODELS.items() if all(laws == named.choice for laws in chosen))


def laws_with_values(
    name: str, values: Mapping[str, Any], needle: core.Needle | None = None, tissue: core.Tissue | None = None
) -> dict[str, Any]:
    """The laws of a named model from {family: {parameter: SI value}}; a family without values may be absent.

    Missing parameters are derived from needle and tissue as in preset files. Raises InputError for an unknown name,
    family or parameter, and for a value that is missing or outside its range.
    """
    choice = named_model(name).choice
    for family, numbers in values.items():
        if family not in choice:
            raise InputError("part", repr(family), "unknown", name, f"Give {', '.join(FAMILIES)}.")
        if not isinstance(numbers, Mapping):
            next_step = f"Give its parameters as {family}=dict(...)."
            raise InputError(family, repr(numbers), "not a mapping of parameters to SI values", name, next_step)
    chosen = {family: (law_called(family, law), dict(values.get(family, {}))) for family, law in choice.items()}
    around = Surroundings(needle, None if tissue is None else lambda: tissue)
    return make_laws(chosen, around, f"{name}, ")
