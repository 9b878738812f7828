# SPDX-License-Identifier: Apache-2.0
"""How often valid repeats have anomalies, and when a curve belongs to another condition."""

import numpy as np
import pytest

from needleforce.campaign.checks import limit, outliers, wrong_labels
from needleforce.campaign.recording_result import nearest
from needleforce.identification import Estimate


def repeats(values, half=0.0, **options) -> dict:
    given = {"puncture_force": values} if not isinstance(values, dict) else values
    count = len(next(iter(given.values())))
    made = {
        name: [Estimate(name, value, "N", value - half, value + half, **options) for value in each]
        for name, each in given.items()
    }
    return {f"{k}.csv": {name: each[k] for name, each in made.items()} for k in range(count)}


def found(values, **options) -> list[str]:
    return [file for file, _ in outliers(repeats(values, **options))]


@pytest.mark.parametrize("count", [4, 5, 6, 7, 9, 12, 17, 25, 40])
def test_one_normal_sample_in_a_hundred_contains_an_outlier(count):
    # independent of the table in the code: 40 000 normal samples; interpolated counts have a small error
    values = np.random.default_rng(count).normal(0.0, 1.0, (40_000, count))
    away = np.abs(values - np.median(values, axis=1, keepdims=True))
    farthest = away.max(axis=1) / (1.4826 * np.median(away, axis=1))
    assert 0.006 < np.mean(farthest > limit(count)) < 0.014


def test_an_outlier_is_named_and_its_repeats_are_not():
    assert found([1.0, 1.01, 0.99, 1.02, 1.5]) == ["4.csv"]
    assert found([1.0, 1.01, 0.99, 1.02, 0.98]) == []


def test_too_few_repeats_have_no_outlier():
    assert found([1.0, 1.01, 5.0]) == []


def test_a_deviation_within_its_interval_is_not_an_outlier():
    assert found([1.0, 1.01, 0.99, 1.02, 1.5], half=0.6) == []


def test_an_unidentifiable_parameter_is_not_an_outlier():
    assert found([1.0, 1.01, 0.99, 1.02, 1.5], identifiable=False) == []


def test_a_deviation_below_ten_percent_is_not_an_outlier():
    assert found([1.0, 1.0, 1.0, 1.0, 1.09]) == [] and found([1.0, 1.0, 1.0, 1.0, 1.2]) == ["4.csv"]


def test_values_at_a_bound_have_no_scatter():
    assert found([0.0, 0.0, 0.0, 0.0, 0.5]) == []


@pytest.mark.parametrize(
    "ratio, factor", [(1000.0, 1000.0), (9.5e-4, 1e-3), (4.6, 4.4482), (0.2248, 1 / 4.4482), (9.5, 9.80665),
                      (2.0, None), (1.0, None), (0.0, None), (np.nan, None)]
)  # fmt: skip
def test_factors_of_units(ratio, factor):
    got = nearest(ratio, (1000.0, 4.4482, 9.80665), 0.2)
    assert got is None if factor is None else got == pytest.approx(factor)


def curves(level: float, count: int, seed: int, scatter=0.02) -> dict:
    random, shape = np.random.default_rng(seed), np.linspace(0.0, 1.0, 100) ** 2
    return {f"{level:g}-{k}.csv": level * random.normal(1.0, scatter) * shape for k in range(count)}


def test_a_swapped_label_is_found_and_nothing_else():
    soft, hard = curves(1.0, 5, 1), curves(2.0, 5, 2)
    soft["swapped.csv"] = 2.01 * np.linspace(0.0, 1.0, 100) ** 2
    every = {"soft": soft, "hard": hard}
    named = dict(wrong_labels(every, {name: list(each) for name, each in every.items()}))
    assert list(named) == ["swapped.csv"] and "hard" in named["swapped.csv"].sentence


def test_a_curve_unlike_all_conditions_has_no_wrong_label():
    soft, hard = curves(1.0, 5, 1), curves(2.0, 5, 2)
    soft["odd.csv"] = 1.5 * np.linspace(0.0, 1.0, 100) ** 2
    every = {"soft": soft, "hard": hard}
    assert not dict(wrong_labels(every, {name: list(each) for name, each in every.items()}))


def test_similar_conditions_are_not_distinguished():
    every = {str(seed): curves(1.0 + 1e-9 * seed, 3, seed) for seed in range(30)}
    assert not dict(wrong_labels(every, {name: list(each) for name, each in every.items()}))
