# SPDX-License-Identifier: Apache-2.0
"""Units: each in SI, and those of a file that states them or does not."""

import numpy as np
import pytest
from plain_insertion import insertion, text

from needleforce.errors import InputError
from needleforce.recording import read
from needleforce.units import find, parse

TIME, DEPTH, FORCE = insertion()


@pytest.mark.parametrize("time_unit, times", [("s", 1.0), ("ms", 1e3), ("us", 1e6)])
@pytest.mark.parametrize("depth_unit, depths", [("m", 1.0), ("mm", 1e3)])
def test_the_only_plausible_units_are_assumed_and_noted(file, time_unit, times, depth_unit, depths):
    run = read(file(text({"time": np.round(TIME * times, 6), "pz": DEPTH * depths, "fz": FORCE})))
    np.testing.assert_allclose(run.time, TIME, atol=1e-9)
    np.testing.assert_allclose(run.depth, DEPTH, atol=1e-12)
    sentences = " ".join(run.card.assumptions)
    for sentence in (f"time is assumed to be in {time_unit}", f"depth is assumed to be in {depth_unit}", "in N"):
        assert sentence in sentences


def test_the_unit_of_a_velocity_follows_from_the_depth(file):
    velocity = np.gradient(DEPTH, TIME)
    run = read(file(text({"time_s": TIME, "depth_mm": DEPTH * 1e3, "velocity": velocity * 1e3, "force_N": FORCE})))
    np.testing.assert_allclose(run.velocity, velocity, atol=1e-15)


def test_two_plausible_units_need_a_choice(file):
    """A step of 0.1 is 10 Hz in seconds and 10 kHz in milliseconds, and 0.25 mm/s become 0.25 m/s."""
    depth = 2.5e-5 * np.minimum(np.arange(200.0), 100.0)
    rows = {"time": 0.1 * np.arange(200.0), "depth_m": depth, "force_N": depth}
    with pytest.raises(
        InputError, match=r"unit of time is unknown.*'time', 'depth_m'.*time in s; time in ms.*--unit time=s"
    ):
        read(file(text(rows)))
    assert read(file(text(rows)), units={"time": "ms"}).rate == pytest.approx(10e3)


def test_no_plausible_unit_needs_a_choice(file):
    with pytest.raises(InputError, match=r"unit of time and depth is unknown.*none of.*--unit time=s --unit depth=m"):
        read(file(text({"time": TIME * 1e9, "pz": DEPTH, "fz": FORCE})))


def test_newtons_that_are_assumed_are_stated_with_what_grams_would_be(file):
    run = read(file(text({"time_s": TIME, "depth_m": DEPTH, "fz": FORCE * 10.0})))
    assert any("in N: no unit is given; the largest value is 7.99 N, in g it would be 0.0784 N" in each
               for each in run.card.assumptions)  # fmt: skip


def test_a_force_too_large_for_newtons(file):
    rows = {"time_s": TIME, "depth_m": DEPTH, "fz": FORCE * 1e3}
    with pytest.raises(InputError, match=r"unit of force is unknown.*is 799.*in N, mN or g.*--unit force=mN"):
        read(file(text(rows)))
    np.testing.assert_allclose(read(file(text(rows)), units={"force": "mN"}).force, FORCE, rtol=1e-12, atol=1e-15)


def test_a_given_unit_overrides_the_header_and_is_noted(file):
    run = read(file(text({"time_s": TIME, "depth_m": DEPTH, "force_N": FORCE * 1e3})), units={"force": "mN"})
    np.testing.assert_allclose(run.force, FORCE, rtol=1e-12, atol=1e-15)
    assert "force is read in mN, as given, although its header states N" in run.card.assumptions


def test_an_unknown_unit_in_a_header(file):
    with pytest.raises(InputError, match=r"run.csv: unit of force is 'V', known are N, mN"):
        read(file(text({"time_s": TIME, "depth_m": DEPTH, "force [V]": FORCE})))


def test_a_torque_without_unit_is_left_out_with_a_note(file):
    rows = {"time_s": TIME, "depth_m": DEPTH, "fz": FORCE, "fx": FORCE / 10, "tx": FORCE}
    run = read(file(text(rows)))
    assert list(run.axes) == ["fx"]
    assert "left_out" in [note.kind for note in run.notes]
    np.testing.assert_allclose(read(file(text(rows)), units={"tx": "N mm"}).axes["tx"], FORCE / 1e3, rtol=1e-15)


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
