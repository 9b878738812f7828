# SPDX-License-Identifier: Apache-2.0
import pickle
import re

import pytest

import needleforce as nf
from needleforce.preset_files.build import as_toml, read_needle, save


@pytest.mark.parametrize("name", nf.presets())
def test_every_preset_has_a_reference_and_is_unchanged_by_a_round_trip(name, tmp_path):
    model = nf.preset(name)
    assert model.name == name and len(model.reference) > 10 and model.doubts
    save(model, tmp_path / "again.toml")
    assert nf.preset(tmp_path / "again.toml") == model
    assert pickle.loads(pickle.dumps(model.stiffness)) == model.stiffness


def test_preset_paper_has_the_papers_peak_exactly_and_paper_116_nearly():
    force = {name: nf.preset(name).stiffness.force(3.237e-3) for name in ("paper", "paper_116", "physical")}
    assert force["paper"] == pytest.approx(0.2101, rel=1e-12)
    assert force["paper_116"] == pytest.approx(0.2073365956887147, rel=1e-12)
    assert force["physical"] == pytest.approx(0.239388, rel=1e-4)  # rigid needle; the steel one is softer by 1e-6


def test_physical_derives_its_modulus_from_needle_and_tissue():
    model = nf.preset("physical")
    assert model.stiffness.reduced_modulus == nf.reduced_modulus(model.needle, model.tissue)
    assert model.stiffness.radius == 0.35e-3
    assert not any("wider than the needle" in warning for warning in model.warnings)
    assert any("wider than the needle" in warning for warning in nf.preset("paper").warnings)


@pytest.fixture
def text():
    return as_toml(nf.preset("physical"))


def refused(text, tmp_path, match):
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
    with pytest.raises(nf.InputError, match=match) as error:
        nf.preset(tmp_path / "mine.toml")
    assert str(error.value).startswith("mine.toml")


@pytest.mark.parametrize(
    "old, new, match",
    [
        ("[tissue]", "[tisue]", "unknown field `tisue`"),
        ("poisson_ratio = 0.5", "poison_ratio = 0.5", r"unknown field `poison_ratio`.*\$\.tissue"),
        ("poisson_ratio = 0.5", "poisson_ratio = 0.7", r"\$\.tissue.*poisson_ratio is 0\.7"),
        ("reference = ", "source = ", "reference|source"),
        ('law = "coulomb"', 'law = "magic"', r"Invalid value 'magic'.*\$\.friction.*Known: coulomb, "),
        ('shape = "cone"', 'shape = "bevel"', r"'bevel'.*Did you mean lancet_bevel\? Known: cone, .*, profile\."),
        ("outer_diameter_m = ", "diameter_m = ", "`diameter_m`.*Did you mean outer_diameter_m"),
        ("outer_diameter_m = ", "gauge = ", "`gauge`.*Known: outer_diameter_m, outer_diameter_mm"),
        ("half_angle_rad = ", "#", "cone.half_angle is missing, needed as half_angle_rad or half_angle_deg"),
        ('shape = "cone"', 'shape = "lancet_bevel"\nequivalence = "equal"', "'equal'.*Did you mean equal_"),
        ("force_N = 0.0776", "force_N = -0.0776", r"\$\.cutting.*-0\.0776"),
        ("force_N = 0.0776", 'force_N = "a lot"', r"\$\.cutting\.force_N"),
        ("force_N = 0.0776", "force_N = 0.0776\nforce_mN = 77.6", r"\$\.cutting.*given twice"),
        ("half_angle_rad = ", "half_angle_deg = 95 #", r"\$\.needle\.tip.*half_angle_deg is 95, outside 0\.1 to 89\.9"),
        ("young_modulus_Pa = 116000.0", "young_modulus_Pa = nan", r"\$\.tissue.*nan"),
        ("[needle]", "[[needle", "mine.toml"),
    ],
)
def test_errors_name_the_place_in_the_file(text, tmp_path, old, new, match):
    refused(text.replace(old, new), tmp_path, re.compile(match, re.S))


def test_the_error_for_a_missing_poisson_ratio_gives_its_effect(text, tmp_path):
    without = re.sub(r"reduced_modulus_Pa = .*\n", "", text.replace("poisson_ratio = 0.5\n", ""))
    refused(without, tmp_path, "poisson_ratio is missing.*32 %")


def test_friction_from_the_foundation(text, tmp_path):
    section = '[foundation]\nfriction_coefficient = 0.745\nreading = "A"\n'
    (tmp_path / "mine.toml").write_text(re.sub(r"per_length_N_per_m = .*\n", "", text) + section, encoding="utf-8")
    model = nf.preset(tmp_path / "mine.toml")
    assert model.friction.per_length == nf.friction_per_length(model.needle, model.tissue, 0.745)


def test_the_error_for_an_unknown_name_lists_the_presets():
    with pytest.raises(nf.InputError, match="paper_116"):
        nf.preset("papper")
    with pytest.raises(nf.InputError, match="not a file"):
        nf.preset("nowhere.toml")


def test_a_needle_file_is_read_and_checked(tmp_path):
    (tmp_path / "needle.toml").write_text(
        'reference = "ruler"\n[needle]\nouter_diameter_mm = 0.7\nlength_mm = 80\nyoung_modulus_GPa = 200\n'
        '[needle.tip]\nshape = "cone"\nhalf_angle_deg = 15\n'
    )
    needle = read_needle(tmp_path / "needle.toml")
    assert needle.outer_diameter == 0.7e-3 and needle.tip == nf.tips.Cone(
        half_angle=nf.preset("paper").needle.tip.half_angle
    )
    (tmp_path / "needle.toml").write_text("[needle]\ngauge = 22\n")
    with pytest.raises(nf.InputError, match="gauge"):
        read_needle(tmp_path / "needle.toml")


