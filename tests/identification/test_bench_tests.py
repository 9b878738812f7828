# SPDX-License-Identifier: Apache-2.0
"""Stress-stretch laws against their strain energy, fits and the choice of the law against simulated, published and real
curves."""

import numpy as np
import pytest

import needleforce as nf
from needleforce.bench_tests import (
    LAWS,
    MODES,
    StressCurve,
    fit_stress,
    initial_modulus,
    modulus_by_mode,
    nominal_stress,
    stable_range,
    tissue_estimate,
)
from needleforce.bench_tests.stress_fit import inflation_of

# law, coefficients, Young's modulus by the textbook: E = 3 mu_0
CASES = [
    ("linear", [116e3], 116e3),
    ("neo_hookean", [116e3 / 3], 116e3),
    ("mooney_rivlin", [15e3, 4e3], 6 * 19e3),
    ("yeoh", [19e3, 500.0, 30.0], 6 * 19e3),
    ("ogden_1", [-180.0, -17.0], 1.5 * 180 * 17),
    ("ogden_2", [12e3, 1.3, 30.0, 8.0], 1.5 * (12e3 * 1.3 + 240)),
    ("ogden_3", [0.618e6, 1.3, 1177.0, 5.0, -9810.0, -2.0], 1.5 * (0.8034e6 + 5885 + 19620)),  # Ogden 1972, rubber
]
OGDEN_1972 = CASES[-1][1]
# stretches of the three axes over that of the first, and how many axes are loaded
AXES = {
    "uniaxial": (lambda s: (s, s**-0.5, s**-0.5), 1),
    "equibiaxial": (lambda s: (s, s, s**-2), 2),
    "planar": (lambda s: (s, 1.0 + 0.0 * s, 1.0 / s), 1),
}


def energy(law, stretches, c):
    """Strain energy by the textbook, of complex stretches too."""
    one, two = sum(s**2 for s in stretches) - 3.0, sum(s**-2 for s in stretches) - 3.0
    if law == "neo_hookean":
        return 0.5 * c[0] * one
    if law == "mooney_rivlin":
        return c[0] * one + c[1] * two
    if law == "yeoh":
        return c[0] * one + c[1] * one**2 + c[2] * one**3
    return sum(m / a * (sum(s**a for s in stretches) - 3.0) for m, a in zip(c[::2], c[1::2]))


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("law, coefficients", [case[:2] for case in CASES[1:]])
def test_the_stress_is_the_derivative_of_the_energy(law, coefficients, mode):
    path, loaded = AXES[mode]
    stretch = np.array([0.7, 0.9, 0.99, 1.01, 1.2, 2.0, 4.0])
    step = 1e-30j  # of a complex number: the derivative has no rounding
    expected = energy(law, path(stretch + step), coefficients).imag / 1e-30 / loaded
    np.testing.assert_allclose(nominal_stress(law, stretch, coefficients, mode), expected, rtol=1e-9)


@pytest.mark.parametrize("mode, ratio", [("uniaxial", 1.0), ("equibiaxial", 2.0), ("planar", 4.0 / 3.0)])
@pytest.mark.parametrize("law, coefficients, modulus", CASES)
def test_the_initial_slope_is_that_of_an_incompressible_tissue(law, coefficients, modulus, mode, ratio):
    step = 1e-6
    slope = np.diff(nominal_stress(law, [1 - step, 1 + step], coefficients, mode))[0] / (2 * step)
    assert slope == pytest.approx(ratio * modulus, rel=1e-5)
    assert initial_modulus(law, coefficients) == pytest.approx(modulus, rel=1e-12)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("law, coefficients, modulus", CASES)
def test_each_law_finds_its_own_modulus(law, coefficients, modulus, mode):
    low, high = (0.9, 1.1) if law == "ogden_1" else (0.8, 1.6) if law != "ogden_3" else (1.01, 6.0)
    stretch = np.linspace(low, high, 60)
    curve = StressCurve(stretch, nominal_stress(law, stretch, coefficients, mode), mode=mode)
    found = fit_stress(curve, law=law)
    assert found.young_modulus.value == pytest.approx(modulus, rel=1e-6)
    assert found.misfit < 1e-9


