# SPDX-License-Identifier: Apache-2.0
"""Waveforms with starts of their own, copies among repeats, unsigned forces, forces without a contact, and rows of text
in bench tests: for each the public case, and further files of its kind, by value."""

import re

import numpy as np
import pytest
from nptdms import ChannelObject, TdmsWriter
from odd_insertion import (
    DEFLECTION,
    DEPTH,
    FORCE,
    HEAD,
    ROWS,
    TIME,
    case,
    check,
    contact_mm,
    depth_of,
    force_of,
    rows,
    written,
)

import needleforce as nf
from needleforce.bench_tests.reading import read_bending, read_stress
from needleforce.campaign import campaign
from needleforce.recording.copies import copies

# --- waveforms that start at different times

START = np.datetime64("2024-03-01T10:00:00.000000")


def tdms(path, force, motion, groups=("Rig", "Rig"), more=(), name="Position"):
    """Channels with (start [s], offset [s], step [s], values, unit); the start may be None."""

    def channel(group, name, start, offset, step, values, unit):
        facts = {"wf_increment": step, "wf_start_offset": offset, "unit_string": unit}
        if start is not None:
            facts["wf_start_time"] = START + np.timedelta64(round(1e6 * start), "us")
        return ChannelObject(group, name, values, facts)

    channels = [channel(groups[0], "Fz", *force), channel(groups[1], name, *motion)]
    with TdmsWriter(path) as writer:
        writer.write_segment(channels + [channel(groups[0], *each) for each in more])
    return path


@pytest.mark.parametrize(
    "force, motion, groups",
    [
        ((0.4, 0.0, 0.01), (0.0, 0.0, 0.01), "AA"),
        ((0.0, 0.0, 0.01), (0.4, 0.0, 0.01), "AA"),
        ((0.4, 0.0, 0.01), (0.0, 0.0, 0.01), "AB"),
        ((0.023, 0.0, 0.01), (0.0, 0.0, 0.01), "AA"),
        ((0.0, 0.4, 0.01), (0.0, 0.0, 0.01), "AA"),
        ((0.3, 0.1, 0.01), (0.0, 0.0, 0.01), "AA"),
        ((0.25, 0.0, 0.01), (0.0, 0.0, 0.02), "AA"),
        ((0.0, 0.0, 0.005), (0.125, 0.0, 0.02), "AB"),
        ((1.0, 0.0, 0.01), (0.2, 0.0, 0.01), "AA"),
        ((0.000_05, 0.0, 0.01), (0.0, 0.0, 0.01), "AA"),
        ((0.0, 0.0, 0.01), (0.0, 0.0, 0.01), "AA"),
    ],
)
def test_channels_with_their_own_starts_are_on_one_clock(tmp_path, force, motion, groups):
    times = [start + offset + step * np.arange(int(8.0 / step)) for start, offset, step in (force, motion)]
    path = tdms(tmp_path / "run.tdms", (*force, force_of(times[0]), "N"), (*motion, depth_of(times[1]), "mm"), groups)
    run = nf.read(path, baseline=False)
    kept = times[0][(times[0] >= times[1][0] - 1e-9) & (times[0] <= times[1][-1] + 1e-9)]
    assert len(run) == pytest.approx(len(kept), abs=1)
    at = kept[0] + run.time - run.time[0]
    assert 1e3 * run.depth == pytest.approx(depth_of(at), abs=0.05)
    assert run.force == pytest.approx(force_of(at), abs=0.02)
    assert any("as the file states" in each for each in run.card.assumptions) == (abs(force[0] - motion[0]) > 1e-4)


@pytest.mark.parametrize("start", [None, 0.0, 0.4042, 0.3959])
def test_channels_without_a_start_or_within_a_step_are_joined_row_by_row(tmp_path, start):
    """As those of a multiplexer."""
    path = tdms(tmp_path / "run.tdms", (start, 0.0, 0.01, FORCE, "N"), (start and 0.4, 0.0, 0.01, DEPTH, "mm"))
    check(nf.read(path, baseline=False))


