# SPDX-License-Identifier: Apache-2.0
"""The LuGre filters against the law itself, against the information form, and along insertions of a known friction."""

import json
from typing import NamedTuple

import numpy as np
import pytest
from scipy.stats import chi2

import needleforce as nf
from needleforce.errors import InputError
from needleforce.identification import LuGreFilter, filter_lugre
from needleforce.identification.lugre_filter import joseph, limit, measured, predicted

NAMES = ["bristle_stiffness", "bristle_damping", "viscous", "coulomb", "static_friction", "stribeck_speed"]
TRUTH = (2e5, 300.0, 500.0, 18.0, 25.0, 1e-3)
RATE, NOISE = 1000.0, 10e-3  # [Hz], [N]: 2 % of the friction on 30 mm
MOTIONS = [(-2e-3, 1e-3), (-1e-4, 0.02), (3e-4, 5e-4), (1e-3, 1e-3), (8e-3, 1e-2)]


class Update(NamedTuple):
    """State (4,) and its covariance (4, 4) after a sample; the sample's innovation [N/m] and its variance."""

    state: np.ndarray
    covariance: np.ndarray
    innovation: float
    variance: float


def updated_state(state, covariance, velocity, traction, dt, limits, process, noise):
    """One complete step of filter 1 in linear parameters, with known limits (3,): prediction, then Joseph's update.

    ``covariance`` (4, 4) is that of ``state`` before the step, ``process`` (4, 4) the process noise, ``traction`` [N/m]
    the measured force over embedded length and ``noise`` its variance. The parameters are not constrained to be
    positive.
    """
    g = limit(velocity, limits, 2.0).value
    ahead, jacobian, _ = predicted(np.asarray(state, float), velocity, dt, g)
    expected, slopes, _ = measured(ahead, velocity, g)
    before = jacobian @ np.asarray(covariance, float) @ jacobian.T + np.asarray(process, float)
    gain, after, variance = joseph(before, slopes, noise)
    innovation = traction - expected
    return Update(ahead + gain * innovation, after, innovation, variance)


def law(values=TRUTH, exponent=2.0):
    return nf.laws.Lugre(*map(float, values), exponent)


def slope(function, values, index, step=1e-5):
    """Central difference by one of the values."""
    there, back = np.array(values, float), np.array(values, float)
    there[index] *= 1.0 + step
    back[index] *= 1.0 - step
    return (function(there) - function(back)) / (there[index] - back[index])


@pytest.mark.parametrize("exponent", [1.0, 2.0])
@pytest.mark.parametrize(("velocity", "dt"), MOTIONS)
def test_jacobians_are_those_of_the_law(velocity, dt, exponent):
    """All from the public law: values are (zeta, sigma_0, sigma_1, sigma_2, F_c, F_s, v_s)."""
    values = np.array([4e-5, *TRUTH])
    g = limit(velocity, values[4:], exponent)
    after, by_state, by_limit = predicted(values[:4], velocity, dt, g.value)
    traction, by_predicted, frozen = measured(values[:4], velocity, g.value)

    def deflected(x):
        return law(x[1:], exponent).deflected(x[0], velocity, dt)

    def pulled(x):
        return law(x[1:], exponent).traction(x[0], velocity)

    assert after[0] == pytest.approx(deflected(values), rel=1e-12)
    assert traction == pytest.approx(pulled(values), rel=1e-12)
    by_values = np.concatenate([by_state[0], by_limit * g.slopes])
    steep = np.concatenate([by_predicted, frozen * g.slopes])
    for i in range(7):
        scale = 1e-7 / values[i]  # a difference resolves no less
        assert by_values[i] == pytest.approx(slope(deflected, values, i), rel=1e-6, abs=scale * values[0])
        assert steep[i] == pytest.approx(slope(pulled, values, i), rel=1e-6, abs=scale * traction)
    assert (by_state[1:] == np.eye(4)[1:]).all()


