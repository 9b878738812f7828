# SPDX-License-Identifier: Apache-2.0
"""Draws beside a brute-force grid, a random walk over the same likelihood, and the truth of many recordings."""

import runpy
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2, ks_2samp

from needleforce.identification.one_layer.cycle_fit import fit_cycle
from needleforce.identification.one_layer.cycle_values import CycleOptions
from needleforce.identification.statistics.draws import EXACT, GAUSSIAN, draw_cycle

NOISE = 10e-3


@pytest.fixture(scope="module")
def simulate(root):
    return runpy.run_path(str(root / "benchmarks" / "fit.py"))["simulate"]


def drawn(arrays, count, seed=0, **options):
    """The draws, their method and the fit of four arrays."""
    fit = fit_cycle(*arrays, CycleOptions(**options))
    strokes = SimpleNamespace(**dict(zip(("depth_in", "force_in", "depth_out", "force_out"), arrays)))
    return *draw_cycle(fit, strokes, count, np.random.default_rng(seed)), fit


def model(arrays, c, contact, friction, cutting, puncture, saturation=np.inf, zero=0.0):
    """The specification's formula, sample by sample, and the sensor's zero; ``puncture`` counts the samples before
    it."""
    h, out = arrays[0] - contact, np.maximum(arrays[2] - contact, 0.0)
    cone = np.clip(h, 0.0, saturation)
    pushed = c * cone * (2.0 * np.maximum(h, 0.0) - cone)
    after = friction * h + cutting
    return zero + np.concatenate([np.where(np.arange(len(h)) < puncture, pushed, after), -friction * out])


def left(arrays, *parameters, zero):
    force = np.concatenate([arrays[1], arrays[3]])
    return float(np.sum((force - model(arrays, *parameters, zero=zero)) ** 2))


def variance_of(fit):
    return sum(noise.count * noise.long_run for noise in fit.residuals.noises) / fit.residuals.count


def weighted_quantile(values, weights, share):
    """Of a grid: each node's weight lies half below it."""
    nodes, at = np.unique(values, return_inverse=True)
    each = np.bincount(at, weights)
    return np.interp(share, np.cumsum(each) - 0.5 * each, nodes)


def test_draws_are_the_posterior_of_a_brute_force_grid(simulate):
    arrays, _ = simulate(3, NOISE, samples=300)
    found, method, fit = drawn(arrays, 200_000)
    assert method == EXACT
    variance, force = variance_of(fit), np.concatenate([arrays[1], arrays[3]])
    rows = []
    sd = np.sqrt(fit.covariance[1, 1])
    for contact in fit.values["contact_depth"] + sd * np.linspace(-5.5, 5.5, 111):
        for puncture in range(fit.puncture.before - 6, fit.puncture.before + 7):
            unit = [
                model(arrays, *each, puncture) for each in ((1, contact, 0, 0), (0, contact, 1, 0), (0, contact, 0, 1))
            ]
            design = np.column_stack([*unit, np.ones_like(force)])
            best, misfit, _, _ = np.linalg.lstsq(design, force, rcond=None)
            volume = -0.5 * np.linalg.slogdet(design.T @ design)[1]
            spread = np.sqrt(variance * np.linalg.inv(design.T @ design).diagonal())
            rows.append((contact, puncture, volume - 0.5 * misfit[0] / variance, *best, *spread))
    contact, puncture, log, *means = np.array(rows).T
    weights = np.exp(log - log.max())
    weights /= weights.sum()
    for share in (0.025, 0.5, 0.975):
        assert np.quantile(found["contact_depth"], share) == pytest.approx(
            weighted_quantile(contact, weights, share), abs=0.03 * sd
        )
    for name, mean, spread in zip(
        ("stiffness_coefficient", "friction_per_length", "cutting_force", "force_offset"), means[:4], means[4:]
    ):
        total = np.sqrt(weights @ (spread**2 + mean**2) - (weights @ mean) ** 2)
        assert found[name].mean() == pytest.approx(weights @ mean, abs=0.02 * total)
        assert found[name].std() == pytest.approx(total, rel=0.01)
    after = np.searchsorted(arrays[0], found["puncture_depth"])
    for each in np.unique(puncture).astype(int):
        assert np.mean(after == each) == pytest.approx(weights[puncture == each].sum(), abs=0.006)


