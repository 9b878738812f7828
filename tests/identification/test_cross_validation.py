# SPDX-License-Identifier: Apache-2.0
"""Repeats left out, beside how well the experiment repeats itself."""

import dataclasses

import numpy as np
import pytest

import needleforce as nf
from needleforce.identification.compare import ModelRow, _ranked
from needleforce.identification.cross_validation import CrossValidation, cross_validate, mean_of_others, measured_cycle
from needleforce.identification.diagnostics import FitInputs
from needleforce.identification.layered.identify import identify_layered
from needleforce.identification.one_layer.fit_recording import fitted
from needleforce.identification.one_layer.segmented_recording import segmented

MOTION = nf.Motion.insert(start=-3e-3, speed=3e-3, depth=14e-3, hold=1.0)
RUN = nf.simulate(nf.preset("physical"), MOTION, rate=100.0)


def scaled(factor, motion=None):
    run = RUN if motion is None else nf.simulate(nf.preset("physical"), motion, rate=100.0)
    return dataclasses.replace(run, force=factor * run.force)


def errors_of_floor(runs):
    cycles = [measured_cycle(segmented(run)) for run in runs]
    return np.array([cycle.errors(mean_of_others(cycles, k)) for k, cycle in enumerate(cycles)])


def test_the_floor_is_the_mean_of_the_others():
    """Forces of 0.9, 1 and 1.2: the mean of the others is off by 0.2, 0.05 and 0.25 of the force at 1."""
    found = errors_of_floor([scaled(factor) for factor in (0.9, 1.0, 1.2)])
    shape = RUN.force[measured_cycle(segmented(RUN)).span]
    rms = np.sqrt(np.mean((shape / shape.max()) ** 2))
    np.testing.assert_allclose(found[:, 0], rms * np.array([0.2 / 0.9, 0.05, 0.25 / 1.2]), rtol=2e-3)
    assert np.isfinite(found).all()


def test_the_curve_of_one_held_out_repeat_is_kept():
    """That with the median floor: over the own peak 0.2 / 0.9, 0.05 and 0.25 / 1.2, which is the third."""
    singles = [segmented(scaled(factor)) for factor in (0.9, 1.0, 1.2)]
    found = cross_validate(singles, FakeFit)
    cycle = measured_cycle(singles[2])
    np.testing.assert_array_equal(found.shown.measured, cycle.force)
    np.testing.assert_allclose(found.shown.others, 0.95 / 1.2 * cycle.force, atol=2e-3)
    np.testing.assert_allclose(cycle.errors(found.shown.predicted), found.prediction[2])


class FakeFit:
    """Predicts the force of the first of its repeats."""

    identified_model = "any"

    def __init__(self, repeats):
        self.force = repeats[0].recording.force

    def predict(self, recording, events=None):
        return self.force


def test_repeats_of_another_motion_do_not_count():
    deeper = nf.Motion.insert(start=-3e-3, speed=3e-3, depth=16e-3, hold=1.0)
    faster = nf.Motion.insert(start=-3e-3, speed=5e-3, depth=14e-3, hold=1.0)
    found = errors_of_floor([scaled(1.0), scaled(1.1), scaled(0.9), scaled(1.0, deeper), scaled(1.0, faster)])
    np.testing.assert_allclose(found[:3], errors_of_floor([scaled(1.0), scaled(1.1), scaled(0.9)]), rtol=1e-12)
    assert np.isnan(found[3:]).all()


def test_a_perfect_predictor_stands_below_the_floor():
    """With five repeats it errs by sd, the mean of four by sd sqrt(1 + 1/4): 0.894."""
    random, ratios, whole = np.random.default_rng(1), [], measured_cycle(segmented(RUN))
    for _ in range(60):
        factors = 1.0 + 0.05 * random.standard_normal(5)
        cycles = [dataclasses.replace(whole, force=factor * whole.force) for factor in factors]
        floor = np.array([cycle.errors(mean_of_others(cycles, k)) for k, cycle in enumerate(cycles)])
        perfect = np.array([cycle.errors(whole.force) for cycle in cycles])
        ratios.append(CrossValidation(perfect, perfect, floor).over_floor(perfect)[0] ** 2)
    assert np.sqrt(np.mean(ratios)) == pytest.approx(np.sqrt(0.8), rel=0.05)


def row(name, errors, bic=np.nan):
    errors = np.tile(np.asarray(errors, float)[:, None], 4)
    cross_validation = CrossValidation(errors, errors, np.full_like(errors, 0.05))
    ratio = float(cross_validation.over_floor(errors)[0])
    return ModelRow(model=name, bic=bic, parameters=4, prediction=ratio, cross_validation=cross_validation)


def test_a_model_that_wins_by_less_than_its_noise_ties():
    clear, near, far = [0.05, 0.06, 0.055, 0.052], [0.051, 0.058, 0.057, 0.052], [0.10, 0.13, 0.11, 0.12]
    ranked = _ranked([row("far", far, 1.0), row("near", near, 3.0), row("clear", clear, 2.0)])
    assert [each.model for each in ranked] == ["clear", "near", "far"]
    assert [each.ties for each in ranked] == [False, True, False]
    # of two that tie the criterion of the loading curve decides
    assert _ranked([row("clear", clear, 4.0), row("near", near, 3.0)])[0].model == "near"


def test_held_out_repeats_are_predicted_from_the_others():
    given = []

    def identified(others):
        given.append(len(others))
        return nf.identify([single.recording for single in others], model="cone_cylinder")

    singles = [fitted(segmented(scaled(factor)), ("cone_cylinder",), None) for factor in (0.9, 1.0, 1.1)]
    blank = fitted(segmented(dataclasses.replace(RUN, force=np.zeros(len(RUN)))), ("cone_cylinder",), None)
    found = cross_validate([*singles, blank], identified)
    assert given == [2, 2, 2] and found.prediction.shape == (3, 4)
    # the model of the others is their mean
    np.testing.assert_allclose(found.over_floor(found.prediction)[0], 1.0, atol=0.05)


def test_real_repeats_left_out_are_foretold_as_well_as_the_experiment_repeats_itself(recordings):
    files = sorted((recordings / "needle-insertion-rig").glob("dev__control-needle__skin_2_0_2_*.csv"))
    assert len(files) == 5
    read = [
        nf.read(file, columns={"force": "fz", "depth": "pz"}, units={"time": "us", "depth": "mm"}) for file in files
    ]
    given = FitInputs(None, None, {})
    found = cross_validate(
        [segmented(run) for run in read], lambda others: identify_layered(others, "layered_as_fitted", given, 2)
    )
    assert found.over_floor(found.prediction)[0] < 1.15 and found.over_floor(found.replay)[0] < 1.05
    paper = nf.compare(read, ["paper"])[0]
    assert paper.prediction > 2.0
