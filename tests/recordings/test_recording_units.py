# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from needleforce.errors import InputError
from needleforce.units import find, parse


@pytest.mark.parametrize(
    "text, dimension, si",
    [  # NIST SP 811, appendix B: exact to the digits given
        ("lbf", "force", 4.4482216152605), ("kgf", "force", 9.80665), ("gf", "force", 9.80665e-3),
        ("mN", "force", 1e-3), ("kN", "force", 1e3), ("in", "length", 0.0254), ("µm", "length", 1e-6),
        ("μm", "length", 1e-6), ("us", "time", 1e-6), ("min", "time", 60.0), ("N·mm", "torque", 1e-3),
        ("Nmm", "torque", 1e-3), ("N_m", "torque", 1.0), ("mm/s", "velocity", 1e-3), ("mm_s", "velocity", 1e-3),
        ("m_s", "velocity", 1.0), ("Seconds", "time", 1.0), ("Millimeter", "length", 1e-3), ("-N", "force", -1.0),
    ],
)  # fmt: skip
def test_one_unit_in_si(text, dimension, si):
    assert find(text, dimension).to_si(np.array([1.0]))[0] == si


def test_prefixes_keep_their_case():
    assert find("MN", "force") is None  # a meganewton is not a millinewton
    assert find("Ms", "time") is None


def test_a_unit_of_length_is_not_a_unit_of_force():
    assert find("mm", "force") is None


def test_conversion_by_an_integer_rounds_once():
    microseconds = np.arange(0, 10**6, 9973, dtype=float)
    assert (find("us", "time").to_si(microseconds) == microseconds / 1e6).all()


def test_an_unknown_unit_names_the_known_ones():
    with pytest.raises(InputError, match=r"unit of time is 'weeks', known are s, ms, us, ns, min.*--unit time=s"):
        parse("weeks", "time", "time")
