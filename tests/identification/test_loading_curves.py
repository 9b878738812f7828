# SPDX-License-Identifier: Apache-2.0
"""Loading curves: each law against its own simulated curves, odd input, and the ranking on recordings of others."""

import runpy
from collections import Counter

import numpy as np
import pytest
from scipy.optimize import nnls

import needleforce as nf
from needleforce.identification.one_layer.deformation_fit import fit_deformation
from needleforce.identification.one_layer.loading_curves import CURVES
from needleforce.identification.statistics.noise import Noise, noise_of
from needleforce.identification.statistics.regression import criterion, independent_samples

CONTACT, PUNCTURE = 4e-3, 12e-3
# formulas written out once more, by law: F(h) [N], and the numbers in it
TRUTH = {
    "cone": (lambda h: 20e3 * h**2, {"stiffness_coefficient": 20e3}),
    "cone_cylinder": (
        lambda h: np.where(h < 3e-3, 25e3 * h**2, 25e3 * (6e-3 * h - 9e-6)),
        {"stiffness_coefficient": 25e3, "saturation_depth": 3e-3},
    ),
    "power_law": (lambda h: 0.04 * (1e3 * h) ** 1.6, {"reference_force": 0.04, "exponent": 1.6}),
    "polynomial": (lambda h: 40.0 * h + 12e3 * h * h, {"linear": 40.0, "quadratic": 12e3}),
    "exponential": (lambda h: 0.1 * (np.exp(300.0 * h) - 1.0), {"scale": 0.1, "rate": 300.0}),
}


def curve(law, seed=0, noise=5e-3, samples=1200):
    """Depth and force (n,) of free travel and loading."""
    depth = np.linspace(0.0, PUNCTURE, samples)
    force = TRUTH[law][0](np.maximum(depth - CONTACT, 0.0))
    return depth, force + np.random.default_rng(seed).normal(0.0, noise, samples)


def fits(depth, force, contact=CONTACT + 0.5e-3):
    return {law: fit_deformation(depth, force, contact, law) for law in CURVES}


@pytest.mark.parametrize("law", TRUTH)
def test_the_law_of_the_curve_wins_and_its_intervals_hold_its_numbers(law):
    truth, inside, won = TRUTH[law][1] | {"contact_depth": CONTACT, "force_offset": 0.03}, Counter(), 0
    assert set(truth) == {*CURVES[law].parameters, "contact_depth", "force_offset"}
    for seed in range(40):
        depth, force = curve(law, seed)
        found = fits(depth, force + 0.03)
        own = found[law]
        for name, variance in zip(own.order, own.covariance.diagonal()):
            inside[name] += abs(own.values[name] - truth[name]) <= 1.96 * variance**0.5
        won += min(found, key=lambda other: found[other].bic) == law
    # 95 % of 40: below 33 has a chance of 0.3 % for each number
    assert min(inside[name] for name in truth) >= 33, inside
    # a law that holds this one as a special case wins by chance, with a likelihood ratio above log(1200): 1 %
    assert won >= 37


def test_wrong_curves_are_far_behind():
    found = fits(*curve("cone_cylinder"))
    assert min(found[law].bic for law in CURVES if law != "cone_cylinder") > found["cone_cylinder"].bic + 6
    assert found["cone"].bic > found["cone_cylinder"].bic + 100


def test_numbers_are_counted_alike():
    counts = {law: len(fit.order) for law, fit in fits(*curve("cone")).items()}
    assert counts == {"cone": 3, "cone_cylinder": 4, "power_law": 4, "polynomial": 4, "exponential": 4}
    known = fit_deformation(*curve("cone_cylinder"), CONTACT, "cone_cylinder", {"saturation_depth": 3e-3})
    assert known.order == ("stiffness_coefficient", "contact_depth", "force_offset")
    assert known.values["saturation_depth"] == 3e-3


def test_criterion_is_schwarz():
    noise = Noise(sse=2.0, count=100)
    assert criterion(noise.mean_square, 3, 100) == pytest.approx(100 * np.log(0.02) + 3 * np.log(100))
    assert criterion(noise.mean_square, 3, 10) == pytest.approx(10 * np.log(0.02) + 3 * np.log(10))