def test_planar_loading_does_not_separate_the_terms_of_mooney_rivlin():
    stretch = np.linspace(0.8, 1.6, 30)
    curve = StressCurve(stretch, nominal_stress("mooney_rivlin", stretch, [15e3, 4e3], "planar"), mode="planar")
    assert fit_stress(curve, law="mooney_rivlin").young_modulus.value == pytest.approx(6 * 19e3)  # of their sum
    (both,) = [law for law in fit_stress(curve).laws if law.law == "mooney_rivlin"]
    assert "do not determine" in both.excluded


def test_an_exact_curve_chooses_the_simplest_law():
    stretch = np.linspace(0.9, 1.25, 30)
    found = {law: fit_stress(StressCurve(stretch, nominal_stress(law, stretch, [39e3]))).best
             for law in ("linear", "neo_hookean")}  # fmt: skip
    assert found["linear"].law == "linear" and found["linear"].weight > 0.99
    # Mooney-Rivlin, Yeoh and Ogden's law contain the neo-Hookean one and fit as exactly: by AICc = 2 k n/(n - k - 1)
    # alone, k with the variance, it has this weight and no more
    penalty = [2.0 * k * 30.0 / (30.0 - k - 1.0) for k in (2, 3, 3, 4)]
    expected = 1.0 / np.sum(np.exp(-0.5 * (np.array(penalty) - penalty[0])))
    assert found["neo_hookean"].law == "neo_hookean" and found["neo_hookean"].weight == pytest.approx(
        expected, rel=0.02
    )


def coverage(law, coefficients, modulus, *, noise, readings, count, seed=1, smooth=0.0):
    """Share of curves whose interval contains the modulus, with noise of a share of the peak, AR(1) with ``smooth``."""
    low, high = {"linear": (1.0, 1.15), "neo_hookean": (1.0, 1.3), "ogden_1": (0.9, 1.1), "ogden_2": (0.7, 2.0),
                 "ogden_3": (1.0, 6.0)}.get(law, (0.8, 1.6))  # fmt: skip
    stretch = np.linspace(low, high, readings)
    stress, random, inside = nominal_stress(law, stretch, coefficients), np.random.default_rng(seed), 0
    for _ in range(count):
        white = random.standard_normal(readings)
        for k in range(1, readings):
            white[k] = smooth * white[k - 1] + np.sqrt(1.0 - smooth**2) * white[k]
        found = fit_stress(StressCurve(stretch, stress + noise * np.abs(stress).max() * white)).young_modulus
        inside += found.low <= modulus <= found.high
    return inside / count


def test_the_interval_holds_the_truth_where_the_law_is_chosen_too(many):
    # benchmarks/stress_laws.py does the same with 200 curves of each, and with laws that are not in the list
    shares = [coverage(*case, noise=0.005, readings=40, count=many(3, 15)) for case in CASES]
    assert min(shares) >= 0.8 and np.mean(shares) >= 0.94


def test_the_interval_holds_the_truth_with_correlated_noise(many):
    shares = [coverage(*case, noise=0.005, readings=80, count=many(5, 25), smooth=0.7) for case in CASES[:3]]
    assert np.mean(shares) >= 0.92


def test_correlated_residuals_count_for_less():
    random = np.random.default_rng(3)
    white = random.standard_normal((400, 60))
    assert np.mean([inflation_of([each], 0) for each in white]) < 1.3
    noise = white.copy()
    for k in range(1, 60):
        noise[:, k] = 0.8 * noise[:, k - 1] + 0.6 * noise[:, k]
    assert np.mean([inflation_of([each], 0) > 2.0 for each in noise]) > 0.9


def test_the_mode_of_one_curve_is_never_assumed_silently(tmp_path):
    stretch = np.linspace(1.0, 1.3, 30)
    stress = nominal_stress("neo_hookean", stretch, [10e3], "equibiaxial")
    rows = np.column_stack([stretch, 1e-3 * stress])
    np.savetxt(tmp_path / "t.csv", rows, delimiter=",", header="stretch,stress_kPa", comments="")
    assumed, declared = tissue_estimate(tmp_path / "t.csv"), tissue_estimate(tmp_path / "t.csv", mode="equibiaxial")
    assert "uniaxial mode assumed" in assumed.source and "assumed" not in declared.source
    assert declared.value == pytest.approx(30e3, rel=1e-6)
    both = modulus_by_mode(fit_stress(StressCurve(stretch, stress)))
    assert both["equibiaxial"] == pytest.approx(0.5 * both["uniaxial"])
    assert both["planar"] == pytest.approx(0.75 * both["uniaxial"])


