# SPDX-License-Identifier: Apache-2.0
"""Friction under each form of the foundation, from bins, from second passes and from whole recordings, with known
truth; the forces are computed here, by quadrature."""

import dataclasses

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import least_squares

import needleforce as nf
from needleforce.identification import compare
from needleforce.identification.two_pass.second_pass import friction_forms

FRICTION, OFFSET, START, BIN = 18.6, 0.01, 3.3e-3, 0.25e-3
TRUTHS = {"cubic": (0.7, 12e-3), "hyperbolic": (1.5, 12e-3), "tanh": (1.5, 12e-3)}
PRESSURES = {
    "cubic": lambda u: u + u**3,
    "hyperbolic": lambda u: u / (1.0 + u),
    "tanh": np.tanh,
}


def effective(form, ratio, deflection, lengths):
    """Friction over friction per length [m]: mean pressure of both sides along the shaft, none below 0."""

    def mean(x):
        sides = (ratio * (1.0 + x / deflection), ratio * max(1.0 - x / deflection, 0.0))
        return sum(PRESSURES[form](side) for side in sides) / (2.0 * PRESSURES[form](ratio))

    return np.array([quad(mean, 0.0, length, points=[min(deflection, length)])[0] for length in lengths])


def bins(form, deepest=30e-3, noise=0.5e-3, seed=0):
    """A second pass in bins, with an intercept; ``noise`` [N] of a bin."""
    depth = np.arange(START, deepest, BIN)
    length = depth if form == "linear" else effective(form, *TRUTHS[form], depth)
    scatter = noise * np.random.default_rng(seed).standard_normal(len(depth))
    return depth, FRICTION * length + OFFSET + scatter, np.ones((len(depth), 1))


def by_name(found):
    return {each.form: each for each in found}


@pytest.mark.parametrize("form", TRUTHS)
def test_without_noise_the_truth_is_found(form):
    found = friction_forms(*bins(form, noise=1e-9))
    assert found[0].form == form
    ratio, deflection = TRUTHS[form]
    expected = {"friction_per_length": FRICTION, "settlement_ratio": ratio, "deflection_length": deflection}
    for name, value in expected.items():
        assert found[0].values[name] == pytest.approx(value, rel=0.02)
    depth = np.arange(START, 30e-3, BIN)[-1:]
    bend = effective(form, ratio, deflection, depth)[0] / depth[0] - 1.0
    assert found[0].values["friction_bend"] == pytest.approx(bend, rel=0.01)


@pytest.mark.parametrize("form", TRUTHS)
def test_the_form_is_chosen_and_its_intervals_contain_the_truth(form):
    """Twenty noises; 95 % intervals, which those of the grid exceed: with a chance of 1e-3 four or more miss."""
    ratio, deflection = TRUTHS[form]
    missed = {"friction_per_length": 0, "settlement_ratio": 0, "deflection_length": 0}
    for seed in range(20):
        own = friction_forms(*bins(form, seed=seed), forms=("linear", form))
        assert own[0].form == form
        for name, value in zip(missed, (FRICTION, ratio, deflection)):
            missed[name] += not own[0].low[name] <= value <= own[0].high[name]
    assert max(missed.values()) <= 4


def test_the_least_squares_are_those_of_another_program():
    depth, force, _ = bins("tanh")
    found = friction_forms(depth, force, np.ones((len(depth), 1)), forms=("tanh",))[0]

    def residual(x):
        return x[0] * effective("tanh", x[1], 1e-3 * x[2], depth) + x[3] - force

    other = least_squares(residual, (15.0, 1.0, 10.0, 0.0))
    own = [found.values[name] for name in ("friction_per_length", "settlement_ratio", "deflection_length")]
    assert own == pytest.approx(other.x[:3] * (1.0, 1.0, 1e-3), rel=0.01)
    n = len(depth)
    assert found.bic == pytest.approx(n * np.log(2.0 * other.cost / n) + 4 * np.log(n), abs=0.01)


def test_a_line_is_seldom_taken_for_a_bend(many):
    """The docstring's chance is 1 of n = 107 recordings for a form; of 40 three or more with a chance of about 1 %."""
    wrong = sum(friction_forms(*bins("linear", seed=seed))[0].form != "linear" for seed in range(many(8, 40)))
    assert wrong <= many(1, 3)