def test_one_prediction_has_the_reference_value(root):
    entries = json.loads((root / "tests" / "reference_values.json").read_text(encoding="utf-8"))["oracles"]
    entry = next(each for each in entries if each["name"] == "ekf_predicted_force")
    given, limits = entry["inputs"], [entry["inputs"][key] for key in ("Fc", "Fs", "vs")]
    plain = np.eye(4), given["v"], 0.0, given["dt"], limits, np.zeros((4, 4)), 1.0
    assert -updated_state(given["x"], *plain).innovation == pytest.approx(entry["expected"], rel=entry["rel_tol"])


def test_one_step_is_the_information_form():
    """P+ = (P-^-1 + H'H / R)^-1 and x+ = x- + P+ H' (y - h) / R, in units in which no number is small."""
    state, scale, limits = np.array([4e-5, 2e5, 300.0, 500.0]), np.array([1e-5, 5e4, 90.0, 100.0]), TRUTH[3:]
    random, velocity, dt, traction, noise = np.random.default_rng(4), 2e-3, 4e-3, 14.0, 0.3
    covariance, process = ((m @ m.T + np.eye(4)) * np.outer(scale, scale) for m in random.standard_normal((2, 4, 4)))

    def deflected(x):
        return law([*x[1:], *limits]).deflected(x[0], velocity, dt)

    def pulled(x):
        return law([*x[1:], *limits]).traction(x[0], velocity)

    ahead, jacobian = np.array([deflected(state), *state[1:]]), np.eye(4)
    jacobian[0] = [slope(deflected, state, i) for i in range(4)]
    slopes = np.array([slope(pulled, ahead, i) for i in range(4)]) * scale
    before = (jacobian @ covariance @ jacobian.T + process) / np.outer(scale, scale)
    after = np.linalg.inv(np.linalg.inv(before) + np.outer(slopes, slopes) / noise)
    found = updated_state(state, covariance, velocity, traction, dt, limits, process, noise)
    assert found.covariance / np.outer(scale, scale) == pytest.approx(after, rel=1e-5)
    moved = after @ slopes * (traction - pulled(ahead)) / noise
    assert (found.state - ahead) / scale == pytest.approx(moved, rel=1e-5)
    assert found.variance == pytest.approx(slopes @ before @ slopes + noise, rel=1e-6)


def least_eigenvalue(covariance):
    """The least, and the largest difference from symmetry, with every variance scaled to 1."""
    sd = np.sqrt(np.diagonal(covariance))
    unit = covariance / np.outer(sd, sd)
    return np.linalg.eigvalsh(unit)[0], np.abs(unit - unit.T).max()


def test_covariance_stays_symmetric_and_positive():
    """With almost no noise, where (I - K H) P, the same in exact numbers, is off symmetry by 2e-6 of its variances."""
    random, covariance, information = np.random.default_rng(2), np.eye(7), np.eye(7)
    for slopes in random.standard_normal((300, 7)):
        _, covariance, _ = joseph(covariance, slopes, 1e-10)
        information += np.outer(slopes, slopes) / 1e-10
        least, skew = least_eigenvalue(covariance)
        assert least > 0.0 and skew < 1e-15
    assert covariance == pytest.approx(np.linalg.inv(information), rel=1e-3, abs=1e-6 * covariance.max())


def test_covariance_of_the_filter_stays_so_along_a_motion():
    found = LuGreFilter(law(), 0.3)
    for velocity in np.random.default_rng(5).uniform(-8e-3, 8e-3, 3000):
        found.step(velocity, 18.0 * np.sign(velocity), 1e-3, noise=1e-3)
        least, skew = least_eigenvalue(found.covariance)
        assert least > -1e-9 and skew < 1e-12


