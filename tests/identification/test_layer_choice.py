# SPDX-License-Identifier: Apache-2.0
"""One layer or layers, when no model is named: decided by what one layer misses over the complete cycle."""

import dataclasses
import functools
import re
from types import SimpleNamespace

import numpy as np
import pytest

import needleforce as nf
from needleforce.identification.layered import identify as layered
from needleforce.identification.layered import model_selection
from needleforce.identification.model_choice import with_one_layer_parameters

MOTION = nf.Motion.insert(start=-4e-3, speed=3e-3, depth=14e-3, hold=6.0, withdraw=True)


def recorded(seed=0, kept=1.0, outwards=None):
    """The paper's tissue with noise of 5 mN; at rest its force falls to a share that the withdrawal keeps, or has
    another one ``outwards``."""
    run = nf.simulate(nf.preset("paper"), MOTION, rate=200.0)
    start = run.time[np.argmax(run.depth >= run.depth.max() - 1e-9)]
    share = kept + (1.0 - kept) * np.exp(-np.clip(run.time - start, 0.0, None) / 1.5)
    share = share if outwards is None else np.where(np.gradient(run.depth) < 0.0, outwards, share)
    force = run.force * share + np.random.default_rng(seed).normal(0.0, 5e-3, len(run))
    return nf.Recording(time=run.time, depth=run.depth, force=force)


@functools.cache
def relaxed(repeats, model=None):
    """Recordings whose withdrawal keeps 0.4 of the force, and their fit, which several tests look at."""
    runs = [recorded(seed, kept=0.4) for seed in range(repeats)]
    return runs, nf.identify(runs, model=model)


def first(fit):
    return next((each for each in fit.warnings if each.startswith("The model is ")), "")


@pytest.mark.parametrize("kept", [1.0, 0.3])
def test_one_layer_that_leaves_the_noise_of_the_strokes_needs_no_layered_fit(monkeypatch, kept):
    def unexpected(*_):
        raise AssertionError("a layered fit although one layer describes the recording")

    monkeypatch.setattr(layered, "identify_layered", unexpected)
    fit = nf.identify(recorded(kept=kept, outwards=1.0))
    assert fit.model.name.startswith("identified_") and "layered" not in fit.model.name
    assert not first(fit)
    assert any("viscous" in each for each in fit.warnings) == (kept < 1.0)


@pytest.mark.parametrize("repeats", [1, 2])
def test_a_hold_and_a_withdrawal_that_one_layer_misses_are_evidence_for_layers(repeats):
    (_, fit), (_, one) = relaxed(repeats), relaxed(repeats, "paper")
    assert fit.model.name == "identified_layered_yielding"
    assert one.quality.nrmse > 0.05 > fit.quality.nrmse
    shares = [float(share) for share in re.findall(r"([\d.]+) %", first(fit))]
    assert len(shares) == 2 and shares[0] > 5.0 > shares[1]
    assert not any("which this model omits" in each for each in fit.warnings)


def test_the_engine_has_the_surface_of_the_layered_model():
    """Whatever contact depth one layer has."""
    (run,), fit = relaxed(1)
    contact = dataclasses.replace(fit.parameters["contact_depth"], value=1e-3)
    fit = dataclasses.replace(fit, parameters={**fit.parameters, "contact_depth": contact})
    for events in (None, nf.segment(run)):
        model, surface = fit.placed(run, events)
        force = nf.Insertion(model, max_speed=np.inf).forces(run.depth - surface, np.full(len(run), 5e-3))
        assert np.std(force - run.force) < 1.05 * np.std(fit.predict(run, events) - run.force)


def test_the_puncture_of_a_layered_default_is_the_measured_one():
    (_, fit), (_, one) = relaxed(2), relaxed(2, "paper")
    for name in ("puncture_depth", "puncture_force"):
        assert fit.parameters[name].value == one.parameters[name].value
    truth = nf.preset("paper").layers[0].puncture.depth
    at = fit.parameters["puncture_indentation"]
    assert at.value == pytest.approx(fit.parameters["puncture_depth"].value - fit.parameters["contact_depth"].value)
    assert at.low <= truth <= at.high


