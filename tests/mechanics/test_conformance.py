# SPDX-License-Identifier: Apache-2.0
"""The same trace from C++ and from Python."""

import subprocess

import numpy as np
import pytest

import needleforce as nf
from needleforce.layer import Layer


@pytest.fixture(scope="module")
def binary(root, tmp_path_factory):
    """The C++ trace, compiled as a user would compile it."""
    path = tmp_path_factory.mktemp("trace") / "trace"
    source = root / "tests" / "cpp" / "trace.cpp"
    subprocess.run(["g++", "-std=c++20", "-O2", f"-I{root / 'include'}", source, "-o", path], check=True)
    return path


def physical():
    return nf.preset("physical").replace(
        stiffness=nf.laws.ConeCylinder(154666.55782265437, 0.2617993877991494, 0.00035),
        puncture=nf.laws.PunctureForce(0.2),
        friction=nf.laws.Coulomb(18.6, dimple_ratio=0.25),
    )


def layered():
    laws = nf.laws
    contact = laws.ConeCylinder(154666.55782265437, 0.2617993877991494, 0.00035)
    fading = laws.Prony(0.31, 0.7, 0.26, 5.0)
    bristles = laws.Lugre(
        bristle_stiffness=1e6, bristle_damping=100.0, viscous=200.0, coulomb=18.0, static_friction=25.0
    )
    crack = laws.StickSlip(0.1, 0.04, 1.5e-3, 25.07, 200.0)
    shaft, cut = laws.Coulomb(30.0, 20e-6, 0.0), laws.ConstantCutting(0.12, 20e-6)
    deeper = Layer(5e-3, contact, laws.PunctureDepth(1e-3), shaft, cut, fading)
    return nf.Model(contact, laws.PunctureForce(0.15), bristles, crack, relaxation=fading, deeper=(deeper,))


@pytest.mark.parametrize(("name", "make"), [("physical", physical), ("layered", layered)])
def test_cpp_and_python_agree(binary, name, make):
    random = np.random.default_rng(0)
    strokes = [np.linspace(-1e-3, 6e-3, 700), np.linspace(6e-3, 5.9e-3, 50), np.linspace(5.9e-3, 9e-3, 300)]
    strokes += [9e-3 + 2e-6 * random.standard_normal(100), np.linspace(9e-3, -1e-3, 800), np.linspace(-1e-3, 1e-2, 900)]
    depth = np.concatenate(strokes)
    text = "\n".join(repr(float(z)) for z in depth)
    asked = [binary, *(["layered"] if name == "layered" else [])]
    out = subprocess.run(asked, input=text, capture_output=True, text=True, check=True).stdout
    traced = np.array([line.split() for line in out.splitlines()], float)
    model = make()
    insertion = nf.Insertion(model)
    samples = [insertion.step(z, None, 1e-3) for z in depth]
    ours = np.array([[s.force, s.stiffness, s.friction, s.cutting, s.force_by_depth] for s in samples])
    np.testing.assert_array_max_ulp(ours, traced, maxulp=4)
    run = nf.Insertion(model).run(depth, None, np.full(len(depth), 1e-3))
    np.testing.assert_array_equal(run["force"], ours[:, 0])
