# SPDX-License-Identifier: Apache-2.0
"""Formats by their first bytes, whatever the name; those that are recognised and not read say how to export."""

import zipfile

import pytest

from needleforce.errors import InputError
from needleforce.recording.formats.detect import TEXT, format_of, tables_of


def zipped(path, *names):
    with zipfile.ZipFile(path, "w") as archive:
        for name in names:
            archive.writestr(name, "a")
    return path.read_bytes()


@pytest.mark.parametrize("start, name, step", [
    (b"[DataSet]\r\nVersion=2\r\n", "Nanosurf", "CSV or ASCII"),
    (b"\\*Force file list\r\n\\Version: 1\r\n\x1a\0\0\x01", "NanoScope", "ASCII text"),
    (b"\\*File list\r\n\x1a\0\0\x01", "NanoScope", "ASCII text"),
    (b"SQLite format 3\0", "database", "name the bag's folder"),
])  # fmt: skip
def test_what_is_not_read_is_named_with_the_way_to_export_it(tmp_path, start, name, step):
    (tmp_path / "x.csv").write_bytes(start)
    with pytest.raises(InputError, match=rf"{name}.*{step}"):
        tables_of(tmp_path / "x.csv")


def test_archives(tmp_path):
    path = tmp_path / "x.jpk-force"
    zipped(path, "header.properties", "segments/0/channels/height.dat")
    with pytest.raises(InputError, match=r"JPK force curve.*export it as text"):
        tables_of(path)
    zipped(path, "a.txt")
    with pytest.raises(InputError, match=r"zip archive.*Unpack it"):
        tables_of(path)


@pytest.mark.parametrize("start", [
    b"", b"time,force\n0,1\n", b"\\*Force file list\r\n\\Version: 1\r\ntime force\r\n0 1\r\n", b"\0" * 64,
    b"\xff\xfet\0i\0", b"\0\0\0\0\5\0\0\0\1\0\0\0\0\0\0\0\5\0\0\0ti e\0", b"[1, 2]", b"[DataSet",
])  # fmt: skip
def test_what_has_no_mark_is_text(tmp_path, start):
    (tmp_path / "x").write_bytes(start)
    assert format_of(tmp_path / "x") == TEXT


@pytest.mark.parametrize(
    "start", [b'{"a": 1}\n', b'\xef\xbb\xbf{"a"', b'[{"a": 1}]', b'[\n  {\n    "a": 1', b'\n\n {"a":']
)
def test_json_is_known_by_its_first_object(tmp_path, start):
    (tmp_path / "x.txt").write_bytes(start)
    assert format_of(tmp_path / "x.txt").name == "JSON"
