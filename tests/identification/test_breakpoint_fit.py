# SPDX-License-Identifier: Apache-2.0
"""The complete fit of one cycle against its own truth, against brute force and against scipy."""

import numpy as np
import pytest
from scipy.optimize import curve_fit, minimize_scalar

from needleforce.errors import InputError
from needleforce.identification.one_layer.cycle_fit import fit_cycle, limit_saturation
from needleforce.identification.one_layer.cycle_values import CycleOptions

TRUTH = {
    "stiffness_coefficient": 20051.0,
    "contact_depth": 4.1e-3,
    "friction_per_length": 18.6,
    "cutting_force": 0.0776,
    "puncture_depth": 4.1e-3 + 3.237e-3,
}


def cycle(noise=0.0, samples=3000, saturation=np.inf, seed=1, **changed):
    """Depth and force of both strokes with known parameters."""
    t = TRUTH | changed
    random, depth = np.random.default_rng(seed), np.linspace(0.0, 20e-3, samples)
    h = np.maximum(depth - t["contact_depth"], 0.0)
    g = np.where(h < saturation, h**2, saturation * (2.0 * h - min(saturation, 1.0)))
    line = t["friction_per_length"] * h
    force = np.where(depth <= t["puncture_depth"], t["stiffness_coefficient"] * g, line + t["cutting_force"])
    out = -line[::-1]
    return (
        depth,
        force + noise * random.standard_normal(samples),
        depth[::-1],
        out + noise * random.standard_normal(samples),
    )


@pytest.mark.parametrize(
    ("saturation", "options"),
    [
        (np.inf, {"law": "cone"}),
        (2.0518e-3, {"law": "cone_cylinder", "saturation_depth": 2.0518e-3}),
        (2.0518e-3, {"law": "cone_cylinder"}),
    ],
)
def test_without_noise_the_truth_comes_back(saturation, options):
    arrays = cycle(saturation=saturation)
    fit = fit_cycle(*arrays, CycleOptions(**options))
    for name in ("stiffness_coefficient", "contact_depth", "friction_per_length", "cutting_force"):
        assert fit.values[name] == pytest.approx(TRUTH[name], rel=1e-6), name
    assert fit.values["saturation_depth"] == pytest.approx(saturation, rel=1e-6)
    assert fit.puncture.before == np.sum(arrays[0] <= TRUTH["puncture_depth"])
    assert (fit.puncture.low, fit.puncture.high) == (fit.puncture.before - 1, fit.puncture.before)
    assert fit.residuals.rmse < 1e-9 and not fit.warnings


def test_depth_and_force_may_be_shifted_and_scaled():
    depth_in, force_in, depth_out, force_out = cycle(noise=5e-3)
    plain = fit_cycle(depth_in, force_in, depth_out, force_out)
    moved = fit_cycle(depth_in - 7e-3, 3.0 * force_in + 0.5, depth_out - 7e-3, 3.0 * force_out + 0.5)
    for name, scale, shift in (
        ("stiffness_coefficient", 3.0, 0.0),
        ("friction_per_length", 3.0, 0.0),
        ("cutting_force", 3.0, 0.0),
        ("puncture_force", 3.0, 0.0),
        ("force_offset", 3.0, 0.5),
        ("contact_depth", 1.0, -7e-3),
        ("puncture_depth", 1.0, -7e-3),
    ):
        for got, was in ((moved.values, plain.values), (moved.low, plain.low), (moved.high, plain.high)):
            assert got[name] == pytest.approx(scale * was[name] + shift, rel=1e-5), name


def squares(arrays, z0, row):
    """Least sum of squares for one contact depth and one puncture, by numpy's least squares on the whole design."""
    depth_in, force_in, depth_out, force_out = arrays
    h_in, h_out = np.maximum(depth_in - z0, 0.0), np.maximum(depth_out - z0, 0.0)
    before = np.arange(len(depth_in)) < row
    design = np.ones((len(depth_in) + len(depth_out), 4))  # the last column is the sensor's zero
    design[:, :3] = 0.0
    design[: len(before), 0] = np.where(before, h_in**2, 0.0) * 1e3
    design[: len(before), 1] = np.where(before, 0.0, depth_in - z0)
    design[: len(before), 2] = np.where(before, 0.0, 1.0)
    design[len(before) :, 1] = -h_out
    force = np.concatenate([force_in, force_out])
    residual = force - design @ np.linalg.lstsq(design, force, rcond=None)[0]
    return float(residual @ residual)


@pytest.mark.parametrize("seed", range(3))
def test_no_other_contact_and_puncture_fits_better(seed):
    arrays = cycle(noise=20e-3, samples=120, seed=seed)
    fit = fit_cycle(*arrays)

    def least(row):
        start, end = arrays[0][0], arrays[0][row - 9]
        grid = min(np.linspace(start, end, 25), key=lambda z0: squares(arrays, z0, row))
        step = (end - start) / 24
        bounds = (grid - step, grid + step)
        return minimize_scalar(lambda z0: squares(arrays, z0, row), bounds=bounds, method="bounded").fun

    rows = range(16, 120 - 8)
    best = min(least(row) for row in rows)
    assert fit.residuals.sse == pytest.approx(best, rel=1e-6)


