# SPDX-License-Identifier: Apache-2.0
"""The plugin and `needleforce.mujoco.step` give the same numbers, from any preset and on any place."""

import types

import numpy as np
import pytest
from needle_scenes import SERVO, inserted, loaded, oblique, on_arm, on_slide, stiff_models, with_plugin

import needleforce as nf
from needleforce import core
from needleforce.mujoco import attach, plugin_xml, step

TIP = nf.tips.Profile(radii=(0.0, 2e-4, 5e-4), heights=(0.0, 6e-4, 1.5e-3))
BEVEL_TIP = nf.tips.LancetBevel(half_angle=0.3, equivalence="equal_volume")
BEVEL = core.Bevel(half_angle=0.3, friction_coefficient=0.2, face_share=0.5)
SITE = {"site": "tip", "surface_site": "skin"}
TO_THE_DIGIT = 1e-9  # of the largest force


def models():
    presets = {name: nf.preset(name) for name in nf.presets()}
    paper = nf.preset("paper")
    presets["profile"] = paper.replace(stiffness=nf.laws.TipContact(reduced_modulus=1e5, radius=5e-4, tip=TIP))
    below = nf.Layer(
        8e-3,
        nf.laws.TipContact(reduced_modulus=2e5, radius=5e-4, tip=BEVEL_TIP),
        nf.laws.PunctureDepth(1e-3),
        paper.friction,
        paper.cutting,
        nf.laws.Prony(share_1=0.2, time_1=0.3, share_2=0.1, time_2=2.0),
    )
    presets["tip below"] = paper.replace(deeper=(below,))
    presets["profile below"] = paper.replace(
        deeper=(nf.Layer(8e-3, presets["profile"].stiffness, below.puncture, paper.friction, paper.cutting),)
    )
    return presets | stiff_models()


def by_plugin(mujoco, xml, controls):
    m, d = loaded(mujoco, xml)
    rows = []
    for control in controls:
        d.ctrl[:] = control
        mujoco.mj_step(m, d)
        rows.append([*d.sensor("tissue").data, *d.qpos])
    return np.array(rows)


def by_python(mujoco, xml, controls, model, **settings):
    m, d = loaded(mujoco, xml)
    needle = attach(model, m, **settings)
    rows = []
    for control in controls:
        d.ctrl[:] = control
        step(m, d, needle)
        s = needle.sample
        phase, status = list(nf.Phase).index(s.phase), list(nf.Status).index(s.status)
        parts = [s.depth, s.force, s.stiffness, s.friction, s.cutting, s.lateral, phase, status]
        rows.append([*parts, *d.qpos])
    return np.array(rows)


def assert_same(one, other):
    scale = np.abs(one[:, 1]).max()
    assert scale > 1e-3
    assert np.abs(one[:, 1:6] - other[:, 1:6]).max() <= TO_THE_DIGIT * scale
    np.testing.assert_array_equal(one[:, 6:8], other[:, 6:8])
    np.testing.assert_allclose(one[:, 8:], other[:, 8:], rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", models())
def test_on_a_joint_the_xml_of_a_model_is_the_model(mujoco, name):
    model = models()[name]
    time = np.arange(0.0, 2.0, 1e-3)
    controls = np.where(time < 1.2, inserted(time, speed=30e-3), 30e-3 * (1.7 - time))
    plugin = plugin_xml(model, joint="slide")
    there = by_plugin(mujoco, on_slide(plugin, servo=SERVO), controls)
    assert_same(there, by_python(mujoco, on_slide(servo=SERVO), controls, model, joint="slide"))


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast", "implicit"])
@pytest.mark.parametrize("surface", [SITE, {"site": "tip", "surface_normal": (0.3, 0, 3), "surface_height": 0.0}])
def test_at_a_site_of_an_arm(mujoco, surface, integrator):
    model = nf.preset("paper")
    plugin = plugin_xml(model, bevel=BEVEL, **surface)
    there = by_plugin(mujoco, on_arm(plugin, integrator), oblique())
    here = by_python(mujoco, on_arm("", integrator), oblique(), model, bevel=BEVEL, **surface)
    assert_same(there, here)
    assert there[:, 0].max() > 25e-3 and there[-1, 1] == 0.0


def test_the_force_at_a_site_acts_at_the_tip(mujoco):
    """Force and moment on the joints from the tip's lever arm by hand."""
    m, d = loaded(mujoco, on_arm(plugin_xml(nf.preset("paper"), bevel=BEVEL, **SITE)))
    for control in oblique()[:1200]:
        d.ctrl[:] = control
        mujoco.mj_step(m, d)
    mujoco.mj_forward(m, d)
    frame = d.site("tip").xmat.reshape(3, 3)
    _, force, *_, lateral, _, _ = d.sensor("tissue").data
    assert force > 0.2 and lateral > 0.01
    push = lateral * frame[:, 0] - force * frame[:, 2]
    lever = d.site("tip").xpos - d.joint("wrist").xanchor
    expected = [push[0], push[2], np.cross(lever, push)[1]]
    np.testing.assert_allclose(d.qfrc_passive, expected, rtol=1e-12, atol=1e-15)


def test_a_needle_along_the_surface_feels_nothing(mujoco):
    m, d = loaded(mujoco, on_arm(plugin_xml(nf.preset("paper"), **SITE)))
    d.joint("wrist").qpos[0], d.joint("z").qpos[0] = np.pi / 2, -0.26
    mujoco.mj_forward(m, d)
    assert d.sensor("tissue").data[1] == 0.0 and d.sensor("tissue").data[7] == 3.0
    assert not d.qfrc_passive.any()


def test_two_needles_on_one_body_share_its_mass(mujoco):
    """Each counts on its part; alone each would overshoot in stiff bristles, the two together at rest stay so."""
    model = stiff_models()["lugre_rigid"]
    both = plugin_xml(model, joint="slide", name="needle").replace("</plugin>", "")
    both += plugin_xml(model, joint="slide", name="other").split("\n", 1)[1]
    m, d = loaded(mujoco, on_slide(both, servo=SERVO))
    force = []
    for time in np.arange(0.0, 3.0, 1e-3):
        d.ctrl[0] = inserted(time)
        mujoco.mj_step(m, d)
        force.append(d.sensor("tissue").data[1])
    assert np.mean(force[-500:]) > 0.2 and np.std(force[-500:]) < 1e-6


def test_a_fit_gives_its_model():
    fit = types.SimpleNamespace(model=nf.preset("paper"))
    assert plugin_xml(fit, joint="slide") == plugin_xml(fit.model, joint="slide")


def test_xml_names_its_place():
    assert 'key="surface.normal" value="0.0 0.0 1.0"' in plugin_xml(
        nf.preset("paper"), site="tip", surface_normal=(0, 0, 1)
    )
    assert with_plugin(nf.preset("paper")).startswith('<plugin plugin="needleforce.needle">')
