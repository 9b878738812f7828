# SPDX-License-Identifier: Apache-2.0
"""Statistics of penetration tests over needles, against pandas and by hand."""

import math

import numpy as np
import pytest
from known_penetration import Needle, curve
from scipy import stats

import needleforce as nf
from needleforce.bench_tests import PenetrationTest, penetration_tests


@pytest.fixture(scope="module")
def needles():
    rng = np.random.default_rng(12)
    many = {}
    for group, entry in (("21G", 0.8), ("23G", 0.6)):
        for k in range(5):
            scatter = entry * rng.normal(1.0, 0.05)
            many[f"{group}-{k + 1}"] = curve(Needle(entry=scatter, valley=0.5 * scatter), rng)
    many["23G-6"] = None
    return penetration_tests(many)


def test_statistics_by_hand(needles):
    assert list(needles.groups) == ["21G", "23G"] and len(needles) == 11
    for group in ("21G", "23G", "all"):
        chosen = needles.tests if group == "all" else needles.groups[group]
        values = np.array([test["entry_force"].value for test in chosen if not test.empty])
        (found,) = [each for each in needles.statistics("entry_force") if each.group == group]
        low, high = stats.t.interval(0.95, len(values) - 1, values.mean(), stats.sem(values))
        assert (found.n, found.missing) == (len(values), len(chosen) - len(values))
        expected = [values.mean(), np.std(values, ddof=1), np.median(values), values.min(), values.max(), low, high]
        numbers = [found.mean, found.sd, found.median, found.smallest, found.largest, found.low, found.high]
        assert numbers == pytest.approx(expected, rel=1e-12)


def test_the_table_by_pandas(needles):
    frame = needles.to_dataframe()
    assert list(frame["name"])[-1] == "23G-6" and frame["drag [N]"].isna().sum() == 1
    assert frame["drag_reason"].iloc[-1] == "There is no curve."
    means = frame.groupby("group")["drag [N]"].mean()
    for each in needles.statistics("drag"):
        if each.group != "all":
            assert each.mean == pytest.approx(means[each.group], rel=1e-12)


def test_one_needle_has_no_interval_of_the_mean(needles):
    alone = penetration_tests([needles.tests[0]])
    (found,) = alone.statistics("drag")
    assert (found.n, found.group) == (1, "all") and math.isnan(found.sd) and math.isnan(found.low)


def test_groups_by_name(needles):
    first, second = needles.tests[:2]
    named = lambda *names: penetration_tests(dict(zip(names, (first, second))))  # noqa: E731
    assert list(named("WT1.1-1", "WT1.1-2").groups) == ["WT1.1"]
    assert list(named("needle 1", "needle 12").groups) == ["needle"]
    assert list(named("alpha", "beta").groups) == ["all"]
    chosen = penetration_tests({"a": first, "b": second}, groups={"a": "x", "b": "y"})
    assert list(chosen.groups) == ["x", "y"]
    with pytest.raises(nf.InputError, match="group"):
        penetration_tests({"a": first, "b": second}, groups={"a": "x"})
    with pytest.raises(nf.InputError, match="at least one"):
        penetration_tests({})


def test_texts_and_plot(needles):
    pytest.importorskip("matplotlib").use("Agg")
    assert "11 needles in 2 groups" in repr(needles)
    assert "peak at tip entry" in str(needles) and "23G-6: There is no curve." in str(needles)
    assert "travel at the heel" in str(needles.tests[0])
    axes = needles.plot()
    assert axes.get_xlabel() == "travel [mm]" and axes.get_ylabel() == "force [N]"
    travel, mean, _ = needles.mean_curve("21G")
    rows = [np.interp(travel, test.travel, test.force, right=np.nan) for test in needles.groups["21G"]]
    assert mean == pytest.approx(np.nanmean(rows, axis=0))
    assert isinstance(needles["21G-1"], PenetrationTest)
