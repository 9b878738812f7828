# SPDX-License-Identifier: Apache-2.0
"""Moduli from curves of blocks of known size, made on a finer mesh than that of the fit."""

import numpy as np
import pytest

import needleforce as nf
from needleforce import fe

RADIUS = 1e-3  # about that of the deepest contact
TIP = nf.tips.Sphere(radius=2 * RADIUS)
REACH = 1.8e-3
YOUNG, RATIO = 12.3e3, 0.45


def block(size, cell, materials=None, layers=(), base="fixed"):
    mesh = fe.axisymmetric_block(max(size, 20) * RADIUS, size * RADIUS, cell, layers=layers)
    held = {"bottom": base, "sides": "free" if base == "fixed" else "fixed"}
    return fe.Tissue(mesh, materials or fe.Elastic(10e3, RATIO), symmetry="axisymmetric", supports=held)


def curve(tissue, deepest=0.4e-3, noise=5e-3, seed=0):
    """Depth and force of an approach with free travel, a zero of its own, an offset and white noise."""
    solved = np.linspace(2e-5, deepest, 40)
    force = fe.press(tissue, TIP, solved, REACH).force
    depth = np.linspace(-0.5 * deepest, deepest, 1201)
    ideal = np.interp(depth, solved, force)
    near = depth < solved[0]
    ideal[near] = force[0] * (np.maximum(depth[near], 0.0) / solved[0]) ** 1.5
    white = np.random.default_rng(seed).normal(0.0, noise * force[-1], len(depth))
    return depth + 3e-3, ideal + white + 0.2 * force[-1]


@pytest.mark.parametrize("size", [3, 10, 20, 40])
def test_the_modulus_of_a_finite_block_is_found_with_its_geometry(size):
    depth, force = curve(block(size, 3e-5, fe.Elastic(YOUNG, RATIO)))
    found = fe.fit_modulus(block(size, 6e-5), TIP, depth, force, reach=REACH)
    assert found.young_modulus["tissue"] == pytest.approx(YOUNG, rel=0.015)
    assert found.contact_depth == pytest.approx(3e-3, abs=6e-6)
    # the half-space takes the base for a stiffer tissue, the more the thinner the block
    assert found.half_space_modulus > (1.0 + 0.5 / size) * YOUNG
    assert found.geometry_factor == pytest.approx(found.half_space_modulus / found.young_modulus["tissue"])
    assert found.solutions == 2


def test_a_half_space_is_within_a_twentieth_only_from_twenty_radii_on():
    factors = []
    for size in (3, 10, 40):
        depth, force = curve(block(size, 3e-5, fe.Elastic(YOUNG, RATIO)))
        factors.append(fe.fit_modulus(block(size, 6e-5), TIP, depth, force, reach=REACH).geometry_factor)
    assert factors[0] > 1.25 and 1.05 < factors[1] < 1.15 and 1.0 < factors[2] < 1.05


def test_the_wrong_base_gives_the_wrong_modulus():
    depth, force = curve(block(3, 3e-5, fe.Elastic(YOUNG, RATIO)))
    sliding = fe.fit_modulus(block(3, 6e-5, base="sliding"), TIP, depth, force, reach=REACH)
    assert sliding.young_modulus["tissue"] > 1.03 * YOUNG


def test_moduli_of_two_layers_are_found_with_intervals():
    layers, true = [("skin", 0.8e-3), ("fat", 1.0)], {"skin": 40e3, "fat": 8e3}
    tissue = block(20, 3e-5, {name: fe.Elastic(value, RATIO) for name, value in true.items()}, layers)
    start = block(20, 6e-5, {name: fe.Elastic(20e3, RATIO) for name in true}, layers)
    depth, force = curve(tissue, noise=2e-3)
    found = fe.fit_modulus(start, TIP, depth, force, reach=REACH, labels=("skin", "fat"))
    for name, value in true.items():
        assert found.young_modulus[name] == pytest.approx(value, rel=0.15)
        assert 0.93 * found.low[name] < value < 1.07 * found.high[name]
    one = fe.fit_modulus(start.with_materials({"skin": fe.Elastic(40e3, RATIO), "fat": fe.Elastic(20e3, RATIO)}),
                         TIP, depth, force, reach=REACH, labels=("fat",))  # fmt: skip
    assert one.young_modulus["fat"] == pytest.approx(8e3, rel=0.05)
    assert one.high["fat"] - one.low["fat"] < found.high["fat"] - found.low["fat"]


def test_curves_and_labels_that_do_not_fit_are_named():
    depth, force = curve(block(10, 6e-5))
    with pytest.raises(nf.InputError, match="label is skin"):
        fe.fit_modulus(block(10, 6e-5), TIP, depth, force, reach=REACH, labels=("skin",))
    with pytest.raises(nf.InputError, match="reach is"):
        fe.fit_modulus(block(10, 6e-5), TIP, depth, force, reach=0.5e-3)
    with pytest.raises(nf.InputError):
        fe.fit_modulus(block(10, 6e-5), TIP, depth, np.zeros_like(depth), reach=REACH)
