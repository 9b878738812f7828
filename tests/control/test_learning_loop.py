# SPDX-License-Identifier: Apache-2.0
"""A haptic model that learns on the way: its force has no jump where the loop takes over what was learnt."""

import numpy as np
import pytest

import needleforce as nf
from needleforce.control import LiveInsertion

DT, BLEND = 1e-3, 20e-3  # [s]
LEARNT_EVERY = 50  # cycles


def tissue(scale):
    laws = nf.laws
    return nf.Model(stiffness=laws.Cone(scale * 4e5, 0.2618), puncture=laws.PunctureDepth(4e-3),
                    friction=laws.Coulomb(scale * 60.0), cutting=laws.ConstantCutting(scale * 0.3))  # fmt: skip


def felt(blend_time):
    """The force that a hand feels from a model three times too stiff that learns from the needle's sensor."""
    needle, hand = nf.Insertion(tissue(1.0)), LiveInsertion(tissue(3.0), blend_time=blend_time)
    online, random, forces, true = nf.OnlineIdentifier(prior=tissue(3.0)), np.random.default_rng(1), [], []
    depths = np.r_[np.arange(-1e-3, 12e-3, 3e-3 * DT), np.full(300, 12e-3)]
    for cycle, depth in enumerate(depths.tolist()):
        true.append(needle.step(depth, None, DT).force)
        online.step(true[-1] + 2e-3 * random.standard_normal(), depth, DT)
        known = online.parameters if cycle % LEARNT_EVERY == 0 else {}
        if known and all(each.identifiable for each in known.values()):  # right after a puncture friction is not
            hand.replace(online.model)
        forces.append(hand.step(depth, None, DT).force)
    return np.array(forces), np.array(true), hand


def test_a_learnt_model_is_taken_over_without_a_jump_and_approaches_the_truth():
    smooth, true, hand = felt(BLEND)
    at_once, _, _ = felt(0.0)
    assert hand.taken > 50 and hand.refused == 0
    step = np.arange(1, len(true))
    puncture = np.abs(np.diff(true)) > 0.05
    swap = (step % LEARNT_EVERY == 0) & ~puncture
    jump = np.abs(np.diff(at_once))[swap].max()  # where the model is replaced at once
    own = np.abs(np.diff(at_once))[~swap & ~puncture].max()  # what the models do by themselves
    assert puncture.sum() == 1 and jump > 5.0 * own
    # by the rule of LiveInsertion: the models' own change, and their difference times dt / blend
    assert np.abs(np.diff(smooth))[~puncture].max() <= own + jump * DT / BLEND
    assert smooth[-1] == pytest.approx(true[-1], rel=0.02)  # it began three times too stiff