@pytest.mark.parametrize(
    "name, unit, factor, more",
    [
        ("LVDT", "um", 1e3, ()),
        ("Position (mm)", "", 1.0, ()),
        ("Position", "mm", 1.0, (("Tz", 0.4, 0.0, 0.01, 0.0 * TIME, "Nmm"),)),
        ("Position", "mm", 1.0, (("Position target", 0.2, 0.0, 0.01, DEPTH, "mm"),)),
    ],
)
def test_the_channel_of_the_motion_is_found(tmp_path, name, unit, factor, more):
    force, motion = (0.4, 0.0, 0.01, force_of(0.4 + TIME), "N"), (0.0, 0.0, 0.01, factor * DEPTH, unit)
    run = nf.read(tdms(tmp_path / "run.tdms", force, motion, more=more, name=name), baseline=False)
    assert len(run) == 760
    assert 1e3 * run.depth == pytest.approx(depth_of(0.4 + TIME[:760]), abs=0.05)
    assert run.force == pytest.approx(force_of(0.4 + TIME[:760]), abs=0.02)


def test_waveforms_of_two_days_are_not_joined(tmp_path):
    path = tdms(tmp_path / "run.tdms", (86400.0, 0.0, 0.01, FORCE, "N"), (0.0, 0.0, 0.01, DEPTH, "mm"))
    with pytest.raises(nf.InputError, match="begins 86400 s later"):
        nf.read(path)


def test_public_case_01(recordings):
    run = nf.read(case(recordings, "01-tdms-start-times") / "same.tdms")
    assert contact_mm(run) == pytest.approx(3.0, abs=0.15)
    puncture = nf.segment(run).punctures[0]
    assert (1e3 * puncture.depth, puncture.force) == pytest.approx((7.0, 0.8), abs=0.1)


# --- repeats that are the same readings, saved in another way

RESAVED = {
    "line ends": HEAD.replace("\n", "\r\n") + rows(end="\r\n"),
    "old line ends": (HEAD + rows()).replace("\n", "\r\n\r\n"),
    "semicolons": HEAD.replace(",", ";") + rows(sep=";"),
    "tabs": HEAD.replace(",", "\t") + rows(sep="\t"),
    "decimal commas": HEAD.replace(",", ";") + rows(sep=";", decimal=","),
    "other units": "time_ms,depth_um,force_mN\n" + rows(ROWS * 1e3, places=3),
    "other order": "force_N,time_s,depth_mm\n" + rows(ROWS[:, [2, 0, 1]]),
    "fewer digits": HEAD + rows(places=4),
    "another card": "# tissue: liver\n# needle: 18 G\n" + HEAD + rows(),
    "the last rows are absent": HEAD + rows(ROWS[:-30]),
    "the first rows are absent": HEAD + rows(ROWS[20:]),
    "a column more": "time_s,depth_mm,force_N,fx_N\n" + rows(np.column_stack([ROWS, 0.1 * FORCE])),
    "signs": HEAD + rows(ROWS * [1.0, -1.0, -1.0]),
    "three digits": HEAD + rows(places=3),
    "four significant digits": HEAD + "".join(",".join(f"{v:.4g}" for v in row) + "\n" for row in ROWS),
    "a coarse force": HEAD + rows(np.column_stack([TIME, DEPTH, 0.005 * np.round(FORCE / 0.005)])),
    "every second row": HEAD + rows(ROWS[::2]),
    "every third row, from the second on": HEAD + rows(ROWS[1::3]),
    "means of two rows": HEAD + rows(ROWS.reshape(-1, 2, 3).mean(axis=1)),
    "another gain": HEAD + rows(ROWS * [1.0, 1.0, 1.02]),
    "half the gain, reversed": HEAD + rows(ROWS * [1.0, 1.0, -0.5]),
    "another zero of all": HEAD + rows(np.add(ROWS, [100.0, 3.0, 0.5])),
    "another start of the clock and the depth, every second row": HEAD + rows(np.add(ROWS[::2], [50.0, -2.0, 0.0])),
    "a drift taken off": HEAD + rows(ROWS - np.outer(TIME, [0.0, 0.0, 0.02])),
    "another zero, gain and place of the columns": "force_N,depth_mm,time_s\n" + rows(ROWS[:, ::-1] * 1.03 + 0.1),
    "without the first second, rounded": HEAD + rows(ROWS[100:], places=3),
}
OWN_NOISE = {
    "white": lambda noise: 0.003 * noise,
    "of a filter": lambda noise: 0.01 * np.convolve(noise, np.ones(10) / 10.0, "same"),
    "with hum": lambda noise: 0.001 * noise + 0.02 * np.sin(2.0 * np.pi * 13.0 * TIME + noise[0]),
    "of a coarse sensor": lambda noise: 0.005 * np.round((force_of(TIME) + 0.002 * noise) / 0.005) - force_of(TIME),
}


