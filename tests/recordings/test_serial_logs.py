# SPDX-License-Identifier: Apache-2.0
"""Logs of microcontrollers and robots: named values in each line, stamps in two columns, headers in any encoding."""

import numpy as np
import pytest

import needleforce as nf

TIME = np.arange(1000) / 100.0
DEPTH_MM = 2.0 * TIME
FORCE_N = np.round(0.05 * np.clip(DEPTH_MM - 5.0, 0.0, None), 6)
EPOCH = 1_700_000_000
ROWS = list(zip(TIME, FORCE_N, DEPTH_MM))


def check(run, time_tolerance=1e-9):
    np.testing.assert_allclose(run.time - run.time[0], TIME, atol=time_tolerance)
    np.testing.assert_allclose(run.depth, 1e-3 * DEPTH_MM, atol=1e-9)
    np.testing.assert_allclose(run.force, FORCE_N, atol=1e-9)


def clock(seconds):
    return f"17:38:{int(seconds):02d}.{round(1000 * (seconds % 1)):03d}"


@pytest.mark.parametrize(
    "line",
    [
        lambda t, f, x: f"t={1000 * t:.0f}ms;F={f:.6f}N;x={x:.3f}mm",
        lambda t, f, x: f"time:{1000 * t:.0f} force:{f:.6f} pos:{x:.3f}",
        lambda t, f, x: f"t = {t:.3f} s | Fz = {1000 * f:.3f} mN | z = {x:.3f} mm",
        lambda t, f, x: f"Time(ms): {1000 * t:.0f}, Load(N): {f:.6f}, Displacement(mm): {x:.3f}",
        lambda t, f, x: f"t={1000 * t:.0f}ms;F={f:.6f}N;x={x:.3f}mm".replace(".", ","),
        lambda t, f, x: f"{clock(t)} -> Force:{f:.6f},Depth:{x:.3f}",
        lambda t, f, x: f"t={t:.3f};x={x:.3f}mm;" + (f"F={1000 * f:.3f}mN" if f < 0.1 else f"F={f:.6f}N"),
    ],
)
@pytest.mark.parametrize("first", ["", "Booting v1.2\r\n"])
def test_lines_that_name_their_values(file, line, first):
    run = nf.read(file(first + "\r\n".join(line(*row) for row in ROWS) + "\r\n"))
    check(run)
    assert [n.count for n in run.notes if "'Booting v1.2'" in n.message] == [1] * bool(first)


def test_a_serial_plotter_without_time_and_a_truncated_line(file):
    path = file("".join(f"Force:{f:.6f},Depth:{x:.3f}\n" for _, f, x in ROWS) + "Force:0.1")
    check(nf.read(path, rate=100.0))


def test_a_unit_of_another_kind_is_an_error_with_its_line(file):
    lines = [f"t={t:.3f}s F={f:.6f}N x={x:.3f}mm" for t, f, x in ROWS]
    lines[500] = "t=5.000s F=0.25mm x=10.000mm"
    with pytest.raises(nf.InputError, match=r"line 501: unit of F is 'mm', it was 'N' before"):
        nf.read(file("\n".join(lines)))


NS = np.round(1e9 * TIME).astype(np.int64)


