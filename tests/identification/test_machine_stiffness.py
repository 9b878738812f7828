# SPDX-License-Identifier: Apache-2.0
"""A machine in series with the needle is found where it alone explains a recording, or taken as given."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from command_line import run

import needleforce as nf
from needleforce.identification.one_layer.machine_stiffness import _best

SPEED, RATE, NOISE, PUNCTURE, DEEP = 3e-3, 500.0, 4e-3, 3.237e-3, 14e-3
TRUE = {
    "contact_depth": 0.0,
    "puncture_depth": PUNCTURE,
    "puncture_force": 4.202,
    "friction_per_length": 372.0,
    "cutting_force": 1.552,
    "stiffness_coefficient": 4.202 / PUNCTURE**2,
}


def recorded(stiffness=np.inf, *, seed=0, power=2.0, outwards=1.0, grip=0.0, stretch=0.1e-3, noise=NOISE):
    """Own insertion with its depth at the stage: the tip is behind it by the force over the stiffness [N/m] of the
    machine, and jumps at the puncture. The fall takes no time."""
    tip = [np.linspace(0.0, PUNCTURE, 4000), np.linspace(PUNCTURE, DEEP, 8000), np.linspace(DEEP, 0.0, 12000)]
    slid = np.minimum((DEEP - tip[2]) / stretch, 1.0)
    force = [TRUE["puncture_force"] * (tip[0] / PUNCTURE) ** power, 372.0 * tip[1] + 1.552]
    force.append(372.0 * tip[2] * (1.0 - (1.0 + outwards) * slid) + 1.552 * (1.0 - slid) - grip * slid)
    stage = [depth + each / stiffness for depth, each in zip(tip, force)]
    jump, deepest, step = stage[0][-1], stage[1][-1], SPEED / RATE
    legs = [np.arange(-4e-3, deepest, step), np.full(300, deepest), np.arange(deepest, -4e-3, -step)]
    loaded = np.interp(legs[0], stage[0], force[0])
    inwards = np.where(legs[0] <= jump, loaded, np.interp(legs[0], stage[1], force[1]))
    back = np.interp(-legs[2], -stage[2], force[2], right=0.0)
    clean = np.concatenate([inwards, np.full(300, force[1][-1]), back])
    noise = np.random.default_rng(seed).normal(0.0, noise, len(clean))
    return nf.Recording(time=np.arange(len(clean)) / RATE, depth=np.concatenate(legs), force=clean + noise)


def held(fit):
    return {name: fit.parameters[name].low <= value <= fit.parameters[name].high for name, value in TRUE.items()}


@pytest.mark.parametrize("stiffness", [50e3, 20e3, 5e3])
def test_a_machine_is_found_and_its_parameters_are_those_at_the_tip(stiffness):
    fit = nf.identify(recorded(stiffness))
    found = fit.parameters.machine_stiffness
    assert found.low <= stiffness <= found.high and found.high < 1.1 * found.low
    assert all(held(fit).values()), held(fit)
    assert fit.parameters.cutting_force.high - fit.parameters.cutting_force.low < 0.02 * TRUE["cutting_force"]
    assert fit.warnings[0].startswith("A machine (sensor, holder, drive) of") and "machine_stiffness" in fit.warnings[0]
    again = recorded(stiffness, seed=1)
    assert np.sqrt(np.mean((fit.predict(again) - again.force) ** 2)) < 0.01 * again.force.max()


@pytest.mark.parametrize("stretch", [0.3e-3, 0.6e-3])
def test_a_long_reversal_of_friction_does_not_hide_the_machine(stretch):
    fit = nf.identify(recorded(20e3, stretch=stretch))
    assert fit.parameters.machine_stiffness.low <= 20e3 <= fit.parameters.machine_stiffness.high
    assert all(held(fit).values()), held(fit)


@pytest.mark.parametrize(("least", "found"), [(0.8, 0.8), (1.2, 0.0)])
def test_what_is_least_beyond_the_reversal_is_no_machine(least, found):
    """Another law of the contact than a cone may be fitted so: 4 of 105 power laws of another generator were."""

    def left(compliance):
        return SimpleNamespace(sse=1.0 + (compliance - least) ** 2, noises=[SimpleNamespace(long_run=1e-4)])

    profile = SimpleNamespace(residuals=left, squares=lambda compliance: left(compliance).sse)
    assert _best(profile, 1.0)[0] == pytest.approx(found, abs=1e-6)


def test_a_machine_that_noise_may_hide_is_in_the_intervals(many):
    fits = [nf.identify(recorded(100e3, seed=seed, noise=20e-3)) for seed in range(many(3, 20))]
    for fit in fits:
        assert all(held(fit)[name] for name in ("friction_per_length", "cutting_force", "contact_depth"))
    assert any("With a machine" in sentence for fit in fits for sentence in fit.warnings)


def test_repeats_share_the_machine():
    fit = nf.identify([recorded(20e3, seed=seed) for seed in range(3)])
    assert fit.parameters.machine_stiffness.low <= 20e3 <= fit.parameters.machine_stiffness.high
    assert fit.parameters.cutting_force.low <= 1.552 <= fit.parameters.cutting_force.high


@pytest.mark.parametrize(
    "other", [{}, {"power": 1.8}, {"power": 2.3}, {"outwards": 0.7}, {"grip": 0.2}, {"stretch": 1e-3}], ids=str
)
def test_no_other_error_is_taken_for_a_machine(other):
    fits = [nf.identify(recorded(seed=seed, **other)) for seed in range(3)]
    assert not any("machine_stiffness" in fit.parameters for fit in fits)


def test_a_known_machine_is_held():
    fit = nf.identify(recorded(20e3), machine_stiffness=20e3, model="paper")
    assert all(held(fit).values()), held(fit)
    assert fit.parameters.machine_stiffness.value == 20e3 and "as given" in fit.held_fixed[0]


def test_a_comparison_takes_a_known_machine():
    (row,) = nf.compare([recorded(20e3, seed=seed) for seed in range(2)], ["paper"], machine_stiffness=20e3)
    assert row.residual == pytest.approx(NOISE / TRUE["puncture_force"], rel=0.1)  # of the loading curve


@pytest.mark.parametrize(
    "stiffness, words", [(0.0, "must be above 0"), (np.nan, "must be above 0"), (1e3, r"exceed 2\.[0-2]\d? N/mm")]
)
def test_an_impossible_machine_is_refused(stiffness, words):
    """At the puncture this cone behind 20 N/mm has a slope of 2.30 N/mm, over all of its travel 1.22 N/mm."""
    with pytest.raises(nf.InputError, match=words) as refused:
        nf.identify(recorded(20e3), machine_stiffness=stiffness)
    assert "leave it out" in str(refused.value)


def test_the_command_takes_it_in_newtons_per_millimetre(tmp_path):
    recording = recorded(20e3)
    table = np.column_stack([recording.time, 1e3 * recording.depth, recording.force])
    np.savetxt(tmp_path / "run.csv", table, delimiter=",", header="time_s,depth_mm,force_N", comments="")
    done = run("identify", tmp_path / "run.csv", "--machine-stiffness-N-mm", "20", "--json", tmp_path / "out.json")
    assert done.returncode == 0, done.stderr
    found = {each["name"]: each["value"] for each in json.loads((tmp_path / "out.json").read_text())["parameters"]}
    assert found["machine_stiffness"] == 20e3 and found["cutting_force"] == pytest.approx(1.552, abs=0.01)