def test_samples_behind_a_filter_count_as_one():
    noises = []
    for seed in range(20):
        white = np.random.default_rng(seed).standard_normal(4009)
        noises.append(noise_of(np.convolve(white, np.full(10, 0.1), "valid"), 4000, 1, 0.0))
    counted = [independent_samples([noise, noise._replace(sse=2 * noise.sse, long_run=0.0)]) for noise in noises]
    assert np.mean(counted) == pytest.approx(400, rel=0.1)


@pytest.mark.parametrize("law", CURVES)
def test_gradients_are_finite_differences(law):
    each, values = CURVES[law], TRUTH[law][1]
    h = np.array([-1e-3, 0.7e-3, 2.2e-3, 4.1e-3, 7e-3])
    found = each.gradient(h, values)
    for name, value in values.items():
        up, down = (each.force(h, values | {name: value * (1.0 + step)}) for step in (1e-6, -1e-6))
        np.testing.assert_allclose(found[name], (up - down) / (2e-6 * value), rtol=1e-5, atol=1e-12)
    slope = (each.force(h + 1e-9, values) - each.force(h - 1e-9, values)) / 2e-9
    np.testing.assert_allclose(found["contact_depth"], -slope, rtol=1e-5, atol=1e-9)
    assert all(part[0] == 0.0 for part in found.values())


@pytest.mark.parametrize("law", CURVES)
def test_the_curve_is_the_compiled_law(law):
    values = TRUTH[law][1]
    stiffness = CURVES[law].stiffness(values, np.radians(20.0))
    for h in (0.3e-3, 2e-3, 8e-3):
        assert stiffness.force(h) == pytest.approx(float(TRUTH[law][0](np.float64(h))), rel=1e-9)


def solved(law, depth, force, contact, shape):
    """Amplitudes and zero of least squares at one contact depth and shape parameter, and the sum of squares: NNLS of
    the formulas in Python, the zero as the difference of two amplitudes."""
    basis = CURVES[law].basis(np.maximum(depth - contact, 0.0), *shape)
    design = np.column_stack([*basis, np.ones_like(depth), -np.ones_like(depth)])
    scale = np.linalg.norm(design, axis=0)
    found, residual = nnls(design / scale, force)
    return found / scale, residual**2