def test_curves_of_one_material_in_different_modes_are_fitted_together():
    random = np.random.default_rng(5)
    curves = []
    for mode, end in (("uniaxial", 6.0), ("equibiaxial", 4.0), ("planar", 5.0)):
        stretch = np.linspace(1.02, end, 30)
        stress = nominal_stress("ogden_3", stretch, OGDEN_1972, mode)
        curves.append(StressCurve(stretch, stress + 2e3 * random.standard_normal(30), mode=mode))
    found = fit_stress(curves)
    assert found.best.law == "ogden_3"
    assert found.young_modulus.low <= CASES[-1][2] <= found.young_modulus.high
    assert found.young_modulus.high - found.young_modulus.low < 0.1 * CASES[-1][2]
    wrong = fit_stress([StressCurve(curve.stretch, curve.stress) for curve in curves])  # all taken as uniaxial
    assert wrong.misfit > 10 * found.misfit


def test_an_unknown_zero_of_the_stress_is_part_of_the_fit():
    random = np.random.default_rng(7)
    stretch = np.linspace(1.0, 1.3, 60)
    stress = nominal_stress("neo_hookean", stretch, [10e3]) + 300.0 + 20.0 * random.standard_normal(60)
    known, free = (fit_stress(StressCurve(stretch, stress), law="neo_hookean", fit_zero=zero) for zero in (False, True))
    assert free.young_modulus.low <= 30e3 <= free.young_modulus.high
    assert free.best.zero[0] == pytest.approx(300.0, abs=20.0)
    assert known.young_modulus.value > 1.05 * 30e3


def test_a_law_that_softens_within_the_readings_is_excluded():
    stretch = np.linspace(1.01, 1.3, 30)
    stress = 1e5 * (stretch - 1) * (1.2 - stretch) + 1e3
    with pytest.raises(nf.InputError, match="softens"):
        fit_stress(StressCurve(stretch, stress), law="mooney_rivlin")


def test_the_end_of_stability_is_where_the_stress_has_its_largest_value():
    coefficients, stretch = [1.0, -0.05, 0.0], np.linspace(1.0, 2.0, 20)
    fine = np.linspace(1.0, 4.0, 300_001)
    peak = fine[np.argmax(nominal_stress("yeoh", fine, coefficients))]
    _, high = stable_range("yeoh", stretch, coefficients, "uniaxial")
    assert high == pytest.approx(peak, rel=0.01) and peak < 4.0
    assert stable_range("neo_hookean", stretch, [1.0], "uniaxial") == (0.0, np.inf)


@pytest.mark.parametrize("mode", MODES)
def test_ogdens_parameters_of_rubber_are_stable(mode):
    # Ogden 1972 requires mu alpha > 0 of each term
    assert stable_range("ogden_3", np.array([1.0, 7.0]), OGDEN_1972, mode)[1] == np.inf


@pytest.mark.parametrize(
    "stretch, stress, message",
    [
        ([1.0, 1.1], [0.0, 1.0], "at least 3 are needed"),
        ([0.0, 0.1, 0.2], [0.0, 1.0, 2.0], "a strain is stretch - 1"),
        ([1.0, 1.1, 1.2], [0.0, np.nan, 2.0], "must be finite"),
        ([1.0, 1.1, 1.2], [0.0, -1.0, -2.0], "opposite sign"),
        ([1.1, 1.1, 1.1], [1.0, 2.0, 3.0], "it must vary"),
        ([1.0, 1.1, 1.2], [0.0, 1.0], "same length"),
    ],
)
def test_readings_that_are_no_curve_are_refused(stretch, stress, message):
    with pytest.raises(nf.InputError, match=message):
        fit_stress(StressCurve(stretch, stress))


@pytest.mark.parametrize("options, message", [({"law": "hooke"}, "ogden_3"), ({"max_stretch": 1.05}, "at least 3")])
def test_wrong_options_are_refused(options, message):
    stretch = np.linspace(1.0, 1.5, 10)
    with pytest.raises(nf.InputError, match=message):
        fit_stress(StressCurve(stretch, nominal_stress("neo_hookean", stretch, [1.0])), **options)
    with pytest.raises(nf.InputError, match="equibiaxial"):
        fit_stress(StressCurve(stretch, stretch, mode="biaxial"))


