# SPDX-License-Identifier: Apache-2.0
"""Tables of bench tests: headers, units, preambles, columns by position, and what is refused."""

import numpy as np
import pytest

import needleforce as nf
from needleforce.bench_tests import (
    elastica_deflection,
    needle_estimate,
    nominal_stress,
    read_bending,
    read_stress,
    tissue_estimate,
)

STRETCH = np.linspace(1.0, 1.2, 21)
STRESS = nominal_stress("neo_hookean", STRETCH, [116e3 / 3])  # Pa
GAUGE, AREA = 20e-3, 50e-6


def written(tmp_path, columns, header="", delimiter=",", before="", decimal="."):
    rows = [delimiter.join(f"{value:.8g}".replace(".", decimal) for value in row) for row in zip(*columns)]
    path = tmp_path / "test.csv"
    path.write_text(before + "\n".join([*([header] if header else []), *rows, ""]), encoding="utf-8")
    return path


KPA = 1e-3 * STRESS
FORMS = {
    "suffix": ((STRETCH, KPA), {"header": "stretch,stress_kPa"}, {}),
    "brackets": ((STRETCH, KPA), {"header": "Stretch ratio [-],Nominal stress [kPa]"}, {}),
    "unit row": ((STRETCH, KPA), {"header": '"Stretch","Stress"\n"(1)","(kPa)"', "before": "Specimen 1\n\n"}, {}),
    "preamble": (
        (STRETCH, KPA), {"header": "stretch\tstress, kPa", "delimiter": "\t", "before": "<INFO>\nDate:\ttoday\n"}, {}),
    "numpy comment": ((STRETCH, KPA), {"header": "# stretch stress_kPa", "delimiter": " "}, {}),
    "decimal comma": ((STRETCH, KPA), {"header": "stretch;stress (kPa)", "delimiter": ";", "decimal": ","}, {}),
    "strain in per cent": ((100 * (STRETCH - 1), KPA), {"header": "strain (%),stress (kPa)"}, {}),
    "true strain and stress": ((np.log(STRETCH), KPA * STRETCH), {"header": "true strain,Cauchy stress (kPa)"}, {}),
    "force and length": (
        (1e3 * GAUGE * STRETCH, AREA * STRESS), {"header": "length_mm,load_N"}, {"area": AREA, "gauge_length": GAUGE}),
    "force and displacement": (
        (np.arange(21.0), 1e3 * GAUGE * (STRETCH - 1), AREA * STRESS),
        {"header": "Time,Extension,Load\n(s),(mm),(N)"}, {"area": AREA, "gauge_length": GAUGE}),
    "positions": ((KPA, STRETCH), {}, {"columns": {"stress": "1", "stretch": "2"}, "units": {"stress": "kPa"}}),
    "order by signs": ((KPA, STRETCH), {}, {"units": {"stress": "kPa"}}),
    "strain by position": (
        (STRETCH - 1, KPA), {}, {"columns": {"strain": "1", "stress": "2"}, "units": {"stress": "kPa"}}),
    "compression": ((100 * (1 - 1 / STRETCH), 1e-3 * -nominal_stress("neo_hookean", 1 / STRETCH, [116e3 / 3])),
                    {"header": "Compressive strain (%),Compressive stress (kPa)"}, {}),
}  # fmt: skip


@pytest.mark.parametrize("name", FORMS)
def test_a_table_is_read_whatever_its_form(tmp_path, name):
    columns, form, options = FORMS[name]
    curve, assumptions = read_stress(written(tmp_path, columns, **form), mode="uniaxial", **options)
    stretch = 1 / STRETCH if name == "compression" else STRETCH
    np.testing.assert_allclose(curve.stretch, stretch, rtol=1e-6)
    np.testing.assert_allclose(curve.stress, nominal_stress("neo_hookean", stretch, [116e3 / 3]), rtol=1e-5, atol=0.01)
    assert any("by their signs" in each for each in assumptions) == (name == "order by signs")


