# SPDX-License-Identifier: Apache-2.0
"""Figures of penetration tests against closed forms: a curve with known peaks, drag and work."""

import csv
import math
from dataclasses import dataclass

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from scipy.special import erf

import needleforce as nf
from needleforce.identification import PenetrationTest, penetration_test, penetration_tests
from needleforce.identification.bench_tests.penetration import FIGURES

STEP = 1e-5  # [m] of travel between two samples


@dataclass(frozen=True)
class Needle:
    """A needle through a film: power law up to the tip entry, a linear fall, a parabola up to the heel, and a Gaussian
    decline to the drag."""

    contact: float = 0.6e-3
    entry_at: float = 1.5e-3
    entry: float = 0.8
    exponent: float = 1.5
    fall_over: float = 5e-5
    valley: float = 0.4
    heel_at: float = 3.2e-3
    heel: float = 1.1
    decline: float = 0.8e-3
    drag: float = 0.25
    end: float = 12e-3

    def force(self, z):
        z = np.asarray(z, dtype=float)
        rise = self.entry * np.clip((z - self.contact) / (self.entry_at - self.contact), 0, 1) ** self.exponent
        x = z - self.entry_at
        fall = self.entry + (self.valley - self.entry) * x / self.fall_over
        u = (x - self.fall_over) / (self.heel_at - self.entry_at - self.fall_over)
        hump = self.valley + (self.heel - self.valley) * (2 * u - u * u)
        tail = self.drag + (self.heel - self.drag) * np.exp(-(((z - self.heel_at) / self.decline) ** 2))
        parts = [z < self.entry_at, x < self.fall_over, z < self.heel_at]
        return np.select(parts, [rise, fall, hump], tail)

    def work(self, to):
        """The integral of the force from the contact to a travel after the heel."""
        hump = self.heel_at - self.entry_at - self.fall_over
        tail = 0.5 * math.sqrt(math.pi) * self.decline * erf((to - self.heel_at) / self.decline)
        return (
            self.entry * (self.entry_at - self.contact) / (self.exponent + 1)
            + 0.5 * (self.entry + self.valley) * self.fall_over
            + hump * (self.valley + 2 / 3 * (self.heel - self.valley))
            + self.drag * (to - self.heel_at)
            + (self.heel - self.drag) * tail
        )

    def true(self):
        return {
            "contact_travel": self.contact,
            "entry_force": self.entry,
            "entry_travel": self.entry_at - self.contact,
            "entry_fall": self.entry - self.valley,
            "heel_force": self.heel,
            "heel_travel": self.heel_at - self.contact,
            "drag": self.drag,
            "max_force": max(self.entry, self.heel),
        }


def drawn(rng):
    entry, contact = rng.uniform(0.3, 1.5), rng.uniform(0.3e-3, 1.5e-3)
    entry_at = contact + rng.uniform(0.6e-3, 1.5e-3)
    heel_at = entry_at + rng.uniform(1e-3, 2.5e-3)
    return Needle(
        contact=contact,
        entry_at=entry_at,
        entry=entry,
        exponent=rng.uniform(1.0, 2.0),
        fall_over=rng.uniform(1e-6, 1e-4),
        valley=entry * rng.uniform(0.2, 0.7),
        heel_at=heel_at,
        heel=entry * rng.uniform(1.0, 2.0),
        decline=rng.uniform(0.4e-3, 1e-3),
        drag=entry * rng.uniform(0.15, 0.4),
        end=heel_at + rng.uniform(6e-3, 12e-3),
    )


def curve(needle, rng, *, step=STEP, noise=5e-3, quantum=0.0, travel_quantum=0.0):
    z = np.arange(0.0, needle.end, step)
    force = needle.force(z) + noise * rng.standard_normal(len(z))
    if quantum:
        force = np.round(force / quantum) * quantum
    return (np.round(z / travel_quantum) * travel_quantum if travel_quantum else z), force


