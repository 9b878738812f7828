# SPDX-License-Identifier: Apache-2.0
import math

import numpy as np
import pytest

import needleforce as nf
from needleforce.models.laws import FAMILIES, laws_of
from needleforce.models.validity import Verdict, applicable_laws


def needle(degrees=None):
    tip = None if degrees is None else nf.tips.Cone(half_angle=math.radians(degrees))
    return nf.Needle(outer_diameter=0.7e-3, length=80e-3, young_modulus=200e9, poisson_ratio=0.3, tip=tip)


TISSUE = nf.Tissue(young_modulus=116e3, poisson_ratio=0.5)


def judged(law, *case, **lengths):
    (found,) = (one for one in applicable_laws(*case, **lengths) if one.law.name == law)
    return found.verdict, found.reason


def test_every_law_gets_one_verdict_and_a_reason():
    found = applicable_laws(needle(15), TISSUE)
    assert [one.law for one in found] == [law for family in FAMILIES for law in laws_of(family)]
    assert all(one.verdict in Verdict and one.reason.endswith(".") for one in found)


def test_a_steep_cone_is_a_scaling_law_only():
    assert judged("cone_cylinder", needle(75), TISSUE)[0] == "valid"
    verdict, reason = judged("cone_cylinder", needle(15), TISSUE)
    # 0.2 cot 15 degrees = 0.746
    assert verdict == "scaling law only" and "0.75" in reason


def test_a_bare_cone_wider_than_its_needle_is_not_applicable():
    # the contact reaches the shank at (pi / 2) 0.35 mm cot 15 degrees = 2.05 mm
    assert judged("cone", needle(15), TISSUE, indentation=2.04e-3)[0] == "scaling law only"
    verdict, reason = judged("cone", needle(15), TISSUE, indentation=3.237e-3)
    assert verdict == "not applicable" and "0.552 mm" in reason and "2.05 mm" in reason
    assert judged("cone_cylinder", needle(15), TISSUE, indentation=3.237e-3)[0] == "scaling law only"


def test_reasons_name_what_is_missing():
    assert "no tissue" in judged("cone", needle(75))[1]
    assert "no tip" in judged("cone", needle(), TISSUE)[1]
    assert "none is given" in judged("cone", None, TISSUE)[1]
    assert judged("relaxing_surface", needle(15))[0] == judged("cone", needle(75))[0] == "not judged"
    # a crack needs no modulus: without a tissue the slit is not spread
    assert judged("fracture", needle(15))[0] == "as fitted"


def test_friction_is_not_applicable_beyond_12_mm():
    assert judged("coulomb", needle(15), TISSUE, depth=11.9e-3)[0] == "as fitted"
    verdict, reason = judged("coulomb", needle(15), TISSUE, depth=12.1e-3)
    assert verdict == "not applicable" and "12.1 mm" in reason


def test_a_half_space_law_is_a_scaling_law_in_a_thin_specimen():
    blunt = needle(75), TISSUE
    assert judged("cone_cylinder", *blunt, indentation=2e-3, thickness=20.1e-3)[0] == "valid"
    assert judged("cone_cylinder", *blunt, indentation=2e-3, thickness=19.9e-3)[0] == "scaling law only"


@pytest.mark.parametrize("length", [0.0, -1e-3, math.nan, math.inf])
def test_lengths_that_are_not_above_zero_are_refused(length):
    with pytest.raises(nf.InputError, match="depth"):
        applicable_laws(needle(15), TISSUE, depth=length)


def test_a_simulation_counts_every_sample_that_is_not_ok():
    # the exponential continues as a straight line beyond 50 e-folds: 50 mm here, and the tip goes to 60
    model = nf.Model.named(
        "maurin",
        stiffness={"rate": 1000.0, "scale": 1e-9},
        puncture={"depth": 0.1},
        friction={"per_length": 1.0},
        cutting={"force": 0.1},
    )
    run = nf.simulate(model, nf.Motion.insert(start=0.0, speed=10e-3, depth=60e-3, withdraw=False), 100.0)
    (note,) = run.notes
    assert note.kind == "outside_range" and note.count == np.count_nonzero(run.depth > 50e-3)
    assert any("beyond" in sentence for sentence in run.card.assumptions)


def test_a_simulation_deeper_than_12_mm_has_a_warning():
    shallow, deep = (
        nf.simulate(nf.preset("paper"), nf.Motion.insert(start=0.0, speed=3e-3, depth=z)) for z in (11e-3, 13e-3)
    )
    assert set(deep.card.assumptions) - set(shallow.card.assumptions)
    assert any("13 mm deep" in sentence for sentence in deep.card.assumptions)
    assert not any("deep;" in sentence for sentence in shallow.card.assumptions)


def test_what_the_tip_alone_decides_is_judged_without_a_tissue():
    assert judged("cone_cylinder", needle(15))[0] == "scaling law only"
    assert judged("cone", needle(15), indentation=3e-3)[0] == "not applicable"