@pytest.mark.parametrize(
    "text, message",
    [
        ("", "file is empty"),
        ("stretch,stress\n1,2\n", "stress_"),
        ("stress_kPa\n1\n", "stretch"),
        ("stretch,stress_kPa\n1,x\n2,3\n", "stress_kPa"),
        ("stretch,stress_kPa\n1,\n2,3\n", "must be finite"),
        ("stretch,stress_kPa\n1,0\n1.1,3\n", "at least 3 are needed"),
        ("1.1,1.2\n1.3,1.4\n1.5,1.6\n", "no header.*--column stretch=1"),  # both orders are possible
        ("0,0\n1,2\n2,3\n", "no header"),  # strain or time: not recognised as a stretch
        ("1,0\n1.1,3\n1.2,5\n", "--unit stress=kPa"),
        ("stretch,stress 1 (Pa),stress 2 (Pa)\n1,0,0\n1.1,3,3\n", "ambiguous"),
        ("displacement_mm,stress_kPa\n0,0\n1,3\n", "--gauge-length-mm"),
        ("stretch,force_N\n1,0\n1.1,3\n", "--area-mm2"),
    ],
)
def test_invalid_tables_raise_an_error(tmp_path, text, message):
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(nf.InputError, match=message):
        tissue_estimate(tmp_path / "t.csv")


def test_a_broken_cell_in_the_middle_is_named_by_its_line(tmp_path):
    (tmp_path / "t.csv").write_text("stretch,stress_kPa\n1,0\n1.1,1\n1.2,?\n1.3,3\n1.4,4\n")
    with pytest.raises(nf.InputError, match="line 4"):
        read_stress(tmp_path / "t.csv")


def test_unloading_is_left_out_with_a_note(tmp_path):
    stretch = np.r_[np.linspace(1, 1.2, 100), np.linspace(1.2, 1, 100)]
    stress = 1e-3 * np.r_[np.linspace(0, 20, 100), np.linspace(20, -1, 100)]
    curve, assumptions = read_stress(written(tmp_path, (stretch, stress), header="stretch,stress_kPa"))
    assert len(curve.stretch) == 100 and any("100 of 200" in each for each in assumptions)


def test_bending_and_tension_give_estimates(tmp_path):
    needle = nf.Needle(outer_diameter=0.7e-3, length=0.08, young_modulus=14.1e9)
    position = np.array([8e-3, 12e-3, 16e-3, 20e-3])
    deflection = elastica_deflection(0.1, position, needle)
    columns = (1e3 * position, np.full(4, 100.0), 1e3 * deflection)
    path = written(tmp_path, columns, header="position_mm,force_mN,tip_deflection_mm")
    assert needle_estimate(path, needle).value == pytest.approx(14.1e9, rel=1e-6)
    found = tissue_estimate(written(tmp_path, (STRETCH, KPA), header="stretch,stress_kPa"))
    assert found.value == pytest.approx(116e3, rel=1e-5) and found.low <= 116e3 <= found.high


def test_a_three_point_test_ends_at_its_largest_deflection(tmp_path):
    extension, load = np.r_[0.0:5.0:51j, 4.9:0.0:50j], np.r_[0.0:9.0:51j, 8.0:0.0:50j]
    path = written(tmp_path, (extension, load), header="Extension,Load\n(mm),(N)")
    readings, notes = read_bending(path, three_point=True)
    assert len(readings["force"]) == 51 and readings["deflection"][-1] == pytest.approx(5e-3)
    assert any("51 of 101" in note for note in notes)


def test_files_of_other_laboratories(recordings):
    mach = recordings / "other-labs" / "tension-mach1" / "mach1-04-a.txt"
    curve, _ = read_stress(mach, units={"displacement": "-mm", "force": "-gf"}, area=20e-6, gauge_length=20e-3)
    assert curve.stress.max() * 20e-6 == pytest.approx(153.827456 * 9.80665e-3, rel=1e-6)
    treloar = recordings / "tension" / "Treloar_1944_UT_stress_stretch.txt"
    curve, assumptions = read_stress(treloar, units={"stress": "MPa"})
    assert curve.stretch[-1] == 7.6 and any("column 2 is the stretch" in each for each in assumptions)
    cortex = recordings / "other-labs" / "brain-tissue" / "cortex-compression.txt"
    curve, _ = read_stress(cortex, units={"stress": "kPa"})
    assert curve.stretch.min() == pytest.approx(0.9002, abs=1e-4) and curve.stress.min() < -1.1e3