def test_a_known_curve_without_noise():
    needle = Needle()
    z = np.arange(0.0, needle.end, 2e-6)
    test = penetration_test(z, needle.force(z))
    for name, value in needle.true().items():
        assert test[name].value == pytest.approx(value, rel=0.01), name
    assert test["falls"].value == 2
    assert test["work"].value == pytest.approx(needle.work(z[-1]), rel=1e-3)
    assert test["max_travel"].value == pytest.approx(needle.heel_at - needle.contact, rel=0.01)
    assert test.plateau.start + needle.contact > needle.heel_at + needle.decline


def test_intervals_contain_the_true_figures():
    """Noise of 0.1 to 3 % of the entry, rounding of force and travel, steps of 5 to 20 µm; 95 % are stated."""
    rng = np.random.default_rng(1)
    hits = {name: [] for name in (*Needle().true(), "work")}
    for _ in range(200):
        needle = drawn(rng)
        noise = needle.entry * 10 ** rng.uniform(-3, -1.5)
        options = {"noise": noise, "step": rng.choice([5e-6, 1e-5, 2e-5]), "travel_quantum": rng.choice([0.0, 1e-6])}
        z, force = curve(needle, rng, quantum=noise * rng.choice([0.0, 0.5, 2.0]), **options)
        test = penetration_test(z, force)
        assert test["falls"].value == 2
        true = needle.true() | {"work": needle.work(z[-1])}
        for name, value in true.items():
            if test[name].value is not None:
                hits[name].append(test[name].low <= value <= test[name].high)
    for name, each in hits.items():
        assert len(each) >= 180, name
        assert np.mean(each) >= 0.9, (name, np.mean(each))


def rising(rng):
    """A curve without a peak: a power law, a saturation, or free travel and then a power law; with noise."""
    n = int(10 ** rng.uniform(1.5, 3.5))
    x = np.linspace(0.0, 1.0, n)
    start = rng.uniform(0.0, 0.6) * (rng.random() < 0.5)
    force = np.maximum(x - start, 0.0) ** rng.uniform(1.0, 2.0)
    if rng.random() < 0.3:
        force = 1.0 - np.exp(-x * rng.uniform(1.0, 20.0))
    noise = 10 ** rng.uniform(-3, -1)
    force = force + noise * rng.standard_normal(n)
    quantum = noise * rng.choice([0.0, 1.0, 3.0])
    return x * 1e-2, np.round(force / quantum) * quantum if quantum else force


def test_a_curve_that_only_rises_has_no_peak():
    rng = np.random.default_rng(2)
    found = [penetration_test(*rising(rng)) for _ in range(400)]
    assert sum(test["falls"].value > 0 for test in found) == 0
    assert not any(test.features for test in found)
    assert all("never falls" in test["entry_force"].reason for test in found)


def test_a_short_curve_does_not_know_its_noise_well():
    """The estimate from some twenty readings may be half of the noise."""
    rng = np.random.default_rng(15)
    found = 0
    for _ in range(300):
        x = np.linspace(0.0, 1e-2, int(rng.integers(20, 60)))
        found += penetration_test(x, 10.0 * x + 0.02 * rng.standard_normal(len(x)))["falls"].value > 0
    assert found == 0


def test_correlated_noise_makes_no_peak():
    rng = np.random.default_rng(3)
    for length in (2, 5, 10, 20):
        for _ in range(10):
            z = np.linspace(0.0, 1e-2, 3000)
            white = rng.standard_normal(len(z) + length - 1)
            force = z / 1e-2 + 0.05 * np.convolve(white, np.ones(length) / length**0.5, "valid")
            assert penetration_test(z, force)["falls"].value == 0


def test_a_step_is_an_entry_without_a_fall():
    rng = np.random.default_rng(4)
    z = np.arange(0.0, 6e-3, STEP)
    force = np.where(z < 2e-3, z / 2e-3, 1.0 + 0.1 * (z - 2e-3) / 2e-3) + 3e-3 * rng.standard_normal(len(z))
    test = penetration_test(z, force)
    assert test.features[0].kind == "step"
    assert test["entry_force"].low <= 1.0 <= test["entry_force"].high
    zero = 0.0 if test["contact_travel"].value is None else test["contact_travel"].value
    assert test["entry_travel"].value + zero == pytest.approx(2e-3, abs=5e-5)
    assert test["entry_fall"].value is None and "does not" in test["entry_fall"].reason
    assert test["falls"].value == 0
    stated = penetration_test(z, force, min_fall=0.1)
    assert not stated.features and "smallest fall" in stated["entry_force"].reason


