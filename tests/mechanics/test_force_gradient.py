# SPDX-License-Identifier: Apache-2.0
"""Derivatives of the force: closed forms, differences of the plain step, and where events move."""

import dataclasses
import re

import numpy as np
import pytest

import needleforce as nf

FAMILIES = ("stiffness", "puncture", "friction", "cutting", "relaxation")
# a first contact, a puncture, a reversal, a return, a hold, and out
CORNERS = [(0.0, -1.1e-3), (1.0, 10.3e-3), (1.2, 8.1e-3), (1.5, 12.7e-3), (2.0, 12.7e-3), (3.5, -1.3e-3)]
TIME = np.arange(0.0, 3.5, 1e-3)
DEPTH = np.interp(TIME, *zip(*CORNERS))
STEPS = np.diff(TIME, prepend=TIME[0] - (TIME[1] - TIME[0]))


def changed(model, name, value):
    """The model with one parameter changed."""
    number, rest = re.fullmatch(r"(?:layer (\d+) )?(.*)", name).groups()
    layer = model.layers[int(number or 1) - 1]
    if rest == "top":
        new = layer.replace(top=value)
    else:
        family, parameter = rest.split(".")
        new = layer.replace(**{family: getattr(layer, family).replace(**{parameter: value})})
    if number in (None, "1"):
        return model.replace(**{family: getattr(new, family) for family in FAMILIES})
    deeper = list(model.deeper)
    deeper[int(number) - 2] = new
    return model.replace(deeper=tuple(deeper))


def value_of(model, name):
    number, rest = re.fullmatch(r"(?:layer (\d+) )?(.*)", name).groups()
    layer = model.layers[int(number or 1) - 1]
    return layer.top if rest == "top" else getattr(getattr(layer, rest.split(".")[0]), rest.split(".")[1])


def at_the_end_of_its_range(model, name):
    """True where differences on both sides are not possible."""
    value = value_of(model, name)
    try:
        return value == 0.0 or not all(changed(model, name, (1.0 + k) * value) for k in (-3e-4, 3e-4))
    except nf.InputError:
        return True


def forces(model):
    return nf.Insertion(model, max_speed=np.inf).forces(DEPTH, STEPS)


def differences(model, name):
    """Central differences of the plain step, of the sixth order; and where two orders agree, so that no event lies
    between the runs."""
    value = value_of(model, name)
    h = 1e-4 * abs(value)
    f = {k: forces(changed(model, name, value + k * h)) for k in (-3, -2, -1, 1, 2, 3)}
    first, second, third = (f[k] - f[-k] for k in (1, 2, 3))
    sixth = (45.0 * first - 9.0 * second + third) / (60.0 * h)
    fourth = (8.0 * first - second) / (12.0 * h)
    scale = np.abs(sixth[np.abs(sixth - fourth) < 1e-9 * np.abs(sixth).max()]).max(initial=0.0)
    return sixth, np.abs(sixth - fourth) <= 1e-8 * scale, scale


def test_closed_forms_of_the_papers_law():
    model = nf.preset("paper")
    found = model.force_gradient(DEPTH[:1140], TIME[:1140])
    modulus, angle = model.stiffness.reduced_modulus, model.stiffness.half_angle
    before = (DEPTH[:1140] > 0.0) & (DEPTH[:1140] <= model.puncture_depth)
    square = 2.0 / np.pi * DEPTH[:1140][before] ** 2
    np.testing.assert_allclose(found.column("stiffness.reduced_modulus")[before], square * np.tan(angle), rtol=1e-13)
    steep = square * modulus / np.cos(angle) ** 2
    np.testing.assert_allclose(found.column("stiffness.half_angle")[before], steep, rtol=1e-13)
    inside = slice(600, 1000)
    length = DEPTH[inside] - model.friction.dimple_ratio * model.puncture_depth
    np.testing.assert_allclose(found.column("friction.per_length")[inside], length, rtol=1e-13)
    np.testing.assert_allclose(found.column("cutting.force")[inside], 1.0, rtol=1e-13)
    dimple = -model.friction.per_length * model.puncture_depth
    np.testing.assert_allclose(found.column("friction.dimple_ratio")[inside], dimple, rtol=1e-13)
    np.testing.assert_array_equal(found.force, forces(model)[:1140])


@pytest.mark.parametrize("name", nf.presets())
def test_every_law_agrees_with_differences_away_from_jumps(name):
    model = nf.preset(name)
    found = model.force_gradient(DEPTH, TIME)
    plain = forces(model)
    np.testing.assert_array_equal(found.force, plain)
    # differences make the rounding of stribeck_cutting's iteration larger: docs/evidence/gradients.md
    least = 1e-5 if name == "stribeck" else 1e-6
    for parameter in found.by:
        if at_the_end_of_its_range(model, parameter):
            continue
        expected, smooth, scale = differences(model, parameter)
        error = np.abs(found.column(parameter) - expected)[smooth].max(initial=0.0)
        assert error <= least * scale or scale == 0.0, (parameter, error, scale)
        assert smooth.sum() > 1000, (parameter, smooth.sum())


