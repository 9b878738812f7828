# SPDX-License-Identifier: Apache-2.0
"""Files as laboratories have them, by value: for each fault of public files the public case, and further ones of its
kind made from one insertion whose depth and force are known at every time."""

from itertools import pairwise

import numpy as np
import pytest
from nptdms import ChannelObject, TdmsWriter

import needleforce as nf
from needleforce.bench_tests.reading import read_bending, read_stress
from needleforce.campaign import campaign
from needleforce.identification import fit_indentation

CONTACT, PUNCTURE, PEAK = 3.0, 7.0, 0.8  # mm, mm, N


def depth_of(time):
    """4 mm/s from 0.5 s on to 12 mm, a rest of 1 s, and back [mm]."""
    return np.clip(np.minimum(4.0 * (time - 0.5), 12.0 - 4.0 * (time - 4.5)), 0.0, 12.0)


def force_of(time):
    """A parabola up to the puncture, cutting and friction after it, friction alone on the way back [N]."""
    depth, back = depth_of(time), time > 4.5
    inside = np.where(depth > PUNCTURE, 0.3 + 0.03 * (depth - CONTACT), 0.05 * (depth - CONTACT) ** 2)
    return np.where(depth < CONTACT, 0.0, np.where(back, -0.03 * (depth - CONTACT), inside))


TIME = np.arange(0.0, 8.0, 0.01)
DEPTH = depth_of(TIME)
FORCE = force_of(TIME) + 0.003 * np.random.default_rng(11).normal(size=len(TIME))
ROWS = np.column_stack([TIME, DEPTH, FORCE])
DEFLECTION = 0.004 * np.arange(301)


def rows(table=ROWS, sep=",", decimal=".", places=5, end="\n"):
    return "".join(sep.join(f"{v:.{places}f}".replace(".", decimal) for v in row) + end for row in table)


def written(tmp_path, text, name="run.csv"):
    path = tmp_path / name
    path.write_bytes(text.encode())
    return path


def check(run, time=TIME, *, force=FORCE, atol=2e-5):
    """All readings are there, each in its place."""
    assert len(run) == len(time)
    assert run.time - run.time[0] == pytest.approx(time - time[0], abs=1e-6)
    assert 1e3 * run.depth == pytest.approx(depth_of(time), abs=1e3 * atol)
    assert run.force == pytest.approx(force, abs=atol)


def case(recordings, name):
    found = recordings / "public-cases" / name
    if not found.exists():
        pytest.skip(f"no {found}")
    return found


def contact_mm(run):
    return 1e3 * nf.segment(run).contact.depth


# --- waveforms that start at different times

START = np.datetime64("2024-03-01T10:00:00.000000")


def tdms(path, force, motion, groups=("Rig", "Rig"), more=()):
    """Channels with (start [s], offset [s], step [s], values, unit); the start may be None."""

    def channel(group, name, start, offset, step, values, unit):
        facts = {"wf_increment": step, "wf_start_offset": offset, "unit_string": unit}
        if start is not None:
            facts["wf_start_time"] = START + np.timedelta64(round(1e6 * start), "us")
        return ChannelObject(group, name, values, facts)

    channels = [channel(groups[0], "Fz", *force), channel(groups[1], "Position", *motion)]
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


def test_public_case_01(recordings):
    run = nf.read(case(recordings, "01-tdms-start-times") / "same.tdms")
    assert contact_mm(run) == pytest.approx(3.0, abs=0.15)
    puncture = nf.segment(run).punctures[0]
    assert (1e3 * puncture.depth, puncture.force) == pytest.approx((7.0, 0.8), abs=0.1)


# --- repeats that are the same readings, saved in another way

HEAD = "time_s,depth_mm,force_N\n"
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
}


@pytest.mark.parametrize("how", RESAVED)
def test_readings_saved_again_are_no_repeat(tmp_path, how):
    first, again = written(tmp_path, HEAD + rows(), "A.csv"), written(tmp_path, RESAVED[how], "B.csv")
    with pytest.raises(nf.InputError, match=r"B\.csv: content of the file is the same readings, .*A\.csv, given twice"):
        nf.identify([nf.read(first), nf.read(again)])