@pytest.mark.parametrize("kept", [0.3, 0.5, 0.6])
def test_parameters_of_a_layered_default_hold_the_truth(kept):
    """The withdrawal differs from what any elastic layer does: contact depth and stiffness are not to pay for it."""
    cone = nf.preset("paper").layers[0].stiffness
    truth = 2.0 / np.pi * cone.reduced_modulus * np.tan(cone.half_angle)  # Sneddon's cone
    fit = nf.identify(recorded(3, kept=kept))
    contact, stiffness = fit.parameters["contact_depth"], fit.parameters["stiffness_coefficient"]
    friction, cutting = fit.parameters["friction_per_length"], fit.parameters["cutting_force"]
    assert fit.model.name == "identified_layered_yielding"
    assert contact.low <= 0.0 <= contact.high
    assert contact.high - contact.low < 0.5e-3  # over all loading laws; 0.7 to 2.9 mm in the layered fit
    assert stiffness.low <= truth <= stiffness.high
    layer = nf.preset("paper").layers[0]
    assert friction.low <= layer.friction.per_length <= friction.high
    assert cutting.low <= layer.cutting.force <= cutting.high


@pytest.mark.parametrize("name", ["contact_depth", "puncture_depth"])
def test_a_depth_of_the_layered_model_elsewhere_is_named(name):
    """Dragged or layered tissue: a deeper rupture of the model may describe the cycle better than the first one."""
    _, one = relaxed(1, "paper")
    measured = one.parameters[name]
    for shift, named in ((0.0, False), (2e-3, True)):
        moved = {field: getattr(measured, field) + shift for field in ("value", "low", "high")}
        model = dataclasses.replace(one, parameters={**one.parameters, name: dataclasses.replace(measured, **moved)})
        fit = with_one_layer_parameters(model, one)
        assert fit.parameters[name] == measured
        words = [each for each in fit.warnings if each.startswith(f"{name} is ") and "in the layered model" in each]
        assert bool(words) == named
        assert not named or f"{1e3 * (measured.value + shift):.3g} mm" in words[0]


def homogeneous(seed):
    """One to five repeats of a tissue without layers: a contact by a power that ruptures at once, friction over the
    length inside, another one in the withdrawal, a cutting force, relaxation at rest, of which a part stays, and in
    some a ripple that belongs to the tissue."""
    draw, runs = np.random.default_rng(seed), []
    power, rupture, peak = draw.choice([1.3, 1.7, 2.0, 2.6]), draw.uniform(2e-3, 4.5e-3), draw.uniform(0.15, 1.5)
    depth, cutting, ratio = draw.uniform(10e-3, 16e-3), peak * draw.uniform(0.15, 0.45), draw.uniform(0.7, 1.2)
    friction, relaxed, kept = peak * draw.uniform(30.0, 100.0), draw.uniform(0.0, 0.4), draw.choice([1.0, 0.8])
    ripple, speed, scatter = draw.choice([0.0, 0.02]), draw.uniform(1e-3, 5e-3), draw.uniform(0.02, 0.06)
    for _ in range(draw.choice([1, 3, 5])):
        share, own = 1.0 + scatter * draw.normal(), friction * (1.0 + 0.03 * draw.normal())
        inwards, rest = np.arange(-3e-3, depth, speed * 5e-3), np.arange(1, 601) * 5e-3
        h = np.maximum(inwards, 0.0)
        force = np.where(h < rupture * share, peak * (h / rupture) ** power, cutting + own * h)
        held = force[-1] * (1.0 - relaxed * (1.0 - 0.6 * np.exp(-rest / 0.3) - 0.4 * np.exp(-rest / 2.5)))
        slip = ratio * kept * own * h[::-1]
        back = np.maximum(held[-1] - (held[-1] + slip[0]) * (depth - inwards[::-1]) / 0.2e-3, -slip)
        z = np.concatenate([inwards, np.full(600, inwards[-1]), inwards[::-1]])
        force = np.concatenate([force, held, back]) + ripple * (z > 0.0) * np.sin(2.0 * np.pi * z / 0.8e-3)
        noise = draw.normal(0.0, 4e-3, len(z))
        runs.append(nf.Recording(time=np.arange(len(z)) * 5e-3, depth=z, force=force + noise))
    return runs


