# SPDX-License-Identifier: Apache-2.0
"""Reference values computed independently with 40 digits, through the public names."""

import math
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
import reference

ENTRIES = reference.load()
BENDING = reference.load(reference.FILE.with_name("reference_values_deflection.json"))
# a group whose formulas are the same for several values: tests/fe computes each
LATER = {"fem"}
# values of covered groups that are not used
LATER_VALUES = {"hay_factor_15deg_nu0p3"}


@pytest.mark.parametrize("entry", [e for e in ENTRIES if reference.mapped(e)], ids=lambda e: e["name"])
def test_value(entry):
    got, passed = reference.evaluate(entry, ENTRIES)
    assert passed, (got, entry["expected"])


@pytest.mark.parametrize("entry", [e for e in BENDING if reference.mapped(e)], ids=lambda e: e["name"])
def test_value_of_a_needle_that_bends(entry):
    got, passed = reference.evaluate(entry, BENDING)
    assert passed, (got, entry["expected"])


def test_every_value_of_bending_and_finite_elements_is_computed():
    assert all(reference.mapped(entry) for entry in BENDING)


def test_only_mechanics_not_implemented_yet_are_pending():
    pending = {entry["name"] for entry in ENTRIES if entry["group"] not in LATER and not reference.mapped(entry)}
    assert pending == LATER_VALUES


def test_every_rule_is_used():
    used = {reference.mapped(entry) for entry in ENTRIES + BENDING}
    unused = {
        "shank_energy",
        "yeoh",
        "polynomial_force",
        "stick_time",
        "period",
        "cone_pressure",
    }  # for values that are not in the shipped file
    assert {function.__name__ for *_, function in reference.RULES if function not in used} <= unused


CONE = {"E_r": 116e3, "alpha_deg": 15.0, "a": 0.3e-3, "r": 0.1e-3}
STRIBECK = {"F_s": 0.1, "F_k": 0.0033, "v_s": 0.5714e-3, "c": 20.73}


def entry(group, formula, inputs, expected):
    return {"name": "new", "group": group, "formula": formula, "inputs": inputs, "expected": expected, "rel_tol": 1e-9}


def test_the_pressure_at_a_radius_is_not_taken_for_the_mean_pressure():
    mean = 0.5 * CONE["E_r"] / math.tan(math.radians(15.0))
    at_radius = entry("sneddon", "p(r) = E_r cot(alpha)/2 arcosh(a/r)", CONE, mean * math.acosh(3.0))
    assert reference.evaluate(at_radius, [])[1]
    other = entry("sneddon", "p(r)/p0 of E_r cot(alpha)/2 (1 - r^2/a^2)", CONE, 0.0)
    assert reference.mapped(other) is None


def test_the_argument_of_a_steady_force_is_its_speed():
    critical = STRIBECK["v_s"] * math.log((STRIBECK["F_s"] - STRIBECK["F_k"]) / (STRIBECK["c"] * STRIBECK["v_s"]))
    # a speed among the inputs belongs to another entry of the same law
    for argument, speed in (("Vc", critical), ("2 mm/s", 2e-3), ("V", 3e-3)):
        force = STRIBECK["F_k"] + (STRIBECK["F_s"] - STRIBECK["F_k"]) * math.exp(-speed / STRIBECK["v_s"])
        found = entry("stick_slip", f"F_ss({argument})", STRIBECK | {"V": 3e-3}, force + STRIBECK["c"] * speed)
        assert reference.evaluate(found, [])[1], argument
