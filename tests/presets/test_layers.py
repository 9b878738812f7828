# SPDX-License-Identifier: Apache-2.0
"""Layers in preset files: reading, writing, and errors with their place."""

import re

import pytest

import needleforce as nf
from needleforce.preset_files.build import as_toml

FIRST = """name = "two"
summary = "Two layers."
reference = "by hand"

[needle]
outer_diameter_mm = 0.7
length_mm = 80
young_modulus_GPa = 200

[stiffness]
law = "polynomial"
linear_N_per_m = 100
quadratic_N_per_m2 = 0

[puncture]
law = "puncture_depth"
depth_mm = 2

[friction]
law = "coulomb"
per_length_N_per_m = 10

[cutting]
law = "constant_cutting"
force_N = 0.1
"""
LAYER = """
[[layers]]
top_mm = {top}

[layers.stiffness]
law = "cone_cylinder"
reduced_modulus_kPa = 50
half_angle_deg = 15

[layers.puncture]
law = "puncture_force"
force_N = 0.2

[layers.friction]
law = "coulomb"
per_length_N_per_m = 30

[layers.cutting]
law = "constant_cutting"
force_N = 0.3
"""


def written(text, tmp_path):
    (tmp_path / "two.toml").write_text(text, encoding="utf-8")
    return tmp_path / "two.toml"


def test_missing_parameters_of_a_layer_are_derived_from_the_needle(tmp_path):
    model = nf.preset(written(FIRST + LAYER.format(top=5), tmp_path))
    (deeper,) = model.deeper
    assert deeper.top == 5e-3 and deeper.stiffness.radius == 0.35e-3 and deeper.friction.per_length == 30.0
    assert deeper.relaxation == nf.laws.NoRelaxation()


def test_layers_are_unchanged_by_a_round_trip(tmp_path):
    prony = '\n[layers.relaxation]\nlaw = "prony"\nshare_1 = 0.3\ntime_1_s = 1\n'
    model = nf.preset(written(FIRST + LAYER.format(top=5) + prony + LAYER.format(top=50), tmp_path))
    assert [layer.top for layer in model.layers] == [0.0, 5e-3, 50e-3]
    assert model.deeper[0].relaxation == nf.laws.Prony(0.3, 1.0)
    assert nf.preset(written(as_toml(model), tmp_path)) == model


def test_the_force_in_the_second_layer_is_the_sum_of_its_parts(tmp_path):
    model = nf.preset(written(FIRST + LAYER.format(top=5), tmp_path))
    run = nf.simulate(model, nf.Motion.insert(start=0.0, speed=3e-3, depth=15e-3, withdraw=False))
    # in the second layer the tip cuts with 0.3 N, and the shaft slides along 5 mm of the first and 10 mm of the second
    assert run.force[-1] == pytest.approx(0.3 + 10 * 5e-3 + 30 * 10e-3, rel=1e-3)


@pytest.mark.parametrize(
    "text, match",
    [
        (LAYER.format(top=9) + LAYER.format(top=5), r"\$\.layers\[1\]: layer 3, top.*out of order"),
        (LAYER.format(top=5) + LAYER.format(top=5), r"\$\.layers\[1\]: layer 3, top.*overlap"),
        (LAYER.format(top=1), r"\$\.layers\[0\]: layer 2, top.*two interfaces"),
        (LAYER.format(top=0), r"\$\.layers\[0\]: layer 2, top"),
        (LAYER.replace("top_mm = {top}\n", ""), r"\$\.layers\[0\]: top is missing"),
        (LAYER.format(top='"deep"'), r"\$\.layers\[0\]\.top_mm"),
        (LAYER.format(top=5) + "\n[layers.magic]\n", r"unknown field `magic`.*\$\.layers\[0\]"),
        (LAYER.format(top=5).replace("force_N = 0.2", "force_N = -0.2"), r"\$\.layers\[0\]\.puncture: .*-0\.2"),
        (LAYER.format(top=5).replace("force_N = 0.3", "force_mN = 1\nforce_N = 0.3"), r"layers\[0\]\.cutting.*twice"),
        (LAYER.format(top=5).replace('"coulomb"', '"magic"'), r"Invalid value 'magic'.*\$\.layers\[0\]\.friction"),
        (LAYER.format(top=5).replace("[layers.cutting]\n", "[layers.cuts]\n"), r"\$\.layers\[0\]"),
    ],
)
def test_errors_name_the_layer(text, match, tmp_path):
    with pytest.raises(nf.InputError, match=re.compile(match, re.S)) as error:
        nf.preset(written(FIRST + text, tmp_path))
    assert str(error.value).startswith("two.toml")


def test_a_mechanism_included_twice_is_refused(tmp_path):
    dragged = as_toml(nf.preset("layered")).replace('law = "no_cutting"', 'law = "constant_cutting"\nforce_N = 0.1', 1)
    with pytest.raises(nf.InputError, match="counts the force at the tip already"):
        nf.preset(written(dragged, tmp_path))


def test_relaxation_shares_that_reach_1_are_refused(tmp_path):
    text = as_toml(nf.preset("relaxing")).replace("share_2 = 0.26", "share_2 = 0.69")
    with pytest.raises(nf.InputError, match=r"\$\.relaxation: .*reaches 1"):
        nf.preset(written(text, tmp_path))
