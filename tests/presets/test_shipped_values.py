# SPDX-License-Identifier: Apache-2.0
"""Forces of the shipped presets against published values, or values computed by hand from published ones."""

import math

import numpy as np
import pytest

import needleforce as nf
from needleforce.references import published_values

PEAK, DEPTH = 0.2101, 3.237e-3  # the paper's greatest stiffness force [N] and its depth [m]
PEAK_SD, DEPTH_SD = 0.0105, 0.1347e-3  # the standard deviations of five insertions [N, m]
YOUNG = 116e3  # the paper's modulus of the phantom [Pa]


def cut(name, speed, depth=11e-3):
    """Cutting force (n,) [N] while the tip advances beyond the puncture at ``speed`` [m/s]."""
    run = nf.simulate(nf.preset(name), nf.Motion.insert(start=0.0, speed=speed, depth=depth, withdraw=False), 2000.0)
    steady = (run.depth > 5e-3) & (run.velocity > 0.999 * speed)
    return run.axes["cutting"][steady]


@pytest.mark.parametrize("name", ["paper", "paper_by_force", "paper_by_energy", "power_law", "maurin"])
def test_presets_of_the_paper_have_its_peak_force_and_depth(name):
    model = nf.preset(name)
    assert model.puncture_depth == pytest.approx(DEPTH, rel=1e-7)
    assert model.stiffness.force(model.puncture_depth) == pytest.approx(PEAK, rel=1e-7)


def contact_at_the_peak(modulus, shank=None):
    cone = nf.tips.Cone(half_angle=math.radians(15.0))
    return nf.contact(cone, depth=DEPTH, reduced_modulus=modulus, shank_radius=shank)


def test_the_errata_state_the_interval_of_the_implied_poisson_ratio(root):
    # E_r is proportional to F / h^2, with the paper's standard deviations of force and depth
    found = nf.preset("paper").stiffness.reduced_modulus
    sd = found * math.hypot(PEAK_SD / PEAK, 2 * DEPTH_SD / DEPTH)
    one, two = (math.sqrt(1 - YOUNG / (found + k * sd)) for k in (1, 2))
    page, preset = (root / "docs" / "explanation" / "mechanics.md").read_text(), nf.preset("paper").doubts[0]
    assert found - sd < YOUNG and f"$E_r = {found / 1e3:.1f} \\pm {sd / 1e3:.1f}$ kPa" in page
    assert f"spans 0 to {one:.2f}, two span 0 to {two:.2f}" in page and f"0 to {two:.2f} within two" in preset
    assert f"${100 * (contact_at_the_peak(YOUNG).force / PEAK - 1):.1f}$ %" in page
    assert f"{(YOUNG / 0.75 - found) / sd:.1f} standard deviations away" in page


def test_the_errata_state_the_distance_of_the_physical_peak_in_deviations_and_standard_errors(root):
    peak = contact_at_the_peak(YOUNG / 0.75, shank=0.35e-3)
    combined = math.hypot(PEAK_SD, peak.slope * DEPTH_SD)
    away = (peak.force - PEAK) / combined
    page, doubt = (root / "docs" / "explanation" / "mechanics.md").read_text(), nf.preset("physical").doubts[0]
    assert f"{peak.force:.3f} N is {away:.2f} combined standard deviations of a single insertion" in page
    for text in (page, doubt):
        assert f"{away * math.sqrt(5):.1f} standard errors" in text


