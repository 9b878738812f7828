# SPDX-License-Identifier: Apache-2.0
"""The function for Warp has the engine's numbers on the processor, in both precisions, and pushes in MuJoCo Warp. Too
heavy for every run: make test-hosts."""

import re
import subprocess
import sys

import numpy as np
import pytest
from case_rows import rigid, trace

import needleforce as nf

wp = pytest.importorskip("warp", reason="Warp is not installed: make test-hosts")
DT, N = 2e-3, 7


@pytest.fixture(scope="module")
def needles():
    from needleforce.simulators import warp

    wp.config.quiet = True
    return warp.Needles


def models():
    paper, layered = nf.preset("paper"), nf.preset("layered")
    deeper = layered.deeper[0]
    several = layered.replace(deeper=(deeper, deeper.replace(top=17e-3), deeper.replace(top=24e-3)))
    wide = paper.replace(friction=nf.laws.Coulomb(per_length=25.0, presliding=2e-3, dimple_ratio=0.7))
    return {
        "paper": paper,
        "wide": wide,
        "physical": nf.preset("physical"),
        "by_energy": nf.preset("paper_by_energy"),
        "pulled": paper.replace(cutting=nf.laws.NoCutting()),
        "layered": layered,
        "elastic": nf.Model(**dict(zip(("stiffness", "puncture", "friction", "cutting"), layered.layers[0].parts))),
        "four_layers": several,
    }


def motions(real):
    """In, at rest, out of the tissue and in again, each at its own speed, with leaps and what is no number."""
    speeds = np.repeat([8e-3, 0.0, -6e-3, 11e-3, -20e-3, 12e-3], 500)[:, None] * np.linspace(0.6, 1.6, N)
    depths = -1e-3 + np.cumsum(speeds, axis=0) * DT
    depths[700, 1], depths[1800, 2], depths[40, 3] = np.nan, 0.8, np.inf
    return depths.astype(np.float32).astype(float) if real is wp.float32 else depths


@pytest.mark.parametrize("real, tolerance", [(wp.float64, 1e-9), (wp.float32, 1e-5)], ids=["float64", "float32"])
@pytest.mark.parametrize("name", models())
def test_it_has_the_forces_of_the_engine(needles, name, real, tolerance):
    model, depths = models()[name], motions(real)
    expected = nf.InsertionBatch(model, N).run(depths, DT)
    many = needles(model, N, real=real)
    found = np.array([many.step(row, DT).numpy().copy() for row in depths])
    assert np.abs(expected).max() > 0.1 and np.any(expected < 0.0)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=tolerance * np.abs(expected).max())
    many.reset()
    assert np.all(many.step(depths[0], DT).numpy() == found[0]) and not many.status.any()


CASES = ("bad_numbers", "dragged", "paper", "physical")  # the others have laws that Warp has not


class Recorded(trace.Case):
    """A case whose steps go through the engine and through Warp, both at depths and times that the precision holds."""

    needles, real = None, wp.float64

    def engine(self, model, limits, bevel):
        self.model, self.rows = model, []
        self.warp = self.needles(model, 1, real=self.real, max_speed=limits.get("max_speed", 1.0))
        return nf.Insertion(model, **{name: value for name, value in limits.items() if name != "hold_time"})

    def advance(self, depth, velocity, dt):
        if self.real is wp.float32:
            with np.errstate(over="ignore", under="ignore"):
                depth, dt = float(np.float32(depth)), float(np.float32(dt))
        force = float(self.warp.step([depth], dt).numpy()[0])
        self.rows.append((self.insertion.step(depth, None, dt).force, force))


@pytest.mark.parametrize("real, tolerance", [(wp.float64, 1e-9), (wp.float32, 1e-5)], ids=["float64", "float32"])
def test_the_cases_of_the_conformance_set(needles, real, tolerance):
    for path in rigid():
        if path.stem in CASES:
            case = trace.traced(path, type("Case", (Recorded,), {"needles": needles, "real": real}))
            rows = np.array(case.rows)
            error = np.abs(rows[:, 0] - rows[:, 1])
            assert len(rows) > 300 and error.max() <= tolerance * np.abs(rows).max(), path.stem


