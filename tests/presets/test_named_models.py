# SPDX-License-Identifier: Apache-2.0
import math

import pytest

import needleforce as nf
from needleforce.identification.models import BENT, MODELS
from needleforce.models.laws import FAMILIES, laws_of
from needleforce.models.named_models import NAMED_MODELS, names_of

PAPER = {"puncture": {"depth": 3.237e-3}, "friction": {"per_length": 18.6}, "cutting": {"force": 0.0776}}


@pytest.fixture
def needle():
    tip = nf.tips.Cone(half_angle=0.2617993877991494)
    return nf.Needle(outer_diameter=0.7e-3, length=80e-3, young_modulus=200e9, poisson_ratio=0.3, tip=tip)


@pytest.fixture
def tissue():
    return nf.Tissue(young_modulus=116e3, poisson_ratio=0.5)


def test_every_named_model_has_a_preset_with_its_laws():
    shipped = {name for preset in nf.presets() for name in names_of(nf.preset(preset))}
    assert shipped == set(NAMED_MODELS)


def test_every_preset_has_the_laws_of_a_named_model():
    assert all(names_of(nf.preset(name)) for name in nf.presets())


@pytest.mark.parametrize("name", sorted(set(nf.presets()) & set(NAMED_MODELS)))
def test_a_preset_named_like_a_model_has_its_laws(name):
    assert name in names_of(nf.preset(name))


def test_named_models_consist_of_existing_laws():
    chosen = {(family, law) for named in NAMED_MODELS.values() for family, law in named.choice.items()}
    assert chosen <= {(family, law.name) for family in FAMILIES for law in laws_of(family)}


def test_models_of_identify_are_named_models(root):
    assert set(MODELS) | set(BENT) <= set(NAMED_MODELS)
    recording = nf.read(root / "examples" / "insertion.csv")
    for name in ("paper", "cone_cylinder"):
        assert name in names_of(nf.identify(recording, model=name).model)


def test_a_model_by_name_with_values():
    stiffness = {"rate": 500.0, "scale": 0.05193403787039216}
    model = nf.Model.named("maurin", stiffness=stiffness, **PAPER)
    assert model.name == "maurin" and names_of(model) == ("maurin",)
    # b is the paper's peak over exp(a z_1) - 1
    assert model.stiffness.force(3.237e-3) == pytest.approx(0.2101, rel=1e-12)


def test_missing_parameters_are_derived_from_needle_and_tissue(needle, tissue):
    model = nf.Model.named("physical", needle=needle, tissue=tissue, **PAPER)
    assert model.stiffness == nf.laws.ConeCylinder(nf.reduced_modulus(needle, tissue), needle.tip.half_angle, 0.35e-3)
    assert model.needle == needle and model.tissue == tissue


def test_a_given_value_has_priority_over_needle_and_tissue(needle, tissue):
    model = nf.Model.named("physical", needle=needle, tissue=tissue, stiffness={"reduced_modulus": 1e5}, **PAPER)
    assert model.stiffness.reduced_modulus == 1e5 and model.stiffness.radius == 0.35e-3


def test_spreading_uses_the_plane_strain_modulus(needle, tissue):
    cutting = {"toughness": 164.0, "crack_length": 0.7e-3}
    model = nf.Model.named("azar", needle=needle, tissue=tissue, **PAPER | {"cutting": cutting})
    assert model.cutting.plane_strain_modulus == pytest.approx(116e3 / 0.75)
    # (pi / 4) E' R^2 of a slit opened to the needle's radius
    assert model.cutting.spreading == pytest.approx(math.pi / 4 * 116e3 / 0.75 * 0.35e-3**2)


def test_without_tissue_there_is_no_spreading(needle):
    stiffness = {"reduced_modulus": 116e3}
    cutting = {"toughness": 164.0, "crack_length": 0.7e-3}
    model = nf.Model.named("azar", needle=needle, stiffness=stiffness, **PAPER | {"cutting": cutting})
    assert model.cutting.spreading == 0.0


def test_relaxing_surface_derives_flat_punch_stiffness_and_tip_force(needle):
    friction = {"per_length": 18.6, "recovery_time": 1.0}
    model = nf.Model.named(
        "relaxing_surface", needle=needle, stiffness={"reduced_modulus": 116e3}, **PAPER | {"friction": friction}
    )
    assert model.friction.surface_stiffness == pytest.approx(2 * 116e3 * 0.35e-3)
    assert model.friction.tip_force == 0.0776


def test_the_error_for_a_named_model_given_as_a_preset_lists_its_presets():
    with pytest.raises(nf.InputError, match=r"a named model without values.*okamura_liver"):
        nf.preset("simone")


@pytest.mark.parametrize(
    "name, values, match",
    [
        ("maurn", {}, "'maurn', not a named model.*Did you mean maurin"),
        ("okamura", {}, r"stiffness.linear \[N/m\], stiffness.quadratic .*puncture.depth \[m\].*cutting.force \[N\]"),
        ("maurin", PAPER, r"maurin: .*needed are stiffness.rate \[1/m\], stiffness.scale \[N\]"),
        ("maurin", PAPER | {"stiffness": {"rate": 500.0, "scale": -1.0}}, "exponential.scale is -1.0, outside"),
        ("maurin", PAPER | {"stiffness": {"rate": 500.0, "scale": 1.0, "b": 1}}, "It takes: rate scale"),
        ("maurin", PAPER | {"rigidity": {}}, "'rigidity', unknown. Give stiffness, puncture"),
        ("maurin", PAPER | {"stiffness": 3.0}, "not a mapping"),
        ("azar", PAPER | {"stiffness": {"reduced_modulus": 1e5, "half_angle": 0.3, "radius": 3e-4},
                          "cutting": {"toughness": 100.0}}, "fracture.crack_length is missing.*D for a slit"),
    ],
)  # fmt: skip
def test_errors_name_model_part_and_parameter(name, values, match):
    with pytest.raises(nf.InputError, match=match):
        nf.Model.named(name, **values)