def test_stated_travels_of_work_and_drag():
    needle, rng = Needle(), np.random.default_rng(5)
    z, force = curve(needle, rng)
    test = penetration_test(z, force, work_to=6e-3, plateau_travel=(6e-3, 9e-3), baseline=False)
    zero = test["contact_travel"].value
    assert test["work"].low <= needle.work(6e-3 + zero) <= test["work"].high
    part = force[(z >= 6e-3 + zero) & (z <= 9e-3 + zero)]
    assert test["drag"].value == pytest.approx(part.mean(), rel=1e-3)
    assert test["drag_sd"].value == pytest.approx(part.std(ddof=1), rel=1e-3)
    far = penetration_test(z, force, work_to=20e-3, plateau_travel=(6e-3, 30e-3))
    assert far["work"].value is None and "before the stated travel" in far["work"].reason
    assert far["drag"].value is None and far["drag_sd"].value is None


def test_a_curve_that_ends_early_has_no_plateau():
    needle, rng = Needle(), np.random.default_rng(6)
    z, force = curve(needle, rng)
    before_heel, declining = z < 2.5e-3, z < needle.heel_at + 0.8e-3
    test = penetration_test(z[before_heel], force[before_heel])
    assert test["entry_force"].value == pytest.approx(needle.entry, rel=0.03)
    assert test["heel_force"].value is None and "second peak" in test["heel_force"].reason
    assert test["drag"].value is None and "not steady" in test["drag"].reason
    test = penetration_test(z[declining], force[declining])
    assert test["heel_force"].value == pytest.approx(needle.heel, rel=0.02)
    assert test["drag"].value is None


def test_several_tips_are_counted_and_have_no_heel():
    rng = np.random.default_rng(7)
    z = np.arange(0.0, 4e-3, STEP)
    force = 1e3 * z - sum(0.4 * (z > at) for at in (1e-3, 1.5e-3, 2e-3)) - 0.8 * (z > 3e-3)
    test = penetration_test(z, force + 5e-3 * rng.standard_normal(len(z)), tips=4)
    assert test["falls"].value == 4
    assert test["heel_force"].value is None and "4 tips" in test["heel_force"].reason
    assert test["largest_fall"].low <= 0.8 <= test["largest_fall"].high
    assert test["entry_fall"].low <= 0.4 <= test["entry_fall"].high
    few = penetration_test(z, force + 5e-3 * rng.standard_normal(len(z)), min_fall=0.6)
    assert few["falls"].value == 1


@pytest.mark.parametrize("count", [500, 5_000, 50_000, 500_000])
def test_dense_sampling_does_not_raise_the_peak(count):
    """The highest of many readings near a rounded top is four standard deviations above it."""
    rng = np.random.default_rng(13)
    z = np.linspace(0.0, 6e-3, count)
    force = np.where(z < 1e-3, 0.0, np.sin(np.pi * np.clip((z - 1e-3) / 4e-3, 0.0, 1.0))) + 0.02 * rng.standard_normal(
        count
    )
    test = penetration_test(z, force)
    assert test["falls"].value == 1
    assert test["entry_force"].low <= 1.0 <= test["entry_force"].high
    assert test["max_force"].value == test["entry_force"].value
    assert test.features[0].reading == pytest.approx(force.max(), abs=0.01)


def test_a_force_before_the_contact_is_no_entry():
    """The machine starts with a transient of its own."""
    needle, rng = Needle(contact=3e-3, entry_at=4e-3, heel_at=6e-3, end=16e-3), np.random.default_rng(14)
    z, force = curve(needle, rng)
    force += 0.1 * np.exp(-(((z - 0.2e-3) / 0.05e-3) ** 2))
    test = penetration_test(z, force)
    assert test["entry_force"].low <= needle.entry <= test["entry_force"].high
    assert test["falls"].value == 2