@pytest.mark.parametrize("seed", range(3))
def test_repeats_with_noise_of_their_own_are_repeats(tmp_path, seed):
    noise = np.random.default_rng(seed).normal(size=len(TIME))
    other = np.column_stack([TIME, DEPTH, force_of(TIME) + 0.003 * noise])
    first, again = written(tmp_path, HEAD + rows(), "A.csv"), written(tmp_path, HEAD + rows(other), "B.csv")
    assert len(nf.identify([nf.read(first), nf.read(again)]).recordings) == 2


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


# --- lines under the header, and lines that state a value


NAMES = "Time [s];Depth [mm];Force [N]\n"
BARE = "Time;Depth;Force\n"


@pytest.mark.parametrize(
    "above, sep, decimal, start",
    [
        (NAMES + "eoh\n", ";", ".", 3),
        (NAMES + "DATA\n", ";", ",", 3),
        ("Measurement routine\n01.01.2025\n\n" + NAMES + "eoh\n", ";", ",", 6),
        ((NAMES + "[Data]\n").replace(";", "\t"), "\t", ",", 3),
        (BARE + "s;mm;N\n-----\n", ";", ".", 4),
        ((BARE + "s;mm;N\nbegin of data\n").replace(";", ","), ",", ".", 4),
        (NAMES + "\nstart\n\n", ";", ".", 5),
        (
            NAMES.replace(";", "  ").replace(" [s]", "_s").replace(" [mm]", "_mm").replace(" [N]", "_N") + "DATA\n",
            " ",
            ".",
            3,
        ),
        (NAMES + "OPERATOR = Miller\nMODE = fast\n", ";", ".", 4),
        (NAMES + "RATE = 100 Hz\nGAIN = 2\n", ";", ".", 4),
        (BARE.replace(";", " ") + "RATE: 100 Hz\nGAIN= 2\n", " ", ".", 3),
        (BARE.replace(";", " ") + "eoh\n[s] [mm] [N]\n", " ", ".", 3),
        (BARE.replace(";", " ") + "800\n", " ", ".", 3),
        (NAMES + "Block 1\n", ";", ".", 3),
        (BARE.replace(";", " ") + "SAMPLES = 800\n", " ", ".", 3),
    ],
)
def test_a_keyword_between_header_and_rows_is_passed(tmp_path, above, sep, decimal, start):
    look = nf.read(written(tmp_path, above + rows(sep=sep, decimal=decimal), "run.txt"), baseline=False, dry_run=True)
    assert [each.quantity for each in look.columns] == ["time", "depth", "force"], look.problem
    check(look.recording)


@pytest.mark.parametrize(
    "lines, unit",
    [
        (["SAMPLE_RATE = 100 Hz", "FORCE_UNIT = mN", "DEPTH_UNIT = mm"], "mN"),
        (["Sampling rate = 100", "Units = mm, mN"], "mN"),
        (["FS = 100 Hz", "Unit of force = cN", "Unit of position = mm"], "cN"),
        (["DT = 10 ms", "Force unit = N", "Position unit = mm"], "N"),
        (["SAMPLE_INTERVAL = 0.01 s", "FORCE UNIT = gf", "DISPLACEMENT UNIT = mm"], "gf"),
        (["Abtastrate = 100 Hz", "Krafteinheit = mN", "Wegeinheit = mm"], "mN"),
        (["RATE = 100 Hz", "UNITS = mm mN"], "mN"),
        (["Acquisition rate = 0.1 kHz", "Load units = N", "Extension units = mm"], "N"),
        (["LOG_INTERVAL = 10 ms", "FORCE_UNITS = kN", "POSITION_UNITS = mm"], "kN"),
        (["TimeStep = 0.01", "Units = mm, N"], "N"),
    ],
)
@pytest.mark.parametrize("under", [False, True])
@pytest.mark.parametrize("sep", [";", "\t", " "])
def test_lines_that_state_rate_and_units(tmp_path, lines, unit, under, sep):
    size = {"N": 1.0, "mN": 1e-3, "cN": 1e-2, "gf": 9.80665e-3, "kN": 1e3}[unit]
    header, stated = sep.join(("Depth", "Force")) + "\n", "".join(f"{each}\n" for each in lines)
    table = rows(np.column_stack([DEPTH, FORCE / size]), sep=sep, places=8)
    path = written(tmp_path, (header + stated if under else stated + header) + table, "run.txt")
    check(nf.read(path, baseline=False))