@pytest.mark.parametrize("how", RESAVED)
def test_readings_saved_again_are_no_repeat(tmp_path, how):
    first, again = written(tmp_path, HEAD + rows(), "A.csv"), written(tmp_path, RESAVED[how], "B.csv")
    with pytest.raises(nf.InputError, match=r"B\.csv: content of the file is the same readings, .*A\.csv, given twice"):
        nf.identify([nf.read(first), nf.read(again)])


@pytest.mark.parametrize("kind", OWN_NOISE)
def test_repeats_with_noise_of_their_own_are_repeats(tmp_path, kind, many):
    runs = []
    for seed in range(many(5, 60)):
        force = force_of(TIME) + OWN_NOISE[kind](np.random.default_rng(seed).normal(size=len(TIME)))
        runs.append(nf.read(written(tmp_path, HEAD + rows(np.column_stack([TIME, DEPTH, force])), f"{seed}.csv")))
    assert copies(runs) == {}


def test_repeats_of_the_rig_are_no_copies(recordings):
    runs = [nf.read(path) for path in sorted((recordings / "needle-insertion-rig").glob("*_[1-5]_2024*.csv"))]
    assert len(runs) > 50 and copies(runs) == {}


def test_public_case_06(recordings):
    runs = [nf.read(case(recordings, "06-resaved-repeats") / f"{name}.csv") for name in "ABC"]
    with pytest.raises(nf.InputError, match="the same readings, saved in another way"):
        nf.identify(runs)
    outcome = {
        each.file: each for each in campaign(case(recordings, "06-resaved-repeats"), pattern="{repeat}").recordings
    }
    assert [each.kind for name in ("B.csv", "C.csv") for each in outcome[name].anomalies] == ["copy", "copy"]


# --- a force without its sign next to a signed one

FREE = np.where(TIME < 0.5, -1.0 + TIME, 0.0)  # the stage moves before its depth is counted from zero


@pytest.mark.parametrize(
    "headers, columns",
    [
        ("time_s,depth_mm,rf3_N,absolute_force_N", "tzfa"),
        ("time_s,depth_mm,absolute_force_N,rf3_N", "tzaf"),
        ("Time [s],Depth [mm],Sensor A [N],Force magnitude [N]", "tzfa"),
        ("Time [s],Depth [mm],|Force| [N],Sensor A [N]", "tzaf"),
        ("t,z_mm,channel_2_N,force_abs_N", "tzfa"),
        ("time_s,depth_mm,Fz_N,abs_Fz_N", "tzfa"),
        ("time_s,depth_mm,Force_N,Reaction_N", "tzaf"),
        ("Zeit [s],Weg [mm],Kraft Betrag [N],Kanal 3 [N]", "tzaf"),
        ("time_s,depth_mm,load_mN,cell_mN", "tzAF"),
        ("time_s,insertion_depth_mm,u3_mm,rf3_N,absolute_force_N", "tczfa"),
        ("time_s,depth_mm,rf3,absolute_force", "tzfa"),
        ("time_s,depth_mm,absolute_force,comment,rf3,rf2", "tzaZfr"),
    ],
)
def test_the_signed_force_is_taken_and_said(tmp_path, headers, columns):
    data = {"t": TIME, "z": DEPTH, "f": FORCE, "a": np.abs(FORCE), "A": 1e3 * np.abs(FORCE), "F": 1e3 * FORCE}
    data |= {"Z": 0.0 * TIME, "r": 0.1 * FORCE}
    data |= {"c": np.maximum(DEPTH - 2.0, 0.0)}
    table = np.column_stack([data[each] for each in columns])
    run = nf.read(written(tmp_path, headers + "\n" + rows(table)), baseline=False)
    check(run)
    said = [each for each in run.card.assumptions if "whose absolute value is" in each]
    assert len(said) == ("Fz" not in headers)