# ---- what files contain


def same(a, b, names=("entry_force", "heel_force", "drag", "max_force")):
    for name in names:
        assert a[name].value == pytest.approx(b[name].value, rel=0.02), name


def test_insertion_and_withdrawal():
    needle, rng = Needle(), np.random.default_rng(8)
    z, force = curve(needle, rng)
    back = np.arange(needle.end, 0.0, -STEP)
    both = np.concatenate((z, back)), np.concatenate((force, -0.3 + 5e-3 * rng.standard_normal(len(back))))
    test = penetration_test(*both)
    same(test, penetration_test(z, force))
    assert any("goes back" in note for note in test.notes)


def test_signs_are_recognised_and_stated():
    needle, rng = Needle(), np.random.default_rng(9)
    z, force = curve(needle, rng)
    test = penetration_test(5e-3 - z, -force)
    same(test, penetration_test(z, force))
    assert any("Travel decreases" in note for note in test.notes)
    assert any("negative against" in note for note in test.notes)


def test_rows_without_numbers_are_left_out():
    needle, rng = Needle(), np.random.default_rng(10)
    z, force = curve(needle, rng)
    holes = force.copy()
    holes[[5, 400, 401]] = np.nan
    tail = np.concatenate((z, z[-1] + STEP * np.arange(1, 50))), np.concatenate((holes, np.full(49, np.nan)))
    test = penetration_test(*tail)
    same(test, penetration_test(z, force))
    assert "3 rows without a number are left out." in test.notes


def test_a_constant_step_is_a_travel():
    needle, rng = Needle(), np.random.default_rng(11)
    z, force = curve(needle, rng)
    same(penetration_test(STEP, force), penetration_test(z, force))


@pytest.mark.parametrize(
    "travel, force, reason",
    [
        ([], [], "no values"),
        ([0.0, 1e-3, 2e-3], [0.0, 1.0, 0.5], "3 samples"),
        (np.arange(100) * 1e-5, np.ones(100), "constant"),
        (np.arange(100) * 1e-5, np.full(100, np.nan), "no values"),
        (np.zeros(100), np.arange(100.0), "at least 20"),
    ],
)
def test_a_curve_without_figures_has_a_reason(travel, force, reason):
    test = penetration_test(travel, force, name="A")
    assert test.empty and set(test.figures) == set(FIGURES)
    assert all(reason in figure.reason for figure in test.figures.values())
    assert reason in repr(test)


@pytest.mark.parametrize(
    "travel, force, options, quantity",
    [
        ([0, 1, 2], [0, 1], {}, "shape of travel"),
        ([0, 1, np.inf], [0, 1, 2], {}, "travel and force"),
        (-1e-5, np.arange(50.0), {}, "travel"),
        (np.random.default_rng(1).permutation(500) * 1e-5, np.arange(500.0), {}, "travel"),
        (1e-5, np.arange(50.0), {"work_to": -1.0}, "work_to"),
        (1e-5, np.arange(50.0), {"plateau_travel": (2.0, 1.0)}, "plateau_travel"),
        (1e-5, np.arange(50.0), {"min_fall": -1.0}, "min_fall"),
        (1e-5, np.arange(50.0), {"tips": 0}, "tips"),
    ],
)
def test_wrong_input_is_refused_with_a_next_step(travel, force, options, quantity):
    with pytest.raises(nf.InputError) as caught:
        penetration_test(travel, force, **options)
    assert caught.value.quantity == quantity and caught.value.next_step


# ---- statistics


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


# ---- stalks punctured by a needle, measured elsewhere, read by eye before


