# SPDX-License-Identifier: Apache-2.0
"""Force curves of atomic force microscopes: JPK and Igor by hand, as their makers describe the formats, and the example
of Nanosurf's library; expected values from the raw numbers."""

import importlib.resources
import struct
import sys
from pathlib import Path

import numpy as np
import pytest

import needleforce as nf
from needleforce.recording.formats.detect import format_of, tables_of

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
from curve_files import BENDING, HEIGHT, RATE_HZ, SENSITIVITY, STIFFNESS, igor_wave, jpk

pytest.importorskip("afmformats")


def in_and_out(values):
    return np.concatenate([values, values[::-1]])


def test_jpk(tmp_path):
    jpk(tmp_path / "a.curve")
    assert format_of(tmp_path / "a.curve").name == "a JPK force curve"
    (table,) = tables_of(tmp_path / "a.curve")
    columns = {header: table.read_column(k) for k, header in enumerate(table.headers)}
    bent, height = SENSITIVITY * 1e-3 * in_and_out(BENDING), 1e-9 * in_and_out(HEIGHT)
    np.testing.assert_allclose(columns["time"], np.arange(800) / RATE_HZ, atol=1e-9)
    np.testing.assert_allclose(columns["force"], STIFFNESS * bent, rtol=1e-9, atol=1e-20)
    np.testing.assert_allclose(columns["tip position"], height + bent, rtol=1e-9)
    run = nf.read(tmp_path / "a.curve", test="indentation")
    assert np.argmax(run.depth) == pytest.approx(399.5, abs=1) and run.force.max() > 0  # inwards although height falls
    assert any("force over 0.05 N/m" in note.message for note in run.notes)


def test_jpk_without_a_calibrated_force(tmp_path):
    jpk(tmp_path / "a.curve", force=False)
    with pytest.raises(nf.InputError, match=r"spring constant is missing.*Calibrate"):
        nf.read(tmp_path / "a.curve")


def columns_of(path):
    (table,) = tables_of(path)
    return {header: table.read_column(k) for k, header in enumerate(table.headers)}, table


def test_a_force_curve_of_igor(tmp_path):
    bent, height = 60e-12 * in_and_out(BENDING), 1e-9 * in_and_out(-HEIGHT)  # more towards the sample
    values = np.stack([height + 1e-9, bent, height], axis=1)
    note = "MicroscopeModel:by hand\rSpringConstant:0.05\rNumPtsPerSec:1000\r"
    (tmp_path / "a.any").write_bytes(igor_wave(values, 1e-3, "m", labels=("Raw", "Defl", "ZSnsr"), note=note))
    assert format_of(tmp_path / "a.any").name == "an Igor wave (ibw)"
    columns, table = columns_of(tmp_path / "a.any")
    np.testing.assert_allclose(columns["time"], np.arange(800) / 1000.0, rtol=1e-12)
    np.testing.assert_allclose(columns["force"], STIFFNESS * bent, rtol=1e-6, atol=1e-18)
    np.testing.assert_allclose(columns["tip position"], height - bent, atol=1e-12)
    assert "SpringConstant: 0.05" in [text for _, text in table.comments]
    run = nf.read(tmp_path / "a.any", test="indentation")
    assert np.argmax(run.depth) == pytest.approx(399.5, abs=1)


def test_waves_of_igor_without_labels(tmp_path):
    (tmp_path / "a.ibw").write_bytes(igor_wave(1e-3 * np.arange(500.0), 2e-3, "N"))
    columns, table = columns_of(tmp_path / "a.ibw")
    assert table.headers == ["time", "made_by_hand"] and table.units == ["s", "N"]
    np.testing.assert_allclose(columns["made_by_hand"], 1e-3 * np.arange(500), rtol=1e-6)
    run = nf.read(tmp_path / "a.ibw", speed=10e-3, columns={"force": "made_by_hand"})
    np.testing.assert_allclose(run.depth, 10e-3 * 2e-3 * np.arange(500), atol=1e-12)