def test_stick_slip_has_the_papers_cutting_force_at_both_speeds():
    slow, fast = cut("stick_slip", 1e-3), cut("stick_slip", 3e-3)
    # at 1 mm/s the paper reports 0.04 to 0.1 N, at 3 mm/s a mean of 0.0776 N
    assert slow.min() == pytest.approx(0.04, abs=2e-4) and slow.max() == pytest.approx(0.10, abs=2e-4)
    assert fast[len(fast) // 2 :] == pytest.approx(0.0776, rel=1e-3)  # the first cycles are not yet steady


def test_stribeck_oscillates_below_its_critical_speed_only():
    slow, fast = cut("stribeck", 1e-3), cut("stribeck", 3e-3)
    assert np.ptp(slow) > 0.05
    # F_k + (F_s - F_k) exp(-V / v_s) + c V, by hand
    assert fast[-1] == pytest.approx(0.0033 + 0.0967 * math.exp(-3 / 0.5714) + 20.73 * 3e-3, rel=1e-3)


@pytest.mark.parametrize(
    "name, crack",
    [("azar", 0.0776), ("gokgol_liver", 164 * 0.7e-3), ("porcine_liver_toughness", (76 + 185) / 2 * 0.7e-3)],
)
def test_fracture_force_is_toughness_times_width_plus_spreading(name, crack):
    model = nf.preset(name)
    spread = math.pi / 4 * model.tissue.young_modulus / (1 - 0.5**2) * 0.35e-3**2
    assert cut(name, 3e-3) == pytest.approx(crack + spread, rel=1e-9)


def test_friction_in_agarose_is_coefficient_times_stress_times_circumference():
    assert nf.preset("agarose_friction").friction.per_length == pytest.approx(0.255 * 248.3 * math.pi * 0.36e-3)


def test_okamura_dissipates_in_both_directions():
    model = nf.preset("okamura_liver")
    # 48 N/m x 16.7 mm + 6100 N/m^2 x (16.7 mm)^2
    assert model.stiffness.force(model.puncture_depth) == pytest.approx(2.502829, rel=1e-9)
    run = nf.simulate(model, nf.Motion.insert(start=0.0, speed=3e-3, depth=30e-3))
    inwards, outwards = (run.depth > 20e-3) & (run.velocity == 3e-3), (run.depth < 20e-3) & (run.velocity == -3e-3)
    into, out = (run.axes["friction"][sliding] / run.depth[sliding] for sliding in (inwards, outwards))
    assert into == pytest.approx(10.57 + 212.31 * 3e-3) and out == pytest.approx(-11.96 - 239.08 * 3e-3)
    assert model.friction.viscous_out > 0.0 and any("sign reversed" in doubt for doubt in model.doubts)


def test_lugre_has_the_published_ratio_of_static_to_sliding_friction():
    friction = nf.preset("lugre").friction
    assert friction.static_friction / friction.coulomb == pytest.approx(0.295 / 0.255)


def test_layered_has_the_published_medians():
    model = nf.preset("layered")
    # c = 0.030 N/mm^2 up to h_s = 6.0 mm, then straight: c (2 h_s h - h_s^2)
    assert model.stiffness.force(6.0e-3) == pytest.approx(0.030 * 36, rel=1e-12)
    assert model.stiffness.force(8.0e-3) == pytest.approx(0.030 * (2 * 6 * 8 - 36), rel=1e-12)
    assert len(model.layers) == 2 and model.deeper[0].top == 10e-3


@pytest.mark.parametrize("name", nf.presets())
def test_every_preset_gives_finite_forces_over_a_cycle(name):
    run = nf.simulate(nf.preset(name), nf.Motion.insert(start=-1e-3, speed=3e-3, depth=20e-3, hold=0.5), 500.0)
    assert np.isfinite(run.force).all() and run.force.max() > 0.0
    assert run.force[0] == 0.0 and run.notes == ()


@pytest.mark.parametrize("name", ["okamura_liver", "gokgol_liver", "lugre", "maurin", "layered", "relaxing"])
def test_unverified_and_constructed_values_are_warned_of(name):
    model = nf.preset(name)
    assert model.unverified and any("Unverified" in warning for warning in model.warnings)


def test_published_values_state_where_they_were_read():
    values = published_values()
    assert all(value.quantity and value.value and value.tissue for value in values)
    states = {value.source: value.status for value in values}
    assert states["source paper"] == "verified" and states["CJME 2022"] == "secondary"
    assert states["Okamura, Simone & O'Leary 2004"] == states["Maurin et al. 2004"] == "secondary"
    (toughness,) = (value for value in values if value.source.startswith("Gokgol"))
    assert (toughness.value, toughness.unit, toughness.status) == ("164 +/- 6", "J/m^2", "verified")


def test_citations_are_the_full_references_of_the_works_used():
    cited = "\n".join(nf.preset("layered").citations)
    for words in ("Boussinesq", "layered law", "Fung", "Galin"):
        assert words in cited
    assert "Karnopp" not in cited and "unconfirmed" in "\n".join(nf.preset("okamura_liver").citations)
    own = nf.preset("paper").replace(reference="measured by hand")
    assert own.citations[0] == "measured by hand"
