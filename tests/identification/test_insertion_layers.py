# SPDX-License-Identifier: Apache-2.0
"""Layers that rupture one after another in insertions alone: own simulations of walls, films and tissue, whose rupture
is a smooth step or at once, and the stalks of another laboratory."""

import json
from functools import cache

import numpy as np
import pytest

import needleforce as nf
from needleforce.identification.layered.insertion_problem import InsertionProblem
from needleforce.identification.models import IDENTIFIED

TOPS, INDENTATIONS, PEAKS = (2e-3, 8e-3), (2e-3, 3e-3), (1.0, 1.6)


def walls(
    seed, *, tops=TOPS, indentations=INDENTATIONS, peaks=PEAKS, widths=(0.5e-3, 0.5e-3), power=2.0, friction=30.0,
    cutting=(0.1, 0.2), noise=4e-3, correlation=0.0, quantum=0.0, rate=500, speed=2e-3, rest=0,
):  # fmt: skip
    """Inwards at a constant speed. The contact of a layer rises by a power to its peak and is lost over a width; what
    follows is friction over the length in the layer, and the cutting force of the layer in which the tip is."""
    end = tops[-1] + indentations[-1] + 4e-3
    depth = np.concatenate([np.arange(-3e-3, end, speed / rate), np.full(rest, end)])
    force, cut = np.zeros(len(depth)), np.zeros(len(depth))
    for k, (top, reached, peak, width, own) in enumerate(zip(tops, indentations, peaks, widths, cutting)):
        h, below = np.clip(depth - top, 0.0, None), tops[k + 1] if k + 1 < len(tops) else np.inf
        x = np.clip((h - reached) / max(width, 1e-9), 0.0, 1.0)
        broken = x * x * (3.0 - 2.0 * x)
        contact = peak * (h / reached) ** power
        force += (1.0 - broken) * contact + broken * friction * np.minimum(h, below - top)
        cut = np.where(depth < top, cut, np.where(broken > 0.0, broken * own, np.maximum(cut - contact, 0.0)))
    random, error = np.random.default_rng(seed), np.zeros(len(depth))
    for k, each in enumerate(random.normal(0.0, noise, len(depth))):
        error[k] = correlation * error[k - 1] + (1.0 - correlation**2) ** 0.5 * each
    force = force + cut + error
    force = np.round(force / quantum) * quantum if quantum else force
    return nf.Recording(time=np.arange(len(depth)) / rate, depth=depth, force=force)


@cache
def identified(*seeds):
    """What is found of two walls, for tests that change nothing of it."""
    return nf.identify([walls(seed) for seed in seeds])


def truth(**situation):
    """Top, depth of the peak and its force of each layer, without noise."""
    run = walls(0, **situation | {"noise": 1e-12, "correlation": 0.0, "quantum": 0.0})
    tops = situation.get("tops", TOPS)
    found = []
    for top, below in zip(tops, (*tops[1:], np.inf)):
        inside = np.flatnonzero((run.depth >= top) & (run.depth < below))
        peak = inside[np.argmax(run.force[inside])]
        found.append((top, run.depth[peak], run.force[peak]))
    return found


THREE = {"tops": (1e-3, 3e-3, 5e-3), "indentations": (0.8e-3,) * 3, "peaks": (0.5, 0.6, 0.7)}
SITUATIONS = {
    "two walls": {},
    "two sharp layers": {"widths": (0.0, 0.0)},
    "skin, then fat, at 100 Hz": {
        "tops": (1e-3, 5e-3), "indentations": (3.5e-3, 2.5e-3), "peaks": (3.0, 0.9), "widths": (0.05e-3, 0.1e-3),
        "rate": 100, "noise": 10e-3, "friction": 60.0,
    },
    "three films": THREE | {
        "widths": (0.2e-3,) * 3, "power": 1.5, "friction": 20.0, "cutting": (0.05,) * 3, "speed": 1e-3,
    },
    "four walls": {
        "tops": (1e-3, 4e-3, 7e-3, 10e-3), "indentations": (1.2e-3,) * 4, "peaks": (0.8, 1.0, 0.7, 0.9),
        "widths": (0.4e-3,) * 4, "friction": 20.0, "cutting": (0.1,) * 4,
    },
    "the second higher and sharp": {"widths": (1e-3, 0.0), "peaks": (0.6, 2.0)},
    "correlated noise": {"correlation": 0.95, "noise": 8e-3},
    "a force in steps": {"quantum": 20e-3, "noise": 3e-3},
    "linear contacts": {"power": 1.0},
    "contacts above a cone": {"power": 2.6},
    "much noise": {"noise": 60e-3, "peaks": (2.0, 3.0)},
    "then at rest": {"rest": 500},
    "a layer from the rupture of the last on": {
        "tops": (1e-3, 6.1e-3), "indentations": (5e-3, 4e-3), "peaks": (4.0, 3.5), "widths": (0.0, 0.0),
        "rate": 100, "noise": 10e-3, "friction": 60.0,
    },
}  # fmt: skip


