# SPDX-License-Identifier: Apache-2.0
import pickle
import re

import pytest

import needleforce as nf
from needleforce.preset_files.needle_file import read_needle
from needleforce.preset_files.writing import as_toml, save


@pytest.mark.parametrize("name", nf.presets())
def test_every_preset_says_where_it_comes_from_and_survives_a_round_trip(name, tmp_path):
    model = nf.preset(name)
    assert model.name == name and len(model.reference) > 10 and model.doubts
    save(model, tmp_path / "again.toml")
    assert nf.preset(tmp_path / "again.toml") == model
    assert pickle.loads(pickle.dumps(model.stiffness)) == model.stiffness


def test_the_paper_meets_its_peak_exactly_and_116_kpa_nearly():
    force = {name: nf.preset(name).stiffness.force(3.237e-3) for name in ("paper", "paper_116", "physical")}
    assert force["paper"] == pytest.approx(0.2101, rel=1e-12)
    assert force["paper_116"] == pytest.approx(0.2073365956887147, rel=1e-12)
    assert force["physical"] == pytest.approx(0.239388, rel=1e-4)  # rigid needle; the steel one is softer by 1e-6


def test_physical_takes_its_modulus_from_needle_and_tissue():
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
        ('law = "coulomb"', 'law = "magic"', r"Invalid value 'magic'.*\$\.friction"),
        ("force_N = 0.0776", "force_N = -0.0776", r"\$\.cutting.*-0\.0776"),
        ("force_N = 0.0776", 'force_N = "a lot"', r"\$\.cutting\.force_N"),
        ("force_N = 0.0776", "force_N = 0.0776\nforce_mN = 77.6", r"\$\.cutting.*given twice"),
        ("half_angle_rad = ", "half_angle_deg = 90 #", r"\$\.needle\.tip.*half_angle"),
        ("young_modulus_Pa = 116000.0", "young_modulus_Pa = nan", r"\$\.tissue.*nan"),
        ("[needle]", "[[needle", "mine.toml"),
    ],
)
def test_refusals_name_the_place(text, tmp_path, old, new, match):
    refused(text.replace(old, new), tmp_path, re.compile(match, re.S))


def test_a_missing_poisson_ratio_says_why_it_matters(text, tmp_path):
    without = re.sub(r"reduced_modulus_Pa = .*\n", "", text.replace("poisson_ratio = 0.5\n", ""))
    refused(without, tmp_path, "poisson_ratio is missing.*32 %")


def test_friction_from_the_foundation(text, tmp_path):
    section = '[foundation]\nfriction_coefficient = 0.745\nreading = "A"\n'
    (tmp_path / "mine.toml").write_text(re.sub(r"per_length_N_per_m = .*\n", "", text) + section, encoding="utf-8")
    model = nf.preset(tmp_path / "mine.toml")
    assert model.friction.per_length == nf.friction_per_length(model.needle, model.tissue, 0.745)


def test_unknown_names_list_the_known():
    with pytest.raises(nf.InputError, match="paper_116"):
        nf.preset("papper")
    with pytest.raises(nf.InputError, match="not a file"):
        nf.preset("nowhere.toml")


def test_a_needle_file(tmp_path):
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


def test_a_byte_order_mark_is_no_text(tmp_path, text):
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8-sig")
    assert nf.preset(tmp_path / "mine.toml") == nf.preset("physical")
    assert read_needle(tmp_path / "mine.toml") == nf.preset("physical").needle
