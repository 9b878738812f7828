# SPDX-License-Identifier: Apache-2.0
"""Figures of penetration tests against closed forms: a curve with known peaks, drag and work."""

import numpy as np
import pytest
from known_penetration import STEP, Needle, curve, drawn

import needleforce as nf
from needleforce.bench_tests import penetration_test
from needleforce.bench_tests.penetration import FIGURES


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


def test_intervals_contain_the_true_figures(many):
    """Noise of 0.1 to 3 % of the entry, rounding of force and travel, steps of 5 to 20 µm; 95 % are stated."""
    rng = np.random.default_rng(1)
    hits = {name: [] for name in (*Needle().true(), "work")}
    for _ in range(count := many(40, 200)):
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
        assert len(each) >= 0.9 * count, name
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


def test_a_curve_that_only_rises_has_no_peak(many):
    rng = np.random.default_rng(2)
    found = [penetration_test(*rising(rng)) for _ in range(many(60, 400))]
    assert sum(test["falls"].value > 0 for test in found) == 0
    assert not any(test.features for test in found)
    assert all("never falls" in test["entry_force"].reason for test in found)


def test_a_short_curve_does_not_know_its_noise_well(many):
    """The estimate from some twenty readings may be half of the noise."""
    rng = np.random.default_rng(15)
    found = 0
    for _ in range(many(80, 300)):
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