def test_public_case_11(recordings):
    look = nf.read(case(recordings, "11-keyword-line-after-header") / "eoh.txt", dry_run=True)
    assert [each.header for each in look.columns] == ["Position[mm]", "Load[N]", "Time[ms]"]
    assert [each.quantity for each in look.columns] == ["depth", "force", "time"]
    assert contact_mm(look.recording) == pytest.approx(3.0, abs=0.05)


# --- stray cells to the right of a table


def beside(lines, cells, first=0, gap=1, sep="\t", pad=False):
    """Lines with further cells beyond ``gap`` empty ones, from the line ``first`` on; ``pad`` fills all other lines."""
    width, out = max(len(each.split(sep)) for each in lines), []
    for k, line in enumerate(lines):
        own = line.split(sep) if line else []
        more = cells[k - first] if 0 <= k - first < len(cells) else None
        if more is not None:
            own = [*own, *[""] * (width - len(own) + gap), *more]
        elif pad:
            own = [*own, *[""] * (width - len(own) + gap + len(cells[0]))]
        out.append(sep.join(own))
    return "\n".join(out) + "\n"


TAB = [*"Title\n\nPoints\tTime\tDisp\tLoad\n\tsec\tmm\tN".split("\n")]
TAB += [f"{k + 1}\t" + line for k, line in enumerate(rows(sep="\t").split("\n")[:-1])]
PAIRS = [[f"{0.01 * k:.3f}", f"{0.1 * k:.2f}"] for k in range(900)]


@pytest.mark.parametrize(
    "first, cells, gap, pad",
    [
        (3, PAIRS[:41], 2, True),
        (3, PAIRS[:41], 2, False),
        (4, PAIRS[:40], 1, True),
        (4, PAIRS[:40], 1, False),
        (100, PAIRS[:40], 1, True),
        (100, PAIRS[:40], 1, False),
        (764, PAIRS[:40], 2, False),
        (4, PAIRS[:1], 3, False),
        (10, [["seen"], ["here"]], 1, False),
        (4, [["max", "0.8"], ["min", "-0.3"]], 1, True),
        (0, [["peak", "0.8"]] * 3, 2, False),
        (3, PAIRS[:801], 1, False),
    ],
)
def test_cells_beyond_an_empty_column_change_nothing(tmp_path, first, cells, gap, pad):
    path = written(tmp_path, beside(TAB, cells, first, gap, pad=pad), "run.txt")
    look = nf.read(path, baseline=False, dry_run=True)
    assert [each.header for each in look.columns][:4] == ["Points", "Time", "Disp", "Load"], look.problem
    assert [each.quantity for each in look.columns][:4] == ["", "time", "depth", "force"]
    assert look.columns[0].first == 1.0 and not look.problem
    check(look.recording)


def test_decimal_commas_between_commas_are_still_refused(tmp_path):
    text = rows().replace("0.00350", "0,00350", 1)
    with pytest.raises(nf.InputError, match="number of cells"):
        nf.read(written(tmp_path, HEAD + text.replace("\n1.00000,", "\n1.00000,1,", 1)))


def test_public_case_13(recordings):
    path = case(recordings, "13-stray-cells-in-header") / "stray.txt"
    look = nf.read(path, dry_run=True)
    headers = ["Points", "Elapsed Time", "Scan Time", "Disp 1", "Load 1", "Load 2"]
    assert [each.header for each in look.columns][:6] == headers
    assert (look.columns[0].count, look.columns[0].first) == (375, 1.0)
    columns = {"time": "Elapsed Time", "depth": "Disp 1", "force": "Load 1"}
    assert contact_mm(nf.read(path, columns=columns)) == pytest.approx(3.0, abs=0.05)


