# SPDX-License-Identifier: Apache-2.0
"""First minus second pass with known truth: each bias has the sign and the size of its closed form.

first = f1 (h - d1) + f_c + S, second = f2 (h - d2) + S, both beyond the puncture, h the indentation.
"""

import dataclasses
import json

import numpy as np
import pytest

import needleforce as nf
from needleforce.identification.estimates import Estimate
from needleforce.identification.one_layer.fit_recording import fitted
from needleforce.identification.one_layer.segmented_recording import segmented
from needleforce.identification.two_pass.bias_terms import spreading_force
from needleforce.identification.two_pass.subtraction import Pair, subtract

PAPER = nf.preset("paper")
F_C, FRICTION, PUNCTURE = 0.0776, 18.6, 3.237e-3
SPREADING = 0.0149  # pi/4 E' R² of 116 kPa, incompressible, and R = 0.35 mm
TERMS = ("dimple", "intercept", "unequal_friction", "spreading_force")


def motion(speed=3e-3, depth=14e-3, start=-3e-3):
    return nf.Motion.insert(start=start, speed=speed, depth=depth, hold=1.0)


def noisy(run, seed, noise=2e-3, surface=0.0, more=0.0):
    """A run with sensor noise and effects that the model omits, where the surface has a depth of its own."""
    force = run.force + more + np.random.default_rng(seed).normal(0, noise, len(run))
    return dataclasses.replace(run, depth=run.depth + surface, force=force)


def first_pass(seed=0, dimple=0.0, spreading=0.0, surface=0.0, noise=2e-3, rate=1000.0, move=None):
    model = PAPER.replace(friction=nf.laws.Coulomb(FRICTION, 20e-6, dimple / PUNCTURE))
    run = nf.simulate(model, move or motion(), rate)
    cutting = (run.axes["cutting"] > 0.0) & (run.velocity > 0.0)
    return noisy(run, seed, noise, surface, spreading * cutting)


def second_pass(
    seed=1000, ratio=1.0, dimple=0.0, spreading=0.0, surface=0.0, noise=2e-3, rate=1000.0, move=None, share=0.0
):
    """Friction along an open hole, with a ``share`` of the first pass's loading where it still deforms."""
    run = nf.simulate(PAPER.replace(cutting=nf.laws.NoCutting()), move or motion(), rate)
    embedded = np.maximum(run.depth - dimple, 0.0)
    force = FRICTION * ratio * embedded * np.sign(run.velocity)
    force += spreading * np.clip(run.depth / 1.3e-3, 0.0, 1.0) ** 2 * (run.velocity > 0)
    force += share * np.where(run.depth < PUNCTURE, run.axes["stiffness"], 0.0)
    return noisy(dataclasses.replace(run, force=force), seed, noise, surface)


def two_passes(firsts, seconds, spreading=None):
    singles = [fitted(segmented(first), ("cone",), None) for first in firsts]
    pairs = [
        Pair(single, second, *(single.fits["cone"].values[name] for name in ("contact_depth", "puncture_indentation")))
        for single, second in zip(singles, seconds)
    ]
    found, refused = subtract(pairs, spreading)
    assert not refused
    return found


def cutting(found):
    return float(np.mean([site.cutting for site in found.sites]))


def term(found, name):
    return next(each for each in found.terms if each.name == name)


def holds_the_truth(found):
    return found.cutting_range[0] - 1e-3 <= F_C <= found.cutting_range[1] + 1e-3


def test_without_biases_rates_grids_starts_depths_and_sites_may_differ():
    slow, deep = motion(start=-1.234e-3, depth=13.3e-3), motion(start=-5e-3, depth=15e-3)
    options = [(1000.0, 100.0, 0.0), (100.0, 1000.0, 2.5e-3), (333.0, 75.7, -4e-3), (1000.0, 1000.0, 0.7e-3)]
    firsts = [first_pass(k, rate=one, surface=zero, move=deep) for k, (one, _, zero) in enumerate(options)]
    seconds = [second_pass(k + 50, rate=two, surface=zero, move=slow) for k, (_, two, zero) in enumerate(options)]
    found = two_passes(firsts, seconds)
    assert [site.cutting for site in found.sites] == pytest.approx([F_C] * 4, abs=2e-3)
    assert [site.friction_slope for site in found.sites] == pytest.approx([FRICTION] * 4, rel=0.02)
    assert not found.upper_bound and holds_the_truth(found)
    assert tuple(each.name for each in found.terms) == TERMS
    for name, true in (("unequal_friction", 0.0), ("intercept", 0.0)):
        assert term(found, name).low <= true <= term(found, name).high
    assert not any("mm/s" in sentence or "share" in sentence for sentence in found.biases)