def test_while_both_sides_are_in_contact_a_log_determines_the_bend_and_not_what_causes_it():
    depth, force, others = bins("cubic", deepest=11e-3)
    found = by_name(friction_forms(depth, force, others))["cubic"]
    assert "friction_bend" in found.identifiable and "settlement_ratio" not in found.identifiable
    # the same bend, r^2 / (1 + r^2) / L^2, with any ratio: of all that are possible none is excluded but the smallest
    for ratio in (0.3, 0.7, 10.0):
        assert found.low["settlement_ratio"] <= ratio <= found.high["settlement_ratio"]
    for deflection in (12e-3, 20e-3):
        assert found.low["deflection_length"] <= deflection <= found.high["deflection_length"]
    assert found.low["friction_per_length"] <= FRICTION <= found.high["friction_per_length"]


def test_a_short_pass_has_no_forms():
    depth, force, others = bins("linear", deepest=START + 11 * BIN)
    assert friction_forms(depth[:11], force[:11], others[:11]) == ()


def recorded(model, seed, noise=2e-3, depth=30e-3):
    run = nf.simulate(model, nf.Motion.insert(start=-3e-3, speed=3e-3, depth=depth, hold=1.0), 500.0)
    return dataclasses.replace(run, force=run.force + np.random.default_rng(seed).normal(0.0, noise, len(run)))


@pytest.mark.parametrize("form", TRUTHS)
def test_one_recording_identifies_the_law(form):
    model = nf.preset(f"{form}_foundation")
    fit = nf.identify(recorded(model, 1), model=f"{form}_foundation")
    law = model.friction
    for name in ("settlement_ratio", "deflection_length"):
        estimate = fit.parameters[name]
        assert estimate.identifiable and estimate.low <= getattr(law, name) <= estimate.high
    assert fit.parameters.friction_per_length.value == pytest.approx(law.per_length, rel=5e-3)
    assert fit.parameters.cutting_force.value == pytest.approx(model.cutting.force, rel=0.02)
    assert fit.model.friction.name == law.name
    depth = np.array([10e-3, 20e-3, 30e-3])
    assert fit.model.force(depth) == pytest.approx(model.force(depth), rel=5e-3)
    assert np.isfinite(fit.draws(100)["settlement_ratio"]).all()


def test_a_straight_shaft_does_not_identify_a_bend():
    fit = nf.identify(recorded(nf.preset("physical"), 2), model="tanh_foundation")
    assert not fit.parameters.settlement_ratio.identifiable and not fit.parameters.deflection_length.identifiable
    assert abs(fit.parameters.friction_bend.value) < 0.01


def test_a_short_insertion_does_not_identify_a_bend():
    fit = nf.identify(recorded(nf.preset("tanh_foundation"), 2, depth=5e-3), model="tanh_foundation")
    assert not fit.parameters.settlement_ratio.identifiable


@pytest.mark.parametrize("truth, best", [("physical", "cone_cylinder"), ("tanh_foundation", "tanh_foundation")])
def test_compare_ranks_the_forms_by_prediction_and_evidence(truth, best):
    runs = [recorded(nf.preset(truth), seed) for seed in range(3)]
    rows = compare(runs, models=("cone_cylinder", "cubic_foundation", "hyperbolic_foundation", "tanh_foundation"))
    assert rows[0].model == best
    assert min(rows, key=lambda row: row.friction_bic).model == best
    assert len({row.bic for row in rows}) == 1  # the loading curve is the same


def test_second_passes_give_the_parameters_of_the_model_that_is_asked_for():
    first = nf.preset("hyperbolic_foundation")
    second = first.replace(cutting=nf.laws.NoCutting(), puncture=nf.laws.PunctureDepth(0.0))
    firsts, seconds = [recorded(first, seed) for seed in (0, 1)], [recorded(second, seed) for seed in (2, 3)]
    line = nf.identify(firsts, second_pass=seconds)
    assert any("model='hyperbolic_foundation'" in sentence for sentence in line.two_pass.biases)
    assert next(iter(line.two_pass.bic)) == "hyperbolic"
    fit = nf.identify(firsts, second_pass=seconds, model="hyperbolic_foundation")
    assert fit.parameters.friction_per_length.value == pytest.approx(18.6, rel=5e-3)
    assert fit.parameters.deflection_length.value == pytest.approx(12e-3, rel=0.02)
    assert fit.model.friction.name == "hyperbolic_foundation"
