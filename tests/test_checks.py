# SPDX-License-Identifier: Apache-2.0
"""Each condition of an input at its edges."""

import numpy as np
import pytest

import needleforce as nf
from needleforce import checks

NUMBERS = {
    "above_zero": (lambda value: checks.above_zero("radius", value, "m"), [5e-324, 1, np.float64(2.0), np.array(3.0)]),
    "not_below_zero": (
        lambda value: checks.not_below_zero("radius", value, "m"),
        [0.0, -0.0, 5e-324, 1, np.array(3.0)],
    ),
    "within": (lambda value: checks.within("radius", value, 0.5, 2.0, "m"), [0.5, 2, np.float32(1.0), True]),
    "finite_number": (lambda value: checks.finite_number("radius", value, "Give it in m."), [0.0, -1e308, 10**300]),
}
NO_NUMBERS = [np.nan, np.inf, -np.inf, 10**400, None, "1", b"1", 1j, [1.0], np.ones(1), [[1.0], [1.0, 2.0]], object]


@pytest.mark.parametrize("name", NUMBERS)
def test_a_number_that_meets_the_condition_is_returned_as_it_is(name):
    check, accepted = NUMBERS[name]
    for value in accepted:
        assert check(value) is value


@pytest.mark.parametrize("value", NO_NUMBERS, ids=lambda value: repr(value)[:20])
@pytest.mark.parametrize("name", NUMBERS)
def test_what_is_no_finite_number_is_refused(name, value):
    with pytest.raises(nf.InputError, match="radius is "):
        NUMBERS[name][0](value)


@pytest.mark.parametrize(
    "name, value, message",
    [
        ("above_zero", 0.0, "radius is 0.0 m, must be above 0. Give it in m."),
        ("above_zero", -5e-324, "radius is -5e-324 m, must be above 0. Give it in m."),
        ("above_zero", np.nan, "radius is nan m, must be above 0. Give it in m."),
        ("above_zero", "1e-3", "radius is 1e-3 m, must be above 0. Give it in m."),
        ("above_zero", np.inf, "radius is inf m, must be finite and above 0. Give it in m."),
        ("not_below_zero", -5e-324, "radius is -5e-324 m, must be at least 0. Give it in m."),
        ("not_below_zero", np.inf, "radius is inf m, must be finite and at least 0. Give it in m."),
        ("within", 0.49999, "radius is 0.49999, outside 0.5 to 2 m."),
        ("within", 2.00001, "radius is 2.00001, outside 0.5 to 2 m."),
        ("finite_number", "deep", "radius is 'deep', not a finite number. Give it in m."),
    ],
)
def test_the_message_says_quantity_value_limit_and_what_to_do(name, value, message):
    with pytest.raises(nf.InputError) as refused:
        NUMBERS[name][0](value)
    assert str(refused.value) == message


def test_a_number_without_unit_has_the_next_step_that_is_stated():
    with pytest.raises(nf.InputError, match=r"^delay is -1, must be at least 0\. Use 2\.$"):
        checks.not_below_zero("delay", -1, next_step="Use 2.")
    with pytest.raises(nf.InputError, match=r"^theta is 3, outside 0 to 1\. Use 0\.5\.$"):
        checks.within("theta", 3, 0.0, 1.0, next_step="Use 0.5.")
    with pytest.raises(nf.InputError, match=r"^delay is 0, must be above 0\.$"):
        checks.above_zero("delay", 0)


def test_points_have_three_finite_numbers():
    assert checks.in_range("target", (0, 1, -1), checks.TRAVEL, "Give it in m.", (3,)).tolist() == [0.0, 1.0, -1.0]
    for wrong in ((1.0, 2.0), (1.0, 2.0, np.nan), (1.0, 2.0, np.inf), [[1.0, 2.0, 3.0]], "abc", ("a", "b", "c"), None):
        with pytest.raises(nf.InputError, match=r"^target(?: in row \d)? is .*\. Give x, y, z in m\.$"):
            checks.in_range("target", wrong, checks.TRAVEL, "Give x, y, z in m.", (3,))


@pytest.mark.parametrize(
    "values, message",
    [
        ([0.0, 1.5], "place in row 2 is 1.5 m, outside -1 to 1 m: no needle is longer. Check it."),
        ([[0.0, -1e308]], "place in row 1 is -1e+308 m, outside -1 to 1 m: no needle is longer. Check it."),
        ([0.0, np.nan], "place in row 2 is nan m, not finite, outside -1 to 1 m: no needle is longer. Check it."),
        (np.inf, "place is inf m, not finite, outside -1 to 1 m: no needle is longer. Check it."),
    ],
)
def test_a_number_out_of_its_range_is_named_with_its_row_and_the_physics(values, message):
    with pytest.raises(nf.InputError) as refused:
        checks.in_range("place", values, checks.TRAVEL, "Check it.")
    assert str(refused.value) == message
    with pytest.raises(nf.InputError, match=r"^line 1\d: place is "):
        checks.in_range("place", np.atleast_1d(values), checks.TRAVEL, "", place=lambda row: f"line {10 + row}")


def test_names_and_classes():
    checks.one_of("form", "b", {"a": 1, "b": 2})
    assert checks.instance_of("needle", 3, int, "Give one.") == 3
    for wrong in ("c", "", "B", None, 3, np.nan, ["a"]):
        with pytest.raises(nf.InputError, match=r"^form is .*, unknown\. Give one of a, b\.$"):
            checks.one_of("form", wrong, ("a", "b"))
    with pytest.raises(nf.InputError, match=r"^needle is str, not a int\. Give one\.$"):
        checks.instance_of("needle", "3", int, "Give one.")