@pytest.mark.parametrize("samples", [200, 1201, 20_000])  # with and without block means, an odd number too
@pytest.mark.parametrize("law", CURVES)
def test_the_compiled_fit_has_the_formulas_of_the_curve(law, samples):
    """Amplitudes, zero and sum of squares of the compiled fit are those of the formulas in Python at the same place."""
    for made in ("cone_cylinder", law):
        depth, force = curve(made, noise=2e-3, samples=samples)
        fit = fit_deformation(depth, force - 0.4, CONTACT, law)
        shape = [fit.values[name] for name in CURVES[law].shape]
        (*amplitudes, plus, minus), squares = solved(law, depth, force - 0.4, fit.values["contact_depth"], shape)
        assert fit.noise.sse == pytest.approx(squares, rel=1e-9)
        assert fit.values["force_offset"] == pytest.approx(plus - minus, rel=1e-7)
        assert [fit.values[name] for name in CURVES[law].amplitudes] == pytest.approx(amplitudes, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("law", CURVES)
def test_no_neighbour_of_the_fit_is_better(law):
    """The fit runs to convergence: a thousandth of a standard error further, nothing is better."""
    depth, force = curve(law, samples=6000)
    fit = fit_deformation(depth, force, CONTACT + 1e-3, law)
    errors = dict(zip(fit.order, fit.covariance.diagonal() ** 0.5))
    place, shape = fit.values["contact_depth"], [fit.values[name] for name in CURVES[law].shape]
    for by in (-1e-3, -1e-2, 1e-2, 1e-3):
        moved = [value + by * errors[name] for name, value in zip(CURVES[law].shape, shape)]
        for trial in ((place + by * errors["contact_depth"], shape), (place, moved)):
            assert solved(law, depth, force, *trial)[1] >= fit.noise.sse * (1.0 - 1e-12)


def test_held_parameters_are_reported():
    concave = fit_deformation(*curve("cone_cylinder", noise=1e-3), CONTACT, "polynomial")
    assert concave.values["quadratic"] >= 0.0
    steep = fit_deformation(*curve("exponential", noise=1e-3), CONTACT, "polynomial")
    assert steep.values["linear"] == 0.0 and any("linear" in sentence for sentence in steep.held)
    depth = np.linspace(0.0, PUNCTURE, 500)
    straight = fit_deformation(depth, 30.0 * np.maximum(depth - CONTACT, 0.0), CONTACT, "power_law")
    assert straight.values["exponent"] == pytest.approx(1.0, abs=1e-3) and "exponent" in straight.held[0]


@pytest.mark.parametrize("law", CURVES)
def test_invalid_input_raises_an_error(law):
    depth, force = curve("cone")
    with pytest.raises(nf.InputError, match="samples before the puncture"):
        fit_deformation(depth[-12:], force[-12:], CONTACT, law)
    with pytest.raises(nf.InputError, match="in contact"):
        fit_deformation(depth, force, PUNCTURE + 1e-3, law)
    for dead in (-TRUTH["cone"][0](np.maximum(depth - CONTACT, 0.0)), np.zeros_like(depth)):
        with pytest.raises(nf.InputError, match="not rising"):
            fit_deformation(depth, dead, CONTACT, law)
    refused = 0
    for seed in range(12):  # noise about the sensor's zero rises or falls by chance
        noise_alone = np.random.default_rng(seed).normal(0.1, 5e-3, len(depth))
        try:
            fit = fit_deformation(depth, noise_alone, CONTACT, law)
        except nf.InputError:
            refused += 1
            continue
        assert np.isfinite(fit.bic) and fit.noise.sse <= len(depth) * float(noise_alone.var()) * (1.0 + 1e-12)
    assert refused < 12


def grid(law, depth, force, contact):
    """Least sum of squares over a fine grid of contact depth and shape number: no search."""
    span = depth.max() - contact
    basis = {
        "cone_cylinder": lambda h, s: np.where(h < s * span, h**2, 2 * s * span * h - (s * span) ** 2),
        "power_law": lambda h, s: (h / span) ** s,
        "exponential": lambda h, s: np.expm1(s * h / span),
    }[law]
    numbers = {
        "cone_cylinder": np.linspace(0.01, 2.0, 120),
        "power_law": np.linspace(1.0, 6.0, 120),
        "exponential": np.geomspace(1e-2, 25.0, 120),
    }[law][:, None]
    least, force = np.inf, force - force.mean()
    for place in contact + span * np.linspace(-0.95, 0.85, 120):
        rows = basis(np.maximum(depth - place, 0.0)[None], numbers)
        rows = rows - rows.mean(axis=1)[:, None]  # the sensor's zero is fitted
        along = np.maximum(rows @ force, 0.0) ** 2 / np.einsum("kn,kn->k", rows, rows)
        least = min(least, float(force @ force - along.max()))
    return least


@pytest.fixture(scope="module")
def study(root):
    return runpy.run_path(str(root / "benchmarks" / "loading_curves.py"))


@pytest.fixture(scope="module")
def real(recordings, study):
    """Condition, depth, force and contact depth of every loading curve."""
    return study["insertions"](recordings / "needle-insertion-rig")[0]


@pytest.mark.parametrize("law", ["cone_cylinder", "power_law", "exponential"])
def test_no_point_of_a_fine_grid_is_better(real, law):
    for _, depth, force, contact in real[::8]:
        found = fit_deformation(depth, force, contact, law).noise.sse
        assert found <= grid(law, depth, force, contact) * (1.0 + 1e-6)


def test_the_cone_on_a_cylinder_wins_and_the_quadratic_is_far_behind(real, study):
    """The order that an earlier fit found over 158 recordings of the same rig."""
    found = study["loadings"](real, 1.0)
    assert len(found) > 80
    for which in ("bic", "correlated"):
        rows = [getattr(each, which) for each in found]
        won, apart = study["wins"](rows), study["differences"](rows)
        assert won["cone_cylinder"] > len(found) / 2
        if which == "bic":  # few independent samples cannot afford a shape parameter next to the sensor's zero
            ranked = sorted(won, key=won.get, reverse=True)
            assert ranked[:2] == ["cone_cylinder", "power_law"] and won["cone"] < len(found) / 8
        assert np.median(apart["power_law"]) < np.median(apart["polynomial"]) < np.median(apart["cone"])
    plain = study["differences"]([each.bic for each in found])
    assert np.median(plain["cone"]) > 2 * np.median(plain["power_law"]) > 100
    assert np.median([each.residual["cone_cylinder"] for each in found]) < 0.015