# --- segments: back in time, at rest first, or chosen by a column


TURN = 450  # the row at which the needle turns


def segments(order, *, clock="whole", table=ROWS, labels=("extend", "pause", "retract")):
    """A text with a comment above each segment; ``order`` has (first, stop, -1 for rows from the last on)."""
    out = []
    for k, (first, stop, way) in enumerate(order):
        part = table[first:stop].copy()
        part[:, 0] -= 0.0 if clock == "whole" else part[0, 0]
        out.append(f"\n#\n# segmentIndex: {k}\n# segment: {labels[k]}\n# columns: time depth force\n# units: s mm N\n")
        out.append(rows(part[::way], sep=" "))
    return "".join(out)


@pytest.mark.parametrize("clock", ["whole", "each"])
@pytest.mark.parametrize(
    "order",
    [
        [(0, TURN, 1), (TURN, 800, -1)],
        [(0, TURN, -1), (TURN, 800, -1)],
        [(0, TURN, -1), (TURN, 800, 1)],
        [(0, 350, 1), (350, TURN, 1), (TURN, 800, -1)],
        [(0, 350, 1), (350, TURN, -1), (TURN, 800, -1)],
        [(0, 40, 1), (40, TURN, 1), (TURN, 800, -1)],
    ],
)
def test_segments_that_run_back_in_time_are_turned(tmp_path, order, clock):
    run = nf.read(written(tmp_path, segments(order, clock=clock), "curve.txt"), baseline=False)
    check(run)
    turned = sum(way < 0 for _, _, way in order)
    assert any("runs back" in each.message and each.count == turned for each in run.notes)


@pytest.mark.parametrize("columns", ["time_s,depth_mm,force_N", "Time [s],Height [mm],Signal [N]"])
def test_a_whole_file_that_runs_back_is_turned(tmp_path, columns):
    check(nf.read(written(tmp_path, columns + "\n" + rows(ROWS[::-1])), baseline=False))


@pytest.mark.parametrize("rest", [25, 40, 49])
def test_a_first_phase_at_rest_is_no_recording(tmp_path, rest):
    """Each phase has a clock of its own, from zero."""
    table = ROWS.copy()
    table[rest:, 0] -= table[rest, 0]
    run = nf.read(written(tmp_path, HEAD + rows(table)), baseline=False)
    check(run)
    assert any(each.kind == "phases" for each in run.notes)


def test_repeats_one_below_the_other_are_still_apart(tmp_path):
    again = np.column_stack([TIME, DEPTH, force_of(TIME) + 0.003 * np.random.default_rng(5).normal(size=len(TIME))])
    assert len(nf.read_all(written(tmp_path, HEAD + rows() + rows(again)))) == 2


SEGMENT = np.where(DEPTH <= 0.0, 0, np.where(TIME < 3.5, 1, np.where(TIME < 4.5, 2, 3)))
STEPS = np.array(["rest", "approach", "hold", "withdraw"])[SEGMENT]


@pytest.mark.parametrize(
    "header, labels, wanted, value",
    [
        ("segment", SEGMENT, {"segment": "1"}, 1),
        ("segment", SEGMENT, {"segment": 1}, 1),
        ("Segment", [f"{each:.3e}" for each in SEGMENT], {"Segment": "3"}, 3),
        ("Step", STEPS, {"Step": "approach"}, 1),
        ("phase", STEPS, {"phase": "withdraw"}, 3),
        ("state", STEPS, {"state": "hold"}, 2),
    ],
)
def test_a_segment_is_chosen_by_a_column(tmp_path, header, labels, wanted, value):
    lines = [f"{label},{line}" for label, line in zip(labels, rows().splitlines(), strict=True)]
    path = written(tmp_path, f"{header},{HEAD}" + "\n".join(lines) + "\n")
    kept = value == SEGMENT
    if value == 2:  # the needle rests
        with pytest.raises(nf.InputError, match="the needle must move"):
            nf.read(path, segment=wanted)
        return
    run = nf.read(path, segment=wanted, baseline=False, inwards="increasing", units={"force": "+N"})
    check(run, TIME[kept], force=FORCE[kept])


