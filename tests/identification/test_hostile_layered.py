# SPDX-License-Identifier: Apache-2.0
"""Layered fits of recordings that were not made for them: far zeros, copies, a stranger among repeats."""

import dataclasses

import numpy as np
import pytest

import needleforce as nf
from needleforce.identification.models import with_ruptures
from needleforce.recording import Card

MOTION = nf.Motion.insert(start=-2e-3, speed=4e-3, depth=15e-3, hold=1.0)
PUNCTURE = 8e-3  # [m]


def repeat(seed, puncture=PUNCTURE, noise=5e-3, zero=0.0, factor=1.0):
    """A repeat of the upper layer of the preset, in a zero of its own [m]."""
    model = with_ruptures(nf.preset("layered_as_fitted").replace(deeper=()), np.array([puncture]))
    run = nf.simulate(model, MOTION, rate=100.0)
    force = factor * (run.force + np.random.default_rng(seed).normal(0.0, noise, len(run)))
    return dataclasses.replace(run, depth=run.depth + zero, force=force, axes={})


def fit_of(runs):
    return nf.identify(runs, model="layered_as_fitted", layers=1)


@pytest.mark.parametrize("zero", [-20.0, -0.7, 0.7, 20.0])
def test_numbers_do_not_depend_on_where_a_recording_has_its_zero(zero):
    here, there = (fit_of([repeat(0, zero=z), repeat(1, zero=z)]) for z in (0.0, zero))
    assert there.quality.nrmse == pytest.approx(here.quality.nrmse, rel=0.05)
    assert there.parameters["contact_depth"].value == pytest.approx(zero, abs=0.3e-3)
    for each in there.recordings:
        assert each.parameters["puncture_depth"].value == pytest.approx(zero + PUNCTURE, abs=0.2e-3)


def lost_in_hold(relaxation, hold=1.0):
    """Share of the force that relaxes within the hold [s]: all that a hold shows of longer times."""
    return sum(
        share * (1.0 - np.exp(-hold / time))
        for share, time in ((relaxation.share_1, relaxation.time_1), (relaxation.share_2, relaxation.time_2))
    )


@pytest.mark.parametrize("noise", [0.0, 5e-3])
def test_copies_of_one_recording_keep_the_mechanisms_they_show(noise):
    fit = fit_of([repeat(0, noise=noise)] * 3)
    found, made = (model.layers[0].relaxation for model in (fit.model, nf.preset("layered_as_fitted")))
    assert lost_in_hold(found) == pytest.approx(lost_in_hold(made), rel=0.02)
    assert fit.parameters["relaxation_share_1"].value == pytest.approx(found.share_1)
    assert fit.quality.nrmse < 0.01


def test_an_anomalous_repeat_without_a_name_gives_a_warning():
    fit = fit_of([repeat(0), repeat(1), repeat(2, factor=1e3)])
    assert any("describes these recordings poorly" in warning for warning in fit.warnings), fit.warnings
    assert not any("poorly" in warning for warning in fit_of([repeat(0), repeat(1)]).warnings)


def test_a_repeat_in_another_zero_is_named():
    runs = [repeat(0), repeat(1), repeat(2, zero=0.7)]
    runs = [dataclasses.replace(run, card=Card(source=f"{k}.csv")) for k, run in enumerate(runs)]
    told = [warning for warning in fit_of(runs).warnings if "one zero" in warning]
    assert len(told) == 1 and told[0].startswith("2.csv: its contact at 70")


def test_a_repeat_in_another_zero_does_not_stop_the_comparison():
    (row,) = nf.compare([repeat(0), repeat(1), repeat(2, zero=0.7)], ["paper"])
    known = np.isfinite(row.cross_validation.prediction[:, 0])
    assert not known[2] and any("does not predict it: puncture_depth" in note for note in row.notes)