@pytest.mark.parametrize(
    ("headers", "stamps"),
    [
        (["header.stamp.sec", "header.stamp.nanosec"], [EPOCH + NS // 10**9, NS % 10**9]),
        (["sec", "nsec"], [EPOCH + NS // 10**9, NS % 10**9]),
        (["tv_sec", "tv_usec"], [EPOCH + NS // 10**9, NS % 10**9 // 1000]),
        (["%time", "field.header.stamp"], [EPOCH * 10**9 + NS] * 2),
        (["stamp_ns"], [EPOCH * 10**9 + NS]),
        (["stamp"], [EPOCH * 1000 + NS // 10**6]),
        (["timestamp_us"], [NS // 1000]),
        (["time"], [1_500_000_000 + NS // 1000]),  # a counter of microseconds that is as large as a date
    ],
)
def test_stamps(file, headers, stamps):
    text = ",".join([*headers, "force_N", "depth_mm"]) + "\n"
    text += "".join(",".join(map(str, row)) + "\n" for row in zip(*stamps, FORCE_N, DEPTH_MM))
    check(nf.read(file(text)), 3e-7)  # the spacing of numbers of this size


HEADS = {
    "cp932": ["時間[s]", "荷重[N]", "変位[mm]"],
    "gb18030": ["时间[s]", "载荷[N]", "位移[mm]"],
    "cp1251": ["Время", "Сила", "Перемещение"],
    "cp1252": ["Zeit [s]", "Kräfte [N]", "Länge [mm]"],
    "mac_roman": ["temps (s)", "effort (N)", "déplacement (mm)"],
}


@pytest.mark.parametrize("encoding", HEADS)
@pytest.mark.parametrize("delimiter", [",", ";", "\t", "  "])
@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
def test_headers_of_any_encoding_do_not_stop_numbers(file, encoding, delimiter, line_end):
    lines = [HEADS[encoding][1], delimiter.join(HEADS[encoding])]
    lines += [delimiter.join(f"{value:.6f}" for value in row) for row in ROWS]
    path = file(line_end.join(lines).encode(encoding) + line_end.encode())
    columns, units = {"time": 1, "force": 2, "depth": 3}, {"time": "s", "force": "N", "depth": "mm"}
    check(nf.read(path, columns=columns, units=units))
    if encoding != "cp1251" and delimiter != "  ":  # its headers have no units
        check(nf.read(path))


def test_numbers_after_a_blank_row_that_do_not_continue_are_no_samples(file):
    text = "Time [s],Force [N],Depth [mm]\n" + "".join(f"{t:.3f},{f:.6f},{x:.3f}\n" for t, f, x in ROWS)
    run = nf.read(file(text + "\n4.995,0.281,9.990\n2.888,0.252,5.777\n"))
    check(run)
    assert any(note.message.startswith("2 rows below the table are no samples") for note in run.notes)
    continued = "\n10.000,0.75,20.000\n10.010,0.7505,20.020\n"
    assert len(nf.read(file(text + continued)).time) == 1002


@pytest.mark.parametrize("header", ["Deformation [mm]", "Gap [mm]", "Spalt (mm)", "Verformung in mm"])
def test_words_that_are_a_depth_if_no_other_is(file, header):
    text = f"Time [s],Force [N],{header}\n" + "".join(f"{t:.3f},{f:.6f},{x:.3f}\n" for t, f, x in ROWS)
    check(nf.read(file(text)))
    both = f"Time [s],Force [N],{header},Position [mm]\n"
    both += "".join(f"{t:.3f},{f:.6f},{0.5 * x:.4f},{x:.3f}\n" for t, f, x in ROWS)
    check(nf.read(file(both)))


def test_a_deformation_that_is_a_ratio_is_no_depth(file):
    text = "Time [s],Force [N],Deformation [%]\n" + "".join(f"{t:.3f},{f:.6f},{x:.3f}\n" for t, f, x in ROWS)
    with pytest.raises(nf.InputError, match="no column holds the depth"):
        nf.read(file(text))


def test_a_line_with_other_names_is_no_sample_and_states_a_speed(file):
    lines = "\n".join(f"Time:{t:.3f} Force:{f:.6f}" for t, f, _ in ROWS)
    path = file(f"Stage speed: 2.00 mm/s\n{lines}\n")
    with pytest.raises(nf.InputError, match=r"--speed-mm-s 2 if the needle moved at 'Stage speed: 2\.00 mm/s'"):
        nf.read(path)
    check(nf.read(path, speed=2e-3))


def test_a_sign_of_thousands_in_some_lines_is_refused(file):
    path = file("".join(f"t={t:.2f} F={1e4 * f:,.0f} z={x:.2f}\n" for t, f, x in ROWS))
    with pytest.raises(nf.InputError, match=r"line 351: .*F=1,000.*one may be a sign of thousands"):
        nf.read(path, columns={"depth": "z"})