@pytest.mark.parametrize("header, names", [("segment", "01234"), ("phase", ["rest", "in", "hold", "out", "end"])])
@pytest.mark.parametrize("back", [(), (3,), (1, 3)])
@pytest.mark.parametrize("repeats", [1, 2])
def test_segments_with_clocks_of_their_own_are_one_recording(tmp_path, header, names, back, repeats):
    """Those in ``back`` are saved from their last row on."""
    ends = [0, *(np.flatnonzero(np.diff(SEGMENT)) + 1).tolist(), len(TIME)]
    lines = []
    for k, (first, stop) in enumerate(pairwise(ends)):
        part = ROWS[first:stop] - [TIME[first], 0.0, 0.0]
        part = part[:: -1 if k in back else 1]
        lines += [f"{names[k]},{line}" for line in rows(part).splitlines()]
    path = written(tmp_path, f"{header},{HEAD}" + "\n".join(lines * repeats) + "\n")
    runs = nf.read_all(path, baseline=False)
    assert len(runs) == repeats and sum(map(len, runs)) == repeats * len(TIME)
    assert np.concatenate([run.force for run in runs]) == pytest.approx(np.tile(FORCE, repeats), abs=2e-5)
    if repeats == 1:
        check(runs[0])


@pytest.mark.parametrize("wanted", [{"segment": "retract"}, {"segmentIndex": "1"}])
def test_a_segment_is_chosen_by_the_comment_above_it(tmp_path, wanted):
    text = segments([(0, TURN, 1), (TURN, 800, -1)], labels=("extend", "retract"))
    run = nf.read(written(tmp_path, text), segment=wanted, baseline=False, inwards="increasing", units={"force": "+N"})
    check(run, TIME[TURN:], force=FORCE[TURN:])


@pytest.mark.parametrize(
    "wanted, message",
    [({"segment": "no"}, "never no, it contains extend, retract"), ({"part": "1"}, "the columns are")],
)
def test_a_segment_that_is_absent_is_refused(tmp_path, wanted, message):
    text = segments([(0, TURN, 1), (TURN, 800, -1)], labels=("extend", "retract"))
    with pytest.raises(nf.InputError, match=message):
        nf.read(written(tmp_path, text), segment=wanted)


def test_public_case_17(recordings):
    path = case(recordings, "17-two-segments-reversed") / "two_segments.out"
    for options in ({}, {"segment": {"segment": "extend"}}):
        run = nf.read(path, test="indentation", baseline=False, **options)
        last = int(run.depth.argmax()) + 1
        fit = fit_indentation(run.depth[:last], run.force[:last], nf.tips.Paraboloid(5e-6))
        assert fit.reduced_modulus.value == pytest.approx(1000.0, rel=0.01)
        assert 1e6 * (fit.contact_depth.value - run.depth[0]) == pytest.approx(1.5, abs=0.02)


# --- a unit of a ratio, and times that are called by their unit


