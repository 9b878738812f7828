# SPDX-License-Identifier: Apache-2.0
"""Contacts that rupture gradually: own simulations with a smooth step, and the stalks of another laboratory."""

import functools
import re

import numpy as np
import pytest

import needleforce as nf

CONTACT, ONSET, PEAK, FRICTION, CUTTING = 3e-3, 4e-3, 1.0, 30.0, 0.15  # SI
STEP = 20e-6  # [m] over which friction reverses and the cut unloads
TRUTH = {
    "contact_depth": CONTACT,
    "stiffness_coefficient": PEAK / ONSET**2,
    "friction_per_length": FRICTION,
    "cutting_force": CUTTING,
}


def insertion(width, seed, noise=4e-3, deep=12e-3, rate=500, speed=2e-3, exponential=False):
    """In, half a second of rest, out: a cone whose share that carries falls from 1 to 0 over ``width`` [m] by a
    smooth step, or exponentially, and friction and cutting that take over."""
    inwards = np.linspace(CONTACT - 4e-3, CONTACT + deep, int((deep + 4e-3) / speed * rate))
    rest = np.full(rate // 2, inwards[-1])
    depth = np.concatenate([np.full(20, inwards[0]), inwards, rest, inwards[::-1], np.full(20, inwards[0])])
    deepest, h = np.maximum.accumulate(depth), np.maximum(depth - CONTACT, 0.0)
    x = np.maximum(deepest - CONTACT - ONSET, 0.0) / width
    broken = 1.0 - np.exp(-x) if exponential else np.minimum(x, 1.0) ** 2 * (3.0 - 2.0 * np.minimum(x, 1.0))
    slip = np.clip(1.0 - (deepest - depth) / STEP, -1.0, 1.0)
    force = (1.0 - broken) * PEAK * (h / ONSET) ** 2 + broken * (FRICTION * h * slip + CUTTING * np.maximum(slip, 0.0))
    force += np.random.default_rng(seed).normal(0.0, noise, len(force))
    return nf.Recording(time=np.arange(len(depth)) / rate, depth=depth, force=force)


@functools.cache
def identified(width, seed):
    """A recording and its fit, which several tests look at."""
    recording = insertion(width, seed)
    return recording, nf.identify(recording)


@pytest.mark.parametrize("width", [0.1e-3, 0.3e-3, 0.7e-3, 1.5e-3])
def test_contact_friction_and_cutting_are_in_their_intervals(width):
    """Of 8 x 4 intervals at 95 %, 4 or more miss in 2 % of such tests. A sharp model may be the better one for short
    ruptures; the force at the peak is met by either."""
    missed, met = [], []
    for seed in range(8):
        _, fit = identified(width, seed)
        for name, true in TRUTH.items():
            found = fit.parameters[name]
            if not found.low <= true <= found.high:
                missed.append((seed, name, found.value, found.low, found.high))
        met.append(fit.recordings[0].predicted.max() / fit.parameters.puncture_force.value)
    assert len(missed) <= 4, missed
    assert np.all(np.abs(np.array(met) - 1.0) < 0.05), met


def test_the_interval_of_a_puncture_holds_the_start_of_an_exponential_fall():
    """At once, or over a few samples, of 0.73 N."""
    missed = []
    for width, rate, noise in ((1e-9, 100, 60e-3), (30e-6, 500, 20e-3), (30e-6, 500, 60e-3), (0.1e-3, 200, 60e-3)):
        for seed in range(6):
            found = nf.identify(insertion(width, seed, noise, rate=rate, exponential=True)).parameters.puncture_depth
            if not found.low <= CONTACT + ONSET <= found.high:
                missed.append((width, rate, noise, seed, found))
    assert len(missed) <= 3, missed


def test_the_identified_model_is_the_fit_and_a_preset(tmp_path):
    """Fitted, run by the engine, saved and read again: one force, with the width of the rupture in its interval."""
    recording = insertion(0.7e-3, 3)
    fit = nf.identify(recording, model="gradual_cone")
    inwards = slice(0, int(np.argmax(recording.depth)))
    assert np.std(fit.residuals[0][inwards]) < 1.2 * 4e-3
    fit.save(tmp_path / "gradual.toml")
    again = nf.preset(tmp_path / "gradual.toml")
    assert again.friction == fit.model.friction
    h = np.linspace(-1e-3, 8e-3, 4001)
    dt = np.full(len(h), 1e-3)
    own, read = (nf.Insertion(model, max_speed=np.inf).run(h, None, dt)["force"] for model in (fit.model, again))
    np.testing.assert_allclose(own, read, rtol=1e-9)
    assert np.abs(np.diff(own)).max() < 0.02 * PEAK  # no jump at the onset


@pytest.mark.parametrize("width", [0.1e-3, 0.3e-3, 0.7e-3, 1.5e-3])
def test_a_replay_has_the_peak_of_its_own_recording(width):
    """Its force, and its place: the fit has it where the events say."""
    for seed in range(3):
        recording, fit = identified(width, seed)
        replayed = fit.predict(recording, events=nf.segment(recording))
        assert replayed.max() == pytest.approx(recording.force.max(), rel=0.05), seed
        place = recording.depth[np.argmax(replayed)]
        assert abs(place - fit.parameters.puncture_depth.value) < 0.15e-3, (seed, place)


@pytest.mark.parametrize("width", [1e-9, 0.1e-3, 0.3e-3, 0.7e-3, 1.1e-3, 1.5e-3])
def test_a_replay_of_another_puncture_has_its_force(monkeypatch, many, width):
    """Specimens up to 1.6 times as stiff that rupture 30 % earlier to 20 % later, in a zero of the depth that moves by
    up to 1 mm: the force at the peak goes by the square of the indentation and by the stiffness."""
    met, alone = [], []
    for seed in range(many(3, 10)):
        runs, tops = [], []
        for k, (longer, stiffer) in enumerate(
            ((1.0, 1.0), (0.7, 1.3), (0.85, 0.8), (0.95, 1.6), (1.1, 0.7), (1.2, 1.0))
        ):
            monkeypatch.setattr(f"{__name__}.ONSET", 4e-3 * longer)
            monkeypatch.setattr(f"{__name__}.PEAK", stiffer * longer**2)
            run = insertion(width, 10 * seed + k, deep=9e-3)
            runs.append(nf.Recording(time=run.time, depth=run.depth + 0.2e-3 * k, force=run.force))
            tops.append(insertion(width, 0, noise=0.0, deep=9e-3).force.max())
        fit = nf.identify(runs[0])
        met += [fit.predict(run, events=nf.segment(run)).max() / top for run, top in zip(runs[1:], tops[1:])]
        alone += [fit.predict(run).max() / top for run, top in zip(runs[1:], tops[1:])]
    error = np.abs(np.log(met))
    assert np.sqrt(np.mean(error**2)) < 0.03 and np.mean(error < 0.05) >= 0.9 and error.max() < 0.08, met
    assert np.sqrt(np.mean(error**2)) < 0.1 * np.sqrt(np.mean(np.log(alone) ** 2))


@pytest.mark.parametrize("filter_length", [1, 10])
def test_a_sharp_rupture_is_not_gradual(filter_length):
    """The noise of 4 mN alone, and behind a declared average of 10 samples, 40 um of travel."""
    for seed in range(4):
        recording = insertion(1e-9, seed)
        force = recording.force
        averaged = np.convolve(np.r_[np.full(filter_length - 1, force[0]), force], np.full(filter_length, 1.0), "valid")
        card = type(recording.card)(filter_length=filter_length)
        shown = nf.Recording(time=recording.time, depth=recording.depth, force=averaged / filter_length, card=card)
        assert "gradual" not in nf.identify(shown).model.name, seed


def test_a_gradual_rupture_asked_for_by_name_is_refused_where_a_sharp_one_explains_the_samples_as_well():
    one = nf.identify(insertion(1e-9, 0), model="gradual_cone").recordings[0]
    assert one.status == "unreadable" and one.events.status == "ok" and not one.parameters
    said = "file was read, but the law gradual_cone .*a sharp one explains the samples as well with the law cone"
    assert any(re.search(said, note) for note in one.notes), one.notes


def test_an_exponent_that_is_held_is_fixed_and_one_that_is_fitted_has_an_interval():
    shown = {identified(width, 0)[1].parameters.get("rupture_exponent") for width in (0.3e-3, 0.7e-3, 1.5e-3)} - {None}
    assert shown
    for exponent in shown:
        held = exponent.low == exponent.high
        assert (exponent.known, exponent.identifiable) == (("fixed", False) if held else ("yes", True))
        assert str(exponent).endswith(", fixed") == held and exponent.source.startswith("held fixed") == held


STALKS = "other-labs/stalk-puncture-instron"


def test_stalks_have_models_that_meet_the_peak(recordings, many):
    """Of another laboratory, 1 kHz: a sharp rupture is 1.11 to 1.19 of the measured peak. Until the force is least
    behind the first wall, the residual is small; the transient before the contact is no drift."""
    pd = pytest.importorskip("pandas")
    for path in sorted((recordings / STALKS).glob("*.csv"))[:: many(3, 1)]:
        time, depth, force = pd.read_csv(path).iloc[1:].astype(float).to_numpy().T
        found = nf.identify(nf.Recording(time, 1e-3 * depth, np.gradient(1e-3 * depth, time), force)).recordings[0]
        assert len(found.predicted), path.name
        assert not any("drifts" in note for note in found.notes), path.name
        first, second = found.events.punctures[0], found.events.punctures[-1]
        end = first.end + int(np.argmin(force[first.end : second.low]))
        peak = (
            found.predicted[:end].max() - found.parameters.force_offset.value
        ) / found.parameters.puncture_force.value
        assert abs(peak - 1.0) < 0.05, (path.name, peak)
        assert np.std(force[:end] - found.predicted[:end]) < 0.04 * force[:end].max(), path.name