@pytest.mark.parametrize("model", ["layered", None])
def test_layers_of_a_tissue_without_any_are_called_none(many, model):
    """One in twenty may have layers unsaid."""
    unsaid, count = [], many(1, 20)
    for seed in range(count):
        fit = nf.identify(homogeneous(seed), model=model)
        deeper = [each for name, each in fit.parameters.items() if name.startswith("layer_2_")]
        said = "one layer describes these recordings as well or better" in (fit.warnings or ("",))[0]
        unsaid += [seed] if deeper and not said else []
        assert not said or not any(each.identifiable for each in deeper)
    assert len(unsaid) <= 0.05 * count, unsaid


def rounded(seed, friction=60.0, outlier=False, noise=5e-3):
    """In, two seconds of rest, out: a contact that friction replaces without a fall of the force; without friction, an
    elastic contact that gives back what pressed it in."""
    rate, contact, onset = 200, 3e-3, 4e-3
    inwards = np.linspace(contact - 4e-3, contact + 11e-3, 15 * rate // 3)
    depth = np.concatenate([inwards, np.full(2 * rate, inwards[-1]), inwards[::-1]])
    h = np.clip(depth - contact, 0.0, None)
    slip = np.clip(1.0 - (np.maximum.accumulate(depth) - depth) / 0.5e-3, -1.0, 1.0)
    pressed = np.minimum(h, onset) ** 2 * friction * 11e-3 / onset**2 * 0.36
    force = pressed + friction * np.clip(h - onset, 0.0, None) if friction else 60.0 * 3e-3 * (h / onset) ** 2
    if friction:
        back = len(inwards) + 2 * rate
        force[back:] = np.where(slip[back:] > -1.0, slip[back:], -1.0) * friction * 0.5 * h[back:]
    force = force + np.random.default_rng(seed).normal(0.0, noise, len(force))
    if outlier:
        force[40] += 0.4
    return nf.Recording(time=np.arange(len(depth)) / rate, depth=depth, force=force)


@pytest.mark.parametrize("seed", range(3))
def test_a_cycle_without_a_puncture_has_a_layered_model_that_says_what_is_lacking(seed):
    run = rounded(seed, outlier=seed == 1)
    assert str(nf.segment(run).status) == "no_puncture"
    fit = nf.identify(run)
    assert fit.model.name == "identified_layered_yielding" and fit.quality.nrmse < 0.05
    assert "lack a puncture" in first(fit) and "puncture_force" not in fit.parameters
    hidden = ("puncture_depth", "puncture_indentation", "friction_per_length")
    given = [
        known[name] for known in (fit.parameters, fit.recordings[0].parameters) for name in hidden if name in known
    ]
    assert len(given) >= len(hidden) and not any(each.identifiable for each in given)
    assert fit.predict(run).max() == pytest.approx(run.force[100:].max(), rel=0.05)


@pytest.mark.parametrize("seed", range(3))
def test_what_presses_back_was_not_entered_and_the_reason_is_named_before_an_outlier(seed):
    fit = nf.identify(rounded(seed, friction=0.0, outlier=True))
    assert fit.identified_model is None and fit.recordings[0].notes[0] == "There is no puncture."
    with pytest.raises(nf.InputError, match="There is no puncture"):
        fit.model  # noqa: B018


def test_held_out_forces_stay_with_their_recordings(monkeypatch):
    """One layer has no fit of the second of five repeats, whose layered force is of no other one."""
    seen = []

    class Compared:
        def __init__(self, number):
            self.number = number

        def gain(self, shared):
            return 100.0

        def held_out(self, others, force):
            seen.append((self.number, force))
            return 1.0, 0.5

    made = staticmethod(lambda one, layered, single: Compared(single))
    monkeypatch.setattr(model_selection._Compared, "made", made)
    one = [SimpleNamespace(residuals=[] if k == 1 else [0.0]) for k in range(5)]
    layered = [SimpleNamespace(residuals=[0.0])] * 5
    fits = (SimpleNamespace(recordings=one), SimpleNamespace(recordings=layered, parameters={}))
    found = model_selection.stroke_evidence(*fits, tuple(range(5)), list(range(5)))
    assert seen == [(k, k) for k in (0, 2, 3, 4)] and found.held_out and found.for_layers