def walk(arrays, fit, steps, seed):
    """Random-walk Metropolis over (c, z0, f', f_c, h_s, b, puncture) with the same flat priors: (steps, 7)."""
    random, variance, n = np.random.default_rng(seed), variance_of(fit), len(fit.order)
    place = np.array([*(fit.values[name] for name in fit.order), fit.puncture.before])
    root = np.linalg.cholesky(fit.covariance / np.outer(*2 * [np.sqrt(fit.covariance.diagonal())]))
    root *= np.sqrt(fit.covariance.diagonal())[:, None] * 2.0 / np.sqrt(n)

    def log(x):
        c, contact, friction, cutting, *saturation, zero, puncture = x
        inside = not saturation or 0.0 < saturation[0] < arrays[0][fit.puncture.before] - contact
        if c < 0.0 or friction < 0.0 or not inside:
            return -np.inf
        return -0.5 * left(arrays, c, contact, friction, cutting, int(puncture), *saturation, zero=zero) / variance

    here, trace = log(place), np.empty((steps, n + 1))
    for k in range(steps):
        trial = place.copy()
        trial[:n] += root @ random.standard_normal(n)
        trial[n] += random.integers(-1, 2)
        there = log(trial)
        if np.log(random.random()) < there - here:
            place, here = trial, there
        trace[k] = place
    return trace


@pytest.mark.parametrize("law", ["cone", "cone_cylinder"])
def test_a_random_walk_over_the_same_likelihood_comes_to_the_same(simulate, law):
    arrays, _ = simulate(5, NOISE, samples=300)
    if law == "cone_cylinder":  # with a contact that saturates
        truth = 2.3e4, 4e-3, 18.6, 0.0776, int(np.searchsorted(arrays[0], 7.5e-3)), 1.6e-3
        force = model(arrays, *truth) + np.random.default_rng(1).normal(0.0, NOISE / 3, len(arrays[0]) + len(arrays[2]))
        arrays = arrays[0], force[: len(arrays[0])], arrays[2], force[len(arrays[0]) :]
    found, method, fit = drawn(arrays, 60_000, law=law)
    assert method == EXACT
    trace = walk(arrays, fit, 60_000, 2)[5_000:]
    for k, name in enumerate(fit.order):
        # about one independent sample in 50: the mean of the walk is known to 3 % of a standard error
        assert trace[:, k].mean() == pytest.approx(found[name].mean(), abs=0.15 * found[name].std()), name
        assert trace[:, k].std() == pytest.approx(found[name].std(), rel=0.12), name
        assert ks_2samp(trace[::50, k], found[name][:20_000]).pvalue > 1e-3, name


def test_ranks_of_the_truth_are_even(simulate):
    """Simulation-based calibration (Talts et al. 2018): among draws the truth may stand anywhere."""
    bins, runs = 10, 300
    counts = {}
    for seed in range(runs):
        arrays, truth = simulate(seed, NOISE, samples=1000)
        found, _, _ = drawn(arrays, 399, seed)
        for name in found:
            below = int((found[name] < truth.get(name, 0.0)).sum())  # simulated with a zero of 0
            counts.setdefault(name, np.zeros(bins))[bins * below // 400] += 1
    for name, count in counts.items():
        statistic = np.sum((count - runs / bins) ** 2) / (runs / bins)
        assert chi2.sf(statistic, bins - 1) > 1e-3, (name, count)


def test_what_cannot_be_exact_is_gaussian_and_says_so(simulate):
    quiet, _ = simulate(1, 1e-7, samples=500)
    found, method, fit = drawn(quiet, 20_000)
    assert method == GAUSSIAN
    errors = np.sqrt(fit.covariance.diagonal())
    for name, error in zip(fit.order, errors):
        assert found[name].mean() == pytest.approx(fit.values[name], abs=0.05 * error)
        assert found[name].std() == pytest.approx(error, rel=0.03)


def test_no_coefficient_is_drawn_below_zero(simulate):
    arrays, _ = simulate(2, 30e-3, samples=300)
    h = arrays[0] - 5e-3
    force = np.random.default_rng(4).normal(0.0, 30e-3, len(arrays[0]) + len(arrays[2]))
    force[: len(h)] += np.where(h < 3e-3, 2e4 * np.maximum(h, 0.0) ** 2, 0.0776)  # no friction
    found, method, _ = drawn((arrays[0], force[: len(h)], arrays[2], force[len(h) :]), 20_000)
    assert method == EXACT
    assert found["friction_per_length"].min() >= 0.0 and found["stiffness_coefficient"].min() >= 0.0
    # the bound cuts through the bulk: draws stand close to it
    friction = found["friction_per_length"]
    assert np.mean(friction < 0.1 * friction.max()) > 0.05
