# SPDX-License-Identifier: Apache-2.0
"""Wrong attributes and arguments are refused by name, value, limit and next step."""

import subprocess
import sys

import pytest
from needle_scenes import loaded, on_arm, on_slide

import needleforce as nf
from needleforce.mujoco import attach, plugin_xml, step
from needleforce.mujoco.elements import attributes

PAPER = {"joint": "slide"} | attributes(nf.preset("paper"))
TIP_CONTACT = {"stiffness": "tip_contact radius=1e-3", "stiffness.half_angle": None}
LISTED = "`needleforce laws` lists every law with its numbers."


def with_keys(changes):
    keys = {name: value for name, value in (PAPER | changes).items() if value is not None}
    config = "".join(f'<config key="{name}" value="{value}"/>' for name, value in keys.items())
    return f'<plugin plugin="needleforce.needle"><instance name="needle">{config}</instance></plugin>'


@pytest.mark.parametrize(
    "changes, said",
    [
        ({"friction.per_length": "-3"}, f"coulomb.per_length is -3, outside its range of 0 to 100000. {LISTED}"),
        ({"friction.per_length": "18 N/m"}, "friction.per_length is 18 N/m, not a finite number. Give it in SI"),
        ({"friction.per_length": "nan"}, "friction.per_length is nan, not a finite number."),
        ({"friction.per_length": "1 2"}, "friction.per_length is 1 2, more than one number."),
        ({"friction.coulomb": "3"}, f"coulomb.coulomb is 3, no parameter of it. {LISTED}"),
        ({"friction": "coulomb per_lenght=3"}, f"friction.per_lenght is 3, of no known name. {LISTED}"),
        ({"friction": "coulomb per_length=3"}, "friction.per_length is 3, given twice. Give it next to the law or"),
        ({"friction": "coulomb presliding=1e-5 presliding=2e-5"}, "friction.presliding is 1e-5, given twice."),
        ({"friction": "karnop"}, f"friction is karnop, of no known name. {LISTED}"),
        ({"puncture.depth": None}, "puncture_depth.depth is missing or not a number of 0 to 0.5."),
        ({"cutting": None}, "cutting is left out, but force is given. Name the law."),
        (TIP_CONTACT, f"tip_contact.tip is missing. {LISTED}"),
        (
            TIP_CONTACT | {"stiffness.tip": "lancet_bevel half_angle=0.3 equivalence=none"},
            f"lancet_bevel.equivalence is none of the known readings of a bevel. {LISTED}",
        ),
        ({"layer2.top": "0.008"}, f"layer2.stiffness is missing. {LISTED}"),
        ({"layer3.top": "0.008"}, "layer2.top is left out. Number the layers without gaps."),
        ({"joint": "slyde"}, "joint is slyde, no such name in the model."),
        ({"site": "tip"}, "joint or site is both, not one of them."),
        ({"joint": None}, "joint or site is neither, not one of them."),
        ({"surface.normal": "0 0 1"}, "surface is a site or normal, not for a joint. Give surface.height"),
        ({"joint": None, "site": "tip", "surface.normal": "0 0 0"}, "surface.normal is 0 0 0, no direction."),
        ({"joint": None, "site": "tip", "surface.site": "tip"}, "surface.site is tip, on a body that moves."),
        ({"max_speed": "0"}, "max_speed is 0, not above 0 m/s."),
        ({"bevel.face_share": "1.5"}, "bevel.face_share is 1.5, outside 0 to 1."),
    ],
)
def test_what_is_wrong_with_an_attribute_is_said(mujoco, changes, said):
    with pytest.raises(ValueError) as refused:
        mujoco.MjModel.from_xml_string(on_slide(with_keys(changes)))
    assert f"needleforce.needle 'needle': {said}" in str(refused.value)


def test_layers_that_contradict_each_other_are_refused(mujoco):
    second = {f"layer2.{family}": PAPER[family] for family in ("stiffness", "puncture", "friction", "cutting")}
    second |= {
        "layer2.top": "0.001",
        "layer2.stiffness": "cone reduced_modulus=1e5 half_angle=0.3",
        "layer2.puncture": "puncture_depth depth=0.001",
        "layer2.friction": "coulomb per_length=3",
        "layer2.cutting": "constant_cutting force=0.1",
    }
    with pytest.raises(ValueError, match=r"layer2\.top is refused, the layer above punctures below this top"):
        mujoco.MjModel.from_xml_string(on_slide(with_keys(second)))


def test_unknown_attributes_are_refused(mujoco):
    with pytest.raises(ValueError, match="unrecognized attribute 'plugin:frictio'"):
        mujoco.MjModel.from_xml_string(on_slide(with_keys({"frictio": "coulomb"})))


@pytest.mark.parametrize(
    "place, said",
    [
        ({}, "joint or site is neither"),
        ({"joint": "slide", "site": "tip"}, "joint or site is both"),
        ({"joint": "nowhere"}, "joint is nowhere, not a name in the model"),
        ({"joint": "wrist"}, "joint is wrist, not a slide joint"),
        ({"joint": "z", "surface_site": "skin"}, "surface is a site or normal, not possible for a joint"),
        ({"site": "tip", "surface_site": "tip"}, "surface_site is tip, on a moving body"),
        ({"site": "tip", "surface_normal": (0, 0)}, "surface_normal is (0, 0), not a direction"),
        ({"joint": "z", "surface_height": float("nan")}, "surface_height is nan, not a finite number"),
        ({"site": "tip", "surface_height": "skin"}, "surface_height is 'skin', not a finite number"),
        ({"joint": "z", "max_speed": -1.0}, "max_speed is -1.0, outside"),
    ],
)
def test_what_is_wrong_with_an_argument_is_said(mujoco, place, said):
    m, _ = loaded(mujoco, on_arm())
    with pytest.raises(nf.InputError) as refused:
        attach(nf.preset("paper"), m, **place)
    assert said in str(refused.value)


def test_rk4_is_left_to_the_plugin(mujoco):
    m, d = loaded(mujoco, on_slide(integrator="RK4"))
    with pytest.raises(nf.InputError, match="integrator is RK4"):
        step(m, d, attach(nf.preset("paper"), m, joint="slide"))


def test_xml_of_what_has_no_model_is_refused():
    with pytest.raises(nf.InputError, match="without a model"):
        plugin_xml(None, joint="slide")
    with pytest.raises(nf.InputError, match="keyword is hinge, unknown"):
        plugin_xml(nf.preset("paper"), hinge="slide")


def test_without_mujoco_the_extra_is_named():
    code = "import sys; sys.modules['mujoco'] = None\nimport needleforce as nf\n"
    code += "from needleforce.mujoco import attach, plugin_xml\nplugin_xml(nf.preset('paper'), joint='slide')\n"
    code += "try: attach(nf.preset('paper'), None, joint='slide')\nexcept nf.InputError as error: print(error)"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert said == 'mujoco is not installed, it is needed here. Run pip install "needleforce[mujoco]".\n'
