# SPDX-License-Identifier: Apache-2.0
"""The vocabulary is a test: a parameter name or a unit outside the glossary fails."""

import re

import needleforce as nf
from needleforce import core
from needleforce.models import parameter_units
from needleforce.models.laws import FAMILIES, laws_of
from needleforce.preset_files.schema import ENDINGS, tips

GLOSSARY = {
    "outer_diameter", "inner_diameter", "length", "young_modulus", "poisson_ratio", "half_angle",
    "reduced_modulus", "radius", "depth", "force", "per_length", "presliding", "dimple_ratio", "unloading",
    "linear", "quadratic", "rate", "exponent", "energy", "scale", "reference_force", "reference_depth",
    "tip_radius", "flat_radius", "transition_radius", "reference_radius", "reference_height", "radii", "heights",
    "coulomb_in", "coulomb_out", "viscous_in", "viscous_out", "static_in", "static_out", "static_band",
    "bristle_stiffness", "bristle_damping", "viscous", "coulomb", "static_friction", "stribeck_speed",
    "stribeck_exponent",
    "recovery_time", "surface_stiffness", "tip_force", "stiffness", "rupture_length", "resting_surface",
    "withdrawal_ratio", "brittleness", "rupture_time",
    "toughness", "crack_length", "plane_strain_modulus", "recovered", "break_force", "arrest_force", "arrest_speed",
    "settlement_ratio", "deflection_length", "bending_length",
    "damping", "static_force", "kinetic_force", "mass", "share_1", "time_1", "share_2", "time_2",
}  # fmt: skip


def tables():
    yield from (core.Needle, core.Tissue, *tips())
    yield from (law for family in FAMILIES for law in laws_of(family))


def test_names_and_units_are_in_the_glossary():
    for owner in tables():
        for row in owner.table():
            assert row["name"] in GLOSSARY, (owner, row["name"])
            assert row["unit"] in {*ENDINGS, "1"}, (owner, row["unit"])


def test_a_parameter_has_one_unit():
    rows = {(row["name"], row["unit"]) for law in tables() for row in law.table()}
    units = {name: unit for name, unit in rows if name in parameter_units.OF_LAWS}
    assert len(units) == sum(name in units for name, _ in rows) and units == parameter_units.OF_LAWS
    assert all(parameter_units.UNITS[name] == unit for name, unit in rows if name in parameter_units.UNITS)


def test_every_law_has_a_family_a_source_and_a_validity():
    names = [law.name for family in FAMILIES for law in laws_of(family)]
    assert len(set(names)) == len(names) == len([x for x in vars(core.laws).values() if isinstance(x, type)])
    for family in FAMILIES:
        for law in laws_of(family):
            assert all(isinstance(x, bool) for x in (law.steps_exactly, law.is_passive, law.is_monotone))
            assert law.source and law.validity and law.summary.endswith(".")


def test_words_of_phase_and_status():
    assert list(nf.Phase) == ["free", "deformation", "insertion", "hold", "extraction"]
    assert {"ok", "outside_range", "invalid_parameter", "not_finite", "no_contact", "no_puncture", "incomplete",
            "unreadable"} == set(nf.Status)  # fmt: skip


def test_the_top_level_is_small_and_complete():
    assert len(nf.__all__) <= 40
    for name in nf.__all__:
        assert getattr(nf, name) is not None


def test_type_checkers_see_the_same_names(root):
    stub = (root / "src" / "needleforce" / "__init__.pyi").read_text(encoding="utf-8")
    homes = {name: home or name for home, name in re.findall(r"from \.([\w.]*) import (\w+) as \2", stub)}
    assert homes == nf._HOME
