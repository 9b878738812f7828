# SPDX-License-Identifier: Apache-2.0
"""The steered needle in Chromium: the page's tip, shape and wrench are the package's, its plan is the planner's, and
what goes wrong is stated."""

import sys
from pathlib import Path

import numpy as np
import pytest
from browser import shows

import needleforce as nf
from needleforce import fe
from needleforce.steering.base_motion import BaseMotion
from needleforce.studio import planning
from needleforce.studio.solid_example import solid_example
from needleforce.studio.steering_presets import steering_presets

SLOW = "import json, os, time; print(json.dumps({'count': os.getpid(), 'cost': 1.0}), flush=True); time.sleep(60)"
RESULTS = {"tip": slice(7, 10), "force": 10, "wrench": slice(12, 18)}
FIELD = """async ([along, aside]) => {
  const { SolidField } = await import("./solid_field.js");
  return new SolidField(await (await fetch("solid.json")).json()).places(along, aside);
}"""


@pytest.fixture
def steering(opened):
    """The page with its first needle before the tissue."""
    page = opened()
    page.click("#to-steering")
    shows(page, "#steer-words", "above the tissue")
    return page


def to_the_end(page, click: str, *, timeout: int = 60_000):
    """What a button begins, without waiting for it."""
    page.click(click)
    page.click("#steer-skip")
    page.wait_for_selector("#steer-skip:disabled", timeout=timeout)
    page.wait_for_timeout(100)  # the last frame


def write(page, field: str, value: str):
    page.fill(field, value)
    page.press(field, "Enter")


def exported(page, what: str, folder):
    page.click("#steer-export summary")
    with page.expect_download() as download:
        page.click(f"#steer-export [data-export={what}]")
    download.value.save_as(folder / f"{what}.csv")
    return folder / f"{what}.csv"


def steps(path) -> tuple[np.ndarray, list[str]]:
    """The numbers of each step, and its status."""
    lines = path.read_text(encoding="utf-8").splitlines()
    rows = [line.split(",") for line in lines if not line.startswith(("#", "time"))]
    return np.array([row[:-1] for row in rows], float), [row[-1] for row in rows]


def replayed(insertion: nf.FlexibleInsertion, table: np.ndarray) -> dict[str, np.ndarray]:
    return insertion.run(table[:, 1], table[:, 2:4], tilt=table[:, 4:6], roll=table[:, 6], dt=1e-3)


def test_a_base_moved_and_rolled_gives_tip_shape_and_wrench_of_python(steering, tmp_path):
    page = steering
    write(page, "#steer-to", "15")
    to_the_end(page, "#steer-fast")
    for view, keys in (("#steer-side", ["ArrowRight"] * 4 + ["e"] * 6), ("#steer-top", ["ArrowLeft", "["])):
        for key in keys:
            page.locator(view).press(key)
    write(page, "#steer-tiltX", "1")
    page.wait_for_selector("#steer-skip:disabled", timeout=60_000)
    box = page.locator("#steer-top").bounding_box()
    x, y = box["x"] + 0.6 * box["width"], box["y"] + 30
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 12, y + 60, steps=4)
    page.mouse.up()
    page.wait_for_selector("#steer-skip:disabled", timeout=60_000)
    table, status = steps(exported(page, "steps", tmp_path))
    depth, x, y, roll = table[-1, [1, 2, 3, 6]]
    assert depth > 18e-3 and x == pytest.approx(1e-3) and y > 0.2e-3 and np.degrees(roll) == pytest.approx(25.0)
    assert set(status) == {"ok"}
    flex = steering_presets()["bevel"].insertion()
    ours = replayed(flex, table)
    for name, columns in RESULTS.items():
        assert table[:, columns] == pytest.approx(ours[name], rel=1e-9, abs=1e-9 * np.abs(ours[name]).max()), name
    shape = np.loadtxt(exported(page, "shape", tmp_path), delimiter=",", skiprows=1)
    assert shape == pytest.approx(flex.shape(), rel=1e-9, abs=1e-12)
    # a zero has no sign
    tip = ", ".join(f"{round(1e3 * value, 2) + 0.0:.2f}" for value in ours["tip"][-1]).replace("-", "−")
    assert f"tip x, y, depth\t{tip} mm" in page.inner_text("#steer-values")


