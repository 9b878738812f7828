# SPDX-License-Identifier: Apache-2.0
"""What a file lacks is asked once, and may come from a rate, a speed or a step."""

import numpy as np
import pytest
from plain_insertion import insertion, text

from needleforce.errors import InputError
from needleforce.recording import read

TIME, DEPTH, FORCE = insertion(rate=50.0)
IN = DEPTH[:625]  # the insertion, at constant speed


def test_all_missing_columns_are_in_one_message_with_candidates(file):
    table = text({"a (s)": TIME, "b (mm)": DEPTH, "c (N)": FORCE, "d (mm)": DEPTH, "e (s)": TIME, "g (N)": FORCE})
    with pytest.raises(InputError) as caught:
        read(file(table))
    message = str(caught.value)
    assert "no column holds the time and the force and the depth" in message
    assert "for the time: 'a (s)', 'e (s)'" in message and "for the depth: 'b (mm)', 'd (mm)'" in message
    assert "for the force: 'c (N)', 'g (N)'" in message
    for option in ("--column time=1", "--column force=3", "--column depth=2", "--rate-hz", "--step-um",
                   "--speed-mm-s", "--motion FILE", "indentation"):  # fmt: skip
        assert option in message
    run = read(file(table), columns={"time": "a", "depth": "b", "force": "c"})  # what it asks for
    assert len(run) == len(TIME)


def test_a_column_that_alone_has_a_unit_is_taken_and_reported(file):
    run = read(file(text({"a [s]": TIME, "Stage [mm]": 1e3 * DEPTH, "Load cell [N]": FORCE, "other": FORCE})))
    np.testing.assert_allclose(run.depth, DEPTH, rtol=1e-14, atol=1e-18)
    sentences = " ".join(run.card.assumptions)
    assert "the time is the column 'a [s]', the only one" in sentences
    assert "the depth is the column 'Stage [mm]', the only one with a unit for it" in sentences


def test_time_from_a_rate(file):
    run = read(file(text({"depth_mm": 1e3 * DEPTH, "force_N": FORCE})), rate=50.0)
    np.testing.assert_allclose(run.time, TIME, atol=1e-12)
    assert any("50 Hz" in sentence for sentence in run.card.assumptions)


def test_time_from_speed_and_travel(file):
    run = read(file(text({"depth_mm": 1e3 * DEPTH, "force_N": FORCE})), speed=2e-3)
    np.testing.assert_allclose(run.time, TIME, atol=1e-9)


def test_time_from_a_speed_where_the_depth_rests(file):
    depth = np.repeat(np.arange(50) * 1e-4, 2)  # a step of depth every second sample
    run = read(file(text({"depth_m": depth, "force_N": depth})), speed=1e-3)
    assert run.time[-1] == pytest.approx(depth[-1] / 1e-3) and (np.diff(run.time) > 0).all()


@pytest.mark.parametrize("options", [{"step": 40e-6}, {"speed": 2e-3}])
def test_depth_from_a_step_or_a_speed(file, options):
    run = read(file(text({"time_s": TIME[:625], "force_N": FORCE[:625]})), **options)
    np.testing.assert_allclose(run.depth, IN - IN[0], atol=1e-12)


@pytest.mark.parametrize("options", [{"step": 40e-6, "rate": 50.0}, {"step": 40e-6, "speed": 2e-3},
                                     {"speed": 2e-3, "rate": 50.0}])  # fmt: skip
def test_force_alone(file, options):
    run = read(file(text({"force_N": FORCE[:625]})), **options)
    np.testing.assert_allclose(run.time, TIME[:625], atol=1e-9)
    np.testing.assert_allclose(run.depth, IN - IN[0], atol=1e-9)
    np.testing.assert_array_equal(run.force, FORCE[:625])


def test_an_indentation_needs_no_time_and_no_needle(file):
    nanometres = text({"depth_nm": 1e3 * TIME, "force_uN": FORCE})
    run = read(file(nanometres), test="indentation")
    assert any("no time" in sentence for sentence in run.card.assumptions)
    assert not [note for note in run.notes if note.kind == "implausible"]
    with pytest.raises(InputError, match="no column holds the time"):
        read(file(nanometres))


