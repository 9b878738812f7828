# SPDX-License-Identifier: Apache-2.0
import math

import numpy as np
import pytest

import needleforce as nf
from needleforce.models.applicability import VERDICTS, applicable_laws
from needleforce.models.laws import FAMILIES, laws_of


def needle(degrees=None):
    tip = None if degrees is None else nf.tips.Cone(half_angle=math.radians(degrees))
    return nf.Needle(outer_diameter=0.7e-3, length=80e-3, young_modulus=200e9, poisson_ratio=0.3, tip=tip)


TISSUE = nf.Tissue(young_modulus=116e3, poisson_ratio=0.5)


def said(law, *case, **lengths):
    (found,) = (one for one in applicable_laws(*case, **lengths) if one.law.name == law)
    return found.verdict, found.reason


def test_every_law_gets_one_verdict_and_a_reason():
    found = applicable_laws(needle(15), TISSUE)
    assert [one.law for one in found] == [law for family in FAMILIES for law in laws_of(family)]
    assert all(one.verdict in VERDICTS and one.reason.endswith(".") for one in found)


def test_small_slopes_are_needed():
    assert said("cone_cylinder", needle(75), TISSUE)[0] == "valid"
    verdict, reason = said("cone_cylinder", needle(15), TISSUE)
    # 0.2 cot 15 degrees = 0.746
    assert verdict == "scaling law only" and "0.75" in reason


def test_a_bare_cone_must_not_outgrow_its_needle():
    # the contact reaches the shank at (pi / 2) 0.35 mm cot 15 degrees = 2.05 mm
    assert said("cone", needle(15), TISSUE, indentation=2.04e-3)[0] == "scaling law only"
    verdict, reason = said("cone", needle(15), TISSUE, indentation=3.237e-3)
    assert verdict == "not applicable" and "0.552 mm" in reason and "2.05 mm" in reason
    assert said("cone_cylinder", needle(15), TISSUE, indentation=3.237e-3)[0] == "scaling law only"


def test_what_is_absent_is_named():
    assert "no tissue" in said("cone", needle(75))[1]
    assert "no tip" in said("cone", needle(), TISSUE)[1]
    assert "none is given" in said("cone", None, TISSUE)[1]
    assert said("relaxing_surface", needle(15))[0] == said("cone", needle(75))[0] == "not judged"
    # a crack needs no modulus: spreading the slit is left out by default
    assert said("fracture", needle(15))[0] == "as fitted"


def test_friction_breaks_down_beyond_12_mm():
    assert said("coulomb", needle(15), TISSUE, depth=11.9e-3)[0] == "as fitted"
    verdict, reason = said("coulomb", needle(15), TISSUE, depth=12.1e-3)
    assert verdict == "not applicable" and "12.1 mm" in reason


def test_a_thin_specimen_is_no_half_space():
    blunt = needle(75), TISSUE
    assert said("cone_cylinder", *blunt, indentation=2e-3, thickness=20.1e-3)[0] == "valid"
    assert said("cone_cylinder", *blunt, indentation=2e-3, thickness=19.9e-3)[0] == "scaling law only"


@pytest.mark.parametrize("length", [0.0, -1e-3, math.nan, math.inf])
def test_lengths_are_above_zero(length):
    with pytest.raises(nf.InputError, match="depth"):
        applicable_laws(needle(15), TISSUE, depth=length)


def test_a_simulation_tells_every_sample_that_is_not_ok():
    # the exponential goes on straight beyond 50 e-folds: 50 mm here, and the tip goes to 60
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


def test_a_simulation_deeper_than_12_mm_says_so():
    shallow, deep = (
        nf.simulate(nf.preset("paper"), nf.Motion.insert(start=0.0, speed=3e-3, depth=z)) for z in (11e-3, 13e-3)
    )
    assert set(deep.card.assumptions) - set(shallow.card.assumptions)
    assert any("13 mm deep" in sentence for sentence in deep.card.assumptions)
    assert not any("deep;" in sentence for sentence in shallow.card.assumptions)
