# SPDX-License-Identifier: Apache-2.0
"""Headers with keywords under them, stray cells next to them, and units that do not fit or stand for a name: for each
the public case, and further files of its kind, by value."""

import numpy as np
import pytest
from odd_insertion import DEFLECTION, DEPTH, FORCE, HEAD, TIME, case, check, contact_mm, rows, written

import needleforce as nf
from needleforce.bench_tests.reading import read_stress

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


def next_to(lines, cells, first=0, gap=1, sep="\t", pad=False):
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
    path = written(tmp_path, next_to(TAB, cells, first, gap, pad=pad), "run.txt")
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