@pytest.mark.parametrize("options", [{"rate": 0.0}, {"speed": -1.0}, {"step": float("nan")}, {"test": "puncture"}])
def test_wrong_options(file, options):
    with pytest.raises(InputError):
        read(file(text({"force_N": FORCE})), **options)


def test_ten_hertz_is_a_rate_of_a_needle(file):
    """Times of 0.1 s, written to seven digits, are not exactly 10 Hz."""
    depth = np.linspace(0.0, 20.0, 200)
    run = read(file(text({"time": np.round(0.1 * np.arange(200), 7), "depth": depth, "force": depth})))
    assert run.rate == pytest.approx(10.0) and run.depth[-1] == pytest.approx(20e-3)


def test_a_short_stroke_in_millimetres_is_not_taken_for_metres(file):
    """0.2 without a unit is 0.2 m or 0.2 mm."""
    depth = np.linspace(0.0, 0.2, 200)
    with pytest.raises(InputError, match=r"unit of depth is unknown.*depth in m; depth in mm"):
        read(file(text({"time_s": 0.01 * np.arange(200), "depth": depth, "force_N": depth})))


@pytest.mark.parametrize("unit, factor", [("g", 9.80665e-3), ("gf", 9.80665e-3), ("kg", 9.80665), ("cN", 1e-2),
                                          ("lbf", 4.4482216152605), ("µN", 1e-6), ("nN", 1e-9), ("kp", 9.80665),
                                          ("dyn", 1e-5), ("Newton", 1.0), ("ozf", 0.27801385095378125)])  # fmt: skip
def test_every_unit_is_recognised_and_accepted(file, unit, factor):
    """NIST SP 811, appendix B."""
    stated = read(file(text({"time_s": TIME, "depth_mm": 1e3 * DEPTH, f"force [{unit}]": FORCE})))
    given = read(file(text({"time_s": TIME, "depth_mm": 1e3 * DEPTH, "force": FORCE})), units={"force": unit})
    np.testing.assert_allclose(stated.force, factor * FORCE, rtol=1e-15)
    np.testing.assert_array_equal(given.force, stated.force)


def test_counts_with_a_factor(file):
    counts = np.round(FORCE / 0.0122)
    path = file(text({"time_s": TIME, "depth [steps]": DEPTH / 5e-6, "force [counts]": counts}))
    with pytest.raises(InputError, match=r"unit of depth is 'steps'.*what one of another unit or one count is"):
        read(path)
    run = read(path, units={"force": "0.0122N", "depth": "5 µm"})
    np.testing.assert_allclose(run.force, 0.0122 * counts, rtol=1e-14)
    np.testing.assert_allclose(run.depth, DEPTH, rtol=1e-13, atol=1e-15)


def test_a_stated_unit_is_believed_and_the_advice_is_no_contradiction(file):
    depth = np.linspace(0.0, 2.0, 500)  # 2 m in 5 s, as stated
    run = read(file(text({"time_s": 0.01 * np.arange(500), "depth_m": depth, "force_N": depth})))
    (note,) = [note for note in run.notes if note.kind == "implausible"]
    assert "--unit depth=mm" in note.message and "--unit depth=m " not in note.message
    large = read(file(text({"time_s": TIME, "depth_mm": 1e3 * DEPTH, "force_N": 100 * FORCE})))
    assert large.force.max() == pytest.approx(100 * FORCE.max())


def test_what_contradicts_a_constant_speed_is_stated(file):
    rest = np.concatenate([np.full(100, IN[0]), IN])
    whole = read(file(text({"depth_mm": 1e3 * rest, "force_N": np.clip(40.0 * rest, 0.0, None)})), speed=2e-3)
    assert any("although the depth rests over 101 samples" in sentence for sentence in whole.card.assumptions)
    coarse = read(file(text({"depth_mm": np.round(1e3 * IN, 1), "force_N": FORCE[:625]})), speed=2e-3)
    assert not any("although" in sentence for sentence in coarse.card.assumptions)
    alone = read(file(text({"time_s": TIME, "force_N": FORCE})), speed=2e-3)
    assert any("the force has both signs" in sentence for sentence in alone.card.assumptions)
    one_way = read(file(text({"time_s": TIME[:625], "force_N": FORCE[:625]})), speed=2e-3)
    assert not any("both signs" in sentence for sentence in one_way.card.assumptions)