def test_a_byte_order_mark_is_ignored(tmp_path, text):
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8-sig")
    assert nf.preset(tmp_path / "mine.toml") == nf.preset("physical")
    assert read_needle(tmp_path / "mine.toml") == nf.preset("physical").needle


SHAPES = {
    'shape = "sphere"\nradius_mm = 0.35': nf.tips.Sphere(0.35e-3),
    'shape = "lancet_bevel"\nhalf_angle_rad = 0.25\nequivalence = "equal_length"': nf.tips.LancetBevel(
        0.25, "equal_length"
    ),
    'shape = "profile"\nradii_mm = [0, 0.1, 0.35]\nheights_mm = [0, 0.1, 0.5]': nf.tips.Profile(
        [0, 1e-4, 0.35e-3], [0, 1e-4, 5e-4]
    ),
    'shape = "tangent_ogive"\nradius_mm = 0.35\nlength_mm = 1.3': nf.tips.TangentOgive(0.35e-3, 1.3e-3),
}


def with_tip(text, shape, law):
    text = re.sub(r'shape = "cone"\nhalf_angle_rad = .*', shape, text)
    return re.sub(r'law = "cone_cylinder"\n(.*)\nhalf_angle_rad = .*\nradius_m = .*', rf'law = "{law}"\n\1', text)


@pytest.mark.parametrize("shape, tip", SHAPES.items(), ids=lambda each: getattr(each, "name", ""))
def test_every_tip_is_unchanged_by_a_round_trip(text, tmp_path, shape, tip):
    (tmp_path / "mine.toml").write_text(with_tip(text, shape, "tip_contact"), encoding="utf-8")
    model = nf.preset(tmp_path / "mine.toml")
    assert model.needle.tip == model.stiffness.tip == tip and model.stiffness.radius == 0.35e-3
    save(model, tmp_path / "again.toml")
    assert nf.preset(tmp_path / "again.toml") == model
    without_needle = model.replace(needle=None)
    save(without_needle, tmp_path / "without_needle.toml")
    assert nf.preset(tmp_path / "without_needle.toml").stiffness == model.stiffness
    assert any("scaling law" in warning for warning in model.warnings)


def test_a_cone_law_uses_the_equivalent_cone_of_a_bevel_and_refuses_a_sphere(text, tmp_path):
    shapes = list(SHAPES)
    (tmp_path / "mine.toml").write_text(with_tip(text, shapes[1], "cone_cylinder"), encoding="utf-8")
    half_angle = nf.preset(tmp_path / "mine.toml").stiffness.half_angle
    assert half_angle == nf.tips.LancetBevel(0.25, "equal_length").equivalent_cone().half_angle
    refused(with_tip(text, shapes[0], "cone_cylinder"), tmp_path, r"\$\.stiffness.*tip\.shape.*sphere.*tip_contact")
    refused(with_tip(text, 'shape = "wedge"', "tip_contact"), tmp_path, r"wedge.*\$\.needle\.tip")
    bad = 'shape = "profile"\nradii_mm = [0, 0.1]\nheights_mm = [0, -0.1]'
    refused(with_tip(text, bad, "tip_contact"), tmp_path, r"\$\.needle\.tip: profile\.heights\[1\]")


def test_steep_and_wide_tips_are_warned_of(text, tmp_path):
    (tmp_path / "mine.toml").write_text(with_tip(text, next(iter(SHAPES)), "tip_contact"), encoding="utf-8")
    model = nf.preset(tmp_path / "mine.toml")
    shallow = model.replace(puncture=nf.laws.PunctureDepth(2e-5))
    assert any("slope at the edge" in warning for warning in model.warnings)
    assert not any("scaling law" in warning for warning in shallow.warnings)
    wide = model.replace(stiffness=model.stiffness.replace(radius=1e-3, tip=nf.tips.Cone(0.26)))
    assert any("stops growing at 1 mm" in warning for warning in wide.warnings)


def test_a_needle_file_is_no_preset_and_the_error_names_where_it_works(tmp_path):
    section = "[needle]\nouter_diameter_mm = 0.7\nlength_mm = 80\nyoung_modulus_GPa = 200\n"
    (tmp_path / "mine.toml").write_text(section, encoding="utf-8")
    assert read_needle(tmp_path / "mine.toml").radius == 0.35e-3
    with pytest.raises(nf.InputError, match=r"a needle file.*needle=\"needle.toml\""):
        nf.preset(tmp_path / "mine.toml")


def test_a_name_that_is_almost_a_preset_is_proposed():
    with pytest.raises(nf.InputError, match="Did you mean paper"):
        nf.preset("papper")


def test_a_tip_that_ends_inside_the_shaft_is_refused_in_millimetres(root):
    body = nf.Needle(outer_diameter=1.27e-3, length=0.1, young_modulus=2e11, tip=nf.tips.Sphere(radius=0.6e-3))
    with pytest.raises(nf.InputError, match=r"sphere that ends at a radius of 0\.6 mm.*0\.635 mm"):
        nf.identify(nf.read(root / "examples" / "insertion.csv"), needle=body)
