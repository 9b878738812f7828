# SPDX-License-Identifier: Apache-2.0
"""What a user sees first: the README's example, residuals by where they arise, and the limit of 12 mm."""

import dataclasses

import numpy as np
import pytest

import needleforce as nf

NOISE_N = 1e-3
DEEP = nf.Motion.insert(start=-3e-3, speed=3e-3, depth=16e-3, hold=1.0)
SLOPES = {"straight": 0.0, "steeper beyond 9 mm": 20.0}  # [N/m] in addition to the paper's 18.6


@pytest.fixture(scope="module")
def example(root):
    return nf.identify(nf.read(root / "examples" / "insertion.csv"), needle="paper")


def test_the_example_of_the_readme_is_described(example):
    """The specimen slides after 40 um of travel back, which its 100 Hz show in seven samples."""
    quality, turn = example.quality, example.parameters.presliding
    assert quality.nrmse < 0.03 and quality.sliding_N < 0.02 * 0.42
    assert turn.low <= 20e-6 <= turn.high and turn.value == pytest.approx(20e-6, abs=10e-6)
    assert not any("does not describe" in warning for warning in example.warnings)
    assert "sliding 7" in str(quality) and "reversal of friction" in str(quality)


def test_the_parts_of_a_residual_make_the_whole(example):
    (one,) = example.recordings
    strokes, residual = one.strokes, one.residuals
    turn = np.zeros(len(residual), bool)
    turn[strokes.outwards.start : strokes.outwards.start + strokes.friction_reversal.samples] = True
    inside = strokes.mask(len(residual))
    assert one.quality.reversal_N == pytest.approx(np.sqrt(np.mean(residual[turn] ** 2)))
    assert one.quality.sliding_N == pytest.approx(np.sqrt(np.mean(residual[inside & ~turn] ** 2)))


@pytest.mark.parametrize("form", SLOPES)
def test_the_warning_on_12_mm_is_given_where_friction_is_not_linear(form):
    run = nf.simulate(nf.preset("paper"), DEEP, rate=200.0)
    more = np.sign(np.gradient(run.depth)) * SLOPES[form] * np.maximum(run.depth - 9e-3, 0.0)
    force = run.force + more + np.random.default_rng(3).normal(0.0, NOISE_N, len(run))
    warnings = nf.identify(dataclasses.replace(run, force=force), model="paper").warnings
    assert any("12 mm" in warning for warning in warnings) == (form != "straight")


def test_a_comparison_refuses_the_same_file_twice_and_takes_a_needle(root):
    file = root / "examples" / "insertion.csv"
    with pytest.raises(nf.InputError, match="given twice"):
        nf.compare([nf.read(file), nf.read(file)])
    run = nf.simulate(nf.preset("paper"), DEEP, rate=200.0)
    free, held = (nf.compare(run, ["cone_cylinder"], needle=needle)[0] for needle in (None, "paper"))
    assert held.bic > free.bic  # a cone that is held fixed cannot fit as well as one that is sought
    paper, gradual = nf.compare(run, ["gradual_cone", "paper"])  # one law that nothing shows takes no BIC from others
    assert np.isfinite(paper.bic) and not np.isfinite(gradual.bic) and "rupture is not gradual" in gradual.notes[0]