def test_a_force_without_a_signed_one_is_read_as_it_is(tmp_path):
    table = np.column_stack([TIME, DEPTH, np.abs(FORCE), 0.1 * FORCE])
    run = nf.read(written(tmp_path, "time_s,depth_mm,force_N,other_N\n" + rows(table)), baseline=False)
    check(run, force=np.abs(FORCE))


def test_public_case_07(recordings):
    run = nf.read(case(recordings, "07-two-force-columns") / "two.csv")
    assert contact_mm(run) == pytest.approx(3.0, abs=0.05)
    fit = nf.identify(run)
    assert 1e3 * fit.parameters["friction_per_length"].value * 1e-3 == pytest.approx(30.0, rel=0.02)


# --- why there is no contact


def stepped(at, by, size=0.003):
    """The insertion with a zero that steps; its contact is at 1.25 s, its puncture at 2.25 s."""
    noise = size * np.random.default_rng(3).normal(size=len(TIME))
    return force_of(TIME) + noise + np.where(TIME < at, -by, 0.0)


@pytest.mark.parametrize(
    "at, by",
    [(at, by) for at in (0.3, 0.7, 1.0, 1.15) for by in (-0.4, -2.0, -10.0)]
    + [(at, by) for at in (0.3, 0.7, 1.8, 2.8, 3.1, 4.2, 5.5, 6.4, 7.2) for by in (0.1, 0.3, 2.0)]
    + [(at, -0.2) for at in (1.8, 2.8, 3.1, 4.2, 5.5, 6.4, 7.2)],
)
def test_a_zero_that_steps_is_named(at, by):
    events = nf.segment((TIME, 1e-3 * DEPTH, stepped(at, by)))
    found = [re.search(r"steps by .*? at ([\d.]+) s", each) for each in events.notes]
    assert at in [pytest.approx(float(each[1]), abs=0.011) for each in found if each], events.notes
    assert not any("the sensor drifts" in each or "is not that of the tip" in each for each in events.notes)


@pytest.mark.parametrize("by", [0.1, 0.3, 1.0, -0.1, -1.0])
def test_a_zero_that_drifts_does_not_step(by, many):
    for seed in range(many(3, 40)):
        noise = 0.003 * np.random.default_rng(seed).normal(size=len(TIME))
        notes = nf.segment((TIME, 1e-3 * DEPTH, force_of(TIME) + noise + by * TIME / TIME[-1])).notes
        assert not any("steps" in each and "or drifts" not in each for each in notes)
        assert any("drifts" in each for each in notes)


@pytest.mark.parametrize("at", [1.0, 2.0, 2.5, 3.2, 4.1])
def test_a_channel_that_dies_is_named(at):
    force = stepped(0.0, 0.0)
    notes = nf.segment((TIME, 1e-3 * DEPTH, np.where(TIME < at, force, force[np.searchsorted(TIME, at)]))).notes
    assert any("from" in each and "the channel is dead" in each for each in notes), notes


@pytest.mark.parametrize("value", [0.0, 0.013, -5.2])
@pytest.mark.parametrize("flips", [0, 3])
def test_a_dead_channel_is_named(value, flips):
    force = np.full(len(TIME), value)
    force[100 : 100 + flips] += 1e-4
    note = nf.segment((TIME, 1e-3 * DEPTH, force)).notes[0]
    assert "The force is constant" in note and "dead" in note