def test_a_plan_is_the_planners_and_played_it_misses_as_in_python(steering, tmp_path):
    page, bevel = steering, steering_presets()["bevel"]
    write(page, "#steer-target-x", "3")
    write(page, "#steer-target-depth", "30")
    page.click("#steer-add")
    page.click("[aria-label='remove obstacle 2']")
    page.click("#steer-plan")
    page.wait_for_selector("#steer-play:enabled", timeout=180_000)
    target = np.array([3e-3, 2e-3, 30e-3])
    spheres = [nf.steering.Sphere(one[:3], one[3]) for one in bevel.obstacles]
    plan = nf.steering.plan(bevel.insertion(), target, obstacles=spheres)
    motion = BaseMotion.read(exported(page, "plan", tmp_path))
    assert motion.depth == pytest.approx(plan.motion.depth, rel=1e-9)
    assert motion.lateral == pytest.approx(plan.motion.lateral, rel=1e-6, abs=1e-9)
    assert page.inner_text("#steer-planned").split("\t")[1] == f"{1e3 * plan.miss:.2f} mm"
    to_the_end(page, "#steer-play")
    table, _ = steps(exported(page, "steps", tmp_path))
    tip = replayed(bevel.insertion(), table)["tip"][-1]
    miss = np.linalg.norm(tip - target)
    assert np.linalg.norm(table[-1, 7:10] - target) == pytest.approx(miss, rel=1e-9) and miss < 0.1e-3
    assert page.inner_text("#steer-own").split("\t")[:2] == ["the plan, played", f"{1e3 * miss:.2f} mm"]


def test_a_target_out_of_reach_and_a_planner_that_ends_are_stated(steering, monkeypatch):
    page = steering
    page.click("[aria-label='remove obstacle 1']")
    write(page, "#steer-target-x", "40")
    write(page, "#steer-target-depth", "12")
    page.click("#steer-plan")
    shows(page, "#steer-words", "No plan reaches it within its limits: the target is out of reach by")
    write(page, "#steer-target-depth", "-3")
    page.click("#steer-plan")
    shows(page, "#steer-words", "depth of the target is -3 mm, must be below the surface")
    monkeypatch.setattr(planning, "COMMAND", (sys.executable, "-c", "import os; os.abort()"))
    page.click("#steer-plan")
    shows(page, "#steer-words", "The planner's process ended without a plan")
    monkeypatch.setattr(planning, "COMMAND", (sys.executable, "-c", SLOW))
    page.click("#steer-plan")
    shows(page, "#steer-words", "evaluations")
    process = Path("/proc", page.inner_text("#steer-words").split()[1])
    assert process.is_dir()
    page.click("#steer-cancel")
    shows(page, "#steer-words", "The planner was cancelled")
    for _ in range(100):
        if not process.is_dir():
            break
        page.wait_for_timeout(50)
    assert not process.is_dir()  # nothing runs on for a page that does not wait
    assert page.is_disabled("#steer-play") and page.is_enabled("#steer-plan")


def test_what_is_no_number_and_what_the_core_refuses_are_stated(steering):
    page = steering
    for field, name in (("#steer-x", "across, x"), ("#steer-target-depth", "target, depth")):
        write(page, field, "NaN")
        assert f"{name}: “NaN” is not a number from" in page.inner_text("#steer-refusal")
    write(page, "#steer-x", "15")  # the guide 20 mm above the surface
    to_the_end(page, "#steer-fast")
    for across in ("-15", "15", "-15", "15"):  # rounding decides which stroke is refused
        write(page, "#steer-x", across)
        page.wait_for_timeout(4_000)
        if page.is_visible("#steer-words.wrong"):
            break
    assert "The core refuses this step" in page.inner_text("#steer-words")
    page.click("#steer-again")
    shows(page, "#steer-words", "above the tissue")


def test_tissue_of_a_solid_moves_as_its_finite_elements_do(steering):
    page, example = steering, solid_example()
    page.select_option("#steer-needle", "solid")
    shows(page, "#steer-about", "gelatin of 12 kPa")
    to_the_end(page, "#steer-fast")
    shows(page, "#steer-moved", "tissue moved by up to")
    count = len(example.along)
    along, aside = np.linspace(0.0, 0.05, count), np.linspace(0.03, -0.02, count)
    got = np.array(page.evaluate(FIELD, [along.tolist(), aside.tolist()]))
    # the same forces on the same body at once, solved again; left and right of the needle
    body = fe.Tissue(
        fe.cylinder(15e-3, 28e-3, 0.7e-3, needle_depth=20e-3),
        fe.Elastic(12e3),
        supports={"bottom": "fixed", "sides": "fixed"},
    )
    path = fe.NeedlePath(depth=20e-3, spacing=2e-3, radius=0.7e-3)
    forces = path.loads(body) @ along + path.loads(body, np.array([1.0, 0.0, 0.0])) @ aside
    across = np.concatenate([-example.across[:0:-1], example.across])
    x, z = np.meshgrid(across, example.down)
    moved = body.displacement(body.solve(forces), np.column_stack([x.ravel(), 0.0 * x.ravel(), z.ravel()]))
    expected = np.column_stack([x.ravel(), z.ravel()]) + moved[:, [0, 2]]
    assert got[..., :2].reshape(-1, 2) == pytest.approx(expected, abs=0.02 * np.abs(moved).max())