@pytest.mark.parametrize(
    "headers, columns",
    [
        ("Time [s],Displacement [%],Crosshead disp [mm],Load [N]", "tpzf"),
        ("Time [s],Depth [%],LVDT [mm],Load [N]", "tpzf"),
        ("Time [s],Position [%],Position [mm],Load [N]", "tpzf"),
        ("Time [s],Travel (%),Extension (mm),Load (N)", "tpzf"),
        ("Time_s,Depth_%,Laser_mm,Load_N", "tpzf"),
        ("Time [s],Displacement [mm/mm],Stage 2 [mm],Load [N]", "tpzf"),
        ("Time [s],Position [percent],Axis (um),Load [N]", "tpuf"),
        ("Time [s],Depth [mm],Load [%],Cell 2 [N]", "tzqf"),
        ("Time [s],Depth [mm],Force [%],Loadcell reading [N]", "tzqf"),
        ("Time [s],Depth [mm],Force (V),Loadcell (N)", "tzqf"),
    ],
)
def test_a_column_with_a_fitting_unit_is_preferred(tmp_path, headers, columns):
    data = {"t": TIME, "z": DEPTH, "f": FORCE, "p": DEPTH / 0.12, "q": 10.0 * FORCE, "u": 1e3 * DEPTH}
    check(
        nf.read(written(tmp_path, headers + "\n" + rows(np.column_stack([data[k] for k in columns]))), baseline=False)
    )


def test_a_ratio_alone_is_refused_with_its_unit(tmp_path):
    table = np.column_stack([TIME, DEPTH / 0.12, FORCE])
    with pytest.raises(nf.InputError, match="unit of depth is '%'"):
        nf.read(written(tmp_path, "Time [s],Displacement [%],Load [N]\n" + rows(table)))


@pytest.mark.parametrize(
    "header, per_second",
    [
        ("Millis", 1e3), ("millis", 1e3), ("MILLIS", 1e3), ("time_millis", 1e3), ("Time (millis)", 1e3),
        ("elapsed_millis", 1e3), ("Milliseconds", 1e3), ("ms", 1e3), ("msec", 1e3), ("Micros", 1e6),
        ("time_micros", 1e6), ("microseconds", 1e6), ("Seconds", 1.0), ("Timestamp [micros]", 1e6),
    ],
)  # fmt: skip
def test_a_time_is_called_by_its_unit(tmp_path, header, per_second):
    table = np.column_stack([TIME * per_second, DEPTH, FORCE])
    check(nf.read(written(tmp_path, f"{header},depth_mm,force_N\n" + rows(table)), baseline=False))


@pytest.mark.parametrize("header", ["Force (counts),Force setpoint [N]", "Force [%],Target [N]"])
def test_a_target_is_no_force(tmp_path, header):
    table = np.column_stack([TIME, DEPTH, FORCE, FORCE])
    with pytest.raises(nf.InputError, match=r"unit of force is '(counts|%)'"):
        nf.read(written(tmp_path, f"Time [s],Depth [mm],{header}\n" + rows(table)))


@pytest.mark.parametrize(
    "headers, columns",
    [
        ("Extension (%),Extension (mm),Load (N)", "pzf"),
        ("Displacement [%],Crosshead [mm],Force [N]", "pzf"),
        ("Extension [mm],Load [%],Load [N]", "zpf"),
        ("Extension [mm],Load (V),Force (N)", "zpf"),
    ],
)
def test_bench_tests_prefer_a_fitting_unit(tmp_path, headers, columns):
    data = {"z": DEFLECTION, "p": 5.0 * DEFLECTION, "f": 10.0 * DEFLECTION}
    path = written(tmp_path, headers + "\n" + rows(np.column_stack([data[each] for each in columns])))
    curve, _ = read_stress(path, area=1e-4, gauge_length=0.02)
    assert curve.stress == pytest.approx(1e5 * DEFLECTION) and curve.stretch == pytest.approx(1.0 + 0.05 * DEFLECTION)


# --- why there is no contact


def stepped(at, by, size=0.003):
    """The insertion with a zero that steps before the contact, at 1.25 s."""
    noise = size * np.random.default_rng(3).normal(size=len(TIME))
    return force_of(TIME) + noise + np.where(TIME < at, -by, 0.0)


@pytest.mark.parametrize("at", [0.3, 0.7, 1.0, 1.15])
@pytest.mark.parametrize("by", [-0.4, -2.0, -10.0])
def test_a_zero_that_steps_is_named(at, by):
    events = nf.segment((TIME, 1e-3 * DEPTH, stepped(at, by)))
    assert any(f"at {at:g} s" in each and "baseline changes" in each for each in events.notes), events.notes


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
