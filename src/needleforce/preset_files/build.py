# SPDX-License-Identifier: Apache-2.0
"""A checked preset file becomes a model; laws take what they lack from needle, tissue and foundation."""

import re

from .. import core
from ..errors import InputError
from ..models.derived_parameters import Surroundings, make_laws
from ..models.laws import FAMILIES, law_called
from ..models.layer import Layer
from ..models.model import Model
from .schema import TOP, tips
from .units_in_keys import keys, to_si

NO_POISSON = (
    "It is never assumed: with the paper's numbers 0.5 (an incompressible gel) puts the peak "
    "force 32 % above the measured one, "
    "and the measured peak implies 0.115. Give poisson_ratio, or the stiffness law's reduced_modulus."
)


def build(file) -> Model:
    """The model of a preset file; InputError with the path inside the file for what is missing or impossible."""
    needle = make_needle(file.needle)
    parts = _laws(file, file, needle, "$")
    deeper = tuple(_layer(section, file, needle, f"$.layers[{i}]") for i, section in enumerate(file.layers))
    tissue = make_tissue(file.tissue) if file.tissue is not None and file.tissue.poisson_ratio is not None else None
    about = {key: getattr(file, key) for key in ("name", "summary", "reference", "doubts", "unverified")}
    try:
        return Model(**parts, **about, needle=needle, tissue=tissue, deeper=deeper)
    except InputError as error:
        raise error.at(_place_of_layer(error)) from None


def _place_of_layer(error: InputError) -> str:
    """Where in the file a fault of "layer 1", "layer 2" … stands: the first layer is the file's own sections."""
    found = re.match(r"layer ([2-9]),", error.quantity)
    return f"$.layers[{int(found[1]) - 2}]" if found else "$"


def _laws(section, file, needle, place: str) -> dict:
    tissue = None if file.tissue is None else lambda: make_tissue(file.tissue)
    chosen = {}
    for family in FAMILIES:
        numbers = getattr(section, family)
        if numbers is not None:
            law = law_called(family, numbers.__struct_config__.tag)
            values = given(numbers, law.table(), f"{place}.{family}")
            if getattr(numbers, "tip", None) is not None:
                values["tip"] = make_tip(numbers.tip, f"{place}.{family}.tip")
            chosen[family] = (law, values)
    return make_laws(chosen, Surroundings(needle, tissue, file.foundation), f"{place}.")


def _layer(section, file, needle, place: str) -> Layer:
    top = given(section, TOP, place)
    if not top:
        raise InputError("top", "missing", "needed in m", place, "Give the depth where the layer begins.")
    return Layer(**top, **_laws(section, file, needle, place))


def given(section, table: list[dict], place: str) -> dict[str, float]:
    """The numbers a section gives, in SI; InputError where one is given twice in different units."""
    values = {}
    for row in table:
        given_keys = keys(row["name"], row["unit"]).items()
        found = {
            key: to_si(getattr(section, key), factor) for key, factor in given_keys if getattr(section, key) is not None
        }
        if len(found) > 1:
            raise InputError(row["name"], " and ".join(found), "given twice", place, "Keep one of the two.")
        if found:
            values[row["name"]] = next(iter(found.values()))
    return values


def _make(kind, values: dict, place: str):
    try:
        return kind(**values)
    except InputError as error:
        raise error.at(place) from None


def make_needle(section):
    """The needle of a checked section, or None for no section."""
    if section is None:
        return None
    tip = make_tip(section.tip, "$.needle.tip")
    return _make(core.Needle, given(section, core.Needle.table(), "$.needle") | {"tip": tip}, "$.needle")


def make_tip(section, place: str):
    """The tip of a checked section, or None for no section."""
    if section is None:
        return None
    shape = next(tip for tip in tips() if tip.name == section.__struct_config__.tag)
    words = {part: getattr(section, part) for part in shape.parts if getattr(section, part) is not None}
    values = given(section, shape.table(), place)
    missing = [row["name"] for row in shape.table() if row["name"] not in values] if hasattr(shape, "columns") else []
    if missing:
        raise InputError(f"{shape.name}.{missing[0]}", "missing", "needed in m", place, "Give a column of knots.")
    return _make(shape, values | words, place)


def make_tissue(section):
    """The tissue of a checked section; InputError where the Poisson ratio is missing."""
    values = given(section, core.Tissue.table(), "$.tissue")
    if "poisson_ratio" not in values:
        raise InputError("tissue.poisson_ratio", "missing", "needed for the reduced modulus", "$.tissue", NO_POISSON)
    return _make(core.Tissue, values, "$.tissue")