def test_covariance_is_that_of_scipy_with_the_puncture_known():
    arrays = cycle(noise=5e-3)
    fit = fit_cycle(*arrays)
    n, row = len(arrays[0]), fit.puncture.before

    def model(depth, c, z0, slope, cutting, zero):
        h = np.maximum(depth - z0, 0.0)
        return zero + np.concatenate([c * h[:row] ** 2, slope * (depth[row:n] - z0) + cutting, -slope * h[n:]])

    start = [fit.values[name] for name in fit.order]
    found, covariance = curve_fit(model, np.concatenate(arrays[0::2]), np.concatenate(arrays[1::2]), start)
    assert np.abs(found - start) / np.sqrt(covariance.diagonal()) == pytest.approx(0.0, abs=1e-3)
    scale = np.sqrt(np.outer(covariance.diagonal(), covariance.diagonal()))
    assert fit.covariance / scale == pytest.approx(covariance / scale, abs=0.05)  # noise by stroke, not pooled
    assert all(noise.long_run == noise.variance for noise in fit.residuals.noises)


def test_prediction_and_residual_make_the_measurement():
    arrays = cycle(noise=5e-3, saturation=2.05e-3)
    fit = fit_cycle(*arrays, CycleOptions(law="cone_cylinder"))
    v, h = fit.values, arrays[0] - fit.values["contact_depth"]
    cone = np.clip(h, 0.0, v["saturation_depth"])
    pushed = v["stiffness_coefficient"] * cone * (2.0 * np.maximum(h, 0.0) - cone)
    force_in = np.where(arrays[0] > v["puncture_depth"], v["friction_per_length"] * h + v["cutting_force"], pushed)
    force_out = -v["friction_per_length"] * np.maximum(arrays[2] - v["contact_depth"], 0.0)
    assert v["force_offset"] + force_in + fit.residuals.insertion == pytest.approx(arrays[1], abs=1e-12)
    assert v["force_offset"] + force_out + fit.residuals.withdrawal == pytest.approx(arrays[3], abs=1e-12)
    assert fit.residuals.sse == pytest.approx(np.sum(fit.residuals.insertion**2) + np.sum(fit.residuals.withdrawal**2))


def test_a_window_limits_the_puncture_and_its_edge_gives_a_warning():
    depth, force, *out = cycle(noise=2e-3)
    force = force + np.where(depth > 12e-3, -0.15, 0.0)  # a deeper and larger drop, which a one-layer model omits
    assert fit_cycle(depth, force, *out).values["puncture_depth"] == pytest.approx(12e-3, abs=0.05e-3)
    bound = fit_cycle(depth, force, *out, CycleOptions(puncture_window=(7e-3, 7.6e-3)))
    assert 7e-3 <= bound.values["puncture_depth"] <= 7.6e-3
    assert any("at an end of the range" in warning for warning in bound.warnings)
    first = depth < 12e-3  # below the next puncture is another layer
    alone = fit_cycle(depth[first], force[first], *out, CycleOptions(puncture_window=(7e-3, 7.6e-3)))
    assert alone.values["puncture_depth"] == pytest.approx(TRUTH["puncture_depth"], abs=0.05e-3)
    assert not alone.warnings


def test_an_encoder_that_jitters_does_no_harm():
    depth_in, force_in, depth_out, force_out = cycle(noise=5e-3)
    random = np.random.default_rng(3)
    jitter = 10e-6 * random.standard_normal((2, len(depth_in)))  # 1.5 samples of travel
    fit = fit_cycle(depth_in + jitter[0], force_in, depth_out + jitter[1], force_out)
    assert fit.puncture.before == np.sum(depth_in <= TRUTH["puncture_depth"])
    assert fit.values["contact_depth"] == pytest.approx(TRUTH["contact_depth"], abs=30e-6)
    assert fit.values["friction_per_length"] == pytest.approx(TRUTH["friction_per_length"], rel=0.01)


def test_a_cycle_cut_off_before_the_withdrawal():
    depth, force, *_ = cycle(noise=5e-3)
    fit = fit_cycle(depth, force, None, None)
    assert fit.values["friction_per_length"] == pytest.approx(TRUTH["friction_per_length"], rel=0.05)
    assert fit.low["cutting_force"] < TRUTH["cutting_force"] < fit.high["cutting_force"]
    assert any("no withdrawal" in warning for warning in fit.warnings)