def test_a_puncture_moves_with_what_it_depends_on():
    for name, law in (("paper_by_force", 1.0 / 2.0), ("paper_by_energy", 1.0 / 3.0)):
        model = nf.preset(name)
        found = model.force_gradient(DEPTH, TIME)
        (event,) = [each for each in found.events if each.kind == "puncture"]
        depth, modulus = model.puncture_depth, model.stiffness.reduced_modulus
        assert event.depth == depth and DEPTH[event.index - 1] <= depth < DEPTH[event.index]
        by = dict(zip(found.by, event.d_depth))
        # F_p = c E h^2, or U_p = c E h^3 / 3
        assert by["stiffness.reduced_modulus"] == pytest.approx(-law * depth / modulus, rel=1e-9)
        peak = model.stiffness.reduced_modulus * 2.0 / np.pi * np.tan(model.stiffness.half_angle) * depth**2
        assert event.jump == pytest.approx(model.cutting.force + model.friction.per_length * depth - peak, rel=1e-4)


def test_a_relaxing_puncture_moves_as_two_runs_show():
    model = nf.preset("relaxing").replace(puncture=nf.laws.PunctureForce(force=0.5))
    fine = np.linspace(-1e-3, 12e-3, 40001)
    time = np.arange(len(fine)) * 1e-4

    def depth_of(modulus):
        other = changed(model, "stiffness.reduced_modulus", modulus)
        insertion = nf.Insertion(other, max_speed=np.inf)
        return next(depth for depth in fine if insertion.step(depth, None, 1e-4).punctured)

    modulus = model.stiffness.reduced_modulus
    shift = (depth_of(1.05 * modulus) - depth_of(0.95 * modulus)) / (0.1 * modulus)
    found = model.force_gradient(fine, time, by="stiffness.reduced_modulus")
    (event,) = [each for each in found.events if each.kind == "puncture"]
    assert event.d_depth[0] == pytest.approx(shift, rel=5e-3)


def test_slip_begins_twice_the_presliding_behind_a_reversal():
    model = nf.preset("paper")
    found = model.force_gradient(DEPTH, TIME, by=["friction.presliding", "friction.per_length"])
    turn, slip = [each for each in found.events if each.index >= 1000][:2]
    assert (turn.kind, slip.kind) == ("reversal", "slip")
    assert turn.depth == DEPTH[1000] and not turn.d_depth.any()
    assert slip.depth == pytest.approx(turn.depth - 2.0 * model.friction.presliding, rel=1e-12)
    np.testing.assert_allclose(slip.d_depth, [-2.0, 0.0], atol=1e-12)


def test_a_parameter_asked_for_twice_has_its_column_twice():
    found = nf.preset("paper").force_gradient(DEPTH, TIME, by=["cutting.force", "friction.per_length", "cutting.force"])
    np.testing.assert_array_equal(found.gradient[:, 2], found.gradient[:, 0])
    assert found.gradient[:, 2].max() == pytest.approx(1.0)  # the force itself, while cutting


def test_what_a_law_does_not_have_is_refused_with_what_it_has():
    model = nf.preset("paper")
    with pytest.raises(nf.InputError, match=r"friction\.per_length.*cutting\.force"):
        model.force_gradient(DEPTH, TIME, by="friction.viscous")
    with pytest.raises(nf.InputError, match=r"a tip, .*two models"):
        model.force_gradient(DEPTH, TIME, by="tip.half_angle")
    with pytest.raises(nf.InputError, match="by is 5, no parameter"):
        model.force_gradient(DEPTH, TIME, by=5)
    for depth, time, quantity in (
        (DEPTH[:3], TIME[:4], "shapes"),
        ([0.0, np.nan], [0.0, 1.0], r"depth\[1\]"),
        ([0.0, 2.0], [0.0, 1.0], r"depth\[1\]"),
        ([0.0, 1e-3], [1.0, 1.0], r"time\[1\]"),
        ([0.0, 1e-3], [0.0, np.inf], r"time\[1\]"),
        ([], [], "shapes"),
        ([[0.0, 1e-3], [0.0]], [0.0, 1.0], "depth is list"),
        (DEPTH, "later", "time is str"),
    ):
        with pytest.raises(nf.InputError, match=quantity):
            model.force_gradient(depth, time)
    assert dataclasses.is_dataclass(model.force_gradient(DEPTH, TIME, by=()))