def test_a_dimple_of_the_first_pass_lowers_it_by_friction_times_dimple():
    dimple = 0.8e-3
    found = two_passes([first_pass(k, dimple=dimple) for k in range(3)], [second_pass(k) for k in range(3, 6)])
    assert cutting(found) == pytest.approx(F_C - FRICTION * dimple, abs=1e-3)
    bias = term(found, "dimple")
    assert bias.value == pytest.approx(dimple, abs=0.1e-3)  # where the withdrawal leaves the tissue
    # MODEL: all of the puncture indentation would be 0.0602 N
    assert (bias.adds_low, bias.adds_high) == (pytest.approx(-0.0602, rel=0.02), 0.0)
    assert -bias.adds_low > FRICTION * dimple > -bias.adds_high and holds_the_truth(found)
    assert not found.upper_bound


@pytest.mark.parametrize("ratio", [0.241 / 0.349, 0.9, 1.1])
def test_unequal_friction_adds_the_difference_times_the_depth(ratio):
    found = two_passes([first_pass(k) for k in range(3)], [second_pass(k, ratio=ratio) for k in range(3, 6)])
    bias = term(found, "unequal_friction")
    slope = FRICTION * (1.0 - ratio)
    assert bias.low <= slope <= bias.high and bias.value == pytest.approx(slope, abs=0.5)
    middle = np.mean([site.grid.mean() for site in found.sites])
    assert cutting(found) == pytest.approx(F_C + slope * middle, abs=2e-3)
    assert bias.adds_low <= slope * middle <= bias.adds_high
    assert np.sign(bias.adds_low) == np.sign(slope) and holds_the_truth(found) and not found.upper_bound
    assert "not constant" in bias.sentence


def test_the_spreading_force_stays_in_the_second_pass():
    firsts, seconds = [first_pass(0, spreading=SPREADING)], [second_pass(1, spreading=SPREADING)]
    limits = spreading_force(PAPER.needle, Estimate("tissue_young_modulus", 116e3, "Pa", 110e3, 122e3))
    assert limits[1] == pytest.approx(SPREADING, rel=0.01) and limits[0] == pytest.approx(0.75 * SPREADING, rel=0.01)
    with_limits, without = (two_passes(firsts, seconds, given) for given in (limits, None))
    for found in (with_limits, without):
        assert cutting(found) == pytest.approx(F_C, abs=1e-3) and holds_the_truth(found)
        bias = term(found, "intercept")
        assert bias.low <= SPREADING <= bias.high
    assert term(with_limits, "spreading_force").high == limits[1] and np.isnan(term(without, "spreading_force").high)
    # needle and modulus leave no room for a dimple of that pass; without them it may be as deep as the puncture's
    assert term(with_limits, "intercept").adds_high < 2e-3
    assert term(without, "intercept").adds_high == pytest.approx(FRICTION * PUNCTURE, rel=0.1)


def test_an_intercept_near_0_proves_nothing():
    found = two_passes([first_pass(0, spreading=SPREADING)],
                       [second_pass(1, spreading=SPREADING, dimple=0.8e-3)], (SPREADING, SPREADING))  # fmt: skip
    bias = term(found, "intercept")
    assert bias.value == pytest.approx(0.0, abs=1.5e-3)  # the dimple of 0.8 mm cancels the spreading
    assert cutting(found) == pytest.approx(F_C + FRICTION * 0.8e-3, abs=1e-3)
    assert bias.adds_low <= FRICTION * 0.8e-3 <= bias.adds_high and bias.adds_low > 0.01
    assert not found.upper_bound and holds_the_truth(found)


@pytest.mark.parametrize("noise", [2e-3, 20e-3])
def test_friction_alone_is_not_called_deforming(noise):
    for seed in range(10):
        found = two_passes(
            [first_pass(seed, noise=noise, spreading=SPREADING, dimple=0.8e-3)],
            [second_pass(seed + 100, noise=noise, ratio=0.7, spreading=SPREADING, dimple=0.8e-3 * (seed % 2))],
        )
        assert not found.upper_bound, (seed, found.biases[0])


@pytest.mark.parametrize("share", [0.5, 0.75])
def test_a_second_pass_that_still_deforms_gives_an_upper_bound(share):
    found = two_passes([first_pass(0)], [second_pass(1, share=share)])
    site = found.sites[0]
    assert site.stiffness_share == pytest.approx(share, abs=2 * site.stiffness_share_half)
    assert found.upper_bound and "still deform" in found.biases[0] and "upper bound" in found.biases[0]
    assert found.cutting_range[0] == 0.0


def test_a_second_pass_that_drops_gives_an_upper_bound():
    again = noisy(nf.simulate(PAPER.replace(cutting=nf.laws.ConstantCutting(0.02)), motion()), 7)
    found = two_passes([first_pass(0)], [again])
    assert found.upper_bound and "drop as at a puncture" in found.biases[0] and found.sites[0].drops == 1