def insertion(velocity, seed=0, noise=NOISE, settle=0):
    """Time, velocity, force and embedded length in a hole that is cut, from 30 mm on, without the first samples."""
    model = nf.Model(nf.laws.Cone(1e5, 0.3), nf.laws.PunctureDepth(0.0), law(), nf.laws.ConstantCutting(0.0))
    depth = 30e-3 + np.cumsum(velocity) / RATE
    force = nf.Insertion(model).run(depth, velocity, np.full(len(velocity), 1.0 / RATE))["force"]
    force = force + noise * np.random.default_rng(seed).standard_normal(len(velocity))
    return [column[settle:] for column in (np.arange(len(velocity)) / RATE, velocity, force, depth)]


def excitation(seconds=8.0):
    """Reversals, and speeds from creep to six times the Stribeck speed."""
    t = 2.0 * np.pi * np.arange(int(seconds * RATE)) / RATE
    return 4e-3 * np.sin(0.5 * t) + 2e-3 * np.sin(1.7 * t) * np.sin(0.13 * t) + 0.7e-3 * np.sin(4.3 * t)


def wrong(seed, spread=0.3):
    """A start that is off by the spread, F_s - F_c taken for itself."""
    factor = np.exp(spread * np.random.default_rng(100 + seed).standard_normal(6))
    stiffness, damping, viscous, coulomb, static, speed = TRUTH
    off = np.array([stiffness, damping, viscous, coulomb, static - coulomb, speed]) * factor
    return law([*off[:4], off[3] + off[4], off[5]])


def portmanteau(innovation, lags=20):
    """Ljung and Box's statistic, chi squared with ``lags`` degrees of freedom for white noise."""
    n, x = len(innovation), innovation - innovation.mean()
    lag = np.arange(1, lags + 1)
    correlation = np.array([x[j:] @ x[:-j] for j in lag]) / (x @ x)
    return n * (n + 2) * float(np.sum(correlation**2 / (n - lag)))


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.long) for seed in (1, 2, 3))])
def test_parameters_come_back_and_innovations_are_white(seed):
    columns, learned = insertion(excitation(), seed), int(2.0 * RATE)
    found = filter_lugre(*columns, wrong(seed), NOISE, spread=0.3)
    errors = np.log([getattr(found.law, name) for name in NAMES]) - np.log(TRUTH)
    assert (np.abs(errors) < 3.0 * found.relative_sd[-1]).all(), errors / found.relative_sd[-1]
    assert (found.relative_sd[-1] < 0.1).all()  # and not for want of a claim
    assert found.identifiable == 6 and all(each.identifiable for each in found.parameters.values())
    unit = (found.innovation / np.sqrt(found.variance))[learned:]
    bound = chi2.ppf(0.999, 20)
    assert portmanteau(unit) < bound
    assert np.mean(unit**2) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / len(unit)))
    held = LuGreFilter(wrong(seed), NOISE, held=True)
    _, velocity, force, embedded = columns
    stuck = [held.step(v, f / e, 1.0 / RATE, NOISE / e).innovation for v, f, e in zip(velocity, force, embedded)]
    assert portmanteau(np.array(stuck)[learned:]) > 10.0 * bound  # the same test sees parameters that are wrong


@pytest.mark.parametrize("off", [1.0, 1.3])
@pytest.mark.parametrize("velocity", [1e-3, -3e-3])
def test_a_constant_velocity_identifies_only_the_sliding_friction(velocity, off):
    """The sliding friction has one slope by the logarithms: of the six directions, the other five stay as they were."""
    columns = insertion(np.full(4000, velocity), settle=1000)
    start, spread = law(np.array(TRUTH) * off), 0.5
    found = filter_lugre(*columns, start, NOISE, spread=spread)

    def sliding(x):
        return law([*x[:4], x[3] + x[4], x[5]]).sliding(1.0, velocity)

    values = np.array([getattr(found.law, name) for name in NAMES])
    values[4] -= values[3]
    along = np.array([slope(sliding, values, i) for i in range(6)]) * values
    along /= np.linalg.norm(along)
    left = found.covariance[1:, 1:] / spread**2
    others = np.linalg.svd(np.eye(6) - np.outer(along, along))[0][:, :5]
    assert np.linalg.eigvalsh(others.T @ left @ others)[0] > 0.9
    assert along @ left @ along < 0.05
    assert found.identifiable == 1 and not any(each.identifiable for each in found.parameters.values())
    assert found.law.sliding(1.0, velocity) == pytest.approx(law().sliding(1.0, velocity), rel=2e-3)


