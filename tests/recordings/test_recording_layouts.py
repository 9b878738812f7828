# SPDX-License-Identifier: Apache-2.0
import hashlib

import numpy as np
import pytest
from plain_insertion import insertion, text

from needleforce.recording import read

TIME, DEPTH, FORCE = insertion(rate=50.0)
COLUMNS = {"time_s": TIME, "depth_mm": DEPTH * 1e3, "force_N": FORCE}


@pytest.mark.parametrize(
    "dress",
    [
        {}, {"delimiter": ";"}, {"delimiter": "\t"}, {"delimiter": " "}, {"delimiter": "   "},
        {"delimiter": ";", "decimal": ","}, {"delimiter": "\t", "decimal": ","}, {"end": "\r\n"},
        {"above": "\ufeff"}, {"above": "# made by hand, with commas; and more\n\n# rig: bench\n"},
        {"above": "\ufeff# x\r\n", "end": "\r\n", "delimiter": ";", "decimal": ","},
    ],
)  # fmt: skip
def test_every_layout_gives_the_same_values(file, dress):
    run = read(file(text(COLUMNS, **dress)))
    np.testing.assert_array_equal(run.time, TIME)
    np.testing.assert_allclose(run.depth, DEPTH, rtol=1e-15)
    np.testing.assert_array_equal(run.force, FORCE)
    assert all(array.dtype == float and array.flags.c_contiguous and array.flags.writeable
               for array in (run.time, run.depth, run.velocity, run.force))  # fmt: skip


def test_numpys_commented_header(tmp_path):
    np.savetxt(tmp_path / "run.txt", np.column_stack(list(COLUMNS.values())), "%.17g", header="time_s depth_mm force_N")
    np.testing.assert_array_equal(read(tmp_path / "run.txt").force, FORCE)


def test_comments_and_blank_lines_between_the_rows(file):
    lines = text(COLUMNS).splitlines()
    run = read(file("\n".join([*lines[:9], "# paused, here", "", *lines[9:], ""])))
    np.testing.assert_array_equal(run.force, FORCE)


def test_text_in_an_unused_column_is_accepted(file):
    lines = [line + f",run {i}" for i, line in enumerate(text(COLUMNS).splitlines())]
    np.testing.assert_array_equal(read(file("\n".join(lines))).force, FORCE)


def test_a_header_in_latin_1(file):
    content = text({"time [µs]": TIME * 1e6, "depth_mm": DEPTH * 1e3, "force_N": FORCE})
    run = read(file(content.encode("latin-1")))
    np.testing.assert_allclose(run.time, TIME, rtol=1e-15)


def test_a_large_file_is_read_in_chunks(file, monkeypatch):
    monkeypatch.setattr("needleforce.recording.formats.text_rows._CHUNKED_BYTES", 0)
    monkeypatch.setattr("needleforce.recording.formats.mixed_text._CHUNK_ROWS", 77)
    np.testing.assert_array_equal(read(file(text(COLUMNS))).force, FORCE)


def test_the_card_names_the_file_and_its_hash(file):
    path = file(text(COLUMNS, above="# needle: 18 gauge\n# tissue: agar\n# rig: bench\n# filter_length: 10\n"))
    card = read(path).card
    assert (card.source, card.needle, card.tissue, card.rig) == (str(path), "18 gauge", "agar", "bench")
    assert card.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert card.filter_length == 10
    assert read(path, filter_length=4).card.filter_length == 4