def test_an_old_wave_of_igor(tmp_path):
    """Version 2 of the format: one vector, with its scale in the header."""
    content = (1e-3 * np.arange(500.0)).astype("<f4").tobytes()
    wave = struct.pack("<hi20shhi4s4sih2d", 2, 0, b"old", 0, 0, 0, b"N", b"s", 500, 0, 4e-3, 0.0).ljust(110, b"\0")

    def head(checksum):
        return struct.pack("<hiiih", 2, 110 + len(content) + 16, 0, 0, checksum)

    words = np.frombuffer(head(0) + wave, "<i2").astype(int).sum()
    checksum = int(np.array(-words).astype(np.int16))
    (tmp_path / "a.ibw").write_bytes(head(checksum) + wave + content + bytes(16))
    columns, table = columns_of(tmp_path / "a.ibw")
    assert table.headers == ["time", "old"] and table.units == ["s", "N"]
    np.testing.assert_allclose(columns["time"], 4e-3 * np.arange(500), rtol=1e-12)
    np.testing.assert_allclose(columns["old"], 1e-3 * np.arange(500), rtol=1e-6)


@pytest.mark.parametrize("cut", [20, 100, 384, 500])
def test_a_truncated_wave_of_igor_is_refused(tmp_path, cut):
    (tmp_path / "a.ibw").write_bytes(igor_wave(np.arange(500.0), 2e-3, "N")[:cut])
    with pytest.raises(nf.InputError):
        nf.read(tmp_path / "a.ibw", columns={"force": 1})


def nanosurf_example():
    """A map of 100 force curves that the library's makers ship with it."""
    pytest.importorskip("NSFopen")
    return importlib.resources.files("NSFopen") / "example" / "Force_Spectroscopy" / "spectroscopy.nid"


def raw_channels(content, lines=100, points=1024):
    """Deflection and height of the ways forward and backward: the first four of the arrays after the header, in 32 bits
    over the range that the header states."""
    start = content.index(b"#!") + 2
    ranges = {"deflection": (-1.99075e-06, 3.9815e-06), "height": (-1.4e-05, 2.8e-05)}
    for number, name in enumerate(("deflection", "height", "deflection", "height")):
        counts = np.frombuffer(content, "<i4", lines * points, start + 4 * number * lines * points)
        low, span = ranges[name]
        yield (low + span * (counts.astype(float) / 2.0**32 + 0.5)).reshape(lines, points)


def test_nanosurf():
    path = nanosurf_example()
    tables = tables_of(path)
    assert len(tables) == 100 and tables[6].name == "curve 7"
    force_in, height_in, force_out, height_out = (each[0] for each in raw_channels(path.read_bytes()))
    columns = {header: tables[0].read_column(k) for k, header in enumerate(tables[0].headers)}
    np.testing.assert_allclose(columns["force"], [*force_in, *force_out[::-1]], atol=1e-15)
    np.testing.assert_allclose(columns["Z-Axis Sensor"], [*height_in, *height_out[::-1]], atol=1e-14)
    tip = columns["Z-Axis Sensor"] - columns["force"] / 2.72436
    np.testing.assert_allclose(columns["tip position"], tip, rtol=1e-12)
    np.testing.assert_allclose(columns["time"], np.arange(2048) / 1024.0, atol=1e-12)  # 1 s each way
    assert len(nf.read_all(path, part="curve 1*", test="indentation")) == 12


def test_what_needs_an_extra_names_it(tmp_path, monkeypatch):
    jpk(tmp_path / "a.curve")
    monkeypatch.setitem(sys.modules, "afmformats", None)
    with pytest.raises(nf.InputError, match=r"package afmformats.*needleforce\[labs\]"):
        nf.read(tmp_path / "a.curve")


def test_tdm_files_are_named(tmp_path):
    (tmp_path / "a.tdm").write_text('<?xml version="1.0" encoding="UTF-8"?>\n<usi:tdm xmlns:usi="http://www.ni.com">\n')
    with pytest.raises(nf.InputError, match=r"TDM file.*Save it as TDMS"):
        nf.read(tmp_path / "a.tdm")
