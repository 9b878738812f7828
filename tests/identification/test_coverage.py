# SPDX-License-Identifier: Apache-2.0
"""Intervals hold the truth as often as they promise, white noise or filtered; the long study is in benchmarks."""

import runpy

import numpy as np
import pytest
from scipy.stats import norm

from needleforce.identification.statistics.noise import (
    LEVEL,
    ONE_SIDED,
    TWO_SIDED,
    likely_punctures,
    noise_of,
    student_quantile,
)


@pytest.mark.parametrize("filter_length", [1, 10, 50])
def test_intervals_hold_the_truth_at_their_rate(root, filter_length):
    study = runpy.run_path(str(root / "benchmarks" / "fit.py"))["study"]
    rights, shares = study(400, 20e-3, filter_length, first_seed=1000 * filter_length)
    assert rights >= 0.99
    assert shares.pop("puncture_depth") >= 0.95  # lies between samples: the set is never too small
    assert all(0.91 <= share <= 0.98 for share in shares.values()), shares


@pytest.mark.parametrize("filter_length, fades", [(1, 0.0), (50, 0.0), (1, 0.9)])
def test_draws_hold_the_truth_at_their_rate(root, monkeypatch, filter_length, fades, many):
    monkeypatch.syspath_prepend(root / "benchmarks")
    share_held = runpy.run_path(str(root / "benchmarks" / "uncertainty.py"))["share_held"]
    row = 5e-3 if fades else 10e-3, filter_length, fades, 3000
    intervals, draws = share_held(many(120, 400), row, first_seed=1000 * filter_length)
    assert intervals.pop("puncture_depth") >= 0.95 and draws.pop("puncture_depth") >= 0.91
    # a filter as long as a tenth of the indentation: errors of law and puncture, taken as independent, cancel in part
    both = [intervals.pop("puncture_force"), draws.pop("puncture_force")]
    assert all(0.91 <= share <= (1.0 if filter_length == 50 else 0.98) for share in both), both
    assert all(0.91 <= share <= 0.98 for share in [*intervals.values(), *draws.values()]), (intervals, draws)


def filtered(length, samples=40_000, seed=0):
    """White noise of unit variance behind an average filter: long-run variance stays 1, variance is 1 / length."""
    white = np.random.default_rng(seed).standard_normal(samples + length - 1)
    return np.convolve(white, np.full(length, 1.0 / length), "valid")


@pytest.mark.parametrize("length", [1, 10, 50])
@pytest.mark.parametrize("known", [True, False])
def test_long_run_variance_of_filtered_noise(length, known):
    found = [noise_of(filtered(length, seed=seed), 40_000, length if known else 1) for seed in range(20)]
    assert np.mean([noise.long_run for noise in found]) == pytest.approx(1.0, rel=0.05)
    assert np.mean([noise.variance for noise in found]) == pytest.approx(1.0 / length, rel=0.03)
    last_lag = np.median([noise.last_lag for noise in found])
    assert last_lag == 0 if length == 1 else 0.7 * length <= last_lag <= 1.3 * length


def test_likely_punctures_are_the_posterior():
    gain = np.array([0.0, 3.0, 9.0, 10.0, 8.0, 2.0])
    weight = np.exp(gain / 2.0)
    weight /= weight.sum()
    rows, weights = likely_punctures(gain, 1.0)
    assert rows.tolist() == [3, 2, 4]  # 0.493 + 0.299 = 0.79 is not yet 95 %, with 0.181 it is
    assert weights.sum() == pytest.approx(1.0)
    assert weight[rows].sum() >= 0.95 > weight[rows[:-1]].sum()


def test_quantiles_are_those_of_the_level():
    assert pytest.approx(norm.ppf(0.5 * (1.0 + LEVEL)), abs=1e-12) == TWO_SIDED
    assert pytest.approx(norm.ppf(LEVEL), abs=1e-12) == ONE_SIDED
    assert student_quantile(10**9) == pytest.approx(TWO_SIDED, abs=1e-6)
