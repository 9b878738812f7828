# SPDX-License-Identifier: Apache-2.0
"""A checked preset file becomes a model; laws take what they lack from needle, tissue and foundation."""

from .. import core
from ..errors import InputError
from ..foundation import friction_per_length
from ..model import Model
from .schema import FAMILIES, laws_of
from .units_in_keys import keys, to_si

NO_POISSON = (
    "It is never assumed: with the paper's numbers 0.5 (an incompressible gel) puts the peak "
    "force 32 % above the measured one, "
    "and the measured peak implies 0.115. Give poisson_ratio, or the stiffness law's reduced_modulus."
)


def build(file) -> Model:
    """The model of a preset file; InputError with the path inside the file for what is missing or impossible."""
    needle = make_needle(file.needle)
    parts = {family: _law(family, getattr(file, family), file, needle) for family in FAMILIES}
    tissue = _tissue(file.tissue) if file.tissue is not None and file.tissue.poisson_ratio is not None else None
    about = {"name": file.name, "summary": file.summary, "reference": file.reference, "doubts": file.doubts}
    return Model(**parts, **about, needle=needle, tissue=tissue)


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
    tip = None
    if section.tip is not None:
        tip = _make(core.tips.Cone, given(section.tip, core.tips.Cone.table(), "$.needle.tip"), "$.needle.tip")
    return _make(core.Needle, given(section, core.Needle.table(), "$.needle") | {"tip": tip}, "$.needle")


def _tissue(section):
    values = given(section, core.Tissue.table(), "$.tissue")
    if "poisson_ratio" not in values:
        raise InputError("tissue.poisson_ratio", "missing", "needed for the reduced modulus", "$.tissue", NO_POISSON)
    return _make(core.Tissue, values, "$.tissue")


def _law(family: str, section, file, needle):
    place = f"$.{family}"
    law = next(law for law in laws_of(family) if law.name == section.__struct_config__.tag)
    values = given(section, law.table(), place)
    for row in law.table():
        if row["name"] not in values and row["name"] in DERIVED:
            values |= DERIVED[row["name"]](file, needle)
    return _make(law, values, place)


def _reduced_modulus(file, needle) -> dict:
    if needle is None or file.tissue is None:
        return {}
    return {"reduced_modulus": core.reduced_modulus(needle, _tissue(file.tissue))}


def _half_angle(file, needle) -> dict:
    return {"half_angle": needle.tip.half_angle} if needle is not None and needle.tip is not None else {}


def _radius(file, needle) -> dict:
    return {"radius": needle.radius} if needle is not None else {}


def _per_length(file, needle) -> dict:
    source = file.foundation
    if source is None or needle is None or file.tissue is None:
        return {}
    value = friction_per_length(
        needle,
        _tissue(file.tissue),
        source.friction_coefficient,
        reading=source.reading,
        embedment_factor=source.embedment_factor,
    )
    return {"per_length": value}


# what a law may take from elsewhere in the file when its own section does not give it
DERIVED = {"reduced_modulus": _reduced_modulus, "half_angle": _half_angle, "radius": _radius, "per_length": _per_length}