DAILY = "two walls", "skin, then fat, at 100 Hz", "four walls", "correlated noise", "the second higher and sharp"


@pytest.mark.parametrize(
    "name", [name if name in DAILY else pytest.param(name, marks=pytest.mark.long) for name in SITUATIONS]
)
def test_every_layer_has_its_peak_and_its_place(name, many):
    """Of the intervals of tops, depths, forces and indentations at 95 %, half of one in ten may miss."""
    situation, missed, count = SITUATIONS[name], [], 0
    layers = truth(**situation)
    for seed in range(many(1, 40)):
        fit = nf.identify(walls(seed, **situation))
        assert fit.model.name == "identified_gradual_layers" and len(fit.model.layers) == len(layers)
        assert fit.quality.r2 >= 0.95
        predicted, depth = fit.recordings[0].predicted, fit.recordings[0].recording.depth
        for k, (top, at, force) in enumerate(layers):
            start, below = f"layer_{k + 1}_" if k else "", [*(each[0] for each in layers), np.inf][k + 1]
            inside = (depth >= top) & (depth < below)
            assert predicted[inside].max() == pytest.approx(force, rel=0.05), (seed, k)
            true = {"puncture_depth": at, "puncture_force": force, "puncture_indentation": at - top}
            true |= {"top": top - layers[0][0]} if k else {"contact_depth": top}
            for quantity, value in true.items():
                found = fit.parameters[start + quantity]
                count += 1
                missed += [] if found.low <= value <= found.high else [(seed, found, value)]
    assert len(missed) <= 0.1 * count, missed


def test_what_an_insertion_does_not_show_is_said():
    fit = identified(0)
    for name in ("friction_per_length", "cutting_force", "layer_2_friction_per_length", "layer_2_cutting_force"):
        assert not fit.parameters[name].identifiable
    assert any("withdrawal" in each for each in fit.unknown)
    assert fit.warnings[0].startswith("The model is gradual_layers: over the insertion the residual is")
    assert fit.warnings[0].split("model='")[1].split("'")[0] in IDENTIFIED


def test_one_layer_with_a_second_fall_of_friction_alone_keeps_to_its_evidence():
    """A single wall: no second puncture, no layers; the model can be asked for by name."""
    run = walls(1, tops=(2e-3,), indentations=(2e-3,), peaks=(1.0,), widths=(0.5e-3,), cutting=(0.1,))
    assert "layers" not in nf.identify(run).model.name
    named = nf.identify(run, model="gradual_layers")
    assert len(named.model.layers) == 1 and named.quality.r2 > 0.99


def test_repeats_are_pooled_and_replayed_at_their_punctures(tmp_path):
    """Repeats whose second wall is up to 2 mm deeper: a prediction has it at the mean, a replay where it is."""
    runs = [walls(seed, tops=(2e-3, 8e-3 + 1e-3 * seed)) for seed in range(3)]
    fit = nf.identify(runs)
    assert fit.model.name == "identified_gradual_layers" and fit.parameters["layer_2_top"].between_repeats_sd > 0.5e-3
    for run in runs:
        force = fit.predict(run, events=nf.segment(run))
        for top, below in ((2e-3, 7e-3), (7e-3, np.inf)):
            inside = (run.depth >= top) & (run.depth < below)
            peaks = [run.depth[inside][np.argmax(each[inside])] for each in (force, run.force)]
            assert abs(peaks[0] - peaks[1]) < 0.15e-3
            assert force[inside].max() == pytest.approx(run.force[inside].max(), rel=0.05)
    fit.save(tmp_path / "walls.toml")
    assert len(nf.preset(tmp_path / "walls.toml").layers) == 2
    fit.report(tmp_path / "walls.html")
    assert json.loads(fit.to_json())["parameters"]