def test_a_difference_that_no_line_describes_gives_an_upper_bound():
    first = first_pass(0)
    layer = 0.3 * np.exp(-(((first.depth - 7e-3) / 1e-3) ** 2)) * (first.velocity > 0)
    found = two_passes([dataclasses.replace(first, force=first.force + layer)], [second_pass(1)])
    assert found.upper_bound and "neither a constant nor a line" in found.biases[0]


def test_a_cutting_force_that_swings_is_no_unevenness():
    run = first_pass(0)
    oscillating = 0.04 * np.sin(2 * np.pi * run.depth / 1.7e-3) * (run.axes["cutting"] > 0)
    found = two_passes([dataclasses.replace(run, force=run.force + oscillating)], [second_pass(1)])
    assert not found.upper_bound and cutting(found) == pytest.approx(F_C, abs=4e-3)


def test_a_second_pass_beyond_the_hole_cuts_anew_and_counts_no_further():
    hole = 9e-3
    second = second_pass(1)
    fresh = F_C * ((second.depth > hole) & (second.velocity > 0))
    found = two_passes(
        [first_pass(0, move=motion(depth=hole))], [dataclasses.replace(second, force=second.force + fresh)]
    )
    (site,) = found.sites
    assert site.friction_depth.max() <= hole + 1e-5 and site.friction_end <= hole + 1e-5
    assert site.friction_slope == pytest.approx(FRICTION, rel=0.03) and site.cutting == pytest.approx(F_C, abs=2e-3)
    assert any("share 5.7 mm" in sentence for sentence in found.biases)


def test_different_speeds_and_a_contact_above_the_first_are_reported():
    found = two_passes([first_pass(0)], [second_pass(1, move=motion(speed=1e-3))])
    assert any("3 and 1 mm/s" in sentence for sentence in found.biases)
    assert not any("has contact at a smaller depth" in sentence for sentence in found.biases)
    early = two_passes([first_pass(0, surface=1e-3)], [second_pass(1)])
    assert any("has contact at a smaller depth" in sentence for sentence in early.biases)
    # 1 mm too early is 1 mm less of a dimple of the first
    assert cutting(early) == pytest.approx(F_C - FRICTION * 1e-3, abs=2e-3)


def test_a_second_pass_without_an_insertion_is_refused_with_a_note():
    whole = second_pass(1)
    turn = int(np.argmax(whole.depth))
    columns = (getattr(whole, name)[turn:] for name in ("time", "depth", "velocity", "force"))
    for useless in (nf.Recording(*columns), second_pass(1, move=motion(depth=2e-3))):
        fit = nf.identify([first_pass(0)], second_pass=[useless], model="paper")
        assert fit.two_pass is None and any("common depth of both passes" in note for note in fit.recordings[0].notes)
        assert fit.parameters["cutting_force"].value == pytest.approx(F_C, abs=2e-3)  # the first pass's own


def test_terms_and_range_are_in_the_json_and_the_report(tmp_path):
    fit = nf.identify([first_pass(0)], second_pass=[second_pass(1)], model="paper")
    document = json.loads(fit.to_json())["two_pass"]
    assert [each["name"] for each in document["terms"]] == list(TERMS)
    low, high = document["cutting_range"]
    assert low < fit.parameters["cutting_force"].low < fit.parameters["cutting_force"].high < high
    assert f"{1e3 * high:.3g} mN" in fit.two_pass.biases[-1]
    fit.report(tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "range including biases" in page and "is between" in page


def test_the_existing_hole_beside_an_insertion_four_minutes_before(recordings):
    """Control insertion no. 2 of the same specimen and day, as the hole's own first pass was not recorded."""
    folder = recordings / "needle-insertion-rig"
    first, second = (
        nf.read(next(folder.glob(f"*setup__{name}*"))) for name in ("control_2", "control_1_same-location")
    )
    fit = nf.identify([first], second_pass=[second])
    (site,) = fit.two_pass.sites
    depth = 1e3 * (site.grid + fit.parameters["contact_depth"].value)
    upper, deeper = site.difference[(depth > 17.5) & (depth < 22.0)], site.difference[depth > 22.5]
    # read by others: 1.15 to 1.75 N between 17.5 and 22 mm, 0.55 to 0.70 N deeper, stiffness 0.5 to 0.75
    assert 1.15 < np.mean(upper) < 1.75 and np.max(upper) < 1.85 and 0.5 < np.mean(deeper) < 0.9
    assert 0.5 < site.stiffness_share < 0.9
    assert fit.two_pass.upper_bound and not fit.parameters["cutting_force"].identifiable
    assert "upper bound" in fit.parameters["cutting_force"].source
    for reason in ("still deform", "drop as at a puncture", "neither a constant nor a line"):
        assert reason in fit.two_pass.biases[0]