@pytest.mark.parametrize("zero", [0.0, -0.5])
@pytest.mark.parametrize("stiffness", [5.0, 60.0])
def test_a_negative_force_is_named(zero, stiffness):
    """Pressed to a break, after which the fixture moves freely."""
    depth = np.linspace(0.0, 0.22, 450)
    force = np.append(zero - stiffness * depth, stiffness * np.array([0.01, 0.03, 0.0, 0.0]))
    depth = np.append(depth, [0.3, 0.6, 0.61, 0.62])
    force = force + 0.005 * np.random.default_rng(0).normal(size=len(force))
    events = nf.segment((0.05 * np.arange(len(force)), 1e-3 * depth, force))
    assert events.contact is None and "The force is negative, down to" in events.notes[0]


def test_a_coarse_sensor_that_drifts_does_not_step(many):
    """By a quantum and by two before the contact."""
    for seed in range(many(5, 100)):
        noise = 0.001 * np.random.default_rng(seed).normal(size=len(TIME))
        force = np.round((force_of(TIME) + noise + 0.03 * np.minimum(TIME, 1.2)) / 0.02) * 0.02
        assert not any("baseline changes" in each for each in nf.segment((TIME, 1e-3 * DEPTH, force)).notes)


def test_noise_alone_has_no_other_cause(many):
    for seed in range(many(20, 500)):
        force = 0.01 * np.random.default_rng(seed).normal(size=len(TIME))
        events = nf.segment((TIME, 1e-3 * DEPTH, force))
        assert events.contact is not None or "never exceeds the noise" in events.notes[0], events.notes


@pytest.mark.parametrize(
    "name, words",
    [("rezero", "by −0.39"), ("constant", "constant, 0.013"), ("negative_force", "negative, down to −15.4")],
)
def test_public_case_19(recordings, name, words):
    events = nf.segment(nf.read(case(recordings, "19-no-contact-wrong-cause") / f"{name}.csv"))
    assert events.contact is None and words in events.notes[0]


# --- bench tests with rows that are no readings


@pytest.mark.parametrize("sep", ["\t", ";", ","])
@pytest.mark.parametrize("places", [[100], [100, 101, 200], [1, 299]])
@pytest.mark.parametrize("row", ["Axial Counts{0}0{0}", "{0}{0}", "note{0}0.5{0}"])
def test_bench_tests_leave_out_what_a_recording_does(tmp_path, sep, places, row):
    lines = [f"{k}{sep}{z:.4f}{sep}{10.0 * z:.4f}" for k, z in enumerate(DEFLECTION)]
    for place in sorted(places, reverse=True):
        lines.insert(place, row.format(sep))
    head = f"Points{sep}Deflection{sep}Load\n{sep}mm{sep}N\n"
    found, notes = read_bending(written(tmp_path, head + "\n".join(lines) + "\n"), three_point=True)
    assert found["deflection"] == pytest.approx(1e-3 * DEFLECTION) and found["force"] == pytest.approx(
        10.0 * DEFLECTION
    )
    assert any(f"{len(places)} of {301 + len(places)} rows have a missing value" in each for each in notes)
    head = head.replace("Deflection", "Displacement")
    curve, notes = read_stress(written(tmp_path, head + "\n".join(lines) + "\n"), area=1e-4, gauge_length=0.02)
    assert curve.stress == pytest.approx(1e5 * DEFLECTION) and curve.stretch == pytest.approx(1.0 + 0.05 * DEFLECTION)
    assert any("have a missing value" in each for each in notes)


def test_bench_tests_refuse_many_missing_values(tmp_path):
    lines = [f"{z:.4f},{10.0 * z:.4f}" if k % 20 else f"{z:.4f}," for k, z in enumerate(DEFLECTION)]
    with pytest.raises(nf.InputError, match="16 of 301 rows have no value, and at most 1 % may"):
        read_bending(written(tmp_path, "deflection_mm,force_N\n" + "\n".join(lines) + "\n"), three_point=True)


def test_public_case_14(recordings):
    found, notes = read_bending(case(recordings, "14-text-rows-in-bending") / "text_rows.txt", three_point=True)
    slope = np.polyfit(found["deflection"], found["force"], 1)[0]
    assert slope * 0.08**3 / 48.0 == pytest.approx(0.08, rel=0.01)
    assert any("2 of 302 rows have a missing value" in each for each in notes)
