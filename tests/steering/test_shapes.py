# SPDX-License-Identifier: Apache-2.0
"""Shapes: from base and tip alone, identified from shapes, and on fibre gratings and cameras."""

import math

import numpy as np
import pytest

import needleforce as nf
from needleforce.steering import NeedleShape, identify, needle_shape, read_shapes

NEEDLE = nf.Needle(1.27e-3, 0.0, 0.165, 200e9, 0.3)


def pushed(depth, *, modulus=2e4, force=0.2, roll=0.3, guide=0.0):
    flex = nf.FlexibleInsertion(
        None, NEEDLE, lateral=[nf.LateralLayer(modulus=modulus, tip_force=force)], guide_distance=guide, elements=80,
        bevel_length=2.0 * NEEDLE.outer_diameter, max_speed=math.inf, max_travel=0.3,
    )  # fmt: skip
    flex.run(np.array([0.0, depth]), roll=roll)
    points = flex.shape()
    return points[points[:, 2] >= -1e-9]


@pytest.mark.parametrize("depth", [0.03, 0.12])
def test_shape_between_base_and_tip_is_that_of_the_needle(depth):
    points = pushed(depth)
    found = needle_shape(NEEDLE, 2e4, points[-1])
    np.testing.assert_allclose(found[-1], points[-1], atol=1e-7)
    across = np.column_stack([np.interp(points[:, 2], found[:, 2], column) for column in found[:, :2].T])
    np.testing.assert_allclose(across, points[:, :2], atol=2e-6)


def test_shape_follows_the_slope_of_its_base():
    found = needle_shape(NEEDLE, 2e4, (5e-3, 0.0, 0.1), slope=(0.05, 0.0))
    assert np.abs(found[:, 0] - 0.05 * found[:, 2]).max() < 5e-5  # straight on: no force is needed


def test_curvature_is_identified_better_than_modulus_and_force():
    rng = np.random.default_rng(1)
    shapes = []
    for number, depth in enumerate((0.06, 0.08, 0.1, 0.12)):
        points = pushed(depth, roll=0.9 * number, guide=0.02)
        points = points + rng.normal(0.0, 1e-4, points.shape) * [1.0, 1.0, 0.0]
        shapes.append(NeedleShape(str(number), depth, points))
    fit = identify(shapes, NEEDLE)
    found = {each.name: each for each in fit.parameters}
    assert found["modulus"].low < 2e4 < found["modulus"].high and found["tip_force"].low < 0.2 < found["tip_force"].high
    curvature = nf.steady_curvature(NEEDLE.bending_stiffness, found["modulus"].value, found["tip_force"].value)
    assert curvature == pytest.approx(nf.steady_curvature(NEEDLE.bending_stiffness, 2e4, 0.2), rel=0.1)
    # of which most is the slope of the base, from noisy points
    assert np.median(list(fit.rms.values())) < 0.3e-3


def written(path, points, depth):
    rows = [f"1,{1e3 * depth:g}," + ",".join(f"{1e3 * value:.6g}" for value in point) for point in points]
    path.write_text("\n".join(["hole,depth_mm,x_mm,y_mm,z_mm", *rows]) + "\n", encoding="utf-8")
    return path


def test_axis_of_a_table_may_point_outwards_but_counts_from_the_surface(tmp_path):
    points = pushed(0.1)
    inwards = read_shapes(written(tmp_path / "in.csv", points, 0.1))[0]
    outwards = read_shapes(written(tmp_path / "out.csv", points * [1.0, 1.0, -1.0], 0.1))[0]
    np.testing.assert_allclose(outwards.points, inwards.points, atol=1e-9)
    inside = read_shapes(written(tmp_path / "above.csv", np.vstack([[[0.0, 0.0, -0.11]], points]), 0.1))[0]
    assert inside.points[-1, 2] == pytest.approx(points[-1, 2], abs=1e-6)  # the hub is no tip
    for shift in (0.05, -0.05):
        with pytest.raises(nf.InputError, match="within 10 % of the depth"):
            read_shapes(written(tmp_path / "other.csv", points + np.array([0.0, 0.0, shift]), 0.1))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda points: points[:3], "4 rows"),
        (lambda points: points[:, :2], "x, y and z"),
        (lambda points: points * math.nan, "not finite"),
        (lambda points: points[::-1], "decreases"),
    ],
)
def test_shapes_of_other_arrays_are_named(change, words):
    with pytest.raises(nf.InputError, match=words):
        NeedleShape("one", 0.1, change(pushed(0.1)))


def test_the_place_of_a_shape_does_not_change_what_is_identified():
    shapes = [pushed(depth, roll=roll, guide=0.02) for depth, roll in ((0.08, 0.0), (0.1, 2.0))]

    def fit(aside):
        moved = [points + aside * np.array([1.0, 2.0, 0.0]) for points in shapes]
        return identify([NeedleShape(str(k), each[-1, 2], each) for k, each in enumerate(moved)], NEEDLE)

    here, elsewhere = ([each.value for each in fit(aside).parameters] for aside in (0.0, 0.05))
    np.testing.assert_allclose(here, elsewhere, rtol=1e-4)


def test_bad_shapes_are_named(tmp_path):
    file = tmp_path / "shapes.csv"
    file.write_text("hole,depth_mm,x_mm,y_mm\n1,100,0,0\n", encoding="utf-8")
    with pytest.raises(nf.InputError, match="z is missing"):
        read_shapes(file)
    file.write_text("hole,depth_mm,x_mm,y_mm,z_mm\n1,100,0,0,0\n", encoding="utf-8")
    with pytest.raises(nf.InputError, match="read_shapes"):
        nf.steering.read(file)
    file.write_text("hole,depth,x,y,z\n1,100,0,0,0\n", encoding="utf-8")
    with pytest.raises(nf.InputError, match="unit='mm'"):
        read_shapes(file)
    file.write_text("hole,depth_mm,x_mm,y_mm,z_mm\n1,100,0,0,0\n1,100,0,0,5\n", encoding="utf-8")
    with pytest.raises(nf.InputError, match="4 rows at least"):
        read_shapes(file)
    with pytest.raises(nf.InputError, match="z above 0"):
        needle_shape(NEEDLE, 2e4, (0.0, 0.0, -0.1))
    with pytest.raises(nf.InputError, match="model"):
        identify([NeedleShape("x", 0.06, pushed(0.06))], NEEDLE, model="yielding")


def test_shapes_of_fibre_and_camera_follow_from_base_and_tip(recordings):
    shapes = read_shapes(recordings / "needle-steering" / "shapes_camera_fbg.csv")
    fibre, camera = ([each for each in shapes if kind in each.name] for kind in ("fbg", "cam"))
    assert len(fibre) == len(camera) == 20
    fit = identify(fibre, NEEDLE)
    assert max(fit.rms.values()) < 0.08e-3  # 0.04 to 0.07 mm
    off, between = [], []
    for measured, seen in zip(fibre, camera):
        predicted = fit.predict(measured)
        far = seen.points[seen.points[:, 2] > 0.04]  # where the camera is reliable
        at = NeedleShape("predicted", measured.depth, predicted).at(far[:, 2])
        off.append(np.sqrt(np.mean(np.sum((at - far[:, :2]) ** 2, axis=1))))
        between.append(np.sqrt(np.mean(np.sum((measured.at(far[:, 2]) - far[:, :2]) ** 2, axis=1))))
    # 0.21 to 0.35 mm, where fibre and camera are 0.18 to 0.33 mm apart
    assert np.median(off) < 1.15 * np.median(between)
