# SPDX-License-Identifier: Apache-2.0
"""A model replaced from another thread while a loop in Python runs."""

import itertools
import math
import threading
import time

import pytest

import needleforce as nf
from needleforce import core
from needleforce.control import Guard, LiveInsertion


@pytest.fixture
def model():
    return nf.preset("paper")


def softer(model, ratio):
    cone = model.stiffness
    return model.replace(stiffness=nf.laws.Cone(ratio * cone.reduced_modulus, cone.half_angle))


def pressed(model, depth):
    cone = model.stiffness
    return 2.0 / math.pi * cone.reduced_modulus * math.tan(cone.half_angle) * depth**2


def test_the_force_changes_linearly_from_the_old_to_the_new_model(model):
    live = LiveInsertion(model, blend_time=20e-3)
    before = live.step(2e-3, None, 1e-3).force
    assert before == pytest.approx(pressed(model, 2e-3), rel=1e-12)
    live.replace(softer(model, 0.5))
    for i in range(1, 30):
        force = live.step(2e-3, None, 1e-3).force
        assert force == pytest.approx(before * (1.0 - 0.5 * min(1.0, i / 20)), rel=1e-9)
        assert live.blending == (i < 20)
    assert live.taken == 1


def test_models_from_another_thread_never_disturb_the_loop(model):
    live, done, written = LiveInsertion(model), threading.Event(), []

    def write():
        while not done.is_set():
            live.replace(softer(model, 0.5 + 0.5 * (len(written) % 2)))
            written.append(1)
            time.sleep(1e-4)

    writer = threading.Thread(target=write)
    writer.start()
    highest = pressed(model, 2e-3)
    forces, ends = [], time.monotonic() + 300.0
    while (live.taken < 20 and time.monotonic() < ends) or len(forces) < 20000:
        forces.append(live.step(2e-3, None, 1e-3).force)
    done.set()
    writer.join()
    assert live.taken >= 20 and live.refused == 0
    assert min(forces) >= 0.5 * highest * (1.0 - 1e-12) and max(forces) <= highest * (1.0 + 1e-12)
    steepest = max(abs(b - a) for a, b in itertools.pairwise(forces))
    assert steepest <= 0.5 * highest / 10 * (1.0 + 1e-9)


def test_the_hole_is_kept_when_a_layer_is_added_around_the_tip(model):
    live = LiveInsertion(model, blend_time=0.0)
    for i in range(901):
        before = live.step(1e-5 * i, None, 1e-3)
    # the same tissue below an interface that the tip went through
    below = nf.Layer(6e-3, model.stiffness, nf.laws.PunctureDepth(1e-3), model.friction, model.cutting)
    live.replace(model.replace(deeper=(below,)))
    after = live.step(9e-3, None, 1e-3)
    assert after.force == pytest.approx(before.force, abs=1e-12)
    assert not after.punctured and live.pierced_layers == 2 and live.deepest_cut == pytest.approx(9e-3)


def test_an_invalid_model_is_refused_and_counted(model):
    live = LiveInsertion(model)
    before = live.step(2e-3, None, 1e-3).force
    with pytest.raises(nf.InputError, match="not a Model"):
        live.replace(None)
    # a Model with overlapping layers cannot be made; the core is given the layers directly
    with pytest.raises(nf.InputError, match=r"layer 2, top is refused, .*The previous model continues"):
        live.replace_layers([(0.0, model.laws), (1e-3, model.laws)])
    assert live.refused == 1 and live.last_refused and live.taken == 0
    assert live.step(2e-3, None, 1e-3).force == before
    live.replace(model)
    assert not live.last_refused


@pytest.mark.parametrize(
    "wrong",
    [{"blend_time": -1.0}, {"blend_time": math.nan}, {"blend_time": 1.5}, {"max_speed": 0.0}, {"hold_time": -1.0}],
)
def test_wrong_settings_are_refused(model, wrong):
    with pytest.raises(nf.InputError, match=next(iter(wrong))):
        LiveInsertion(model, **wrong)


def test_an_invalid_step_is_reported_and_reset_restarts(model):
    live = LiveInsertion(model, bevel=core.Bevel(0.35, 0.1, 0.5))
    for i in range(601):
        sample = live.step(1e-5 * i, None, 1e-3)
    assert sample.lateral > 0.0
    assert live.step(math.nan, None, 1e-3).status == nf.Status.not_finite
    live.reset()
    assert live.deepest_cut == 0.0 and live.step(-1e-3, None, 1e-3).force == 0.0


def test_a_guard_limits_a_live_insertion(model):
    live = LiveInsertion(model, blend_time=0.0)
    guard = Guard(live, max_force=0.05)
    for i in range(301):
        output = guard.step(1e-5 * i, None, 1e-3)
    assert output.sample.force == pytest.approx(pressed(model, 3e-3), rel=1e-12) and output.force <= 0.05
    live.replace(softer(model, 0.1))
    output = guard.step(3e-3, None, 1e-3)
    assert output.force == output.sample.force == pytest.approx(0.1 * pressed(model, 3e-3), rel=1e-12)
