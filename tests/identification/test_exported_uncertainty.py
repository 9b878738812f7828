# SPDX-License-Identifier: Apache-2.0
"""What a fit hands on of its uncertainty: pooled draws, correlations, profiles, tables, ArviZ."""

import csv
import dataclasses
import json
import warnings

import numpy as np
import pytest
from scipy.stats import t as student

import needleforce as nf
from needleforce.identification import profile
from needleforce.identification.diagnostics import noise_words
from needleforce.identification.estimates import Estimate, pool
from needleforce.identification.statistics.noise import TWO_SIDED, Noise, noise_of

MOTION = nf.Motion.insert(start=-3e-3, speed=3e-3, depth=14e-3, hold=1.0)


def noisy(name="paper", seed=0, noise=3e-3, depth=None):
    """A run of a preset behind white noise; ``depth`` [m] moves its puncture."""
    model = nf.preset(name)
    model = model if depth is None else model.replace(puncture=nf.laws.PunctureDepth(depth))
    run = nf.simulate(model, MOTION)
    return dataclasses.replace(run, force=run.force + np.random.default_rng(seed).normal(0.0, noise, len(run)))


@pytest.fixture(scope="module")
def one():
    return nf.identify(noisy("physical"), model="cone_cylinder")


@pytest.fixture(scope="module")
def several():
    depths = 3.237e-3 + 0.135e-3 * np.array([-1.2, -0.3, 0.4, 1.1])
    return nf.identify([noisy(seed=k, depth=depth) for k, depth in enumerate(depths)], model="paper")


def test_draws_of_repeats_are_students(several):
    draws = several.draws(40_000, seed=1)
    assert len(draws.files) == 4 and all(values.shape == (4, 40_000) for values in draws.own.values())
    for name in ("puncture_depth", "puncture_indentation"):  # scatter far beyond their own errors
        values = np.array([each.parameters[name].value for each in several.recordings])
        scale = values.std(ddof=1) / 2.0
        for share in (0.025, 0.5, 0.975):
            expected = values.mean() + scale * student.ppf(share, 3)
            assert np.quantile(draws[name], share) == pytest.approx(expected, abs=0.15 * scale)
    moved = np.corrcoef(draws["puncture_depth"], draws["puncture_indentation"])[0, 1]
    assert moved > 0.99  # the surface lies still: one moves with the other
    again = several.draws(40_000, seed=1)
    assert all(np.array_equal(draws[name], again[name]) for name in draws)
    assert not np.array_equal(draws["contact_depth"], several.draws(40_000, seed=2)["contact_depth"])


def test_draws_of_parameters_that_no_single_repeat_identifies():
    """A bare cone has no saturation depth: repeats bound it from below, and their mean is known no better."""
    fit = nf.identify([noisy(seed=k) for k in range(3)], model="cone_cylinder")
    draws = fit.draws(3000)
    assert np.isfinite([draws[name] for name in draws]).all()
    lowest = min(each.parameters["saturation_depth"].low for each in fit.recordings)
    assert 0.9 * lowest < draws["saturation_depth"].min() and draws["saturation_depth"].max() < 1.05 * 3.237e-3


def test_draws_have_the_reported_correlations(one):
    draws, told = one.draws(100_000), one.correlations
    found = np.corrcoef([draws[name] for name in told.names])
    # the posterior is not quite the Gaussian of the covariance, its contact and saturation being bent
    assert found == pytest.approx(told.matrix, abs=0.05)


def test_parameters_identified_only_together_are_reported():
    # a contact that saturates early is nearly a straight line, whose slope is the product 2 c h_s
    model = nf.preset("physical")
    steep = model.replace(stiffness=model.stiffness.replace(radius=0.2e-3))
    run = nf.simulate(steep, MOTION)
    run = dataclasses.replace(run, force=run.force + np.random.default_rng(0).normal(0.0, 3e-3, len(run)))
    fit = nf.identify(run, model="cone_cylinder")
    sentences = [sentence for sentence in fit.unknown if "identified only together" in sentence]
    assert any("stiffness_coefficient and saturation_depth" in s and "of their product" in s for s in sentences), (
        fit.unknown
    )
    matrix, names = fit.correlations.matrix, fit.correlations.names
    assert matrix[names.index("stiffness_coefficient"), names.index("saturation_depth")] < -0.95
    assert not any("identified only together" in sentence for sentence in nf.identify(noisy(), model="paper").unknown)


def test_scatter_and_own_errors_stand_apart():
    sd, own, n = 3.0, 0.5, 4000
    values = np.random.default_rng(0).normal(10.0, np.hypot(sd, own), n)
    half = TWO_SIDED * own
    pooled = pool([{"x": Estimate("x", v, "N", v - half, v + half)} for v in values])["x"]
    assert pooled.within_run_sd == pytest.approx(own)
    assert pooled.between_repeats_sd == pytest.approx(np.hypot(sd, own), rel=0.04)
    assert pooled.specimen_sd == pytest.approx(sd, rel=0.04)
    alone = pool([{"x": Estimate("x", 1.0, "N", 0.0, 2.0)}])["x"]
    assert alone.within_run_sd is None and alone.specimen_sd is None
    alike = pool([{"x": Estimate("x", v, "N", v - 2.0, v + 2.0)} for v in (1.0, 1.1)])["x"]
    assert alike.specimen_sd == 0.0