def test_a_repeat_that_is_cut_off_is_named():
    whole = [walls(seed) for seed in range(3)]
    cut = nf.Recording(time=whole[1].time, depth=whole[1].depth, force=np.minimum(whole[1].force, 1.3))
    fit = nf.identify([whole[0], cut, whole[2]])
    assert any("is cut off at 1.3 N" in each and "too low" in each for each in fit.warnings)
    assert not any("cut off" in each for each in nf.identify(whole[::2]).warnings)


def test_layers_of_insertions_are_compared_with_one_layer():
    rows = nf.compare([walls(seed) for seed in range(3)], ["paper", "gradual_layers"])
    assert [row.model for row in rows] == ["gradual_layers", "paper"] and not rows[1].ties
    assert rows[0].left_out < 0.05 < rows[1].left_out and rows[0].parameters == 2 * 8 + 1


def test_the_model_of_a_fit_is_a_model_to_identify(tmp_path):
    fit = identified(0)
    fit.save(tmp_path / "walls.toml")
    for source in (fit.model, tmp_path / "walls.toml"):
        assert nf.identify(walls(1), model=source).model.name == fit.model.name


@pytest.mark.parametrize("count", [1, 3])
def test_draws_have_the_intervals_and_what_moves_together(count):
    fit = identified(*range(count))
    draws = fit.draws()
    assert set(draws) == set(fit.parameters) and draws.own["layer_2_top"].shape == (count, 4000)
    for name, found in fit.parameters.items():
        low, high = np.quantile(draws[name], (0.025, 0.975)) - np.array([found.low, found.high])
        assert max(abs(low), abs(high)) < 0.1 * (found.high - found.low) or not found.identifiable, name
        assert name == "force_offset" or draws.own[name].min() >= 0.0
    # a deeper contact is a smaller indentation at the same puncture
    assert np.corrcoef(draws.own["contact_depth"][0], draws.own["puncture_indentation"][0])[0, 1] < -0.9


def test_bad_input_is_said():
    close = walls(0, tops=(2e-3, 2.3e-3), indentations=(0.25e-3, 0.4e-3), widths=(0.02e-3,) * 2, rate=25, speed=2e-3)
    fit = nf.identify(close, model="gradual_layers", layers=2)
    said = (*fit.recordings[0].notes, *fit.warnings)
    assert fit.identified_model is not None or any("punctures" in each or "samples" in each for each in said)
    few = nf.identify([walls(0), walls(1, tops=(2e-3,), indentations=(2e-3,))], model="gradual_layers", layers=2)
    assert any("2 layers need as many" in note for note in few.recordings[1].notes) and few.identified_model is not None
    with pytest.raises(nf.InputError, match="no tissue is dragged"):
        nf.identify(walls(0), model="gradual_layers", layers=2, tissue_stiffness=[(250.0, 0.3), None])


def test_the_search_has_the_slopes_that_differences_show(monkeypatch):
    """Every search of an identification, each at its end: cones with a cylinder and power laws, one layer and two."""
    searches, solve = [], InsertionProblem.solve

    def noted(problem, *start):
        searches.append((problem, solve(problem, *start)))
        return searches[-1][1]

    monkeypatch.setattr(InsertionProblem, "solve", noted)
    nf.identify(walls(3, rate=50))
    kinds = {(*problem.curve.shape, len(problem.peaks)) for problem, _ in searches}
    assert kinds == {("saturation_depth", 1), ("saturation_depth", 2), ("exponent", 2)}
    for problem, x in searches:
        low, high = problem.limits
        x, depth = np.clip(x, low + 1e-3, high - 1e-3), problem.depth
        ends = [[problem.forces(x + h * each, depth) for h in (1e-5, -1e-5)] for each in np.eye(len(x))]
        expected = np.array([above - below for above, below in ends]) / 2e-5
        for found, column in zip(problem.slopes(x, depth).T, expected):
            np.testing.assert_allclose(found, column, atol=1e-5 * np.abs(expected).max(), rtol=0.0)


def test_stalks_have_both_walls(recordings, many):
    """Of another laboratory: two walls in each, read by eye before."""
    for path in sorted((recordings / "other-labs/stalk-puncture-instron").glob("*.csv"))[:: many(3, 1)]:
        run = nf.read(path)
        fit, events = nf.identify(run), nf.segment(run)
        assert fit.model.name == "identified_gradual_layers" and fit.quality.r2 >= 0.95, path.name
        for force in (fit.recordings[0].predicted, fit.predict(run), fit.predict(run, events=events)):
            for puncture in events.punctures:
                near = np.abs(run.depth - puncture.depth) < 1e-3
                assert force[near].max() == pytest.approx(run.force[near].max(), rel=0.05), path.name
