# SPDX-License-Identifier: Apache-2.0
"""A condensed solid that relaxes: closed forms, an own solution with the whole history of forces, energy."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import lsq_linear

import needleforce as nf
from needleforce import fe

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from closed_motions_in_solid import drawn_depth, drawn_in_solid, rigid

SPACING, NODES, IN_PATH = 1e-3, 31, 20.4e-3  # [m]; a first step there finds the needle in its path
SHARES, TIMES = np.array([0.3, 0.2]), np.array([0.5, 5.0])
PRONY = nf.laws.Prony(share_1=0.3, time_1=0.5, share_2=0.2, time_2=5.0)
APART = np.abs(np.subtract.outer(np.arange(NODES), np.arange(NODES)))
GEL = fe.CondensedTissue(SPACING, 2e-3 * (0.7 * np.exp(-0.4 * APART) + 0.3 * np.exp(-0.05 * APART)))


def model(friction, *, cutting=0.3, presliding=1e-9, puncture=0.0, relaxation=PRONY):
    return nf.Model(
        nf.laws.Polynomial(linear=100.0, quadratic=0.0), nf.laws.PunctureForce(force=puncture),
        nf.laws.Coulomb(per_length=friction, presliding=presliding), nf.laws.ConstantCutting(force=cutting),
        relaxation=relaxation,
    )  # fmt: skip


def relaxed(times):
    """Share of the force that is left after times of a hold."""
    return 1.0 - SHARES @ (1.0 - np.exp(-np.divide.outer(times, TIMES).T))


def pushed(insertion, depth, travel=30e-6):
    """The force after a travel in next to no time, from within the path, in which shaft and tip stick."""
    insertion.step(depth, None, 1.0)
    for share in np.linspace(0.0, 1.0, 301):
        insertion.step(depth + share * travel, None, 1e-6)
    for _ in range(100):
        found = insertion.step(depth + travel, None, 1e-9).force
    return found


@pytest.mark.parametrize("depth", [20e-3, IN_PATH])
@pytest.mark.parametrize("dt", [1e-3, 0.5])
def test_a_hold_in_which_everything_sticks_relaxes_as_the_series_says(depth, dt):
    insertion = fe.CondensedInsertion(GEL, model(50.0))
    first = pushed(insertion, depth)
    times = dt * np.arange(1, int(8.0 / dt) + 1)
    forces = insertion.run(np.full(len(times), depth + 30e-6), np.full(len(times), dt))["force"]
    np.testing.assert_allclose(forces / first, relaxed(times), atol=1e-4)


@pytest.mark.parametrize("dt", [1e-3, 1.0])
def test_a_slow_push_has_the_integral_of_what_has_relaxed_at_any_step(dt):
    elastic = fe.CondensedInsertion(GEL, model(500.0, cutting=5.0, relaxation=nf.laws.NoRelaxation()))
    stiffness = pushed(elastic, IN_PATH) / 30e-6
    insertion, speed, end = fe.CondensedInsertion(GEL, model(500.0, cutting=5.0)), 20e-6, 10.0
    insertion.step(IN_PATH, None, 1.0)
    depth = IN_PATH + speed * np.linspace(0.0, end, round(end / dt) + 1)[1:]
    insertion.run(depth, np.full(len(depth), dt))
    found = insertion.run(np.full(100, depth[-1]), np.full(100, 1e-9))["force"][-1]
    exact = stiffness * speed * (0.5 * end + SHARES @ (TIMES * (1.0 - np.exp(-end / TIMES))))
    assert found == pytest.approx(exact, rel=5e-3)


def test_a_hold_before_the_puncture_relaxes_as_in_the_axial_law():
    laws = model(20.0, puncture=0.2)
    engines = nf.Insertion(laws), fe.CondensedInsertion(GEL, laws)
    depth = np.concatenate([np.linspace(-1e-3, 1e-3, 400), np.full(600, 1e-3)])
    axial, solid = ([each.step(float(z), None, 5e-3).force for z in depth] for each in engines)
    np.testing.assert_allclose(solid, axial, atol=1e-6)
    assert solid[-1] == pytest.approx(0.1 * relaxed(4.0), rel=0.1)


def creep(time, share, tau):
    """Displacement for a unit force that stays, over that at once."""
    return (1.0 - share * np.exp(-(1.0 - share) * time / tau)) / (1.0 - share)


def own_solution(depth, dt, share, tau, friction, presliding):
    """Force by depth of a needle that moves within its path: displacements from the whole history of forces, which
    come in the middle of each step, and friction by bounded least squares."""
    tip, anchor, before = depth[0], np.full(NODES, depth[0]), np.zeros(NODES)
    changes, forces = [], []
    for now in depth[1:]:
        ages = dt * (np.arange(len(changes), 0, -1) + 0.5)
        history = creep(ages, share, tau) @ np.array(changes).reshape(-1, NODES)
        fresh, displaced = creep(0.5 * dt, share, tau), GEL.compliance @ history
        for _ in range(6):
            covered = np.clip(tip - SPACING * np.arange(NODES), 0.0, SPACING)
            far = 0.5 * covered**2 / SPACING
            length = covered - far
            length[1:] += far[:-1]
            used = length > 1e-12
            own = np.where(used, presliding / (friction * np.maximum(length, 1e-12)), 0.0)
            left = fresh * GEL.compliance[np.ix_(used, used)] + np.diag(own[used])
            right = (now - anchor - displaced + fresh * GEL.compliance @ before)[used]
            root = np.linalg.cholesky(left)
            most = friction * length[used]
            solved = lsq_linear(root.T, np.linalg.solve(root, right), (-most, most), method="bvls", tol=1e-14)
            force = np.zeros(NODES)
            force[used] = solved.x
            moved = displaced + fresh * GEL.compliance @ (force - before)
            tip = float(np.clip(now - np.interp(tip, SPACING * np.arange(NODES), moved), 0.0, depth[0]))
        slides = np.abs(force) >= friction * length * (1.0 - 1e-9)
        anchor = np.where(slides, now - moved - own * force, anchor)
        changes.append(force - before)
        before = force
        forces.append(force.sum())
    return np.array(forces)


def in_path(times):
    """Depth by time within the path: out, a hold, in, a hold."""
    return IN_PATH + np.interp(times, [0.0, 0.5, 0.8, 1.1, 1.4], [0.0, -0.5e-3, -0.5e-3, -0.2e-3, -0.2e-3])


def test_a_shaft_that_slides_and_rests_agrees_with_an_own_solution_at_any_step():
    prony = nf.laws.Prony(share_1=0.5, time_1=0.2)
    own = own_solution(in_path(np.linspace(0.0, 1.4, 141)), 0.01, 0.5, 0.2, 20.0, 1e-6)[9::10]
    for count in (140, 560, 7000):
        insertion = fe.CondensedInsertion(GEL, model(20.0, cutting=0.0, presliding=1e-6, relaxation=prony))
        insertion.step(IN_PATH, None, 1.0)
        times = np.linspace(0.0, 1.4, count + 1)[1:]
        found = insertion.run(in_path(times), np.full(count, 1.4 / count))["force"][count // 14 - 1 :: count // 14]
        assert np.abs(found - own).max() < 5e-3 * np.abs(own).max()


def test_no_motion_in_a_solid_that_relaxes_gains_energy(many):
    shares = []
    for seed in range(many(100, 2000)):
        insertion, _, rng = drawn_in_solid(seed, relaxes=True)
        shares.append(rigid(insertion, *drawn_depth(rng, insertion)).share)
    assert min(shares) >= -1e-6


def test_a_closed_motion_dissipates_where_an_elastic_one_does_not():
    turns = np.concatenate([np.linspace(0.0, 30e-6, 300), np.linspace(30e-6, -30e-6, 600), np.linspace(-30e-6, 0, 300)])
    depth = np.concatenate([[IN_PATH], IN_PATH + turns, np.full(5000, IN_PATH)])
    found = []
    for relaxation in (nf.laws.NoRelaxation(), PRONY):
        insertion = fe.CondensedInsertion(GEL, model(500.0, cutting=5.0, relaxation=relaxation))
        found.append(rigid(insertion, depth, np.full(len(depth), 2e-3)))
    assert abs(found[0].end) < 1e-3 * found[0].turned and found[1].end > 0.1 * found[1].turned
    assert found[1].least >= 0.0


def test_what_relaxes_otherwise_is_refused():
    at_rest = nf.laws.PronyAtRest(share_1=0.5, time_1=1.0)
    with pytest.raises(nf.InputError, match="relaxes otherwise than by prony"):
        fe.CondensedInsertion(GEL, model(20.0, relaxation=at_rest))
    upper = model(20.0)
    elastic = nf.Layer(10e-3, upper.stiffness, upper.puncture, upper.friction, upper.cutting)
    with pytest.raises(nf.InputError, match="do not all relax alike"):
        fe.CondensedInsertion(GEL, replace(upper, deeper=(elastic,)))
    alike = replace(elastic, relaxation=PRONY)
    assert fe.CondensedInsertion(GEL, replace(upper, deeper=(alike,))).step(5e-3, None, 1.0).status == "ok"


def test_saved_bytes_go_on_as_the_insertion_does():
    one, other = (fe.CondensedInsertion(GEL, model(20.0)) for _ in range(2))
    depth = np.linspace(-1e-3, 15e-3, 3000)
    one.run(depth, np.full(3000, 1e-3))
    other.restore(one.save())
    held = [each.run(np.full(500, 15e-3), np.full(500, 0.01))["force"] for each in (one, other)]
    np.testing.assert_array_equal(*held)
    assert held[0][-1] < 0.8 * held[0][0]