def test_stalks_have_the_peaks_that_were_read(recordings, root):
    """Both walls of 21 stalks; waves below 2 N between the walls are not in the readings."""
    rows = (root / "tests" / "segmentation" / "eye_readings_stalks.csv").read_text().splitlines()
    readings = {row["recording"]: row for row in csv.DictReader(line for line in rows if line[0] != "#")}
    assert len(readings) == 21
    for name, row in readings.items():
        table = pd.read_csv(recordings / "other-labs" / "stalk-puncture-instron" / f"{name}.csv")
        _, depth, force = table.iloc[1:].astype(float).to_numpy().T
        test = penetration_test(1e-3 * depth, force, min_fall=2.0, baseline=False)
        eye = [tuple(map(float, each.split(">")[0].split(":"))) for each in row["punctures"].split()]
        zero = 1e3 * (test["contact_travel"].value if test["contact_travel"].value is not None else 1e-3 * depth[0])
        doubtful = [float(each.split(":")[0]) for each in row["doubtful"].split()]
        peaks = [each for each in test.features if each.kind == "peak"]
        peaks = [each for each in peaks if all(abs(1e3 * each.travel + zero - place) > 0.1 for place in doubtful)]
        assert [1e3 * each.travel + zero for each in peaks] == pytest.approx([place for place, _ in eye], abs=0.1), name
        assert [each.force for each in peaks] == pytest.approx([force for _, force in eye], abs=0.5), name


# ---- microneedles in a film, measured elsewhere


@pytest.fixture(scope="module")
def sheet(recordings):
    """(name, summary, forces or text) of every named column, by openpyxl alone."""
    openpyxl = pytest.importorskip("openpyxl")
    path = recordings / "other-labs" / "microneedle-penetration" / "microneedle-data-2.xlsx"
    rows = list(openpyxl.load_workbook(path, data_only=True)["RAW DATA"].iter_rows(min_row=2, values_only=True))
    head = next(k for k, row in enumerate(rows) if row[0] is not None)
    columns = list(zip(*rows[head:]))
    return [
        (name, summary, [x for x in cells if isinstance(x, float | int)], next((x for x in cells if x), ""))
        for name, summary, *cells in columns
        if name
    ]


@pytest.fixture(scope="module")
def microneedles(sheet):
    """The recorded zero of the force is kept, as in the summary of the sheet."""
    many = {name: (5e-6, force) if force else nf.InputError("force", text) for name, _, force, text in sheet}
    return penetration_tests(many, baseline=False)


def test_microneedles_are_all_there(sheet, microneedles):
    assert len(sheet) == len(microneedles) == 250 and len(microneedles.groups) == 50
    assert sum(bool(force) for _, _, force, _ in sheet) == 228
    broken = [name for name, _, force, text in sheet if text == "Broken"]
    assert broken == ["WT1.1-3", "WT1.2-2", "WT1.3-2", "WT1.4-3", "WT1.5-2", "OD2.2-2"]
    for name in broken:
        assert "Broken" in microneedles[name]["entry_force"].reason


def test_maximum_of_every_microneedle(sheet, microneedles):
    for name, _, force, _ in sheet:
        if force:
            figure = microneedles[name]["max_force"]
            slack = 4.0 * microneedles[name].noise
            assert figure.low - slack <= max(force) <= figure.high + slack, name


def test_the_summary_row_is_the_peak_at_tip_entry(sheet, microneedles):
    """226 of 228 columns are summarised by the reading of a peak; the other two by the last one and by ``DNP``."""
    read, differ = [], []
    for name, summary, force, _ in sheet:
        if not force:
            assert summary == "#N/A", name
            continue
        features = microneedles[name].features
        if features and isinstance(summary, float | int):
            read.append(name)
            if abs(features[0].reading - summary) > 1e-9:
                differ.append(name)
    assert len(read) >= 226
    # a smaller fall before the peak; one of 0.2 N that the noise explains; a needle whose summary is its last reading
    assert set(differ) <= {"WT1.1-2", "WT1.2-1", "OD2.2-1"}


def test_microneedles_show_no_drag(sheet, microneedles):
    """They are pressed in until the base touches the film: no curve ends in a plateau."""
    for name, _, force, _ in sheet:
        if force:
            assert microneedles[name]["drag"].value is None and microneedles[name]["drag"].reason, name
