# SPDX-License-Identifier: Apache-2.0
"""A stiffness of dragged tissue that is known before a layered fit: how it and the recordings share one answer."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from test_layered_fit import FIRST, repeat

import needleforce as nf
from needleforce import fe
from needleforce.identification.layered.binned_cycle import COARSE, FINE, binned_cycles
from needleforce.identification.layered.known_stiffness import known_stiffnesses, with_known
from needleforce.identification.layered.search import Solved, again, grow
from needleforce.identification.layered.uncertainty import uncertainty_of
from needleforce.identification.statistics.noise import TWO_SIDED

STIFFNESS, FRICTION = 220.0, 140.0  # [N/m] of the first layer of the presets
SPRING, PER_LENGTH = "tissue_stiffness", "friction_per_length"
SHORT = nf.Motion.insert(start=-2e-3, speed=3e-3, depth=14e-3, hold=2.0)
DEEP = nf.Motion.insert(start=-3e-3, speed=2e-3, depth=14e-3)


def pushed(seed, noise=50e-3):
    """One insertion into one layer behind much noise, without the withdrawal that would show the spring."""
    run, _ = repeat(seed, layers=1, motion=DEEP, noise=noise)
    inwards = int(np.argmax(run.depth)) + 1
    return nf.Recording(*(getattr(run, name)[:inwards] for name in ("time", "depth", "velocity", "force")))


def scattered(count=4):
    """Whole cycles of one layer whose forces scatter by 8 %."""
    return [repeat(1000 + seed, layers=1, motion=SHORT, scale=0.08)[0] for seed in range(count)]


def fitted(runs, *entries, layers=1):
    return nf.identify(runs, model="layered_as_fitted", layers=layers, tissue_stiffness=list(entries) or None)


def log_sd(estimate):
    """Standard error of the logarithm, by the interval."""
    return float(np.log(estimate.high / estimate.low)) / (2.0 * TWO_SIDED)


def joined(one, other):
    """Mean and standard error of two measurements, (value, error) each, by their logarithms."""
    precision = one[1] ** -2 + other[1] ** -2
    mean = (np.log(one[0]) * one[1] ** -2 + np.log(other[0]) * other[1] ** -2) / precision
    return float(np.exp(mean)), precision**-0.5


def holds(estimate, value):
    return estimate.low <= value <= estimate.high


def test_a_right_value_replaces_the_withdrawal_that_is_missing():
    """The interval becomes that of the prior, and the friction, which trades off with the spring, becomes narrower."""
    alone, known = fitted(pushed(0)), fitted(pushed(0), (STIFFNESS, 0.03))
    before, after = ({name: fit.parameters[name] for name in (SPRING, PER_LENGTH)} for fit in (alone, known))
    assert log_sd(before[SPRING]) > 0.1
    assert log_sd(after[SPRING]) == pytest.approx(0.03, rel=0.1)
    assert log_sd(after[PER_LENGTH]) < 0.7 * log_sd(before[PER_LENGTH])
    assert holds(after[SPRING], STIFFNESS) and holds(after[PER_LENGTH], FRICTION)


@pytest.mark.parametrize("value", [150.0, 330.0])
def test_the_truth_stays_in_the_intervals_of_a_wrong_but_uncertain_value(value, many):
    """40 % off with an error of 40 %, over recordings without a withdrawal and campaigns with scatter: fewer than 11 of
    14, or 5 of 7, has a chance of 0.4 % where 95 % are promised."""
    runs = [[pushed(seed, noise=20e-3)] for seed in range(many(5, 10))]
    runs += [[repeat(4 * k + j, layers=1, motion=SHORT, scale=0.08)[0] for j in range(4)] for k in range(many(2, 4))]
    found = [fitted(each, (value, 0.4)).parameters for each in runs]
    assert sum(holds(each[SPRING], STIFFNESS) for each in found) >= many(5, 11)
    assert sum(holds(each[PER_LENGTH], FRICTION) for each in found) >= many(5, 11)


def searched(runs):
    """One layer without what is known beforehand."""
    pairs = [(run, nf.segment(run)) for run in runs]
    coarse, fine = (binned_cycles(pairs, each) for each in (COARSE["as_fitted"], FINE))
    found = next(grow(coarse, 1))
    return again(found, found.x, cycles=fine)


def spring_of(solved):
    """The stiffness and the standard error of its logarithm."""
    found = uncertainty_of(solved)
    k = found.names.index(SPRING)
    return found.value[k], found.half[k] / TWO_SIDED / found.value[k]


def test_the_cost_has_the_row():
    """Half the weight times the square of the distance of the logarithms, whatever else the cost is."""
    solved = with_known(searched([pushed(2)]), known_stiffnesses([(150.0, 0.1)], 1))
    row = solved.problem.known[0]
    for x in (solved.x, solved.x + 0.01):
        distance = x[row.place] - np.log(150.0)
        added = solved.problem.cost(x) - replace(solved.problem, known=()).cost(x)
        assert added == pytest.approx(0.5 * row.noise * (distance / 0.1) ** 2, rel=1e-6)


@pytest.mark.parametrize("error", [0.1, 0.02, 0.005])
def test_precisions_add_up(error):
    """At the same values the precision with the row is that of the data and that of the prior."""
    solved = with_known(searched([pushed(2, noise=5e-3)]), known_stiffnesses([(STIFFNESS, error)], 1))
    data = Solved(replace(solved.problem, known=()), solved.x, solved.cost)
    precisions = [spring_of(each)[1] ** -2 for each in (solved, data)]
    assert precisions[0] == pytest.approx(precisions[1] + error**-2, rel=0.03)


@pytest.mark.parametrize("error", [0.4, 0.1, 0.05])
def test_repeats_and_a_known_value_join_as_two_measurements(error):
    """Against the scatter of repeats: value and interval are those of the joined Gaussians."""
    solved, entry = searched(scattered()), (230.0, error)
    value, sd = spring_of(with_known(solved, known_stiffnesses([entry], 1)))
    mean, expected = joined(spring_of(solved), entry)
    assert sd == pytest.approx(expected, rel=0.04)
    assert abs(np.log(value / mean)) < 0.05 * expected


def test_a_row_is_weighted_with_the_noise_of_the_force():
    """Of one recording it is the variance of the noise: four times the noise, sixteen times the weight."""
    for noise in (10e-3, 40e-3):
        solved = searched([pushed(3, noise=noise)])
        (known,) = with_known(solved, known_stiffnesses([(STIFFNESS, 0.1)], 1)).problem.known
        (cycle,) = solved.problem.cycles
        assert known.noise == pytest.approx((noise / cycle.scale) ** 2 / cycle.count.sum(), rel=0.2)
        assert known.weight == pytest.approx(known.noise / 0.1**2)


def test_a_narrow_error_holds_the_value_and_a_wide_one_changes_nothing():
    runs = scattered()
    alone, wide, narrow = fitted(runs), fitted(runs, (500.0, 1e4)), fitted(runs, (STIFFNESS, 1e-9))
    for name, estimate in alone.parameters.items():
        same = wide.parameters[name]
        width = min(estimate.high - estimate.low, 1e3)
        assert abs(same.value - estimate.value) <= 1e-3 * width, name
    assert narrow.parameters[SPRING].value == pytest.approx(STIFFNESS, rel=1e-6)
    assert narrow.parameters[SPRING].high / narrow.parameters[SPRING].low < 1.0 + 1e-5
    assert narrow.model.friction.stiffness == pytest.approx(STIFFNESS, rel=1e-6)


@pytest.mark.parametrize("value", [0.02, 3e5])
def test_a_value_beyond_the_limits_of_the_search_is_not_clamped(value):
    known = fitted(pushed(0), (value, 1e-6)).parameters[SPRING]
    assert known.value == pytest.approx(value, rel=1e-4) and known.identifiable


def test_entries_belong_to_the_layers_from_the_surface_down():
    run, _ = repeat(1)
    for first, second in itertools.permutations((STIFFNESS, 0.5 * STIFFNESS)):
        fit = fitted(run, (first, 1e-6), (second, 1e-6), layers=2)
        assert fit.parameters["layer_2_top"].value > 0.0
        assert fit.parameters[SPRING].value == pytest.approx(first, rel=1e-4)
        assert fit.parameters["layer_2_tissue_stiffness"].value == pytest.approx(second, rel=1e-4)
    fit = fitted(run, None, (0.5 * STIFFNESS, 0.1), layers=2)
    assert "known beforehand" in fit.parameters["layer_2_tissue_stiffness"].source
    assert "known beforehand" not in fit.parameters[SPRING].source


def test_nothing_changes_to_the_bit_where_nothing_is_known():
    runs = [repeat(seed)[0] for seed in range(2)]
    without, empty = (
        nf.identify(runs, model="layered", layers=2, **more) for more in ({}, {"tissue_stiffness": [None, None]})
    )
    assert without.parameters == empty.parameters and without.held_fixed == empty.held_fixed
    assert without.settings.evidence == empty.settings.evidence


def test_the_fit_states_what_was_known():
    fit = fitted(pushed(0), (STIFFNESS, 0.1))
    assert fit.parameters[SPRING].source == "layered fit, 1 recording, with 220 N/m within 10 % known beforehand"
    assert "known beforehand" not in fit.parameters[PER_LENGTH].source
    assert any(each.startswith("tissue_stiffness: 220 N/m within 10 % known") for each in fit.held_fixed)
    assert not any("contradicts" in each for each in fit.warnings)
    assert fit.parameters["puncture_depth"].value == pytest.approx(FIRST, abs=1e-3)


def test_a_value_that_the_recordings_contradict_is_a_warning():
    fit = fitted(scattered(), (500.0, 0.05))
    assert any("tissue_stiffness: the recordings alone give" in each for each in fit.warnings)


def test_finite_elements_give_it():
    """As docs/howto/layers.md shows it."""
    stiffness = fe.shaft_stiffness(14e-3, 0.35e-3, fe.Elastic(30e3, 0.49), block_radius=20e-3, block_depth=40e-3)
    assert stiffness == pytest.approx(242.0, rel=0.005)
    assert holds(fitted(pushed(0), (stiffness, 0.3)).parameters[SPRING], STIFFNESS)


@pytest.mark.parametrize("model", ["layered", "layered_yielding"])
def test_passive_forms_use_it_too(model):
    fit = nf.identify(pushed(0), model=model, layers=1, tissue_stiffness=[(np.array(STIFFNESS), 0.02)])
    assert fit.parameters[SPRING].value == pytest.approx(STIFFNESS, rel=0.06)
    assert log_sd(fit.parameters[SPRING]) == pytest.approx(0.02, rel=0.15)


@pytest.mark.parametrize(
    "more, message",
    [
        ({"model": "paper", "layers": None}, "the model paper has no layers"),
        ({"model": None, "layers": None}, "the model paper has no layers"),
        ({"layers": None}, "layers is missing, tissue_stiffness has an entry for each layer"),
        ({"layers": 2}, "number of entries in tissue_stiffness is 1, it must be that of the layers, 2"),
        ({"tissue_stiffness": (220.0, 0.1)}, "number of entries in tissue_stiffness is 2"),
        ({"tissue_stiffness": [220.0]}, r"tissue_stiffness of layer 1 is 220.0, it must be \(value, relative_error\)"),
        ({"tissue_stiffness": 220.0}, r"tissue_stiffness of layer 1 is 220.0, it must be \(value, relative_error\)"),
        ({"tissue_stiffness": [(220.0, 0.1, 3.0)]}, r"it must be \(value, relative_error\) or None"),
        ({"tissue_stiffness": [("stiff", 0.1)]}, r"it must be \(value, relative_error\) or None"),
        ({"tissue_stiffness": [(0.0, 0.1)]}, "tissue_stiffness of layer 1 is 0 N/m, it must be finite and above 0"),
        ({"tissue_stiffness": [(np.inf, 0.1)]}, "tissue_stiffness of layer 1 is inf N/m"),
        ({"tissue_stiffness": [(np.nan, 0.1)]}, "tissue_stiffness of layer 1 is nan N/m"),
        (
            {"tissue_stiffness": [(1e-3, 0.1)]},
            "tissue_stiffness of layer 1 is 0.001 N/m, the law has 0.01 to 1e.06 N/m",
        ),
        ({"tissue_stiffness": [(2e6, 0.1)]}, "tissue_stiffness of layer 1 is 2e.06 N/m, the law has 0.01 to 1e.06 N/m"),
        ({"tissue_stiffness": [(220.0, 0.0)]}, "relative error of tissue_stiffness of layer 1 is 0, it must be"),
        ({"tissue_stiffness": [(220.0, np.inf)]}, "relative error of tissue_stiffness of layer 1 is inf"),
        ({"layers": 2, "tissue_stiffness": [None, (-5.0, 0.1)]}, "tissue_stiffness of layer 2 is -5 N/m"),
    ],
)
def test_what_is_refused(more, message):
    given = {"model": "layered", "layers": 1, "tissue_stiffness": [(STIFFNESS, 0.1)]} | more
    with pytest.raises(nf.InputError, match=message):
        nf.identify(pushed(0), **given)
