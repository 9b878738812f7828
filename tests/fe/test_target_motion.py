# SPDX-License-Identifier: Apache-2.0
"""Targets that move with the tissue, and entries planned to meet them: in the plane, on an axis, in space."""

import numpy as np
import pytest

import needleforce as nf
from needleforce import fe
from needleforce.fe.moving.dynamic_insertion import DynamicInsertion, stroke
from needleforce.fe.moving.dynamics import Rayleigh
from needleforce.fe.moving.target_motion import plan_entry
from needleforce.fe.moving.tissue_dynamics import ReducedTissue, TissueDynamics

PATH = fe.NeedlePath(24e-3, 2e-3, 0.5e-3)
MOTION = {"speed": 0.05, "hold": 0.1}


def plane(young=20e3, side=1.0):
    """A block whose left half may be softer, so that a target next to the needle moves sideways."""
    mesh = fe.block((50e-3, 36e-3), 2.5e-3, needle_depth=20e-3).labelled("left", lambda at: at[:, 0] < 0.0)
    materials = {"tissue": fe.Elastic(young, 0.45), "left": fe.Elastic(side * young, 0.45)}
    tissue = fe.Tissue(mesh, materials, symmetry="plane_strain", thickness=20e-3)
    return TissueDynamics(tissue, Rayleigh(2.0, 2e-4))


def needle(model, cutting=0.4, friction=30.0, path=PATH):
    return DynamicInsertion(model, path, friction=friction, cutting=cutting, dt=2e-3)


PLANE = plane(side=0.3)


def miss(model, target, entry, depth):
    """Of a new insertion, from the tip to the target [m]."""
    path = fe.NeedlePath(PATH.depth, PATH.spacing, PATH.radius, entry=(float(entry),))
    run = needle(model, path=path).run(stroke(depth, 0.05, 2e-3, hold=0.1), targets=[target])
    return run.targets[-1, 0] - [entry, depth]


@pytest.mark.parametrize("target", [(0.0, 18e-3), (-4e-3, 16e-3), (6e-3, 12e-3)])
def test_a_planned_needle_meets_the_target_where_it_moved(target):
    plan = plan_entry(needle(PLANE), target, **MOTION)
    unplanned = np.linalg.norm(miss(PLANE, target, *target))
    planned = np.linalg.norm(miss(PLANE, target, plan.entry[0], plan.depth))
    assert plan.reached and plan.distance == pytest.approx(planned, rel=1e-6) and plan.runs < 8
    assert unplanned > 0.5e-3 and planned < 2e-5
    assert plan.depth > target[1]  # tissue is pushed inwards
    np.testing.assert_allclose(plan.target - plan.miss, [plan.entry[0], plan.depth], atol=1e-12)


def test_in_stiff_tissue_the_target_stays_where_it_is():
    plan = plan_entry(needle(plane(young=20e6)), (3e-3, 15e-3), **MOTION)
    np.testing.assert_allclose([*plan.entry, plan.depth], [3e-3, 15e-3], atol=2e-5)


def test_what_is_not_adjusted_stays_and_its_miss_is_reported():
    target = (3e-3, 15e-3)
    depth = plan_entry(needle(PLANE), target, adjust=("depth",), **MOTION)
    assert depth.reached and depth.entry[0] == 0.0 and abs(depth.miss[1]) < 2e-5 and depth.miss[0] > 2e-3
    entry = plan_entry(needle(PLANE), target, adjust=("entry",), **MOTION)
    assert entry.reached and entry.depth == 15e-3 and abs(entry.miss[0]) < 2e-5 and entry.miss[1] > 0.3e-3


def test_a_plan_that_ends_early_reports_its_miss():
    plan = plan_entry(needle(PLANE), (3e-3, 15e-3), max_runs=1, **MOTION)
    assert not plan.reached and plan.runs == 1 and plan.distance > 0.5e-3


def test_a_reduced_model_plans_the_depth():
    target = (0.0, 15e-3)
    reduced = ReducedTissue(PLANE, PATH, 40)
    one, other = (plan_entry(needle(each), target, adjust=("depth",), **MOTION) for each in (PLANE, reduced))
    assert other.depth == pytest.approx(one.depth, abs=4e-5)
    with pytest.raises(nf.InputError, match="path is another, than the one of the reduced model"):
        plan_entry(needle(reduced), (3e-3, 15e-3), **MOTION)


def test_on_an_axis_the_depth_is_planned():
    mesh = fe.axisymmetric_block(30e-3, 30e-3, 2e-3, needle_depth=20e-3)
    model = TissueDynamics(fe.Tissue(mesh, fe.Elastic(20e3, 0.45), symmetry="axisymmetric"), Rayleigh(2.0, 2e-4))
    plan = plan_entry(needle(model, cutting=0.1), (0.0, 15e-3), adjust=("depth",), **MOTION)
    assert plan.reached and plan.depth > 15.3e-3
    with pytest.raises(nf.InputError, match="entry is fixed, on the axis of an axisymmetric mesh"):
        plan_entry(needle(model), (0.0, 15e-3), **MOTION)


def test_in_space_both_coordinates_of_the_entry_are_planned():
    mesh = fe.block((24e-3, 24e-3, 20e-3), 3e-3, needle_depth=12e-3, growth=0.5)
    model = TissueDynamics(fe.Tissue(mesh, fe.Elastic(20e3, 0.45)), Rayleigh(2.0, 2e-4))
    path = fe.NeedlePath(16e-3, 4e-3, 0.5e-3, entry=(0.0, 0.0))
    target = np.array([2e-3, -3e-3, 10e-3])
    plan = plan_entry(needle(model, cutting=0.1, path=path), target, speed=0.1, hold=0.05)
    assert plan.reached and plan.entry.shape == (2,)
    assert np.linalg.norm(plan.target - target) > 0.3e-3 and plan.distance < 3e-5


@pytest.mark.parametrize(
    "target, options, words",
    [
        ((3e-3, 50e-3), {}, r"point is \(3, 50\) mm, is outside the mesh"),
        ((3e-3, 15e-3), {"adjust": ("speed",)}, r"adjust is \['speed'\], must be entry or depth, or both"),
        ((3e-3, 15e-3), {"adjust": ()}, "adjust is"),
        ((3e-3, 30e-3), {}, "must be finite and at most 24 mm, the end of the path"),
        ((np.nan, 15e-3), {}, "point is .*nan"),
        ((3e-3, 15e-3), {"speed": 0.0}, "speed is 0.0, must be above 0"),
    ],
)
def test_targets_and_options_that_do_not_fit_are_named(target, options, words):
    with pytest.raises(nf.InputError, match=words):
        plan_entry(needle(PLANE), target, **(MOTION | options))
