# SPDX-License-Identifier: Apache-2.0
"""A needle whose base moves aside against an inextensible rod of any slope, with its axial forces: the values are those
of ``benchmarks/exact_rod.py``, which knows nothing of needleforce."""

import json
import math
import sys
from pathlib import Path

import numpy as np
import pytest

import needleforce as nf

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from closed_motions import along, axes, run

CASES = json.loads(Path(__file__).with_name("exact_rod.json").read_text(encoding="utf-8"))
DIAMETER = {"0.7 mm": 0.7e-3, "18G": 1.27e-3}
FORCE, TIP = 0.02, 0.005


def deviation(case):
    """How far the engine is off, by quantity: forces over the force, the tip over how far the base moved."""
    diameter, length = DIAMETER[case["needle"]], case["free"] + 30e-3 if case["hub"] else 0.2
    needle = nf.Needle(diameter, 0.0, length, case["stiffness"] * 64.0 / (math.pi * diameter**4))
    guide = math.inf if case["hub"] else case["free"]
    model = nf.preset("paper") if case["friction"] else None
    insertion = nf.FlexibleInsertion(
        model, needle, lateral=case["modulus"], guide_distance=guide, planar=True, max_speed=math.inf
    )
    straight, aside = np.array([30e-3, *[0] * 5]), np.array([30e-3, case["aside"], 0.0, case["tilt"], 0.0, 0.0])
    run(insertion, along([[-1e-3, *[0] * 5], straight], 620))
    rows = run(insertion, along([straight, aside], 200))
    if case["friction"]:
        rows = run(insertion, along([aside, [32e-3, *aside[1:]]], 200))
    assert rows["status"][-1] == 0
    value, frame = case["value"], axes(np.array([[case["tilt"], 0.0]]))[0]
    force, tip = rows["wrench"][-1, :3] @ frame, rows["tip"][-1]
    across, along_it = abs(without_friction(case)["force_x"]), abs(value["force_z"])
    return {
        "force across": (force[0] - value["force_x"]) / across,
        "moment": (rows["wrench"][-1, 4] - value["moment"]) / (across * case["free"]),
        "force along": (force[2] - value["force_z"]) / along_it,
        "force that feeds it": (rows["force"][-1] - value["fed"]) / along_it,
        "tip across": (tip[0] - value["tip_x"]) / case["aside"],
        "tip along": (tip[2] - value["tip_z"]) / case["aside"],
    }


def without_friction(case):
    same = ("needle", "modulus", "free", "hub", "aside", "tilt")
    return next(each for each in CASES if all(each[key] == case[key] for key in same) and not each["friction"])["value"]


def test_the_rod_is_in_balance():
    for case in CASES:
        value = case["value"]
        if not case["friction"]:  # then the tissue's energy at the surface is all that is along
            stretched = 0.5 * case["modulus"] * value["surface_x"] ** 2
            assert -value["force_z"] == pytest.approx(stretched, rel=1e-5)
        assert (
            case["error"]["force_x"] < 1e-4 * abs(without_friction(case)["force_x"]) and case["error"]["tip_x"] < 1e-7
        )


LARGEST = {
    (False, False): "the tip of 1 of 59 is 0.56 % of the base's motion off, across",
    (True, False): "2 of 30 short ones in 10 kPa: force across 2.4 % off, moment 3.5 %",
    (True, True): "2 of 30 short ones in 10 kPa: force across 2.4 % off, moment 3.2 %; 2 tips 0.6 %, along",
}


@pytest.mark.parametrize(
    "hub, friction",
    [
        (False, True),
        *(pytest.param(*case, marks=pytest.mark.xfail(strict=True, reason=why)) for case, why in LARGEST.items()),
    ],
)
def test_base_moved_aside_and_tilted_meets_an_exact_rod(hub, friction):
    # up to slopes of 0.25
    off = {}
    for number, case in enumerate(CASES):
        if (case["hub"], case["friction"]) == (hub, friction):
            for name, value in deviation(case).items():
                if abs(value) > (TIP if name.startswith("tip") else FORCE):
                    off[number, name] = value
    assert off == {}
