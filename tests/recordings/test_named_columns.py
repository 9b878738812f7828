# SPDX-License-Identifier: Apache-2.0
"""Names and units of columns in lines above a table without a row of headers; files by hand."""

import numpy as np
import pytest

import needleforce as nf

TIME = np.arange(3000) / 1000.0
DEPTH = np.clip(10.0 * (TIME - 0.5), 0.0, 20.0)  # [mm]
FORCE = 0.05 * np.clip(DEPTH - 5.0, 0.0, None)  # [N]


def rows(*columns, sep="\t"):
    return "\n".join(sep.join(f"{value:.6f}" for value in row) for row in zip(*columns, strict=True)) + "\n"


def check(run, first=0.0):
    np.testing.assert_allclose(run.time - run.time[0], TIME, atol=1e-9)
    np.testing.assert_allclose(1e3 * run.depth, DEPTH, atol=1e-5)
    np.testing.assert_allclose(run.force, FORCE, atol=1e-5)


KEYED = "Interval=\t0.001 s\nChannelTitle=\tForce\tPosition\nRange=\t10.000 V\t5.000 V\n"
KEYED += "UnitName=\tmN\tmm\nTopValue=\t5000\t50\nBottomValue=\t-5000\t-50\n"


@pytest.mark.parametrize("above", [KEYED, KEYED.replace("TopValue=\t5000\t50\nBottomValue=\t-5000\t-50\n", "")])
def test_lines_that_begin_with_a_key_name_the_columns_but_the_first(file, above):
    path = file(above + rows(TIME, 1e3 * FORCE, DEPTH))
    with pytest.raises(nf.InputError, match=r"'1', 'Force', 'Position'.*--column time=1"):
        nf.read(path)
    check(nf.read(path, columns={"time": 1}))


def test_a_block_for_each_recording_has_its_own_names(file):
    path = file(2 * (KEYED + rows(TIME, 1e3 * FORCE, DEPTH)))
    runs = nf.read_all(path, columns={"time": 1})
    assert len(runs) == 2
    for run in runs:
        check(run)


@pytest.mark.parametrize(
    "lines",
    [
        "# SAMPLE_TIME = 0.001\n# NAME0 = Position (mm)\n# NAME1 = Force (N)\n# END_HEADER\n",
        "Sampling rate: 1000 Hz\nChannel 1: Position [mm]\nChannel 2: Force [N]\n\n",
        "% fs: 1000 Hz\n% 1: stage position (mm)\n% 2: axial force (N)\n",
        "Abtastrate: 1000 Hz\nKanal 1 = Weg\nKanal 1 Einheit = mm\nKanal 2 = Kraft\nKanal 2 Einheit = N\n",
        "dt = 0.001 s\nCh1 Name: Depth\nCh2 Name: Load\nUnit1: mm\nUnit2: N\n",
    ],
)
def test_numbered_lines_name_the_columns(file, lines):
    run = nf.read(file(lines + rows(DEPTH, FORCE)))
    check(run)
    assert any("1000 Hz, as the file states" in each for each in run.card.assumptions)


@pytest.mark.parametrize(
    "lines",
    [
        "Channel 1: 5.0\nChannel 2: 0.2\n",  # settings
        "Channel 1: Force\n",  # of two columns
        "Channel 1: Force\nChannel 1: Depth\nChannel 2: Load\n",  # contradiction
        "1: prepare the sample\n2: start the machine\n",  # instructions, not marked as a comment
    ],
)
def test_other_lines_name_none(file, lines):
    with pytest.raises(nf.InputError, match="has no header"):
        nf.read(file(lines + rows(DEPTH, FORCE)))


def test_headers_right_above_the_numbers_come_first(file):
    lines = "Channel 1: load cell\nChannel 2: encoder\nChannel 3: trigger\nTime [s]\tPosition [mm]\tForce [N]\n"
    check(nf.read(file(lines + rows(TIME, DEPTH, FORCE))))