def test_a_specimen_that_tears_is_reported():
    stretch = np.linspace(1.0, 1.4, 200)
    stress = nominal_stress("neo_hookean", stretch, [10e3]) * np.where(stretch > 1.3, 0.6, 1.0)
    found = fit_stress(StressCurve(stretch, stress))
    assert any("falls after a stretch of 1.3" in note for note in found.notes)
    whole = fit_stress(StressCurve(stretch, stress), max_stretch=1.3)
    assert not any("falls" in note for note in whole.notes)


def test_all_laws_are_tried():
    stretch = np.linspace(0.8, 1.6, 80)
    random = np.random.default_rng(2)
    stress = nominal_stress("yeoh", stretch, [20e3, 4e3, 500.0]) + 100.0 * random.standard_normal(80)
    found = fit_stress(StressCurve(stretch, stress))
    assert {law.law for law in found.laws} == set(LAWS)
    assert sum(law.weight for law in found.laws) == pytest.approx(1.0)
    assert found.best.law == "yeoh" and found.misfit < 0.02


# --- real curves ---


def treloar(recordings, test):
    stress, stretch = np.loadtxt(recordings / "tension" / f"Treloar_1944_{test}_stress_stretch.txt").T
    return StressCurve(stretch, 1e6 * stress, {"UT": "uniaxial", "ET": "equibiaxial", "PS": "planar"}[test])


def test_published_rubber(recordings):
    # Treloar 1944: his shear modulus of 0.39 N/mm^2 fits small and moderate strains of this rubber; E = 3 G
    found = fit_stress(treloar(recordings, "UT"), law="neo_hookean", max_stretch=1.6)
    assert found.young_modulus.value == pytest.approx(3 * 0.39e6, rel=0.1)


def test_ogdens_fit_of_rubber(recordings):
    """Least squares must fit Treloar's three curves at least as well as Ogden's published values do."""
    curves = [treloar(recordings, test) for test in ("UT", "ET", "PS")]
    found = fit_stress(curves, law="ogden")
    published = np.concatenate(
        [nominal_stress("ogden_3", each.stretch, OGDEN_1972, each.mode) - each.stress for each in curves]
    )
    assert np.sqrt(np.mean(published**2)) / 6.3e6 < 0.05  # they are the right curves
    assert found.misfit <= np.sqrt(np.mean(published**2)) / 6.3176e6
    assert found.young_modulus.low <= 3 * 0.39e6 <= found.young_modulus.high  # Treloar's own
    # Ogden's own values have four times the misfit and are not the truth of the interval: 0.6 % above its end
    assert np.sqrt(np.mean(published**2)) / 6.3176e6 > 3.0 * found.misfit
    assert found.young_modulus.value == pytest.approx(CASES[-1][2], rel=0.2)


def test_the_modulus_of_rubber_is_the_same_in_every_mode(recordings):
    found = {test: fit_stress(treloar(recordings, test)).young_modulus for test in ("UT", "ET", "PS")}
    assert found["ET"].low <= found["UT"].high and found["UT"].low <= found["ET"].high
    assert found["PS"].value == pytest.approx(found["ET"].value, rel=0.15)
    taken = fit_stress(StressCurve(*[getattr(treloar(recordings, "ET"), name) for name in ("stretch", "stress")]))
    assert taken.young_modulus.low > found["ET"].high  # the same curve as uniaxial has twice the modulus


@pytest.fixture
def cortex(recordings):
    """Compression of brain cortex; kPa by magnitude."""
    file = recordings / "other-labs" / "brain-tissue" / "cortex-compression.txt"
    stretch, stress = np.loadtxt(file, delimiter=",").T
    return StressCurve(stretch, 1e3 * stress)


def test_the_modulus_of_cortex_is_that_of_its_first_readings(cortex):
    found = fit_stress(cortex)
    # its first secant is 5.3 kPa; by independent fits a Yeoh law has 5.27, an Ogden law 4.8
    assert found.young_modulus.low < 4.8e3 and 5.3e3 < found.young_modulus.high
    assert found.young_modulus.high - found.young_modulus.low < 1.2e3
    assert found.misfit < 0.01


def test_a_law_that_misses_cortex_is_warned_of_and_its_interval_is_wide(cortex):
    found = fit_stress(cortex, law="neo_hookean")
    assert found.young_modulus.value == pytest.approx(8.49e3, rel=0.01)
    assert found.young_modulus.low < 5.3e3
    assert any("misfit" in note and "5 %" in note for note in found.notes)