@pytest.mark.parametrize("kept", [0, 1, 20, 60, 200])
def test_a_withdrawal_may_be_shorter_than_the_filter(kept):
    depth, force, depth_out, force_out = cycle(noise=5e-3)
    fit = fit_cycle(depth, force, depth_out[:kept], force_out[:kept], CycleOptions(filter_length=50))
    assert fit.values["contact_depth"] == pytest.approx(TRUTH["contact_depth"], abs=0.1e-3)
    assert len(fit.residuals.withdrawal) == kept and np.isfinite(fit.covariance).all()


def test_unphysical_friction_is_held_with_a_warning():
    arrays = cycle(noise=5e-3, friction_per_length=-3.0)
    fit = fit_cycle(*arrays)
    assert fit.values["friction_per_length"] == fit.low["friction_per_length"] == 0.0 < fit.high["friction_per_length"]
    assert any("held at 0" in warning and "unphysical" in warning for warning in fit.warnings)


def test_a_bare_cone_bounds_its_saturation_from_below_only():
    fit = fit_cycle(*cycle(noise=5e-3, seed=4), CycleOptions(law="cone_cylinder"))
    assert fit.high["saturation_depth"] == np.inf
    assert 1.5e-3 < fit.low["saturation_depth"] < 3.3e-3


def test_the_lower_limit_of_a_saturation_may_be_left_for_later():
    left = 0
    for seed in range(8):
        arrays = cycle(noise=5e-3, seed=seed)
        fit = fit_cycle(*arrays, CycleOptions(law="cone_cylinder"), limited=False)
        left += fit.low["saturation_depth"] == np.inf
        at_once = fit_cycle(*arrays, CycleOptions(law="cone_cylinder"))
        later = limit_saturation(fit, *arrays)
        assert later.low == limit_saturation(later, *arrays).low == at_once.low
        assert 1e-3 < later.low["saturation_depth"] < 3.3e-3
    assert left > 0


def test_a_filter_smears_both_steps_and_leaving_them_out_removes_the_bias():
    length = 25
    depth_in, force_in, depth_out, force_out = cycle()
    depth, force = np.concatenate([depth_in, depth_out]), np.concatenate([force_in, force_out])
    depth, force = (np.convolve(values, np.full(length, 1 / length), "valid") for values in (depth, force))
    turn = int(np.argmax(depth))
    arrays = depth[:turn], force[:turn], depth[turn:], force[turn:]
    careful, careless = fit_cycle(*arrays, CycleOptions(filter_length=length)), fit_cycle(*arrays)
    for name in ("stiffness_coefficient", "friction_per_length", "cutting_force"):
        error = abs(careful.values[name] / TRUTH[name] - 1.0)
        assert error < 2e-3 and error < 0.2 * abs(careless.values[name] / TRUTH[name] - 1.0), name
    assert careful.low["puncture_depth"] <= TRUTH["puncture_depth"] <= careful.high["puncture_depth"]


def test_pure_noise_and_zero_force_give_a_warning():
    depth, _, out, _ = cycle()
    noise = 5e-3 * np.random.default_rng(0).standard_normal((2, len(depth)))
    for force_in, force_out in (noise, np.zeros_like(noise)):
        for law in ("cone", "cone_cylinder"):
            fit = fit_cycle(depth, force_in, out, force_out, CycleOptions(law=law))
            assert any("may be no" in warning for warning in fit.warnings), fit.warnings


@pytest.mark.parametrize(
    ("change", "options", "message"),
    [
        (lambda a: (a[0][:20], a[1][:20], a[2], a[3]), {}, "number of samples is 20"),
        (lambda a: (a[0], a[1][1:], a[2], a[3]), {}, "shape of depth and force"),
        (lambda a: (a[0], np.where(np.arange(3000) == 7, np.nan, a[1]), a[2], a[3]), {}, "sample 7: force of the ins"),
        (lambda a: (a[0], a[1], a[2], np.where(np.arange(3000) == 9, np.inf, a[3])), {}, "sample 9: force of the with"),
        (lambda a: (0 * a[0], a[1], a[2], a[3]), {}, "depth of the insertion"),
        (lambda a: (-a[0], a[1], -a[2], a[3]), {}, "flip its sign"),
        (lambda a: a, {"law": "sphere"}, "law is 'sphere'"),
        (lambda a: a, {"saturation_depth": 1e-3}, "the law cone has none"),
        (lambda a: a, {"law": "cone_cylinder", "saturation_depth": -1e-3}, "must be positive"),
        (lambda a: a, {"filter_length": 0}, "filter_length is 0"),
        (lambda a: a, {"filter_length": 500}, "filter_length is 500"),
        (lambda a: a, {"puncture_window": (9e-3, 6e-3)}, "lower limit must be below"),
        (lambda a: a, {"puncture_window": (30e-3, 40e-3)}, "possible punctures is 0"),
    ],
)
def test_invalid_input_raises_an_error_with_its_reason(change, options, message):
    with pytest.raises(InputError, match=message):
        fit_cycle(*change(cycle()), CycleOptions(**options))