def test_a_held_filter_follows_the_deflection_of_known_parameters():
    """As one plain filter does whose parameters have no variance."""
    held, state = LuGreFilter(law(), NOISE, held=True), np.array([0.0, *TRUTH[:3]])
    covariance = np.diag([(TRUTH[4] / TRUTH[0]) ** 2, 0.0, 0.0, 0.0])
    _, velocity, force, embedded = insertion(excitation(0.3))
    for v, f, e in zip(velocity, force, embedded):
        held.step(v, f / e, 1.0 / RATE, NOISE / e)
        plain = updated_state(state, covariance, v, f / e, 1.0 / RATE, TRUTH[3:], np.zeros((4, 4)), (NOISE / e) ** 2)
        state, covariance = plain.state, plain.covariance
        assert held.state == pytest.approx(state, rel=1e-9)
    assert tuple(held.state[1:]) == TRUTH[:3] and tuple(held.limits) == TRUTH[3:]


def test_invalid_samples_are_skipped_and_counted():
    time, velocity, force, embedded = insertion(excitation(1.0))
    velocity, force, embedded = velocity.copy(), force.copy(), embedded.copy()
    velocity[100], force[200:210], embedded[300:305], embedded[400] = np.nan, np.inf, 0.0, np.nan
    found = filter_lugre(time, velocity, force, embedded, law(), NOISE)
    assert found.skipped == 1 + 10 + 5 + 1 == np.isnan(found.innovation).sum()
    assert np.isfinite(found.values).all() and np.isfinite(found.relative_sd).all()
    assert found.variance[101] > 100.0 * found.variance[99]  # unknown deflection after a missing motion
    assert found.variance[305] < 2.0 * found.variance[299]  # with a known motion, only the force is missing


def test_a_parameter_that_starts_at_zero_is_held_there():
    dahl = nf.laws.Lugre(2e5, 0.0, 0.0, 18.0, 18.0)
    found = filter_lugre(*insertion(excitation(2.0)), dahl, NOISE)
    assert found.law.bristle_damping == found.law.viscous == 0.0
    assert found.law.static_friction == found.law.coulomb != 18.0
    assert not found.parameters["viscous"].identifiable and found.identifiable == 2  # sigma_0 and F_c


@pytest.mark.parametrize(
    ("change", "options", "message"),
    [
        (lambda c: [c[0], c[1][1:], c[2], c[3]], {}, "shape of velocity"),
        (lambda c: [x.reshape(-1, 2) for x in c], {}, "shape of time"),
        (lambda c: [x[:1] for x in c], {}, "shape of time"),
        (lambda c: [c[0][::-1], *c[1:]], {}, "time is .* goes back"),
        (lambda c: [*c[:3], 0.0 * c[3]], {}, "samples is 0"),
        (lambda c: c, {"spread": 0.0}, "spread is 0"),
        (lambda c: c, {"parameter_walk": -1.0}, "parameter_walk is -1"),
        (lambda c: c, {"bristle_walk": np.nan}, "bristle_walk is nan"),
    ],
)
def test_invalid_input_raises_an_error_with_its_reason(change, options, message):
    with pytest.raises(InputError, match=message):
        filter_lugre(*change(insertion(excitation(0.1))), law(), NOISE, **options)


def test_a_force_without_noise_is_refused():
    with pytest.raises(InputError, match="noise is 0"):
        filter_lugre(*insertion(excitation(0.1)), law(), 0.0)
