# SPDX-License-Identifier: Apache-2.0
"""Values as text: units, digits, intervals."""

import math

import pytest

from needleforce.display.quantities import percent, plain, quantity

SPACE = "\N{NO-BREAK SPACE}"


@pytest.mark.parametrize(
    ("value", "low", "high", "unit", "text"),
    [
        (3.237e-3, 3.198e-3, 3.276e-3, "m", "3.237 ± 0.039 mm"),
        (14.1e9, 12.5e9, 15.7e9, "Pa", "14.1 ± 1.6 GPa"),
        (117546.0, 110000.0, 129000.0, "Pa", "117.5 kPa (110.0 to 129.0)"),
        (820.0, 700.0, 940.0, "Pa", "820 ± 120 Pa"),
        (18.6, 18.45, 18.75, "N/m", "0.01860 ± 0.00015 N/mm"),
        (20051.3, 19430.0, 20672.6, "N/m^2", "0.02005 ± 0.00062 N/mm²"),
        (-2.5e-3, -3.5e-3, -1.5e-3, "m", "−2.5 ± 1.0 mm"),
        (0.2617993877991494, None, None, "rad", "15°"),
        (0.04, None, None, "N", "0.04 N"),
        (0.213, math.nan, math.nan, "1", "0.213"),
        (1.0, 1.0 - 1e-12, 1.0 + 1e-12, "N", "1.00000 ± <0.00001 N"),
        (2e-3, 1e-3, math.inf, "m", "2.000 mm (1.000 to ∞)"),
        (math.nan, math.nan, math.nan, "N", "– N"),
        (12.0, 11.0, 13.0, "furlong", "12.0 ± 1.0 furlong"),
        (0.0, -2.3e-12, 2.3e-12, "N", "0.0000 ± 0.0023 nN"),
        (24e-9, 20e-9, 28e-9, "N", "24.0 ± 4.0 nN"),
        (0.0, None, None, "N", "0 N"),
    ],
)
def test_quantity(value, low, high, unit, text):
    assert str(quantity(value, low, high, unit)).replace(SPACE, " ") == text


@pytest.mark.parametrize(
    ("half", "places"), [(0.0099, 4), (0.01, 3), (0.099, 3), (0.1, 2), (9.9, 1), (10.0, 0), (230.0, 0)]
)
def test_two_digits_of_the_half_width(half, places):
    shown = quantity(1234.5678, 1234.5678 - half, 1234.5678 + half, "s").value
    assert len(shown.partition(".")[2]) == min(places, 2)  # six digits of the value at most


def test_the_interval_is_not_rounded_to_a_point():
    shown = quantity(0.2101, 0.2059, 0.2143, "N")
    assert (shown.value, shown.low, shown.high, shown.half_width) == ("0.2101", "0.2059", "0.2143", "0.0042")


def test_a_plain_number_has_no_trailing_zeros():
    assert plain(116e3, "Pa").replace(SPACE, " ") == "116 kPa"
    assert plain(0.0053, "N", 0.0053).replace(SPACE, " ") == "0.0053 N"
    assert plain(None, "N") == plain(math.nan, "N") == "–"


@pytest.mark.parametrize(
    ("share", "text"), [(0.0342, "3.4 %"), (1.04, "100 %"), (12.3, "1200 %"), (2e-6, "0.0002 %"), (math.nan, "nan %")]
)
def test_per_cent_has_two_digits_and_no_exponent(share, text):
    assert percent(share) == text