@pytest.mark.parametrize("name", ["contact_depth", "saturation_depth"])
def test_a_profile_crosses_384_at_the_interval(one, name):
    found = profile(one, name)
    assert found.difference.min() == 0.0 and (np.diff(found.values) > 0).all()
    below, above = (np.flatnonzero(found.difference <= 3.84)[[0, -1]],)[0]
    estimate = one.parameters[name]
    width = estimate.high - estimate.low
    assert found.values[below] == pytest.approx(estimate.low, abs=0.06 * width)
    assert found.values[above] == pytest.approx(estimate.high, abs=0.06 * width)


def test_a_profile_that_cannot_be_is_refused(one, several):
    with pytest.raises(nf.InputError, match="Give contact_depth or saturation_depth"):
        profile(one, "cutting_force")
    with pytest.raises(nf.InputError, match="was not fitted"):
        profile(several, "saturation_depth")


def test_the_table_of_estimates_is_complete(several, tmp_path):
    several.to_csv(tmp_path / "estimates.csv")
    with open(tmp_path / "estimates.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(several.parameters) + sum(len(each.parameters) for each in several.recordings)
    pooled = {row["quantity"]: row for row in rows if row["recording"] == "pooled"}
    for name, estimate in several.parameters.items():
        row = pooled[name]
        assert float(row["value"]) == estimate.value and row["unit"] == estimate.unit
        assert row["identifiable"] == str(estimate.identifiable).lower() and row["source"] == estimate.source
        assert float(row["within_run_sd"]) == estimate.within_run_sd
    own = [row for row in rows if row["recording"] != "pooled"]
    assert all(row["between_repeats_sd"] == row["within_run_sd"] == "" for row in own)
    assert json.loads(several.to_json())["correlations"]["names"][0] == "stiffness_coefficient"


def test_draws_are_written_by_the_files_ending(several, tmp_path):
    draws = several.draws(50)
    for name in ("draws.csv", "draws.json"):
        draws.save(tmp_path / name)
    with open(tmp_path / "draws.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["recording"] for row in rows].count("pooled") == 50 and len(rows) == 5 * 50
    assert [float(row["cutting_force"]) for row in rows[:50]] == draws["cutting_force"].tolist()
    document = json.loads((tmp_path / "draws.json").read_text())
    assert document["pooled"]["cutting_force"] == draws["cutting_force"].tolist()
    assert document["recordings"][3]["draws"]["contact_depth"] == draws.own["contact_depth"][3].tolist()
    with pytest.raises(nf.InputError, match=r"draws.txt.*must end in .csv or .json"):
        draws.save(tmp_path / "draws.txt")


def test_draws_that_cannot_be_are_refused(one):
    for count in (0, 2.5, 10**8):
        with pytest.raises(nf.InputError, match="number of draws"):
            one.draws(count)
    empty = dataclasses.replace(one, recordings=tuple(dataclasses.replace(r, cycle=None) for r in one.recordings))
    with pytest.raises(nf.InputError, match="no recording has a one-layer fit"):
        empty.draws()


def test_arviz_takes_the_draws(several):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # ArviZ announces its next version when it is loaded
        arviz = pytest.importorskip("arviz", reason="ArviZ is not installed: pip install 'needleforce[arviz]'")
        data = several.to_arviz(draws=1000)
        summary = arviz.summary(data, var_names=["cutting_force", "cutting_force_of_recording"])
    assert data["posterior"]["cutting_force"].shape == (4, 250)
    assert data["posterior"]["cutting_force_of_recording"].dims == ("chain", "draw", "recording")
    assert len(summary) == 5 and (summary["ess_bulk"].astype(float) > 600).all()  # independent draws


def test_noise_that_fades_keeps_its_long_run_variance():
    from scipy.signal import lfilter

    factor, n = 0.95, 20_000
    found = []
    for seed in range(20):
        white = np.random.default_rng(seed).standard_normal(n + 500)
        found.append(noise_of(lfilter([1.0], [1.0, -factor], white)[500:], n))
    assert np.mean([noise.long_run for noise in found]) == pytest.approx(1.0 / (1.0 - factor) ** 2, rel=0.05)
    assert np.median([noise.ar1_factor for noise in found]) == pytest.approx(factor, abs=0.005)


def test_the_noise_is_described_in_words():
    white, filtered = Noise(1.0, 1000, 1.0, 1.0, 0), Noise(1.0, 1000, 1.0, 9.0, 9)
    assert noise_words([white, white]) == "white"
    text = noise_words(
        [white, filtered, filtered._replace(last_lag=12), filtered._replace(last_lag=30, ar1_factor=0.9)]
    )
    assert text == (
        "white; correlated over 9 to 12 samples: flat-top long-run variance; "
        "autocorrelated (AR(1)) over 30 samples: long-run variance of a first-order autoregression"
    )
    assert "too few independent parts" in noise_words([filtered._replace(last_lag=124)])
    assert nf.identify(noisy(), model="paper").settings.noise == "white"