def test_a_first_step_behind_the_puncture_frees_nothing(needles):
    first, trembling = np.linspace(0.0, 12e-3, N), 8e-6 * np.sin(np.arange(200))
    motion = np.concatenate([np.zeros(20), trembling, 3e-5 * np.arange(200)])
    for model in (nf.preset("paper"), nf.preset("physical"), nf.preset("layered")):
        depths, many = first + motion[:, None], needles(model, N)
        found = np.array([many.step(row, DT).numpy().copy() for row in depths])
        expected = nf.InsertionBatch(model, N).run(depths, DT)
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9 * np.abs(expected).max())


def test_a_model_for_each_and_what_is_refused(needles):
    three = [nf.preset("paper"), nf.preset("layered"), nf.preset("physical")]
    depths = motions(wp.float64)[:1500, [0, 4, 5]]
    many = needles(three)
    found = np.array([many.step(row, DT).numpy().copy() for row in depths])
    np.testing.assert_allclose(found, nf.InsertionBatch(three).run(depths, DT), rtol=0.0, atol=1e-9)
    assert len(needles(three[0], 0).step(np.zeros(0), DT)) == 0
    moves = [([0.0, 1e-3, 2e-3], DT), ([1e-3, np.nan, 0.9], DT), (1e-3, 0.0), (1e-3, np.nan), (1e-3, 1.0), (1e-3, DT)]
    batch, many = nf.InsertionBatch(three, max_speed=0.5), needles(three, max_speed=0.5)
    for depth, dt in moves:
        many.step(depth, dt)
        assert many.status.tolist() == batch.step(depth, None, dt).status.tolist(), (depth, dt)
    for wrong, words in (
        (lambda: needles(nf.preset("lugre"), 2), "lugre.*InsertionBatch, which has every law"),
        (lambda: needles(three, 2), "not the number of models, 3"),
        (lambda: needles("paper", 2), "model 0"),
        (lambda: needles([]), "at least one model"),
        (lambda: needles(three[0], 1.5), "n is 1.5, not a whole number"),
        (lambda: needles(three[0], 2, real=float), "real is .*float.*Give warp.float64"),
        (lambda: needles(three[0], 2, device="cuda:99"), "device is 'cuda:99', no device that Warp finds here.*cpu"),
        (lambda: many.step(np.zeros(2), DT), "the shape of depths"),
        (lambda: many.step(["a", "b", "c"], DT), "depths is .*not real numbers"),
        (lambda: many.step(wp.zeros(3, dtype=wp.float32), DT), "not float64 .3,.. Give an array of Warp like force"),
        (lambda: many.step(np.zeros(3), [DT] * 3), "the shape of dt is .3,., not one number"),
        (lambda: many.step(np.zeros(3), None), "dt is None, not real numbers"),
        (lambda: needles(three, max_speed=0.0), "max_speed"),
    ):
        with pytest.raises(nf.InputError, match=words):
            wrong()


def test_the_example_in_mujoco_warp(root, tmp_path):
    """At rest the tissue carries the weight and the servo's spring: 50 g, 2000 N/m."""
    pytest.importorskip("mujoco_warp", reason="MuJoCo Warp is not installed: make test-hosts")
    done = subprocess.run(
        [sys.executable, root / "examples" / "needles_in_warp.py"], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    depth, force = map(float, re.search(r"paper: ([\d.]+) mm deep, ([\d.]+) N", done.stdout).groups())
    assert 19.0 < depth < 20.1 and force == pytest.approx(0.05 * 9.81 + 2000.0 * (20e-3 - 1e-3 * depth), abs=1.5e-3)
